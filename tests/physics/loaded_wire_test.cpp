/// A wire under a load: both relaxers against beam theory, the exact elastica and each other.

#include <cmath>
#include <gtest/gtest.h>

#include "physics/relax/relaxer.h"
#include "physics/wire/energy.h"
#include "tests/physics/elastica.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

constexpr double fixed_length = 40, fixed_rigidity = 50, fixed_weight = 1e-5;  // [mm], [N·mm²], [N/mm]

/// A horizontal wire under a load downwards, clamped at its base and far from any wall, at rest.
Chain hanging(RelaxerKind kind, int segments, double weight, EndCells ends) {
    Chain wire = uniform_wire(fixed_rigidity, fixed_length / segments, {0, 0, 0}, {1, 0, 0},
                              std::vector<Vec3>(segments, Vec3::UnitX()), ends);
    wire.load = Vec3(0, 0, -weight);
    const TubeWall wall({{-50, 0, 0}, {60, 0, 0}}, 60.0, 40);
    RelaxerConfig config = of_kind(kind);
    config.varied_segments = 1;
    config.tolerance = 1e-11;  // C times 1e-8 turns the tip of 200 segments by as much as λ does
    const RelaxReport report = make_relaxer(config, wall)->relax(wire, {2'000'000, 0, 0});
    EXPECT_TRUE(report.converged());
    EXPECT_NEAR(wire.tip().y(), 0, 1e-12);
    return wire;
}

double sag(RelaxerKind kind, int segments, EndCells ends = EndCells::Half) {  // [mm]
    return -hanging(kind, segments, fixed_weight, ends).tip().z();
}

/// Sag w L⁴/8EI of a small deflection [mm]; a large one is less by 1e-6 of it here.
constexpr double beam =
    fixed_weight * fixed_length * fixed_length * fixed_length * fixed_length / (8 * fixed_rigidity);

/// Distance of the tip from the exact one under a weight that bends the wire down by 77°, over L [-].
double error_of_tip(int segments, EndCells ends) {
    Elastica exact{.rigidity = fixed_rigidity, .length = fixed_length, .load = 4e-3};
    exact.clamp_at(0);
    const Vec3 tip = hanging(RelaxerKind::Global, segments, exact.load, ends).tip();
    return (tip - Vec3(exact.x, 0, exact.y)).norm() / fixed_length;
}

/// A wire that leaves the axis of a straight tube at 0.6 rad and ends on its wall, 6 mm away: in their plane
/// the wall is flat, and so stiff that the tip is 1e-6 mm in it. Force of the wall on the tip [N].
double force_on_wall(int segments, EndCells ends) {
    const Vec3 clamped(std::cos(0.6), std::sin(0.6), 0);
    std::vector<Vec3> tangents;
    for (int i = 0; i < segments; ++i) {
        const double angle = 0.6 * (1 - 0.8 * (i + 0.5) / segments);
        tangents.emplace_back(std::cos(angle), std::sin(angle), 0);
    }
    Chain wire = uniform_wire(fixed_rigidity, 20.0 / segments, {0, 0, 0}, clamped, tangents, ends);
    const TubeWall wall({{-20, 0, 0}, {60, 0, 0}}, 6.0, 1e5);
    EXPECT_TRUE(global_relaxer(wall)->relax(wire, {2'000'000, 0, 0}).converged());
    EXPECT_NEAR(wire.tip().y(), 6, 1e-5);
    const auto contacts = all_contacts(wire, wall);
    EXPECT_FALSE(contacts[segments - 1].touches());
    return contacts[segments].force();
}

}  // namespace

TEST(LoadedWire, SagsAsABeamUnderItsWeight) {
    // With half a segment's load at the tip and half a segment's bend at the clamp both sums are the
    // trapezoidal rule: exact for a load that grows linearly, off by 1/N² for a moment that grows as a
    // square.
    for (const RelaxerKind kind : {RelaxerKind::Global, RelaxerKind::Segment})
        for (const int segments : {10, 20})
            EXPECT_NEAR(sag(kind, segments) / beam - 1, 1.0 / (segments * segments), 1e-5) << segments;
    EXPECT_NEAR(sag(RelaxerKind::Global, 200) / beam - 1, 1.0 / (200 * 200), 5e-6);
}

TEST(LoadedWire, SagsByOneSegmentInThreeTenthsMoreByThePapersRule) {
    // A whole segment's load at the tip and a whole one's bend at the clamp: 10/3N, and 1/N² and less.
    for (const RelaxerKind kind : {RelaxerKind::Global, RelaxerKind::Segment}) {
        const double coarse = sag(kind, 10, EndCells::Paper), fine = sag(kind, 20, EndCells::Paper);
        EXPECT_NEAR((coarse - beam) / (fine - beam), 2, 0.1);
        EXPECT_NEAR(2 * fine - coarse, beam, 0.02 * beam);
    }
    EXPECT_NEAR(200 * (sag(RelaxerKind::Global, 200, EndCells::Paper) / beam - 1), 10.0 / 3, 0.03);
}

TEST(LoadedWire, BentFarDownItConvergesToTheElasticaAsTheSquareOfLambda) {
    const double coarse = error_of_tip(50, EndCells::Half), middle = error_of_tip(100, EndCells::Half),
                 fine = error_of_tip(200, EndCells::Half);
    EXPECT_LT(fine, 2e-5);
    EXPECT_NEAR(coarse / middle, 4, 0.05);
    EXPECT_NEAR(middle / fine, 4, 0.05);
    const double papers = error_of_tip(200, EndCells::Paper);
    EXPECT_NEAR(error_of_tip(100, EndCells::Paper) / papers, 2, 0.1);
    EXPECT_GT(papers, 100 * fine);
}

TEST(LoadedWire, PressesOnAWallAsTheElasticaDoes) {
    Elastica exact{.rigidity = fixed_rigidity, .length = 20};
    exact.rest_at(0.6, 6);
    const auto error = [&](int segments, EndCells ends) {
        return std::abs(force_on_wall(segments, ends) / exact.tip_force - 1);
    };
    const double half = error(20, EndCells::Half), paper = error(20, EndCells::Paper);
    EXPECT_NEAR(error(10, EndCells::Half) / half, 4, 0.1);
    EXPECT_NEAR(error(10, EndCells::Paper) / paper, 2, 0.1);
    EXPECT_LT(half, 0.0015);  // at λ = 1 mm
    EXPECT_GT(paper, 0.06);
}

TEST(LoadedWire, RestsInATubeWhereBothRelaxersSay) {
    const Polyline line = anatomy::draw(anatomy::find_scene("spatial")->path);
    const TubeWall wall(line, 2.0, 40, 0.44);
    studies::PlainWire spec{.segment_length = 2, .tip_length = 20};
    Chain unloaded = wire_along(spec, line, 40), wire = unloaded;
    wire.load = Vec3(0.005, 0.01, -0.02);
    Chain other = wire;
    global_relaxer(wall)->relax(unloaded, unlimited);
    const RelaxReport report = global_relaxer(wall)->relax(wire, unlimited);
    EXPECT_TRUE(report.converged());
    paper_relaxer(wall)->relax(other, whole_cycles(40, 150));
    EXPECT_GT(farthest_apart(wire, unloaded), 0.5);
    EXPECT_LT(farthest_apart(wire, other), 1e-3);
    EXPECT_NEAR(total_energy(wire, all_contacts(wire, wall)).total(),
                total_energy(other, all_contacts(other, wall)).total(), 1e-6);
}
