/// Vessels that nobody thought of: random cuts, diseases, segmentations, and the arteries beyond their ends.
/// SELDINGER_FUZZ_SEEDS=N tries N seeds of each in place of a few.

#include <cstdlib>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <limits>

#include "engine/anatomy/anatomy_check.h"
#include "engine/anatomy/grow/generator.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/import/lumen_import.h"
#include "engine/anatomy/import/mesh_cut.h"
#include "engine/exercise/distal_trees.h"
#include "engine/exercise/imaging.h"
#include "engine/io/error.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/geometry/polyline.h"
#include "physics/geometry/random.h"
#include "tests/engine/anatomy/segmented.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/anatomy/tubes.h"

namespace {

using geometry::Random;
using geometry::TriangleMesh;
using geometry::Vec3;

int seeds_or(int few) {
    const char* more = std::getenv("SELDINGER_FUZZ_SEEDS");
    return more ? std::max(1, std::atoi(more)) : few;
}

int one_of(Random& random, int count) {
    return std::min(count - 1, static_cast<int>(random() * count));
}

Vec3 any_direction(Random& random) {
    for (;;) {
        const double x = random.between(-1, 1), y = random.between(-1, 1), z = random.between(-1, 1);
        const Vec3 p(x, y, z);
        if (p.norm() > 0.1 && p.norm() < 1) return p.normalized();
    }
}

/// Coarse, so that many vessels can be grown.
anatomy::GeneratorOptions coarse() {
    anatomy::GeneratorOptions options;
    options.most_cells_per_radius = options.fewest_cells_per_radius = 2;
    return options;
}

std::string defects_of(const anatomy::Anatomy& vessels) {
    std::string text;
    for (const std::string& problem : anatomy::problems(vessels)) text += problem + "\n";
    if (!text.empty()) return text;
    for (const anatomy::Check& check : anatomy::anatomy_checks(vessels))
        if (check.verdict == anatomy::Check::Verdict::Fail) text += anatomy::text_of(check) + "\n";
    for (const anatomy::CalciumDeposit& deposit : vessels.calcium) {
        for (const Vec3& p : deposit.points)
            if (!p.allFinite()) text += "calcium at a place that is not finite\n";
        for (const double radius : deposit.radii)
            if (!(std::isfinite(radius) && radius > 0)) text += "calcium without a radius\n";
    }
    return text;
}

/// A disease at a random place, a few of them beyond the branch or the accepted ranges.
void add_disease(anatomy::VesselTreeSpec& spec, const anatomy::VesselTree& healthy, Random& random) {
    const anatomy::SampledBranch& branch = healthy.branches[one_of(random, std::ssize(healthy.branches))];
    const double length = geometry::length_of(branch.points), at = random.between(-0.05, 1.05) * length;
    const double width = 2 * branch.radii[branch.radii.size() / 2];
    const double angle = random.between(-4, 4), size = random.between(0.3, 3),
                 part = random.between(0.02, 0.7);
    switch (one_of(random, 6)) {
        case 0:
            spec.stenoses.push_back({branch.name, at, part * length, random.between(-5, 95),
                                     random.between(-0.05, 1.05), angle, random() < 0.5});
            break;
        case 1:
            spec.aneurysms.push_back(
                {branch.name, at, size * width, random.between(0.2, 1.1) * size * width, angle});
            break;
        case 2:
            spec.fusiform.push_back({branch.name, at, part * length, size * width});
            break;
        case 3:
            spec.occlusions.push_back({branch.name, at});
            break;
        case 4:
            spec.dissections.push_back(
                {branch.name, at, part * length, random.between(0.15, 0.85), random.between(0.3, 4), angle});
            break;
        default:
            spec.tortuosities.push_back({branch.name, random.between(0, 4), random.between(5, 60)});
    }
}

}  // namespace

