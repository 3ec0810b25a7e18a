#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {
namespace {

using std::numbers::pi;
constexpr double apex = 447.0;    // z of the tops of the lungs [mm]
constexpr double lung_gap = 2.5;  // between a lung and what it lies against [mm]

/// Middle, axis and half-axes of an ellipsoid about that axis.
struct Chamber {
    Vec3 centre, axis;
    double along, across;
    double fraction(const Vec3& p) const {  // 1 on the surface
        const Vec3 d = p - centre;
        const double a = d.dot(axis), c2 = d.squaredNorm() - a * a;
        return std::sqrt(a * a / (along * along) + c2 / (across * across));
    }
};

/// The heart's chambers, relative to the valve as the coronary arteries run on them. From in front their
/// outline is, on the right, the right atrium; on the left, from above, the auricle and the left ventricle.
struct Heart {
    Vec3 middle;
    std::array<Chamber, 5> chambers;

    static Heart standard() {
        const Vec3 valve = place_in_body(geometry::Landmark::AorticValve);
        const auto chamber = [&](const Vec3& off, const Vec3& axis, double along, double across) {
            return Chamber{valve + off, axis.normalized(), along, across};
        };
        return {valve + Vec3(14, 4, -28),
                {chamber(Vec3(37, 8, -35), Vec3(0.74, -0.36, -0.57), 68, 41),   // left ventricle
                 chamber(Vec3(14, -3, -38), Vec3(0.90, -0.20, -0.38), 56, 38),  // right ventricle
                 chamber(Vec3(-9, 12, -24), Vec3(0.10, 0.10, 1.00), 46, 34),    // right atrium
                 chamber(Vec3(10, 33, -8), Vec3(1.00, 0.00, 0.10), 38, 30),     // left atrium
                 chamber(Vec3(34, 2, 4), Vec3(0.50, -0.20, 0.85), 33, 21)}};    // auricle, outflow tract
    }
    /// Less than 1 inside; the parts are blended.
    double fraction(const Vec3& p) const {
        constexpr double k = 0.12;
        double least = chambers.front().fraction(p);
        for (std::size_t i = 1; i < chambers.size(); ++i) {
            const double own = chambers[i].fraction(p),
                         h = std::clamp(0.5 + 0.5 * (own - least) / k, 0.0, 1.0);
            least = own + h * (least - own) - k * h * (1.0 - h);
        }
        return least;
    }
};

/// The dome of one side of the diaphragm: its top, and the depth of the sulcus around it.
struct Dome {
    Side side;
    double top() const { return side.sign > 0.0 ? 226.0 : 237.0; }
    double height(double x, double y) const {
        const double across = (side.sign * x - 66.0) / 66.0, along = (y + 12.0) / 104.0;
        const double rim = 186.0 - 18.0 * std::clamp(along, -1.0, 1.0);
        const double fraction = std::max(0.0, 1.0 - across * across - along * along);
        return rim + (top() - rim) * std::pow(fraction, 0.75);
    }
};

/// Half the width of the vertebral bodies at a height [mm].
double half_width_of_spine(double z) {
    const auto column = vertebrae();
    std::size_t i = 1;
    while (i + 1 < column.size() && z > column[i].z) ++i;
    const double t = std::clamp((z - column[i - 1].z) / (column[i].z - column[i - 1].z), 0.0, 1.0);
    return column[i - 1].half_width + t * (column[i].half_width - column[i - 1].half_width);
}

/// How far from the midline the mediastinum reaches: vertebrae, oesophagus and trachea, great vessels; thin
/// behind the sternum.
double mediastinum(Side side, double y, double z, double cage_front) {
    const double front = spine_front(z), behind_sternum = y - cage_front;
    const auto hump = [z](double middle, double reach) {
        return std::exp(-std::pow((z - middle) / reach, 2.0));
    };
    // Pulmonary trunk and hilum on the left; superior vena cava down to the atrium on the right.
    const double trunk = side.sign > 0.0 ? 19.0 * hump(322.0, 26.0) + 6.0 * hump(420.0, 30.0)
                                         : 12.0 * hump(330.0, 55.0) + 9.0 * hump(405.0, 45.0);
    const auto rise = [](double from, double to, double at) {
        const double t = std::clamp((at - from) / (to - from), 0.0, 1.0);
        return t * t * (3.0 - 2.0 * t);
    };
    const double thin = std::clamp((behind_sternum - 8.0) / 25.0, 0.0, 1.0);
    // Lungs lie close to the vertebral bodies; further back are the necks of ribs and transverse processes.
    const double uneven = 2.2 * shape::noise(Vec3(40.0 * side.sign, 0.6 * y, z), 38.0, 5) +
                          0.9 * shape::noise(Vec3(40.0 * side.sign, y, z), 14.0, 6);
    const double before = 7.0 + std::max(18.0 * rise(380.0, 398.0, z), thin * (15.0 + trunk + uneven)),
                 beside = half_width_of_spine(z) + 8.5 + uneven;
    const double ahead = before + rise(front - 8.0, front + 8.0, y) * (beside - before);
    return ahead + rise(front + 16.0, front + 52.0, y) * (52.0 + uneven - ahead);
}

/// The last point, up to `reach`, before a ray leaves the region where `inside` holds.
double first_exit(double reach, double step, const std::function<bool(double)>& inside) {
    double held = 0.0;
    while (held + step < reach && inside(held + step)) held += step;
    double out = held + step;
    for (int k = 0; k < 7; ++k) {
        const double middle = 0.5 * (held + out);
        (inside(middle) ? held : out) = middle;
    }
    return held;
}

/// One lung: the part of a half of the rib cage that heart, vessels, mediastinum and diaphragm leave free.
class Lung {
public:
    Lung(const Chest& chest, Side side) : chest_(chest), side_(side), dome_{side} {
        for (const VesselSample& vessel : chest.vessels) {
            if (vessel.radius > 2.0 && vessel.place.z() > 140.0 && vessel.place.z() < apex + 20.0)
                vessels_.push_back(vessel);
        }
    }

