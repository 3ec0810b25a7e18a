#include "render/patient.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/solids.h"

namespace render {

using physics::Polyline;
using physics::TriangleMesh;
using physics::Vec3;

namespace {

constexpr double skin_behind = 108.0;  // of the back, from the front of the vertebral bodies [mm]
constexpr double spacing = 38.0;       // of lumbar vertebrae, body 28 mm and disc 10 mm
constexpr double body_half = 14.0;     // half of a body's height [mm]
constexpr double shell = 1.4;          // thickness of cortical bone, exaggerated at the plates [mm]

/// Bone, in two meshes: the outer surface and the trabecular core within.
struct Bones {
    TriangleMesh outer;
    TriangleMesh core;
};

/// A vertebral body, waisted, with rims; `thinner` mm smaller all around.
TriangleMesh vertebral_body(const Vec3& centre, double half_width, double half_depth, double half_height,
                            double thinner) {
    // Height as share of the half-height, and width there as share of the widest.
    constexpr double profile[][2] = {{-1.0, 0.93},   {-0.93, 0.99}, {-0.8, 0.985}, {-0.55, 0.92},
                                     {-0.25, 0.875}, {0.0, 0.86},   {0.25, 0.875}, {0.55, 0.92},
                                     {0.8, 0.985},   {0.93, 0.99},  {1.0, 0.93}};
    std::vector<Ring> rings;
    for (const auto& [height, share] : profile) {
        Ring ring;
        ring.centre = centre + Vec3(0.0, 0.0, height * (half_height - 1.3 * thinner));
        ring.a = half_width * share - thinner;
        ring.b = half_depth * share - thinner;
        ring.exponent = 2.5;
        rings.push_back(ring);
    }
    return loft(rings, 48);
}

void add_tube(Bones& bones, const Polyline& path, const Vec3& u, const std::vector<double>& a,
              const std::vector<double>& b, double wall = shell) {
    append(bones.outer, tube(path, u, a, b));
    std::vector<double> inner_a, inner_b;
    for (double x : a) inner_a.push_back(std::max(x - wall, 0.3));
    for (double x : b) inner_b.push_back(std::max(x - wall, 0.3));
    // The core ends short of the lids.
    Polyline inner = path;
    inner.front() += std::min(wall / (path[1] - path[0]).norm(), 0.4) * (path[1] - path[0]);
    inner.back() += std::min(wall / (path[path.size() - 2] - path.back()).norm(), 0.4) *
                    (path[path.size() - 2] - path.back());
    append(bones.core, tube(inner, u, inner_a, inner_b));
}

/// Body, pedicles, transverse (lumbar) and spinous processes, laminae and facets of one vertebra.
void add_vertebra(Bones& bones, const PatientSpec& spec, double z, double size, bool lumbar) {
    const double half_width = 23.0 * size, half_depth = 16.5 * size;
    const Vec3 centre(spec.spine_x, spec.spine_front + half_depth, z);
    append(bones.outer, vertebral_body(centre, half_width, half_depth, body_half * size, 0.0));
    append(bones.core, vertebral_body(centre, half_width, half_depth, body_half * size, shell));
    const double back = centre.y() + half_depth;
    for (double side : {-1.0, 1.0}) {
        const double x = spec.spine_x + side * 15.5 * size;
        add_tube(bones,
                 {{x, back - 4.0, z + 4.5},
                  {x + side, back + 5.0, z + 4.5},
                  {x + 2.0 * side, back + 13.0, z + 3.5}},
                 Vec3::UnitX(), {4.6, 4.2, 4.6}, {7.4, 6.8, 7.0}, 1.7);
        // Facets: the articular pillar from the level above to the level below.
        add_tube(bones,
                 {{x + 1.5 * side, back + 16.0, z + 21.0},
                  {x + 2.5 * side, back + 15.5, z + 6.0},
                  {x - 1.0 * side, back + 17.0, z - 9.0},
                  {x - 2.5 * side, back + 18.0, z - 21.0}},
                 Vec3::UnitX(), {3.2, 5.8, 5.0, 4.2}, {3.0, 4.0, 4.0, 3.4}, 1.2);
        if (lumbar)
            add_tube(bones,
                     {{x + 6.0 * side, back + 13.0, z + 4.0},
                      {x + 18.0 * side, back + 14.0, z + 5.5},
                      {x + 29.0 * side, back + 16.0, z + 7.5}},
                     Vec3::UnitZ(), {5.2, 4.0, 2.4}, {2.8, 2.4, 1.6}, 0.9);
        add_tube(bones,
                 {{x - 3.0 * side, back + 18.5, z - 2.0}, {spec.spine_x + 1.5 * side, back + 25.0, z - 6.0}},
                 Vec3::UnitZ(), {8.0, 8.5}, {2.4, 2.4}, 0.9);
    }
    add_tube(bones,
             {{spec.spine_x, back + 24.5, z - 6.0},
              {spec.spine_x, back + 36.0, z - 9.0},
              {spec.spine_x, back + 50.0, z - 13.0}},
             Vec3::UnitZ(), {7.5, 8.5, 7.0}, {2.6, 2.2, 3.2}, 0.9);
}

/// Sacrum: a wedge that tapers downward and bends back, with its foramina left out.
void add_sacrum(Bones& bones, const PatientSpec& spec, double top) {
    Polyline path;
    std::vector<double> half_width, half_depth;
    for (int i = 0; i <= 8; ++i) {
        const double t = i / 8.0;
        path.push_back({spec.spine_x, spec.spine_front + 16.0 + 48.0 * std::sin(1.9 * t), top - 100.0 * t});
        half_width.push_back(50.0 - 12.0 * t - 24.0 * t * t);
        half_depth.push_back(17.0 - 11.0 * t);
    }
    add_tube(bones, path, Vec3::UnitX(), half_width, half_depth, 1.5);
}

/// Ilium as a curved blade, pubic rami and ischium as tubes around the foramen, femoral head and neck.
void add_hip(Bones& bones, const PatientSpec& spec, double top, double side) {
    const Vec3 origin(spec.spine_x, spec.spine_front + 16.0, top);
    const auto at = [&](double x, double y, double z) -> Vec3 { return origin + Vec3(side * x, y, z); };
    // Blade: long half-axis forward and outward, thin across.
    const Vec3 blade = Vec3(side * 0.62, -0.78, 0.0).normalized();
    add_tube(
        bones,
        {at(88, 20, 47), at(88, 20, 45), at(87, 19, 41), at(86, 18, 34), at(84, 17, 22), at(81, 15, 4),
         at(78, 12, -18), at(78, 8, -42), at(80, 2, -66), at(84, -4, -84), at(86, -4, -98), at(87, -4, -104)},
        blade, {10, 21, 33, 45, 56, 62, 56, 41, 28, 25, 20, 10},
        {2.0, 3.6, 4.6, 4.6, 4.0, 3.2, 3.6, 6.0, 12.0, 17.0, 14.0, 8.0}, 1.5);
    add_tube(bones, {at(74, -10, -92), at(50, -26, -88), at(28, -34, -96), at(8, -36, -106)}, Vec3::UnitZ(),
             {10, 7, 8, 15}, {8, 6, 6, 7});
    add_tube(bones, {at(9, -34, -112), at(24, -22, -132), at(42, -4, -142), at(58, 8, -136), at(74, 8, -106)},
             Vec3::UnitZ(), {8, 6, 8, 14, 10}, {6, 5, 7, 9, 9});
    const Vec3 head = at(96, -6, -92);
    append(bones.outer, ellipsoid(head, Vec3(23, 23, 23)));
    append(bones.core, ellipsoid(head, Vec3(21.8, 21.8, 21.8)));
    add_tube(bones, {at(112, -5, -104), at(128, -3, -116), at(140, -1, -128)}, Vec3::UnitY(), {14, 13, 16},
             {15, 15, 22}, 2.0);
    add_tube(bones, {at(141, 0, -112), at(144, 0, -140), at(140, 0, -180), at(136, 0, -260)}, Vec3::UnitX(),
             {15, 18, 15, 14}, {15, 18, 15, 14}, 4.0);
}

TriangleMesh trunk(const PatientSpec& spec, double smaller) {
    const double middle_y =
        spec.spine_front + skin_behind - 0.5 * spec.depth;  // spinous processes end below the skin
    std::vector<Ring> rings;
    const double low = spec.lower.z() - 260.0, high = spec.upper.z() + 260.0;
    constexpr int steps = 24;
    for (int i = 0; i <= steps; ++i) {
        const double z = low + (high - low) * i / steps;
        // A waist above the pelvis.
        const double waist = 1.0 - 0.06 * std::exp(-std::pow((z - spec.bifurcation - 25.0) / 70.0, 2.0));
        Ring ring;
        ring.centre = Vec3(spec.spine_x, middle_y, z);
        ring.a = 0.5 * spec.width * waist - smaller;
        ring.b = 0.5 * spec.depth * (0.5 + 0.5 * waist) - smaller;
        ring.exponent = 2.4;
        rings.push_back(ring);
    }
    return loft(rings, 72);
}

/// Gas in a piece of bowel along a path, bulging between its folds.
TriangleMesh haustra(const Polyline& path, double width, double depth, double fold) {
    Polyline fine;
    std::vector<double> a, b;
    double travelled = 0.0;
    double length = 0.0;
    for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).norm();
    for (std::size_t i = 1; i < path.size(); ++i) {
        const double piece = (path[i] - path[i - 1]).norm();
        const int steps = std::max(2, static_cast<int>(piece / 2.0));
        for (int k = i == 1 ? 0 : 1; k <= steps; ++k) {
            const double s = travelled + piece * k / steps;
            // Round at both ends, narrow at each fold; no two bulges are alike.
            const double end = std::min(s, length - s) / width;
            const double cap =
                std::sqrt(std::clamp(1.0 - (1.0 - end) * (1.0 - end) * (end < 1.0), 0.01, 1.0));
            const double bulge = 0.72 + 0.28 * std::abs(std::sin(std::numbers::pi * s / fold)) +
                                 0.10 * std::sin(1.7 * s / fold + 0.13 * path.front().x());
            fine.push_back(path[i - 1] + (path[i] - path[i - 1]) * (double(k) / steps));
            a.push_back(width * cap * bulge);
            b.push_back(depth * cap * bulge);
        }
        travelled += piece;
    }
    return tube(fine, Vec3::UnitX() + 0.4 * Vec3::UnitZ(), a, b, 24);
}

/// Colon on both sides, some loops between. Fixed places, so that frames repeat.
TriangleMesh bowel_gas(const PatientSpec& spec) {
    const double front = spec.spine_front + skin_behind - spec.depth + 45.0;
    const auto at = [&](double x, double y, double z) -> Vec3 {
        return {spec.spine_x + x, front + y, spec.bifurcation + z};
    };
    TriangleMesh gas;
    append(gas,
           haustra({at(-112, 18, -34), at(-118, 20, -6), at(-114, 18, 24), at(-108, 16, 46)}, 17, 7, 21));
    append(gas, haustra({at(113, 16, 18), at(118, 20, 48), at(110, 20, 84), at(104, 18, 102)}, 12, 6, 17));
    append(gas, haustra({at(-84, 8, 96), at(-60, 5, 88), at(-34, 4, 92)}, 11, 5, 19));
    append(gas, haustra({at(26, 4, 104), at(48, 5, 98), at(78, 8, 108)}, 10, 5, 16));
    append(gas, haustra({at(92, 14, -46), at(74, 12, -58), at(60, 12, -80), at(36, 14, -92)}, 11, 6, 15));
    append(gas, haustra({at(-18, 16, -104), at(4, 16, -98), at(18, 15, -112)}, 12, 7, 22));
    append(gas, haustra({at(-58, 12, -18), at(-46, 12, -30), at(-50, 12, -46)}, 8, 4, 13));
    append(gas, haustra({at(46, 12, 26), at(58, 12, 36), at(72, 12, 30)}, 7, 4, 12));
    return gas;
}

/// Kidneys in their fat beside L1 to L3, the left one higher.
struct Flanks {
    TriangleMesh fat;
    TriangleMesh kidneys;
};
Flanks flanks(const PatientSpec& spec) {
    Flanks result;
    for (double side : {-1.0, 1.0}) {
        const double z = spec.bifurcation + (side > 0.0 ? 84.0 : 70.0);
        const auto at = [&](double x, double y, double dz) -> Vec3 {
            return {spec.spine_x + side * x, spec.spine_front + y, z + dz};
        };
        // The long axis leans outward and forward below.
        const Polyline path{at(48, 30, 56),  at(49, 29, 52),  at(51, 28, 42),  at(55, 25, 20), at(60, 21, -4),
                            at(65, 16, -28), at(68, 12, -44), at(70, 10, -52), at(70, 10, -55)};
        append(result.kidneys, tube(path, Vec3::UnitX(), {4, 12, 20, 26, 25, 25, 19, 11, 4},
                                    {3, 9, 15, 19, 20, 19, 15, 9, 3}, 28));
        Polyline wide;
        for (const Vec3& p : path) wide.push_back(p + 0.30 * (p - path[4]));
        append(result.fat, tube(wide, Vec3::UnitX(), {12, 22, 31, 36, 38, 36, 29, 20, 9},
                                {9, 16, 23, 28, 29, 27, 22, 15, 7}, 28));
    }
    return result;
}

/// The two lowest ribs on each side, from their vertebra backward and around.
void add_rib(Bones& bones, const PatientSpec& spec, double z, double reach) {
    for (double side : {-1.0, 1.0}) {
        const double back = spec.spine_front + 30.0;
        Polyline path;
        std::vector<double> half_height, half_thickness;
        const int steps = 14;
        for (int i = 0; i <= steps; ++i) {
            const double t = reach * i / steps;  // angle around the trunk [rad]
            path.push_back({spec.spine_x + side * (22.0 + 118.0 * std::sin(0.95 * t)),
                            back + 12.0 + 20.0 * std::sin(2.6 * t) - 46.0 * t * t, z - 44.0 * t});
            const double taper = i == 0 || i == steps ? 0.75 : 1.0;
            half_height.push_back(5.6 * taper);
            half_thickness.push_back(3.2 * taper);
        }
        add_tube(bones, path, Vec3::UnitZ(), half_height, half_thickness, 0.8);
    }
}

}  // namespace

