#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {

using Eigen::Isometry3d;

namespace {

constexpr double sinus_cell = 1.8;  // of the grids [mm]

/// Crowns with roots: eight on each side above and below; molars are wide.
TriangleMesh teeth(const Chance& chance) {
    TriangleMesh all;
    for (const bool upper : {true, false}) {
        for (int i = 0; i < 14; ++i) {
            const double angle = (i - 6.5) * 0.215,
                         molar = std::clamp((std::abs(i - 6.5) - 2.5) / 3.0, 0.0, 1.0);
            const int index = i + (upper ? 0 : 14);
            // Of both sides, neither stands where the other does; now and then one is lost.
            const double aside_by = 0.9 * chance.normal("place of a tooth", index) + (i < 7 ? 1.3 : -0.6),
                         deeper = 0.9 * chance.normal("height of a tooth", index) + (i < 7 ? 0.7 : -0.4);
            if (chance.normal("lost tooth", index) > 1.7) continue;
            const double out = upper ? 46.0 : 44.5, row = (upper ? -71.0 : -73.0) + deeper,
                         up = upper ? 1.0 : -1.0;
            const Vec3 edge = Vec3(27.0 * std::sin(angle), -28.0 - out * std::cos(angle), row) +
                              aside_by * Vec3(std::cos(angle), std::sin(angle), 0);
            const double tilt = 1.6 * chance.normal("tooth", index),
                         length =
                             (19.0 - 3.0 * molar) * (1.0 + 0.07 * chance.normal("length of a tooth", index));
            const Vec3 inward = Vec3(-std::sin(angle), std::cos(angle), 0.0);
            const auto at = [&](double part, double aside) -> Vec3 {
                return edge + part * length * (up * Vec3::UnitZ() + 0.12 * inward) +
                       (aside + tilt * part) * Vec3(std::cos(angle), std::sin(angle), 0);
            };
            append(all,
                   tube({at(0, 0), at(0.08, 0), at(0.25, 0), at(0.42, 0)}, inward,
                        {1.2 + 2.0 * molar, 2.6 + 1.4 * molar, 3.2 + 1.2 * molar, 2.2 + 0.8 * molar},
                        {2.6 + 1.4 * molar, 3.2 + 1.6 * molar, 3.3 + 1.6 * molar, 2.2 + 1.4 * molar}, 10));
            for (const double root : {-1.0, 1.0}) {
                if (molar < 0.5 && root > 0.0) continue;
                const double aside = molar < 0.5 ? 0.0 : 2.2 * root;
                append(all, tube({at(0.43, 0.8 * aside), at(0.7, aside), at(1.0, 1.2 * aside)}, inward,
                                 {1.9 - 0.3 * molar, 1.3 - 0.2 * molar, 0.4},
                                 {1.6 - 0.4 * molar, 1.1 - 0.2 * molar, 0.4}, 8));
            }
        }
    }
    return all;
}

/// Cells of the mastoid: bubbles that hardly touch.
TriangleMesh mastoid_cells(const Chance& chance) {
    TriangleMesh cells;
    geometry::Random random(chance.field("mastoid cells"));
    for (const Side side : {left, right}) {
        for (int k = 0; k < 110; ++k) {
            const double x = random.between(-1, 1), y = random.between(-1, 1), z = random.between(-1, 1),
                         size = 0.7 + 1.9 * std::pow(random(), 2.0);
            if (x * x + y * y + z * z > 1.0) continue;
            append(cells,
                   ellipsoid(side.at(56 + 5.5 * x, 33 + 9 * y, -32 + 18 * z), size * Vec3(1.0, 1.1, 1.3), 6));
        }
    }
    return cells;
}

/// Sutures and the grooves of the meningeal arteries, as soft tissue in the bone of the vault.
TriangleMesh skull_grooves(const Chance& chance) {
    const shape::Solid cavity = cranial_cavity(chance);
    // On a ray from the middle of the vault, at a fraction of the thickness from the inner side.
    const auto on_vault = [&](const Vec3& toward, double fraction) -> Vec3 {
        const Vec3 direction = (toward - vault).normalized();
        double low = 30.0, high = 120.0;
        for (int k = 0; k < 18; ++k) {
            const double middle = 0.5 * (low + high);
            const Vec3 p = vault + middle * direction;
            (cavity.distance(p) < fraction * skull_thickness(p) ? low : high) = middle;
        }
        return vault + low * direction;
    };
    TriangleMesh grooves;
    geometry::Random random(chance.field("sutures"));
    const auto suture = [&](const std::vector<Vec3>& course) {
        Polyline path;
        std::vector<double> wide;
        for (std::size_t i = 0; i + 1 < course.size(); ++i) {
            const int steps = std::max(2, static_cast<int>((course[i + 1] - course[i]).norm() / 2.2));
            for (int k = 0; k < steps; ++k) {
                const Vec3 p = course[i] + (course[i + 1] - course[i]) * (static_cast<double>(k) / steps);
                const Vec3 out = (p - vault).normalized(),
                           aside = (course[i + 1] - course[i]).cross(out).normalized();
                const double jag = (k % 2 == 0 ? 1.0 : -1.0) * random.between(0.2, 2.0);
                path.push_back(on_vault(p + jag * aside, 0.5));
                wide.push_back(random.between(0.45, 0.9));
            }
        }
        append(grooves, tube(path, Vec3(0.31, 0.52, 0.79), wide, wide, 5));
    };
    const auto artery = [&](const std::vector<Vec3>& course, double radius) {
        Polyline path;
        std::vector<double> radii;
        for (std::size_t i = 0; i + 1 < course.size(); ++i) {
            for (int k = 0; k < 6; ++k) {
                const double t = k / 6.0;
                const double x = random.between(-1, 1), y = random.between(-1, 1), z = random.between(-1, 1);
                path.push_back(on_vault(course[i] + t * (course[i + 1] - course[i]) + Vec3(x, y, z), 0.12));
                radii.push_back(
                    radius * (1.0 - 0.7 * (static_cast<double>(i) + t) / static_cast<double>(course.size())));
            }
        }
        append(grooves, tube(path, Vec3(0.31, 0.52, 0.79), radii, radii, 6));
    };
    for (const Side side : {left, right}) {
        suture({Vec3(0, -8, 100), side.at(30, -10, 88), side.at(55, -14, 66), side.at(68, -20, 36),
                side.at(68, -24, 12)});
        suture({Vec3(0, 98, 66), side.at(22, 97, 48), side.at(42, 90, 24), side.at(56, 76, 0)});
        suture({side.at(70, -20, 14), side.at(74, 4, 24), side.at(74, 26, 18), side.at(70, 48, 2)});
        artery({side.at(62, -10, -8), side.at(70, -14, 12), side.at(70, -10, 36), side.at(60, -2, 62),
                side.at(40, 8, 86)},
               1.1);
        artery({side.at(70, -12, 24), side.at(72, 10, 40), side.at(66, 26, 60), side.at(48, 40, 80)}, 0.8);
        artery({side.at(66, -6, -4), side.at(74, 20, 6), side.at(73, 46, 22), side.at(62, 74, 36)}, 0.9);
        artery({side.at(74, 24, 10), side.at(74, 40, 36), side.at(64, 56, 60)}, 0.7);
    }
    suture({Vec3(0, -8, 100), Vec3(0, 30, 104), Vec3(0, 68, 92), Vec3(0, 98, 66)});
    return grooves;
}

/// Air on both sides of the nose's septum, around the conchae.
shape::Compound nasal_cavity(const Chance& chance) {
    // Narrow above, wide below; most of it filled by the conchae.
    shape::Compound air;
    for (const Side side : {left, right}) {
        air.add(shape::sweep({{side.at(4.5, -68, -39), 2, 7},
                              {side.at(5.5, -54, -37), 3.6, 13},
                              {side.at(5.5, -30, -38), 4, 12}},
                             Vec3::UnitX()));
        air.add(
            shape::sweep({{side.at(3.5, -66, -20), 1.5, 8}, {side.at(3.5, -34, -18), 1.6, 9}}, Vec3::UnitX()),
            0.0, 3.0);
        air.cut(shape::sweep({{side.at(10, -66, -44), 4, 5},
                              {side.at(8.5, -46, -42), 5.5, 7},
                              {side.at(9, -26, -41), 4, 5}},
                             Vec3::UnitX()),
                1.5);
        air.cut(shape::sweep({{side.at(9, -58, -28), 4, 5},
                              {side.at(8, -42, -27), 4.5, 5.5},
                              {side.at(8.5, -26, -27), 4, 4}},
                             Vec3::UnitX()),
                1.5);
        const shape::Solid septum = shape::block(Vec3(0, -46, -30), Vec3(1.6, 40, 40), 0.5);
        air.cut({[=, bend = septum_bend(chance)](const Vec3& p) {
                     return 0.9 * septum.distance(p - bend(p) * Vec3::UnitX());
                 },
                 {septum.box.min() - Vec3(5, 0, 0), septum.box.max() + Vec3(5, 0, 0)}},
                0.5);
    }
    return air;
}

/// The throat, from behind the nose down to the larynx.
shape::Compound throat() {
    const double larynx = 495.0 - place_in_body(geometry::Landmark::Sella).z();
    shape::Compound air;
    air.add(shape::sweep({{Vec3(0, -12, -38), 10, 6},
                          {Vec3(0, -3, -48), 12, 5},
                          {Vec3(0, -1, -66), 12, 5},
                          {Vec3(0, -5, -84), 12, 6},
                          {Vec3(0, -9, -104), 11, 5},
                          {Vec3(0, -8, larynx), 7, 5}},
                         Vec3::UnitX()));
    return air;
}

TriangleMesh placed(TriangleMesh mesh) {
    const Isometry3d to = at_sella();
    for (Vec3& v : mesh.vertices) v = to * v;
    return mesh;
}

}  // namespace

