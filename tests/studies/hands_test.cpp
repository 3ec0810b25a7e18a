/// Hands at the speeds of the room's keys in all scenarios that ship, and hands that once got stuck.

#include <algorithm>
#include <cstdlib>
#include <gtest/gtest.h>
#include <random>

#include "engine/io/files.h"
#include "physics/wire/energy.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"
#include "tests/fuzz/states.h"

namespace fuzz {

/// SELDINGER_HAND_COURSES=N plays N courses; state_fuzz hands N does so outside the tests.
TEST(StateFuzz, AHandAtTheSpeedOfKeysIsNeverStuck) {
    const char* more = std::getenv("SELDINGER_HAND_COURSES");
    const int courses = more ? std::max(1, std::atoi(more)) : 21;
    EXPECT_EQ(play_hands(courses, 1,
                         [](const std::string&, int, const std::string& broken) { EXPECT_EQ(broken, ""); }),
              0);
}

/// Courses of hands that once held a device fast or took frames of three times their budget.
TEST(StateFuzz, HandsThatOnceGotStuckGoOnWithinEveryFramesBudget) {
    struct Found {
        const char *scenario, *script;
        int frames, longest_settling;
        double brought_back;
    };
    // In the first, hands far faster than keys queue up 38 cm: frames may settle for long.
    for (const Found& found : {Found{"crossover", "crossover_out_seed4", 125, 125, 0},
                               Found{"coronary_lad", "lad_frozen", 86, 15, 0.9 * 32}}) {
        const std::string assets = SELDINGER_SOURCE "/assets/";
        exercise::Simulation simulation(test::shipped_scenario(found.scenario), test::cache());
        const std::string file =
            std::string(SELDINGER_SOURCE "/tests/fuzz/found/hands/") + found.script + ".gw";
        const script::CommandScript script =
            script::parse_commands(io::read_text(file, "script", "a file"), file);
        int settling = 0, longest = 0;
        double deepest = 0, fed = 0;  // by the hand: inside, or in the bow outside
        for (int frame = 0; frame < found.frames; ++frame) {
            for (const script::TimedCommand& timed : script.at(frame)) simulation.apply(timed.command);
            const exercise::StepReport report = simulation.step();
            ASSERT_LE(report.relax.updates, simulation.scenario().budget.updates)
                << found.scenario << ", frame " << frame;
            settling = report.settling ? settling + 1 : 0;
            longest = std::max(longest, settling);
            fed = simulation.inserted() + simulation.hand(script::DeviceRole::Wire).bow;
            deepest = std::max(deepest, fed);
            const auto& hands = simulation.readings().hands;
            for (std::size_t k = 0; k < hands.size(); ++k)
                // A pull of another device, which nothing refuses, may add a little.
                EXPECT_LE(hands[k].load.push, 1.1 * simulation.passes_on(static_cast<int>(k)))
                    << found.scenario << ", frame " << frame << ", device " << k;
        }
        EXPECT_LE(longest, found.longest_settling) << found.scenario;
        EXPECT_GE(deepest - fed, found.brought_back) << found.scenario;
    }
}

/// Hands far faster than keys, and the least budget, with which frames end on the way to rest.
TEST(StateFuzz, NoFrameTakesMoreUpdatesThanItsBudget) {
    constexpr int least = 16;  // for each segment
    for (const char* name : {"crossover", "coronary_lad", "renal"}) {
        scenario::Scenario scenario = test::shipped_scenario(name);
        const int segments = exercise::Simulation(scenario, test::cache()).wire().segments();
        scenario.budget.updates = least * (segments + 50);
        exercise::Simulation simulation(scenario, test::cache());
        std::mt19937 random(7);
        int settling = 0;
        for (int frame = 0; frame < 60; ++frame) {
            simulation.apply(script::Advance{1e-8 * static_cast<double>(random() % 1'000'000'000)});
            simulation.apply(script::Rotate{1e-8 * static_cast<double>(random() % 400'000'000) - 2});
            const exercise::StepReport report = simulation.step();
            settling += report.settling;
            if (least * simulation.wire().segments() > scenario.budget.updates) break;
            ASSERT_LE(report.relax.updates, scenario.budget.updates) << name << ", frame " << frame;
        }
        EXPECT_GT(settling, 0) << name;  // or the budget limits nothing
    }
}

}  // namespace fuzz