PatientSpec patient_around(std::span<const Vec3> points, double bifurcation) {
    PatientSpec spec;
    spec.bifurcation = bifurcation;
    if (points.empty()) return spec;
    spec.lower = spec.upper = points.front();
    for (const Vec3& p : points) {
        spec.lower = spec.lower.cwiseMin(p);
        spec.upper = spec.upper.cwiseMax(p);
    }
    // The aorta: the middle of what lies highest, wall or centreline, and what lies below it down to the
    // bifurcation. Renal arteries leave it sideways.
    double left = spec.lower.x(), right = spec.upper.x();
    for (const Vec3& p : points) {
        if (p.z() < spec.upper.z() - 10.0) continue;
        left = std::max(left, p.x());
        right = std::min(right, p.x());
    }
    spec.spine_x = 0.5 * (left + right);
    double back = spec.lower.y();
    for (const Vec3& p : points) {
        if (p.z() > bifurcation && std::abs(p.x() - spec.spine_x) < 15.0) back = std::max(back, p.y());
    }
    spec.spine_front = back + 3.0;
    const double margin = 25.0;
    const double widest = std::max(spec.upper.x() - spec.spine_x, spec.spine_x - spec.lower.x());
    spec.width = std::max(spec.width, 2.0 * (widest + margin));
    spec.depth = std::max(spec.depth, spec.spine_front + skin_behind - spec.lower.y() + margin);
    return spec;
}