void add_head_layers(std::vector<TissueLayer>& layers, const Chance& chance) {
    add_brain_layers(layers, chance, shape::grown(cranial_cavity(chance), -1.5), at_sella());
    const shape::Compound air = sinuses(chance);
    const shape::Compound walls = air.grown_by(sinus_wall);
    layers.push_back({"teeth", Material::CorticalBone, Material::SoftTissue, placed(teeth(chance)), false});
    layers.push_back({"sinus walls", Material::CorticalBone, Material::SoftTissue,
                      placed(shape::polygonised(walls, sinus_cell).outer), false});
    layers.push_back({"sinuses", Material::Air, Material::CorticalBone,
                      placed(shape::polygonised(air, sinus_cell).outer), false});
    layers.push_back({"skull grooves", Material::SoftTissue, Material::CorticalBone,
                      placed(skull_grooves(chance)), false});
    layers.push_back(
        {"mastoid cells", Material::Air, Material::TrabecularBone, placed(mastoid_cells(chance)), false});
    layers.push_back({"nasal cavity", Material::Air, Material::SoftTissue,
                      placed(shape::polygonised(nasal_cavity(chance), sinus_cell).outer), false});
    layers.push_back({"throat", Material::Air, Material::SoftTissue,
                      placed(shape::polygonised(throat(), 2.5).outer), false});
}

}  // namespace render
