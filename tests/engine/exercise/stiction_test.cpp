/// Static and kinetic friction, of devices in each other and in their valves, as a scenario has them.

#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <set>

#include "engine/exercise/exercise.h"
#include "physics/wire/energy.h"
#include "tests/engine/exercise/wild_exercise.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using script::DeviceRole;

std::string rubbing_toml(const std::string& wire, const std::string& catheter) {
    return test::small_toml_with("frictionless = true", wire) +
           "[catheter]\ndevice = \"cobra5f\"\ninserted_mm = 30\n" + catheter;
}

std::string refused(const std::string& toml) {
    try {
        const scenario::Scenario s = test::small_scenario(toml);
        std::string all;
        for (const std::string& text : scenario::problems(s)) all += text;
        return all;
    } catch (const io::InputError& error) {
        return error.what();
    }
}

/// Makes frames until nothing waits.
void play(Simulation& simulation, const script::Command& command) {
    simulation.apply(command);
    for (int k = 0; k < 300; ++k) {
        const StepReport report = simulation.step();
        EXPECT_FALSE(report.refused);
        if (!report.settling && report.waiting_insertion == 0) return;
    }
    FAIL() << "it never came to rest";
}

}  // namespace

TEST(StictionScenario, KeysAreReadAndTheWallScalesThoseOfTheWall) {
    const scenario::Scenario s = test::small_scenario(
        rubbing_toml("friction = 0.1\nstatic_friction = 0.14\nvalve_friction_N = 0.1\npinned = false",
                     "inner_friction = 0.05\nstatic_inner_friction = 0.06\nvalve_friction_N = "
                     "0.2\nstatic_valve_friction_N = 0.3\n") +
        "[wall]\nfriction = 1.5\n");
    EXPECT_TRUE(scenario::problems(s).empty());
    EXPECT_FALSE(s.devices[0].pinned);
    EXPECT_TRUE(s.devices[1].pinned);
    const Simulation simulation(s);
    const physics::DeviceSpec &wire = simulation.wire().devices[0].spec,
                              &catheter = simulation.wire().devices[1].spec;
    EXPECT_NEAR(wire.friction, 0.15, 1e-15);
    EXPECT_NEAR(wire.static_friction, 0.21, 1e-15);
    EXPECT_EQ(wire.valve_friction, 0.1);
    EXPECT_EQ(catheter.inner_friction, 0.05);
    EXPECT_EQ(catheter.static_inner_friction, 0.06);
    EXPECT_EQ(catheter.static_valve_friction, 0.3);
    EXPECT_EQ(simulation.wire().rubs.size(), 3u);
    // Each is part of what a recording belongs to.
    std::set<std::uint64_t> contents;
    for (const char* other : {"", "inner_friction = 0.04\n", "static_inner_friction = 0.17\n",
                              "valve_friction_N = 0.3\n", "pinned = false\nvalve_friction_N = 0.3\n"})
        contents.insert(
            test::small_scenario(rubbing_toml("friction = 0.1\nvalve_friction_N = 0.1", other)).content);
    EXPECT_EQ(contents.size(), 5u);
}

TEST(StictionScenario, ValuesThatAreImpossibleAreRefused) {
    test::expect_said(refused(rubbing_toml("friction = 0.1\nstatic_friction = 0.05", "")),
                      "not below 'friction', 0.1");
    test::expect_said(refused(rubbing_toml("static_friction = 1.5", "")), "from 0 to 1");
    test::expect_said(refused(rubbing_toml("valve_friction_N = -1", "")), "valve_friction_N");
    test::expect_said(refused(rubbing_toml("inner_friction = 0.1", "")), "unknown key 'inner_friction'");
    test::expect_said(refused(rubbing_toml("", "inner_friction = 0.2\nstatic_inner_friction = 0.1\n")),
                      "'inner_friction', 0.2");
    test::expect_said(refused(rubbing_toml("static_valve_friction_N = 0.1\nfrictionless = true", "")),
                      "'static_valve_friction_N' or 'frictionless = true'");
    test::expect_said(
        refused(rubbing_toml("pinned = false\nvalve_friction_N = 0\nstatic_valve_friction_N = 0", "")),
        "valve_friction_N above 0");
    test::expect_said(refused(rubbing_toml("pinned = 1", "")), "pinned");
    test::expect_said(refused(rubbing_toml("static_friction = 0.9", "[wall]\nfriction = 2\n")), "up to 1");
    scenario::Scenario paper = test::small_scenario();
    paper.wire().device.valve_friction = 0.1;
    paper.relaxer.kind = physics::RelaxerKind::Segment;
    ASSERT_EQ(scenario::problems(paper).size(), 1u);
    test::expect_said(scenario::problems(paper)[0], "friction");
}

