/// The quick study of random tubes and wild hands: nothing happens that should not, on any number of threads.

#include <algorithm>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "engine/scenario/scenario.h"
#include "engine/studies/plain_wire.h"
#include "engine/studies/runs.h"
#include "engine/studies/wild_hands.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"
#include "tests/studies/quick_study.h"

namespace {

using io::Table;
using studies::StudyResult;

StudyResult quick(int threads) {
    studies::StudyOptions options = test::quick_study(threads);
    options.scenarios = SELDINGER_SOURCE "/assets/scenarios";
    options.devices = SELDINGER_SOURCE "/assets/devices";
    options.cache = test::cache();
    return studies::run_robustness(options);
}

double total(const Table& table, const std::string& name) {
    return table.number(table.rows.size() - 1, name);
}

}  // namespace

TEST(Robustness, EveryShippedScenarioMeetsWildHands) {
    studies::StudyOptions options;
    options.scenarios = SELDINGER_SOURCE "/assets/scenarios";
    options.devices = SELDINGER_SOURCE "/assets/devices";
    EXPECT_EQ(studies::wild_scenarios(options).size(), scenario::shipped_scenarios(options.scenarios).size());
}

TEST(Robustness, QuickStudyFindsNothingAndDoesNotDependOnThreads) {
    const StudyResult one = quick(1), two = quick(2);
    const Table &tubes = one.tables.at(0), &hands = one.tables.at(1), &incidents = one.tables.at(2);
    EXPECT_EQ(total(tubes, "pushes"), 300.0);
    EXPECT_EQ(total(hands, "frames"), 150.0);
    ASSERT_EQ(hands.rows.size(), 3u);  // renal, s_bend, all
    for (const char* none : {"unconverged", "gradient_above_limit", "folds", "deep", "refused", "over_work"})
        EXPECT_EQ(total(tubes, none), 0.0) << none;
    for (const char* none : {"not_at_rest", "folds", "beyond_force"})
        EXPECT_EQ(total(hands, none), 0.0) << none;
    for (const studies::Claim& claim : one.claims) {
        // The claim is 5 % of many frames; of these 75, up to 6.
        const double* measured = std::get_if<double>(&claim.measured);
        const bool few = claim.text.ends_with("earlier rest [%]") && measured && *measured <= 8;
        EXPECT_TRUE(claim.holds || few || claim.kind == studies::ClaimKind::Machine)
            << claim.text << '\n'
            << io::to_markdown(incidents);
    }
    for (std::size_t t = 0; t < 2; ++t) {
        ASSERT_EQ(two.tables[t].rows.size(), one.tables[t].rows.size());
        for (std::size_t r = 0; r < one.tables[t].rows.size(); ++r)
            for (std::size_t k = 1; k < one.tables[t].columns.size(); ++k) {
                const std::string& name = one.tables[t].columns[k];
                if (name.ends_with("_ms")) continue;
                const auto &a = one.tables[t].rows[r][k], &b = two.tables[t].rows[r][k];
                const bool none = a != a && b != b;
                EXPECT_TRUE(none || a == b) << name << ", row " << r;
            }
    }
}

/// Frames in which joints left a side branch so far in one motion that their stations stayed behind, or came
/// to rest at the border of two vessels.
TEST(Robustness, WiresThatLeaveASideBranchRestWhenAllContactsAreAskedAnew) {
    struct Course {
        const char* scenario;
        std::uint32_t hand;
        int frames;
    };
    for (const Course& course :
         {Course{"coronary_lad", 2, 37}, Course{"coronary_lad", 3, 18}, Course{"coronary", 3, 65}}) {
        exercise::Simulation simulation(test::shipped_scenario(course.scenario), test::cache());
        const studies::WildJudge judge(simulation);
        const studies::WildTally tally = studies::play_wildly(simulation, judge, course.hand, course.frames);
        EXPECT_EQ(tally.restless, 0) << course.scenario << ", hand " << course.hand << ": |g|/C up to "
                                     << tally.gradient;
        EXPECT_GT(tally.frames - tally.settling, course.frames / 2);
    }
}

TEST(Robustness, ARandomTubeIsItsSeed) {
    const studies::RandomTube a = studies::random_tube(7), b = studies::random_tube(7),
                              c = studies::random_tube(8);
    EXPECT_EQ(a.centreline, b.centreline);
    EXPECT_NE(a.radius, c.radius);
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        const studies::RandomTube tube = studies::random_tube(seed);
        EXPECT_TRUE(tube.radius >= 1 && tube.radius <= 6) << seed;
        EXPECT_TRUE(tube.segments >= 50 && tube.segments <= 400) << seed;
        double length = 0;
        for (std::size_t i = 1; i < tube.centreline.size(); ++i)
            length += (tube.centreline[i] - tube.centreline[i - 1]).norm();
        EXPECT_GT(length, tube.segments * tube.segment_length) << seed;
    }
}

TEST(Robustness, TheRawLumenKnowsInsideAndHowFarOutside) {
    const anatomy::Anatomy tube = anatomy::tube_anatomy(
        "tube", anatomy::draw(std::vector<anatomy::PenMove>{anatomy::Run{40}}), 2, 96, 0.5);
    const studies::RawLumen lumen(tube);
    EXPECT_NEAR(lumen.outside_by({20, 2.5, 0}, 1), 0.5, 0.005);
    EXPECT_NEAR(lumen.outside_by({20, 1.5, 0}, 1), -0.5, 0.005);
    // Past its ends it narrows over 14 radii and is closed.
    for (const double past : {0.1, 0.9, 5.0, 20.0, 28.0}) {
        EXPECT_LT(lumen.outside_by({40 + past, 0, 0}, 1), 0) << past;
        EXPECT_LT(lumen.outside_by({-past, 0.1, 0}, 1), 0) << past;
        EXPECT_GT(lumen.outside_by({40 + past, 2.1, 0}, 1), 0) << past;
    }
    EXPECT_GT(lumen.outside_by({40 + 30, 0, 0}, 1), 0);
}
