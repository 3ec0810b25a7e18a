#include "engine/anatomy/grow/generator.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/anatomy/anatomy_check.h"
#include "engine/anatomy/anatomy_writer.h"
#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/surface_nets.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/lumen_wall.h"
#include "engine/anatomy/vessel_paths.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/geometry/polyline.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/distance_field.h"
#include "physics/wire/chain.h"
#include "tests/cases.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/fixtures.h"
#include "tests/physics/wires.h"

namespace anatomy {
namespace {

using geometry::Vec3;
using test::small_anatomy, test::small_tree;

bool same(const geometry::TriangleMesh& a, const geometry::TriangleMesh& b) {
    return a.vertices == b.vertices && a.triangles == b.triangles;
}

/// Asserts that the gradient at so many places of the wall around a place is that of the distance, and
/// counts those that the smooth minimum of two branches blends.
int blended_with_the_gradient(const ImplicitLumen& lumen, const Vec3& around, double radius, int places) {
    int blended = 0;
    for (int k = 0; k < places; ++k) {
        const Vec3 x = lumen.projected(
            around + radius * Vec3(std::sin(3.1 * k), std::cos(1.7 * k), std::sin(0.9 * k + 1)));
        const auto value = lumen.at(x);
        if (std::abs(value.distance) > 1e-6) continue;
        Vec3 difference;
        const double h = 1e-5;
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3 step = h * Vec3::Unit(axis);
            difference[axis] = (lumen.at(x + step).distance - lumen.at(x - step).distance) / (2 * h);
        }
        EXPECT_LT((difference - value.gradient).norm(), 1e-4) << x.transpose();
        blended += value.gradient.norm() < 0.999;
    }
    return blended;
}

/// The lumen is sound, its triangles are near equilateral and lie on the wall.
void expect_figures(const geometry::TriangleMesh& lumen, const ImplicitLumen& exact) {
    EXPECT_EQ(geometry::topology(lumen).non_manifold_edges, 0);
    EXPECT_EQ(self_intersections(lumen), 0);
    EXPECT_GE(smallest_angles(lumen).percentile, 30 * std::numbers::pi / 180);
    std::vector<double> errors;
    for (const auto& t : lumen.triangles) {
        const Vec3 centroid = (lumen.vertices[t[0]] + lumen.vertices[t[1]] + lumen.vertices[t[2]]) / 3;
        errors.push_back(std::abs(exact.at(centroid).distance));
    }
    std::sort(errors.begin(), errors.end());
    EXPECT_LE(errors[errors.size() * 99 / 100], 0.05);
    EXPECT_LE(errors.back(), 0.35);
}

}  // namespace

TEST(ImplicitLumen, OfAStraightVesselIsTheDistanceToATube) {
    VesselTreeSpec spec = small_tree();
    spec.branches.pop_back();
    spec.targets.clear();
    spec.branches[0].knots[2].radius = 2;
    const ImplicitLumen lumen(grow(spec), 0.5);
    for (const double r : {1.2, 1.6, 2.0, 2.9}) {
        const auto value = lumen.at({14.3, r * 0.6, r * 0.8});
        EXPECT_NEAR(value.distance, r - 2, 1e-9);
        EXPECT_LT((value.gradient - Vec3(0, 0.6, 0.8)).norm(), 1e-6);
    }
}

TEST(ImplicitLumen, HasTheGradientOfItsValue) {
    const VesselTree tree = grow(small_tree());
    const ImplicitLumen lumen(tree, 0.4);
    const Vec3 junction = tree.branches[1].points[tree.branches[1].exit];
    EXPECT_GT(blended_with_the_gradient(lumen, junction, 2.5, 60), 3);
}

TEST(ImplicitLumen, IsTheSameWhicheverBlocksItKnows) {
    // A cell of 0.1 mm leaves most of these places without a block: there every sample of every branch is
    // asked.
    const VesselTree tree = grow(small_tree());
    const ImplicitLumen coarse(tree, 0.4), fine(tree, 0.1);
    int asked = 0;
    for (const SampledBranch& branch : tree.branches) {
        for (std::size_t i = 0; i < branch.points.size(); i += 3) {
            for (int k = 0; k < 8; ++k) {
                const Vec3 away(std::sin(3.1 * k + 1), std::cos(1.7 * k), std::sin(0.9 * k + 1));
                const Vec3 x = branch.points[i] + (branch.radii[i] - 0.9) * away.normalized();
                const auto a = coarse.at(x), b = fine.at(x);
                EXPECT_EQ(a.distance, b.distance) << x.transpose();
                EXPECT_EQ(a.gradient, b.gradient) << x.transpose();
                ++asked;
            }
        }
    }
    EXPECT_GT(asked, 100);
}

