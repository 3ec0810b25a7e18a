#include "render/patient/patient_parts.h"

namespace render {

using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

constexpr double kidney_cell = 2.5, pyramid_cell = 2.0;  // of the grids [mm]
constexpr double cortex_thickness = 6.5;                 // over the pyramids; 6 to 10 (texts) [mm]

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

/// Pyramids in five pairs before and behind the sinus (texts count 8 to 18): the tissue under the cortex,
/// divided by columns of cortex that widen toward the papillae.
shape::Compound pyramids(const KidneyFrame& f, const shape::Solid& whole, const Chance& chance, int index) {
    shape::Compound medulla;
    medulla.add(shape::grown(whole, -cortex_thickness));
    const auto column_half = [f](const Vec3& p) {
        const Vec3 off = p - f.middle;
        const double out = (off - off.dot(f.up) * f.up).norm();
        return 1.1 + 3.0 * std::max(0.0, 1.0 - out / 15.0);
    };
    const std::uint64_t field = chance.field("renal columns", index);
    int count = 0;
    for (const double along : {-29.0, -10.0, 10.0, 29.0}) {
        const double at = along + 1.5 * chance.normal("renal column", 8 * index + count++);
        // Fanned out from the sinus.
        const Vec3 normal = (f.up - 0.004 * along * f.hilum).normalized();
        medulla.cut({[=](const Vec3& p) {
                         const double bent = 4.0 * shape::noise(p, 26.0, field);
                         return 0.7 *
                                (std::abs((p - f.middle - at * f.up).dot(normal) + bent) - column_half(p));
                     },
                     whole.box},
                    2.0);
    }
    medulla.cut(
        {[=](const Vec3& p) { return 0.8 * (std::abs((p - f.middle).dot(f.across)) - column_half(p)); },
         whole.box},
        2.0);
    medulla.cut(renal_sinus(f, 2.0), 1.0);
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
    const shape::Solid whole = shape::sweep(course, Vec3::UnitX());
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