/// A scenario's kinetic value takes the catalogue's static one with it, and frictionless means all of it.
TEST(StictionScenario, StaticValuesGoWithTheirKineticOnes) {
    const std::string file = test::asset("devices/cobra5f.toml");
    std::ifstream in(file);
    std::string text((std::istreambuf_iterator<char>(in)), {});
    try {
        scenario::parse_device(test::replaced(text, "inner_friction = \"", "title = \""), "mine.toml");
        FAIL() << "a value without a source";
    } catch (const io::InputError& error) {
        test::expect_said(error.what(), "source");
    }
    const scenario::Device device = scenario::parse_device(text, "mine.toml");
    EXPECT_EQ(device.holding_friction(), 0.26);
    EXPECT_EQ(device.inner_friction, 0.1);
    const auto with = [&](const std::string& lines) {
        const test::TemporaryFolder folder;
        std::ofstream(folder.path() / "mine.toml") << text;
        return scenario::parse_scenario(
                   std::string(test::small_toml) + "[catheter]\ndevice = \"mine.toml\"\n" + lines,
                   folder.path() / "s.toml", test::asset("devices"))
            .devices[1]
            .device;
    };
    EXPECT_EQ(with("").static_friction, 0.26);
    EXPECT_EQ(with("friction = 0.1\n").static_friction, 0);
    EXPECT_EQ(with("friction = 0.1\nstatic_friction = 0.12\n").static_friction, 0.12);
    const scenario::Device smooth = with("frictionless = true\n");
    EXPECT_EQ(smooth.holding_friction() + smooth.holding_inner_friction() + smooth.holding_valve_friction(),
              0);
}

/// The wire goes along with a catheter where no hand holds it, for its valve is on the catheter's hub.
TEST(StictionScenario, AnIdleWireIsPinnedOrDraggedAlong) {
    struct Case {
        const char *pinned, *valve;
        bool dragged;
    };
    for (const Case& c :
         {Case{"true", "0.002", false}, Case{"false", "0.002", true}, Case{"false", "5", true}}) {
        scenario::Scenario s = test::small_scenario(rubbing_toml(
            std::string("friction = 0\nvalve_friction_N = ") + c.valve + "\npinned = " + c.pinned,
            "friction = 0\ninner_friction = 0.5\nvalve_friction_N = 0.1\n"));
        s.torsion = scenario::TorsionModel::Rigid;
        s.wire().inserted = 50;
        Simulation simulation(s);
        const double wire = simulation.inserted(DeviceRole::Wire),
                     catheter = simulation.inserted(DeviceRole::Catheter);
        play(simulation, script::Advance{15, DeviceRole::Catheter});
        const double gone = simulation.inserted(DeviceRole::Wire) - wire;
        EXPECT_NEAR(simulation.inserted(DeviceRole::Catheter), catheter + 15, 1e-9);
        if (c.dragged) {
            EXPECT_GT(gone, 10);
            EXPECT_LT(std::abs(simulation.hand(DeviceRole::Wire).load.push), 5e-3 + 0.01 * std::stod(c.valve))
                << "nobody holds it";
        } else {
            EXPECT_LT(std::abs(gone), 2 * physics::slip_length);
        }
        if (std::string(c.pinned) == "true") {
            EXPECT_EQ(gone, 0);
        }
        // The valve resists the hand.
        EXPECT_GT(simulation.hand(DeviceRole::Catheter).load.push, 0.08);
        EXPECT_GT(simulation.wire().rub_loss, 0.1);
        // In its own hand it goes alone, and is held there.
        play(simulation, script::Withdraw{3, DeviceRole::Wire});
        EXPECT_NEAR(simulation.inserted(DeviceRole::Wire), wire + gone - 3, 1e-9);
        EXPECT_NEAR(simulation.inserted(DeviceRole::Catheter), catheter + 15, 1e-9);
    }
}

/// What a helper holds stays, what he lets go of goes along, as the scenario's own `pinned` has it.
TEST(StictionScenario, APinHoldsADeviceOrLetsItGoWhileOthersMove) {
    const auto scenario = [](const std::string& pinned, const std::string& valve = "0.002") {
        scenario::Scenario s = test::small_scenario(
            rubbing_toml("friction = 0\nvalve_friction_N = " + valve + "\npinned = " + pinned,
                         "friction = 0\ninner_friction = 0.5\nvalve_friction_N = 0.1\n"));
        s.torsion = scenario::TorsionModel::Rigid;
        s.wire().inserted = 50;
        return s;
    };
    Simulation told(scenario("true")), written(scenario("false"));
    const double wire = told.inserted(DeviceRole::Wire);
    play(told, script::Advance{5, DeviceRole::Catheter});
    EXPECT_EQ(told.inserted(DeviceRole::Wire), wire) << "it is held";
    told.apply(script::Pin{false, DeviceRole::Wire});
    EXPECT_FALSE(told.devices()[0].pinned);
    play(told, script::Advance{15, DeviceRole::Catheter});
    play(written, script::Advance{15, DeviceRole::Catheter});
    const double gone = told.inserted(DeviceRole::Wire) - wire;
    EXPECT_GT(gone, 10);
    EXPECT_NEAR(gone, written.inserted(DeviceRole::Wire) - wire, 0.5);

    // It is part of the state, and of a new attempt no more.
    Simulation again(scenario("true"));
    geometry::restore_state(again, geometry::state_of(told));
    EXPECT_FALSE(again.devices()[0].pinned);
    EXPECT_EQ(again.state_hash(), told.state_hash());
    for (Simulation* s : {&told, &again}) play(*s, script::Withdraw{10, DeviceRole::Catheter});
    EXPECT_EQ(again.state_hash(), told.state_hash());
    told.apply(script::Pin{true, DeviceRole::Wire});
    const double held = told.inserted(DeviceRole::Wire);
    play(told, script::Withdraw{5, DeviceRole::Catheter});
    EXPECT_EQ(told.inserted(DeviceRole::Wire), held);
    told.apply(script::Pin{false, DeviceRole::Wire});
    told.reset();
    EXPECT_TRUE(told.devices()[0].pinned);

    // A valve that holds nothing does not let go, and says so.
    Simulation smooth(scenario("true", "0"));
    smooth.apply(script::Pin{false, DeviceRole::Wire});
    EXPECT_TRUE(smooth.devices()[0].pinned);
    test::expect_said(smooth.step().denied, "its valve has no friction");
    EXPECT_THROW(smooth.apply(script::Pin{true, DeviceRole::Sheath}), io::InputError);
}

