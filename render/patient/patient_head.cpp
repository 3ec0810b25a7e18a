#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using geometry::Polyline;
using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

using std::numbers::pi;
constexpr double skull_cell = 2.0, sinus_cell = 1.8;  // of the grids [mm]
constexpr double sinus_wall = 0.6;                    // thin bone around air [mm]

// All places in this file are measured from the sella. Skull 180 mm long, 146 wide (men: 182 and 145, texts);
// sella to nasion 72, sella to basion 46, nasion to chin 118 (cephalometric means of men, rounded: Riolo
// 1974).
const Vec3 vault(0.0, 20.0, 28.0);  // its middle [mm]

Isometry3d at_sella() {
    return Isometry3d(Translation3d(place_in_body(geometry::Landmark::Sella)));
}

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
    const double front = 3.0 + 9.0 * bell((aside - 30.0) / 20.0) - 5.0 * bell(x / 7.0);
    const double middle = 1.0 - 24.0 * step_up(10.0, 24.0, aside) + 16.0 * step_up(48.0, 66.0, aside);
    const double behind = -12.0 - 30.0 * step_up(10.0, 26.0, y) + 24.0 * step_up(70.0, 104.0, y) +
                          10.0 * step_up(35, 66, aside);
    const double wing = -14.0 - 0.35 * aside, petrous = 10.0 + 0.55 * aside;
    const double to_middle = step_up(wing - 5.0, wing + 5.0, y),
                 to_behind = step_up(petrous - 7.0, petrous + 7.0, y);
    const double fore = front + to_middle * (middle - front);
    return fore + to_behind * (behind - fore);
}

/// What the tables of the skull enclose.
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
                const double floor = 0.75 * (floor_of(p.x(), p.y()) - p.z());
                return std::max(round, floor) +
                       0.25 * std::pow(std::max(0.0, 4.0 - std::abs(round - floor)), 2.0) / 4.0;
            },
            {vault - Vec3(80, 92, 90), vault + Vec3(80, 92, 72)}};
}

/// A sheet's mirror image.
shape::Solid mirrored(shape::Solid solid) {
    Eigen::AlignedBox3d box(Vec3(-solid.box.max().x(), solid.box.min().y(), solid.box.min().z()),
                            Vec3(-solid.box.min().x(), solid.box.max().y(), solid.box.max().z()));
    return {[own = std::move(solid.distance)](const Vec3& p) { return own({-p.x(), p.y(), p.z()}); }, box};
}

/// Thickness of the skull: 6 to 8 mm in the vault, thin at the temples, over the orbits and in the middle
/// fossae (Lynnerup 2001: frontal 6.6 to 7.5, occipital 7.3; temporal squama 2 to 4: texts).
double skull_thickness(const Vec3& p) {
    const double temple =
        bell((std::abs(p.x()) - 70.0) / 16.0) * bell((p.y() - 2.0) / 30.0) * bell((p.z() - 8.0) / 26.0);
    const double base = step_up(6.0, -14.0, p.z());
    const double behind = 2.0 * bell((p - Vec3(0, 108, -6)).norm() / 22.0);
    return 6.8 - 3.8 * temple - 3.2 * base * (1.0 - step_up(40.0, 70.0, p.y())) + behind;
}

/// Air of the nose's cells and of the ears: closed spaces with thin walls.
shape::Compound sinuses(const Chance& chance) {
    shape::Compound air;
    geometry::Random random(chance.field("sinuses"));
    const auto size = [&](const char* name, int index) { return 1.0 + 0.14 * chance.normal(name, index); };
    for (const Side side : {left, right}) {
        const int index = side.sign > 0.0 ? 0 : 1;
        // Maxillary: a pyramid toward the cheek bone. 34 high, 33 deep, 27 wide (texts).
        const double m = size("maxillary sinus", index);
        air.add(shape::ellipsoid(side.at(28, -44, -35), m * Vec3(12.5, 15.5, 15)), 0.0, 0.0);
        air.add(shape::ellipsoid(side.at(34, -50, -31), m * Vec3(10, 9, 9)), 0.0, 6.0);
        air.add(shape::ellipsoid(side.at(23, -44, -46), m * Vec3(7, 11, 8)), 0.0, 6.0);
        // Frontal: lobes beside a septum, seldom alike.
        const double f = 1.0 + 0.22 * chance.normal("frontal sinus", index) + (index == 0 ? 0.1 : -0.12);
        air.add(shape::ellipsoid(side.at(8, -63.5, 15), Vec3(6.5, 4.5, 11 * f)), 0.0, 0.0);
        air.add(shape::ellipsoid(side.at(17, -62, 17), Vec3(7 * f, 4, 8.5 * f)), 0.0, 3.0);
        air.add(shape::ellipsoid(side.at(26, -59.5, 15), Vec3(6 * f, 3, 6 * f)), 0.0, 2.5);
        // Sphenoidal: two halves.
        const double s = size("sphenoidal sinus", index);
        air.add(shape::ellipsoid(side.at(7.6, -14, -16), Vec3(7, 11 * s, 8)), 0.0, 0.0);
        // Ethmoidal cells, three by three.
        for (int k = 0; k < 9; ++k) {
            const double x = random.between(-0.7, 0.7), y = random.between(-1, 1), z = random.between(-1, 1);
            air.add(shape::ellipsoid(side.at(9.0 + x, -58.0 + 11.5 * (k % 3) + y, -13.0 + 8.2 * (k / 3) + z),
                                     Vec3(4.6 + 0.8 * x, 5.0 + 0.5 * y, 3.5 + 0.4 * z)),
                    0.0, 0.0);
        }
        // Outer ear canal.
        air.add(shape::cone(side.at(45, 24, -21), side.at(66, 23, -23), 2.4, 3.0), 0.0, 0.0);
    }
    return air;
}