    bool holds(const Vec3& p, double gap = lung_gap) const {
        if (p.z() < dome_.height(p.x(), p.y()) + gap || p.z() > apex) return false;
        const CageSection cage = chest_.section(p.z());
        if (!cage.holds(p.x(), p.y(), gap - lung_gap)) return false;
        if (side_.sign * p.x() <
            mediastinum(side_, p.y(), p.z(), cage.middle - cage.half_depth) + gap - lung_gap)
            return false;
        if (heart_.fraction(p) < 1.0 + gap / 50.0) return false;
        return std::none_of(vessels_.begin(), vessels_.end(), [&](const VesselSample& vessel) {
            return (p - vessel.place).squaredNorm() < std::pow(vessel.radius + gap, 2);
        });
    }

    TriangleMesh mesh() const {
        constexpr double cell = 4.0, blend = 5.0;
        shape::Compound lung;
        lung.add(lung_space(chest_, side_));
        lung.cut({[heart = heart_](const Vec3& p) { return 40.0 * (heart.fraction(p) - 1.0) - lung_gap; },
                  {Vec3(-110, -160, 150), Vec3(120, 60, 380)}},
                 blend);
        for (const VesselSample& vessel : vessels_) {
            if (side_.sign * vessel.place.x() > -vessel.radius - lung_gap)
                lung.cut(shape::ball(vessel.place, vessel.radius + lung_gap), blend);
        }
        return shape::polygonised(lung, cell).outer;
    }

private:
    const Chest& chest_;
    Side side_;
    Dome dome_;
    Heart heart_ = Heart::standard();
    std::vector<VesselSample> vessels_;
};

/// Arteries and veins of a lung: trees that divide its points among their branches, from trunks at the hilum.
/// Radii follow Murray's law with the exponent 2.4 (estimate) from 0.6 mm at the ends.
class LungVessels {
public:
    LungVessels(const Lung& lung, Side side, std::uint64_t seed) : lung_(lung), random_(seed) {
        constexpr int ends = 100;
        for (const double lower : {0.0, 16.0}) {
            const Vec3 hilum = side.at(40.0, spine_front(335.0) - 20.0 - lower, 336.0 - 1.6 * lower);
            std::vector<Vec3> points;
            for (int tries = 0; tries < 60 * ends && static_cast<int>(points.size()) < ends; ++tries) {
                const double x = random_.between(20.0, 135.0), y = random_.between(-125.0, 85.0),
                             z = random_.between(172.0, 440.0);
                const Vec3 p = side.at(x, y, z);
                if (lung_.holds(p, lung_gap + 4.0)) points.push_back(p);
            }
            if (!points.empty()) grow(std::move(points), hilum);
        }
    }
    TriangleMesh mesh() && { return std::move(mesh_); }

private:
    void grow(std::vector<Vec3> points, const Vec3& from) {
        Vec3 middle = Vec3::Zero();
        for (const Vec3& p : points) middle += p / static_cast<double>(points.size());
        const bool last = points.size() == 1;
        const Vec3 to = last ? middle : Vec3(from + random_.between(0.32, 0.5) * (middle - from));
        draw(from, to, 0.6 * std::pow(static_cast<double>(points.size()), 1.0 / 2.4));
        if (last) return;
        // Divides across the direction in which the points spread most.
        Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
        for (const Vec3& p : points) spread += (p - middle) * (p - middle).transpose();
        const Vec3 widest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
        std::sort(points.begin(), points.end(),
                  [&](const Vec3& a, const Vec3& b) { return a.dot(widest) < b.dot(widest); });
        const auto count = static_cast<double>(points.size());
        const auto cut =
            std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(random_.between(0.3, 0.7) * count), 1,
                                       static_cast<std::ptrdiff_t>(points.size()) - 1);
        grow({points.begin(), points.begin() + cut}, to);
        grow({points.begin() + cut, points.end()}, to);
    }

