#include "physics/relax/global_relaxer.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "physics/wire/energy.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

/// Relaxes the wire, which must come to rest.
RelaxReport to_equilibrium(Relaxer& relaxer, Chain& wire, const LumenWall& wall) {
    const RelaxReport report = relaxer.relax(wire, unlimited);
    EXPECT_TRUE(report.converged());
    EXPECT_TRUE(report.strict_minimum());
    EXPECT_LE(report.gradient, 1e-8);
    EXPECT_LE(relative_gradient(wire, all_contacts(wire, wall)), 2e-8);  // measured by other code
    EXPECT_TRUE(validate(wire).empty());
    return report;
}

/// The half-space z < 0 as two vessels see it that meet at x = 0: beyond it the wall stands `jump` lower. Who
/// is held stays with its own up to 1 mm past the border.
struct TwoFields final : LumenWall {
    double jump;
    explicit TwoFields(double by) : jump(by) {}
    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        for (std::size_t i = 0; i < joints.size(); ++i) {
            WallContact& c = contacts[i];
            const double border = !c.held || c.station < 0 ? 0 : c.station == 0 ? 1 : -1;
            const int station = joints[i].x() > border;
            c = {.penetration = joints[i].z() + station * jump,
                 .normal = Vec3::UnitZ(),
                 .stiffness = 20,
                 .clearance = 5,
                 .station = station,
                 .held = c.held && station == c.station};
        }
    }
    bool same_vessel(int a, int b) const override { return a == b; }
};

struct Listed {
    const char* scene;
    std::initializer_list<double> minima;  // [N·mm], found by independent solvers
    double digits;
};
const Listed listed[] = {{"sinuous", {5.808956, 5.808954}, 1e-6},
                         {"spatial", {1.86512, 1.86577}, 5e-6},
                         {"hairpin", {13.4646, 13.4661, 13.4681, 13.4716}, 5e-5},
                         {"stiffwall", {5.812938}, 1e-6}};

}  // namespace

TEST(GlobalRelaxer, ReachesAListedMinimumFromTheCentreline) {
    for (const Listed& scene : listed) {
        auto [wall, wire] = scene_setup(scene.scene);
        to_equilibrium(*global_relaxer(wall), wire, wall);
        const double energy = energy_of(wire, wall);
        EXPECT_NEAR(energy, nearest(energy, scene.minima), scene.digits) << scene.scene;
    }
}

TEST(GlobalRelaxer, IsAtEquilibriumAfterEveryPush) {
    for (const Listed& scene : listed) {
        auto [wall, wire] = scene_setup(scene.scene);
        const int segments = wire.segments();
        wire = wire_along(wire.devices[0].spec, wire.grid, wall.centreline(), 20);
        auto relaxer = global_relaxer(wall);
        relaxer->relax(wire, unlimited);
        int unconverged = 0;
        while (wire.segments() < segments) {
            move(wire, wire.grid.segment_length);
            const RelaxReport report = relaxer->relax(wire, unlimited);
            unconverged += !report.converged();
            ASSERT_LT(report.largest_bend, 0.5) << scene.scene << " at " << wire.segments();
            const auto contacts = all_contacts(wire, wall);
            ASSERT_LT(largest_penetration(contacts), 0.05);
        }
        EXPECT_EQ(unconverged, 0) << scene.scene;
        const double energy = energy_of(wire, wall);
        EXPECT_NEAR(energy, nearest(energy, scene.minima), scene.digits) << scene.scene;
    }
}

TEST(GlobalRelaxer, GoesWhereThePapersRelaxerGoes) {
    auto [wall, wire] = scene_setup("hairpin");
    Chain other = wire;
    global_relaxer(wall)->relax(wire, unlimited);
    paper_relaxer(wall)->relax(other, whole_cycles(other.segments(), 100));
    EXPECT_LT(farthest_apart(wire, other), 0.05);
}

