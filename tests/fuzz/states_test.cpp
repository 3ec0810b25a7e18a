/// A few of the random cases of `tests/fuzz/run.sh states`; SELDINGER_FUZZ_SEEDS=N plays N.

#include "tests/fuzz/states.h"

#include <cstdlib>
#include <gtest/gtest.h>

namespace fuzz {

TEST(StateFuzz, WhatMustHoldHoldsAfterEveryFrame) {
    const char* more = std::getenv("SELDINGER_FUZZ_SEEDS");
    const int cases = more ? std::max(1, std::atoi(more)) : 40;
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

TEST(StateFuzz, ACaseIsTheSameWheneverItIsDrawn) {
    const StateCase one = random_case(7, 30), two = random_case(7, 30);
    EXPECT_EQ(one.scenario, two.scenario);
    EXPECT_EQ(one.script, two.script);
    EXPECT_NE(one.scenario, random_case(8, 30).scenario);
}

}  // namespace fuzz
