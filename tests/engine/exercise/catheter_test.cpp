/// A catheter over the wire in an exercise: commands for each, contrast through it, images and truth, replay.

#include <algorithm>
#include <gtest/gtest.h>
#include <random>

#include "engine/exercise/device_rules.h"
#include "engine/exercise/exercise.h"
#include "engine/exercise/observation.h"
#include "engine/exercise/room_readout.h"
#include "engine/run/truth_files.h"
#include "engine/scenario/placement.h"
#include "engine/script/recording.h"
#include "physics/wire/energy.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using script::DeviceRole;
using Commands = std::vector<script::Command>;

/// The bent tube with a 5F Berenstein catheter.
scenario::Scenario with_catheter(const std::string& more = "", const std::string& device = "berenstein5f") {
    return test::small_scenario(std::string(test::small_toml) + "[catheter]\ndevice = \"" + device + "\"\n" +
                                more);
}

/// Makes frames until nothing waits.
StepReport play(Exercise& exercise, const Commands& commands) {
    StepReport last = exercise.next_frame(commands).motion, report = last;
    for (int k = 0; k < 200 && (last.settling || last.waiting_insertion != 0 || last.waiting_rotation != 0);
         ++k) {
        last = exercise.next_frame(Commands{}).motion;
        if (report.denied.empty()) report.denied = last.denied;
        report.too_thick |= last.too_thick;
    }
    return report;
}

TEST(Catheter, APartThatWouldNotEndInItsFrameWaitsForTheNextOne) {
    // A hand that is always ahead of what a frame's work can do.
    scenario::Scenario scenario = with_catheter("inserted_mm = 20.0\n");
    scenario.wire().device.friction = 0.1;
    scenario.budget.updates = 2500;
    Simulation simulation(scenario);
    int settling = 0, waiting = 0;
    for (int frame = 0; frame < 100; ++frame) {
        simulation.apply(script::Advance{20, frame % 3 == 0 ? DeviceRole::Wire : DeviceRole::Catheter});
        if (frame % 10 == 9) simulation.apply(script::Withdraw{60, DeviceRole::All});
        const StepReport report = simulation.step();
        settling += report.settling;
        waiting += report.waiting_insertion != 0;
    }
    EXPECT_GT(waiting, 50);
    // Some of them while it is pushed into the narrowing vessel past the end of the tube: 25 of 99.
    EXPECT_LT(settling, waiting / 3);
}

TEST(Catheter, EachDeviceMovesByItsOwnCommands) {
    Exercise exercise(with_catheter(), false);
    const Simulation& simulation = exercise.simulation();
    EXPECT_EQ(simulation.inserted(), 20);
    EXPECT_EQ(simulation.inserted(DeviceRole::Catheter), 0);
    EXPECT_TRUE(simulation.path_of(DeviceRole::Catheter).empty());
    play(exercise, {script::Advance{30}});
    play(exercise, {script::Advance{24.5, DeviceRole::Catheter}});
    EXPECT_NEAR(simulation.inserted(), 50, 1e-9);
    EXPECT_NEAR(simulation.inserted(DeviceRole::Catheter), 24.5, 1e-9);
    play(exercise, {script::Withdraw{4, DeviceRole::All}, script::Rotate{0.5, DeviceRole::Catheter}});
    EXPECT_NEAR(simulation.inserted(), 46, 1e-9);
    EXPECT_NEAR(simulation.inserted(DeviceRole::Catheter), 20.5, 1e-9);
    const auto& devices = simulation.wire().devices;
    EXPECT_NEAR(devices[1].roll + devices[1].windup, 0.5, 1e-9);
    EXPECT_NEAR(devices[0].roll + devices[0].windup, 0, 1e-9);
    // Wire and catheter in one frame.
    play(exercise, {script::Advance{3}, script::Advance{2, DeviceRole::Catheter}});
    EXPECT_NEAR(simulation.inserted(), 49, 1e-9);
    EXPECT_NEAR(simulation.inserted(DeviceRole::Catheter), 22.5, 1e-9);
    EXPECT_NEAR((simulation.tip_of(DeviceRole::Wire).at - simulation.wire().tip()).norm(), 0, 1e-9);
    EXPECT_NEAR(
        (simulation.path_of(DeviceRole::Catheter).back() - simulation.tip_of(DeviceRole::Catheter).at).norm(),
        0, 1e-9);
    // The wire's tip inside the catheter, and the wire out.
    play(exercise, {script::Withdraw{35}});
    EXPECT_NEAR(simulation.inserted(), 14, 1e-9);
    play(exercise, {script::Remove{}});
    EXPECT_EQ(simulation.inserted(), 0);
    EXPECT_NEAR(simulation.inserted(DeviceRole::Catheter), 22.5, 1e-9);
    EXPECT_TRUE(simulation.path_of(DeviceRole::Wire).empty());
    exercise.next_frame(Commands{script::Reset{}});
    EXPECT_EQ(simulation.inserted(), 20);
    EXPECT_EQ(simulation.inserted(DeviceRole::Catheter), 0);
}

