#include <Eigen/Geometry>
#include <numbers>

#include "render/patient/patient_parts.h"

namespace render {

using geometry::Polyline;
using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

using std::numbers::pi;

/// Places in the head are measured from the sella.
Vec3 from_sella(const Vec3& p) {
    return place_in_body(geometry::Landmark::Sella) + p;
}

double bell(double x) {
    return std::exp(-x * x);
}

/// Outer surface of the skull's floor: the roof of the orbits, lower behind the sella and in the middle
/// fossae.
double skull_floor(double x, double y) {
    const double t = std::clamp(y / 48.0, 0.0, 1.0);
    const double clivus = -4.0 - 40.0 * t * t * (3.0 - 2.0 * t);
    const double orbit = 12.0 * std::clamp(-(y + 20.0) / 25.0, 0.0, 1.0);
    const double temporal = 22.0 * bell((std::abs(x) - 38.0) / 18.0) * bell((y + 6.0) / 20.0);
    return clivus + orbit - temporal;
}

const Vec3 vault(0.0, 20.0, 28.0);  // its middle [mm]

/// Distance of the skull's outer surface from the middle of its vault.
double skull_radius(const Vec3& direction) {
    const auto inside = [&](double r) {
        const Vec3 p = vault + r * direction;
        const double across = (p.x()) / (72.0 + 4.0 * std::clamp((p.y() - 10.0) / 40.0, -2.0, 1.0)),
                     along = (p.y() - vault.y()) / 90.0, up = (p.z() - vault.z()) / 70.0;
        const double sum =
            std::pow(std::abs(across), 2.3) + std::pow(std::abs(along), 2.3) + std::pow(std::abs(up), 2.3);
        return sum < 1.0 && p.z() > skull_floor(p.x(), p.y());
    };
    double held = 0.0, out = 130.0;
    for (double r = 4.0; r < out && inside(r); r += 4.0) held = r;
    out = held + 4.0;
    for (int k = 0; k < 8; ++k) {
        const double middle = 0.5 * (held + out);
        (inside(middle) ? held : out) = middle;
    }
    return held;
}

/// The skull's surface, `inset` mm inside the outer one.
TriangleMesh skull(double inset) {
    return star(
        from_sella(vault), [&](const Vec3& direction) { return skull_radius(direction) - inset; }, 96);
}

constexpr double outer_table = 1.6, diploe = 3.2, inner_table = 1.4;  // [mm]

void add_path(Bones& bones, Polyline path, const Vec3& u, const std::vector<double>& a,
              const std::vector<double>& b, double wall) {
    for (Vec3& p : path) p = from_sella(p);
    add_tube(bones, path, u, a, b, wall, 12);
}

void add_face(Bones& bones, Side side) {
    // Rim of the orbit, nearly a ring.
    Polyline rim;
    constexpr int steps = 28;
    for (int i = 0; i <= steps; ++i) {
        const double angle = 2.0 * pi * i / steps * 0.985;
        rim.push_back(side.at(34.0 + 20.0 * std::cos(angle),
                              -62.0 + 0.14 * 20.0 * (1.0 + std::cos(angle)) * 2.0,
                              -8.0 + 18.0 * std::sin(angle)));
    }
    add_path(bones, rim, Vec3::UnitY(), std::vector<double>(rim.size(), 3.6),
             std::vector<double>(rim.size(), 2.6), 1.1);
    // Cheek bone and its arch to the temple.
    add_path(bones,
             {side.at(45, -58, -34), side.at(60, -46, -31), side.at(67, -22, -28), side.at(66, 2, -24)},
             Vec3::UnitZ(), {10, 7, 4.2, 4.5}, {6, 3.6, 2.4, 2.8}, 1.1);
    // Outer wall of the orbit.
    add_path(bones, {side.at(54, -52, -26), side.at(56, -47, -8), side.at(53, -50, 8)}, Vec3::UnitY(),
             {7, 6, 7}, {2.6, 2.2, 3}, 0.8);
    // Side of the nose.
    add_path(bones, {side.at(6, -74, 4), side.at(8, -76, -14), side.at(14, -72, -34)}, Vec3::UnitY(),
             {4, 4, 6}, {2, 1.8, 2.2}, 0.8);
    // Pterygoid process and tuber of the maxilla.
    add_path(bones, {side.at(14, -22, -24), side.at(15, -26, -40), side.at(16, -28, -56)}, Vec3::UnitY(),
             {9, 8, 5}, {2.2, 2.0, 2.2}, 0.7);
    // Condyle, ramus, angle and body of the mandible to the chin.
    add_path(bones,
             {side.at(51, 8, -28), side.at(51, 6, -38), side.at(51, 1, -58), side.at(49, -4, -74),
              side.at(45, -18, -85), side.at(36, -40, -91), side.at(24, -58, -95), side.at(10, -68, -97),
              side.at(0.6, -70, -97)},
             side.at(0.0, 0.75, 0.66), {5, 8, 15, 15, 12, 11, 11, 12, 12},
             {4.5, 3.4, 3.2, 4, 5, 5, 5.2, 6, 6.4}, 1.8);
    // Coronoid process.
    add_path(bones, {side.at(50, -18, -38), side.at(50.5, -13, -50), side.at(50, -9, -66)}, Vec3::UnitY(),
             {3, 6, 8}, {2, 2.2, 2.6}, 0.9);
    // Mastoid process and condyle of the occiput, under the skull.
    add_path(bones, {side.at(53, 34, -40), side.at(54, 30, -52), side.at(52, 27, -62)}, Vec3::UnitX(),
             {9, 9, 4}, {13, 11, 5}, 1.0);
    // Lateral mass and arch of the atlas.
    add_path(bones, {side.at(20, 26, -51), side.at(20, 27, -58), side.at(19, 27, -66)}, Vec3::UnitX(),
             {8, 8.5, 8}, {9, 9, 9}, 1.4);
    add_path(bones, {side.at(26, 27, -60), side.at(37, 29, -60)}, Vec3::UnitZ(), {5, 4}, {4, 3}, 1.0);
    add_path(bones, {side.at(19, 36, -59), side.at(16, 50, -60), side.at(1, 60, -61)}, Vec3::UnitZ(),
             {4, 4, 5}, {3.2, 3, 3.6}, 1.0);
}

/// A row of teeth and the bone they stand in: half an ellipse open to the back.
Polyline dental_arch(double z, double from, double to) {
    Polyline arch;
    constexpr int steps = 18;
    for (int i = 0; i <= steps; ++i) {
        const double angle = from + (to - from) * i / steps;
        arch.push_back({27.0 * std::sin(angle), -28.0 - 48.0 * std::cos(angle), z});
    }
    return arch;
}

TriangleMesh teeth() {
    TriangleMesh all;
    for (const bool upper : {true, false}) {
        for (int i = 0; i < 14; ++i) {
            const double angle = (i - 6.5) * 0.215,
                         molar = std::clamp((std::abs(i - 6.5) - 2.5) / 3.0, 0.0, 1.0);
            const Vec3 crown(27.0 * std::sin(angle), -28.0 - 46.0 * std::cos(angle), upper ? -73.0 : -74.5);
            const double root = upper ? 8.0 : -8.0;
            append(all, tube({from_sella(crown), from_sella(crown + Vec3(0, 1, 0.45 * root)),
                              from_sella(crown + Vec3(0, 2, root))},
                             Vec3::UnitX(), {2.6 + 1.6 * molar, 2.8 + 1.6 * molar, 1.2},
                             {2.2 + 2.2 * molar, 3.0 + 1.8 * molar, 1.2}, 10));
        }
    }
    return all;
}

/// Petrous ridges, clivus, sphenoid wings and clinoid processes: dense bone on the floor of the skull.
TriangleMesh skull_base() {
    TriangleMesh dense;
    // Each stands on the floor, clear of the inner table.
    const auto add = [&](Polyline path, const Vec3& u, const std::vector<double>& a,
                         const std::vector<double>& b) {
        for (std::size_t i = 0; i < path.size(); ++i) {
            Vec3& p = path[i];
            p.z() += skull_floor(p.x(), p.y()) + outer_table + diploe + inner_table;
            p = from_sella(p);
        }
        append(dense, tube(path, u, a, b, 16));
    };
    for (const Side side : {left, right}) {
        add({side.at(14, 20, 8), side.at(26, 26, 10), side.at(38, 30, 13), side.at(45, 33, 14)},
            Vec3::UnitZ(), {3, 5, 7, 5}, {3, 5.5, 7, 5});
        add({side.at(8, -14, 5), side.at(22, -22, 6), side.at(34, -27, 6), side.at(43, -29, 9)},
            Vec3::UnitZ(), {1.6, 2.0, 2.2, 1.6}, {3, 2.4, 2, 1.6});
        add({side.at(9, -12, 5), side.at(9, -6, 6.5), side.at(9, -2, 7)}, Vec3::UnitX(), {2.6, 2.0, 1.0},
            {2, 1.6, 1.0});
    }
    // Back of the saddle.
    add({Vec3(0, 11, 3), Vec3(0, 10, 9), Vec3(0, 9, 13)}, Vec3::UnitX(), {8, 9, 9}, {1.6, 1.8, 1.2});
    return dense;
}

/// Air of the sinuses; grown by `wall`, the bone around them.
TriangleMesh sinuses(double wall) {
    TriangleMesh air;
    // No two cells are alike: ellipsoids with bulges.
    const auto add = [&](const Vec3& centre, const Vec3& half_axes, double bulge) {
        append(air, star(
                        from_sella(centre),
                        [&](const Vec3& d) {
                            const double even = 1.0 / d.cwiseQuotient(half_axes).norm();
                            return wall +
                                   even * (1.0 + bulge * std::sin(2.0 + 3.1 * d.x() + 0.05 * centre.x()) *
                                                     std::sin(1.0 + 2.7 * d.z() - 1.9 * d.y()));
                        },
                        20));
    };
    for (const Side side : {left, right}) {
        add(side.at(28, -43, -36), {13, 13, 12}, 0.25);
        for (double y : {-56.0, -45.0, -33.0}) add(side.at(7.5, y, -15.0 - 0.1 * y), {4.2, 5.4, 6.5}, 0.3);
    }
    add({0, -14, -16}, {12, 10, 7}, 0.2);
    return air;
}

/// The throat, from behind the nose down to the larynx.
TriangleMesh throat() {
    const double larynx = 495.0 - place_in_body(geometry::Landmark::Sella).z();
    TriangleMesh air;
    const auto add = [&](Polyline path, const std::vector<double>& a, const std::vector<double>& b) {
        for (Vec3& p : path) p = from_sella(p);
        append(air, tube(path, Vec3::UnitX(), a, b, 16));
    };
    add({{0, -6, -36}, {0, -4, -48}, {0, -3, -66}, {0, -6, -84}, {0, -9, -104}, {0, -8, larynx}},
        {8, 11, 12, 12, 11, 7}, {3, 5, 5, 6, 5, 5});
    return air;
}

}  // namespace

