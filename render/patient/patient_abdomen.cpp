#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {
namespace {

using std::numbers::pi;
constexpr double fat_cell = 5.0, gas_cell = 2.4;  // of the grids [mm]
constexpr double bowel_wall = 2.0;                // between gas and what is around the bowel [mm]

/// A piece of bowel: its course, and the gas in it.
struct Bowel {
    std::vector<shape::Station> course;
    double fold;        // mean distance of folds [mm]; 0: none
    double fold_depth;  // as fraction of the radius
    struct Gas {
        double from, to;  // as fractions of the course
        double level;     // its surface is this far behind the middle, as fraction of the radius
    };
    std::vector<Gas> gas;
};

/// The wall's inner side: haustra between folds that reach over a third of the way around and do not meet,
/// no two alike.
shape::Solid lumen_of(const Bowel& bowel, const std::vector<shape::Station>& course, std::uint64_t field) {
    double radius = 0.0;
    for (const shape::Station& station : course) radius = std::max(radius, station.a);
    const double fold = bowel.fold, depth = bowel.fold_depth * radius;
    const Vec3 offset = course.front().at;
    const auto inset = [=](double s, double angle) {
        const double uneven =
            0.22 * radius * shape::noise(Vec3(s, 8.0 * angle, 0.0) + offset, 2.2 * radius, field) +
            0.10 * radius *
                shape::noise(Vec3(s, radius * std::cos(angle), radius * std::sin(angle)) + offset, 9.0,
                             field + 3);
        if (fold <= 0.0) return uneven;
        double deepest = 0.0;
        for (int sector = 0; sector < 3; ++sector) {
            const double away = std::remainder(angle - sector * 2.0 * pi / 3.0 - 0.5, 2.0 * pi);
            const double reach = std::clamp(1.35 - std::abs(away), 0.0, 1.0);
            const double phase =
                s / fold + 0.41 * sector +
                0.55 * shape::noise(Vec3(s, 40.0 * sector, 0.0) + offset, 2.5 * fold, field + 1);
            const double cut = std::pow(std::abs(std::cos(pi * phase)), 6.0);
            const double own =
                0.9 + 0.6 * shape::noise(Vec3(std::round(phase) * 9.0, sector * 31.0, 3.0), 7.0, field + 2);
            deepest = std::max(deepest, reach * cut * own);
        }
        return uneven + depth * deepest;
    };
    return shape::sweep(course, Vec3::UnitX() + 0.3 * Vec3::UnitZ(), 2.0, inset);
}

/// The part of a course between two fractions of its stations.
std::vector<shape::Station> part_of(const std::vector<shape::Station>& course, double from, double to) {
    std::vector<shape::Station> part;
    constexpr int steps = 10;
    for (int k = 0; k <= steps; ++k) {
        const double at = (from + (to - from) * k / steps) * (static_cast<double>(course.size()) - 1.0);
        const auto i = std::min(static_cast<std::size_t>(at), course.size() - 2);
        const double t = at - static_cast<double>(i);
        const shape::Station &a = course[i], &b = course[i + 1];
        part.push_back({a.at + t * (b.at - a.at), a.a + t * (b.a - a.a), a.b + t * (b.b - a.b)});
    }
    return part;
}

/// Colon: caecum, ascending, transverse, descending, sigmoid, rectum. Calibre 45 to 75 mm at the caecum, 35
/// to 50 beyond (texts; collapsed parts less), haustra every 25 mm (estimate).
std::vector<Bowel> colon(const Chance& chance, double front) {
    const double sag = 14.0 * chance.normal("transverse colon"), f = front + 40.0;
    const auto w = [&](const char* name, double value, double spread) {
        return value * (1.0 + spread * chance.normal(name));
    };
    const double r = w("calibre of the colon", 1.0, 0.12);
    std::vector<Bowel> all;
    all.push_back({{{Vec3(-94, -14, -86), 20 * r, 18 * r},
                    {Vec3(-104, -8, -62), 27 * r, 24 * r},
                    {Vec3(-109, 4, -28), 24 * r, 21 * r},
                    {Vec3(-111, 12, 8), 21 * r, 19 * r},
                    {Vec3(-108, 12, 42), 22 * r, 19 * r},
                    {Vec3(-98, 0, 66), 20 * r, 17 * r}},
                   27,
                   0.42,
                   {{0.02, 0.42, 0.1}, {0.55, 0.96, -0.1}}});
    all.push_back({{{Vec3(-92, -14, 72), 19 * r, 17 * r},
                    {Vec3(-74, f + 8, 58 - 0.3 * sag), 20 * r, 18 * r},
                    {Vec3(-42, f - 2, 34 - 0.8 * sag), 21 * r, 18 * r},
                    {Vec3(0, f - 6, 22 - sag), 21 * r, 18 * r},
                    {Vec3(40, f - 2, 40 - 0.8 * sag), 20 * r, 17 * r},
                    {Vec3(76, f + 14, 82), 18 * r, 16 * r},
                    {Vec3(100, 2, 118), 21 * r, 18 * r},
                    {Vec3(112, 20, 112), 18 * r, 16 * r}},
                   24,
                   0.45,
                   {{0.08, 0.36, 0.3}, {0.50, 0.64, 0.1}, {0.80, 0.97, 0.2}}});
    all.push_back({{{Vec3(116, 24, 92), 15 * r, 14 * r},
                    {Vec3(118, 24, 50), 13 * r, 12 * r},
                    {Vec3(116, 20, 6), 13 * r, 12 * r},
                    {Vec3(110, 4, -40), 13 * r, 12 * r},
                    {Vec3(98, -22, -74), 14 * r, 13 * r}},
                   22,
                   0.38,
                   {{0.12, 0.34, 0.5}, {0.62, 0.74, 0.4}}});
    const double over = 12.0 * chance.normal("sigmoid colon");
    all.push_back({{{Vec3(92, -26, -88), 14 * r, 13 * r},
                    {Vec3(64, -34, -108 + 0.4 * over), 16 * r, 15 * r},
                    {Vec3(36, -30, -92 + over), 18 * r, 17 * r},
                    {Vec3(6, -24, -84 + over), 18 * r, 17 * r},
                    {Vec3(-16, -6, -104 + 0.5 * over), 16 * r, 15 * r},
                    {Vec3(-6, 18, -122), 16 * r, 15 * r},
                    {Vec3(0, 34, -140), 20 * r, 18 * r},
                    {Vec3(0, 38, -164), 20 * r, 17 * r},
                    {Vec3(0, 32, -184), 13 * r, 12 * r}},
                   26,
                   0.36,
                   {{0.14, 0.30, 0.2}, {0.40, 0.56, 0.1}, {0.72, 0.90, 0.0}}});
    return all;
}

/// Loops of small bowel 22 to 27 mm wide, some 3 m of them, that wander through the middle of the abdomen and
/// turn back at its borders.
std::vector<Bowel> small_bowel(const Chance& chance, double front) {
    std::vector<Bowel> loops;
    geometry::Random random(chance.field("small bowel"));
    constexpr int count = 15, pieces = 11;
    for (int loop = 0; loop < count; ++loop) {
        Bowel bowel;
        bowel.fold = 7.0;
        bowel.fold_depth = 0.14;
        // In an order of their own: that of arguments differs from compiler to compiler.
        const double height = random.between(-128, 28), depth = random.between(34, 96),
                     left = random.between(-70, 75);
        Vec3 at(left, front + depth, height);
        const double direction_z = random.between(-0.6, 0.6), direction_y = random.between(-0.5, 0.5),
                     direction_x = random.between(-1, 1);
        Vec3 direction(direction_x, direction_y, direction_z);
        direction.normalize();
        const double calibre = random.between(10.5, 13.5);
        for (int k = 0; k < pieces; ++k) {
            bowel.course.push_back(
                {at, calibre * random.between(0.85, 1.1), calibre * random.between(0.8, 1.0)});
            const double z = random.between(-1, 1), y = random.between(-0.7, 0.7), x = random.between(-1, 1);
            const Vec3 swerve(x, y, z);
            direction = (direction + 0.85 * swerve).normalized();
            for (int axis = 0; axis < 3; ++axis) {
                const double low = axis == 0   ? -82
                                   : axis == 1 ? front + 32
                                               : -136,
                             high = axis == 0   ? 86
                                    : axis == 1 ? front + 100
                                                : 34;
                const double next = at[axis] + 20.0 * direction[axis];
                if (next < low || next > high) direction[axis] = -direction[axis];
            }
            at += 20.0 * direction;
        }
        if (loop % 4 == 1) {
            const double from = random.between(0.1, 0.5);
            bowel.gas.push_back({from, from + random.between(0.14, 0.34), random.between(-0.4, 0.2)});
        }
        loops.push_back(std::move(bowel));
    }
    return loops;
}

/// Stool with gas in it, as places of more and of less gas in a mottled colon. They lie apart from the larger
/// gas: where two enclose a place, it would be lighter than air.
void add_stool(std::vector<TextureBlob>& gas, const std::vector<shape::Station>& course, int count,
               std::uint64_t field, const std::vector<shape::Compound>& pockets) {
    geometry::Random random(field);
    for (int k = 0; k < count; ++k) {
        const double at = random() * (static_cast<double>(course.size()) - 1.001),
                     angle = random.between(0, 2 * pi), out = 0.85 * std::sqrt(random()),
                     along = random.between(-0.3, 0.3);
        const auto i = static_cast<std::size_t>(at);
        const double t = at - static_cast<double>(i);
        const shape::Station &a = course[i], &b = course[i + 1];
        const double wide = a.a + t * (b.a - a.a);
        const Vec3 centre =
            a.at + t * (b.at - a.at) + out * wide * Vec3(std::cos(angle), std::sin(angle), along);
        const double x = random.between(-1, 1), y = random.between(-1, 1), z = random.between(-1, 1),
                     chosen = random();
        TextureBlob blob;
        blob.middle = centre.cast<float>();
        blob.axis = Vec3(x, y, z + 1e-6).normalized().cast<float>();
        blob.radius = static_cast<float>(0.9 + 4.2 * chosen * chosen * chosen);
        blob.elongation = static_cast<float>(random.between(0.6, 2.2));
        blob.fraction = static_cast<float>(random.between(0.15, 0.6));
        const double reach = blob.radius * std::max(1.0f, blob.elongation);
        // Stool lies in lumps, with more gas between them than in them.
        if (shape::noise(centre, 17.0, field + 1) < random.between(-1.0, 0.6) ||
            std::any_of(pockets.begin(), pockets.end(), [&](const shape::Compound& pocket) {
                return pocket.box().exteriorDistance(centre) < reach &&
                       pocket.at(centre).distance < reach + 0.5;
            }))
            continue;
        gas.push_back(blob);
    }
}

/// Gas of the stomach, which in a patient on the back lies in front, in body and antrum, between long folds.
shape::Compound stomach_gas(const Chance& chance) {
    const std::uint64_t field = chance.field("gas of the stomach");
    const double full = 1.0 + 0.12 * chance.normal("gas of the stomach");
    const std::vector<shape::Station> course{{Vec3(59, -34, 172), 20 * full, 19},
                                             {Vec3(57, -42, 148), 24 * full, 20},
                                             {Vec3(42, -57, 116), 19 * full, 16},
                                             {Vec3(14, -57, 101), 12 * full, 11}};
    const auto inset = [=](double along, double angle) {
        const Vec3 on_wall(along, 20.0 * std::cos(angle), 20.0 * std::sin(angle));
        const double folds = 0.5 + 0.5 * std::cos(10.0 * angle + 2.5 * shape::noise(on_wall, 22.0, field));
        return 3.5 * (0.6 + 0.6 * shape::noise(on_wall, 26.0, field + 1)) +
               2.4 * folds * (0.6 + 0.6 * shape::noise(on_wall, 17.0, field + 2));
    };
    shape::Compound lumen;
    lumen.add(shape::sweep(course, Vec3::UnitX(), 2.0, inset));
    lumen.keep(shape::half_space(Vec3(50, -46, 130), Vec3(0, 1, 0.03)), 2.0);
    return lumen;
}

/// The long axis of a kidney next to T12 to L3, 110 mm long, 55 wide, 45 thick (texts), the left one higher;
/// and that of the fat around it.
std::vector<shape::Station> kidney_course(Side side, double middle, std::vector<shape::Station>* fat) {
    const auto at = [&](double x, double y, double z) { return side.at(x, y, middle + z); };
    // The long axis leans outward and forward below.
    const std::vector<shape::Station> course{
        {at(48, 30, 56), 4, 3},    {at(49, 29, 52), 12, 9},  {at(51, 28, 42), 20, 15},
        {at(55, 25, 20), 26, 19},  {at(60, 21, -4), 25, 20}, {at(65, 16, -28), 25, 19},
        {at(68, 12, -44), 19, 15}, {at(70, 10, -52), 11, 9}, {at(70, 10, -55), 4, 3}};
    for (std::size_t i = 1; i + 1 < course.size(); ++i)
        fat->push_back(
            {course[i].at + 0.25 * (course[i].at - course[4].at), course[i].a + 12.0, course[i].b + 10.0});
    return course;
}

/// Psoas and iliacus from the twelfth rib to the thigh.
shape::Solid psoas(const Side side) {
    return shape::sweep({{side.at(27, 24, 118), 6, 8},
                         {side.at(34, 22, 80), 11, 14},
                         {side.at(39, 20, 40), 16, 18},
                         {side.at(45, 15, 0), 19, 21},
                         {side.at(54, 4, -40), 20, 22},
                         {side.at(68, -10, -84), 20, 19},
                         {side.at(86, -22, -124), 20, 16},
                         {side.at(98, -18, -165), 17, 15}},
                        Vec3::UnitX());
}

}  // namespace

