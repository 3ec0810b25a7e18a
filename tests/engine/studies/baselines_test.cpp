/// The classical rods that the study of speed against accuracy compares with: each against closed forms, and
/// the equilibrium of all against ours.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <memory>

#include "engine/anatomy/scenes.h"
#include "engine/studies/baselines/beam_rod.h"
#include "engine/studies/baselines/position_rod.h"
#include "engine/studies/baselines/spring_chain.h"
#include "engine/studies/pareto_methods.h"
#include "engine/studies/plain_wire.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/tube_wall.h"
#include "tests/engine/fixtures.h"
#include "tests/physics/elastica.h"
#include "tests/physics/wires.h"

namespace baselines {
namespace {

enum class Kind { Position, Chain, Beam };

std::unique_ptr<Baseline> make_rival(Kind kind, const RodSpec& spec, const Tube* tube = nullptr) {
    switch (kind) {
        case Kind::Position:
            return std::make_unique<PositionRod>(spec, tube, PositionSettings{0.1, 16, false, true});
        case Kind::Chain:
            return std::make_unique<SpringChain>(spec, tube, Damping::Critical);
        case Kind::Beam:
            break;
    }
    return std::make_unique<BeamRod>(spec, tube);
}

std::vector<Vec3> straight_nodes(int n, double length) {
    std::vector<Vec3> nodes;
    for (int i = 0; i <= n; ++i) nodes.emplace_back(length * i, 0, 0);
    return nodes;
}

/// The deflection of a clamped rod 20 mm long under a small force across its end.
double deflection(Kind kind, int n, double force) {
    RodSpec spec{.segment_length = 20.0 / n, .axial = 1e4, .load = {0, force, 0}};
    const auto rod = make_rival(kind, spec);
    rod->start(straight_nodes(n, spec.segment_length));
    rod->advance(kind == Kind::Beam ? 100 : 30'000);
    return rod->nodes().back().y();
}

const Tube& bent_tube() {
    static const Tube tube({{10, 0, Vec3::UnitZ()}, {20, 1.4, Vec3::UnitZ()}, {15, -1.2, {0.3, 0.5, 1}}},
                           1.5);
    return tube;
}

std::vector<Vec3> centreline_nodes(const Tube& tube, int n) {
    std::vector<Vec3> nodes;
    for (int i = 0; i <= n; ++i) nodes.push_back(tube.point(i));
    return nodes;
}

}  // namespace

TEST(Baselines, TheirTubeHasTheDistanceGradientAndCurvatureOfItsCentreline) {
    const Tube& tube = bent_tube();
    for (const double way : {4.0, 17.0, 29.0, 38.0, 44.0}) {
        const Vec3 x = tube.point(way) + Vec3(0.2, 1.1, -1.3);
        double at = tube.nearest_arc(x);
        const Touch touch = tube.touch(x, at, true);
        double least = 1e9;
        for (int k = 0; k <= 45'000; ++k) least = std::min(least, (tube.point(1e-3 * k) - x).norm());
        EXPECT_NEAR(touch.depth, least - 1.5, 1e-6) << way;
        for (int k = 0; k < 3; ++k) {
            const double h = 1e-5;
            double up_way = at, down_way = at;
            const Touch up = tube.touch(x + h * Vec3::Unit(k), up_way, false),
                        down = tube.touch(x - h * Vec3::Unit(k), down_way, false);
            EXPECT_NEAR(touch.normal[k], (up.depth - down.depth) / (2 * h), 1e-9) << way;
            EXPECT_LT((touch.curvature.col(k) - (up.normal - down.normal) / (2 * h)).norm(), 1e-8) << way;
        }
    }
}

TEST(Baselines, TheirTubeIsThatOfTheScenes) {
    for (const char* name : {"sinuous", "spatial", "hairpin"}) {
        const studies::ParetoVessel vessel = studies::scene_vessel(name, false);
        const physics::TubeWall wall(vessel.path, vessel.tube->radius(), 1.0);
        for (int k = 1; k < 100; ++k) {
            const std::vector<Vec3> x = {vessel.tube->point(vessel.tube->length() * k / 100) +
                                         Vec3(0.3, -0.2, 0.4)};
            double way = vessel.tube->nearest_arc(x[0]);
            std::vector<physics::WallContact> contact(1);
            wall.contacts(x, contact);
            EXPECT_NEAR(vessel.tube->touch(x[0], way, false).depth, contact[0].penetration, 1e-4)
                << name << k;
        }
    }
}

TEST(Baselines, RefuseATubeOrARodThatCannotBe) {
    EXPECT_THROW(Tube({}, 1), std::invalid_argument);
    EXPECT_THROW(Tube({{0, 0, Vec3::UnitZ()}}, 1), std::invalid_argument);
    EXPECT_THROW(Tube({{10, NAN, Vec3::UnitZ()}}, 1), std::invalid_argument);
    EXPECT_THROW(Tube({{10, 0, Vec3::UnitZ()}}, -1), std::invalid_argument);
    for (const Kind kind : {Kind::Position, Kind::Chain, Kind::Beam}) {
        const auto rod = make_rival(kind, {});
        EXPECT_THROW(rod->start({Vec3::Zero()}), std::invalid_argument);
        EXPECT_THROW(rod->start({Vec3::Zero(), Vec3(NAN, 0, 0)}), std::invalid_argument);
    }
}

TEST(Baselines, ACantileverBendsByPLCubedOver3EI) {
    const double force = 1e-4, exact = force * 8000 / (3 * 50);
    // The cubic element is exact at its nodes, whatever its length.
    for (const int n : {2, 5, 20}) EXPECT_NEAR(deflection(Kind::Beam, n, force) / exact, 1, 1e-5) << n;
    // Lumped joints, half a segment's at the clamp: PL³/3EI (1 + 1/2N²).
    for (const Kind kind : {Kind::Position, Kind::Chain})
        for (const int n : {4, 8})
            EXPECT_NEAR(deflection(kind, n, force) / exact, 1 + 0.5 / (n * n), 1e-5) << n;
}

TEST(Baselines, ABentBeamUnderAMomentIsACircleOfRadiusEIOverM) {
    RodSpec spec;
    spec.axial = 1e3;  // a moment alone stretches nothing
    const int n = 20;
    const double angle = 2.5;
    spec.moment = Vec3(0, 0, angle * spec.bending / n);
    BeamRod rod(spec, nullptr);
    rod.start(straight_nodes(n, 1));
    // The beam may turn out of the plane at no cost: there is no strict minimum, so no rest is reported.
    rod.advance(500);
    // Chords of length 1 that turn by M/EI from one to the next, half of that at the clamp.
    Vec3 at = Vec3::Zero();
    for (int i = 1; i <= n; ++i) {
        const double heading = angle / n * (i - 0.5);
        at += Vec3(std::cos(heading), std::sin(heading), 0);
        EXPECT_LT((rod.nodes()[i] - at).norm(), 1e-6) << i;
    }
}

TEST(Baselines, UnderALargeForceTheyTakeTheShapeOfTheElastica) {
    Elastica exact{.tip_force = 2};  // P L²/EI = 2: half of its length
    exact.clamp_at(0);
    EXPECT_NEAR(-exact.y, 0.49346, 1e-5);  // K. E. Bisshopp, D. C. Drucker, 1945
    const int n = 20;
    RodSpec spec{.axial = 1e5};
    spec.load = {0, 2 * spec.bending / (n * n), 0};
    for (const Kind kind : {Kind::Position, Kind::Chain, Kind::Beam}) {
        const auto rod = make_rival(kind, spec);
        rod->start(straight_nodes(n, 1));
        rod->advance(kind == Kind::Beam ? 200 : kind == Kind::Chain ? 20'000 : 25'000);
        EXPECT_NEAR(rod->nodes().back().x() / n, exact.x, 2e-3);
        EXPECT_NEAR(rod->nodes().back().y() / n, -exact.y, 2e-3);
    }
}

TEST(Baselines, TheBeamsEnergyNeverRisesAndAllEndAtTheSameRest) {
    const Tube& tube = bent_tube();
    RodSpec spec{.axial = 1e5};
    const std::vector<Vec3> start = centreline_nodes(tube, 44);
    const auto beam = make_rival(Kind::Beam, spec, &tube);
    beam->start(start);
    double energy = beam->energy();
    Progress progress = Progress::Going;
    for (int k = 0; k < 500 && progress == Progress::Going; ++k) {
        progress = beam->advance(1);
        EXPECT_LE(beam->energy(), energy + 1e-11);
        energy = beam->energy();
    }
    EXPECT_EQ(progress, Progress::AtRest);
    for (const Kind kind : {Kind::Position, Kind::Chain}) {
        const auto rod = make_rival(kind, spec, &tube);
        rod->start(start);
        rod->advance(kind == Kind::Chain ? 20'000 : 3000);
        for (int i = 0; i <= 44; ++i) EXPECT_LT((rod->nodes()[i] - beam->nodes()[i]).norm(), 0.02) << i;
    }
}

TEST(Baselines, OneThatDivergesSaysSoAndKeepsFiniteNodes) {
    RodSpec spec;
    SpringChain chain(spec, &bent_tube(), Damping::Kinetic, 0.01);
    auto nodes = centreline_nodes(bent_tube(), 40);
    nodes[20].y() += 0.1;
    chain.start(nodes);
    EXPECT_EQ(chain.advance(10'000), Progress::Diverged);
    EXPECT_EQ(chain.advance(1), Progress::Diverged);
    PositionRod rod(spec, &bent_tube(), {10, 1, true, true});
    rod.start(nodes);
    EXPECT_EQ(rod.advance(10'000), Progress::Diverged);
    for (const Baseline* each : {static_cast<const Baseline*>(&chain), static_cast<const Baseline*>(&rod)})
        for (const Vec3& x : each->nodes()) EXPECT_TRUE(x.allFinite());
    chain.start(centreline_nodes(bent_tube(), 40));  // afresh
    EXPECT_LT(chain.tally().rounds, 1);
}

/// Beams share no code with our wire: their distance at rest is that of two discretisations, second order in
/// the length of segments.
TEST(Baselines, OurEquilibriumIsThatOfBeamElementsToSecondOrder) {
    const studies::ParetoVessel vessel = studies::scene_vessel("sinuous", false);
    std::vector<double> apart;
    for (const int finer : {1, 2, 4}) {
        studies::PlainWire of = vessel.spec;
        of.segment_length /= finer;
        const physics::TubeWall wall(vessel.path, 1, vessel.stiffness / finer);
        const int n = 60 * finer;
        physics::Chain wire = wire_along(of, vessel.path, n);
        ASSERT_TRUE(global_relaxer(wall)->relax(wire, unlimited).converged());
        RodSpec spec = vessel.rod;
        spec.segment_length /= finer;
        spec.wall_stiffness /= finer;
        spec.axial *= 1e4;
        BeamRod beam(spec, vessel.tube.get());
        beam.start(wire.joints);
        ASSERT_EQ(beam.advance(500), Progress::AtRest);
        double farthest = 0;
        for (int i = 0; i <= n; ++i) farthest = std::max(farthest, (wire.joints[i] - beam.nodes()[i]).norm());
        apart.push_back(farthest);
    }
    EXPECT_LT(apart[0], 0.02);
    EXPECT_NEAR(std::log2(apart[0] / apart[2]) / 2, 2, 0.5);
}

}  // namespace baselines