TEST(GlobalRelaxer, DoesNoWorkWhereNothingChanged) {
    auto [wall, wire] = scene_setup("hairpin");
    auto relaxer = global_relaxer(wall);
    relaxer->relax(wire, unlimited);
    const Chain before = wire;
    const RelaxReport report = relaxer->relax(wire, unlimited);
    EXPECT_EQ(report.newton_steps, 0);
    EXPECT_EQ(report.updates, 0);
    EXPECT_EQ(report.wall_queries, 0);
    EXPECT_TRUE(report.converged());
    EXPECT_EQ(wire.tangents, before.tangents);
    // A relaxer that has not seen this wire asks for every joint but moves none.
    EXPECT_EQ(global_relaxer(wall)->relax(wire, unlimited).wall_queries, wire.segments());
    EXPECT_EQ(wire.tangents, before.tangents);
}

TEST(GlobalRelaxer, WorksAtTheTipOfALongWireFirst) {
    auto [wall, wire] = long_scene(560);
    auto relaxer = global_relaxer(wall);
    relaxer->relax(wire, unlimited);
    long long windows = 0, wholes = 0;
    for (int k = 0; k < 30; ++k) {
        move(wire, wire.grid.segment_length);
        Chain other = wire;
        const RelaxReport report = to_equilibrium(*relaxer, wire, wall);
        const RelaxReport whole = global_relaxer(wall)->relax(other, unlimited);
        windows += report.updates;
        wholes += whole.updates;
        EXPECT_LT(report.wall_queries, whole.wall_queries);
    }
    EXPECT_LT(windows, wholes);
}

TEST(GlobalRelaxer, GoesByItsOptionsAndEndsForOneReason) {
    RelaxerConfig config;
    const auto push = [&](const GlobalOptions& options, int updates) {
        auto [wall, wire] = scene_setup("sinuous");
        GlobalRelaxer relaxer(config, wall, options);
        EXPECT_EQ(relaxer.last_report().termination, Termination::NotStarted);
        EXPECT_EQ(relaxer.relax(wire, unlimited).termination, Termination::StrictMinimum);
        move(wire, -wire.grid.segment_length);
        relaxer.relax(wire, unlimited);
        move(wire, wire.grid.segment_length);
        return std::pair(relaxer.relax(wire, {updates, 0, 0}), wire);
    };
    const auto [usual, usual_wire] = push({}, unlimited.updates);
    EXPECT_EQ(usual.termination, Termination::StrictMinimum);

    GlobalOptions whole;
    whole.window.least = 10'000;
    const auto [wide, wide_wire] = push(whole, unlimited.updates);
    EXPECT_EQ(wide.window, wide_wire.segments());
    EXPECT_GT(wide.updates, usual.updates);

    GlobalOptions careful;
    careful.trust.step_fraction = 0.01;
    const auto [short_steps, careful_wire] = push(careful, unlimited.updates);
    EXPECT_GT(short_steps.newton_steps, usual.newton_steps);
    for (const Chain* other : {&wide_wire, &careful_wire})  // of any options the rest is the same
        EXPECT_LT((other->tip() - usual_wire.tip()).norm(), 1e-5);

    EXPECT_EQ(push(careful, 80).first.termination, Termination::OutOfBudget);
    GlobalOptions impatient = careful;
    impatient.step.most_idle = -1;  // any step without much progress is one too many
    impatient.step.progress_energy = 1, impatient.step.progress_gradient = 0;
    impatient.softening.most_passes = 1;
    auto [wall, wire] = scene_setup("sinuous");
    const RelaxReport stuck = GlobalRelaxer(config, wall, impatient).relax(wire, unlimited);
    EXPECT_EQ(stuck.termination, Termination::Stuck) << message(stuck.termination);
    EXPECT_FALSE(stuck.at_rest() || stuck.out_of_budget());
}

TEST(GlobalRelaxer, SpendsAShortBudgetAtTheTip) {
    auto [wall, wire] = scene_setup("sinuous");
    auto relaxer = global_relaxer(wall);
    relaxer->relax(wire, unlimited);
    move(wire, -wire.grid.segment_length);
    relaxer->relax(wire, unlimited);
    move(wire, wire.grid.segment_length);
    const Chain before = wire;
    const double energy = energy_of(wire, wall);
    const RelaxReport report = relaxer->relax(wire, {80, 0, 0});
    EXPECT_FALSE(report.converged());
    EXPECT_TRUE(report.out_of_budget());
    EXPECT_EQ(report.newton_steps, 1);  // the first step is always completed
    EXPECT_LT(report.window, 100);
    EXPECT_LT(energy_of(wire, wall), energy);
    for (int i = 0; i <= wire.segments() - report.window; ++i)
        ASSERT_EQ(wire.tangents[i], before.tangents[i]) << i;
    EXPECT_TRUE(relaxer->relax(wire, unlimited).converged());
}