TEST(SurfaceNets, OfTheSmallTreeAreClosedAndWithoutHandles) {
    const ImplicitLumen lumen(grow(small_tree()), 0.4);
    const geometry::TriangleMesh mesh = surface_nets(lumen, 1);
    const geometry::Topology found = geometry::topology(mesh);
    EXPECT_EQ(found.boundary_edges, 0);
    EXPECT_EQ(found.non_manifold_edges, 0);
    EXPECT_EQ(euler_characteristic(mesh), 2);
    EXPECT_GT(geometry::signed_volume(mesh), 0);
    for (const Vec3& v : mesh.vertices) EXPECT_LT(std::abs(lumen.at(v).distance), 1e-5);
    EXPECT_TRUE(same(mesh, surface_nets(lumen, 3)));
}

TEST(Generator, MeetsItsFiguresOnTheSmallTree) {
    const ClosedLumen closed = closed_surface(grow(small_tree()));
    const geometry::Topology before = geometry::topology(closed.mesh);
    EXPECT_EQ(before.boundary_edges, 0);
    EXPECT_EQ(euler_characteristic(closed.mesh), 2);

    const geometry::TriangleMesh& lumen = small_anatomy().lumen;
    EXPECT_GE(smallest_angles(lumen).least, 3 * std::numbers::pi / 180);
    expect_figures(lumen, closed.implicit);
}

TEST(Generator, MeetsItsFiguresOnTheGridOfALargeTree) {
    GeneratorOptions coarse;
    coarse.many_cells = 1;  // as if the small tree were large
    const VesselTree tree = grow(small_tree());
    EXPECT_NEAR(grid_cell(tree), 1.0 / 3, 1e-9);
    EXPECT_GT(grid_cell(tree, coarse), 0.45);  // its smallest radius is 1
    const geometry::TriangleMesh lumen = generate(small_tree(), coarse).lumen;
    expect_figures(lumen, ImplicitLumen(tree, grid_cell(tree)));
}

TEST(Generator, MakesTheGridOfALargeTreeNoFinerThanItsTriangles) {
    const VesselTree tree = grow(vessel_preset("arch-lca"));
    EXPECT_NEAR(grid_cell(tree), tree.least_radius / 2, 1e-9);
    const VesselTree alone = grow(vessel_preset("lca"));
    EXPECT_NEAR(grid_cell(alone), alone.least_radius / 3, 1e-9);
}

TEST(Generator, OpensExactlyTheEndsInTheirPlanes) {
    const Anatomy& anatomy = small_anatomy();
    ASSERT_EQ(anatomy.ends.size(), 3u);
    EXPECT_EQ(anatomy.ends[0].opening.name, "main.in");
    EXPECT_EQ(anatomy.ends[0].role, EndRole::Inlet);
    EXPECT_EQ(anatomy.ends[2].opening.name, "side.out");
    const geometry::Topology found = geometry::topology(anatomy.lumen);
    ASSERT_EQ(found.loops.size(), 3u);
    for (const geometry::BoundaryLoop& loop : found.loops) {
        const auto end =
            std::min_element(anatomy.ends.begin(), anatomy.ends.end(), [&](const auto& a, const auto& b) {
                return (a.opening.centre - loop.centroid).norm() < (b.opening.centre - loop.centroid).norm();
            });
        for (const int v : loop.vertices) {
            const Vec3 from = anatomy.lumen.vertices[v] - end->opening.centre;
            EXPECT_NEAR(from.dot(end->opening.outward_normal), 0, 1e-6);
            EXPECT_NEAR(from.norm(), end->opening.radius, 0.02);
        }
    }
    EXPECT_TRUE(problems(anatomy).empty());
}

TEST(Generator, LeavesAClosedSacClosed) {
    VesselTreeSpec spec = small_tree();
    spec.aneurysms = {{"main", 22, 5, 3, 3}};
    const Anatomy anatomy = generate(spec);
    EXPECT_EQ(anatomy.ends.size(), 3u);
    EXPECT_EQ(anatomy.branches.back().name, "main aneurysm");
    EXPECT_GT(geometry::signed_volume(closed_lumen(anatomy)),
              geometry::signed_volume(closed_lumen(small_anatomy())) + 40);
}

