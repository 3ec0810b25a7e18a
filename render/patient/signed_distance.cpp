#include "render/patient/signed_distance.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "physics/geometry/random.h"

namespace render::shape {

using Eigen::AlignedBox3d;
using Eigen::Matrix3d;
using geometry::Vec3;

namespace {

AlignedBox3d box_around(const Vec3& centre, const Vec3& half) {
    return {centre - half, centre + half};
}

AlignedBox3d inflated(AlignedBox3d box, double by) {
    box.min().array() -= by;
    box.max().array() += by;
    return box;
}

/// Smooth minimum (Quilez' polynomial), and the fraction of the second argument in it.
std::pair<double, double> smooth_min(double a, double b, double blend) {
    if (blend <= 0.0 || std::abs(a - b) >= blend) return b < a ? std::pair{b, 1.0} : std::pair{a, 0.0};
    const double h = 0.5 + 0.5 * (a - b) / blend;
    return {a + h * (b - a) - blend * h * (1.0 - h), h};
}

/// Distance from the surface of an ellipsoid to first order; x: local coordinates.
double ellipsoid_distance(const Vec3& x, const Vec3& half) {
    const Vec3 q = x.cwiseQuotient(half);
    const double k0 = q.norm(), k1 = q.cwiseQuotient(half).norm();
    return k1 < 1e-9 ? -half.minCoeff() : std::max(k0 * (k0 - 1.0) / k1, -half.minCoeff());
}

}  // namespace

Solid ellipsoid(const Vec3& centre, const Vec3& half, const Matrix3d& axes) {
    const Vec3 reach = (axes.cwiseAbs2() * half.cwiseAbs2()).cwiseSqrt();
    return {[=](const Vec3& p) { return ellipsoid_distance(axes.transpose() * (p - centre), half); },
            box_around(centre, reach)};
}

Solid ball(const Vec3& centre, double radius) {
    return {[=](const Vec3& p) { return (p - centre).norm() - radius; },
            box_around(centre, Vec3::Constant(radius))};
}

Solid cone(const Vec3& from, const Vec3& to, double radius_from, double radius_to) {
    AlignedBox3d box = box_around(from, Vec3::Constant(radius_from));
    box.extend(box_around(to, Vec3::Constant(radius_to)));
    const Vec3 axis = to - from;
    const double square = axis.squaredNorm();
    return {[=](const Vec3& p) {
                const double t = std::clamp((p - from).dot(axis) / square, 0.0, 1.0);
                return (p - from - t * axis).norm() - (radius_from + t * (radius_to - radius_from));
            },
            box};
}

Solid block(const Vec3& centre, const Vec3& half, double rounding, const Matrix3d& axes) {
    const Vec3 reach = axes.cwiseAbs() * half;
    return {[=](const Vec3& p) {
                const Vec3 q = (axes.transpose() * (p - centre)).cwiseAbs() - half + Vec3::Constant(rounding);
                return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - rounding;
            },
            box_around(centre, reach)};
}

Solid half_space(const Vec3& at, const Vec3& normal) {
    const Vec3 n = normal.normalized();
    return {[=](const Vec3& p) { return n.dot(p - at); }, box_around(at, Vec3::Constant(1e4))};
}

Solid sweep(const std::vector<Station>& stations, const Vec3& u, double exponent,
            std::function<double(double, double)> inset) {
    assert(stations.size() >= 2);
    constexpr int pieces = 4;
    struct Joint {
        Vec3 at = Vec3::Zero(), u = Vec3::Zero(), v = Vec3::Zero(), along = Vec3::Zero(), axis = Vec3::Zero();
        double a = 0.0, b = 0.0, length = 0.0, inverse = 0.0;
    };
    std::vector<Joint> joints;
    const int count = static_cast<int>(stations.size());
    for (int i = 0; i + 1 < count; ++i) {
        const Station &before = stations[std::max(i - 1, 0)], &from = stations[i], &to = stations[i + 1],
                      &after = stations[std::min(i + 2, count - 1)];
        for (int k = i == 0 ? 0 : 1; k <= pieces; ++k) {
            const double t = static_cast<double>(k) / pieces, t2 = t * t, t3 = t2 * t;
            const Vec3 start = i == 0 ? Vec3(to.at - from.at) : Vec3(0.5 * (to.at - before.at)),
                       end = i + 2 == count ? Vec3(to.at - from.at) : Vec3(0.5 * (after.at - from.at));
            const double s = t2 * (3.0 - 2.0 * t);
            Joint joint;
            joint.at = (2 * t3 - 3 * t2 + 1) * from.at + (t3 - 2 * t2 + t) * start +
                       (3 * t2 - 2 * t3) * to.at + (t3 - t2) * end;
            joint.a = from.a + s * (to.a - from.a);
            joint.b = from.b + s * (to.b - from.b);
            joints.push_back(joint);
        }
    }
    AlignedBox3d box;
    const int last = static_cast<int>(joints.size()) - 1;
    for (int i = 0; i <= last; ++i) {
        Joint& joint = joints[i];
        if (i > 0) joint.length = joints[i - 1].length + (joint.at - joints[i - 1].at).norm();
        joint.along = (joints[std::min(i + 1, last)].at - joints[std::max(i - 1, 0)].at).normalized();
        joint.u = (u - u.dot(joint.along) * joint.along).normalized();
        joint.v = joint.along.cross(joint.u);
        joint.axis = joints[std::min(i + 1, last)].at - joint.at;
        joint.inverse = 1.0 / std::max(joint.axis.squaredNorm(), 1e-12);
        box.extend(box_around(joint.at, Vec3::Constant(std::max(joint.a, joint.b))));
    }
    if (inset) box = inflated(box, 0.1 * box.sizes().minCoeff());  // it may bulge
    return {[joints = std::move(joints), exponent, inset = std::move(inset)](const Vec3& p) {
                double least = 1e300, part = 0.0;
                std::size_t nearest = 0;
                for (std::size_t i = 0; i + 1 < joints.size(); ++i) {
                    const Joint& joint = joints[i];
                    const Vec3 x = p - joint.at;
                    const double t = std::clamp(x.dot(joint.axis) * joint.inverse, 0.0, 1.0);
                    const double square = (x - t * joint.axis).squaredNorm();
                    if (square < least) least = square, nearest = i, part = t;
                }
                const Joint &low = joints[nearest], &high = joints[nearest + 1];
                const Vec3 x = p - low.at - part * (high.at - low.at);
                const Vec3 across = low.u + part * (high.u - low.u), up = low.v + part * (high.v - low.v),
                           along = low.along + part * (high.along - low.along);
                const double a = low.a + part * (high.a - low.a), b = low.b + part * (high.b - low.b),
                             c = std::min(a, b);
                const Vec3 local(x.dot(across), x.dot(up), x.dot(along)), half(a, b, c);
                const double drawn_in = inset ? inset(low.length + part * (high.length - low.length),
                                                      std::atan2(local.y(), local.x()))
                                              : 0.0;
                if (exponent == 2.0) return ellipsoid_distance(local, half) + drawn_in;
                const Vec3 q = local.cwiseQuotient(half).cwiseAbs().cwiseMax(1e-9);
                const Vec3 powers(std::pow(q.x(), exponent - 1), std::pow(q.y(), exponent - 1), q.z());
                const double sum = powers.x() * q.x() + powers.y() * q.y() + powers.z() * q.z();
                const double k0 = std::pow(sum, 1.0 / exponent);
                const double slope = powers.cwiseQuotient(half).norm() * k0 / std::max(sum, 1e-12);
                return std::max((k0 - 1.0) / std::max(slope, 1e-9), -c) + drawn_in;
            },
            box};
}

Solid sheet(std::vector<Cut> cuts) {
    assert(cuts.size() >= 2);
    AlignedBox3d box;
    for (const Cut& cut : cuts)
        for (const Vec3& p : cut.points) box.extend(box_around({p.x(), p.y(), cut.z}, Vec3::Constant(p.z())));
    return {[cuts = std::move(cuts)](const Vec3& p) {
                const double z = std::clamp(p.z(), cuts.front().z, cuts.back().z);
                std::size_t i = 0;
                while (i + 2 < cuts.size() && z > cuts[i + 1].z) ++i;
                const double t = (z - cuts[i].z) / (cuts[i + 1].z - cuts[i].z);
                const double beyond = p.z() - z;
                const auto point = [&](std::size_t k) -> Vec3 {
                    return cuts[i].points[k] + t * (cuts[i + 1].points[k] - cuts[i].points[k]);
                };
                double least = 1e300;
                Vec3 from = point(0);
                for (std::size_t k = 0; k + 1 < cuts[i].points.size(); ++k) {
                    const Vec3 to = point(k + 1);
                    const double wx = to.x() - from.x(), wy = to.y() - from.y(), x = p.x() - from.x(),
                                 y = p.y() - from.y();
                    const double part = std::clamp((x * wx + y * wy) / (wx * wx + wy * wy + 1e-9), 0.0, 1.0);
                    const double away = std::hypot(x - part * wx, y - part * wy);
                    const double thick = from.z() + part * (to.z() - from.z());
                    // Sheets lean: the way to the surface is shorter than along the cut.
                    constexpr double lean = 0.88;
                    least = std::min(
                        least, beyond == 0.0 ? lean * (away - thick) : std::hypot(away, beyond) - thick);
                    from = to;
                }
                return least;
            },
            box};
}

Solid warped(Solid solid, double by, double wavelength, std::uint64_t field) {
    return {[=, own = std::move(solid.distance)](const Vec3& p) {
                const double here = own(p);
                if (std::abs(here) > 3.0 * by) return 0.75 * here;
                const Vec3 off(noise(p, wavelength, field), noise(p, wavelength, field + 1),
                               noise(p, wavelength, field + 2));
                return 0.75 * own(p + by * off);
            },
            inflated(solid.box, 1.4 * by)};
}

Solid grown(Solid solid, double by) {
    return {[own = std::move(solid.distance), by](const Vec3& p) { return own(p) - by; },
            inflated(solid.box, by)};
}

Solid moved(Solid solid, const Eigen::Isometry3d& to) {
    const Vec3 centre = to * solid.box.center();
    const Vec3 half = to.linear().cwiseAbs() * (0.5 * solid.box.sizes());
    return {[own = std::move(solid.distance), back = to.inverse()](const Vec3& p) { return own(back * p); },
            box_around(centre, half)};
}

void Compound::push(Part part) {
    widest_blend_ = std::max(widest_blend_, part.blend);
    thickest_shell_ = std::max(thickest_shell_, part.shell);
    if (part.operation == Operation::Add) box_.extend(part.solid.box);
    if (part.operation == Operation::Keep) box_ = box_.intersection(part.solid.box);
    all_.push_back(static_cast<std::uint16_t>(parts_.size()));
    parts_.push_back(std::move(part));
}

Compound& Compound::add(Solid solid, double shell, double blend) {
    push({std::move(solid), Operation::Add, blend, shell, {}});
    return *this;
}
Compound& Compound::add(Solid solid, Shell shell, double thickest, double blend) {
    push({std::move(solid), Operation::Add, blend, thickest, std::move(shell)});
    return *this;
}
Compound& Compound::cut(Solid solid, double blend) {
    push({std::move(solid), Operation::Cut, blend, 0.0, {}});
    return *this;
}
Compound& Compound::keep(Solid solid, double blend) {
    push({std::move(solid), Operation::Keep, blend, 0.0, {}});
    return *this;
}
void Compound::roughen(double contour, double rough, std::uint64_t field, double thinner) {
    thinner_ = thinner;
    contour_ = contour;
    rough_ = rough;
    field_ = field;
    thickest_shell_ = 1.6 * thickest_shell_ + 2.0 * rough;
}

double Compound::uneven_shell(const Vec3& p, double shell) const {
    if (!is_rough() || shell <= 0.0) return shell;
    // The thick walls of long bones are even.
    const double slow =
        1.0 + std::clamp(0.75 * noise(p, 19.0, field_ + 2), -0.55, 0.55) * std::min(1.0, 1.0 / shell);
    const double whole = slow * shell + rough_ * fractal(p, 10.0, 3.4, 0.4, field_ + 3);
    return std::max({whole - thinner_, 0.1 * whole, 0.06});
}
Compound& Compound::clear_of(const Compound& other, double gap) {
    for (const Part& part : other.parts_)
        if (part.operation == Operation::Add) cut(grown(part.solid, gap));
    return *this;
}

Compound Compound::grown_by(double by) const {
    Compound result;
    for (Part part : parts_) {
        if (part.operation == Operation::Add) part.solid = grown(part.solid, by);
        result.push(std::move(part));
    }
    return result;
}

Solid Compound::solid() const {
    return {[own = *this](const Vec3& p) { return own.at(p).distance; }, box_};
}

Compound::Value Compound::at(const Vec3& p, const std::vector<std::uint16_t>& parts) const {
    constexpr double far = 1e6;
    Value value{far, 0.0};
    for (const std::uint16_t index : parts) {
        const Part& part = parts_[index];
        const double own = part.solid.distance(p);
        if (part.operation == Operation::Add) {
            const auto [distance, fraction] = smooth_min(value.distance, own, part.blend);
            value.distance = distance;
            if (fraction > 0.0) {
                const double shell = part.varying ? part.varying(p) : part.shell;
                value.shell += fraction * (shell - value.shell);
            }
        } else {
            value.distance =
                -smooth_min(-value.distance, part.operation == Operation::Cut ? own : -own, part.blend).first;
        }
    }
    if (is_rough() && value.distance < 2.0 * widest_contour() &&
        value.distance > -2.0 * widest_contour() - thickest_shell_)
        value.distance += contour_ * (1.3 * noise(p, 14.0, field_) + 1.3 * noise(p, 5.6, field_ + 1));
    return value;
}

std::vector<std::uint16_t> Compound::parts_near(const AlignedBox3d& box, double margin) const {
    std::vector<std::uint16_t> near;
    bool some = false;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
        const AlignedBox3d& own = parts_[i].solid.box;
        const double square = box.squaredExteriorDistance(own);
        if (parts_[i].operation != Operation::Keep && square > margin * margin) continue;
        some = some || parts_[i].operation == Operation::Add;
        near.push_back(static_cast<std::uint16_t>(i));
    }
    if (!some) near.clear();
    return near;
}

