#include "engine/anatomy/grow/disease.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <limits>

#include "engine/anatomy/anatomy_check.h"
#include "engine/anatomy/anatomy_writer.h"
#include "engine/anatomy/grow/generator.h"
#include "engine/exercise/imaging.h"
#include "physics/geometry/mesh_query.h"
#include "physics/geometry/mesh_topology.h"
#include "render/xray/fluoroscope.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using geometry::Vec3;

/// A straight vessel of radius 6 along +z, 160 mm long, with a branch at 20 mm and one at 140 mm.
VesselTreeSpec trunk() {
    VesselTreeSpec spec;
    spec.name = "trunk";
    spec.branches = {{"trunk", "", 0, {{{0, 0, 0}, 6}, {{0, 0, 80}, 6}, {{0, 0, 160}, 6}}, false},
                     {"low", "trunk", 20, {{{0, 0, 0}, 2}, {{20, 0, 4}, 2}, {{30, 0, 8}, 2}}, false},
                     {"high", "trunk", 140, {{{0, 0, 0}, 2}, {{-20, 0, 4}, 2}, {{-30, 0, 8}, 2}}, false},
                     {"twig", "high", 20, {{{0, 0, 0}, 1}, {{0, 8, 2}, 1}, {{0, 14, 4}, 1}}, false}};
    spec.targets = {{"low", "low", 20}, {"high", "high", 20}, {"twig", "twig", 10}};
    return spec;
}

}  // namespace

TEST(Disease, AnEccentricPlaqueLeavesTheWallOpposite) {
    VesselTreeSpec spec = trunk();
    spec.stenoses = {{"trunk", 80, 30, 60, 1, 0, false}};
    const SampledBranch branch = grow(spec).branches[0];
    const int middle = branch.sample_at(80);
    EXPECT_NEAR(branch.radii[middle], 2.4, 0.01);
    const double moved = branch.points[middle].head<2>().norm();
    EXPECT_NEAR(moved, 3.6, 0.01);  // the centre, away from the plaque: 3.6 + 2.4 reaches the wall
    spec.stenoses[0].eccentricity = 0;
    const SampledBranch concentric = grow(spec).branches[0];
    EXPECT_NEAR(concentric.points[middle].head<2>().norm(), 0, 1e-9);
    EXPECT_NEAR(concentric.radii[middle], 2.4, 0.01);
}

TEST(Disease, CalciumLiesInTheWallAndDarkensTheImage) {
    VesselTreeSpec spec = trunk();
    spec.stenoses = {{"trunk", 80, 30, 60, 1, 0, true}};
    const test::TemporaryFolder folder;
    const Anatomy sick = load_anatomy(write_anatomy(generate(spec), folder.path(), {}));
    ASSERT_GE(sick.calcium.size(), 3u);
    const geometry::MeshQuery wall(closed_lumen(sick));
    for (const CalciumDeposit& deposit : sick.calcium) {
        for (std::size_t i = 0; i < deposit.points.size(); ++i) {
            EXPECT_FALSE(wall.encloses(deposit.points[i]));
            EXPECT_GT(wall.distance(deposit.points[i]), 0.9 * deposit.radii[i]);
        }
    }
    // The quanta that each pixel of an image within a patient expects, with the calcium and without.
    scenario::Scenario scenario;
    scenario.imaging.patient = true;
    Anatomy bare = sick;
    bare.calcium.clear();
    render::CArm arm{.isocentre = {0, 0, 80}, .detector_width = 120, .pixels = 256};
    const auto quanta = [&](const Anatomy& anatomy) {
        return render::Fluoroscope({}, exercise::tissue_layers(scenario, anatomy))
            .expected_quanta(arm, {}, {});
    };
    const render::Field with = quanta(sick), without = quanta(bare);
    std::vector<geometry::Polyline> shadows;  // of the deposits, on the image [pixels]
    for (const CalciumDeposit& deposit : sick.calcium) {
        shadows.emplace_back();
        for (const Vec3& p : deposit.points) {
            const render::Pixel at = render::project(arm, p);
            shadows.back().emplace_back(at.x, at.y, 0);
        }
    }
    std::vector<double> beside;
    std::vector<double> darkest(shadows.size(), 1);
    for (int j = 0; j < arm.pixels; ++j) {
        for (int i = 0; i < arm.pixels; ++i) {
            const std::size_t pixel = static_cast<std::size_t>(j) * arm.pixels + i;
            const double fraction = with.values[pixel] / without.values[pixel];
            double nearest = std::numeric_limits<double>::infinity();
            for (std::size_t k = 0; k < shadows.size(); ++k) {
                for (const Vec3& p : shadows[k]) {
                    const double distance = (p - Vec3(i + 0.5, j + 0.5, 0)).norm();
                    nearest = std::min(nearest, distance);
                    if (distance < 3) darkest[k] = std::min(darkest[k], fraction);
                }
            }
            if (nearest > 30) beside.push_back(fraction);
        }
    }
    // The automatic exposure answers the calcium by a little more voltage: the whole image is brighter, most
    // of all where the body is thickest.
    const auto [least, most] = std::minmax_element(beside.begin(), beside.end());
    // And a focal spot spreads the border of each deposit.
    EXPECT_NEAR(*least, 1, 0.02);
    EXPECT_NEAR(*most, 1, 0.03);
    for (std::size_t k = 0; k < darkest.size(); ++k) EXPECT_LT(darkest[k], 0.96 * *least) << "deposit " << k;
}