void add_head_bones(Bones& bones) {
    append(bones.outer, skull(0.0));
    append(bones.core, skull(outer_table));
    for (const Side side : {left, right}) add_face(bones, side);
    add_path(bones, dental_arch(-58.0, -1.5, 1.5), Vec3::UnitZ(), std::vector<double>(19, 6.0),
             std::vector<double>(19, 4.5), 0.8);
    // Hard palate, chin's midline, dens and front arch of the atlas.
    add_path(bones, {{0, -70, -53}, {0, -46, -52}, {0, -26, -52}}, Vec3::UnitX(), {8, 14, 13},
             {1.8, 1.4, 1.4}, 0.7);
    add_path(bones, {{0, 26, -63}, {0, 25, -52}, {0, 25, -45}}, Vec3::UnitX(), {5.5, 5, 3}, {5.5, 5, 3}, 1.2);
    add_path(bones, {{-16, 20, -57}, {0, 14, -57}, {16, 20, -57}}, Vec3::UnitZ(), {4, 5, 4}, {2.4, 3, 2.4},
             1.0);
}

void add_head_layers(std::vector<TissueLayer>& layers) {
    layers.push_back({"inner table", Material::CorticalBone, Material::TrabecularBone,
                      skull(outer_table + diploe), false});
    layers.push_back({"brain", Material::SoftTissue, Material::CorticalBone,
                      skull(outer_table + diploe + inner_table), false});
    layers.push_back({"skull base", Material::CorticalBone, Material::SoftTissue, skull_base(), false});
    layers.push_back({"teeth", Material::CorticalBone, Material::SoftTissue, teeth(), false});
    layers.push_back({"sinus walls", Material::CorticalBone, Material::SoftTissue, sinuses(0.5), false});
    layers.push_back({"sinuses", Material::Air, Material::CorticalBone, sinuses(0.0), false});
    layers.push_back({"throat", Material::Air, Material::SoftTissue, throat(), false});
}

}  // namespace render