/// Three devices: a wire of 0.014 in in a microcatheter in a 5F catheter.
scenario::Scenario with_microcatheter() {
    std::string text = test::small_toml;
    text.replace(text.find("device = \"glide035\""), 19, "device = \"floppy014\"");
    text.replace(text.find("[chain]\ntorsion = \"rigid\""), 25, "[chain]\nsegment_length_mm = 2.0");
    return test::small_scenario(
        text + "[microcatheter]\ndevice = \"micro17\"\n[catheter]\ndevice = \"berenstein5f\"\n");
}

// From the command to the image: the shaft goes black first, from the hub, then the vessel beyond the tip;
// a second after the injection the helper's flush pushes what is left out of it.
TEST(Catheter, FillsWithContrastBeforeTheVesselDoesAndIsFlushed) {
    scenario::Scenario s = with_catheter();
    s.imaging.patient = false;
    s.c_arm.pixels = 256;
    Exercise exercise(s, true);
    play(exercise, {script::Beam{true}, script::Advance{10}});
    play(exercise, {script::Advance{25, DeviceRole::Catheter}});
    play(exercise, {script::Remove{DeviceRole::Wire}});
    const Simulation& simulation = exercise.simulation();
    ASSERT_EQ(simulation.inserted(), 0);
    exercise.next_frame(Commands{});
    const render::Field before = exercise.monitor()->last_signal();
    const geometry::Polyline path = simulation.path_of(DeviceRole::Catheter);
    const Simulation::Tip tip = simulation.tip_of(DeviceRole::Catheter);
    const auto darker = [&](const geometry::Vec3& place) {  // than before, over five by five pixels [-]
        const render::Pixel at = render::project(simulation.console().arm(), place);
        double now = 0, then = 0;
        for (int j = -2; j <= 2; ++j)
            for (int i = -2; i <= 2; ++i) {
                const auto pixel =
                    static_cast<std::size_t>((static_cast<int>(at.y) + j) * 256 + static_cast<int>(at.x) + i);
                now += exercise.monitor()->last_signal().values[pixel];
                then += before.values[pixel];
            }
        return std::log(then / now);
    };
    const geometry::Vec3 shaft = path[path.size() / 2], beyond = tip.at + 4 * tip.along;
    int shaft_dark = -1, vessel_dark = -1;
    double darkest = 0;
    exercise.next_frame(Commands{script::Inject{3, 2, "", 320, DeviceRole::Catheter, false}});
    for (int frame = 0; frame < 30; ++frame) {
        if (shaft_dark < 0 && darker(shaft) > 0.05) shaft_dark = frame;
        darkest = std::max(darkest, darker(shaft));
        if (vessel_dark < 0 && darker(beyond) > 0.1) vessel_dark = frame;
        exercise.next_frame(Commands{});
    }
    EXPECT_GE(shaft_dark, 1);
    EXPECT_GE(vessel_dark, shaft_dark);
    const double left = simulation.contrast().balance().in_lines;
    EXPECT_GT(left, 100);
    for (int frame = 0; frame < 150; ++frame) exercise.next_frame(Commands{});
    EXPECT_LT(simulation.contrast().balance().in_lines, 0.3 * left);
    EXPECT_LT(darker(shaft), 0.75 * darkest);  // a film stays
}

