#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {
namespace {

/// The surface under the skin, which is 1.3 to 2.2 mm thick (texts): a little less, because the fat under it
/// is thin in places.
TriangleMesh under_skin(const TriangleMesh& surface) {
    constexpr double thick = 1.2;
    std::vector<Vec3> inward(surface.vertices.size(), Vec3::Zero());
    for (const auto& t : surface.triangles) {
        const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
        for (const int k : t) inward[k] -= (b - a).cross(c - a);
    }
    TriangleMesh inner = surface;
    for (std::size_t k = 0; k < inward.size(); ++k)
        inner.vertices[k] += thick * inward[k] / std::max(inward[k].norm(), 1e-9);
    return inner;
}

/// What runs through the fat under the skin: septa, and veins of 1 to 3 mm.
void add_septa(std::vector<TextureBlob>& blobs, const TriangleMesh& flesh, const shape::Solid& body,
               geometry::Random random) {
    constexpr double per_area = 0.006;  // [1/mm²]
    scatter(flesh, per_area, random, [&](const Vec3& at, const Vec3& inward) {
        const double out = random.between(1.5, 13.0), chosen = random(), length = random.between(7.0, 24.0),
                     x = random.between(-1, 1), y = random.between(-1, 1), z = random.between(-1, 1),
                     lean = random.between(-0.5, 0.5);
        const Vec3 middle = at - out * inward;
        if (body.distance(middle) > -3.0) return;
        // Along the surface more than across it.
        const Vec3 any(x, y, 1.5 * z);
        const Vec3 along = (any - any.dot(inward) * inward).normalized() + lean * inward;
        TextureBlob blob;
        blob.middle = middle.cast<float>();
        blob.axis = along.normalized().cast<float>();
        blob.radius = static_cast<float>(0.35 + 1.2 * std::pow(chosen, 4.0));
        blob.elongation = static_cast<float>(0.5 * length / blob.radius);
        blob.fraction = -0.9f;
        blobs.push_back(blob);
    });
}

/// A crease of the skin from place to place: both of its sides lie on each other.
void add_crease(std::vector<TextureBlob>& blobs, const shape::Solid& body, const std::vector<Vec3>& course,
                const Vec3& outward, double deep, geometry::Random random) {
    Polyline path;
    for (std::size_t i = 0; i + 1 < course.size(); ++i)
        for (int k = 0; k < 8; ++k) {
            Vec3 inside = course[i] + k / 8.0 * (course[i + 1] - course[i]);
            double low = 0.0, high = 200.0;
            for (int j = 0; j < 14; ++j) {
                const double middle = 0.5 * (low + high);
                (body.distance(inside + middle * outward) < 0.0 ? low : high) = middle;
            }
            path.push_back(inside + low * outward);
        }
    for (std::size_t k = 0; k + 1 < path.size(); ++k) {
        const Vec3 way = path[k + 1] - path[k];
        // Deepest in the middle of its course.
        const double part = std::sin(std::numbers::pi * (static_cast<double>(k) + 0.5) /
                                     static_cast<double>(path.size() - 1));
        for (const double depth : {0.25, 0.7}) {
            TextureBlob blob;
            blob.middle = (path[k] + 0.5 * way - depth * deep * part * outward).cast<float>();
            blob.axis = way.normalized().cast<float>();
            blob.radius = static_cast<float>(1.0 + 0.8 * part + random.between(-0.2, 0.4));
            blob.elongation = static_cast<float>(0.9 * way.norm() / blob.radius);
            blob.fraction = static_cast<float>(-0.9 * random.between(0.8, 1.1));
            blobs.push_back(blob);
        }
    }
}

/// Septa, and the creases of groins, buttocks and flanks.
void add_fat_under_skin(std::vector<TextureBlob>& blobs, const Chance& chance, const TriangleMesh& flesh,
                        const shape::Solid& body) {
    add_septa(blobs, flesh, body, geometry::Random(chance.field("septa of fat")));
    int index = 0;
    for (const Side side : {left, right}) {
        const auto at = [&](double x, double y, double z) { return side.at(x, y, z); };
        const std::vector<Vec3> groin{at(122, 0, -62), at(92, 0, -104), at(62, 0, -150), at(34, 0, -186)},
            buttock{at(24, 30, -226), at(60, 34, -238), at(100, 34, -236), at(136, 24, -222)},
            flank{at(100, 40, 62), at(140, 20, 52), at(172, 0, 50)};
        add_crease(blobs, body, groin, -Vec3::UnitY(), 9.0,
                   geometry::Random(chance.field("crease", index++)));
        add_crease(blobs, body, buttock, Vec3::UnitY(), 12.0,
                   geometry::Random(chance.field("crease", index++)));
        add_crease(blobs, body, flank, Vec3::UnitY(), 5.0, geometry::Random(chance.field("crease", index++)));
    }
}

/// Fat that parts a muscle from its neighbours: flakes along its surface, here more and there less.
void add_fat_plane(std::vector<TextureBlob>& fat, const shape::Solid& muscle, const shape::Solid& flesh,
                   double thick, std::uint64_t field) {
    constexpr double per_area = 0.042;  // [1/mm²]
    geometry::Random random(field);
    shape::Compound one;
    one.add(muscle);
    scatter(shape::polygonised(one, 8.0).outer, per_area, random, [&](const Vec3& at, const Vec3& inward) {
        const double x = random.between(-0.15, 0.15), y = random.between(-0.15, 0.15),
                     z = random.between(-0.15, 0.15), depth = random.between(-0.8, 0.8), wide = random();
        const double much = 0.65 + 0.8 * shape::noise(at, 34.0, field + 1);
        if (much < 0.1) return;
        TextureBlob blob;
        blob.middle = (at + depth * inward).cast<float>();
        blob.axis = (inward + Vec3(x, y, z)).normalized().cast<float>();
        blob.radius = static_cast<float>(4.2 + 4.6 * wide);
        blob.elongation = static_cast<float>(1.6 * thick * std::min(much, 1.4) / blob.radius);
        blob.fraction = 0.7f;
        if (flesh.distance(at) < -1.0 - blob.radius) fat.push_back(blob);
    });
}

/// Streaks of fat between the bundles of a muscle, along it.
void add_fat_streaks(std::vector<TextureBlob>& fat, const std::vector<shape::Station>& course, int count,
                     std::uint64_t field) {
    geometry::Random random(field);
    for (int k = 0; k < count; ++k) {
        const double at = random() * (static_cast<double>(course.size()) - 1.001),
                     x = random.between(-0.9, 0.9), y = random.between(-0.9, 0.9), size = random(),
                     length = random.between(10, 36), lean_x = random.between(-0.08, 0.08),
                     lean_y = random.between(-0.08, 0.08);
        if (x * x + y * y > 0.9) continue;
        const auto i = static_cast<std::size_t>(at);
        const double t = at - static_cast<double>(i);
        const shape::Station &a = course[i], &b = course[i + 1];
        TextureBlob blob;
        blob.middle =
            (a.at + t * (b.at - a.at) + Vec3(x * (a.a + t * (b.a - a.a)), y * (a.b + t * (b.b - a.b)), 0.0))
                .cast<float>();
        blob.axis = ((b.at - a.at).normalized() + Vec3(lean_x, lean_y, 0.0)).normalized().cast<float>();
        blob.radius = static_cast<float>(0.6 + 1.8 * size * size * size);
        blob.elongation = static_cast<float>(length / (1.0 + blob.radius) / blob.radius);
        blob.fraction = 0.75f;
        fat.push_back(blob);
    }
}

/// Muscles of the back, the belly's front, the buttocks and the thighs: where fat parts them.
void add_muscles(std::vector<TextureBlob>& fat, const Chance& chance, double front, const shape::Solid& flesh,
                 const Chest& chest) {
    struct Muscle {
        std::vector<shape::Station> course;
        int streaks;
        double thick;  // of the fat around it [mm]
    };
    const CageSection cage = chest.section(330.0), upper = chest.section(400.0);
    const double breast = cage.middle - cage.half_depth, back = cage.middle + cage.half_depth,
                 nape = upper.middle + upper.half_depth;
    const Vec3 shoulder = shoulder_joint(chest), arm = arm_direction(chest);
    int index = 0;
    for (const Side side : {left, right}) {
        const auto at = [&](double x, double y, double z) { return side.at(x, y, z); };
        const auto on_arm = [&](double along, double ahead, double out) {
            const Vec3 p = shoulder + along * arm + Vec3(out, ahead, 0.0);
            return side.at(p.x(), p.y(), p.z());
        };
        const Muscle muscles[] = {
            // Long muscles of the back, and the square one beside them.
            {{{at(28, 64, -96), 14, 12},
              {at(38, 68, -20), 27, 21},
              {at(38, 68, 70), 28, 22},
              {at(36, 74, 150), 25, 19},
              {at(34, 84, 230), 22, 14}},
             150,
             1.5},
            {{{at(70, 40, -32), 15, 8},
              {at(60, 38, 20), 17, 9},
              {at(50, 38, 80), 14, 8},
              {at(42, 36, 122), 9, 6}},
             30,
             1.3},
            {{{at(32, front + 26, 140), 30, 5},
              {at(34, front + 24, 60), 32, 5.5},
              {at(34, front + 24, -20), 32, 6},
              {at(28, front + 32, -110), 24, 7}},
             30,
             1.1},
            // Buttocks.
            {{{at(36, 88, -66), 12, 10},
              {at(62, 88, -104), 28, 16},
              {at(92, 74, -152), 34, 19},
              {at(118, 52, -206), 20, 14}},
             130,
             1.9},
            {{{at(108, 46, -36), 15, 9},
              {at(126, 34, -78), 19, 14},
              {at(138, 24, -128), 17, 14},
              {at(139, 16, -162), 8, 8}},
             60,
             1.4},
            // Thighs: in front, outside, inside, behind, and the long one across.
            {{{at(112, -34, -176), 20, 15},
              {at(106, -36, -270), 33, 25},
              {at(98, -32, -400), 36, 27},
              {at(92, -28, -540), 32, 25}},
             110,
             1.5},
            {{{at(142, -4, -196), 13, 24},
              {at(138, -6, -300), 19, 33},
              {at(124, -4, -420), 21, 33},
              {at(116, -4, -540), 19, 28}},
             90,
             1.3},
            {{{at(44, -8, -182), 18, 22},
              {at(58, -2, -255), 29, 29},
              {at(72, 2, -360), 26, 27},
              {at(84, 6, -480), 16, 19}},
             120,
             1.7},
            {{{at(72, 38, -206), 19, 16},
              {at(84, 44, -290), 29, 21},
              {at(88, 42, -400), 29, 21},
              {at(88, 38, -540), 23, 18}},
             110,
             1.8},
            {{{at(126, -58, -92), 8, 6},
              {at(104, -64, -180), 10, 7},
              {at(66, -56, -300), 11, 7},
              {at(44, -34, -440), 10, 8}},
             20,
             1.4},
            // Chest: in front, toward the arm; behind, from the back to the arm; the
            // serrated one beside the ribs; between nape and shoulder.
            {{{at(34, breast - 12, 330), 9, 52},
              {at(84, breast - 9, 346), 9, 46},
              {at(128, breast + 22, 376), 10, 28},
              {at(158, breast + 50, 398), 8, 12}},
             60,
             1.6},
            {{{at(66, back + 16, 236), 8, 40},
              {at(118, back - 6, 292), 9, 38},
              {at(146, back - 42, 350), 11, 22},
              {at(162, back - 74, 392), 8, 10}},
             70,
             1.7},
            {{{at(141, -6, 236), 6, 46}, {at(143, -2, 300), 7, 46}, {at(134, 8, 354), 7, 36}}, 40, 1.5},
            {{{at(24, nape + 26, 360), 8, 22},
              {at(44, nape + 20, 412), 10, 26},
              {at(98, nape - 4, 440), 9, 20},
              {at(140, shoulder.y() + 10, 444), 7, 10}},
             60,
             1.6},
            // Shoulder and upper arm.
            {{{on_arm(-22, 0, 8), 17, 24},
              {on_arm(20, 0, 22), 14, 30},
              {on_arm(70, 0, 24), 10, 24},
              {on_arm(110, 0, 16), 7, 10}},
             50,
             1.6},
            {{{on_arm(50, -14, 0), 12, 10}, {on_arm(140, -20, 2), 20, 15}, {on_arm(250, -16, 2), 16, 13}},
             40,
             1.6},
            {{{on_arm(40, 16, 0), 12, 10}, {on_arm(140, 20, 2), 21, 14}, {on_arm(260, 14, 2), 17, 11}},
             40,
             1.6}};
        for (const Muscle& muscle : muscles) {
            add_fat_plane(fat, shape::sweep(muscle.course, Vec3::UnitX()), flesh, muscle.thick,
                          chance.field("planes of fat", index));
            add_fat_streaks(fat, muscle.course, 6 * muscle.streaks, chance.field("streaks of fat", index));
            ++index;
        }
    }
}

}  // namespace

void add_skin_and_muscles(std::vector<TissueLayer>& layers, const Chance& chance, const shape::Solid& body,
                          const shape::Solid& tissue, const Chest& chest, double front) {
    std::vector<TextureBlob> blobs;
    add_fat_under_skin(blobs, chance, layers[1].mesh, body);
    add_muscles(blobs, chance, front, tissue, chest);
    layers.push_back({"fat", Material::Adipose, Material::SoftTissue, under_skin(layers[0].mesh), false});
    layers.back().texture_blobs = std::move(blobs);
}

}  // namespace render
