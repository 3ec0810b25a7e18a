/// How near the estimate of a tip's error is, and what segments led by it cost, on many random tubes.

#include <cstdio>
#include <gtest/gtest.h>

#include "engine/exercise/simulation.h"
#include "physics/relax/error_refinement.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"
#include "tests/physics/random_tube.h"

using namespace physics;

namespace {

void print(const char* name, const RatioCounts& ratios) {
    std::printf("%s: %d of %d within a factor of two (%.1f %%), %d above 4, the largest %.2f, %d without\n",
                name, ratios.within_two, ratios.cases, 100 * ratios.share(), ratios.above_four,
                ratios.largest, ratios.without);
}

}  // namespace

// Seeds 0 to 999, none left out.
TEST(DiscretisationErrorStudy, AThousandRandomTubesAgainstAnEighthOfTheSegments) {
    RatioCounts tips, forces;
    double estimating = 0, pushing = 0;
    for (int seed = 0; seed < 1000; ++seed) {
        const RandomTube tube(seed);
        ASSERT_TRUE(tube.at_rest) << "seed " << seed;
        const ErrorRatio ratio = error_ratio(tube);
        tips.add(ratio.of_tip());
        forces.add(ratio.of_force());
        if (!(ratio.of_tip() <= 4)) std::printf("seed %d: %.2f\n", seed, ratio.of_tip());
        ErrorEstimator estimator(*tube.wall);
        const auto contacts = all_contacts(tube.chain, *tube.wall);
        estimator.of(tube.chain, contacts);
        const double before = io::thread_cpu_seconds();
        estimator.of(tube.chain, contacts);
        estimating += io::thread_cpu_seconds() - before;
        pushing += tube.seconds_of_pushes / tube.pushes;
    }
    print("tip", tips);
    print("largest force of a length λ", forces);
    std::printf("an estimate takes %.1f us, a push of λ without friction in a closed form %.1f us\n",
                1e3 * estimating, 1e3 * pushing);
    EXPECT_GE(tips.share(), 0.9);
    EXPECT_EQ(tips.above_four, 0);
    EXPECT_EQ(tips.without, 0);
}

// The uniform chain is the first of λ, λ/2 … λ/16 whose true error is no larger than that of the segments led
// by the estimate; each push of either counts with what it takes to show its rest.
TEST(DiscretisationErrorStudy, SegmentsLedByTheEstimateAgainstUniformOnesOfTheSameError) {
    double updates = 0, of_uniform = 0, seconds = 0, seconds_of_uniform = 0, segments = 0,
           segments_of_uniform = 0;
    int cases = 0, reached = 0;
    constexpr double tolerance = 0.01;  // [mm]
    for (int seed = 0; seed < 100; ++seed) {
        const RandomTube tube(seed);
        const double lambda = tube.chain.grid.segment_length;
        Chain chain = tube.chain;
        GlobalRelaxer relaxer({}, *tube.wall);
        relaxer.relax(chain, {1'000'000, 0, 0});
        const double before = io::thread_cpu_seconds();
        const ErrorRefinement made = refine_to_error(chain, *tube.wall, relaxer, {.tolerance = tolerance});
        const double refining = io::thread_cpu_seconds() - before;
        const Vec3 truth = halved(tube.chain, *tube.wall, 4).tip();
        const double error = (chain.tip() - truth).norm();
        reached += error <= 2 * tolerance;
        int halvings = 0;
        while (halvings < 4 &&
               (halved(tube.chain, *tube.wall, halvings).tip() - truth).norm() > std::max(error, tolerance))
            ++halvings;
        const RandomTube uniform(seed, 1 << halvings);
        const double uniform_length = uniform.chain.grid.segment_length;
        ++cases;
        updates += (static_cast<double>(tube.updates_of_pushes) / tube.pushes + made.updates) / lambda;
        seconds += (tube.seconds_of_pushes / tube.pushes + refining) / lambda;
        of_uniform += static_cast<double>(uniform.updates_of_pushes) / uniform.pushes / uniform_length;
        seconds_of_uniform += uniform.seconds_of_pushes / uniform.pushes / uniform_length;
        segments += chain.segments();
        segments_of_uniform += uniform.chain.segments();
    }
    std::printf(
        "to %.3f mm, true error within twice of it in %d of %d: segments %.0f against %.0f of uniform ones "
        "(%.2f times), updates a mm %.0f against %.0f (%.2f times), time a mm %.2f ms against %.2f ms (%.2f "
        "times)\n",
        tolerance, reached, cases, segments / cases, segments_of_uniform / cases,
        segments_of_uniform / segments, updates / cases, of_uniform / cases, of_uniform / updates,
        1e3 * seconds / cases, 1e3 * seconds_of_uniform / cases, seconds_of_uniform / seconds);
    EXPECT_GE(segments_of_uniform, 1.3 * segments);
    EXPECT_GE(of_uniform, updates);
}

// A hand that pushes on, with friction and vessels that give way: λ against λ/4.
TEST(DiscretisationErrorStudy, TheSameHandWithAQuarterOfTheSegmentsInAnExercise) {
    const scenario::Scenario as_shipped = test::shipped_scenario("iliac_aorta");
    exercise::Simulation coarse(as_shipped, test::cache());
    const double lambda = coarse.wire().grid.segment_length;
    scenario::Scenario finer = as_shipped;
    finer.segment_length = lambda / 4;
    finer.wall_stiffness = coarse.scenario().wall_stiffness / 4;
    finer.budget.updates = 100'000'000;
    exercise::Simulation fine(finer, test::cache());
    RatioCounts ratios;
    for (int frame = 0; frame < 150; ++frame) {
        for (exercise::Simulation* one : {&coarse, &fine}) {
            one->apply(script::Advance{lambda});
            one->step();
        }
        if (frame % 10 != 0) continue;
        const auto error = coarse.tip_error();
        ASSERT_TRUE(error) << "frame " << frame;
        const double apart = (coarse.tip() - fine.tip()).norm();
        std::printf("frame %d: %.4f mm, estimate %.4f mm\n", frame, apart, error->tip);
        ratios.add(apart / error->tip);
    }
    print("tip of iliac_aorta", ratios);
    EXPECT_GE(ratios.share(), 0.5);
    EXPECT_LE(ratios.largest, 8);
}

TEST(DiscretisationErrorStudy, TakesAFifthOfAPushAtMostInExercises) {
    for (const char* name : {"iliac_aorta", "arch", "arch_3", "renal", "coronary"}) {
        exercise::Simulation simulation(test::shipped_scenario(name), test::cache());
        double pushing = 0, estimating = 0;
        int rests = 0, estimates = 0;
        for (int frame = 0; frame < 150; ++frame) {
            simulation.apply(script::Advance{simulation.wire().grid.segment_length});
            const double start = io::thread_cpu_seconds();
            simulation.step();
            const double stepped = io::thread_cpu_seconds();
            const auto error = simulation.tip_error();
            estimating += io::thread_cpu_seconds() - stepped;
            pushing += stepped - start;
            rests += simulation.readings().at_rest && simulation.readings().strict_minimum;
            estimates += error.has_value();
        }
        std::printf("%s: %.0f us of %.0f us, %.0f %%; stated in %d of %d rests\n", name,
                    1e6 / 150 * estimating, 1e6 / 150 * pushing, 100 * estimating / pushing, estimates,
                    rests);
        EXPECT_LE(estimating, 0.25 * pushing) << name;
        EXPECT_GE(estimates, 0.7 * rests) << name;
    }
}