    void draw(const Vec3& from, const Vec3& to, double radius) {
        const double length = (to - from).norm();
        if (length < 2.0) return;
        const double y = random_.between(-1, 1), x = random_.between(-1, 1);
        const Vec3 aside = (to - from).cross(Vec3(x, y, 0.5)) * 0.10;
        constexpr int pieces = 4;
        Polyline path;
        for (int k = 0; k <= pieces; ++k) {
            const double t = static_cast<double>(k) / pieces;
            const Vec3 p = from + t * (to - from) + 4.0 * t * (1.0 - t) * aside;
            if (lung_.holds(p, lung_gap + radius + 1.5))
                path.push_back(p);
            else if (!path.empty())
                break;
        }
        if (path.size() < 2) return;
        const std::vector<double> radii(path.size(), radius);
        append(mesh_, tube(path, Vec3(0.31, 0.83, 0.46), radii, radii, radius > 1.5 ? 8 : 5));
    }

    const Lung& lung_;
    geometry::Random random_;
    TriangleMesh mesh_;
};

/// Muscle under the lung's base, 4 mm thick.
TriangleMesh dome(const Chest& chest, Side side) {
    const Dome shape{side};
    constexpr int around = 48, rings = 10;
    std::vector<Polyline> upper, lower;
    for (int i = 1; i <= rings; ++i) {
        Polyline top, bottom;
        for (int k = 0; k < around; ++k) {
            const double angle = 2.0 * pi * k / around, fraction = 0.94 * i / rings;
            const double x = side.sign * 66.0 + fraction * 64.0 * std::cos(angle),
                         y = -12.0 + fraction * 102.0 * std::sin(angle);
            const double z = shape.height(x, y);
            const CageSection cage = chest.section(z);
            // Drawn inward where the cage is narrower.
            const double inward = std::min(
                1.0,
                0.97 / std::max(1e-3, std::pow(std::pow(std::abs(x) / cage.half_width, 2.3) +
                                                   std::pow(std::abs(y - cage.middle) / cage.half_depth, 2.3),
                                               1.0 / 2.3)));
            const double px = inward * x, py = cage.middle + inward * (y - cage.middle);
            const double pz = shape.height(px, py);
            top.push_back({px, py, pz});
            bottom.push_back({px, py, pz - 4.0});
        }
        upper.push_back(std::move(top));
        lower.push_back(std::move(bottom));
    }
    upper.insert(upper.end(), lower.rbegin(), lower.rend());
    return loft(upper);
}