void add_abdomen_layers(std::vector<TissueLayer>& layers, const Chance& chance, const shape::Solid& flesh,
                        const shape::Solid& cavity, double front, bool with_gas) {
    std::vector<shape::Station> fat_left, fat_right;
    const std::vector<shape::Station> on_left = kidney_course(left, 84.0, &fat_left),
                                      on_right = kidney_course(right, 70.0, &fat_right);
    const std::vector<Bowel> large = colon(chance, front), small = small_bowel(chance, front);

    // Fat fills what organs leave free.
    shape::Compound fat;
    fat.add(cavity);
    fat.cut({[](const Vec3& p) {
                 const double x = p.x() / 33.0, y = (p.y() - spine_front(p.z()) - 20.0) / 30.0;
                 return 30.0 * (std::sqrt(x * x + y * y) - 1.0);
             },
             {Vec3(-33, -40, -400), Vec3(33, 90, 400)}});
    for (const Side side : {left, right}) fat.cut(psoas(side), 2.0);
    // Great vessels.
    fat.cut(
        shape::sweep({{Vec3(12, -12, 170), 12, 12}, {Vec3(10, -14, 80), 11, 11}, {Vec3(2, -16, 0), 10, 10}},
                     Vec3::UnitX()),
        1.0);
    fat.cut(shape::sweep(
                {{Vec3(-22, -14, 170), 12, 12}, {Vec3(-18, -12, 80), 12, 10}, {Vec3(-12, -8, -4), 11, 9}},
                Vec3::UnitX()),
            1.0);
    for (const Side side : {left, right})
        fat.cut(shape::sweep({{side.at(6, -14, -4), 11, 10},
                              {side.at(34, 0, -60), 11, 11},
                              {side.at(62, -14, -120), 9, 9},
                              {side.at(72, -24, -170), 8, 8}},
                             Vec3::UnitX()),
                1.0);
    // Liver: right lobe with its lower edge, left lobe. Spleen 110 × 70 × 45 mm, stomach, bladder.
    fat.cut(shape::ellipsoid(Vec3(-72, -12, 150), Vec3(76, 74, 78)), 3.0);
    fat.cut(shape::ellipsoid(Vec3(-104, 4, 104), Vec3(30, 48, 54),
                             Eigen::AngleAxisd(0.15, Vec3::UnitY()).toRotationMatrix()),
            8.0);
    fat.cut(shape::ellipsoid(Vec3(6, -48, 158), Vec3(58, 34, 36),
                             Eigen::AngleAxisd(0.25, Vec3::UnitY()).toRotationMatrix()),
            6.0);
    fat.cut(shape::ellipsoid(Vec3(102, 34, 150), Vec3(24, 36, 54),
                             Eigen::AngleAxisd(-0.3, Vec3::UnitX()).toRotationMatrix()),
            2.0);
    fat.cut(shape::sweep({{Vec3(58, -20, 190), 32, 30},
                          {Vec3(58, -38, 150), 30, 26},
                          {Vec3(40, -58, 112), 24, 20},
                          {Vec3(6, -56, 98), 17, 16},
                          {Vec3(-24, -40, 104), 14, 13}},
                         Vec3::UnitX()),
            2.0);
    fat.cut(shape::ellipsoid(Vec3(0, -12, -152), Vec3(44, 32, 28)), 3.0);
    // About the kidneys; the bowel, with its gas, is cut out of this fat too.
    for (const auto* course : {&fat_left, &fat_right})
        fat.add(shape::sweep(*course, Vec3::UnitX()), 0.0, 4.0);
    TriangleMesh gas;
    int index = 0;
    std::vector<shape::Compound> pockets = {stomach_gas(chance)};
    const shape::Solid inner = shape::grown(flesh, -2.0);
    const shape::Solid kidneys[] = {shape::sweep(on_left, Vec3::UnitX()),
                                    shape::sweep(on_right, Vec3::UnitX())};
    for (const std::vector<Bowel>* bowels : {&large, &small}) {
        for (const Bowel& bowel : *bowels) {
            fat.cut(shape::sweep(bowel.course, Vec3::UnitX() + 0.3 * Vec3::UnitZ()), 1.5);
            const std::uint64_t field = chance.field("bowel gas", index++);
            for (const Bowel::Gas& bubble : bowel.gas) {
                std::vector<shape::Station> course = part_of(bowel.course, bubble.from, bubble.to);
                for (shape::Station& station : course) {
                    station.a -= bowel_wall;
                    station.b -= bowel_wall;
                }
                shape::Compound one;
                one.add(lumen_of(bowel, course, field), 0.0, 0.0);
                // The patient lies: gas is in front of the fluid.
                const shape::Station& middle = course[course.size() / 2];
                // What is in the bowel is no still water: its surface is uneven.
                const Vec3 level = middle.at + Vec3(0, bubble.level * middle.b, 0);
                one.keep({[=](const Vec3& p) {
                              return 0.6 * (p.y() - level.y() + 7.0 * shape::noise(p, 21.0, field + 5) +
                                            3.0 * shape::noise(p, 9.0, field + 6));
                          },
                          shape::half_space(level, Vec3(0, 1, 0.02)).box},
                         5.0);
                one.keep(inner, 0.0);
                for (const shape::Solid& kidney : kidneys) one.cut(shape::grown(kidney, 5.0), 0.0);
                // Neighbours press on each other, with two walls between.
                for (const shape::Compound& earlier : pockets)
                    if (earlier.box().intersects(one.box()))
                        one.cut(shape::grown(earlier.solid(), 2.0 * bowel_wall), 0.0);
                pockets.push_back(std::move(one));
            }
        }
    }
    // Haustra may bulge beyond the course that was cut. Fat that reached into gas would be lighter than air.
    for (const shape::Compound& pocket : pockets) {
        fat.cut(shape::grown(pocket.solid(), bowel_wall), 0.0);
        if (with_gas) append(gas, shape::polygonised(pocket, gas_cell).outer);
    }
    // The bowel touches a kidney through some fat.
    for (const shape::Solid& kidney : kidneys) fat.add(shape::grown(kidney, 2.5), 0.0, 0.0);
    layers.push_back({"abdominal fat", Material::Adipose, Material::SoftTissue,
                      shape::polygonised(fat, fat_cell).outer, false});
    add_kidney_layers(layers, chance, left, on_left);
    add_kidney_layers(layers, chance, right, on_right);
    if (!with_gas) return;
    std::vector<TextureBlob> stool;
    add_stool(stool, part_of(large[0].course, 0.0, 0.95), 1500, chance.field("stool", 0), pockets);
    add_stool(stool, part_of(large[1].course, 0.3, 0.9), 700, chance.field("stool", 1), pockets);
    add_stool(stool, part_of(large[2].course, 0.0, 1.0), 900, chance.field("stool", 2), pockets);
    add_stool(stool, part_of(large[3].course, 0.35, 0.95), 900, chance.field("stool", 3), pockets);
    layers.push_back({"bowel gas", Material::Air, Material::SoftTissue, std::move(gas), false});
    layers.back().texture_blobs = std::move(stool);
}

}  // namespace render
