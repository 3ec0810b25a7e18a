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
    double distance(const Vec3& p) const {
        const Vec3 d = p - centre;
        const double a = d.dot(axis), c2 = d.squaredNorm() - a * a;
        return across * (std::sqrt(a * a / (along * along) + c2 / (across * across)) - 1.0);
    }
};

/// The heart's chambers, relative to the valve as the coronary arteries run on them. From in front their
/// outline is, on the right, the right atrium between the two caval veins; on the left, from above, the
/// pulmonary trunk, the auricle and the left ventricle.
struct Heart {
    static constexpr std::size_t own = 5;  // chambers; what follows are great vessels and fat
    Vec3 middle;
    std::array<Chamber, 10> chambers;

    static Heart standard() {
        const Vec3 valve = place_in_body(geometry::Landmark::AorticValve);
        const auto chamber = [&](const Vec3& off, const Vec3& axis, double along, double across) {
            return Chamber{valve + off, axis.normalized(), along, across};
        };
        return {valve + Vec3(14, 4, -28),
                {chamber(Vec3(40, 8, -36), Vec3(0.74, -0.36, -0.57), 74, 40),   // left ventricle
                 chamber(Vec3(14, -3, -38), Vec3(0.90, -0.20, -0.38), 56, 38),  // right ventricle
                 chamber(Vec3(-11, 11, -25), Vec3(0.14, 0.10, 1.00), 50, 30),   // right atrium
                 chamber(Vec3(10, 33, -8), Vec3(1.00, 0.00, 0.10), 38, 30),     // left atrium
                 chamber(Vec3(34, 2, 4), Vec3(0.50, -0.20, 0.85), 33, 21),      // auricle, outflow tract
                 chamber(Vec3(-17, 20, 36), Vec3(0.06, 0.10, 1.00), 70, 12),    // superior caval vein
                 chamber(Vec3(-11, 20, -66), Vec3(-0.10, 0.20, 1.00), 40, 14),  // inferior caval vein
                 chamber(Vec3(25, 8, 30), Vec3(0.40, 0.75, 0.50), 32, 15),      // pulmonary trunk
                 chamber(Vec3(-26, -24, -66), Vec3(0.75, -0.35, 0.5), 34, 17),  // fat beside the heart,
                 chamber(Vec3(72, -34, -76), Vec3(0.8, -0.3, -0.4), 36, 18)}};  // on both sides
    }
    /// Negative inside; the parts are blended. `all`: great vessels and fat are parts of it.
    double distance(const Vec3& p, bool all) const {
        constexpr double blend = 9.0;  // [mm]
        double least = chambers.front().distance(p);
        for (std::size_t i = 1; i < (all ? chambers.size() : own); ++i) {
            const double next = chambers[i].distance(p),
                         h = std::clamp(0.5 + 0.5 * (next - least) / blend, 0.0, 1.0);
            least = next + h * (least - next) - 0.5 * blend * h * (1.0 - h);
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
/// behind the sternum, wider and wider toward the back, so that few rays run along its border.
double mediastinum(Side side, double y, double z, double cage_front) {
    const double front = spine_front(z), behind_sternum = y - cage_front;
    const auto hump = [z](double middle, double reach) {
        return std::exp(-std::pow((z - middle) / reach, 2.0));
    };
    // Left: knob of the aorta, pulmonary trunk and hilum, subclavian artery. Right: azygos vein and hilum,
    // brachiocephalic vessels.
    const double trunk = side.sign > 0.0
                             ? 10.0 * hump(374.0, 15.0) + 15.0 * hump(333.0, 19.0) + 7.0 * hump(425.0, 26.0)
                             : 6.0 * hump(366.0, 9.0) + 13.0 * hump(327.0, 23.0) + 8.0 * hump(415.0, 34.0);
    const auto rise = [](double from, double to, double at) {
        const double t = std::clamp((at - from) / (to - from), 0.0, 1.0);
        return t * t * (3.0 - 2.0 * t);
    };
    const double uneven = 4.6 * shape::noise(Vec3(40.0 * side.sign, y, z), 34.0, 5) +
                          1.8 * shape::noise(Vec3(40.0 * side.sign, y, z), 14.0, 6);
    const double ahead_of_spine = std::max(front - cage_front, 40.0),
                 depth = std::clamp((behind_sternum - 8.0) / (ahead_of_spine - 8.0), 0.0, 1.0);
    // Lungs lie close to the vertebral bodies; further back are the necks of ribs and transverse processes.
    const double before =
                     6.0 + std::max((15.0 + 1.8 * uneven + 5.0 * hump(400.0, 26.0)) * rise(378.0, 402.0, z),
                                    depth * (12.0 + uneven) + rise(0.1, 0.6, depth) * trunk),
                 beside = half_width_of_spine(z) + 8.5 + 0.7 * uneven;
    const double ahead = before + rise(front - 14.0, front + 8.0, y) * (beside - before);
    return ahead + rise(front + 12.0, front + 58.0, y) * (54.0 + uneven - ahead);
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
        if (heart_.distance(p, true) < gap) return false;
        return std::none_of(vessels_.begin(), vessels_.end(), [&](const VesselSample& vessel) {
            return (p - vessel.place).squaredNorm() < std::pow(vessel.radius + gap, 2);
        });
    }

    TriangleMesh mesh() const {
        constexpr double cell = 4.0, blend = 5.0;
        shape::Compound lung;
        lung.add(lung_space(chest_, side_));
        lung.cut({[heart = heart_](const Vec3& p) { return heart.distance(p, true) - lung_gap; },
                  {Vec3(-110, -160, 150), Vec3(130, 60, 412)}},
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
/// Radii follow Murray's law with an exponent of 2.3 (estimate) from 0.44 mm at the ends.
class LungVessels {
public:
    LungVessels(const Lung& lung, Side side, std::uint64_t seed) : lung_(lung), random_(seed) {
        constexpr int ends = 360;
        draw_trunks(side);
        for (const double lower : {0.0, 16.0}) {
            const Vec3 hilum = side.at(48.0, spine_front(335.0) - 18.0 - lower, 336.0 - 1.6 * lower);
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

    /// Vessels and walls of less than 0.7 mm, which run outward, and as much less between them.
    void add_finest(Side side, std::vector<TextureBlob>& blobs) {
        const Vec3 hilum = side.at(40.0, spine_front(335.0) - 20.0, 330.0);
        bool more = true;
        for (int k = 0; k < 34000; ++k) {
            const double x = random_.between(8.0, 136.0), y = random_.between(-125.0, 88.0),
                         z = random_.between(170.0, 446.0), aside = random_.between(-1, 1),
                         up = random_.between(-1, 1), chosen = random_(), length = random_.between(1.5, 6.0);
            const Vec3 p = side.at(x, y, z), out = (p - hilum).normalized();
            TextureBlob blob;
            blob.radius = static_cast<float>(0.6 + 2.3 * chosen * chosen);
            blob.elongation = static_cast<float>(length / (0.6 + 0.6 * blob.radius));
            if (!lung_.holds(p, lung_gap + 0.8 * blob.radius * std::max(1.0f, blob.elongation))) continue;
            blob.middle = p.cast<float>();
            blob.axis = (out + 0.6 * Vec3(aside, up, aside * up)).normalized().cast<float>();
            // Of lung in the place of tissue: where vessels lie there is less.
            blob.fraction = more ? -0.42f : 0.14f;
            if (!more) blob.radius *= 1.442f;  // three times the volume
            more = !more;
            blobs.push_back(blob);
        }
    }

private:
    static constexpr double exponent = 2.3;

    void grow(std::vector<Vec3> points, const Vec3& from) {
        Vec3 middle = Vec3::Zero();
        for (const Vec3& p : points) middle += p / static_cast<double>(points.size());
        const bool last = points.size() == 1;
        const Vec3 to = last ? middle : Vec3(from + random_.between(0.32, 0.5) * (middle - from));
        draw(from, to, 0.44 * std::pow(static_cast<double>(points.size()), 1.0 / exponent));
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

    /// The artery between the lobes with its branches, and veins: most of what a hilum shows.
    void draw_trunks(Side side) {
        const double y = spine_front(330.0) - 14.0, lower = side.sign > 0.0 ? 0.0 : -8.0;
        const auto at = [&](double x, double back, double z) { return side.at(x, y + back, z + lower); };
        taper({at(46, 0, 344), at(64, 2, 326), at(75, 8, 300), at(83, 16, 268), at(86, 24, 236)}, 6.4, 2.0);
        taper({at(72, 6, 306), at(88, 4, 290), at(104, -2, 278)}, 3.2, 1.6);
        taper({at(78, 12, 284), at(94, 18, 262), at(104, 26, 236)}, 2.9, 1.3);
        taper({at(54, -6, 344), at(64, -12, 372), at(78, -8, 396), at(84, 0, 414)}, 4.2, 1.2);
        taper({at(62, -12, 368), at(78, -24, 384), at(92, -34, 392)}, 2.6, 1.1);
        taper({at(50, -8, 318), at(70, -6, 306), at(92, -2, 300), at(112, 6, 290)}, 4.0, 1.4);
        taper({at(58, -12, 340), at(78, -24, 346), at(98, -40, 344)}, 3.4, 1.2);
        taper({at(62, 4, 332), at(82, 22, 336), at(98, 44, 330)}, 3.0, 1.2);
        for (int k = 0; k < 14; ++k) {
            const double turn = random_.between(-1.3, 1.3), rise = random_.between(-1.2, 1.2),
                         length = random_.between(24, 52), wide = random_.between(1.0, 2.4),
                         off = random_.between(-9, 9), z = random_.between(300, 352);
            const Vec3 from = at(58 + 0.5 * off, off, z);
            const Vec3 way = side.at(std::cos(turn) * std::cos(rise), std::sin(turn), std::sin(rise));
            taper({from, from + 0.5 * length * way, from + length * (way + Vec3(0, 0, 0.1 * off / 9.0))},
                  wide, 0.6 * wide);
        }
    }

    /// A vessel that winds a little and narrows on its way.
    void taper(const std::vector<Vec3>& course, double from, double to) {
        constexpr int pieces = 4;
        Polyline path;
        std::vector<double> radii;
        const auto count = static_cast<int>(course.size());
        for (int i = 0; i + 1 < count; ++i) {
            const Vec3 &before = course[std::max(i - 1, 0)], &a = course[i], &b = course[i + 1],
                       &after = course[std::min(i + 2, count - 1)];
            for (int k = i == 0 ? 0 : 1; k <= pieces; ++k) {
                const double t = static_cast<double>(k) / pieces, t2 = t * t, t3 = t2 * t;
                const double x = random_.between(-1, 1), y = random_.between(-1, 1),
                             z = random_.between(-1, 1);
                const Vec3 p = (2 * t3 - 3 * t2 + 1) * a + 0.5 * (t3 - 2 * t2 + t) * (b - before) +
                               (3 * t2 - 2 * t3) * b + 0.5 * (t3 - t2) * (after - a) + 0.6 * Vec3(x, y, z);
                const double part = (i + t) / (count - 1), radius = from + part * (to - from);
                if (!lung_.holds(p, lung_gap + radius + 1.2)) {
                    if (path.size() > 1) break;
                    path.clear();
                    radii.clear();
                    continue;
                }
                path.push_back(p);
                radii.push_back(path.size() == 1 ? 0.4 * radius : radius);
            }
        }
        if (path.size() < 2) return;
        radii.back() *= 0.4;
        append(mesh_, tube(path, Vec3(0.31, 0.83, 0.46), radii, radii, 8));
    }

    void draw(const Vec3& from, const Vec3& to, double radius) {
        const double length = (to - from).norm();
        if (length < 2.0) return;
        const double y = random_.between(-1, 1), x = random_.between(-1, 1);
        const Vec3 aside = (to - from).cross(Vec3(x, y, 0.5)) * 0.16;
        const int pieces = radius > 0.6 ? 4 : 3;
        Polyline path;
        for (int k = 0; k <= pieces; ++k) {
            const double t = static_cast<double>(k) / pieces;
            const Vec3 p = from + t * (to - from) + 4.0 * t * (1.0 - t) * aside;
            if (lung_.holds(p, lung_gap + radius + 1.2))
                path.push_back(p);
            else if (!path.empty())
                break;
        }
        if (path.size() < 2) return;
        const std::vector<double> radii(path.size(), radius);
        append(mesh_, tube(path, Vec3(0.31, 0.83, 0.46), radii, radii,
                           radius > 1.5   ? 8
                           : radius > 0.8 ? 5
                                          : 3));
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
                              [&](double r) { return shape.distance(centre + r * direction, false) < 0.0; });
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
        LungVessels tree(lung, side, chance.field("lung vessels", side.sign > 0.0 ? 0 : 1));
        tree.add_finest(side, layers.back().texture_blobs);
        append(vessels, std::move(tree).mesh());
        append(muscle, dome(chest, side));
    }
    layers.push_back({"lung vessels", Material::Blood, Material::Lung, std::move(vessels), false});
    layers.push_back({"heart", Material::SoftTissue, Material::SoftTissue, heart(), false});
    layers.push_back({"diaphragm", Material::SoftTissue, Material::SoftTissue, std::move(muscle), false});
    layers.push_back({"airway", Material::Air, Material::SoftTissue, airway(), false});
}

}  // namespace render