TEST(Catheter, EachOfThreeDevicesMovesByItsOwnCommandsFromATextAndIsShown) {
    scenario::Scenario s = with_microcatheter();
    s.c_arm.pixels = 256;
    s.target.device = DeviceRole::Microcatheter;
    Exercise exercise(s, true);
    const Simulation& simulation = exercise.simulation();
    const auto play_text = [&](const std::string& line) {
        const script::CommandScript script = script::parse_commands("0 " + line + "\n", "x.gw");
        EXPECT_TRUE(simulation.problems(script).empty()) << line;
        return play(exercise, {script.commands.at(0).command});
    };
    play_text("beam on");
    play_text("advance 30 mm");
    play_text("advance microcatheter 34 mm");
    play_text("advance catheter 20 mm");
    EXPECT_NEAR(simulation.inserted(), 50, 1e-9);
    EXPECT_NEAR(simulation.inserted(DeviceRole::Microcatheter), 34, 1e-9);
    EXPECT_NEAR(simulation.inserted(DeviceRole::Catheter), 20, 1e-9);
    play_text("withdraw all 2 mm");
    play_text("rotate microcatheter 30 deg");
    EXPECT_NEAR(simulation.inserted(), 48, 1e-9);
    EXPECT_NEAR(simulation.inserted(DeviceRole::Microcatheter), 32, 1e-9);
    EXPECT_NEAR(simulation.inserted(DeviceRole::Catheter), 18, 1e-9);
    EXPECT_NEAR(simulation.hand(DeviceRole::Microcatheter).turned, M_PI / 6, 1e-9);
    EXPECT_EQ(simulation.hand(DeviceRole::Wire).turned, 0);
    EXPECT_EQ((simulation.tip() - simulation.tip_of(DeviceRole::Microcatheter).at).norm(), 0);
    EXPECT_EQ(exercise.next_frame(Commands{}).motion.denied, "");
    const Truth truth = exercise.truth();
    ASSERT_EQ(truth.devices.size(), 3u);
    std::vector<std::ptrdiff_t> seen;
    for (const render::GrayImage& mask : truth.devices)
        seen.push_back(std::count(mask.pixels.begin(), mask.pixels.end(), 255));
    // A pixel for each that wire and catheter run through, fewer where the tube turns by 40°. Of the
    // microcatheter the ring of platinum alone is seen, of 0.8 mm x 0.57 mm: 2 x 1.7 pixels with a part of a
    // pixel at each border, and more for its slant. The polymer takes less than 2 % of the softest quanta.
    const double per_mm = s.c_arm.pixels * s.c_arm.sid / (s.c_arm.detector_width * s.c_arm.sod),
                 foreshortened = std::cos(40 * M_PI / 180);
    EXPECT_GE(seen[0], 48 * per_mm * foreshortened);
    EXPECT_GE(seen[1], 1);
    EXPECT_LE(seen[1], 6);
    EXPECT_GE(seen[2], 18 * per_mm * foreshortened);
    test::expect_said(run::to_json(truth, {0, 0, 0}), "_microcatheter.png");
    // Contrast comes in where the microcatheter ends, as fast as its lumen with the wire allows.
    EXPECT_LT(simulation.largest_flow(DeviceRole::Microcatheter),
              simulation.largest_flow(DeviceRole::Catheter));
    test::expect_said(play_text("inject 1 ml at 10 ml/s through catheter").denied, "passes");
    play_text("remove wire");
    EXPECT_EQ(simulation.inserted(), 0);
    play_text("inject 0.2 ml at 0.2 ml/s through microcatheter");
    EXPECT_GT(simulation.contrast().injected(), 0);
    play(exercise, {script::Exchange{"standard014"}});
    EXPECT_EQ(simulation.devices()[0].device.name, "standard014");
    // What it has not is refused with its name.
    const auto found = simulation.problems(script::parse_commands("0 advance sheath 5 mm\n", "x.gw"));
    ASSERT_EQ(found.size(), 1u);
    test::expect_said(found[0], "asks for a sheath, and the scenario has none");
    // A copy and a snapshot go on alike.
    Exercise dark(s, false);
    dark.next_frame(Commands{script::Advance{10}, script::Advance{8, DeviceRole::Microcatheter}});
    const Exercise::Snapshot middle = dark.snapshot();
    Exercise copy(dark);
    for (Exercise* each : {&dark, &copy}) each->next_frame(Commands{script::Rotate{1, DeviceRole::Catheter}});
    EXPECT_EQ(dark.simulation().state_hash(), copy.simulation().state_hash());
    const std::uint64_t end = dark.simulation().state_hash();
    dark.restore(middle);
    dark.next_frame(Commands{script::Rotate{1, DeviceRole::Catheter}});
    EXPECT_EQ(dark.simulation().state_hash(), end);
}