TEST(GlobalRelaxer, KeepsToItsBudgetAndReturnsALowerState) {
    auto [wall, wire] = scene_setup("sinuous");
    auto relaxer = global_relaxer(wall);
    double last = energy_of(wire, wall);
    for (int k = 0; k < 5; ++k) {
        const RelaxReport report = relaxer->relax(wire, {3 * wire.segments(), 0, 0});
        EXPECT_LE(report.newton_steps, 3);
        EXPECT_FALSE(report.converged());
        const double now = energy_of(wire, wall);
        EXPECT_LT(now, last);
        last = now;
        EXPECT_TRUE(validate(wire).empty());
    }
}

TEST(GlobalRelaxer, LeavesExactSymmetry) {
    // Pressed head-on along its axis, and folded back on itself exactly.
    Chain pressed = uniform_wire(50, 1.0, {0, 0, 0}, {1, 0, 0}, std::vector<Vec3>(40, Vec3::UnitX()));
    const TubeWall cap({{-1, 0, 0}, {38.5, 0, 0}}, 1.0, 42);
    const double before = energy_of(pressed, cap);
    RelaxReport report = to_equilibrium(*global_relaxer(cap), pressed, cap);
    EXPECT_LT(energy_of(pressed, cap), 0.7 * before);
    EXPECT_GT(report.push_force, 0.0);

    std::vector<Vec3> tangents(40, Vec3::UnitX());
    for (int i = 20; i < 40; ++i) tangents[i] = -Vec3::UnitX();
    Chain folded = uniform_wire(50, 1.0, {0, 0, 0}, {1, 0, 0}, tangents);
    const TubeWall tube({{-30, 0, 0}, {60, 0, 0}}, 3.0, 42);
    report = global_relaxer(tube)->relax(folded, unlimited);
    EXPECT_TRUE(validate(folded).empty());
    EXPECT_LT(report.gradient, 1e-6);
}

TEST(GlobalRelaxer, AFoldedWireStaysFolded) {
    // A hairpin turn inside a wide straight tube: unfolding would first cost energy.
    std::vector<Vec3> tangents;
    for (int i = 0; i < 20; ++i) tangents.push_back(Vec3::UnitX());
    for (int i = 0; i < 12; ++i) {
        const double angle = M_PI * (i + 0.5) / 12;
        tangents.emplace_back(std::cos(angle), std::sin(angle), 0);
    }
    for (int i = 0; i < 20; ++i) tangents.push_back(-Vec3::UnitX());
    Chain wire = uniform_wire(50, 1.0, {0, -3.8, 0}, {1, 0, 0}, tangents);
    const TubeWall wall({{-30, 0, 0}, {60, 0, 0}}, 4.5, 42);
    const RelaxReport report = to_equilibrium(*global_relaxer(wall), wire, wall);
    EXPECT_LT(wire.tangents.back().x(), -0.5);
    EXPECT_LT(report.largest_bend, M_PI / 3);
}

TEST(GlobalRelaxer, RotatesACurvedTipAgainstAWallUnderItsWeight) {
    studies::PlainWire spec{.segment_length = 1, .curved_angle = 1.2};
    const Polyline line = anatomy::draw(anatomy::find_scene("spatial")->path);
    const TubeWall wall(line, 2.0, 20, 0.44);
    Chain wire = wire_along(spec, line, 100);
    wire.load = Vec3(0, 0, -1e-3);
    auto relaxer = global_relaxer(wall);
    to_equilibrium(*relaxer, wire, wall);
    double torque = 0;
    int steps = 0;
    for (int k = 0; k < 36; ++k) {
        rotate(wire, every_device, 10 * M_PI / 180);
        const RelaxReport report = to_equilibrium(*relaxer, wire, wall);
        torque = std::max(torque, std::abs(report.base_torque));
        steps += report.newton_steps;
        // The torque is the energy's change with the hub's turn.
        if (k % 12 == 0) {
            auto energy_at = [&](double angle) {
                Chain turned = wire;
                rotate(turned, every_device, angle);
                return energy_of(turned, wall);
            };
            const double slope = (energy_at(1e-5) - energy_at(-1e-5)) / 2e-5;
            EXPECT_NEAR(report.base_torque, slope, 1e-6 + 1e-4 * std::abs(slope));
        }
    }
    EXPECT_GT(torque, 1e-4);
    EXPECT_LT(steps, 36 * 25);
}