TEST(RandomVessels, ACutLeavesOneMoreOpeningOrTheMeshAsItWas) {
    std::vector<TriangleMesh> meshes = {
        test::tube(2, 20), test::small_anatomy().lumen, anatomy::generate(test::small_loop()).lumen,
        anatomy::repaired(test::segmented(test::random_tree(7, 12, 0.2), 0.6, 1)).mesh};
    for (int k = 0; k < 3; ++k)
        meshes.push_back(geometry::capped(meshes[k], geometry::topology(meshes[k]).loops));
    const int seeds = seeds_or(40);
    int made = 0, refused = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
        Random random(static_cast<std::uint64_t>(seed));
        const TriangleMesh& mesh = meshes[one_of(random, std::ssize(meshes))];
        ASSERT_EQ(geometry::topology(mesh).non_manifold_edges, 0);
        anatomy::MeshCut cut(mesh);
        TriangleMesh before = cut.result();
        for (int k = 0; k < 8; ++k) {
            const geometry::Topology had = geometry::topology(before);
            if (before.triangles.empty()) break;
            const Vec3& corner = before.vertices[one_of(random, std::ssize(before.vertices))];
            const Vec3 outward = any_direction(random);
            const double deep = random.between(0, 4), reach = random.between(1, 30);
            const Vec3 centre = random() < 0.1 ? corner : Vec3(corner - deep * outward);
            const bool done = cut.beyond(centre, outward, corner, reach, random.between(0.5, 10));
            const TriangleMesh after = cut.result();
            const std::string where = fmt::format("seed {}, cut {}", seed, k);
            if (!done) {
                ++refused;
                ASSERT_EQ(after.vertices, before.vertices) << where;
                ASSERT_EQ(after.triangles, before.triangles) << where;
                continue;
            }
            ++made;
            const geometry::Topology has = geometry::topology(after);
            ASSERT_EQ(has.non_manifold_edges, 0) << where;
            ASSERT_EQ(has.loops.size(), had.loops.size() + 1) << where;
            for (const Vec3& p : after.vertices) ASSERT_TRUE(p.allFinite()) << where;
            before = after;
        }
    }
    RecordProperty("made", made);
    RecordProperty("refused", refused);
    EXPECT_GT(made, seeds / 4);
    EXPECT_GT(refused, seeds / 4);
}

TEST(RandomVessels, DiseasesAreRefusedWithAReasonOrGiveSoundVessels) {
    const int seeds = seeds_or(8);
    const auto presets = anatomy::vessel_presets();
    int sound = 0, refused = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
        Random random(static_cast<std::uint64_t>(seed));
        const std::string_view preset = presets[static_cast<std::size_t>(seed) % presets.size()].name;
        anatomy::VesselTreeSpec spec =
            anatomy::vessel_preset(preset, static_cast<std::uint64_t>(one_of(random, 50)));
        const anatomy::VesselTree healthy = anatomy::grow(spec);
        const int count = 1 + one_of(random, 3);
        for (int k = 0; k < count; ++k) add_disease(spec, healthy, random);
        const std::string where = fmt::format("seed {}, {}", seed, preset);
        try {
            const anatomy::Anatomy vessels = anatomy::generate(spec, coarse());
            ++sound;
            EXPECT_EQ(defects_of(vessels), "") << where;
        } catch (const io::InputError& error) {
            ++refused;
            // Says what was found or is accepted.
            const std::string text = error.what();
            EXPECT_GT(text.size(), 30u) << where;
            EXPECT_EQ(text.find("nan"), std::string::npos) << where << ": " << text;
            if (std::getenv("SELDINGER_FUZZ_SEEDS")) fmt::print("{}: {}\n", where, text);
        }
    }
    RecordProperty("sound", sound);
    RecordProperty("refused", refused);
    EXPECT_GT(sound, 0);
    EXPECT_GT(refused, 0);
}