TEST(Catheter, AWireIsExchangedWhenItIsOut) {
    Exercise exercise(with_catheter(), false);
    const Simulation& simulation = exercise.simulation();
    play(exercise, {script::Advance{30, DeviceRole::Catheter}});
    StepReport report = play(exercise, {script::Exchange{"amplatzSS035"}});
    test::expect_said(report.denied, "still in");
    EXPECT_EQ(simulation.devices()[0].device.name, "glide035");
    report = play(exercise, {script::Remove{}, script::Exchange{"amplatzSS035"}});
    EXPECT_EQ(report.denied, "");
    ASSERT_EQ(simulation.devices()[0].device.name, "amplatzSS035");
    play(exercise, {script::Advance{40}});
    EXPECT_NEAR(simulation.inserted(), 40, 1e-9);
    EXPECT_EQ(simulation.wire().devices[0].spec.shaft_rigidity(),
              simulation.devices()[0].device.shaft_rigidity());
    exercise.next_frame(Commands{script::Reset{}});
    EXPECT_EQ(simulation.devices()[0].device.name, "glide035");
    EXPECT_EQ(simulation.wire().devices[0].spec.shaft_rigidity(), 250);
}

/// The hub of each shaft is ahead of its tip, segment by segment, and catches up when it is turned back.
TEST(Catheter, ShaftsOfAChainTwistSegmentBySegment) {
    scenario::Scenario s = with_catheter();
    s.torsion = scenario::TorsionModel::Segments;
    Exercise exercise(s, false);
    const Simulation& simulation = exercise.simulation();
    play(exercise, {script::Advance{25}, script::Advance{30, DeviceRole::Catheter}});
    play(exercise, {script::Rotate{1, DeviceRole::Catheter}});
    const auto& devices = simulation.wire().devices;
    for (const physics::Device& device : devices)
        ASSERT_EQ(device.wound.size(), simulation.wire().joints.size());
    EXPECT_GT(devices[1].wound_up(), 1e-4);
    EXPECT_LT(devices[1].wound_up(), 1);
    EXPECT_GT(simulation.hand(DeviceRole::Catheter).load.torque, 0);
    const double before = devices[1].wound_up();
    play(exercise, {script::Rotate{-1, DeviceRole::Catheter}});
    EXPECT_LT(devices[1].wound_up(), before);
    play(exercise, {script::Remove{}, script::Exchange{"amplatzSS035"}, script::Advance{40}});
    EXPECT_EQ(devices[0].wound.size(), simulation.wire().joints.size());
    EXPECT_TRUE(simulation.readings().at_rest);
}