std::vector<TissueLayer> make_patient(const PatientSpec& spec) {
    Bones bones;
    const double sacrum = spec.bifurcation - spacing - body_half - 8.0;  // top plate of S1, below L5
    int level = 0;
    for (double z = spec.bifurcation - spacing; z < spec.upper.z() + 130.0; z += spacing, ++level) {
        add_vertebra(bones, spec, z, std::max(0.78, 1.06 - 0.03 * level), level < 5);
        // L5 is level 0, so T12 with the short last rib is 5.
        if (level >= 5) add_rib(bones, spec, z + 6.0, level == 5 ? 0.75 : 1.25);
    }
    add_sacrum(bones, spec, sacrum);
    for (double side : {-1.0, 1.0}) add_hip(bones, spec, sacrum, side);

    std::vector<TissueLayer> layers;
    layers.push_back({"skin and fat", Material::adipose, Material::air, trunk(spec, 0.0), false});
    layers.push_back({"trunk", Material::soft_tissue, Material::adipose, trunk(spec, 15.0), false});
    layers.push_back(
        {"bones", Material::cortical_bone, Material::soft_tissue, std::move(bones.outer), false});
    layers.push_back(
        {"marrow", Material::trabecular_bone, Material::cortical_bone, std::move(bones.core), false});
    Flanks flank = flanks(spec);
    layers.push_back({"kidney fat", Material::adipose, Material::soft_tissue, std::move(flank.fat), false});
    layers.push_back({"kidneys", Material::soft_tissue, Material::adipose, std::move(flank.kidneys), false});
    if (spec.bowel_gas) {
        layers.push_back({"bowel gas", Material::air, Material::soft_tissue, bowel_gas(spec), false});
    }
    return layers;
}

}  // namespace render
