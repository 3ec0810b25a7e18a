#include "engine/scenario/benchmark.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/io/error.h"
#include "tests/engine/fixtures.h"

namespace scenario {
namespace {

std::string refusal(const std::string& toml) {
    try {
        parse_benchmarks(toml, "benchmark.toml");
    } catch (const io::InputError& error) {
        return error.what();
    }
    return "";
}

}  // namespace

TEST(Benchmark, WhatIsWrittenIsReadBackToTheBit) {
    for (unsigned seed = 1; seed <= 1000; ++seed) {
        std::mt19937_64 random(seed);
        Benchmarks all;
        for (unsigned k = random() % 4; k > 0; --k) {
            const std::string names[] = {"renal", "a b", "quo\"te", "", "x.y", "schem", "[z]", "ä\n"};
            Benchmark& made = all[names[random() % 8]];
            made = {};
            made.by = "by " + names[random() % 8];
            made.attempts = 1 + static_cast<int>(random() % 5);
            made.scenario = random() % 2 ? random() : 0;
            for (const BenchmarkFigure& figure : benchmark_figures())
                if (random() % 3)
                    for (int i = 0; i < made.attempts; ++i)
                        (made.*figure.sample)
                            .values.push_back(std::ldexp(static_cast<double>(random()), -50));
        }
        const Benchmarks read = parse_benchmarks(to_toml(all), "x.toml");
        ASSERT_EQ(read.size(), all.size()) << "seed " << seed;
        for (const auto& [name, made] : all) {
            const Benchmark& back = read.at(name);
            EXPECT_EQ(back.by, made.by);
            EXPECT_EQ(back.attempts, made.attempts);
            EXPECT_EQ(back.scenario, made.scenario);
            for (const BenchmarkFigure& figure : benchmark_figures())
                EXPECT_EQ((back.*figure.sample).values, (made.*figure.sample).values)
                    << "seed " << seed << ", " << figure.key;
        }
    }
}

TEST(Benchmark, MeanAndSpreadAreThoseOfStatistics) {
    const Sample sample{{2, 4, 4, 4, 5, 5, 7, 9}};
    EXPECT_DOUBLE_EQ(sample.mean(), 5);
    EXPECT_DOUBLE_EQ(sample.spread(), std::sqrt(32.0 / 7));
    EXPECT_DOUBLE_EQ(sample.least(), 2);
    EXPECT_EQ(Sample{{3}}.spread(), 0);
    EXPECT_EQ(Sample{}.mean(), 0);
}

TEST(Benchmark, WhatIsWrongIsSaidWithItsLine) {
    EXPECT_EQ(refusal("schema = 1\n[renal]\nby = \"x\"\nattempts = 2\ncontrast_ml = [1, 2]\n"), "");
    test::expect_said(refusal("schema = 1\n[renal]\nby = \"x\"\nattempts = 2\ncontrast_ml = [1]\n"),
                      "benchmark.toml:5");
    test::expect_said(refusal("schema = 1\n[renal]\nby = \"x\"\nattempts = 2\ncontrast_ml = [1, nan]\n"),
                      "2 numbers from 0");
    test::expect_said(refusal("schema = 1\n[renal]\nby = \"x\"\nattempts = 2\ncontrast_ml = [1, -1]\n"),
                      "2 numbers from 0");
    test::expect_said(refusal("schema = 1\n[renal]\nby = \"x\"\nattempts = 0\n"), "attempts");
    test::expect_said(refusal("schema = 1\n[renal]\nattempts = 1\n"), "by = ");
    test::expect_said(refusal("schema = 1\n[renal]\nby = \"x\"\n"), "attempts = ");
    test::expect_said(refusal("schema = 1\n[renal]\nby = \"x\"\nattempts = 1\npoints = [3]\n"), "points");
    test::expect_said(refusal("schema = 1\nrenal = 3\n"), "renal");
    test::expect_said(refusal("[renal]\nby = \"x\"\nattempts = 1\n"), "schema");
    test::expect_said(refusal("schema = 1\n[renal]\nby = \"x\"\nattempts = 1\nscenario = \"7\"\n"),
                      "16 digits");
}

TEST(Benchmark, AScenarioHasThatOfItsFolderAndRefusesAPar) {
    EXPECT_TRUE(test::shipped_scenario("renal").lesson.benchmark.given());
    EXPECT_FALSE(test::small_scenario().lesson.benchmark.given());
    try {
        test::small_scenario(std::string(test::small_toml) + "[par]\ncompletion_time_s = 2.0\n");
        FAIL();
    } catch (const io::InputError& error) {
        test::expect_said(error.what(), "seldinger benchmark");
    }
}

}  // namespace scenario
