#include "render/patient/patient.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "physics/geometry/mesh_topology.h"
#include "render/patient/patient_parts.h"
#include "render/patient/solids.h"
#include "render/xray/path_length.h"
#include "render/xray/texture_blobs.h"

namespace {

using geometry::BodyPlace;
using geometry::Landmark;
using geometry::TriangleMesh;
using geometry::Vec3;
using render::CArm;
using render::PatientSpec;
using render::TissueLayer;

/// A patient around vessels that fill a box of the body.
PatientSpec around(double low, double high) {
    PatientSpec spec;
    spec.origin = Vec3::Zero();
    spec.lower = {-60, -60, low};
    spec.upper = {60, 60, high};
    return spec;
}
/// Its layers, made once for all tests of a process that ask for them.
const std::vector<TissueLayer>& body_of(double low, double high, std::uint64_t seed = 0) {
    static std::map<std::tuple<double, double, std::uint64_t>, std::vector<TissueLayer>> made;
    const auto [at, fresh] = made.try_emplace({low, high, seed});
    if (fresh) {
        PatientSpec spec = around(low, high);
        spec.seed = seed;
        at->second = render::make_patient(spec);
    }
    return at->second;
}
const std::vector<TissueLayer>& whole_body() {
    return body_of(-150, 660);
}

const TriangleMesh* mesh_of(const std::vector<TissueLayer>& layers, const std::string& name) {
    for (const TissueLayer& layer : layers) {
        if (layer.name == name) return &layer.mesh;
    }
    return nullptr;
}

/// Separates points inside a solid from those outside by the sum of crossings of a ray.
class Inside {
public:
    // The ray is slanted, so that it meets no edge of solids built on a lattice.
    explicit Inside(const TriangleMesh& mesh, const Vec3& along = Vec3(0.317, 0.211, 0.925))
        : along_(along.normalized()), mesh_(mesh) {
        for (const auto& t : mesh.triangles) {
            Eigen::AlignedBox2d box;
            for (const int corner : t) box.extend(flat(mesh.vertices[corner]));
            boxes_.push_back(box);
            all_.extend(box);
        }
        for (std::size_t i = 0; i < boxes_.size(); ++i) {
            const Eigen::Array2i first = cell(boxes_[i].min()), last = cell(boxes_[i].max());
            for (int x = first.x(); x <= last.x(); ++x)
                for (int y = first.y(); y <= last.y(); ++y) cells_[x * side_ + y].push_back(i);
        }
    }
    bool operator()(const Vec3& p) const {
        if (!all_.contains(flat(p))) return false;
        const Eigen::Array2i at = cell(flat(p));
        int count = 0;
        for (const std::size_t i : cells_[at.x() * side_ + at.y()]) {
            if (!boxes_[i].contains(flat(p))) continue;
            const auto& t = mesh_.triangles[i];
            const Vec3 a = mesh_.vertices[t[0]] - p, b = mesh_.vertices[t[1]] - p,
                       c = mesh_.vertices[t[2]] - p;
            const double u = along_.dot(b.cross(c)), v = along_.dot(c.cross(a)), w = along_.dot(a.cross(b));
            const bool out = u > 0 && v > 0 && w > 0, in = u < 0 && v < 0 && w < 0;
            const Vec3 normal = (b - a).cross(c - a);
            if ((out || in) && a.dot(normal) / along_.dot(normal) > 0) count += out ? 1 : -1;
        }
        return count > 0;
    }

private:
    static constexpr int side_ = 128;
    const Vec3 along_, across_ = along_.unitOrthogonal(), up_ = along_.cross(across_);
    Eigen::Vector2d flat(const Vec3& p) const { return {p.dot(across_), p.dot(up_)}; }
    Eigen::Array2i cell(const Eigen::Vector2d& at) const {
        const Eigen::Array2d fraction = (at - all_.min()).array() / all_.sizes().array();
        return (fraction * side_).cast<int>().max(0).min(side_ - 1);
    }

