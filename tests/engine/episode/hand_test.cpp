/// What the hand feels is one number, wherever it is shown: panel, trace, State, the line of `serve`, and
/// that by which a shaft bows.

#include <gtest/gtest.h>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>

#include "engine/episode/episode.h"
#include "engine/exercise/device_rules.h"
#include "engine/exercise/observation.h"
#include "engine/exercise/room_readout.h"
#include "engine/script/command.h"
#include "physics/wire/energy.h"
#include "physics/wire/feed.h"
#include "tests/anatomies.h"
#include "tests/cases.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/fixtures.h"

namespace episode {
namespace {

using Commands = std::vector<script::Command>;
using Row = std::map<std::string, std::string>;

/// The rows of a frame by their columns.
std::vector<Row> rows_of(const std::string& text) {
    const auto words = [](const std::string& line) {
        std::vector<std::string> found(1);
        for (const char c : line)
            if (c == ',')
                found.emplace_back();
            else
                found.back() += c;
        return found;
    };
    std::vector<Row> rows;
    std::string header = exercise::Trace::header();
    header.pop_back();
    const std::vector<std::string> names = words(header);
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const std::vector<std::string> cells = words(line);
        EXPECT_EQ(cells.size(), names.size());
        Row row;
        for (std::size_t k = 0; k < std::min(names.size(), cells.size()); ++k) row[names[k]] = cells[k];
        rows.push_back(row);
    }
    return rows;
}

/// An exercise and an episode of one scenario, at their start.
struct Start {
    explicit Start(const scenario::Scenario& scenario)
        : exercise(scenario, exercise::Pictures::None, test::cache()),
          episode(scenario, exercise::Pictures::None, test::cache()) {}
    exercise::Exercise exercise;
    Episode episode;
};

/// Plays a course in an exercise with the room's readout and a trace, and in an episode. Returns the largest
/// push shown.
double play(const Start& start, const std::vector<Commands>& course, const std::string& which) {
    exercise::Exercise exercise(start.exercise);
    Episode episode(start.episode);
    exercise::RoomReadout room;
    const exercise::Trace trace(exercise.simulation());
    double largest = 0;
    int frame = 0;
    for (const Commands& commands : course) {
        SCOPED_TRACE(which + ", frame " + std::to_string(frame++));
        const exercise::Frame made = exercise.next_frame(commands);
        room.observe(made, exercise.score());
        episode.step(commands);
        EXPECT_EQ(exercise.simulation().state_hash(), episode.hash());
        const render::Readout panel = room.read(made, exercise.score());
        const Observation state = episode.reading();
        const auto line = nlohmann::json::parse(to_json(episode));
        const std::vector<Row> rows = rows_of(trace.rows(made, exercise.score()));
        const auto devices = exercise.simulation().devices();
        EXPECT_EQ(rows.size(), devices.size());
        EXPECT_EQ(panel.devices.size(), devices.size());
        if (testing::Test::HasFailure()) break;
        // Texts of numbers read back to the same bits.
        const auto cell = [&](int device, const char* name) { return std::stod(rows.at(device).at(name)); };
        for (std::size_t k = 0; k < devices.size(); ++k) {
            const render::Readout::Device& shown = panel.devices[k];
            const std::string prefix = k == 0 ? "" : std::string(devices[k].name()) + "_";
            const auto json = [&](const char* name) { return line[prefix + name].get<double>(); };
            const int row = static_cast<int>(k);
            EXPECT_EQ(*shown.push_force, state.push.of[k]);
            EXPECT_EQ(*shown.push_force, cell(row, "push_N"));
            EXPECT_EQ(*shown.push_force, json("push_N"));
            EXPECT_EQ(*shown.torque, state.torque.of[k]);
            EXPECT_EQ(*shown.torque, cell(row, "torque_N_mm"));
            EXPECT_EQ(*shown.torque, json("torque_Nmm"));
            EXPECT_EQ(*shown.hub_twist / geometry::degree, state.turned.of[k]);
            EXPECT_EQ(state.turned.of[k], cell(row, "turned_deg"));
            EXPECT_EQ(state.turned.of[k], json("turned_deg"));
            EXPECT_EQ(*shown.inserted, state.inserted.of[k]);
            EXPECT_EQ(state.inserted.of[k], json("inserted_mm"));
        }
        largest = std::max(largest, std::abs(*panel.devices[0].push_force));
        if (testing::Test::HasFailure()) break;
    }
    return largest;
}

std::vector<Commands> by_frame(const script::CommandScript& script, int frames) {
    std::vector<Commands> course(static_cast<std::size_t>(frames));
    for (int k = 0; k < frames; ++k) course[static_cast<std::size_t>(k)] = test::commands_of(script, k);
    return course;
}

TEST(Hand, FeelsTheSameInPanelTraceStateAndLineInEveryFrameOfTheDemo) {
    const script::CommandScript script = script::load_commands(test::asset("scripts/renal.gw"));
    play(Start(test::shipped_scenario("renal")), by_frame(script, 226), "renal");
}

TEST(Hand, IsShownNoForceOfAWireInTheMiddleOfASnap) {
    // Fast pushes and turns of a rough wire whose shaft winds up: frames end on the way to rest.
    const char* course =
        "0 advance 19.685 mm\n0 rotate -35.73 deg\n1 advance 29.222 mm\n1 rotate 200.73 deg\n"
        "2 advance 21.276 mm\n2 rotate -241.80 deg\n3 advance 0.838 mm\n3 rotate -290.88 deg\n"
        "4 advance 17.855 mm\n4 rotate 28.30 deg\n5 advance 14.876 mm\n6 advance 18.037 mm\n"
        "7 advance 23.850 mm\n8 advance 19.625 mm\n9 advance 9.798 mm\n9 rotate 103.72 deg\n"
        "10 advance 13.553 mm\n12 advance 10.356 mm\n12 rotate 213.83 deg\n13 advance 9.471 mm\n"
        "13 rotate 283.39 deg\n14 advance 19.462 mm\n15 advance 22.553 mm\n15 rotate -179.83 deg\n"
        "16 advance 12.641 mm\n16 rotate -309.06 deg\n17 advance 6.165 mm\n18 advance 0.548 mm\n"
        "19 advance 14.299 mm\n20 advance 10.317 mm\n22 withdraw 8.394 mm\n23 advance 0.899 mm\n"
        "24 advance 0.259 mm\n25 withdraw 11.471 mm\n26 advance 7.024 mm\n27 advance 5.334 mm\n"
        "28 advance 12.401 mm\n28 rotate 126.51 deg\n29 advance 10.404 mm\n30 advance 14.572 mm\n"
        "31 advance 19.362 mm\n31 rotate 105.99 deg\n32 advance 18.089 mm\n32 rotate -241.19 deg\n"
        "33 advance 28.555 mm\n34 withdraw 14.464 mm\n34 rotate -236.06 deg\n35 advance 12.769 mm\n"
        "35 rotate 352.72 deg\n";
    const double largest =
        play(Start(test::shipped_scenario(
                 "renal", {{"guidewire.friction", "0.1"}, {"guidewire.torsional_rigidity_N_mm2", "188"}})),
             by_frame(script::parse_commands(course, "panel_push.gw"), 40), "panel_push");
    EXPECT_LT(largest, 5);  // [N]; at rest 0.7 N at most
    // What is shown in the middle of a snap is felt by the wire that is shown, which is at rest.
    exercise::Simulation simulation(
        test::shipped_scenario(
            "renal", {{"guidewire.friction", "0.1"}, {"guidewire.torsional_rigidity_N_mm2", "188"}}),
        test::cache());
    const script::CommandScript script = script::parse_commands(course, "panel_push.gw");
    int settling = 0;
    for (int frame = 0; frame < 40; ++frame) {
        for (const script::Command& command : test::commands_of(script, frame)) simulation.apply(command);
        if (!simulation.step().settling) continue;
        ++settling;
        const auto loads = physics::hub_loads(simulation.wire(),
                                              physics::all_contacts(simulation.wire(), simulation.wall()));
        EXPECT_NEAR(simulation.readings().hands[0].load.push, loads[0].push, 1e-6) << frame;
    }
    EXPECT_GT(settling, 0);
}

TEST(Hand, FeelsTheSameInRandomCourses) {
    const auto with = [](const char* more, const char* section) {
        return test::small_scenario(
            test::small_toml_with("frictionless = true\nbuckling_force_N = 0\n[chain]\ntorsion = \"rigid\"",
                                  std::string(more) + "buckling_force_N = 0\n[chain]") +
            section);
    };
    std::vector<Start> starts = {
        Start(with("frictionless = true\ntorsional_rigidity_N_mm2 = 0\n", "")),
        Start(with("friction = 0.2\ntorsional_rigidity_N_mm2 = 0\n", "")),
        Start(with("friction = 0.1\ntorsional_rigidity_N_mm2 = 120\n", "")),
        Start(with("frictionless = true\n", "[catheter]\ndevice = \"berenstein5f\"\n")),
        Start(with("diameter_mm = 0.356\n",
                   "[microcatheter]\ndevice = \"berenstein4f\"\nouter_diameter_mm = 0.9\ninner_diameter_mm = "
                   "0.5\n[catheter]\ndevice = \"berenstein5f\"\n"))};
    const char* const names[] = {"smooth", "rough", "winding", "catheter", "microcatheter"};
    for (int seed = 0; seed < test::cases(1000); ++seed) {
        std::mt19937 random(static_cast<unsigned>(seed));
        const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
        const Start& start = starts[static_cast<std::size_t>(seed) % starts.size()];
        std::vector<Commands> course(5);
        for (Commands& commands : course) {
            const auto devices = start.episode.simulation().devices();
            const std::size_t which = random() % (devices.size() + (devices.size() > 1));
            const script::DeviceRole held =
                which < devices.size() ? devices[which].role : script::DeviceRole::All;
            if (random() % 4 != 0) commands.emplace_back(script::Advance{12 * unit(), held});
            if (random() % 4 == 0) commands.emplace_back(script::Withdraw{8 * unit(), held});
            if (random() % 3 == 0) commands.emplace_back(script::Rotate{8 * (unit() - 0.5), held});
            if (random() % 40 == 0) commands.emplace_back(script::Reset{});
        }
        play(start, course, std::string(names[seed % starts.size()]) + ", seed " + std::to_string(seed));
        ASSERT_FALSE(HasFailure());
    }
}

TEST(Hand, FieldsHaveNamesOfTheirOwn) {
    std::set<std::string_view> names, columns;
    for (const exercise::Field& field : exercise::fields()) {
        EXPECT_TRUE(field.name.empty() || names.insert(field.name).second) << field.name;
        EXPECT_TRUE(field.column.empty() || columns.insert(field.column).second) << field.column;
        EXPECT_FALSE(field.name.empty() && field.column.empty());
        EXPECT_FALSE(field.doc.empty()) << field.name << field.column;
    }
}

}  // namespace
}  // namespace episode