TEST(GlobalRelaxer, MirroredSceneGivesTheMirroredWire) {
    // With and without a load, mirrored as well.
    const Polyline path = anatomy::draw(anatomy::find_scene("spatial")->path);
    Polyline mirrored = path;
    for (Vec3& p : mirrored) p.z() = -p.z();
    studies::PlainWire spec;
    auto run = [&](const Polyline& line, double sign, const Vec3& load) {
        const TubeWall wall(line, 2.0, 40, 0.44);
        Chain wire = wire_along(spec, line, 40);
        wire.base_director = Vec3::UnitY();
        wire.load = load;
        auto relaxer = global_relaxer(wall);
        for (int k = 0; k < 15; ++k) {
            move(wire, 2);
            rotate(wire, every_device, sign * 0.15);
            relaxer->relax(wire, unlimited);
        }
        return wire;
    };
    for (const double weight : {0.0, 0.01}) {
        const Chain one = run(path, 1, weight * Vec3(0.3, -0.5, 0.8));
        const Chain other = run(mirrored, -1, weight * Vec3(0.3, -0.5, -0.8));
        for (int i = 0; i <= one.segments(); ++i) {
            const Vec3 image(other.joints[i].x(), other.joints[i].y(), -other.joints[i].z());
            EXPECT_LT((one.joints[i] - image).norm(), 1e-5) << i;
        }
    }
}

TEST(GlobalRelaxer, HoldsUpTheWiresWeightAtTheIntroducer) {
    // A wire that hangs straight down, and one that stands.
    for (const double up : {-1.0, 1.0}) {
        Chain wire = uniform_wire(50, 1.0, {0, 0, 0}, {0, 0, up}, std::vector<Vec3>(40, Vec3(0, 0, up)));
        const TubeWall wall({{0, 0, -100}, {0, 0, 100}}, 20.0, 40);
        wire.load = Vec3(0, 0, -1e-3);
        const RelaxReport report = to_equilibrium(*global_relaxer(wall), wire, wall);
        EXPECT_NEAR(report.push_force, up * 0.04, 1e-12);
    }
}

TEST(GlobalRelaxer, AStandingWireBucklesUnderItsWeightWhereGreenhillSays) {
    // w L³/EI = 7.8373 (Greenhill 1881), which half cells at both ends reach as 1/N².
    const double length = 100, critical = 7.8373 * 50 / std::pow(length, 3);
    const TubeWall wall({{0, 0, -100}, {0, 0, 200}}, 150.0, 40);
    for (const double fraction : {0.99, 1.01}) {
        Chain wire = uniform_wire(50, 0.5, {0, 0, 0}, {0, 0, 1}, std::vector<Vec3>(200, Vec3::UnitZ()));
        wire.load = Vec3(0, 0, -fraction * critical);
        to_equilibrium(*global_relaxer(wall), wire, wall);
        EXPECT_EQ(wire.tip().head<2>().norm() > 1.0, fraction > 1) << wire.tip().transpose();
    }
}

TEST(GlobalRelaxer, FollowsALoadThatChanges) {
    auto [wall, wire] = scene_setup("spatial");
    auto relaxer = global_relaxer(wall);
    relaxer->relax(wire, unlimited);
    const double unloaded = energy_of(wire, wall);
    wire.load = Vec3(0, -0.02, 0.01);
    EXPECT_GT(to_equilibrium(*relaxer, wire, wall).newton_steps, 0);
    wire.load.setZero();
    EXPECT_GT(energy_of(wire, wall), unloaded + 1e-4);
    to_equilibrium(*relaxer, wire, wall);
    EXPECT_NEAR(energy_of(wire, wall), nearest(energy_of(wire, wall), {1.86512, 1.86577}), 5e-6);
}