    const TriangleMesh& mesh_;
    std::vector<Eigen::AlignedBox2d> boxes_;
    Eigen::AlignedBox2d all_;
    /// Which triangles' boxes reach into which cell of a lattice over all of them.
    std::vector<std::vector<std::size_t>> cells_{side_ * side_};
};

/// Fraction of a mesh's vertices, about 3000 of them, that lie inside another. A ray may run along an edge: a
/// vertex is outside if two more rays do not both find it inside.
double fraction_inside(const TriangleMesh& what, const TriangleMesh& of) {
    const Inside inside(of), second(of, {-0.513, 0.187, 0.838}), third(of, {0.229, -0.671, 0.705});
    int held = 0, all = 0;
    const std::size_t every = what.vertices.size() / 3000 | 1;
    for (std::size_t i = 0; i < what.vertices.size(); i += every, ++all) {
        const Vec3& p = what.vertices[i];
        held += inside(p) || (second(p) && third(p));
    }
    return double(held) / all;
}

/// Two or three vertices of thousands may lie on a flat triangle of the outer mesh, where its true surface is
/// further out.
constexpr double nested = 0.999;

/// Distance along a ray to where `holds` first changes.
template <class Holds>
double first_change(const Holds& holds, const Vec3& from, const Vec3& way, double start, double most) {
    const bool at_start = holds(from + start * way);
    for (double s = start; s < most; s += 0.1)
        if (holds(from + s * way) != at_start) return s - 0.05;
    return most;
}

TEST(Solids, AreClosedOutwardAndOfTheRightVolume) {
    const auto ball = render::ellipsoid(Vec3(5, 6, 7), Vec3(10, 20, 30), 64);
    EXPECT_EQ(render::unmatched_edges(ball), 0);
    EXPECT_NEAR(geometry::signed_volume(ball) / (4.0 / 3.0 * std::numbers::pi * 6000.0), 1.0, 0.01);
    const auto star = render::star(
        Vec3(5, 6, 7), [](const Vec3&) { return 10.0; }, 64);
    EXPECT_EQ(render::unmatched_edges(star), 0);
    EXPECT_NEAR(geometry::signed_volume(star) / (4.0 / 3.0 * std::numbers::pi * 1000.0), 1.0, 0.01);
    // The same, whichever way the path runs.
    for (double end : {40.0, -40.0}) {
        const auto rod = render::tube({{0, 0, 0}, {0, 0, end}}, Vec3(1, 0, 0), {5, 5}, {3, 3}, 64);
        EXPECT_EQ(render::unmatched_edges(rod), 0);
        EXPECT_NEAR(geometry::signed_volume(rod) / (std::numbers::pi * 15.0 * 40.0), 1.0, 0.01);
    }
}

TEST(Patient, ConsistsOfClosedMeshes) {
    std::size_t triangles = 0;
    for (const auto& layer : whole_body()) {
        EXPECT_FALSE(layer.mesh.triangles.empty()) << layer.name;
        EXPECT_EQ(render::unmatched_edges(layer.mesh), 0) << layer.name;
        EXPECT_GT(geometry::signed_volume(layer.mesh), 0.0) << layer.name;
        triangles += layer.mesh.triangles.size();
    }
    // Of a body from the thighs to the vertex; no exercise shows all of it.
    EXPECT_LE(triangles, 1'100'000u);
    for (const auto& [low, high, most] :
         {std::array{-190.0, 130.0, 640e3}, {200.0, 380.0, 700e3}, {560.0, 700.0, 600e3}}) {
        std::size_t part = 0;
        for (const auto& layer : body_of(low, high)) part += layer.mesh.triangles.size();
        EXPECT_LE(static_cast<double>(part), most) << "from " << low << " to " << high;
    }
}

TEST(Patient, HasTheOrgansOfTheRegionThatTheVesselsReach) {
    const auto names = [](double low, double high) {
        std::set<std::string> result;
        for (const TissueLayer& layer : body_of(low, high)) result.insert(layer.name);
        return result;
    };
    const auto belly = names(-190, 0), chest = names(320, 330), head = names(590, 670);
    EXPECT_TRUE(belly.contains("left kidney") && belly.contains("right kidney"));
    EXPECT_FALSE(belly.contains("heart") || belly.contains("brain"));
    EXPECT_TRUE(chest.contains("heart") && chest.contains("left lung") && chest.contains("diaphragm"));
    EXPECT_FALSE(chest.contains("left kidney") || chest.contains("brain"));
    EXPECT_TRUE(head.contains("brain") && head.contains("sinuses"));
    EXPECT_FALSE(head.contains("left kidney") || head.contains("heart"));
}

TEST(Patient, LiesWhereItsLandmarkIs) {
    for (const Landmark landmark : {Landmark::AorticBifurcation, Landmark::AorticValve, Landmark::Sella}) {
        EXPECT_EQ(geometry::landmark_named(geometry::name_of(landmark)), landmark);
        const Vec3 at(3, -20, 7);
        const auto spec = render::patient_around(std::vector<Vec3>{at}, {landmark, at});
        EXPECT_TRUE(spec.origin.isApprox(at - render::place_in_body(landmark)));
    }
    EXPECT_FALSE(geometry::landmark_named("knee"));
    // The valve lies behind the sternum in the heart, the sella in the skull.
    const auto& layers = whole_body();
    EXPECT_TRUE(
        Inside(*mesh_of(layers, "heart"))(render::place_in_body(Landmark::AorticValve) + Vec3(0, 0, -5)));
    EXPECT_TRUE(Inside(*mesh_of(layers, "brain"))(render::place_in_body(Landmark::Sella) + Vec3(0, 0, 25)));
}

TEST(Patient, KeepsNestedSolidsStrictlyNested) {
    const auto& layers = whole_body();
    const char* const pairs[][2] = {{"fat", "body"},
                                    {"trunk", "body"},
                                    {"left lung", "trunk"},
                                    {"right lung", "trunk"},
                                    {"heart", "trunk"},
                                    {"diaphragm", "trunk"},
                                    {"airway", "trunk"},
                                    {"throat", "trunk"},
                                    {"teeth", "trunk"},
                                    {"abdominal fat", "trunk"},
                                    {"left kidney", "abdominal fat"},
                                    {"right kidney", "abdominal fat"},
                                    {"brain", "trunk"},
                                    {"sinuses", "sinus walls"},
                                    {"nasal cavity", "trunk"},
                                    {"bones", "trunk"},
                                    {"bowel gas", "trunk"}};
    for (const auto& [inner, outer] : pairs) {
        EXPECT_GE(fraction_inside(*mesh_of(layers, inner), *mesh_of(layers, outer)), nested)
            << inner << " in " << outer;
    }
    // Where fat is as thin as skin, flesh may touch it.
    EXPECT_GE(fraction_inside(*mesh_of(layers, "trunk"), *mesh_of(layers, "fat")), 0.99);
    // Marrow lies under meshes of shells from 0.06 mm on, which flat triangles may cut.
    EXPECT_GE(fraction_inside(*mesh_of(layers, "marrow"), *mesh_of(layers, "bones")), 0.95);
    TriangleMesh lungs = *mesh_of(layers, "left lung");
    render::append(lungs, *mesh_of(layers, "right lung"));
    EXPECT_GE(fraction_inside(*mesh_of(layers, "lung vessels"), lungs), nested);
}

TEST(Patient, HasKidneysOfCortexAndMedulla) {
    for (const std::uint64_t seed : {0, 3, 17}) {
        const auto& layers = body_of(-190, 0, seed);
        for (const std::string kidney : {"left kidney", "right kidney"}) {
            const TriangleMesh &whole = *mesh_of(layers, kidney),
                               &cortex = *mesh_of(layers, kidney + " cortex"),
                               &medulla = *mesh_of(layers, kidney + " medulla");
            const double volume = geometry::signed_volume(whole), inner = geometry::signed_volume(medulla);
            EXPECT_NEAR(geometry::signed_volume(cortex) + inner, volume, 1e-6 * volume);
            // 110 to 190 ml; a cortex of 70 % (texts).
            EXPECT_GT(volume, 80e3) << kidney;
            EXPECT_LT(volume, 190e3) << kidney;
            EXPECT_GT(inner, 0.22 * volume) << kidney << " of seed " << seed;
            EXPECT_LT(inner, 0.36 * volume) << kidney << " of seed " << seed;
            EXPECT_GE(fraction_inside(medulla, whole), nested) << kidney << " of seed " << seed;
        }
    }
}

/// Pieces of a mesh that share no edge, of more than a few triangles.
int separate_pieces(const TriangleMesh& mesh) {
    const int triangles = static_cast<int>(mesh.triangles.size());
    std::vector<int> parent(mesh.triangles.size()), count(mesh.triangles.size(), 0);
    for (int i = 0; i < triangles; ++i) parent[i] = i;
    const auto root = [&](int i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    std::map<std::pair<int, int>, int> edges;
    for (int i = 0; i < triangles; ++i)
        for (int k = 0; k < 3; ++k) edges[{mesh.triangles[i][k], mesh.triangles[i][(k + 1) % 3]}] = i;
    for (const auto& [ends, triangle] : edges)
        if (const auto other = edges.find({ends.second, ends.first}); other != edges.end())
            parent[root(triangle)] = root(other->second);
    for (int i = 0; i < triangles; ++i) ++count[root(i)];
    return static_cast<int>(std::count_if(count.begin(), count.end(), [](int n) { return n > 30; }));
}

TEST(Patient, HasRenalPyramidsInTwoRowsThatDifferFromKidneyToKidney) {
    std::set<int> counts;
    for (const std::uint64_t seed : {1, 3, 17}) {
        const auto& layers = body_of(-190, 0, seed);
        for (const std::string kidney : {"left kidney", "right kidney"}) {
            const TriangleMesh& medulla = *mesh_of(layers, kidney + " medulla");
            // Texts count 8 to 18; some are fused.
            const int pieces = separate_pieces(medulla);
            EXPECT_GE(pieces, 7) << kidney << " of seed " << seed;
            EXPECT_LE(pieces, 18) << kidney << " of seed " << seed;
            counts.insert(pieces);
        }
    }
    EXPECT_GT(counts.size(), 1u);
}

TEST(Patient, HasTerritoriesOfTheBrainWithBordersThatWanderAndInterlock) {
    const auto& layers = body_of(590, 670, 4);
    const Vec3 sella = render::place_in_body(Landmark::Sella);
    const Inside anterior(*mesh_of(layers, "brain, left ACA"));
    // Where the anterior artery's strip ends to the left, less the plane that fits best.
    std::vector<Eigen::Vector4d> rows;
    for (double y = -30; y <= 45; y += 5)
        for (double z = 40; z <= 75; z += 5) {
            const Vec3 from = sella + Vec3(6, y, z);
            if (!anterior(from)) continue;
            rows.emplace_back(1, y, z, first_change(anterior, from, Vec3::UnitX(), 0.0, 60.0));
        }
    ASSERT_GT(rows.size(), 60u);
    Eigen::MatrixXd places(rows.size(), 3);
    Eigen::VectorXd ends(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        places.row(static_cast<int>(i)) = rows[i].head<3>();
        ends[static_cast<int>(i)] = rows[i][3];
    }
    const Eigen::VectorXd off = ends - places * places.colPivHouseholderQr().solve(ends);
    const double deviation = off.norm() / std::sqrt(static_cast<double>(rows.size()));
    RecordProperty("deviation_mm", std::to_string(deviation));
    EXPECT_GT(deviation, 1.5);
    EXPECT_LT(deviation, 8.0);
    // TextureBlobs move iodine within a territory and a little beyond its border, and make none.
    for (const TissueLayer& layer : layers) {
        if (!layer.name.starts_with("brain, ")) continue;
        double sum = 0, all = 0, beyond = 0;
        const Inside own(layer.mesh);
        for (std::size_t i = 0; i < layer.texture_blobs.size(); ++i) {
            sum += render::content(layer.texture_blobs[i]);
            all += std::abs(render::content(layer.texture_blobs[i]));
            if (i % 10 == 0) beyond += 10 * !own(layer.texture_blobs[i].middle.cast<double>());
        }
        EXPECT_GT(all, 0.05 * geometry::signed_volume(layer.mesh)) << layer.name;
        EXPECT_LT(std::abs(sum), 1e-3 * all) << layer.name;
        EXPECT_GT(beyond, 0.02 * static_cast<double>(layer.texture_blobs.size())) << layer.name;
        EXPECT_LT(beyond, 0.4 * static_cast<double>(layer.texture_blobs.size())) << layer.name;
    }
}

TEST(Patient, HasABrainOfTerritoriesThatShareNoSpace) {
    const auto& layers = body_of(590, 670);
    const TriangleMesh& brain = *mesh_of(layers, "brain");
    std::vector<Inside> parts;
    std::vector<double> volumes;
    double sum = 0;
    for (const char* part :
         {"left ACA", "right ACA", "left MCA", "right MCA", "left PCA", "right PCA", "cerebellum and stem"}) {
        const TriangleMesh* mesh = mesh_of(layers, std::string("brain, ") + part);
        ASSERT_TRUE(mesh) << part;
        parts.emplace_back(*mesh);
        volumes.push_back(geometry::signed_volume(*mesh));
        sum += volumes.back();
    }
    const double volume = geometry::signed_volume(brain);
    EXPECT_NEAR(sum, volume, 0.011 * volume);
    // Fractions of the hemispheres vary widely (van der Zwan 1993); the middle artery's is the largest.
    const double above = sum - volumes[6];
    for (const int side : {0, 1}) {
        EXPECT_NEAR(volumes[0 + side] / above, 0.12, 0.05);
        EXPECT_NEAR(volumes[2 + side] / above, 0.26, 0.06);
        EXPECT_NEAR(volumes[4 + side] / above, 0.12, 0.05);
    }
    EXPECT_NEAR(volumes[6] / sum, 0.12, 0.04);
    const Inside whole(brain);
    int held = 0, once = 0;
    for (int k = 0; k < 3000; ++k) {
        const Vec3 p =
            brain.vertices[(static_cast<std::size_t>(k) * 7919) % brain.vertices.size()] * 0.5 +
            brain.vertices[(static_cast<std::size_t>(k) * 104729 + 11) % brain.vertices.size()] * 0.5;
        if (!whole(p)) continue;
        ++held;
        int holders = 0;
        for (const Inside& part : parts) holders += part(p);
        once += holders == 1;
    }
    EXPECT_GT(held, 2000);
    EXPECT_GT(once, 0.97 * held);  // a grid of 5 mm along the borders
}

TEST(Patient, HasLungsThatShareNoSpaceWithBonesHeartDiaphragmOrAirway) {
    const auto& layers = body_of(100, 330);
    for (const char* lung : {"left lung", "right lung"}) {
        const TriangleMesh& mesh = *mesh_of(layers, lung);
        for (const char* other : {"bones", "heart", "diaphragm", "airway", "abdominal fat", "bowel gas"}) {
            EXPECT_EQ(fraction_inside(*mesh_of(layers, other), mesh), 0.0) << other << " in the " << lung;
            EXPECT_EQ(fraction_inside(mesh, *mesh_of(layers, other)), 0.0)
                << "the " << lung << " in " << other;
        }
    }
    // They make room for a vessel where there was lung.
    const Vec3 place(70, 0, 320);
    ASSERT_TRUE(Inside(*mesh_of(layers, "left lung"))(place));
    PatientSpec spec = around(100, 330);
    spec.vessels = {{place, 12.0}};
    const auto made = render::make_patient(spec);
    for (double x : {-11.0, 0.0, 11.0})
        EXPECT_FALSE(Inside(*mesh_of(made, "left lung"))(place + Vec3(x, 0, 0))) << x;
}

TEST(Patient, HasTwelvePairsOfRibsThatRunToTheFront) {
    render::Bones cage;
    const std::vector<render::VesselSample> none;
    const render::Chest chest{-130.0, none};
    render::add_cage(cage, chest, render::Chance(0), false);
    const Inside bone(cage.outer);
    // At the side each rib is crossed once by a line down the flank.
    for (double side : {-1.0, 1.0}) {
        std::set<int> levels;
        for (double z = 60.0; z < 470.0; z += 1.0) {
            const auto section = chest.section(z);
            for (double outward = 2.0; outward < 17.0; outward += 1.0) {
                const Vec3 p = section.point(0.7, z, outward).cwiseProduct(Vec3(side, 1, 1));
                if (bone(p)) levels.insert(static_cast<int>(z));
            }
        }
        int ribs = 0;
        for (const int level : levels) ribs += !levels.contains(level - 1);
        EXPECT_EQ(ribs, 12) << side;
    }
}

TEST(Patient, HasBonesThatCountOnce) {
    // Pieces of a bone are joined, and bones keep clear of each other in their joints.
    for (const auto& [low, high] : {std::pair{-190.0, 130.0}, {200.0, 380.0}, {560.0, 700.0}}) {
        const auto& layers = body_of(low, high);
        EXPECT_NO_THROW(render::require_simple("bones", *mesh_of(layers, "bones")));
    }
}

TEST(Patient, HasHipJointsOfPublishedSize) {
    const auto& layers = body_of(-190, 0);
    const Inside bone(*mesh_of(layers, "bones")), marrow(*mesh_of(layers, "marrow"));
    for (const double side : {1.0, -1.0}) {
        const Vec3 joint(89.0 * side, 10.0, -152.0);
        for (const Vec3& way : {Vec3(0, 0, 1), Vec3(-0.5 * side, 0, 0.87), Vec3(0, 0.5, 0.87)}) {
            // The head, 48 mm in diameter, the cartilage, the roof of the cup.
            const double head = first_change(bone, joint, way.normalized(), 5.0, 60.0);
            EXPECT_NEAR(head, 24.0, 0.4);
            EXPECT_NEAR(first_change(bone, joint, way.normalized(), head + 0.2, 60.0) - head, 3.5, 0.8);
        }
    }
    // Shaft of the femur: some 29 mm wide, walls of 5 to 8 mm.
    const Vec3 level(0, 10, -330);
    const double from = first_change(bone, level, Vec3(1, 0, 0), 60.0, 200.0),
                 to = first_change(bone, level, Vec3(1, 0, 0), from + 1.0, 200.0),
                 inner = first_change(marrow, level, Vec3(1, 0, 0), from, 200.0);
    EXPECT_NEAR(to - from, 29.0, 2.0);
    EXPECT_GT(inner - from, 5.0);
    EXPECT_LT(inner - from, 8.5);
}

TEST(Patient, HasVertebraeOfPublishedSize) {
    const auto& layers = body_of(-60, 60);
    const Inside bone(*mesh_of(layers, "bones")), marrow(*mesh_of(layers, "marrow"));
    for (const char* name : {"L3", "L2"}) {
        const render::Vertebra& level =
            *std::ranges::find(render::vertebrae(), name, &render::Vertebra::name);
        const Vec3 middle(0.0, level.front + level.half_depth, level.z);
        const double up = first_change(bone, middle, Vec3::UnitZ(), 0.0, 40.0),
                     down = first_change(bone, middle, -Vec3::UnitZ(), 0.0, 40.0);
        // Concave plates: by 1 to 4 mm each.
        EXPECT_LT(up + down, 2.0 * level.half_height - 2.0) << name;
        EXPECT_GT(up + down, 2.0 * level.half_height - 8.0) << name;
        // End plates 0.6 mm thick, most of it in plaques beside the mesh.
        const double plate = up - first_change(marrow, middle, Vec3::UnitZ(), 0.0, 40.0);
        EXPECT_GT(plate, 0.02) << name;
        EXPECT_LT(plate, 0.6) << name;
        const double side = first_change(bone, middle, Vec3::UnitX(), 0.0, 60.0);
        EXPECT_NEAR(side, 0.89 * level.half_width, 2.0) << name;
    }
}

TEST(Patient, OfASeedIsAlwaysTheSameAndOfTheNextAnother) {
    PatientSpec spec = around(-20, 20);
    const auto bones_of = [&](std::uint64_t seed) {
        spec.seed = seed;
        const auto layers = render::make_patient(spec);
        return *mesh_of(layers, "bones");
    };
    const TriangleMesh first = bones_of(7), again = bones_of(7), next = bones_of(8), mean = bones_of(0);
    EXPECT_EQ(first.vertices, again.vertices);
    EXPECT_EQ(first.triangles, again.triangles);
    EXPECT_NE(first.vertices, next.vertices);
    EXPECT_NE(first.vertices, mean.vertices);
}

TEST(Patient, HasItsSpineBehindTheAortaAndItsSkinAroundTheVessels) {
    std::vector<Vec3> points;
    for (int i = 0; i <= 32; ++i) {
        for (int k = 0; k < 12; ++k) {
            const double angle = std::numbers::pi * k / 6.0;
            points.emplace_back(12.0 + 10.0 * std::cos(angle), -5.0 + 10.0 * std::sin(angle), 4.0 * i);
        }
    }
    points.emplace_back(70, -60, -150);
    const auto spec = render::patient_around(points, {Landmark::AorticBifurcation, Vec3(12, -15, 0)});
    EXPECT_NEAR(spec.origin.x(), 12.0, 1e-9);
    EXPECT_GT(spec.origin.y(), 5.0);  // the wall of the aorta
    EXPECT_LT(spec.origin.y(), 15.0);
    const auto layers = render::make_patient(spec);
    const auto& skin = layers.front().mesh;
    Vec3 low = skin.vertices.front(), high = low;
    for (const Vec3& v : skin.vertices) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
    }
    for (const Vec3& p : points) {
        EXPECT_TRUE((p.array() > low.array()).all() && (p.array() < high.array()).all());
    }
}

TEST(Patient, BalancesAtEveryPixelAllAroundIt) {
    for (const auto& [low, high, middle] :
         {std::array{-60.0, 60.0, 0.0}, {200.0, 380.0, 320.0}, {560.0, 700.0, 620.0}}) {
        const auto& layers = body_of(low, high);
        render::PathLengthRenderer renderer;
        for (const TissueLayer& layer : layers) renderer.add(layer.mesh);
        for (double lao : {-90.0, 25.0, 90.0}) {
            for (double cranial : {-30.0, 30.0}) {
                CArm arm{.lao = lao * std::numbers::pi / 180.0,
                         .cranial = cranial * std::numbers::pi / 180.0,
                         .isocentre = Vec3(0, 0, middle),
                         .detector_width = 400.0,
                         .pixels = 128};
                for (std::size_t i = 0; i < layers.size(); ++i) {
                    EXPECT_EQ(renderer.render(static_cast<int>(i), arm).unbalanced_pixels, 0)
                        << layers[i].name << " at LAO " << lao << ", cranial " << cranial;
                }
            }
        }
    }
}

}  // namespace
