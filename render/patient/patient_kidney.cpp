#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {
namespace {

constexpr double kidney_cell = 2.5, pyramid_cell = 1.6;  // of the grids [mm]
constexpr double cortex_thickness = 5.4;  // over the pyramids, 1 mm more or less; 6 to 10 (texts)

/// The middle of a kidney, and the directions of its long axis (up), its hilum and across both.
struct KidneyFrame {
    Vec3 middle, up, hilum, across;
};

KidneyFrame frame_of(const Side side, const std::vector<shape::Station>& course) {
    KidneyFrame f;
    f.middle = course[course.size() / 2].at;
    f.up = (course.front().at - course.back().at).normalized();
    const Vec3 medial = side.at(-1.0, -0.4, 0.0);  // and forward
    f.hilum = (medial - medial.dot(f.up) * f.up).normalized();
    f.across = f.up.cross(f.hilum);
    return f;
}

/// Fat around calyces and vessels, open toward the hilum.
shape::Solid renal_sinus(const KidneyFrame& f, double grown_by) {
    Eigen::Matrix3d axes;
    axes << f.hilum, f.across, f.up;
    const Vec3 by = Vec3::Constant(grown_by);
    const shape::Solid inner = shape::ellipsoid(f.middle + 8.0 * f.hilum, Vec3(15, 4.5, 21) + by, axes),
                       outer = shape::ellipsoid(f.middle + 25.0 * f.hilum, Vec3(12, 8, 14) + by, axes);
    Eigen::AlignedBox3d box = inner.box;
    box.extend(outer.box);
    return {[=](const Vec3& p) { return std::min(inner.distance(p), outer.distance(p)); }, box};
}

/// A pyramid of the medulla: its papilla at the sinus, and the direction in which it widens.
struct Pyramid {
    Vec3 papilla, axis;
    double width;  // relative to the others
};

/// Two rows, before and behind the sinus, of four to six each, and one or two at either pole: 10 to 16 (texts
/// count 8 to 18). Those of the front row look forward, those behind look outward, since the calyces in front
/// lie more toward the hilum (texts).
std::vector<Pyramid> pyramids_of(const KidneyFrame& f, const Chance& chance, int index) {
    geometry::Random random(chance.field("renal pyramids", index));
    const Vec3 forward = f.across.y() < 0.0 ? f.across : Vec3(-f.across);
    std::vector<Pyramid> all;
    const auto add = [&](double rise, double turn, double apart, double width) {
        // `rise` toward the upper pole, `turn` from the convex border forward.
        const Vec3 across = -std::cos(turn) * f.hilum + std::sin(turn) * forward;
        const Vec3 axis = std::cos(rise) * across + std::sin(rise) * f.up;
        all.push_back({f.middle + 5.0 * f.hilum + 20.0 * std::sin(rise) * f.up +
                           apart * std::sin(turn) * forward - 2.0 * std::cos(rise) * f.hilum,
                       axis, width});
    };
    for (const double row : {-1.0, 1.0}) {
        const int count = 4 + static_cast<int>(3.0 * random());
        const double reach = random.between(0.80, 0.95);
        for (int k = 0; k < count; ++k) {
            const double even = count > 1 ? 2.0 * k / (count - 1) - 1.0 : 0.0;
            const double rise = reach * even + random.between(-0.11, 0.11),
                         turn = (row > 0.0 ? 1.05 : -0.60) + random.between(-0.18, 0.18);
            add(rise, turn, 4.5, random.between(0.8, 1.2));
        }
    }
    for (const double pole : {-1.0, 1.0}) {
        const bool two = random() < 0.5;
        const double turn = random.between(-0.3, 0.4);
        for (int k = 0; k < (two ? 2 : 1); ++k) {
            const double size = random.between(0.9, 1.25), rise = pole * random.between(1.32, 1.45);
            add(rise, turn + (two ? 1.6 * k - 0.8 : 0.0), 3.0, size);
        }
    }
    return all;
}

/// The tissue under the cortex that is nearer to the axis of one pyramid than to the others', apart from the
/// columns of cortex between them.
shape::Compound pyramids(const KidneyFrame& f, const shape::Solid& whole, const Chance& chance, int index) {
    const std::uint64_t field = chance.field("renal columns", index);
    shape::Compound medulla;
    medulla.add({[=, depth = whole.distance, all = pyramids_of(f, chance, index)](const Vec3& p) {
                     // Warped, so that no face is flat.
                     const Vec3 q =
                         p + 2.2 * Vec3(shape::noise(p, 15.0, field), shape::noise(p, 15.0, field + 1),
                                        shape::noise(p, 15.0, field + 2));
                     double nearest = 1e6, next = 1e6, beyond = 1e6;
                     for (const Pyramid& pyramid : all) {
                         const Vec3 off = q - pyramid.papilla;
                         const double along = off.dot(pyramid.axis);
                         const double away = std::sqrt(std::max(0.0, off.squaredNorm() - along * along)) +
                                             std::max(0.0, -2.0 * along);
                         const double scaled = away / pyramid.width;
                         if (scaled < nearest) {
                             next = nearest;
                             nearest = scaled;
                             beyond = away - pyramid.width * (6.5 + 0.90 * std::max(0.0, along));
                         } else {
                             next = std::min(next, scaled);
                         }
                     }
                     const double column = 1.2 - 0.5 * (next - nearest);
                     const double under =
                         depth(p) + cortex_thickness + 1.0 * shape::noise(p, 19.0, field + 3);
                     return 0.75 * std::max({column, beyond, under});
                 },
                 whole.box});
    medulla.cut(renal_sinus(f, 1.2), 0.8);
    return medulla;
}

TriangleMesh inside_out(TriangleMesh mesh) {
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    return mesh;
}

}  // namespace

void add_kidney_layers(std::vector<TissueLayer>& layers, const Chance& chance, Side side,
                       const std::vector<shape::Station>& course) {
    const std::string name = side.sign > 0.0 ? "left kidney" : "right kidney";
    // The lobes of the foetus leave shallow furrows.
    const std::uint64_t lobes = chance.field("renal lobes", side.sign > 0.0 ? 0 : 1);
    const shape::Solid whole = shape::sweep(course, Vec3::UnitX(), 2.0, [lobes](double along, double angle) {
        const Vec3 on_surface(along, 22.0 * std::cos(angle), 22.0 * std::sin(angle));
        return 0.9 * shape::noise(on_surface, 24.0, lobes) + 0.5 * shape::noise(on_surface, 11.0, lobes + 1);
    });
    const KidneyFrame f = frame_of(side, course);
    shape::Compound kidney;
    kidney.add(whole);
    kidney.cut(renal_sinus(f, 0.0), 3.0);
    TriangleMesh outside = shape::polygonised(kidney, kidney_cell).outer,
                 medulla =
                     shape::polygonised(pyramids(f, whole, chance, side.sign > 0.0 ? 0 : 1), pyramid_cell)
                         .outer;
    TriangleMesh cortex = outside;
    append(cortex, inside_out(medulla));
    layers.push_back({name, Material::SoftTissue, Material::Adipose, std::move(outside), false});
    layers.push_back(
        {name + " cortex", Material::SoftTissue, Material::SoftTissue, std::move(cortex), false});
    layers.push_back(
        {name + " medulla", Material::SoftTissue, Material::SoftTissue, std::move(medulla), false});
}

}  // namespace render
