/// A few of the random cases of state_fuzz; SELDINGER_FUZZ_SEEDS=N plays N. And those that it once found.

#include "tests/fuzz/states.h"

#include <algorithm>
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
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() == ".toml") files.push_back(entry.path());
    ASSERT_FALSE(files.empty());
    std::ranges::sort(files);
    files.resize(static_cast<std::size_t>(test::cases(static_cast<int>(files.size()))));
    for (const std::filesystem::path& file : files) {
        std::filesystem::path script = file;
        script.replace_extension(".gw");
        StateCase found{1, io::read_text(file, "scenario", "a file"),
                        io::read_text(script, "script", "a file"), 300};
        const StateOutcome outcome = play(found);
        EXPECT_EQ(outcome.broken + outcome.refused, "") << file;
    }
}

TEST(StateFuzz, ACaseIsTheSameWheneverItIsDrawn) {
    const StateCase one = random_case(7, 30), two = random_case(7, 30);
    EXPECT_EQ(one.scenario, two.scenario);
    EXPECT_EQ(one.script, two.script);
    EXPECT_NE(one.scenario, random_case(8, 30).scenario);
}

}  // namespace fuzz
