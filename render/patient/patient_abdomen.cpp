#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/geometry/polyline.h"
#include "render/patient/patient_parts.h"

namespace render {

using geometry::Polyline;
using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

/// Ilium as a curved blade, pubic rami and ischium as tubes around the foramen, femoral head and neck.
void add_hip(Bones& bones, Side side) {
    const auto at = [&](double x, double y, double z) { return side.at(x, 16.0 + y, sacrum_top + z); };
    // Blade: long half-axis forward and outward, thin across.
    const Vec3 blade = side.at(0.62, -0.78, 0.0).normalized();
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
    add_ellipsoid(bones, head, Vec3(23, 23, 23), 1.2, 28);
    add_tube(bones, {at(112, -5, -104), at(128, -3, -116), at(140, -1, -128)}, Vec3::UnitY(), {14, 13, 16},
             {15, 15, 22}, 2.0);
    add_tube(bones, {at(141, 0, -112), at(144, 0, -140), at(140, 0, -180), at(136, 0, -260)}, Vec3::UnitX(),
             {15, 18, 15, 14}, {15, 18, 15, 14}, 4.0);
}

/// Gas in a piece of bowel along a path, bulging between its folds.
TriangleMesh haustra(const Polyline& path, double width, double depth, double fold) {
    Polyline fine;
    std::vector<double> a, b;
    double travelled = 0.0;
    const double length = geometry::length_of(path);
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
    return tube(fine, Vec3::UnitX() + 0.4 * Vec3::UnitZ(), a, b, 18);
}

/// Colon on both sides, some loops between. Fixed places, so that frames repeat.
TriangleMesh bowel_gas(double front) {
    const auto at = [&](double x, double y, double z) -> Vec3 { return {x, front + 45.0 + y, z}; };
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
    append(gas, ellipsoid({58, -30, 203}, {26, 24, 10}, 20));  // of the stomach, under its dome
    return gas;
}

struct Kidney {
    TriangleMesh fat;
    TriangleMesh organ;
};

/// A kidney in its fat next to L1 to L3, the left one higher.
Kidney kidney(Side side) {
    const double middle = side.sign > 0.0 ? 84.0 : 70.0;
    const auto at = [&](double x, double y, double z) { return side.at(x, y, middle + z); };
    // The long axis leans outward and forward below.
    const Polyline path{at(48, 30, 56),  at(49, 29, 52),  at(51, 28, 42),  at(55, 25, 20), at(60, 21, -4),
                        at(65, 16, -28), at(68, 12, -44), at(70, 10, -52), at(70, 10, -55)};
    Polyline wide;
    for (const Vec3& p : path) wide.push_back(p + 0.30 * (p - path[4]));
    return {
        tube(wide, Vec3::UnitX(), {9, 17, 26, 35, 38, 36, 29, 20, 9}, {9, 16, 23, 28, 29, 27, 22, 15, 7}, 28),
        tube(path, Vec3::UnitX(), {4, 12, 20, 26, 25, 25, 19, 11, 4}, {3, 9, 15, 19, 20, 19, 15, 9, 3}, 28)};
}

}  // namespace

void add_pelvis(Bones& bones) {
    for (const Side side : {left, right}) add_hip(bones, side);
}

void add_abdomen_layers(std::vector<TissueLayer>& layers, double front, bool gas) {
    Kidney on_left = kidney(left), on_right = kidney(right);
    append(on_left.fat, on_right.fat);
    layers.push_back({"kidney fat", Material::Adipose, Material::SoftTissue, std::move(on_left.fat), false});
    layers.push_back(
        {"left kidney", Material::SoftTissue, Material::Adipose, std::move(on_left.organ), false});
    layers.push_back(
        {"right kidney", Material::SoftTissue, Material::Adipose, std::move(on_right.organ), false});
    if (gas) layers.push_back({"bowel gas", Material::Air, Material::SoftTissue, bowel_gas(front), false});
}

}  // namespace render
