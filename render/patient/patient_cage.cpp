#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {
namespace {

constexpr double rib_plaques = 0.35;      // of the shell [mm]
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

constexpr double blade_cell = 1.6, shoulder_cell = 2.2;  // of the grids [mm]

/// A place on the back of the cage, `gap` mm off the lungs.
Vec3 behind(const Chest& chest, double x, double z, double gap) {
    const CageSection cage = chest.section(std::min(z, 440.0));
    const double fraction = std::min(x / (cage.half_width + 12.0), 0.97);
    return {x, cage.middle + (cage.half_depth + gap) * std::pow(1.0 - std::pow(fraction, 2.3), 1.0 / 2.3), z};
}

/// The left shoulder blade, 150 mm high and 100 wide (texts), its body 2 to 3 mm thick.
shape::Compound shoulder_blade(const Chest& chest, const Chance& chance) {
    shape::Compound bone;
    const Vec3 glenoid = shoulder_joint(chest) + Vec3(-26, 2, -2);
    struct Row {
        double z, medial, lateral;
    };
    constexpr Row rows[] = {{294, 90, 96},  {306, 84, 104}, {330, 76, 116}, {355, 70, 127}, {380, 67, 138},
                            {402, 67, 143}, {418, 70, 138}, {432, 78, 112}, {438, 84, 98}};
    std::vector<shape::Cut> cuts;
    for (const Row& row : rows) {
        shape::Cut cut{row.z, {}};
        const double thick[] = {2.4, 1.7, 1.6, 1.9, 3.6};
        for (int k = 0; k <= 4; ++k) {
            const double t = k / 4.0, x = row.medial + t * (row.lateral - row.medial);
            Vec3 p = behind(chest, x, row.z, 25.0 + 9.0 * std::clamp((row.z - 370.0) / 30.0, 0.0, 1.0));
            // The joint's end leaves the cage forward.
            const double toward = std::clamp((row.z - 340.0) / 50.0, 0.0, 1.0) * t * t;
            p.y() += toward * 0.7 * (glenoid.y() - p.y());
            cut.points.push_back({p.x(), p.y(), thick[k]});
        }
        cuts.push_back(std::move(cut));
    }
    bone.add(shape::sheet(std::move(cuts)), 0.4, 0.0);
    bone.add(shape::ellipsoid(glenoid + Vec3(-4, 2, 0), Vec3(7, 12, 18)), 1.0, 9.0);
    const Vec3 root = behind(chest, 68, 398, 25.0), bend = behind(chest, 105, 410, 36.0);
    bone.add(shape::sweep({{root, 3, 2.5},
                           {bend, 9, 2.6},
                           {glenoid + Vec3(2, 26, 18), 9, 3.4},
                           {glenoid + Vec3(20, 14, 28), 5, 8},
                           {glenoid + Vec3(16, -4, 30), 4, 9}},
                          Vec3(0.1, 0.8, 0.5)),
             0.9, 3.0);
    bone.add(shape::sweep({{glenoid + Vec3(-9, -2, 11), 7, 7},
                           {glenoid + Vec3(-10, -16, 15), 5.5, 5.5},
                           {glenoid + Vec3(-2, -32, 9), 4.5, 5},
                           {glenoid + Vec3(3, -38, 3), 4, 4.5}},
                          Vec3::UnitX()),
             1.0, 4.0);
    bone.cut(shape::ball(shoulder_joint(chest), 26.5), 0.5);
    bone.roughen(0.35, 0.2, chance.field("shoulder blade"));
    return bone;
}

/// The left humerus: head 48 mm in diameter (Iannotti 1992: 46 ± 2), 310 mm long, shaft 24 mm wide with walls
/// of 4.5 mm (texts).
shape::Compound humerus(const Chest& chest, const Chance& chance) {
    const Vec3 head = shoulder_joint(chest), direction = arm_direction(chest),
               across = direction.cross(Vec3::UnitY()).normalized();
    const Vec3 outward = across.dot(Vec3(1, 0, 1)) > 0.0 ? across : Vec3(-across);
    const auto at = [&](double along, double out, double back) -> Vec3 {
        return head + along * direction + out * outward + back * Vec3::UnitY();
    };
    shape::Compound bone;
    bone.add(
        shape::sweep({{at(8, 8, 0), 20, 20},
                      {at(32, 8, 0), 16, 16},
                      {at(60, 6, 0), 13, 13},
                      {at(130, 4, 0), 12, 12},
                      {at(220, 3, 0), 11.5, 11.5},
                      {at(270, 3, 0), 11, 14},
                      {at(294, 3, 0), 8, 26}},
                     Vec3::UnitY()),
        [=](const Vec3& p) {
            const double s = (p - head).dot(direction);
            return 1.1 +
                   3.4 * std::clamp((s - 25.0) / 50.0, 0.0, 1.0) * std::clamp((290.0 - s) / 40.0, 0.2, 1.0);
        },
        4.6, 0.0);
    bone.add(shape::ball(head, 23.0), 0.8, 4.0);
    bone.add(shape::ellipsoid(at(6, 22, 4), Vec3(9, 12, 9)), 0.8, 7.0);
    bone.add(shape::ellipsoid(at(14, 6, -18), Vec3(7, 7, 7)), 0.8, 6.0);
    bone.roughen(0.35, 0.4, chance.field("humerus"));
    return bone;
}

/// The left collar bone, 145 mm long, S-shaped.
shape::Compound collar_bone(const Chest& chest, const Chance& chance) {
    const CageSection top = chest.section(405.0);
    const double manubrium = top.middle - top.half_depth - 7.0;
    shape::Compound bone;
    bone.add(
        shape::sweep({{Vec3(14, manubrium + 2.0, 407), 9.0, 8.5},
                      {Vec3(24, manubrium + 0.0, 410), 8.4, 8},
                      {Vec3(36, manubrium - 2.5, 413.5), 7.6, 7.8},
                      {Vec3(50, manubrium - 3.0, 417), 6.3, 6.6},
                      {Vec3(70, manubrium + 3.0, 421), 5.6, 6},
                      {Vec3(96, manubrium + 20.0, 427), 5.2, 6.2},
                      {Vec3(116, manubrium + 40.0, 434), 5.0, 8},
                      {Vec3(132, manubrium + 49.0, 437), 4.6, 9.5},
                      {Vec3(140, manubrium + 50.0, 437), 3.8, 7.5}},
                     Vec3::UnitZ()),
        [](const Vec3& p) { return 0.7 + 1.4 * std::exp(-std::pow((p.x() - 80.0) / 34.0, 4.0)); }, 2.1, 0.0);
    // The joint's face, flat, toward the manubrium; the other end is cut toward the acromion.
    bone.cut(shape::half_space(Vec3(19, manubrium, 409), Vec3(1.0, 0.15, 0.35)), 7.0);
    bone.cut(shape::half_space(Vec3(141, manubrium + 50.0, 437), Vec3(-1.0, -0.35, 0.0)), 5.0);
    bone.roughen(0.4, 0.35, chance.field("collar bone"));
    return bone;
}

void add_shoulders(Bones& bones, const Chest& chest, const Chance& chance) {
    int index = 0;
    for (const auto& [bone, cell] : {std::pair{shoulder_blade(chest, chance), blade_cell},
                                     {humerus(chest, chance), shoulder_cell},
                                     {collar_bone(chest, chance), shoulder_cell}}) {
        const shape::Surfaces surfaces = shape::polygonised(bone, cell);
        for (const bool mirrored : {false, true}) {
            mirrored ? bones.add_mirrored(surfaces) : bones.add(surfaces);
            bones.add_grain(bone, 0.25, 9.0, 3.0, Vec3(0.4, 0, 0.3), chance.field("shoulder grain", index++),
                            Eigen::Isometry3d::Identity(), mirrored);
        }
    }
}

/// Manubrium, body and xiphoid process, with the joints between them. 17 to 18 cm long (texts).
void add_sternum(Bones& bones, const Chest& chest, const Chance& chance) {
    const auto at = [&](double z) -> Vec3 {
        const CageSection cage = chest.section(z);
        return {0.0, cage.middle - cage.half_depth - pleura_to_rib - 3.5, z};
    };
    shape::Compound bone;
    bone.add(shape::sweep({{at(408), 23, 4.6}, {at(398), 25, 4.4}, {at(384), 23, 4.8}, {at(370), 16, 5}},
                          Vec3::UnitX(), 2.4),
             0.8, 0.0);
    bone.cut(shape::ball(at(418) + Vec3(0, 0, 4), 14.0), 3.0);
    for (const Side side : {left, right}) bone.cut(shape::ball(side.at(21, at(409).y(), 412), 12.5), 1.0);
    bone.add(shape::sweep({{at(362), 15, 4.6},
                           {at(346), 16, 5},
                           {at(322), 18, 5},
                           {at(296), 20, 4.8},
                           {at(278), 16, 4.5},
                           {at(268), 11, 4}},
                          Vec3::UnitX(), 2.4),
             0.8, 0.0);
    bone.add(shape::sweep({{at(262), 6, 2.6}, {at(248), 4.5, 2}, {at(238), 3, 1.6}}, Vec3::UnitX()), 0.6,
             0.0);
    bone.roughen(0.5, 0.3, chance.field("sternum"));
    const shape::Surfaces surfaces = shape::polygonised(bone, 2.2);
    bones.add(surfaces);
    bones.add_grain(bone, 0.4, 5.0, 3.0, Vec3(0, 0, 0.4), chance.field("sternal grain"));
}

/// Cartilage from a rib's end toward the sternum, a little denser than flesh, less and less of it along the
/// way, with specks of calcium at its borders as after the age of forty.
void add_cartilage(Bones& bones, const Chest& chest, const Chance& chance, int number, const Vec3& rib_end,
                   double half_height, Side side) {
    if (number > 10) return;
    geometry::Random random(chance.field("costal cartilage", 2 * number + (side.sign > 0 ? 0 : 1)));
    const double meets = number <= 7 ? 405.0 - 19.0 * number : 262.0 + 4.0 * (10 - number);
    const CageSection cage = chest.section(meets);
    const Vec3 to = side.at(number <= 7 ? 17.0 : 34.0 + 14.0 * (number - 7),
                            cage.middle - cage.half_depth - pleura_to_rib, meets);
    const Vec3 direction = (to - rib_end).normalized();
    const auto at = [&](double t) {
        return Vec3(rib_end + t * (to - rib_end) -
                    Vec3(0, 4.0 * std::min(1.0, 4.0 * t), 14.0 * std::sin(std::numbers::pi * t)));
    };
    TextureBlob blob;
    blob.axis = direction.cast<float>();
    constexpr double step = 4.0;  // [mm]
    const double length = (to - rib_end).norm();
    for (double s = -3.0; s < length; s += step) {
        blob.middle = at(s / length).cast<float>();
        blob.radius = static_cast<float>(half_height * random.between(0.9, 1.1));
        blob.elongation = 1.5f;
        blob.fraction =
            static_cast<float>(0.10 * std::exp(-std::max(s, 0.0) / 9.0) + 0.035 * random.between(0.6, 1.4));
        bones.trabeculae.push_back(blob);
    }
    const int count = 30 + static_cast<int>(40.0 * random());
    for (int k = 0; k < count; ++k) {
        const double t = std::pow(random(), 1.6), radius = 0.4 + 1.1 * std::pow(random(), 3.0),
                     x = random.between(-4, 4), edge = random() < 0.5 ? -1 : 1,
                     z = edge * random.between(0.5, 1.0) * half_height, y = random.between(-2, 2);
        blob.middle = (at(t) + Vec3(x, y, z)).cast<float>();
        blob.radius = static_cast<float>(radius);
        blob.elongation = static_cast<float>(random.between(1.0, 4.0));
        blob.fraction = static_cast<float>(random.between(0.15, 0.6));
        bones.trabeculae.push_back(blob);
    }
}

/// A section of a rib, in the frame of the path there.
struct RibSection {
    Vec3 at, up, inward;                        // place, and unit directions
    double half_height, half_thickness, shell;  // [mm]
};

/// Round above, thin below, with the groove of vessels and nerve on the inner side of the lower edge; the
/// shell is thickest at both edges. `inner`: what the shell encloses.
Polyline ring_of(const RibSection& section, bool inner) {
    constexpr int around = 14;
    Polyline ring;
    for (int k = 0; k < around; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / around, c = std::cos(angle), s = std::sin(angle);
        const double groove = s > 0.0 ? 0.55 * std::exp(-std::pow((c + 0.62) / 0.25, 2.0)) : 0.0;
        double height = section.half_height * c,
               thickness = section.half_thickness * s * (0.86 + 0.24 * c) * (1.0 - groove);
        if (inner) {
            height -= c * std::min(1.9 * section.shell, 0.7 * section.half_height);
            thickness -= std::copysign(std::min(section.shell, 0.6 * std::abs(thickness)), thickness);
        }
        ring.push_back(section.at + height * section.up + thickness * section.inward);
    }
    return ring;
}

void add_rib(Bones& bones, const Chest& chest, const Chance& chance, int number, Side side) {
    Rib rib = ribs[number - 1];
    const int index = 2 * number + (side.sign > 0 ? 0 : 1);
    // Both of a pair differ from the mean, and a little from each other.
    rib.drop += 4.0 * chance.normal("drop of a rib", number) + 1.8 * chance.normal("drop of one rib", index);
    rib.reach +=
        0.05 * chance.normal("reach of a rib", number) + 0.03 * chance.normal("reach of one rib", index);
    rib.half_height *= 1.0 + 0.05 * chance.normal("height of a rib", number);
    const std::uint64_t field = chance.field("course of a rib", index);
    const Vertebra& origin = vertebrae()[17 - number];  // T1 is the 17th from below
    const double top = origin.z + 0.55 * origin.half_height;
    std::vector<RibSection> sections;
    const auto add = [&](const Vec3& p, double fraction, double shell) {
        const CageSection cage = chest.section(p.z());
        sections.push_back({p, Vec3::UnitZ(), Vec3(-p.x(), cage.middle - p.y(), 0.0),
                            fraction * rib.half_height, fraction * 3.2, shell});
    };
    // Head at the vertebra, neck behind the lung.
    const CageSection at_neck = chest.section(top);
    add(side.at(origin.half_width + 2.6, origin.front + 2.0 * origin.half_depth - 4.0, top), 0.5, 0.4);
    add(side.at(origin.half_width + 12.0, at_neck.middle + at_neck.half_depth + pleura_to_rib + 1.0,
                top + 1.0),
        0.62, 0.5);
    double start = 0.40;  // where the rib meets the cage: well outside its neck [rad]
    while (at_neck.point(start, top, rib_gap(top)).x() < origin.half_width + 24.0) start += 0.02;
    const int steps = static_cast<int>(6.0 + 8.0 * rib.reach);
    for (int i = 0; i <= steps; ++i) {
        const double t = double(i) / steps, angle = start + t * (rib.reach - start);
        // Steepest at the side; the front end turns up a little.
        const double wave =
            1.3 * std::sin(std::numbers::pi * t) * shape::noise(Vec3(60.0 * t, 0, 0), 17.0, field);
        const double z = top - rib.drop * (0.25 * t + 0.75 * (t * t * (3.0 - 2.0 * t))) + wave;
        Vec3 p = chest.section(z).point(angle, z, rib_gap(z));
        p.x() *= side.sign;
        // Toward the cartilage a rib is broader, and its shell thinner.
        const double ahead = std::clamp((t - 0.6) / 0.4, 0.0, 1.0);
        const double uneven = 1.0 + 0.05 * shape::noise(Vec3(90.0 * t, 40.0, 0), 9.0, field);
        add(p, uneven * (1.0 + 0.10 * ahead * ahead), 0.6 - 0.35 * ahead);
    }
    // Thins out in front, where the cartilage begins.
    const Vec3 end = sections.back().at, on = (end - sections[sections.size() - 2].at).normalized();
    add(end + 1.6 * on, 1.0, 0.3);
    add(end + 2.6 * on, 0.8, 0.3);
    for (std::size_t back = 0; back < 5 && back < sections.size(); ++back)
        sections[sections.size() - 1 - back].half_thickness *= 0.45 + 0.11 * static_cast<double>(back);
    std::vector<Polyline> outer, core;
    // Backward, so that the head, which lies beside the cage's middle, does not turn the sections over.
    Vec3 inward = sections.back().inward;
    for (std::size_t i = sections.size(); i-- > 0;) {
        RibSection& section = sections[i];
        const Vec3 along =
            (sections[std::min(i + 1, sections.size() - 1)].at - sections[i == 0 ? 0 : i - 1].at)
                .normalized();
        section.up = (Vec3::UnitZ() - along.z() * along).normalized();
        const Vec3 across = along.cross(section.up);
        section.inward = inward = across.dot(inward) > 0.0 ? across : Vec3(-across);
    }
    for (const RibSection& section : sections) outer.push_back(ring_of(section, false));
    // The core ends short of the lids.
    sections.front().at += 0.7 * (sections[1].at - sections[0].at).normalized();
    sections.back().at -= 0.5 * on;
    for (const RibSection& section : sections) core.push_back(ring_of(section, true));
    bones.add({loft(outer), loft(core)}, Eigen::Isometry3d::Identity(), rib_plaques);
    add_cartilage(bones, chest, chance, number, end, rib.half_height, side);
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

Vec3 shoulder_joint(const Chest& chest) {
    const CageSection top = chest.section(405.0);
    return {174.0, top.middle - top.half_depth + 57.0, 412.0};
}

Vec3 arm_direction(const Chest& chest) {
    return (chest.arms_down ? Vec3(0.16, 0.0, -0.987) : Vec3(0.50, 0.12, 0.86)).normalized();
}

void add_cage(Bones& bones, const Chest& chest, const Chance& chance, bool shoulders) {
    for (int number = 1; number <= 12; ++number) {
        for (const Side side : {left, right}) add_rib(bones, chest, chance, number, side);
    }
    add_sternum(bones, chest, chance);
    if (shoulders) add_shoulders(bones, chest, chance);
}

}  // namespace render