/// The eye's socket: a cone from the optic canal to the rim, 40 × 35 mm (texts).
shape::Solid orbit(const Side side) {
    return shape::sweep({{side.at(14, -17, -1), 3.5, 3.5},
                         {side.at(22, -32, -5), 11, 10},
                         {side.at(31, -50, -8), 18.5, 17},
                         {side.at(37, -70, -9), 20, 17.5}},
                        Vec3::UnitX(), 2.5);
}

void add_cranium(shape::Compound& bone, const shape::Solid& cavity) {
    bone.add({[inner = cavity.distance](const Vec3& p) { return inner(p) - skull_thickness(p); },
              {cavity.box.min() - Vec3::Constant(10.0), cavity.box.max() + Vec3::Constant(10.0)}},
             1.5, 0.0);
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
    bone.add(shape::ellipsoid(Vec3(0, 105, -8), Vec3(14, 8, 6)), 2.0, 14.0);
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
        bone.add(shape::sweep({{side.at(13, 15, -11), 5, 6},
                               {side.at(24, 23, -10), 8, 9},
                               {side.at(38, 31, -9), 10.5, 12},
                               {side.at(52, 37, -11), 11, 13},
                               {side.at(62, 40, -16), 9, 13}},
                              Vec3(-0.6, 0.8, 0.0)),
                 2.6, 4.0);
        bone.cut(shape::cone(side.at(8, 26, -8), side.at(25, 26, -9), 3.2, 2.3), 0.5);  // inner ear canal
    }
}

void add_facial_bones(shape::Compound& bone) {
    for (const Side side : {left, right}) {
        // Upper jaw and cheek bone around the sinus.
        bone.add(shape::ellipsoid(side.at(25, -46, -37), Vec3(19, 21, 20)), 0.45, 4.0);
        bone.add(shape::ellipsoid(side.at(20, -52, -52), Vec3(17, 19, 8)), 0.6, 8.0);
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

}  // namespace

namespace {

void add_lower_face(shape::Compound& bone) {
    // Palate and the arch of the upper teeth.
    bone.add(shape::block(Vec3(0, -46, -52), Vec3(17, 24, 2.2), 1.6), 0.8, 3.0);
    std::vector<shape::Station> arch;
    for (int i = 0; i <= 12; ++i) {
        const double angle = -1.5 + 3.0 * i / 12.0;
        arch.push_back({Vec3(27.0 * std::sin(angle), -28.0 - 46.0 * std::cos(angle), -59),
                        5.0 + 1.5 * std::abs(std::sin(angle)), 3.6 + 1.4 * std::abs(std::sin(angle))});
    }
    bone.add(shape::sweep(arch, Vec3::UnitZ()), 0.7, 4.0);
    bone.add(shape::block(Vec3(0, -48, -24), Vec3(1.1, 22, 26), 0.8), 0.5, 1.0);  // septum of the nose
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
                               {side.at(51, 9, -35), 4, 4},
                               {side.at(51, 10, -30), 8.5, 4.2}},
                              Vec3::UnitX()),
                 1.2, 3.0);
        bone.add(shape::cone(side.at(50, -21, -44), side.at(50, -22, -33), 3.2, 1.8), 1.0, 3.0);
        bone.add(shape::sweep({{side.at(46, -14, -78), 11, 5},
                               {side.at(42, -32, -86), 12, 5.6},
                               {side.at(34, -50, -92), 12.5, 5.6},
                               {side.at(22, -64, -96), 13, 5.8},
                               {side.at(8, -71, -99), 13.5, 6.2},
                               {side.at(-2, -72, -100), 13.5, 6.6}},
                              Vec3::UnitZ(), 2.6),
                 2.2, 5.0);
    }
    return bone;
}