/// States of runs without a pin keep their hashes, and one that is undone is as if there had been none.
TEST(StictionScenario, APinThatChangesNothingLeavesTheState) {
    const scenario::Scenario s =
        test::small_scenario(rubbing_toml("friction = 0\nvalve_friction_N = 0.01", ""));
    Simulation plain(s), pinned(s);
    pinned.apply(script::Pin{true, DeviceRole::Wire});
    for (Simulation* simulation : {&plain, &pinned})
        play(*simulation, script::Advance{5, DeviceRole::Catheter});
    EXPECT_EQ(pinned.state_hash(), plain.state_hash());
}

TEST(StictionScenario, WildHandsEndAtRestRestoreAndReplay) {
    for (unsigned seed = 0; seed < 8; ++seed) {
        scenario::Scenario s = test::small_scenario(
            rubbing_toml("friction = 0.1\nstatic_friction = 0.15\nvalve_friction_N = 0.02\npinned = false",
                         "inner_friction = 0.2\nstatic_inner_friction = 0.3\nvalve_friction_N = "
                         "0.05\nstatic_valve_friction_N = 0.08\npinned = false\n"));
        s.wire().inserted = 40;
        s.torsion = seed % 2 == 0 ? scenario::TorsionModel::Compliant : scenario::TorsionModel::Segments;
        Exercise exercise(s, false);
        const bool helped = seed >= 4;  // somebody holds devices, or lets them go
        const auto wild = [helped](std::mt19937& random) {
            const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
            std::vector<script::Command> commands;
            const DeviceRole held = random() % 2 == 0   ? DeviceRole::Wire
                                    : random() % 4 == 0 ? DeviceRole::All
                                                        : DeviceRole::Catheter;
            if (random() % 3 != 0) commands.emplace_back(script::Advance{4 * unit(), held});
            if (random() % 3 == 0) commands.emplace_back(script::Withdraw{4 * unit(), held});
            if (random() % 3 == 0) commands.emplace_back(script::Rotate{3 * (unit() - 0.5), held});
            if (helped && random() % 4 == 0)
                commands.emplace_back(script::Pin{
                    random() % 2 == 0, random() % 2 == 0 ? DeviceRole::Wire : DeviceRole::Catheter});
            return commands;
        };
        test::play_wildly_and_again(exercise, seed, wild);
        if (HasFatalFailure()) return;
        EXPECT_GT(exercise.simulation().wire().rub_loss, 0);
    }
}

/// Whatever the rate of frames, what has lain still for rest_time holds by the static coefficient.
TEST(StictionScenario, FramesOfRestMakeItStick) {
    for (const double rate : {7.5, 15.0, 60.0}) {
        scenario::Scenario s = test::small_scenario(
            test::small_toml_with("frictionless = true", "friction = 0.1\nstatic_friction = 0.2"));
        s.frame_rate = rate;
        s.imaging.pulse_rate = 7.5;
        Simulation simulation(s);
        play(simulation, script::Advance{10});
        const auto still = [&] {
            const auto& grips = simulation.wire().grips;
            return std::any_of(grips.begin(), grips.end(),
                               [](const physics::Grip& grip) { return grip.holds() && grip.rests(); });
        };
        const double force = simulation.hand(DeviceRole::Wire).load.push;
        int frames = 0;
        while (!still() && frames < 100) simulation.step(), ++frames;
        EXPECT_GE(frames, physics::rest_time * rate) << rate;
        EXPECT_LE(frames, physics::rest_time * rate + 3) << rate;
        EXPECT_NEAR(simulation.hand(DeviceRole::Wire).load.push, force, 1e-5);
    }
}

}  // namespace exercise
