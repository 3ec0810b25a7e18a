#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/patient/patient_parts.h"

namespace render {

using geometry::Polyline;
using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

constexpr double shell = 1.4;  // of the lumbar plates, exaggerated [mm]

/// A vertebral body, waisted, with rims; `thinner` mm smaller all around.
TriangleMesh vertebral_body(double half_width, double half_depth, double half_height, double thinner) {
    // Height as share of the half-height, and width there as share of the widest.
    constexpr double profile[][2] = {{-1.0, 0.93},   {-0.93, 0.99}, {-0.8, 0.985}, {-0.55, 0.92},
                                     {-0.25, 0.875}, {0.0, 0.86},   {0.25, 0.875}, {0.55, 0.92},
                                     {0.8, 0.985},   {0.93, 0.99},  {1.0, 0.93}};
    std::vector<Ring> rings;
    for (const auto& [height, share] : profile) {
        Ring ring;
        ring.centre = Vec3(0.0, half_depth, height * (half_height - 1.3 * thinner));
        ring.a = half_width * share - thinner;
        ring.b = half_depth * share - thinner;
        ring.exponent = 2.5;
        rings.push_back(ring);
    }
    return loft(rings, 32);
}

/// One vertebra as large as L3, its anterior face at y = 0 and its middle at z = 0.
Bones large_vertebra(double half_height, bool lumbar) {
    const int around = lumbar ? 16 : 10;
    constexpr double half_width = 23.0, half_depth = 16.5, back = 2.0 * half_depth;
    Bones bones;
    append(bones.outer, vertebral_body(half_width, half_depth, half_height, 0.0));
    append(bones.core, vertebral_body(half_width, half_depth, half_height, shell));
    for (const Side side : {left, right}) {
        add_tube(
            bones,
            {side.at(15.5, back - 4.0, 4.5), side.at(16.5, back + 5.0, 4.5), side.at(17.5, back + 13.0, 3.5)},
            Vec3::UnitX(), {4.6, 4.2, 4.6}, {7.4, 6.8, 7.0}, 1.7, around);
        // Facets: the articular pillar from the level above to the level below.
        add_tube(bones,
                 {side.at(17.0, back + 16.0, 21.0), side.at(18.0, back + 15.5, 6.0),
                  side.at(14.5, back + 17.0, -9.0), side.at(13.0, back + 18.0, -21.0)},
                 Vec3::UnitX(), {3.2, 5.8, 5.0, 4.2}, {3.0, 4.0, 4.0, 3.4}, 1.2, around);
        const double across = lumbar ? 1.0 : 0.8, backward = lumbar ? 0.0 : 9.0;
        add_tube(
            bones,
            {side.at(21.5 * across, back + 13.0, 4.0), side.at(33.5 * across, back + 14.0 + backward, 5.5),
             side.at(44.5 * across, back + 16.0 + 1.6 * backward, 7.5)},
            Vec3::UnitZ(), {5.2, 4.0, lumbar ? 2.4 : 4.4}, {2.8, 2.4, lumbar ? 1.6 : 3.0}, 0.9, around);
        add_tube(bones, {side.at(12.5, back + 18.5, -2.0), side.at(1.5, back + 25.0, -6.0)}, Vec3::UnitZ(),
                 {8.0, 8.5}, {2.4, 2.4}, 0.9, around);
    }
    const double drop = lumbar ? 0.0 : 18.0;  // thoracic spinous processes overlap like tiles
    add_tube(
        bones,
        {{0.0, back + 24.5, -6.0}, {0.0, back + 36.0, -9.0 - 0.5 * drop}, {0.0, back + 50.0, -13.0 - drop}},
        Vec3::UnitZ(), {7.5, 8.5, 7.0}, {2.6, 2.2, 3.2}, 0.9, around);
    return bones;
}

/// Distance to the neighbours above and below, on average [mm].
double spacing(std::size_t level) {
    const auto column = vertebrae();
    const std::size_t below = level == 0 ? 0 : level - 1, above = std::min(level + 1, column.size() - 1);
    return (column[above].z - column[below].z) / static_cast<double>(above - below);
}

/// Sacrum: a wedge that tapers downward and bends back, with its foramina left out.
void add_sacrum(Bones& bones) {
    Polyline path;
    std::vector<double> half_width, half_depth;
    for (int i = 0; i <= 8; ++i) {
        const double t = i / 8.0;
        path.push_back({0.0, 16.0 + 48.0 * std::sin(1.9 * t), sacrum_top - 100.0 * t});
        half_width.push_back(50.0 - 12.0 * t - 24.0 * t * t);
        half_depth.push_back(17.0 - 11.0 * t);
    }
    add_tube(bones, path, Vec3::UnitX(), half_width, half_depth, 1.5);
}

}  // namespace

void add_spine(Bones& bones, double low, double high) {
    const auto column = vertebrae();
    for (std::size_t level = 0; level < column.size(); ++level) {
        const Vertebra& own = column[level];
        if (own.z < low || own.z > high) continue;
        const Vec3 scale(own.half_width / 23.0, own.half_depth / 16.5, spacing(level) / 38.0);
        const Eigen::Affine3d place = Eigen::Translation3d(0.0, own.front, own.z) *
                                      Eigen::AngleAxisd(-std::atan(spine_slope(own.z)), Vec3::UnitX()) *
                                      Eigen::Scaling(scale);
        Bones made = large_vertebra(own.half_height / scale.z(), own.z < 130.0);
        for (TriangleMesh* mesh : {&made.outer, &made.core}) {
            for (Vec3& v : mesh->vertices) v = place * v;
        }
        append(bones.outer, made.outer);
        append(bones.core, made.core);
    }
    if (low < column.front().z) add_sacrum(bones);
}

}  // namespace render
