/// The shaft outside, from a hand's commands to what the hand feels.

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/exercise/exercise.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using script::DeviceRole;

/// A wire that rubs in a bend, by more than its shaft bears.
constexpr double critical = 0.012;  // [N]
scenario::Scenario tight(double torsional_rigidity = 0) {
    scenario::Scenario s = test::small_scenario();
    scenario::Device& wire = s.wire().device;
    wire.friction = 0.5;
    wire.buckling_force = critical;
    test::set_torsion(wire, torsional_rigidity);
    return s;
}

double fed_by(Simulation& simulation, const script::Command& command, int frames) {
    double fed = 0;
    for (int k = 0; k < frames; ++k) {
        simulation.apply(command);
        const StepReport report = simulation.step();
        EXPECT_FALSE(report.settling);
        if (report.refused) break;
        if (const auto* in = std::get_if<script::Advance>(&command)) fed += in->length;
        if (const auto* out = std::get_if<script::Withdraw>(&command)) fed -= out->length;
    }
    return fed;
}

}  // namespace

TEST(Outside, WhatHandsFeedIsInsideOrInTheBow) {
    Simulation simulation(tight());
    const double start = simulation.inserted();
    double fed = fed_by(simulation, script::Advance{1, DeviceRole::Wire}, 32);
    const Hand pressed = simulation.hand(DeviceRole::Wire);
    EXPECT_GT(pressed.bow, 3) << "it never bowed";
    EXPECT_NEAR(simulation.inserted() + pressed.bow, start + fed, 1e-6);
    EXPECT_LE(pressed.load.push, simulation.passes_on());
    EXPECT_GT(pressed.load.push, 0.9 * critical);
    // The bow comes out before the wire does.
    const double inside = simulation.inserted();
    fed += fed_by(simulation, script::Withdraw{1, DeviceRole::Wire}, static_cast<int>(pressed.bow) - 2);
    EXPECT_NEAR(simulation.inserted(), inside, 0.3);
    EXPECT_NEAR(simulation.inserted() + simulation.hand(DeviceRole::Wire).bow, start + fed, 1e-6);
    fed += fed_by(simulation, script::Withdraw{1, DeviceRole::Wire}, 12);
    EXPECT_LT(simulation.inserted(), inside - 5);
    EXPECT_NEAR(simulation.inserted() + simulation.hand(DeviceRole::Wire).bow, start + fed, 1e-6);
}

TEST(Outside, CloserHandsPushHarder) {
    Simulation far(tight()), near(tight());
    near.apply(script::Grip{50, DeviceRole::Wire});
    for (Simulation* simulation : {&far, &near})
        fed_by(*simulation, script::Advance{1, DeviceRole::Wire}, 32);
    EXPECT_GT(near.inserted(), far.inserted() + 3);
    EXPECT_GT(near.hand(DeviceRole::Wire).load.push, 1.4 * far.hand(DeviceRole::Wire).load.push);
    EXPECT_NEAR(near.passes_on() / far.passes_on(), 4, 0.01);
}

/// A hand that takes a bowed shaft closer to the valve, or a torsional one, moves nothing inside.
TEST(Outside, AnotherGripMovesNothing) {
    scenario::Scenario s = tight(100);
    for (const auto model : {scenario::TorsionModel::Compliant, scenario::TorsionModel::Segments}) {
        s.torsion = model;
        Simulation simulation(s);
        fed_by(simulation, script::Advance{1, DeviceRole::Wire}, 40);
        simulation.apply(script::Rotate{1.5, DeviceRole::Wire});
        for (int k = 0; k < 20; ++k) simulation.step();
        const Hand before = simulation.hand(DeviceRole::Wire);
        const geometry::Polyline joints = simulation.wire().joints;
        simulation.apply(script::Grip{30, DeviceRole::Wire});
        for (int k = 0; k < 5; ++k) simulation.step();
        EXPECT_NEAR(simulation.hand(DeviceRole::Wire).load.torque, before.load.torque,
                    1e-3 * std::abs(before.load.torque) + 1e-6);
        double moved = 0;
        for (std::size_t j = 0; j < joints.size(); ++j)
            moved = std::max(moved, (simulation.wire().joints[j] - joints[j]).norm());
        EXPECT_LT(moved, 0.02);
    }
}

