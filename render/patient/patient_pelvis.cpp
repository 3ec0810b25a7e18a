#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using geometry::degree;

namespace {

constexpr double hip_plaques = 0.55, femoral_plaques = 0.4;  // [mm]
constexpr double hip_cell = 2.5, femoral_cell = 2.2;         // of the grids [mm]

/// Middle of the left hip joint: 178 mm between both (estimate; texts give 160 to 190), head 24 mm in radius
/// (men: 48 to 50 mm in diameter).
const Vec3 hip_joint(89.0, 10.0, -152.0);
constexpr double head_radius = 24.0, joint_space = 3.5;

/// The left hip bone. Heights: crest 140 mm above the joint, tuberosity 68 below; 280 mm between the crests
/// (Gray: bi-iliac breadth of men 28 cm); cup open 45° down and 17° forward (typical: inclination 40 to 45°,
/// anteversion 15 to 20°; as defined by Murray 1993).
shape::Compound hip_bone(const Chance& chance) {
    shape::Compound shape;
    // The blade, from the notch behind to the front border, at heights from the cup up to the crest.
    shape.add(
        shape::sheet({{-146, {{66, 36, 9}, {71, 32, 11}, {76, 26, 11}, {80, 16, 9}, {84, 2, 8}}},
                      {-130, {{60, 44, 5}, {67, 39, 8}, {76, 29, 10}, {85, 14, 11}, {93, -10, 9}}},
                      {-116, {{51, 57, 5}, {62, 47, 6}, {75, 33, 6.5}, {87, 13, 7.5}, {99, -19, 6.5}}},
                      {-100, {{45, 72, 7}, {61, 55, 6}, {79, 37, 3.8}, {94, 13, 4.4}, {107, -24, 5}}},
                      {-84, {{43, 81, 7}, {66, 61, 5}, {88, 40, 2.9}, {104, 13, 3}, {117, -32, 4.5}}},
                      {-68, {{46, 83, 6}, {73, 63, 3.6}, {97, 42, 2.7}, {114, 13, 2.8}, {125, -36, 4.5}}},
                      {-52, {{60, 77, 4.5}, {87, 60, 3}, {108, 42, 2.7}, {123, 16, 2.8}, {131, -24, 4}}},
                      {-34, {{84, 65, 4}, {105, 50, 2.8}, {120, 34, 2.8}, {131, 14, 2.8}, {135, -8, 4}}},
                      {-20, {{112, 46, 4}, {121, 36, 3.5}, {127, 26, 3.5}, {132, 17, 4}, {135, 8, 5}}}}),
        0.6, 0.0);
    // Crest, from the posterior to the anterior superior spine, with its tubercle.
    shape.add(shape::sweep({{Vec3(42, 84, -80), 7, 7},
                            {Vec3(50, 82, -60), 5.5, 5.5},
                            {Vec3(72, 73, -40), 4.5, 4.5},
                            {Vec3(100, 55, -24), 4.5, 4.5},
                            {Vec3(122, 33, -15), 5.5, 4.5},
                            {Vec3(135, 8, -20), 8, 5},
                            {Vec3(136, -12, -36), 6, 4.5},
                            {Vec3(131, -28, -54), 5, 4.5},
                            {Vec3(124, -37, -70), 6, 6}},
                           Vec3::UnitX()),
              1.1, 5.0);
    shape.add(shape::cone(Vec3(105, -24, -114), Vec3(97, -16, -126), 6.5, 9.0), 1.1, 6.0);
    // Brim: from the joint with the sacrum to the pubis.
    shape.add(shape::sweep({{Vec3(56, 44, -104), 5, 5},
                            {Vec3(65, 30, -118), 6, 6},
                            {Vec3(70, 14, -132), 7, 8},
                            {Vec3(66, -4, -144), 8, 9},
                            {Vec3(52, -18, -148), 6.5, 7.5},
                            {Vec3(32, -27, -154), 6, 7},
                            {Vec3(13, -31, -161), 7, 8}},
                           Vec3::UnitY()),
              1.3, 6.0);
    shape.add(shape::ellipsoid(Vec3(10, -28, -170), Vec3(8.2, 8, 20)), 1.1, 5.0);
    shape.add(shape::sweep({{Vec3(10, -25, -182), 5.5, 7},
                            {Vec3(22, -14, -198), 4.5, 6.5},
                            {Vec3(38, 6, -214), 5, 8},
                            {Vec3(50, 22, -218), 10, 12},
                            {Vec3(57, 34, -214), 12, 13}},
                           Vec3(0.6, -0.5, 0.2)),
              1.1, 5.0);
    // Ischium with its spine.
    shape.add(shape::sweep({{Vec3(74, 35, -150), 11, 9},
                            {Vec3(72, 37, -172), 12, 11},
                            {Vec3(66, 37, -192), 12, 12},
                            {Vec3(57, 32, -210), 14, 14}},
                           Vec3::UnitX()),
              1.3, 6.0);
    shape.add(shape::cone(Vec3(67, 45, -158), Vec3(56, 53, -164), 6.0, 1.2), 0.6, 6.0);
    // The cup: cartilage lies between it and the head; its floor is deeper below and has no cartilage.
    const Vec3 opening = Vec3(0.70, -0.24, -0.67).normalized();
    shape.add(shape::ball(hip_joint + Vec3(-1, 2, 2), head_radius + joint_space + 3.6), 0.8, 9.0);
    // The roof bears on the ilium.
    shape.add(shape::ellipsoid(hip_joint + Vec3(4, 5, 30), Vec3(24, 19, 24)), 0.8, 10.0);
    shape.cut(shape::ball(hip_joint, head_radius + joint_space), 0.8);
    shape.cut(shape::ball(hip_joint - Vec3(7, 0, 6), 23.0), 2.0);
    shape::Solid mouth = shape::half_space(hip_joint + 2.0 * opening, -opening);
    const Vec3 around = Vec3::Constant(60.0);
    mouth = {[beyond = mouth.distance](const Vec3& p) {
                 // The rim is wavy: low in front, higher behind and above.
                 const Vec3 q = p - hip_joint;
                 const double wave = 0.16 * q.y() + 4.0 * std::sin(std::atan2(q.y(), q.z()) * 2.0 + 0.6);
                 return std::max(beyond(p) + wave, (p - hip_joint).norm() - head_radius - joint_space - 9.0);
             },
             {hip_joint - around, hip_joint + around}};
    shape.cut(mouth, 5.0);
    // Notch below.
    shape.cut(shape::cone(hip_joint + Vec3(4, -6, -18), hip_joint + Vec3(6, -12, -42), 11.0, 10.0), 3.0);
    shape.cut(shape::half_space(Vec3(2.2, 0, 0), Vec3::UnitX()), 0.0);  // symphysis
    // The joint with the sacrum, some 2.5 mm wide: both faces are rough.
    shape.clear_of(sacrum(), 3.2);
    shape.roughen(0.42, 0.3, chance.field("hip cortex"));
    return shape;
}

/// Where the shaft of the left femur begins, and its direction: neck–shaft angle 127°, anteversion 14°,
/// offset 43 mm (Noble et al., Clin Orthop 1988: 125°, 43 mm); shaft leans 7° inward.
const Vec3 shaft_top = hip_joint + Vec3(43.0, 10.0, -32.0);
const Vec3 shaft_direction(-0.115, -0.02, -0.993);

Vec3 along_shaft(double length, double x = 0.0, double y = 0.0) {
    // Bowed forward by 8 mm at the middle of 420 mm.
    const double bow = -8.0 * std::sin(std::numbers::pi * std::clamp(length / 420.0, 0.0, 1.0));
    return shaft_top + length * shaft_direction + Vec3(x, y + bow, 0.0);
}

double length_of_shaft(double low) {
    return std::max(60.0, (shaft_top.z() - low) / -shaft_direction.z() - 14.0);
}

/// Its canal, from below the trochanters.
std::vector<shape::Station> femoral_canal(double low) {
    const double length = std::min(length_of_shaft(low) - 8.0, 330.0);
    std::vector<shape::Station> canal;
    for (const auto& [s, radius] :
         {std::pair{26.0, 3.0}, {38.0, 6.0}, {56.0, 7.4}, {90.0, 6.4}, {150.0, 5.9}, {240.0, 6.0}}) {
        if (s < length - 10.0) canal.push_back({along_shaft(s), radius, radius});
    }
    canal.push_back({along_shaft(length), 6.0, 6.0});
    return canal;
}

/// The left femur down to a height. Neck 34 mm high and 27 wide, shaft 29 mm wide with walls of 7 mm; head
/// 48 mm (Noble 1988; Gray).
shape::Compound femur(const Chance& chance, double low) {
    const auto along = [](double length, double x = 0.0, double y = 0.0) {
        return along_shaft(length, x, y);
    };
    const double length = length_of_shaft(low);
    std::vector<shape::Station> shaft;
    for (double s : {-12.0, 10.0, 35.0, 60.0, 100.0, 160.0, 240.0, 320.0, 380.0}) {
        if (s > length) break;
        const double wide = s < 20.0 ? 17.0 : s < 50.0 ? 16.5 : s < 300.0 ? 14.4 : s < 350.0 ? 15.5 : 20.0;
        shaft.push_back({along(s), wide, wide - 0.5});
    }
    shaft.push_back({along(length), length > 330.0 ? 19.0 : 14.4, length > 330.0 ? 16.0 : 14.0});
    shape::Compound shape;
    // The wall thickens from the trochanters to the middle of the shaft, most on the inner side (calcar).
    shape.add(
        shape::sweep(shaft, Vec3::UnitX()),
        [](const Vec3& p) {
            const double s = (p - shaft_top).dot(shaft_direction);
            const double inner = std::clamp((shaft_top.x() - 0.115 * s - p.x()) / 14.0, 0.0, 1.0);
            return 1.2 +
                   5.3 * std::clamp((s - 8.0) / 60.0, 0.0, 1.0) * std::clamp((400.0 - s) / 90.0, 0.25, 1.0) +
                   2.6 * inner * std::exp(-std::pow((s - 22.0) / 22.0, 2.0));
        },
        9.2, 0.0);
    const Vec3 neck = hip_joint - shaft_top;
    shape.add(
        shape::sweep(
            {{shaft_top + 0.08 * neck, 16, 19}, {shaft_top + 0.45 * neck, 13.2, 17.2}, {hip_joint, 14, 18}},
            neck.cross(Vec3::UnitZ())),
        [](const Vec3& p) {
            return p.z() < hip_joint.z() - 10.0 - 0.5 * (p.x() - hip_joint.x()) ? 2.6 : 1.1;
        },
        2.6, 7.0);
    shape.add(shape::ball(hip_joint, head_radius), 0.8, 2.5);
    shape.cut(shape::ball(hip_joint + Vec3(-25.0, 4.0, -4.0), 5.0), 2.0);  // fovea
    // Trochanters and the crest between them.
    shape.add(shape::ellipsoid(hip_joint + Vec3(50, 18, -20), Vec3(11, 14, 22),
                               AngleAxisd(-8.0 * degree, Vec3::UnitY()).toRotationMatrix()),
              1.0, 7.0);
    shape.add(shape::cone(along(24, -6, 6), along(30, -14, 15), 10.0, 4.5), 1.2, 9.0);
    shape.add(
        shape::sweep(
            {{hip_joint + Vec3(48, 28, -16), 6, 5}, {along(8, -2, 15), 5, 5}, {along(28, -12, 14), 5, 5}},
            Vec3::UnitX()),
        1.2, 6.0);
    shape.roughen(0.16, 0.4, chance.field("femoral cortex"), femoral_plaques);
    return shape;
}

/// Principal compressive and tensile trabeculae of the head and neck (Singh 1970), others of the trochanters.
void add_femoral_struts(Bones& bones, const shape::Compound& shape, const Chance& chance, double side,
                        const Isometry3d& place) {
    geometry::Random random(chance.field("femoral trabeculae", side > 0.0 ? 0 : 1));
    const auto add = [&](const std::vector<Vec3>& arc, double spread, int count, double most) {
        for (int k = 0; k < count; ++k) {
            const double u = random.between(-spread, spread), v = random.between(-13.0, 13.0),
                         radius = random.between(0.25, most);
            for (std::size_t i = 0; i + 1 < arc.size(); ++i) {
                if (random() < 0.25) continue;
                const double widen = 0.6 + 0.4 * static_cast<double>(i + 1);
                const Vec3 across = (arc[i + 1] - arc[i]).cross(Vec3::UnitY()).normalized();
                const Vec3 from = arc[i] + u * (widen - 0.4) * across + Vec3(0, v, 0),
                           to = arc[i + 1] + u * widen * across + Vec3(0, v + random.between(-2.0, 2.0), 0);
                if (shape.at(from).distance > -2.2 || shape.at(to).distance > -2.2) continue;
                const auto sided = [&](Vec3 p) {
                    p.x() *= side;
                    return Vec3(place * p);
                };
                bones.add_trabecula(sided(from), sided(to), radius);
            }
        }
    };
    const Vec3& c = hip_joint;
    add({c + Vec3(27, 5, -38), c + Vec3(17, 4, -22), c + Vec3(7, 2, -6), c + Vec3(-1, 0, 10),
         c + Vec3(-4, 0, 21)},
        7.0, 150, 0.7);
    add({c + Vec3(56, 14, -48), c + Vec3(48, 12, -24), c + Vec3(34, 8, -10), c + Vec3(18, 4, -2),
         c + Vec3(2, 1, -5), c + Vec3(-13, 0, -12)},
        5.0, 110, 0.6);
    add({c + Vec3(30, 9, -52), c + Vec3(38, 12, -34), c + Vec3(48, 16, -16), c + Vec3(52, 18, -2)}, 8.0, 40,
        0.4);
}

/// Moves the vertices from `first` on by up to some 3 mm, but none at the joints: the halves of a pelvis are
/// not mirror images.
void make_uneven(geometry::TriangleMesh& mesh, std::size_t first, const Chance& chance, const Side side) {
    if (!chance.varied()) return;
    std::uint64_t fields[3];
    for (int k = 0; k < 3; ++k) fields[k] = chance.field("uneven hips", (side.sign > 0.0 ? 0 : 3) + k);
    const Vec3 joint = side.at(hip_joint.x(), hip_joint.y(), hip_joint.z());
    for (std::size_t i = first; i < mesh.vertices.size(); ++i) {
        Vec3& p = mesh.vertices[i];
        const double off_joint = std::clamp(((p - joint).norm() - 34.0) / 30.0, 0.0, 1.0),
                     off_sacrum = std::clamp((std::abs(p.x()) - 58.0) / 24.0, 0.0, 1.0);
        Vec3 by;
        for (int k = 0; k < 3; ++k) by[k] = shape::noise(p, 75.0, fields[k]);
        p += 3.2 * off_joint * off_sacrum * by;
    }
}

}  // namespace