TEST(Catheter, WhatCannotBeIsRefusedAtLoad) {
    const auto refused = [](const std::string& section) {
        return test::refusal([&] { test::small_scenario(test::small_toml + section); });
    };
    test::expect_said(refused("[catheter]\ndevice = \"cobra\"\n"), "catheters are: ");
    test::expect_said(refused("[catheter]\ndevice = \"rosen035\"\n"), "a wire");
    test::expect_said(refused("[catheter]\n"), "device");
    test::expect_said(refused("[catheter]\ndevice = \"cobra5f\"\ninner_diameter_mm = 0.8\n"),
                      "does not fit a catheter's lumen of 0.8 mm");
    test::expect_said(refused("[catheter]\ndevice = \"cobra5f\"\nouter_diameter_mm = 10.1\n"),
                      "outer_diameter_mm = 10.1");
    test::expect_said(refused("[catheter]\ndevice = \"cobra5f\"\ninserted_mm = 900\n"), "cannot be in");
    test::expect_said(refused("[catheter]\ndevice = \"cobra5f\"\nlength_mm = nan\n"), "length_mm");

    test::expect_refusal([] { Simulation(with_catheter("inserted_mm = 200\n")); }, "cannot start inside");
    const Simulation alone(test::small_scenario());
    const Simulation simulation(with_catheter());
    const auto said = [](const Simulation& s, const std::string& text) {
        const auto found = s.problems(script::parse_commands(text, "x.gw"));
        return found.empty() ? std::string() : found.front();
    };
    test::expect_said(said(alone, "0 advance catheter 5 mm\n"), "has none");
    test::expect_said(said(alone, "0 inject 5 ml at 1 ml/s through catheter\n"), "has none");
    test::expect_said(said(simulation, "0 exchange wire rosen035\n"), "still in");
    test::expect_said(said(simulation, "0 remove wire\n1 exchange wire rosen36\n"),
                      "found 'rosen36' (did you mean 'rosen035'?); wires are: ");
    test::expect_said(said(simulation, "0 remove wire\n1 exchange wire cobra5f\n"), "is a catheter");
    EXPECT_EQ(said(simulation, "0 remove wire\n1 exchange wire rosen035\n"), "");
    test::expect_said(said(simulation, "0 inject 5 ml at 40 ml/s through catheter\n"), "ml/s at most");
    EXPECT_THROW(Simulation(test::small_scenario()).apply(script::Remove{}), io::InputError);
    test::expect_refusal([] { script::parse_commands("0 remove both\n", "x.gw"); }, "expected one of: wire");
    test::expect_refusal([] { script::parse_commands("0 advance cath 5 mm\n", "x.gw"); }, "number");
}

TEST(Catheter, ContrastComesInWhereItsTipIsAsFastAsItsLumenAllows) {
    Exercise exercise(with_catheter(), false);
    const Simulation& simulation = exercise.simulation();
    StepReport report = play(exercise, {script::Inject{2, 1, "", 320}});
    test::expect_said(report.denied, "not inside");
    play(exercise, {script::Advance{40}});
    play(exercise, {script::Advance{40, DeviceRole::Catheter}});
    report = play(exercise, {script::Inject{2, 3, "", 320}});
    test::expect_said(report.denied, "ml/s");
    EXPECT_EQ(simulation.contrast().injected(), 0);
    play(exercise, {script::Remove{}});
    exercise.next_frame(Commands{script::Inject{2, 3, "", 320}});
    for (int frame = 0; frame < 5; ++frame) exercise.next_frame(Commands{});
    EXPECT_GT(simulation.contrast().injected(), 0);
    // The cell with the most of it lies at the tip.
    const auto iodine = simulation.contrast().iodine();
    const auto most = std::max_element(iodine.begin(), iodine.end()) - iodine.begin();
    EXPECT_LT((simulation.contrast().nodes()[most] - simulation.tip_of(DeviceRole::Catheter).at).norm(), 10);
}