/// Where less of the shaft twists outside, a turn of the hub turns more of the tip.
TEST(Outside, TheShaftOutsideTakesAPartOfTheTurn) {
    scenario::Scenario s = tight(20);
    s.torsion = scenario::TorsionModel::Compliant;
    double wound[2];
    for (const int close : {0, 1}) {
        s.hand_distance = close ? 5 : 400;
        Simulation simulation(s);
        simulation.apply(script::Rotate{1, DeviceRole::Wire});
        for (int k = 0; k < 20; ++k) simulation.step();
        wound[close] = std::abs(simulation.wire().devices[0].wound_up());
    }
    EXPECT_GT(wound[0], 1.2 * wound[1]);
}

TEST(Outside, ThePapersRelaxersRefuseAGrip) {
    scenario::Scenario s = test::small_scenario();
    s.relaxer.kind = physics::RelaxerKind::Segment;
    Simulation simulation(s);
    EXPECT_THROW(simulation.apply(script::Grip{30, DeviceRole::Wire}), io::InputError);
}

/// The same wire in a catheter that is as easily bowed.
scenario::Scenario two_tight() {
    scenario::Scenario s = test::small_scenario(std::string(test::small_toml) +
                                                "[catheter]\ndevice = \"berenstein5f\"\ninserted_mm = 18\n");
    for (scenario::PlacedDevice& placed : s.devices) {
        placed.device.friction = placed.device.static_friction = 0.5;
        placed.device.buckling_force = critical;
        placed.pinned = false;
    }
    return s;
}

/// One hand on both: they go in by the same length, the shaft that bows is the catheter's with the wire in
/// it, and it bears what both bear.
TEST(Outside, AHandThatFeedsAllBowsTheOutermostShaftWithTheOthersInIt) {
    Simulation both(two_tight());
    const double wire = both.inserted(DeviceRole::Wire), catheter = both.inserted(DeviceRole::Catheter);
    const double fed = fed_by(both, script::Advance{1, DeviceRole::All}, 40);
    const double bow = both.hand(DeviceRole::Catheter).bow;
    EXPECT_GT(bow, 3) << "it never bowed";
    EXPECT_NEAR(both.inserted(DeviceRole::Catheter) + bow, catheter + fed, 1e-6);
    EXPECT_NEAR(both.inserted(DeviceRole::Wire) + both.hand(DeviceRole::Wire).bow, wire + fed, 1e-6);
    EXPECT_GE(both.hand(DeviceRole::Wire).bow, bow) << "it lies in the catheter's bow";
    const double push = both.hand(DeviceRole::Wire).load.push + both.hand(DeviceRole::Catheter).load.push;
    EXPECT_NEAR(both.passes_on(1) / both.passes_on(0), 2, 1e-3) << "critical loads add";
    EXPECT_GT(push, 0.9 * 2 * critical);
    EXPECT_LE(push, both.passes_on(1) + 1.5e-3);
    // A pull takes the bow first.
    const double inside = both.inserted(DeviceRole::Catheter);
    fed_by(both, script::Withdraw{1, DeviceRole::All}, static_cast<int>(bow) - 2);
    EXPECT_NEAR(both.inserted(DeviceRole::Catheter), inside, 0.3);
    // Let go, the catheter straightens, and what it held of the wire bows the wire's own shaft.
    const double held = both.hand(DeviceRole::Wire).bow, in = both.inserted(DeviceRole::Wire);
    both.apply(script::Rotate{0.01, DeviceRole::Wire});
    for (int k = 0; k < 20; ++k) both.step();
    EXPECT_EQ(both.hand(DeviceRole::Catheter).bow, 0);
    EXPECT_NEAR(both.inserted(DeviceRole::Wire) + both.hand(DeviceRole::Wire).bow, in + held, 1e-6);
}