TriangleMesh heart() {
    const Heart shape = Heart::standard();
    const Vec3 centre = shape.middle;
    return star(
        centre,
        [&](const Vec3& direction) {
            return first_exit(120.0, 4.0,
                              [&](double r) { return shape.fraction(centre + r * direction) < 1.0; });
        },
        56);
}

/// Larynx, trachea and main bronchi.
TriangleMesh airway() {
    const auto before = [](double x, double z, double gap) -> Vec3 { return {x, spine_front(z) - gap, z}; };
    TriangleMesh air = tube({before(0, 492, 20), before(0, 470, 19), before(0, 440, 19), before(0, 400, 18),
                             before(1, 372, 18), before(1, 360, 18)},
                            Vec3::UnitX(), {6, 8.5, 8.5, 8.5, 9.5, 8}, {8, 8, 8, 8, 8, 6}, 20);
    append(air, tube({before(-5, 357, 18), before(-14, 344, 18), before(-23, 330, 17)}, Vec3::UnitY(),
                     {6, 6.5, 5}, {6, 6.5, 5}, 16));
    append(air, tube({before(7, 357, 18), before(17, 348, 18), before(27, 338, 17)}, Vec3::UnitY(),
                     {5, 5.5, 4.5}, {5, 5.5, 4.5}, 16));
    return air;
}

}  // namespace

shape::Solid lung_space(const Chest& chest, Side side) {
    shape::Solid space;
    space.distance = [&chest, side, dome = Dome{side}](const Vec3& p) {
        const CageSection cage = chest.section(p.z());
        const double n = CageSection::exponent;
        const double qx = std::max(std::abs(p.x()) / cage.half_width, 1e-6),
                     qy = std::max(std::abs(p.y() - cage.middle) / cage.half_depth, 1e-6);
        const double px = std::pow(qx, n - 1.0), py = std::pow(qy, n - 1.0), sum = px * qx + py * qy;
        const double k0 = std::pow(sum, 1.0 / n);
        const double slope = std::hypot(px / cage.half_width, py / cage.half_depth) * k0 / sum;
        const double around = 0.85 * (k0 - 1.0) / slope;
        const double above = 0.7 * (dome.height(p.x(), p.y()) + lung_gap - p.z());
        const double beside =
            0.85 * (mediastinum(side, p.y(), p.z(), cage.middle - cage.half_depth) - side.sign * p.x());
        return std::max({around, above, beside, p.z() - apex});
    };
    space.box = side.sign > 0.0 ? Eigen::AlignedBox3d(Vec3(0, -160, 150), Vec3(140, 90, apex))
                                : Eigen::AlignedBox3d(Vec3(-140, -160, 150), Vec3(0, 90, apex));
    return space;
}

void add_chest_layers(std::vector<TissueLayer>& layers, const Chest& chest, const Chance& chance) {
    TriangleMesh vessels, muscle;
    for (const Side side : {left, right}) {
        const Lung lung(chest, side);
        layers.push_back({side.sign > 0.0 ? "left lung" : "right lung", Material::Lung, Material::SoftTissue,
                          lung.mesh(), false});
        append(vessels,
               LungVessels(lung, side, chance.field("lung vessels", side.sign > 0.0 ? 0 : 1)).mesh());
        append(muscle, dome(chest, side));
    }
    layers.push_back({"lung vessels", Material::Blood, Material::Lung, std::move(vessels), false});
    layers.push_back({"heart", Material::SoftTissue, Material::SoftTissue, heart(), false});
    layers.push_back({"diaphragm", Material::SoftTissue, Material::SoftTissue, std::move(muscle), false});
    layers.push_back({"airway", Material::Air, Material::SoftTissue, airway(), false});
}

}  // namespace render