TEST(Catheter, ContrastThroughTheIntroducerComesInWhereTheDevicesDo) {
    Exercise exercise(test::small_scenario(), false);  // a wire alone
    const Simulation& simulation = exercise.simulation();
    const script::CommandScript script =
        script::parse_commands("0 inject 4 ml at 8 ml/s through introducer\n", "x.gw");
    EXPECT_TRUE(simulation.problems(script).empty());
    exercise.next_frame(std::vector<script::Command>{script.commands[0].command});
    exercise.next_frame(Commands{});
    EXPECT_GT(simulation.contrast().injected(), 0.5);
    EXPECT_NEAR(simulation.contrast().time_left(), 0.5 - 2 / simulation.scenario().frame_rate, 1e-9);
    // Blood carries it on from there.
    const auto nodes = simulation.contrast().nodes();
    const geometry::Vec3 entry = simulation.wire().joints[0];
    const auto first = std::min_element(nodes.begin(), nodes.end(), [&](const auto& a, const auto& b) {
        return (a - entry).norm() < (b - entry).norm();
    });
    EXPECT_GT(simulation.contrast().iodine()[static_cast<std::size_t>(first - nodes.begin())], 50);
}

TEST(Catheter, ItsLumenPassesWhatPoiseuilleAndBlasiusAllow) {
    physics::DeviceSpec catheter;
    catheter.inner_diameter = 1.1;
    catheter.length = 650;
    const double open = largest_flow(catheter, 0.889, 0);
    EXPECT_GT(open, 15);  // 5F flush catheters are rated for 15 to 25 ml/s
    EXPECT_LT(open, 30);
    // All of it filled by a 0.035 in wire: the annulus of closed form.
    const double R = 0.55e-3, r = 0.4445e-3, square = R * R - r * r;
    const double annulus = std::pow(R, 4) - std::pow(r, 4) - square * square / std::log(R / r);
    EXPECT_NEAR(largest_flow(catheter, 0.889, 650), 1e6 * M_PI * 8.27e6 * annulus / (8 * 6e-3 * 0.65), 1e-6);
    EXPECT_EQ(largest_flow(catheter, 1.1, 10), 0);
    EXPECT_GT(largest_flow(catheter, 0.889, 100), largest_flow(catheter, 0.889, 300));
}

TEST(Catheter, WhatHandsDidReplaysFromASnapshotAndFromText) {
    std::mt19937 random(5);
    Exercise first(with_catheter("friction = 0.1\n"), false);
    const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
    std::string text;
    for (int k = 0; k < 120; ++k) {
        Commands commands;
        const DeviceRole held =
            std::array{DeviceRole::Wire, DeviceRole::Catheter, DeviceRole::All}[random() % 3];
        if (random() % 2) commands.emplace_back(script::Advance{4 * unit(), held});
        if (random() % 3 == 0) commands.emplace_back(script::Withdraw{4 * unit(), held});
        if (random() % 3 == 0) commands.emplace_back(script::Rotate{2 * unit() - 1, held});
        if (k == 60) commands = {script::Remove{}, script::Exchange{"rosen035"}, script::Advance{30}};
        if (k % 17 == 0) commands.emplace_back(script::Inject{0.5, 0.3, "", 320});
        for (const script::Command& command : commands)
            text += std::to_string(k) + " " + script::to_text(command) + "\n";
        first.next_frame(commands);
        ASSERT_TRUE(physics::validate(first.simulation().wire()).empty()) << k;
    }
    const script::CommandScript script = script::parse_commands(text, "x.gw");
    Exercise second(with_catheter("friction = 0.1\n"), false);
    std::optional<Exercise::Snapshot> middle;
    for (int k = 0; k < 120; ++k) {
        if (k == 75) middle = second.snapshot();
        second.next_frame(test::commands_of(script, k));
    }
    EXPECT_EQ(first.simulation().state_hash(), second.simulation().state_hash());
    Exercise third(with_catheter("friction = 0.1\n"), false);
    third.restore(*middle);
    for (int k = 75; k < 120; ++k) third.next_frame(test::commands_of(script, k));
    EXPECT_EQ(first.simulation().state_hash(), third.simulation().state_hash());
}