TEST(GlobalRelaxer, RestsWhereTheWallJumpsBetweenTwoVessels) {
    constexpr unsigned seed = 12;
    constexpr int cases = 1000;
    std::mt19937 random(seed);
    const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
    studies::PlainWire spec{.segment_length = 1};
    int restless = 0, crossed = 0;
    for (int k = 0; k < cases; ++k) {
        const double jump = std::pow(10, -4 + 3 * unit()) * (random() % 4 == 0 ? -1 : 1);
        const TwoFields wall(jump);
        const double x = -0.2 * unit();
        const Polyline path{Vec3(x, 0, -1e-3), Vec3(x, 40, -1e-3)};
        Chain wire = wire_along(spec, path, 40);
        // Across the border, slightly or far, and onto the wall [N/mm].
        wire.load = Vec3(std::pow(10, -6 + 3 * unit()), 0, 0.02 * unit());
        for (int& station : wire.stations) station = 0;
        const RelaxReport report = global_relaxer(wall)->relax(wire, {.updates = 40 * 400});
        restless += !report.at_rest();
        crossed += wire.joints.back().x() > 0;
    }
    EXPECT_EQ(restless, 0) << "seed " << seed;
    EXPECT_GT(crossed, cases / 2);
}

/// A solve whose budget is cut again and again comes to the rest that it comes to at once. A trust region
/// that is forgotten at every call leaves 11 of these wires where they are for ever.
TEST(GlobalRelaxer, ColdStartsComeToRestHoweverTheirBudgetIsCut) {
    std::mt19937_64 random(1);
    const auto draw = [&](double from, double to) {
        return from + (to - from) * std::ldexp(static_cast<double>(random() >> 11), -53);
    };
    for (int trial = 0; trial < 400; ++trial) {
        const int segments = static_cast<int>(draw(20, 80));
        const double lambda = draw(0.3, 1.5), rigidity = 5 * std::pow(100, draw(0, 1)),
                     stiffness = 10 * std::pow(1000, draw(0, 1)), radius = draw(2, 8),
                     clamp = draw(-40, 40) * degree, bend = draw(-2, 2) / segments;
        double angle = draw(-30, 30) * degree, y = 0, way = 1;
        std::vector<Vec3> tangents;
        for (int i = 0; i < segments; ++i) {
            if (std::abs(y + lambda * std::sin(angle)) > radius) angle = -angle, way = -way;
            tangents.emplace_back(std::cos(angle), std::sin(angle), 0);
            y += lambda * tangents.back().y();
            angle += way * bend;
        }
        const TubeWall wall({{0, 0, 0}, {2 * lambda * segments, 0, 0}}, radius, stiffness);
        Chain wire =
            uniform_wire(rigidity, lambda, Vec3::Zero(), {std::cos(clamp), std::sin(clamp), 0}, tangents);
        GlobalRelaxer relaxer({}, wall);
        RelaxReport report;
        int calls = 0;
        for (; calls < 300 && !report.converged(); ++calls)
            report = relaxer.relax(wire, whole_cycles(segments, 1));
        EXPECT_TRUE(report.converged()) << "trial " << trial << ": |g|/C " << report.gradient;
    }
}

/// The case of physics that never came to rest in 3000 calls, in calls as small as its own.
TEST(GlobalRelaxer, GoesOnWithItsTrustRegionAndSavesIt) {
    const int segments = 41;
    const double lambda = 0.5;
    std::vector<Vec3> tangents(segments, Vec3(std::cos(0.2), std::sin(0.2), 0));
    const TubeWall wall({{0, 0, 0}, {60, 0, 0}}, 5, 1e4);
    Chain wire = uniform_wire(50, lambda, Vec3::Zero(), {std::cos(M_PI / 6), 0.5, 0}, tangents);
    GlobalRelaxer relaxer({}, wall), restored({}, wall);
    Chain other;
    RelaxReport report;
    int calls = 0;
    for (; calls < 200 && !report.converged(); ++calls) {
        if (calls == 3) {
            geometry::restore_state(restored, geometry::state_of(relaxer));
            other = wire;
        }
        report = relaxer.relax(wire, {253, 0, 0});
        if (calls >= 3) restored.relax(other, {253, 0, 0});
        if (calls >= 3) {
            ASSERT_EQ(wire.tangents, other.tangents) << "call " << calls;
        }
    }
    EXPECT_TRUE(report.converged()) << report.gradient;
    EXPECT_GT(calls, 4);
}