/// A thousand frames of random hands at several distances: what is fed is inside or bowed, and no push is
/// more than the shaft bears by more than is felt.
TEST(Outside, RandomHandsLoseNothing) {
    for (const unsigned seed : {1u, 2u, 3u, 4u}) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const auto unit = [&] { return random() / 4294967296.0; };
        scenario::Scenario s = tight();
        s.wire().device.static_friction = 0.6;
        Simulation simulation(s);
        double fed = 0;
        const double start = simulation.inserted();
        for (int frame = 0; frame < 250; ++frame) {
            const double mm = 3 * unit() * (unit() < 0.7 ? 1 : -1);
            if (unit() < 0.05) {
                // What is inside may come out by as much as the shaft no longer bears.
                const double before = simulation.hand(DeviceRole::Wire).bow;
                simulation.apply(script::Grip{10 + 150 * unit(), DeviceRole::Wire});
                fed += simulation.hand(DeviceRole::Wire).bow - before;
                continue;
            }
            if (mm > 0)
                simulation.apply(script::Advance{mm, DeviceRole::Wire});
            else
                simulation.apply(script::Withdraw{-mm, DeviceRole::Wire});
            if (unit() < 0.3) simulation.apply(script::Rotate{unit() - 0.5, DeviceRole::Wire});
            StepReport report = simulation.step();
            for (int k = 0; k < 50 && (report.settling || report.waiting_insertion != 0); ++k)
                report = simulation.step();
            ASSERT_EQ(report.waiting_insertion, 0) << "frame " << frame;
            const Hand hand = simulation.hand(DeviceRole::Wire);
            ASSERT_LE(hand.load.push, simulation.passes_on() + 1.5e-3) << "frame " << frame;
            const double now = simulation.inserted() + hand.bow - start;
            if (report.refused || report.withdrawal_stopped || report.whole_wire_is_in)
                fed = now;  // told: not all of it was made
            else
                fed += mm;
            ASSERT_NEAR(now, fed, 1e-6) << "frame " << frame << ", seed " << seed;
        }
    }
}

/// The same with two devices, each fed alone or both at once. What a hand that takes another device lets go
/// of, or has straightened, is counted from there.
TEST(Outside, RandomHandsOnTwoDevicesLoseNothing) {
    int bowed = 0, together = 0;
    for (const unsigned seed : {1u, 2u, 3u}) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const auto unit = [&] { return random() / 4294967296.0; };
        Simulation simulation(two_tight());
        constexpr std::array devices = {DeviceRole::Wire, DeviceRole::Catheter};
        const auto in_hand = [&](DeviceRole held, DeviceRole device) {
            return held == DeviceRole::All || held == device;
        };
        const auto fed_of = [&](DeviceRole device) {
            return simulation.inserted(device) + simulation.hand(device).bow;
        };
        std::array<double, 2> fed = {fed_of(DeviceRole::Wire), fed_of(DeviceRole::Catheter)};
        DeviceRole held = DeviceRole::All;
        const auto settle = [&] {
            StepReport report = simulation.step();
            bool partly = false;
            for (int k = 0; k < 50 && (report.settling || report.waiting_insertion != 0); ++k) {
                partly |= report.refused || report.withdrawal_stopped || report.whole_wire_is_in ||
                          report.too_thick;
                report = simulation.step();
            }
            EXPECT_EQ(report.waiting_insertion, 0);
            return partly || report.refused || report.withdrawal_stopped || report.whole_wire_is_in ||
                   report.too_thick;
        };
        for (int frame = 0; frame < 150; ++frame) {
            if (unit() < 0.1) {
                const DeviceRole next = std::array{DeviceRole::Wire, DeviceRole::Catheter, DeviceRole::All,
                                                   DeviceRole::All}[random() % 4];
                simulation.apply(script::Rotate{0.01, next});
                settle();
                held = next;
                fed = {fed_of(DeviceRole::Wire), fed_of(DeviceRole::Catheter)};
            }
            if (unit() < 0.05) {
                for (const DeviceRole device : devices)
                    simulation.apply(script::Grip{10 + 150 * unit(), device});
                fed = {fed_of(DeviceRole::Wire), fed_of(DeviceRole::Catheter)};
            }
            const double mm = 2 * unit() * (unit() < 0.7 ? 1 : -1);
            if (mm > 0)
                simulation.apply(script::Advance{mm, held});
            else
                simulation.apply(script::Withdraw{-mm, held});
            const bool partly = settle();
            for (const int k : {0, 1}) {
                if (!in_hand(held, devices[k])) continue;
                const double now = fed_of(devices[k]);
                fed[k] = partly ? now : fed[k] + mm;
                ASSERT_NEAR(now, fed[k], 1e-6) << "frame " << frame << ", " << script::name_of(held);
            }
            if (held != DeviceRole::All) continue;
            ++together;
            bowed += simulation.hand(DeviceRole::Catheter).bow > 1;
            const double push =
                simulation.hand(DeviceRole::Wire).load.push + simulation.hand(DeviceRole::Catheter).load.push;
            ASSERT_LE(push, simulation.passes_on(1) + 3e-3) << "frame " << frame;
        }
    }
    EXPECT_GT(together, 100);
    EXPECT_GT(bowed, 30) << "no shaft bowed while one hand held both";
}

}  // namespace exercise
