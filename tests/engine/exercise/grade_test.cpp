#include "engine/exercise/grade.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/exercise/exercise.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

scenario::Benchmarks shipped() {
    return scenario::load_benchmarks(test::asset("scenarios/benchmark.toml"));
}

/// An attempt that came to the mean of the benchmark in everything, times `factor`.
Score as_skilled(const scenario::Benchmark& skilled, double factor) {
    Score score;
    score.completed = true;
    score.completed_after = factor * skilled.completed_after.mean();
    score.air_kerma = factor * skilled.air_kerma.mean();
    score.area_product = factor * skilled.area_product.mean();
    score.contrast = factor * skilled.contrast.mean();
    score.wire_travel = factor * skilled.wire_travel.mean();
    score.angiograms = static_cast<int>(std::lround(skilled.angiograms.mean()));
    return score;
}

}  // namespace

TEST(Grade, TwiceFourAndEightTimesTheSkilledAreWorthLessAndLess) {
    for (const auto& [name, skilled] : shipped()) {
        EXPECT_DOUBLE_EQ(grade(as_skilled(skilled, 1), skilled).points, 100) << name;
        EXPECT_DOUBLE_EQ(grade(as_skilled(skilled, 0.5), skilled).points, 100) << name;
        double before = 100;
        for (const double factor : {2.0, 4.0, 8.0, 16.0, 1000.0}) {
            const double points = grade(as_skilled(skilled, factor), skilled).points;
            EXPECT_LT(points, before - 0.5) << name << " at " << factor;
            EXPECT_GT(points, 0) << name << " at " << factor;
            before = points;
        }
    }
}

TEST(Grade, ALineCostsWhatTheFormulaSays) {
    scenario::Benchmark skilled;
    skilled.by = "a test";
    skilled.attempts = 2;
    skilled.completed_after.values = {8, 10};
    skilled.wrong_entries.values = {0, 0};
    skilled.errors.values = {0, 1};
    Score s;
    s.completed = true;
    s.completed_after = 19;
    s.contrast = 300;
    s.wrong_branches = {{"RRA", 3, 2.0}};
    s.handling_errors.resize(2);
    const Grade made = grade(s, skilled);
    ASSERT_EQ(made.lines.size(), measures().size());
    double most = 0, cost = 0;
    for (const GradeLine& line : made.lines) {
        most += line.measure->most;
        cost += line.cost;
    }
    EXPECT_DOUBLE_EQ(most, 100);  // injuries can cost that by themselves
    EXPECT_DOUBLE_EQ(made.lines[0].cost, 25 * (1 - std::sqrt(10.0 / 20)));
    EXPECT_DOUBLE_EQ(made.lines[3].cost, 0);  // nobody measured it
    EXPECT_DOUBLE_EQ(made.lines[5].cost, 10 * (1 - std::sqrt(1.0 / 4)));
    EXPECT_DOUBLE_EQ(made.lines[6].cost, 20 * (1 - std::sqrt(1.5 / 3)));
    EXPECT_DOUBLE_EQ(made.points, 100 - cost);
    s.handling_errors.clear();
    s.handling_errors.resize(3);
    s.handling_errors[0].kind = HandlingError::Dissection;
    s.handling_errors[1].kind = HandlingError::Perforation;
    EXPECT_DOUBLE_EQ(grade(s, skilled).cost_of_injuries(), 65);
    s.completed = false;
    EXPECT_EQ(grade(s, skilled).points, 0);
}

/// A blind attempt, and the same with a look at the vessels before: one as long and as dear as the skilled's.
TEST(Grade, LookingIsNeverDearerThanGoingBlind) {
    std::mt19937 random(20261126);
    const auto between = [&random](double least, double most) {
        return least * std::pow(most / least, std::ldexp(static_cast<double>(random()), -32));
    };
    int compared = 0;
    for (const auto& [name, skilled] : shipped()) {
        if (skilled.angiograms.least() < 1) continue;
        for (int k = 0; k < 1000; ++k, ++compared) {
            Score blind = as_skilled(skilled, 1);
            blind.completed_after = between(0.05, 20) * skilled.completed_after.mean();
            blind.air_kerma = between(1e-3, 20) * skilled.air_kerma.mean();
            blind.area_product = between(1e-3, 20) * skilled.area_product.mean();
            blind.wire_travel = between(0.2, 20) * skilled.wire_travel.mean();
            blind.contrast = blind.angiograms = 0;
            blind.handling_errors.resize(random() % 8);
            Score looks = blind;
            looks.angiograms = 1;
            looks.contrast = skilled.contrast.mean();
            looks.completed_after = *blind.completed_after + 6;
            looks.air_kerma = *blind.air_kerma + skilled.air_kerma.mean();
            looks.area_product = *blind.area_product + skilled.area_product.mean();
            EXPECT_GE(grade(looks, skilled).points, grade(blind, skilled).points)
                << name << ", case " << k << " of seed 20261126";
        }
    }
    EXPECT_GE(compared, 10000);
}

TEST(Score, AnAngiogramIsAnInjectionThatAPulseShows) {
    const auto of = [](const char* script) {
        Exercise exercise(test::small_scenario(), false);
        test::play(exercise, script);
        return exercise.score().angiograms;
    };
    EXPECT_EQ(of("0 beam on\n2 inject 5 ml at 5 ml/s into tube\n40 end\n"), 1);
    EXPECT_EQ(of("2 inject 5 ml at 5 ml/s into tube\n25 beam on\n40 end\n"), 1);  // a moment after
    EXPECT_EQ(of("2 inject 5 ml at 5 ml/s into tube\n60 beam on\n70 end\n"), 0);  // it has gone by
    EXPECT_EQ(of("2 inject 5 ml at 5 ml/s into tube\n70 end\n"), 0);              // nobody looked
    EXPECT_EQ(of("0 beam on\n2 contrast 200 mg/ml\n40 end\n"), 0);                // no injection
    EXPECT_EQ(
        of("0 beam on\n2 inject 5 ml at 5 ml/s into tube\n60 inject 5 ml at 5 ml/s into tube\n90 end\n"), 2);
}

}  // namespace exercise