double noise(const Vec3& p, double wavelength, std::uint64_t seed) {
    const Vec3 q = p / wavelength;
    const Vec3 floor(std::floor(q.x()), std::floor(q.y()), std::floor(q.z()));
    Vec3 f = q - floor;
    f = f.cwiseProduct(f).cwiseProduct(Vec3::Constant(3.0) - 2.0 * f);
    const auto x = static_cast<std::int64_t>(floor.x()), y = static_cast<std::int64_t>(floor.y()),
               z = static_cast<std::int64_t>(floor.z());
    const auto lattice = [seed](std::int64_t i, std::int64_t j, std::int64_t k) {
        const std::uint64_t word = static_cast<std::uint64_t>(i) * 0x9e3779b97f4a7c15ull ^
                                   static_cast<std::uint64_t>(j) * 0xc2b2ae3d27d4eb4full ^
                                   static_cast<std::uint64_t>(k) * 0x165667b19e3779f9ull ^ seed;
        return static_cast<double>(geometry::mixed(word) >> 11) * 0x1p-52 - 1.0;
    };
    double sum = 0.0;
    for (int c = 0; c < 8; ++c) {
        const double weight =
            (c & 1 ? f.x() : 1 - f.x()) * (c & 2 ? f.y() : 1 - f.y()) * (c & 4 ? f.z() : 1 - f.z());
        sum += weight * lattice(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
    }
    return 1.4 * sum;  // the interpolation narrows the spread
}

double fractal(const Vec3& p, double coarsest, double finest, double rise, std::uint64_t seed) {
    double sum = 0.0, total = 0.0;
    for (double wavelength = coarsest; wavelength >= 0.99 * finest; wavelength *= 0.5) {
        const double weight = std::pow(wavelength / coarsest, rise);
        sum += weight * noise(p, wavelength, seed = geometry::mixed(seed + 1));
        total += weight * weight;
    }
    return sum / std::sqrt(total);
}

}  // namespace render::shape