TEST(Generator, JoinsABranchAtBothEnds) {
    const VesselTreeSpec spec = test::small_loop();
    const VesselTree tree = grow(spec);
    const ClosedLumen closed = closed_surface(tree);
    EXPECT_EQ(euler_characteristic(closed.mesh), 0);  // a torus
    EXPECT_EQ(geometry::topology(closed.mesh).non_manifold_edges, 0);
    // Blended at the far end as at the near one: on the wall between the bypass's last samples and the main
    // vessel the smooth minimum lies below both.
    const ImplicitLumen& lumen = closed.implicit;
    const SampledBranch& bypass = tree.branches[2];
    EXPECT_GT(blended_with_the_gradient(lumen, bypass.points[bypass.entry], 2, 80), 3);

    const Anatomy anatomy = generate(spec);
    EXPECT_EQ(anatomy.ends.size(), 3u);  // none of the bypass
    EXPECT_EQ(self_intersections(anatomy.lumen), 0);
    for (const Check& check : anatomy_checks(anatomy))
        EXPECT_NE(check.verdict, Check::Verdict::Fail) << text_of(check);
    const std::optional<VesselPlace> joint = joint_of(anatomy, 2);
    ASSERT_TRUE(joint);
    EXPECT_EQ(joint->branch, 0);
    EXPECT_EQ(joint->sample, tree.branches[2].joined_sample);
    EXPECT_FALSE(joint_of(anatomy, 0));
    EXPECT_FALSE(joint_of(anatomy, 1));
}

TEST(Generator, TwoTreesMayMeet) {
    const Anatomy anatomy = generate(test::small_confluence());
    ASSERT_EQ(anatomy.ends.size(), 3u);
    EXPECT_EQ(anatomy.ends[2].opening.name, "right.in");
    EXPECT_EQ(anatomy.ends[2].role, EndRole::Inlet);
    // A wire is led from the end of the second tree into the first.
    const geometry::CentrelineTree stations(anatomy.branches, anatomy.openings());
    const int last_of_right = static_cast<int>(stations.stations().size()) - 1;
    ASSERT_EQ(stations.stations()[last_of_right].branch, 1);
    const int found = stations.locate(anatomy.targets[0].centre, last_of_right);
    EXPECT_EQ(stations.stations()[found].branch, 0);
    EXPECT_NEAR((stations.stations()[found].centre - anatomy.targets[0].centre).norm(), 0, 0.01);
}

TEST(Generator, GivesTheSameBitsAgainForAnyNumberOfThreads) {
    GeneratorOptions alone;
    alone.threads = 1;
    EXPECT_TRUE(same(small_anatomy().lumen, generate(small_tree(), alone).lumen));
}