shape::Compound atlas_and_dens() {
    shape::Compound bone;
    bone.add(
        shape::sweep({{Vec3(0, 25, -74), 6, 6}, {Vec3(0, 26, -60), 5, 5.5}, {Vec3(0, 26, -46), 4.2, 4.5}},
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

/// Crowns with roots: eight on each side above and below; molars are wide.
TriangleMesh teeth(const Chance& chance) {
    TriangleMesh all;
    for (const bool upper : {true, false}) {
        for (int i = 0; i < 14; ++i) {
            const double angle = (i - 6.5) * 0.215,
                         molar = std::clamp((std::abs(i - 6.5) - 2.5) / 3.0, 0.0, 1.0);
            const double out = upper ? 46.0 : 44.5, row = upper ? -71.0 : -73.0, up = upper ? 1.0 : -1.0;
            const Vec3 edge(27.0 * std::sin(angle), -28.0 - out * std::cos(angle), row);
            const double tilt = 0.8 * chance.normal("tooth", i + (upper ? 0 : 14)),
                         length = 19.0 - 3.0 * molar;
            const Vec3 inward = Vec3(-std::sin(angle), std::cos(angle), 0.0);
            const auto at = [&](double part, double aside) -> Vec3 {
                return edge + part * length * (up * Vec3::UnitZ() + 0.12 * inward) +
                       (aside + tilt * part) * Vec3(std::cos(angle), std::sin(angle), 0);
            };
            append(all,
                   tube({at(0, 0), at(0.08, 0), at(0.25, 0), at(0.42, 0)}, inward,
                        {1.2 + 2.4 * molar, 2.6 + 2.0 * molar, 3.4 + 1.8 * molar, 2.8 + 1.6 * molar},
                        {2.6 + 1.4 * molar, 3.2 + 1.6 * molar, 3.3 + 1.8 * molar, 2.4 + 1.8 * molar}, 10));
            for (const double root : {-1.0, 1.0}) {
                if (molar < 0.5 && root > 0.0) continue;
                const double aside = molar < 0.5 ? 0.0 : 2.2 * root;
                append(all, tube({at(0.43, 0.8 * aside), at(0.7, aside), at(1.0, 1.2 * aside)}, inward,
                                 {2.4 - 0.4 * molar, 1.8 - 0.3 * molar, 0.6},
                                 {2.0 - 0.5 * molar, 1.5 - 0.3 * molar, 0.5}, 8));
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
    // On a ray from the middle of the vault, at a share of the thickness from the inner side.
    const auto on_vault = [&](const Vec3& toward, double share) -> Vec3 {
        const Vec3 way = (toward - vault).normalized();
        double low = 30.0, high = 120.0;
        for (int k = 0; k < 18; ++k) {
            const double middle = 0.5 * (low + high);
            const Vec3 p = vault + middle * way;
            (cavity.distance(p) < share * skull_thickness(p) ? low : high) = middle;
        }
        return vault + low * way;
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
                wide.push_back(random.between(0.3, 0.6));
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
shape::Compound nasal_cavity() {
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
        air.cut(shape::block(side.at(0, -46, -30), Vec3(1.6, 40, 40), 0.5), 0.5);
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

void add_head_bones(Bones& bones, const Chance& chance) {
    const shape::Solid cavity = cranial_cavity(chance);
    shape::Compound skull;
    add_cranium(skull, cavity);
    add_facial_bones(skull);
    add_lower_face(skull);
    add_pterygoids(skull);
    for (const Side side : {left, right}) skull.cut(orbit(side), 1.0);
    // Nose: the opening in front and the space behind.
    skull.cut(
        shape::sweep({{Vec3(0, -84, -36), 11, 13}, {Vec3(0, -66, -34), 11, 16}, {Vec3(0, -24, -34), 12, 16}},
                     Vec3::UnitX(), 3.0),
        1.5);
    skull.add(shape::block(Vec3(0, -46, -26), Vec3(1.1, 20, 24), 0.8), 0.5, 0.5);
    skull.clear_of(sinuses(chance), sinus_wall);
    const std::uint64_t field = chance.field("diploe");
    skull.roughen([field](const Vec3& p) { return 0.55 * shape::fractal(p, 16.0, 4.0, 0.4, field); }, 1.2);
    bones.add(shape::polygonised(skull, skull_cell), at_sella());
    add_voids(bones, skull, 9000, 2.4, chance.field("diploic voids"), at_sella());
    bones.add(shape::polygonised(mandible(), skull_cell), at_sella());
    bones.add(shape::polygonised(atlas_and_dens(), skull_cell), at_sella());
}

void add_head_layers(std::vector<TissueLayer>& layers, const Chance& chance) {
    add_brain_layers(layers, shape::grown(cranial_cavity(chance), -1.5), at_sella());
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
                      placed(shape::polygonised(nasal_cavity(), sinus_cell).outer), false});
    layers.push_back({"throat", Material::Air, Material::SoftTissue,
                      placed(shape::polygonised(throat(), 2.5).outer), false});
}

}  // namespace render