TEST(Disease, AFusiformAneurysmWidensTheVessel) {
    VesselTreeSpec spec = trunk();
    spec.fusiform = {{"trunk", 80, 60, 24}};
    const SampledBranch branch = grow(spec).branches[0];
    EXPECT_NEAR(branch.radii[branch.sample_at(80)], 12, 0.01);
    EXPECT_NEAR(branch.radii[branch.sample_at(45)], 6, 0.01);
    EXPECT_TRUE(problems(generate(spec)).empty());
}

TEST(Disease, AnOcclusionEndsTheBranchAndWhatLiesBeyond) {
    VesselTreeSpec spec = trunk();
    spec.occlusions = {{"trunk", 100}};
    const Anatomy anatomy = generate(spec);
    ASSERT_EQ(anatomy.branches.size(), 2u);
    EXPECT_EQ(anatomy.branches[1].name, "low");
    EXPECT_EQ(anatomy.ends.size(), 2u);  // the inlet and the low branch's
    ASSERT_EQ(anatomy.targets.size(), 1u);
    EXPECT_EQ(anatomy.targets[0].name, "low");
    EXPECT_NEAR(anatomy.branches[0].points.back().z(), 100, 1);
}

TEST(Disease, ADissectionHasTwoLuminaBetweenItsTears) {
    VesselTreeSpec spec = trunk();
    spec.dissections = {{"trunk", 35, 90, 0.4, 2.5, 0}};
    const VesselTree tree = grow(spec);
    EXPECT_EQ(tree.loops(), 1);
    const Anatomy anatomy = generate(spec);
    EXPECT_TRUE(problems(anatomy).empty());
    ASSERT_EQ(anatomy.branches.size(), 5u);
    const auto& false_lumen = anatomy.branches.back();
    EXPECT_EQ(false_lumen.name, "trunk false lumen");
    EXPECT_EQ(anatomy.ends.size(), 5u);
    EXPECT_EQ(euler_characteristic(closed_lumen(anatomy)), 0);
    const SampledBranch& trunk_branch = tree.branches[0];
    const int middle = trunk_branch.sample_at(80);
    EXPECT_NEAR(trunk_branch.radii[middle], 0.4 * (6 - 1.25), 0.05);
    EXPECT_NEAR(false_lumen.radii[false_lumen.radii.size() / 2], 0.6 * (6 - 1.25), 0.2);
    // A wire's width of tissue lies between them: halfway, a point of the flap.
    const Vec3 one = trunk_branch.points[middle], other = false_lumen.points[false_lumen.points.size() / 2];
    const Vec3 way = (other - one).normalized();
    EXPECT_FALSE(
        geometry::MeshQuery(closed_lumen(anatomy)).encloses(one + (trunk_branch.radii[middle] + 1) * way));
}

TEST(Disease, WhatCannotBeIsRefusedWithItsPlace) {
    VesselTreeSpec spec = trunk();
    spec.dissections = {{"trunk", 10, 100, 0.4, 2.5, 0}};
    test::expect_refusal([&] { grow(spec); }, "branch 'low' leaves 'trunk' at 20.0 mm, where the dissection");
    spec.dissections = {{"trunk", 40, 30, 0.4, 2.5, 0}};
    test::expect_refusal([&] { grow(spec); }, "expected 45 mm or more");
    spec.dissections = {{"trunk", 40, 300, 0.4, 2.5, 0}};
    test::expect_refusal([&] { grow(spec); }, "the end of the dissection");
    spec = trunk();
    spec.occlusions = {{"trunc", 40}};
    test::expect_refusal([&] { grow(spec); }, "an occlusion names the branch 'trunc'");
    spec.occlusions = {{"trunk", 400}};
    test::expect_refusal([&] { grow(spec); }, "the occlusion is 400 mm along 'trunk'");
    spec = trunk();
    spec.fusiform = {{"trunk", 80, 60, 90}};
    test::expect_refusal([&] { grow(spec); }, "a diameter of 1 to 60 mm");
    spec = trunk();
    spec.stenoses = {{"trunk", 80, 30, 60, 2, 0, false}};
    test::expect_refusal([&] { grow(spec); }, "eccentricity");
}

}  // namespace anatomy