TEST(Generator, MakesALumenThatAWireCanBePushedThrough) {
    const test::TemporaryFolder folder;
    const Anatomy anatomy = load_anatomy(write_anatomy(small_anatomy(), folder.path(), {}));
    const auto wall = cached_distance_field(anatomy, 5, 0.2);
    const EntryPath path = path_from(anatomy, *find_end(anatomy, "side.out"));
    const Vec3 inward = -anatomy.ends[2].opening.outward_normal;
    physics::Chain wire = physics::uniform_wire(20, 1, path.points[0], inward, {inward, inward, inward});
    const auto relaxer = global_relaxer(*wall);
    for (int push = 0; push < 15; ++push) {
        physics::move(wire, wire.grid.segment_length);
        EXPECT_TRUE(relaxer->relax(wire, {100'000, 0, 1}).converged()) << push;
    }
    EXPECT_TRUE(inside(anatomy, wire.joints.back()));
    EXPECT_EQ(nearest_place(anatomy, wire.joints.back()).branch, 0);  // out of the side branch
}

using AnatomyWriter = test::InFolder;

TEST_F(AnatomyWriter, WritesWhatIsReadBack) {
    const Anatomy &made = small_anatomy(),
                  read = load_anatomy(write_anatomy(made, folder / "new/folder", {{"program", "test"}}));
    EXPECT_EQ(read.name, "small");
    EXPECT_EQ(read.lumen.triangles.size(), made.lumen.triangles.size());
    EXPECT_EQ(read.lumen.vertices.size(), made.lumen.vertices.size());
    ASSERT_EQ(read.branches.size(), 2u);
    EXPECT_EQ(read.branches[1].parent, 0);
    EXPECT_EQ(read.branches[1].parent_sample, made.branches[1].parent_sample);
    for (std::size_t i = 0; i < made.branches[1].points.size(); ++i)
        EXPECT_LT((read.branches[1].points[i] - made.branches[1].points[i]).norm(), 2e-6);
    EXPECT_EQ(read.targets[0].name, "far");
    EXPECT_EQ(read.targets[0].sample, made.targets[0].sample);
    test::expect_said(test::read(folder / "new/folder/small.anatomy.json"), "\"program\":\"test\"");
}

TEST(GeneratedAnatomy, AnotherTargetNeedsNoOtherVessels) {
    const test::TemporaryFolder folder;
    int steps = 0;
    const ModelCache cache{folder / "cache", [&steps](double, const char*) { ++steps; }};
    VesselTreeSpec spec = small_tree();
    const Anatomy first = generated_anatomy(spec, cache);
    EXPECT_GT(steps, 0);
    steps = 0;
    spec.targets = {{"new", spec.branches[0].name, 5}};
    const Anatomy second = generated_anatomy(spec, cache);
    EXPECT_EQ(steps, 0);
    ASSERT_EQ(second.targets.size(), 1u);
    EXPECT_EQ(second.targets[0].name, "new");
    EXPECT_EQ(second.targets[0].centre, second.branches[0].points[second.targets[0].sample]);
    EXPECT_EQ(second.lumen.vertices, first.lumen.vertices);
}

TEST_F(AnatomyWriter, LeavesNothingWhereItCannotWrite) {
    test::write(folder / "file", "in the way");
    test::expect_refusal([&] { write_anatomy(small_anatomy(), folder / "file", {}); }, "cannot be made");
    std::filesystem::create_directory(folder / "out");
    std::filesystem::create_directory(folder / "out/small.anatomy.json");
    test::expect_refusal([&] { write_anatomy(small_anatomy(), folder / "out", {}); }, "cannot be written");
    EXPECT_FALSE(std::filesystem::exists(folder / "out/small.stl"));
}

TEST(MeshQuality, SeesATriangleThatPiercesAnother) {
    geometry::TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0.5, 0.5, -1}, {0.5, 0.5, 1}, {3, 3, 1}};
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    EXPECT_EQ(self_intersections(mesh), 1);
    mesh.vertices[4].z() = -0.5, mesh.vertices[5].z() = -0.5;
    EXPECT_EQ(self_intersections(mesh), 0);
}

/// A thousand straight tubes, along axes and beside them, of any length and place, as an author draws them.
TEST(Generator, EveryStraightTubeIsWhatItsOwnReaderAccepts) {
    const unsigned seed = 36008;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int round = 0; round < test::cases(1000); ++round) {
        Vec3 direction = Vec3::Zero();
        direction[static_cast<int>(random() % 3)] = random() % 2 ? 1 : -1;
        if (random() % 3 == 0)
            direction += 1e-3 * unit(random) * Vec3(unit(random), unit(random), unit(random));
        if (random() % 5 == 0) direction = Vec3(unit(random) - 0.5, unit(random) - 0.5, unit(random) + 0.01);
        direction.normalize();
        const double radius = 0.6 + 4 * unit(random), length = 6 * radius + 30 * unit(random);
        const double grain = random() % 2 ? 1 : 10;  // authors write whole numbers, or tenths
        const Vec3 start =
            (40 * (Vec3(unit(random), unit(random), unit(random)) - Vec3::Constant(0.5)) * grain)
                .array()
                .round() /
            grain;
        VesselTreeSpec spec;
        spec.name = "v";
        spec.branches = {{"v", "", 0, {{start, radius}, {start + length * direction, radius}}, false}};
        GeneratorOptions coarse;  // the ends are cut alike at any fineness
        coarse.many_cells = 20000;
        std::vector<std::string> wrong;
        const std::string said = test::refusal([&] { wrong = problems(generate(spec, coarse)); });
        EXPECT_TRUE(said.empty() && wrong.empty())
            << "seed " << seed << ", round " << round << ": " << said << (wrong.empty() ? "" : wrong.front());
    }
}

}  // namespace anatomy
