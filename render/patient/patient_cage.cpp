#include <Eigen/Geometry>

#include "render/patient/patient_parts.h"

namespace render {

using geometry::Polyline;
using geometry::Vec3;

namespace {

constexpr double pleura_to_rib = 5.0;     // from the lungs to the middle of a rib [mm]
constexpr double sternum_to_skin = 26.0;  // from the lungs' front to the skin [mm]

/// The course of a rib: the angle where its bone ends [rad], and how far that is below its vertebra [mm].
struct Rib {
    double reach, drop, half_height;
};
constexpr Rib ribs[] = {{2.35, 30, 6.5},  {2.55, 52, 5.5},  {2.60, 66, 5.6},  {2.58, 78, 5.8},
                        {2.55, 88, 6.0},  {2.50, 98, 6.2},  {2.42, 106, 6.4}, {2.25, 110, 6.4},
                        {2.05, 108, 6.2}, {1.85, 102, 6.0}, {1.45, 78, 5.4},  {0.95, 48, 4.6}};

/// From the lung to the middle of a rib; more where the cage narrows upward and ribs lie flatter [mm].
double rib_gap(double z) {
    return pleura_to_rib + 8.0 * std::clamp((z - 360.0) / 55.0, 0.0, 1.0);
}

void add_rib(Bones& bones, const Chest& chest, int number, Side side) {
    const Rib& rib = ribs[number - 1];
    const Vertebra& origin = vertebrae()[17 - number];  // T1 is the 17th from below
    const double top = origin.z + 0.55 * origin.half_height;
    Polyline path;
    std::vector<double> half_height, half_thickness;
    const auto add = [&](const Vec3& p, double share) {
        path.push_back(p);
        half_height.push_back(share * rib.half_height);
        half_thickness.push_back(share * 3.2);
    };
    // Head at the vertebra, neck behind the lung.
    const CageSection at_neck = chest.section(top);
    add(side.at(origin.half_width + 1.0, origin.front + 2.0 * origin.half_depth - 4.0, top), 0.8);
    add(side.at(origin.half_width + 12.0, at_neck.middle + at_neck.half_depth + pleura_to_rib + 1.0,
                top + 1.0),
        0.72);
    double start = 0.40;  // where the rib meets the cage: well outside its neck [rad]
    while (at_neck.point(start, top, rib_gap(top)).x() < origin.half_width + 24.0) start += 0.02;
    const int steps = static_cast<int>(6.0 + 8.0 * rib.reach);
    for (int i = 0; i <= steps; ++i) {
        const double t = double(i) / steps, angle = start + t * (rib.reach - start);
        // Steepest at the side; the front end turns up a little.
        const double z = top - rib.drop * (0.25 * t + 0.75 * (t * t * (3.0 - 2.0 * t)));
        Vec3 p = chest.section(z).point(angle, z, rib_gap(z));
        p.x() *= side.sign;
        add(p, t == 1.0 ? 0.85 : 1.0);
    }
    add_tube(bones, path, Vec3::UnitZ(), half_height, half_thickness, 1.0, 12);
}

void add_shoulder(Bones& bones, const Chest& chest, Side side) {
    const auto behind = [&](double x, double z, double gap) {
        const CageSection cage = chest.section(z);
        const double share = std::min(x / (cage.half_width + 12.0), 0.97);
        const double y =
            cage.middle + (cage.half_depth + gap) * std::pow(1.0 - std::pow(share, 2.3), 1.0 / 2.3);
        return side.at(x, y, z);
    };
    const CageSection top = chest.section(405.0);
    const double manubrium = top.middle - top.half_depth - 7.0;
    add_tube(bones,
             {side.at(13, manubrium + 1.0, 407), side.at(16, manubrium, 409),
              side.at(22, manubrium - 2.0, 411), side.at(38, manubrium - 2.0, 414),
              side.at(75, manubrium + 8.0, 423), side.at(112, manubrium + 34.0, 430),
              side.at(144, manubrium + 47.0, 433), side.at(150, manubrium + 48.0, 433)},
             Vec3::UnitZ(), {4, 8, 9, 6, 5.5, 5.5, 7, 4}, {4, 8, 8, 6, 5.5, 5, 5, 3}, 1.4);
    const Vec3 glenoid = side.at(148, manubrium + 62.0, 410);
    // Blade from the superior to the inferior angle, its long half-axis across the back.
    add_tube(bones,
             {behind(88, 432, 20), behind(98, 424, 20), behind(104, 405, 20), behind(106, 380, 20),
              behind(104, 350, 20), behind(100, 322, 20), behind(96, 300, 20), behind(95, 293, 20)},
             side.at(0.82, -0.57, 0.0), {10, 28, 40, 37, 28, 19, 11, 4}, {2, 2.2, 2.2, 2, 2, 2.4, 3, 2}, 0.8);
    add_tube(bones,
             {behind(66, 402, 25), behind(100, 412, 32), glenoid + side.at(-6, 24, 14),
              glenoid + side.at(10, 4, 24)},
             Vec3::UnitZ(), {3, 6, 6, 5}, {3, 5, 9, 10}, 1.0);
    add_ellipsoid(bones, glenoid + side.at(26, 2, 2), Vec3(23, 23, 23), 1.2);
    add_tube(bones, {glenoid + side.at(32, 2, -14), glenoid + side.at(35, 2, -40)}, Vec3::UnitX(), {17, 12},
             {17, 12}, 2.5);
}

}  // namespace

Vec3 CageSection::point(double angle, double z, double outward) const {
    const double c = std::cos(angle), s = std::sin(angle), power = 2.0 / exponent;
    return {(half_width + outward) * std::copysign(std::pow(std::abs(s), power), s),
            middle + (half_depth + outward) * std::copysign(std::pow(std::abs(c), power), c), z};
}

bool CageSection::holds(double x, double y, double inset) const {
    const double a = std::abs(x) / (half_width - inset), b = std::abs(y - middle) / (half_depth - inset);
    // Powers are slow, and not needed for places well within the ellipse.
    if (exponent >= 2.0 && a >= 0.0 && b >= 0.0 && a * a + b * b < 0.999) return true;
    return std::pow(a, exponent) + std::pow(b, exponent) < 1.0;
}

CageSection Chest::section(double z) const {
    constexpr double width[][2] = {{100, 122}, {180, 132}, {240, 136}, {290, 133}, {330, 125}, {365, 110},
                                   {395, 90},  {418, 70},  {434, 54},  {447, 40},  {460, 30}};
    constexpr double behind[][2] = {{100, 44}, {180, 50}, {300, 52}, {380, 48}, {420, 40}, {447, 32}};
    // How far the front of the cage lies behind its foremost point.
    constexpr double front_slope[][2] = {{100, 0},  {250, 0},  {330, 10}, {365, 22},
                                         {400, 44}, {425, 60}, {447, 74}};
    const double back = spine_front(z) + interpolated(behind, z);
    const double foremost = front + sternum_to_skin + interpolated(front_slope, z);
    return {interpolated(width, z), 0.5 * (back - foremost), 0.5 * (back + foremost)};
}

void add_cage(Bones& bones, const Chest& chest) {
    for (int number = 1; number <= 12; ++number) {
        for (const Side side : {left, right}) add_rib(bones, chest, number, side);
    }
    Polyline sternum;
    for (double z : {410.0, 407.0, 396.0, 372.0, 364.0, 330.0, 290.0, 262.0, 248.0, 244.0}) {
        const CageSection cage = chest.section(z);
        sternum.push_back({0.0, cage.middle - cage.half_depth - pleura_to_rib - 1.0, z});
    }
    add_tube(bones, sternum, Vec3::UnitX(), {12, 22, 26, 17, 16, 19, 21, 14, 8, 4},
             {3, 5, 5.5, 5, 4.5, 4.5, 4.5, 4, 3, 2}, 1.0, 24);
    for (const Side side : {left, right}) add_shoulder(bones, chest, side);
}

}  // namespace render
