/// A few of the random cases of state_fuzz; SELDINGER_FUZZ_SEEDS=N plays N. And those that it once found.

#include "tests/fuzz/states.h"

#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>

#include "engine/io/files.h"
#include "tests/cases.h"

namespace fuzz {

TEST(StateFuzz, WhatMustHoldHoldsAfterEveryFrame) {
    const char* more = std::getenv("SELDINGER_FUZZ_SEEDS");
    const int cases = more ? std::max(1, std::atoi(more)) : test::cases(24);
    int refused = 0, frames = 0;
    for (int seed = 1; seed <= cases; ++seed) {
        const StateOutcome outcome = play(random_case(static_cast<std::uint32_t>(seed), 40));
        EXPECT_EQ(outcome.broken, "") << "seed " << seed;
        refused += !outcome.refused.empty();
        frames += outcome.frames;
    }
    EXPECT_LT(refused, cases / 2);  // or most would not be tried
    RecordProperty("frames", frames);
}

TEST(StateFuzz, WhatOnceBrokeHolds) {
    const std::filesystem::path folder = SELDINGER_SOURCE "/tests/fuzz/found/states";
    int cases = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().extension() != ".toml") continue;
        std::filesystem::path script = entry.path();
        script.replace_extension(".gw");
        StateCase found{1, io::read_text(entry.path(), "scenario", "a file"),
                        io::read_text(script, "script", "a file"), 300};
        const StateOutcome outcome = play(found);
        EXPECT_EQ(outcome.broken + outcome.refused, "") << entry.path();
        ++cases;
    }
    EXPECT_GT(cases, 0);
}

TEST(StateFuzz, ACaseIsTheSameWheneverItIsDrawn) {
    const StateCase one = random_case(7, 30), two = random_case(7, 30);
    EXPECT_EQ(one.scenario, two.scenario);
    EXPECT_EQ(one.script, two.script);
    EXPECT_NE(one.scenario, random_case(8, 30).scenario);
}

}  // namespace fuzz
