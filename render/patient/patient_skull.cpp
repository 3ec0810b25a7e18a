#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {

using Eigen::Isometry3d;
using Eigen::Translation3d;

namespace {

constexpr double skull_cell = 2.15;  // of the grid [mm]

double step_up(double from, double to, double x) {
    const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

double bell(double x) {
    return std::exp(-x * x);
}

/// Height of the floor that the brain lies on: roofs of the orbits, middle fossae, clivus and posterior
/// fossa.
double floor_of(double x, double y) {
    const double aside = std::abs(x);
    // Front: orbital roofs rise to the sides of the cribriform plate.
    const double front =
        3.0 + 10.0 * bell((aside - 30.0) / 20.0) * bell((y + 48.0) / 30.0) - 5.0 * bell(x / 7.0);
    const double middle = 1.0 - 24.0 * step_up(10.0, 24.0, aside) + 16.0 * step_up(48.0, 66.0, aside);
    const double behind = -12.0 - 30.0 * step_up(10.0, 26.0, y) + 24.0 * step_up(70.0, 104.0, y) +
                          10.0 * step_up(35, 66, aside);
    const double wing = -14.0 - 0.35 * aside, petrous = 10.0 + 0.55 * aside;
    const double to_middle = step_up(wing - 5.0, wing + 5.0, y),
                 to_behind = step_up(petrous - 7.0, petrous + 7.0, y);
    const double fore = front + to_middle * (middle - front);
    return fore + to_behind * (behind - fore);
}

}  // namespace

Isometry3d at_sella() {
    return Isometry3d(Translation3d(place_in_body(geometry::Landmark::Sella)));
}

shape::Solid cranial_cavity(const Chance& chance) {
    const std::uint64_t field = chance.field("impressions of the brain");
    const double broad = 1.0 + 0.02 * chance.normal("breadth of the skull"),
                 tall = 1.0 + 0.015 * chance.normal("height of the skull");
    return {[=](const Vec3& p) {
                const double widen = 66.0 * broad + 4.0 * std::clamp((p.y() - 10.0) / 40.0, -2.0, 1.0);
                const Vec3 q =
                    (p - vault).cwiseQuotient(Vec3(widen, 84.0, 64.0 * tall)).cwiseAbs().cwiseMax(1e-6);
                const Vec3 power(std::pow(q.x(), 1.3), std::pow(q.y(), 1.3), std::pow(q.z(), 1.3));
                const double sum = power.dot(q), k0 = std::pow(sum, 1.0 / 2.3);
                const double slope = power.cwiseQuotient(Vec3(widen, 84.0, 64.0 * tall)).norm() * k0 / sum;
                const double round = (k0 - 1.0) / slope + 0.5 * shape::noise(p, 13.0, field);
                // The brain leaves ridges and hollows on its floor.
                const double ridges = 0.9 * shape::noise(Vec3(p.x(), p.y(), 0.0), 17.0, field + 1);
                const double floor = 0.72 * (floor_of(p.x(), p.y()) + ridges - p.z());
                return std::max(round, floor) +
                       0.25 * std::pow(std::max(0.0, 4.0 - std::abs(round - floor)), 2.0) / 4.0;
            },
            {vault - Vec3(80, 92, 90), vault + Vec3(80, 92, 72)}};
}

/// Thickness of the skull: 6 to 8 mm in the vault, thin at the temples, over the orbits and in the middle
/// fossae (Lynnerup 2001: frontal 6.6 to 7.5, occipital 7.3; temporal squama 2 to 4: texts).
double skull_thickness(const Vec3& p) {
    const double temple =
        bell((std::abs(p.x()) - 70.0) / 16.0) * bell((p.y() - 2.0) / 30.0) * bell((p.z() - 8.0) / 26.0);
    const double base = step_up(6.0, -14.0, p.z());
    const double behind = 2.0 * bell((p - Vec3(0, 108, -6)).norm() / 22.0);
    const double roofs = bell((std::abs(p.x()) - 28.0) / 17.0) * bell((p.y() + 40.0) / 22.0) *
                         (1.0 - step_up(16.0, 26.0, p.z()));
    return std::max(
        1.4, 6.8 - 3.8 * temple - 3.2 * base * (1.0 - step_up(40.0, 70.0, p.y())) + behind - 4.6 * roofs);
}

std::function<double(const Vec3&)> septum_bend(const Chance& chance) {
    const double most = std::clamp(0.8 + 1.3 * chance.normal("septum of the nose"), -2.6, 2.6),
                 lower = 0.7 * chance.normal("lower septum");
    return [=](const Vec3& p) {
        return bell((p.y() + 50.0) / 17.0) *
               (most * bell((p.z() + 25.0) / 10.0) + lower * bell((p.z() + 42.0) / 8.0));
    };
}

shape::Compound sinuses(const Chance& chance) {
    shape::Compound air;
    geometry::Random random(chance.field("sinuses"));
    const std::uint64_t field = chance.field("walls of the sinuses");
    const auto add = [&](const shape::Solid& solid, double blend) {
        air.add(shape::warped(solid, 2.8, 15.0, field), 0.0, blend);
    };
    const auto size = [&](const char* name, int index) { return 1.0 + 0.07 * chance.normal(name, index); };
    for (const Side side : {left, right}) {
        const int index = side.sign > 0.0 ? 0 : 1;
        // Maxillary: a pyramid toward the cheek bone. 34 high, 33 deep, 27 wide (texts).
        // No two alike, with recesses toward palate, cheek bone and nose.
        const double m = size("maxillary sinus", index) * (index == 0 ? 1.06 : 0.93);
        const double low = 2.0 * chance.normal("floor of the sinus", index), back = index == 0 ? 1.5 : -2.0;
        add(shape::ellipsoid(side.at(27, -42 + back, -32), m * Vec3(11, 12.5, 11)), 0.0);
        add(shape::ellipsoid(side.at(35, -51 + back, -29), m * Vec3(9, 7, 7)), 7.0);
        add(shape::ellipsoid(side.at(22, -38 + back, -46 + low), m * Vec3(6, 11, 7)), 9.0);
        add(shape::ellipsoid(side.at(25, -55 + back, -42 - low), m * Vec3(6, 6, 8)), 6.0);
        // Frontal: lobes beside a septum, seldom alike.
        const double f = 1.0 + 0.22 * chance.normal("frontal sinus", index) + (index == 0 ? 0.1 : -0.12);
        add(shape::ellipsoid(side.at(8, -63.5, 15), Vec3(6.0, 4.0, 10 * f)), 0.0);
        add(shape::ellipsoid(side.at(17, -62, 17), Vec3(6.5 * f, 3.5, 8 * f)), 3.0);
        add(shape::ellipsoid(side.at(26, -59.5, 15), Vec3(5.5 * f, 2.6, 5.5 * f)), 2.5);
        // Sphenoidal: two halves.
        const double s = size("sphenoidal sinus", index);
        add(shape::ellipsoid(side.at(7.6, -14, -16), Vec3(6.2, 10.5 * s, 7.5)), 0.0);
        // Ethmoidal cells, three by three.
        for (int k = 0; k < 9; ++k) {
            const double x = random.between(-0.7, 0.7), y = random.between(-1, 1), z = random.between(-1, 1);
            add(shape::ellipsoid(
                    side.at(9.0 + x, -58.0 + 11.5 * (k % 3) + 2.6 * y, -13.0 + 8.2 * (k / 3) + 1.6 * z),
                    Vec3(4.2 + 1.0 * x, 4.9 + 1.3 * z, 3.5 + 0.9 * y)),
                0.0);
        }
        // Outer ear canal.
        air.add(shape::cone(side.at(45, 24, -21), side.at(66, 23, -23), 2.4, 3.0), 0.0, 0.0);
    }
    return air;
}

namespace {

/// A sheet's mirror image.
shape::Solid mirrored(shape::Solid solid) {
    Eigen::AlignedBox3d box(Vec3(-solid.box.max().x(), solid.box.min().y(), solid.box.min().z()),
                            Vec3(-solid.box.min().x(), solid.box.max().y(), solid.box.max().z()));
    return {[own = std::move(solid.distance)](const Vec3& p) { return own({-p.x(), p.y(), p.z()}); }, box};
}

/// The eye's socket: a cone from the optic canal to the rim, 40 × 35 mm (texts).
shape::Solid orbit(const Side side) {
    return shape::sweep({{side.at(14, -17, -1), 3.5, 3.5},
                         {side.at(22, -32, -5), 11, 10},
                         {side.at(31, -50, -8), 18.5, 17},
                         {side.at(37, -70, -9), 20, 17.5}},
                        Vec3::UnitX(), 2.5);
}

void add_cranium(shape::Compound& bone, const shape::Solid& cavity, const Chance& chance) {
    bone.add(
        {[inner = cavity.distance](const Vec3& p) { return inner(p) - skull_thickness(p); },
         {cavity.box.min() - Vec3::Constant(10.0), cavity.box.max() + Vec3::Constant(10.0)}},
        [](const Vec3& p) { return std::min(1.4, 0.32 * skull_thickness(p)); }, 1.4, 0.0);
    // The face's upper part and the body of the sphenoid hang on it.
    bone.add(shape::ellipsoid(Vec3(0, -61, 14), Vec3(36, 9, 15)), 1.3, 8.0);
    bone.add(shape::ellipsoid(Vec3(0, -10, -13), Vec3(20, 19, 12)), 0.6, 8.0);
    bone.add(shape::sweep({{Vec3(0, 10, -6), 12, 6}, {Vec3(0, 17, -24), 11, 6}, {Vec3(0, 22, -40), 9, 4}},
                          Vec3::UnitX(), 2.6),
             1.3, 4.0);
    for (const Side side : {left, right}) {
        bone.add(shape::ellipsoid(side.at(52, 33, -35), Vec3(8, 12, 19)), 1.0, 12.0);           // mastoid
        bone.add(shape::cone(side.at(44, 20, -34), side.at(38, 10, -60), 2.4, 1.0), 0.9, 2.0);  // styloid
        bone.add(shape::ellipsoid(side.at(17, 28, -45), Vec3(7, 11, 7)), 1.2, 4.0);             // condyle
        bone.add(shape::ellipsoid(side.at(44, 8, -26), Vec3(15, 12, 4)), 0.5, 8.0);  // over the jaw's joint
    }
    bone.add(shape::ellipsoid(Vec3(0, 100, -8), Vec3(14, 8, 6)), 2.0, 14.0);
    bone.cut(cavity, 1.0);
    bone.cut(shape::sweep({{Vec3(0, 39, -28), 14.5, 17}, {Vec3(0, 38, -64), 15, 18}}, Vec3::UnitX()), 2.0);
    // On the floor inside: sella, clinoid processes, small wings, petrous pyramids at 45° to the midline.
    bone.add(shape::sweep({{Vec3(0, 11, -8), 9, 3}, {Vec3(0, 8.5, -1), 9, 1.5}, {Vec3(0, 8, 4), 8.5, 1.3}},
                          Vec3::UnitX()),
             1.0, 2.0);
    bone.cut(shape::ellipsoid(Vec3(0, 1, 1), Vec3(9, 6, 7)), 1.5);
    for (const Side side : {left, right}) {
        bone.add(shape::cone(side.at(14, -14, 5), side.at(11, -3, 5.5), 3.2, 1.6), 1.2, 2.0);
        bone.add(shape::sweep({{side.at(12, -14, 7), 5, 2.0},
                               {side.at(28, -21, 9), 4, 1.8},
                               {side.at(44, -31, 13), 4, 1.8},
                               {side.at(54, -38, 16), 4, 2.0}},
                              Vec3::UnitY()),
                 1.8, 2.5);
        // Full of cells and canals: uneven, and seldom as dense as a solid of that size.
        const shape::Solid pyramid = shape::sweep({{side.at(13, 15, -11), 5, 6},
                                                   {side.at(24, 23, -10), 8, 8.5},
                                                   {side.at(38, 31, -10), 10, 11},
                                                   {side.at(52, 37, -12), 10, 11.5},
                                                   {side.at(62, 40, -17), 7, 9}},
                                                  Vec3(-0.6, 0.8, 0.0));
        bone.add(shape::warped(pyramid, 3.2, 13.0, chance.field("petrous pyramid", side.sign > 0.0 ? 0 : 1)),
                 1.9, 4.0);
        bone.cut(shape::cone(side.at(8, 26, -8), side.at(25, 26, -9), 3.2, 2.3), 0.5);  // inner ear canal
    }
}

void add_facial_bones(shape::Compound& bone, const Chance& chance) {
    for (const Side side : {left, right}) {
        // Upper jaw and cheek bone around the sinus.
        const std::uint64_t field = chance.field("upper jaw", side.sign > 0.0 ? 0 : 1);
        bone.add(shape::warped(shape::ellipsoid(side.at(25, -45, -36), Vec3(17.5, 19, 18)), 4.4, 19.0, field),
                 0.45, 4.0);
        bone.add(
            shape::warped(shape::ellipsoid(side.at(20, -52, -52), Vec3(17, 19, 8)), 2.4, 17.0, field + 3),
            0.6, 8.0);
        bone.add(shape::ellipsoid(side.at(48, -52, -29), Vec3(11, 10, 12)), 1.6, 6.0);
        bone.add(shape::sweep({{side.at(54, -46, -31), 6, 4},
                               {side.at(63, -30, -30), 4.2, 2.4},
                               {side.at(67, -12, -28), 3.6, 2.2},
                               {side.at(64, 6, -25), 4.5, 3}},
                              Vec3::UnitZ()),
                 1.2, 3.0);
        bone.add(
            shape::sweep(
                {{side.at(5, -66, 8), 5, 5}, {side.at(8, -71, -10), 4.5, 4}, {side.at(14, -69, -30), 6, 5}},
                Vec3::UnitX()),
            1.0, 3.0);
        bone.add(shape::cone(side.at(3, -70, 4), side.at(3.5, -82, -14), 3.2, 1.6), 0.8, 2.0);
        // Rim of the orbit above and outside.
        bone.add(shape::sweep({{side.at(14, -66, 6), 5, 4},
                               {side.at(28, -66, 12), 5, 4.5},
                               {side.at(44, -61, 9), 5, 4.5},
                               {side.at(54, -53, -4), 4.5, 4.5},
                               {side.at(54, -51, -22), 5, 4.5}},
                              Vec3::UnitY()),
                 1.5, 4.0);
        // Outer wall of the orbit: the great wing of the sphenoid.
        const shape::Solid wing = shape::sheet({{-24, {{28, -12, 1.3}, {40, -26, 1.1}, {52, -43, 2.0}}},
                                                {-4, {{35, -15, 1.3}, {46, -30, 1.1}, {54, -46, 2.2}}},
                                                {14, {{42, -20, 1.5}, {51, -35, 1.5}, {56, -49, 2.4}}}});
        bone.add(side.sign > 0.0 ? wing : mirrored(wing), 0.5, 4.0);
    }
}

/// A plate in the septum of the nose, bent as that is.
shape::Solid septum(const Chance& chance, const Vec3& middle, const Vec3& half) {
    const shape::Solid plate = shape::block(middle, half, 0.8);
    return {[=, bend = septum_bend(chance)](const Vec3& p) {
                return 0.9 * plate.distance(p - bend(p) * Vec3::UnitX());
            },
            {plate.box.min() - Vec3(5, 0, 0), plate.box.max() + Vec3(5, 0, 0)}};
}

void add_lower_face(shape::Compound& bone, const Chance& chance) {
    // Palate and the arch of the upper teeth.
    bone.add(shape::block(Vec3(0, -46, -52), Vec3(17, 24, 2.2), 1.6), 0.8, 3.0);
    std::vector<shape::Station> arch;
    for (int i = 0; i <= 12; ++i) {
        const double angle = -1.5 + 3.0 * i / 12.0;
        arch.push_back({Vec3(27.0 * std::sin(angle), -28.0 - 46.0 * std::cos(angle), -59),
                        8.0 + 1.5 * std::abs(std::sin(angle)), 4.0 + 1.4 * std::abs(std::sin(angle))});
    }
    bone.add(shape::sweep(arch, Vec3::UnitZ()), 0.6, 4.0);
    bone.add(septum(chance, Vec3(0, -48, -24), Vec3(1.1, 22, 26)), 0.5, 1.0);
}

/// Lower jaw, its joint, and the first two vertebrae.
shape::Compound mandible() {
    shape::Compound bone;
    for (const bool is_left : {true, false}) {
        const Side side = is_left ? left : right;
        const shape::Solid ramus = shape::sheet({{-82, {{46, -6, 4}, {46, -18, 4.5}, {44, -30, 4.5}}},
                                                 {-66, {{49, -1, 3.2}, {49.5, -14, 2.6}, {47, -30, 3}}},
                                                 {-50, {{51, 4, 3}, {51, -10, 2.2}, {49, -25, 2.2}}},
                                                 {-38, {{51, 7, 3.4}, {51, -6, 1.4}, {50, -22, 2.0}}}});
        bone.add(is_left ? ramus : mirrored(ramus), 1.3, 0.0);
        bone.add(shape::sweep({{side.at(51, 6, -44), 4, 3.4},
                               {side.at(51, 9, -38), 4, 4},
                               {side.at(51, 10, -35), 8.5, 3.4}},
                              Vec3::UnitX()),
                 1.2, 3.0);
        bone.add(shape::cone(side.at(50, -21, -44), side.at(50, -22, -33), 3.2, 1.8), 1.0, 3.0);
        bone.add(shape::sweep({{side.at(46, -14, -78), 11, 5},
                               {side.at(42, -32, -86), 12, 5.6},
                               {side.at(34, -50, -92), 12.5, 5.6},
                               {side.at(22, -64, -96), 13, 5.8},
                               {side.at(8, -70, -97), 12.5, 6.2},
                               {side.at(-2, -71, -97), 12.5, 6.2}},
                              Vec3::UnitZ(), 2.6),
                 2.2, 5.0);
    }
    return bone;
}

shape::Compound atlas_and_dens() {
    shape::Compound bone;
    bone.add(
        shape::sweep({{Vec3(0, 25, -56), 6, 6}, {Vec3(0, 26, -52), 5, 5.5}, {Vec3(0, 26, -46), 4.2, 4.5}},
                     Vec3::UnitX()),
        1.2, 0.0);
    for (const Side side : {left, right}) {
        bone.add(shape::ellipsoid(side.at(20, 27, -60), Vec3(8, 9, 7.5)), 1.2, 0.0);
        bone.add(shape::sweep({{side.at(26, 28, -60), 5, 4}, {side.at(38, 30, -61), 4, 3}}, Vec3::UnitZ()),
                 1.0, 3.0);
        bone.add(shape::sweep({{side.at(17, 20, -59), 4.5, 2.4},
                               {side.at(8, 16, -58), 5, 2.6},
                               {side.at(-1, 15, -58), 5.5, 3}},
                              Vec3::UnitZ()),
                 1.0, 2.0);
        bone.add(shape::sweep({{side.at(20, 34, -58), 4, 3.2},
                               {side.at(19, 46, -58), 4, 3},
                               {side.at(10, 57, -59), 4.5, 3.2},
                               {side.at(-1, 61, -60), 5, 3.6}},
                              Vec3::UnitZ()),
                 1.0, 2.0);
    }
    return bone;
}

/// Plates and processes under the skull that are thinner than the grid of the rest.
void add_pterygoids(shape::Compound& bone) {
    const auto plate = shape::sheet({{-54, {{13, -26, 1.0}, {12, -19, 0.9}, {16, -15, 0.8}}},
                                     {-24, {{14, -26, 2.0}, {13, -18, 1.4}, {19, -13, 1.2}}}});
    bone.add(plate, 0.5, 2.0);
    bone.add(mirrored(plate), 0.5, 2.0);
}

}  // namespace

void add_head_bones(Bones& bones, const Chance& chance) {
    const shape::Solid cavity = cranial_cavity(chance);
    shape::Compound skull;
    add_cranium(skull, cavity, chance);
    add_facial_bones(skull, chance);
    add_lower_face(skull, chance);
    add_pterygoids(skull);
    for (const Side side : {left, right}) skull.cut(orbit(side), 1.0);
    // Nose: the opening in front and the space behind.
    skull.cut(
        shape::sweep({{Vec3(0, -84, -36), 11, 13}, {Vec3(0, -66, -34), 11, 16}, {Vec3(0, -24, -34), 12, 16}},
                     Vec3::UnitX(), 3.0),
        1.5);
    skull.add(septum(chance, Vec3(0, -46, -26), Vec3(1.1, 20, 24)), 0.5, 0.5);
    skull.clear_of(sinuses(chance), sinus_wall);
    skull.roughen(0.4, 0.5, chance.field("diploe"));
    const shape::Surfaces surfaces = shape::polygonised(skull, skull_cell);
    bones.add(surfaces, at_sella());
    bones.add_grain(skull, 0.12, 6.0, 2.4, Vec3::Zero(), chance.field("diploic grain"), at_sella());
    shape::Compound jaw = mandible(), atlas = atlas_and_dens();
    jaw.roughen(0.45, 0.4, chance.field("lower jaw"));
    atlas.roughen(0.35, 0.3, chance.field("atlas"));
    for (const shape::Compound* bone : {&jaw, &atlas}) {
        const shape::Surfaces own = shape::polygonised(*bone, skull_cell);
        bones.add(own, at_sella());
        bones.add_grain(*bone, 0.2, 6.0, 2.0, Vec3(0.3, 0.3, 0), chance.field("grain of the jaw"),
                        at_sella());
    }
}

}  // namespace render