void add_pelvis(Bones& bones, const Chance& chance, double low) {
    const shape::Compound hip_shape = hip_bone(chance);
    const shape::Surfaces hip = shape::polygonised(hip_shape, hip_cell);
    const shape::Compound thigh = femur(chance, low);
    const shape::Surfaces thigh_bone = shape::polygonised(thigh, femoral_cell);
    // Nobody lies quite straight: the legs turn by a few degrees about their joints.
    for (const Side side : {left, right}) {
        const int index = side.sign > 0.0 ? 0 : 1;
        const Vec3 joint = side.at(hip_joint.x(), hip_joint.y(), hip_joint.z());
        const Isometry3d turned =
            Translation3d(joint) *
            AngleAxisd(
                (side.sign * (index == 0 ? 3.0 : 5.0) + 4.0 * chance.normal("turn of the leg", index)) *
                    degree,
                Vec3::UnitZ()) *
            AngleAxisd(1.0 * chance.normal("abduction", index) * degree, Vec3::UnitY()) *
            Translation3d(-joint);
        const std::size_t outer = bones.outer.vertices.size(), core = bones.core.vertices.size();
        const Isometry3d still = Isometry3d::Identity();
        index == 0 ? bones.add(hip, still, hip_plaques) : bones.add_mirrored(hip, still, hip_plaques);
        bones.add_grain(hip_shape, 0.25, 10.0, 5.0, Vec3(0.35, 0, 0.5), chance.field("hip trabeculae", index),
                        still, index == 1);
        make_uneven(bones.outer, outer, chance, side);
        make_uneven(bones.core, core, chance, side);
        index == 0 ? bones.add(thigh_bone, turned, femoral_plaques)
                   : bones.add_mirrored(thigh_bone, turned, femoral_plaques);
        add_femoral_struts(bones, thigh, chance, side.sign, turned);
        bones.add_grain(thigh, 0.3, 16.0, 4.0, Vec3(-0.2, 0, 0.6), chance.field("femoral grain", index),
                        turned, index == 1);
        bones.add_canal(femoral_canal(low), chance.field("femoral canal", index), turned, index == 1);
    }
}

}  // namespace render