namespace {

/// Expects pieces for every artery that leaves the vessels, near its end and no wider than it.
void expect_distal_trees(const anatomy::Anatomy& vessels, const std::string& where) {
    const blood::ContrastFlow contrast(vessels);
    const auto layers = exercise::tissue_layers(scenario::Scenario{}, vessels);
    const auto pieces = exercise::distal_trees(vessels, contrast.blood(), layers);
    const std::uint32_t nodes = exercise::distal_nodes(contrast.blood());
    ASSERT_EQ(exercise::distal_iodine(contrast).size(), nodes) << where;
    const auto& outlets = contrast.blood().outlets;
    constexpr std::uint32_t bins = blood::DistalArteries::bins;
    // Between the end and its organ, or in the tissue ahead.
    std::vector<Eigen::AlignedBox3d> reach;
    for (const blood::Outlet& outlet : outlets) {
        reach.emplace_back(outlet.place);
        for (const render::TissueLayer& layer : layers)
            if (layer.name.ends_with(outlet.organ))
                for (const Vec3& v : layer.mesh.vertices) reach.back().extend(v);
        const Vec3 margin = Vec3::Constant(60 * outlet.radius);
        reach.back() = {Vec3(reach.back().min() - margin), Vec3(reach.back().max() + margin)};
    }
    std::vector<std::size_t> own(outlets.size(), 0);
    for (const render::VesselPiece& piece : pieces) {
        ASSERT_TRUE(piece.from.allFinite() && piece.to.allFinite()) << where;
        ASSERT_TRUE(std::isfinite(piece.radius) && piece.radius > 0) << where;
        ASSERT_TRUE(piece.fill >= 0 && piece.fill <= 1) << where;
        ASSERT_LT(piece.node, nodes) << where;
        const std::size_t k = piece.node / bins;
        if (k >= outlets.size()) continue;  // of a source
        ++own[k];
        ASSERT_LE(piece.radius, outlets[k].radius * (1 + 1e-6)) << where << ": " << outlets[k].end;
        ASSERT_TRUE(reach[k].contains(piece.to.cast<double>())) << where << ": " << outlets[k].end;
    }
    for (std::size_t k = 0; k < outlets.size(); ++k) {
        if (!(outlets[k].arterial > 0)) continue;
        EXPECT_GT(own[k], 0u) << where << ": " << outlets[k].end;
    }
}

}  // namespace

TEST(RandomVessels, EveryEndOfEveryPresetGoesOn) {
    const int seeds = std::min(60, seeds_or(1));
    for (const anatomy::VesselPreset& preset : anatomy::vessel_presets()) {
        for (int seed = 0; seed < seeds; ++seed) {
            const auto number = static_cast<std::uint64_t>(seed == 0 ? 0 : 100 + seed);
            expect_distal_trees(anatomy::generate(anatomy::vessel_preset(preset.name, number), coarse()),
                                fmt::format("{}, seed {}", preset.name, number));
        }
    }
}

TEST(RandomVessels, SegmentedTreesAreRefusedWithAReasonOrImported) {
    const int seeds = std::min(400, seeds_or(2));
    int sound = 0, refused = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
        Random random(static_cast<std::uint64_t>(seed));
        const int tips = 1 + one_of(random, 30), rounds = one_of(random, 6);
        const double voxel = random.between(0.35, 1.1);
        const std::uint32_t tree = 1000 + static_cast<std::uint32_t>(seed);
        const std::string where =
            fmt::format("seed {}: tree {}, {} tips, voxels of {:.2f} mm, smoothed {} times", seed, tree, tips,
                        voxel, rounds);
        const TriangleMesh mesh = test::segmented(test::random_tree(tree, tips, 0.3 * voxel), voxel, rounds);
        anatomy::ImportOptions options;
        options.unit = "mm";
        try {
            const anatomy::Anatomy vessels = anatomy::import_lumen(mesh, "segmented", options).anatomy;
            ++sound;
            EXPECT_EQ(defects_of(vessels), "") << where;
            EXPECT_GE(vessels.ends.size(), 2u) << where;
            expect_distal_trees(vessels, where);
        } catch (const io::InputError& error) {
            ++refused;
            EXPECT_NE(std::string(error.what()).find("accepted"), std::string::npos)
                << where << ": " << error.what();
            if (std::getenv("SELDINGER_FUZZ_SEEDS")) fmt::print("{}: {}\n", where, error.what());
        }
    }
    RecordProperty("sound", sound);
    RecordProperty("refused", refused);
    EXPECT_GT(sound, seeds / 2);
}