TEST(Catheter, TraceHasARowForEachDevice) {
    Exercise exercise(with_catheter(), false);
    Trace trace(exercise.simulation());
    exercise.next_frame(Commands{script::Advance{20}});
    const Frame frame = exercise.next_frame(Commands{script::Advance{5, DeviceRole::Catheter}});
    const std::string rows = trace.rows(frame, exercise.score());
    EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 2);
    test::expect_said(rows, ",wire,40");
    test::expect_said(rows, ",catheter,5,0,");
    const std::string header = Trace::header();
    const auto commas = [](const std::string& line) { return std::count(line.begin(), line.end(), ','); };
    EXPECT_EQ(commas(rows), 2 * commas(header));
}

TEST(Catheter, ImageAndTruthShowBothAndTheWireInIt) {
    std::string more = "inserted_mm = 0\n";
    scenario::Scenario s = with_catheter(more);
    s.c_arm.pixels = 256;
    Exercise exercise(s, true);
    exercise.next_frame(Commands{script::Beam{true}, script::Advance{40}});
    exercise.next_frame(Commands{script::Advance{30, DeviceRole::Catheter}});
    for (int k = 0; k < 10; ++k) exercise.next_frame(Commands{});
    const Truth truth = exercise.truth();
    ASSERT_EQ(truth.devices.size(), 2u);
    const render::GrayImage &wires = truth.devices[0], &catheters = truth.devices[1];
    const auto count = [](const render::GrayImage& mask) {
        return std::count(mask.pixels.begin(), mask.pixels.end(), 255);
    };
    EXPECT_GT(count(wires), 50);
    EXPECT_GT(count(catheters), 50);
    int both = 0;
    for (std::size_t i = 0; i < wires.pixels.size(); ++i)
        both += wires.pixels[i] != 0 && catheters.pixels[i] != 0;
    EXPECT_GT(both, 30);  // the wire inside the catheter
    const std::string json = run::to_json(truth, {0, 0, 0});
    test::expect_said(json, "\"catheter_px\"");
    test::expect_said(json, "_catheter.png");
    // Fewer quanta pass where the wire lies in the catheter than beside it in the catheter alone.
    render::Fluoroscope& scope = exercise.monitor()->fluoroscope();
    const Pulse& pulse = truth.pulse;
    const render::Field with = scope.expected_quanta(pulse.arm, pulse.seen(), pulse.exposure);
    render::SeenDevices alone = pulse.seen();
    alone.all.erase(alone.all.begin());
    const render::Field without = scope.expected_quanta(pulse.arm, alone, pulse.exposure);
    const render::Field none = scope.expected_quanta(pulse.arm, {}, pulse.exposure);
    double wire = 0, catheter = 0;
    int darker = 0;
    for (std::size_t i = 0; i < with.values.size(); ++i) {
        if (wires.pixels[i] == 0 || catheters.pixels[i] == 0) continue;
        wire += without.values[i] - with.values[i];
        catheter += none.values[i] - without.values[i];
        darker += with.values[i] < without.values[i];
    }
    EXPECT_EQ(darker, both);
    EXPECT_GT(wire, 0);
    EXPECT_GT(catheter, 0);
    // Out of it: the wire's mask is empty, and the file is still written.
    for (int k = 0; k < 30; ++k) exercise.next_frame(k == 0 ? Commands{script::Remove{}} : Commands{});
    const Truth after = exercise.truth();
    EXPECT_EQ(count(after.devices[0]), 0);
    EXPECT_EQ(run::to_json(after, {0, 0, 0}).find("tip_px"), std::string::npos);
}

}  // namespace
}  // namespace exercise
