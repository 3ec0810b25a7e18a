#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/patient/patient_parts.h"

namespace render {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;

namespace {

constexpr double degrees = std::numbers::pi / 180.0;
constexpr double lumbar_plaques = 0.36, other_plaques = 0.25;  // of walls some 0.4 mm thick [mm]
constexpr double lumbar_cell = 1.8, thoracic_cell = 2.1, cervical_cell = 1.5;  // of the grids [mm]

/// What is behind the body, from L5 up to C2 [mm]. Pedicles and canal of T1 to L5: Panjabi et al., Spine 1991
/// (thoracic) and 1992 (lumbar), rounded; of the neck, Panjabi et al. 1991 (cervical), rounded; spans of
/// transverse processes, lengths and drops of spinous processes: estimates.
struct Arch {
    double pedicle_half_width, pedicle_half_height, canal_half_width, canal_half_depth, span, spine, drop;
};
constexpr Arch arches[] = {
    {7.8, 8.0, 13.5, 9.5, 46, 24, 7},  {6.6, 7.7, 12.7, 9.2, 43, 29, 9},  {5.1, 7.3, 12.2, 8.8, 46, 31, 10},
    {4.3, 7.5, 11.9, 9.0, 42, 31, 10}, {4.3, 8.0, 11.8, 9.3, 37, 29, 10}, {4.0, 8.0, 11.1, 9.0, 24, 26, 12},
    {3.9, 8.2, 10.0, 8.2, 26, 25, 16}, {3.4, 7.4, 9.2, 7.8, 29, 26, 24},  {3.2, 6.9, 8.9, 7.8, 31, 28, 26},
    {2.9, 6.3, 8.8, 7.9, 32, 29, 28},  {2.8, 6.0, 8.7, 8.0, 32, 29, 29},  {2.6, 5.8, 8.6, 8.1, 32, 29, 28},
    {2.5, 5.7, 8.6, 8.1, 33, 28, 26},  {2.4, 5.6, 8.6, 8.1, 34, 27, 24},  {2.6, 5.7, 8.8, 8.2, 35, 26, 24},
    {3.2, 5.6, 9.4, 8.2, 37, 26, 20},  {4.2, 5.0, 10.5, 8.2, 38, 26, 14}, {3.2, 3.8, 12.2, 7.6, 34, 24, 12},
    {2.9, 3.6, 12.9, 7.5, 28, 20, 8},  {2.8, 3.5, 12.7, 7.4, 27, 14, 6},  {2.7, 3.6, 12.5, 7.4, 26, 13, 5},
    {2.7, 3.7, 11.9, 7.6, 26, 13, 4},  {3.5, 4.5, 12.2, 8.8, 26, 16, 4}};

/// One vertebra about the middle of its body.
struct VertebraPlan {
    Vertebra own;
    Arch arch;
    int level;
    double spacing;  // to its neighbours on average [mm]
    bool lumbar() const { return level < 5; }
    bool cervical() const { return level > 16; }
    double canal() const { return own.half_depth + arch.canal_half_depth - 1.5; }  // y of its middle
};

/// Body with concave end plates, waist and rims. Concavity 2.8 mm below and 1.8 mm above in the loins, less
/// higher up; waist 11 % (estimates). End plates 0.6 mm thick, other walls 0.4 (Silva et al., Bone 1994,
/// measured about 0.35).
void add_body(shape::Compound& shape, const VertebraPlan& plan, const Chance& chance) {
    const double w = plan.own.half_width, d = plan.own.half_depth,
                 h = plan.own.half_height * (1.0 + 0.03 * chance.normal("vertebral height", plan.level));
    const double hollow = plan.lumbar() ? 1.0 : plan.cervical() ? 0.3 : 0.65;
    struct Spur {
        double angle, size;
    };
    std::array<Spur, 4> spurs{};
    for (int k = 0; k < 4; ++k)
        spurs[k] = {(k % 2 == 0 ? 0.35 : std::numbers::pi - 0.35) +
                        0.5 * chance.normal("spur angle", 4 * plan.level + k),
                    std::max(0.0, (plan.lumbar() ? 1.4 : 0.8) * chance.normal("spur", 4 * plan.level + k))};
    // No plate lies quite level, and no two alike.
    struct Tilt {
        double across, along;
    };
    std::array<Tilt, 2> tilts{};
    for (int k = 0; k < 2; ++k)
        tilts[k] = {0.022 * chance.normal("plate across", 2 * plan.level + k),
                    0.045 * chance.normal("plate along", 2 * plan.level + k)};
    const std::uint64_t field = chance.field("vertebral body", plan.level);
    const bool cervical = plan.cervical();
    struct Walls {
        double radial, axial;
    };
    const auto walls = [=](const Vec3& p) -> Walls {
        const bool up = p.z() > 0.0;
        const double z = std::min(1.0, std::abs(p.z()) / h);
        const double angle = std::atan2(-p.y(), p.x());
        double wider = 1.0 - 0.11 * (1.0 - z * z) - 0.05 * std::pow(z, 12.0);
        const Spur& spur = spurs[(up ? 2 : 0) + (p.x() > 0.0 ? 0 : 1)];
        const double beside = std::remainder(angle - spur.angle, 2.0 * std::numbers::pi);
        const double rim = std::exp(-std::pow((std::abs(p.z()) - h) / 2.4, 2.0));
        const double out = rim * (0.5 + spur.size * std::exp(-beside * beside / 0.18));
        // Flat, slightly hollow, behind.
        const double back =
            p.y() > 0.0 ? 0.90 + 0.06 * std::pow(std::min(1.0, std::abs(p.x()) / w), 2.0) : 1.0;
        const double n = p.y() > 0.0 ? 3.0 : 2.2;
        const double qx = std::abs(p.x()) / (w * wider + out),
                     qy = std::abs(p.y()) / (d * wider * back + out);
        const double k0 = std::pow(std::pow(qx, n) + std::pow(qy, n) + 1e-12, 1.0 / n);
        const double radial = (k0 - 1.0) * std::min(w, d) * 1.1;
        const double inside = std::max(0.0, 1.0 - k0 * k0 * 1.15);
        double hollow_by = hollow * (up ? 1.8 : 2.8) * std::pow(inside, 0.8);
        if (cervical && up) hollow_by -= 3.5 * std::pow(std::min(1.2, std::abs(p.x()) / w), 6.0);
        const Tilt& tilt = tilts[up ? 1 : 0];
        const double uneven = 1.1 * shape::noise(p, 19.0, field + 1) + 0.5 * shape::noise(p, 9.0, field) +
                              tilt.across * p.x() + tilt.along * p.y();
        return {radial, std::abs(p.z()) - h + hollow_by + uneven};
    };
    shape::Solid body;
    body.distance = [walls](const Vec3& p) {
        const auto [radial, axial] = walls(p);
        constexpr double blend = 1.6;
        const double apart = std::abs(radial - axial);
        return std::max(radial, axial) +
               (apart < blend ? 0.25 * (blend - apart) * (blend - apart) / blend : 0.0);
    };
    const Vec3 half(w + 6.0, d + 6.0, h + 6.0);
    body.box = {-half, half};
    shape.add(
        body,
        [walls](const Vec3& p) {
            const auto [radial, axial] = walls(p);
            return axial > radial - 0.8 ? 0.55 : 0.4;
        },
        0.6, 0.0);
}

/// Articular processes that reach down to the next vertebra.
shape::Compound lower_facets(const VertebraPlan& plan) {
    const double c = plan.canal(), s = 0.5 * plan.spacing, x = plan.arch.canal_half_width;
    const double size = plan.lumbar() ? 1.0 : plan.cervical() ? 0.75 : 0.72;
    shape::Compound shape;
    for (const Side side : {left, right})
        shape.add(shape::cone(side.at(0.95 * x, c + 10.0 * size, -5.0),
                              side.at((plan.lumbar() ? 1.08 : 1.2) * x, c + 9.0 * size, -s - 7.0 * size),
                              5.0 * size, 4.4 * size),
                  0.7, 2.0);
    return shape;
}

shape::Compound vertebra_shape(const VertebraPlan& plan, const Chance& chance) {
    const auto& [pw, ph, cw, cd, span, spine, drop] = plan.arch;
    const double c = plan.canal(), d = plan.own.half_depth, h = plan.own.half_height, s = 0.5 * plan.spacing;
    const double size = plan.lumbar() ? 1.0 : plan.cervical() ? 0.75 : 0.72;
    const double high = plan.cervical() ? 0.0 : 0.38 * h;  // of the pedicles
    shape::Compound shape;
    add_body(shape, plan, chance);
    for (const Side side : {left, right}) {
        const double x = cw + pw;
        shape.add(shape::sweep({{side.at(0.84 * x, d - 6.0, high - 0.5), pw + 0.8, ph + 0.8},
                                {side.at(0.97 * x, d + 3.0, high), pw, ph},
                                {side.at(x + 1.5, c + 5.0, high - 1.5), pw + 0.6, ph + 0.4}},
                               side.at(1.0, 0.0, 0.15)),
                  0.55, 4.0);
        // Articular process that reaches up.
        shape.add(shape::cone(side.at(x, c + 4.0 * size, high),
                              side.at(plan.lumbar() ? 1.5 * cw + 1.0 : 1.25 * cw, c + 6.0 * size,
                                      s + (plan.cervical() ? -1.0 : 5.0 * size)),
                              5.2 * size, 4.0 * size),
                  0.7, 2.5);
        // Between the two: the isthmus.
        shape.add(shape::cone(side.at(0.5 * (x + cw) + 2.0, c + 5.0 * size, high - 2.0),
                              side.at(0.95 * cw, c + 10.0 * size, -6.0), 4.8 * size, 4.8 * size),
                  0.9, 2.5);
        // Transverse process: flat and forward in the loins, stout and backward in the chest.
        const double back = plan.lumbar()     ? 2.0
                            : plan.cervical() ? -8.0
                            : plan.level > 15 ? 20.0
                            : plan.level > 13 ? 26.0
                                              : 30.0;
        const double bent =
            3.0 * chance.normal("transverse process", 2 * plan.level + (side.sign > 0 ? 0 : 1));
        const double rise = plan.lumbar() ? 3.0 + bent : plan.cervical() ? -3.0 : 2.0 + 0.4 * bent;
        const double y = plan.cervical() ? c - 3.0 : plan.lumbar() ? c + 4.0 : c + 7.0;
        shape.add(shape::sweep({{side.at(x - 1.0, y, high - 1.0), 5.5 * size, 4.2 * size},
                                {side.at(0.5 * (x + span), y + 0.5 * back, high - 1.0 + 0.4 * rise),
                                 (plan.lumbar() ? 4.6 : 4.4) * size, (plan.lumbar() ? 2.4 : 3.2) * size},
                                {side.at(span, y + back, high - 1.0 + rise),
                                 (plan.lumbar() ? 2.6 : 3.6) * size, (plan.lumbar() ? 1.5 : 2.8) * size}},
                               Vec3::UnitZ()),
                  0.5, 2.5);
        // Lamina, sloping back and down.
        shape.add(
            shape::sweep(
                {{side.at(0.95 * cw, c + 8.0 * size, -2.0), (plan.lumbar() ? 8.5 : 9.0) * size, 3.0 * size},
                 {side.at(0.5 * cw, c + cd + 3.0, -4.5), (plan.lumbar() ? 9.0 : 10.5) * size, 3.0 * size},
                 {side.at(0.0, c + cd + 5.5, -6.5), (plan.lumbar() ? 9.0 : 10.5) * size, 3.2 * size}},
                Vec3::UnitZ()),
            0.7, 2.0);
    }
    const shape::Compound lower = lower_facets(plan);
    shape.add(lower.solid(), 0.7, 2.0);
    const double aside = 2.0 * chance.normal("spinous process", plan.level);
    const double from = c + cd + 4.0;
    const double tall = plan.lumbar() ? 9.5 : plan.cervical() ? 4.5 : 7.5;
    const double bend = 1.2 * chance.normal("bend of a spinous process", plan.level);
    shape.add(shape::sweep({{Vec3(0.0, from, -6.5), tall, 3.6},
                            {Vec3(0.2 * aside + bend, from + 0.3 * spine, -6.5 - 0.25 * drop), tall, 2.4},
                            {Vec3(0.6 * aside + bend, from + 0.65 * spine, -6.5 - 0.62 * drop), tall, 2.8},
                            {Vec3(aside, from + spine, -6.5 - drop), 0.8 * tall, 4.2}},
                           Vec3::UnitZ(), 2.2),
              0.5, 2.5);
    // The canal is wider than deep, its corners behind the bodies.
    shape::Solid canal;
    canal.distance = [c, cw = cw, cd = cd](const Vec3& p) {
        const double x = p.x() / cw, y = (p.y() - c) / cd;
        return (std::sqrt(x * x + y * y) - 1.0) * std::min(cw, cd);
    };
    canal.box = {Vec3(-cw, c - cd, -60.0), Vec3(cw, c + cd, 60.0)};
    shape.cut(canal, 1.0);
    shape.roughen(plan.lumbar() ? 0.42 : 0.33, 0.3, chance.field("vertebral cortex", plan.level));
    return shape;
}

/// Distance to the neighbours above and below, on average [mm].
double spacing(std::size_t level) {
    const auto column = vertebrae();
    const std::size_t below = level == 0 ? 0 : level - 1, above = std::min(level + 1, column.size() - 1);
    return (column[above].z - column[below].z) / static_cast<double>(above - below);
}

VertebraPlan plan_of(std::size_t level, const Chance& chance) {
    VertebraPlan plan{vertebrae()[level], arches[level], static_cast<int>(level), spacing(level)};
    const double wider = 1.0 + 0.02 * chance.normal("vertebral width", plan.level);
    plan.own.half_width *= wider;
    return plan;
}

/// A slight curve to the side and a turn about the long axis with it; L5 and L4 lean forward.
Isometry3d place_of(const VertebraPlan& plan, const Chance& chance) {
    const double z = plan.own.z, bow = 2.2 * chance.normal("scoliosis"),
                 wave = 1.2 * chance.normal("counter curve");
    const double aside = bow * std::sin(z / 130.0 + 0.4) + wave * std::sin(z / 70.0);
    const double tilt = bow / 130.0 * std::cos(z / 130.0 + 0.4) + wave / 70.0 * std::cos(z / 70.0) +
                        0.6 * degrees * chance.normal("vertebral tilt", plan.level);
    const double turn = -0.012 * bow * std::sin(z / 130.0 + 0.4) +
                        1.0 * degrees * chance.normal("vertebral turn", plan.level);
    const double forward = plan.level == 0 ? 11.0 * degrees : plan.level == 1 ? 3.0 * degrees : 0.0;
    return Translation3d(aside, plan.own.front + plan.own.half_depth, z) *
           AngleAxisd(-std::atan(spine_slope(z)) + forward, Vec3::UnitX()) * AngleAxisd(tilt, Vec3::UnitY()) *
           AngleAxisd(turn, Vec3::UnitZ());
}

}  // namespace

shape::Compound sacrum() {
    // y, z of its middle line, half widths and depths; 105 mm wide and 110 high (anatomy texts give
    // 100 to 120). S1's plate leans forward by 40°.
    struct Level {
        double y, z, half_width, half_depth;
    };
    constexpr Level levels[] = {{30, -72, 51, 15}, {41, -88, 50, 14.5}, {54, -108, 41, 12},
                                {62, -128, 30, 9}, {65, -147, 20, 6.5}, {61, -163, 11, 5},
                                {52, -176, 7, 4},  {43, -184, 4, 3}};
    shape::Compound shape;
    std::vector<shape::Station> whole;
    for (const Level& at : levels) whole.push_back({Vec3(0, at.y, at.z), at.half_width, at.half_depth});
    shape.add(shape::sweep(whole, Vec3::UnitX(), 2.6), 0.7, 0.0);
    // Body of S1, with its promontory in front of the wings.
    shape.add(
        shape::sweep({{Vec3(0, 21, -62), 24, 15}, {Vec3(0, 34, -80), 22, 14}, {Vec3(0, 47, -98), 18, 11}},
                     Vec3::UnitX(), 2.5),
        0.7, 5.0);
    for (const Side side : {left, right}) {
        // The wings slope outward.
        shape.cut(shape::ellipsoid(side.at(46, 26, -52), Vec3(26, 34, 15),
                                   AngleAxisd(side.sign * 0.45, Vec3::UnitY()).toRotationMatrix()),
                  6.0);
        // Articular process of S1, lateral crest.
        shape.add(shape::cone(side.at(19, 50, -72), side.at(21, 53, -58), 5.5, 4.0), 1.0, 3.0);
    }
    // Median crest behind the canal, uneven and not quite in the middle.
    shape.add(shape::sweep({{Vec3(0.6, 66, -78), 5.0, 2.2},
                            {Vec3(-0.4, 69, -88), 6.0, 3.4},
                            {Vec3(1.0, 72, -98), 4.0, 2.2},
                            {Vec3(0.8, 76, -108), 5.5, 3.0},
                            {Vec3(-0.6, 77, -120), 3.6, 2.4},
                            {Vec3(0.3, 77, -131), 4.2, 2.2},
                            {Vec3(0.0, 75, -140), 2.2, 1.8}},
                           Vec3::UnitY()),
              0.5, 4.0);
    // The plate of S1, the canal and the foramina.
    shape.cut({[plate = shape::half_space(Vec3(0, 25, -60), Vec3(0, 0.55, -0.83)).distance](const Vec3& p) {
                   return std::max(plate(p), std::abs(p.x()) - 28.0);
               },
               {Vec3(-28, -20, -90), Vec3(28, 60, -20)}},
              2.0);
    shape.cut(shape::sweep({{Vec3(0, 50, -60), 11, 6},
                            {Vec3(0, 57, -82), 9, 4.5},
                            {Vec3(0, 65, -106), 6.5, 3.2},
                            {Vec3(0, 71, -132), 5, 2.5},
                            {Vec3(0, 70, -150), 4, 2}},
                           Vec3::UnitX()),
              1.5);
    for (const Side side : {left, right}) {
        // y, z where each begins in the canal, x there and in front; radius in front. Those in front open
        // outward and down; those behind are too narrow to show.
        constexpr double foramina[][5] = {{47, -94, 14, 25, 5.2},
                                          {58, -113, 12.5, 21.5, 4.6},
                                          {64, -131, 11, 18, 3.8},
                                          {66, -148, 9.5, 14, 3.0}};
        for (const auto& [y, z, from, to, radius] : foramina) {
            const double off = side.sign * 0.07 * (z + 120.0);
            shape.cut(shape::cone(side.at(from, y, z), side.at(to + off, y - 18.0, z - 9.0 + 0.5 * off),
                                  0.7 * radius, radius),
                      4.0);
        }
    }
    // What is left of the disc of S1 and S2.
    shape.cut(shape::ellipsoid(Vec3(0, 45.5, -95), Vec3(14, 7, 1.2),
                               AngleAxisd(-0.6, Vec3::UnitX()).toRotationMatrix()));
    return shape;
}

void add_spine(Bones& bones, const Chance& chance, double low, double high) {
    const auto column = vertebrae();
    for (std::size_t level = 0; level < column.size(); ++level) {
        if (column[level].z < low || column[level].z > high) continue;
        const VertebraPlan plan = plan_of(level, chance);
        const Isometry3d place = place_of(plan, chance);
        shape::Compound shape = vertebra_shape(plan, chance);
        if (level + 1 < column.size()) {
            // Joint spaces under the vertebra above.
            const VertebraPlan above = plan_of(level + 1, chance);
            shape.cut(shape::grown(
                shape::moved(lower_facets(above).solid(), place.inverse() * place_of(above, chance)), 2.4));
        }
        const shape::Surfaces surfaces = shape::polygonised(shape, plan.lumbar()     ? lumbar_cell
                                                                   : plan.cervical() ? cervical_cell
                                                                                     : thoracic_cell);
        bones.add(surfaces, place, plan.lumbar() ? lumbar_plaques : other_plaques);
        // The middle of a body has half the bone that there is near its plates.
        const double across = 0.92 * std::min(plan.own.half_depth, plan.own.half_height);
        bones.add_poor_marrow(place * Vec3(0, 0, 0), place.linear() * Vec3::UnitX(),
                              0.85 * plan.own.half_width, across, 0.13);
        bones.add_grain(shape, 0.6, plan.own.half_depth, plan.lumbar() ? 4.0 : 3.0, Vec3::UnitZ(),
                        chance.field("vertebral trabeculae", plan.level), place);
    }
    if (low < column.front().z) {
        shape::Compound shape = sacrum();
        const VertebraPlan fifth = plan_of(0, chance);
        shape.cut(shape::grown(shape::moved(lower_facets(fifth).solid(), place_of(fifth, chance)), 2.4));
        shape.roughen(0.45, 0.35, chance.field("sacral cortex"));
        const shape::Surfaces surfaces = shape::polygonised(shape, 2.0);
        bones.add(surfaces);
        bones.add_grain(shape, 0.4, 14.0, 5.0, Vec3(0, 0.3, 0.6), chance.field("sacral trabeculae"));
    }
}

}  // namespace render
