/// How near the estimate of a tip's error is, and what segments led by it cost, on many random tubes.

#include <cstdio>
#include <cstdlib>
#include <gtest/gtest.h>

#include "engine/exercise/simulation.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"
#include "tests/physics/refined_course.h"

using namespace physics;

namespace {

void print(const char* name, const RatioCounts& ratios) {
    std::printf("%s: %d of %d within a factor of two (%.1f %%), %d above 4, the largest %.2f, %d without\n",
                name, ratios.within_two, ratios.cases, 100 * ratios.share(), ratios.above_four,
                ratios.largest, ratios.without);
}

}  // namespace

// Seeds 0 to 999, none left out. With TIP_ERROR_CSV=FILE each tube is a line of that file.
TEST(DiscretisationErrorStudy, AThousandRandomTubesAgainstFarShorterSegments) {
    RatioCounts tips, forces;
    double estimating = 0, pushing = 0;
    const char* name = std::getenv("TIP_ERROR_CSV");
    std::FILE* csv = name ? std::fopen(name, "w") : nullptr;
    ASSERT_TRUE(!name || csv) << name;
    if (csv) std::fprintf(csv, "seed,tip_error_mm,true_tip_error_mm,force_error_N,true_force_error_N\n");
    for (int seed = 0; seed < 1000; ++seed) {
        const RandomTube tube(seed);
        ASSERT_TRUE(tube.at_rest) << "seed " << seed;
        const ErrorRatio ratio = error_ratio(tube);
        tips.add(ratio.of_tip());
        forces.add(ratio.of_force());
        if (!(ratio.of_tip() <= 4))
            std::printf("seed %d: %.4f mm, estimate %.4f mm\n", seed, ratio.true_tip, ratio.tip);
        if (csv && ratio.estimated)
            std::fprintf(csv, "%d,%.9g,%.9g,%.9g,%.9g\n", seed, ratio.tip, ratio.true_tip, ratio.force,
                         ratio.true_force);
        ErrorEstimator estimator(*tube.wall);
        const auto contacts = all_contacts(tube.chain, *tube.wall);
        estimator.of(tube.chain, contacts);
        const double before = io::thread_cpu_seconds();
        estimator.of(tube.chain, contacts);
        estimating += io::thread_cpu_seconds() - before;
        pushing += tube.seconds_of_pushes / tube.pushes;
    }
    if (csv) std::fclose(csv);
    print("tip", tips);
    print("largest force of a length λ", forces);
    std::printf("an estimate takes %.1f us, a push of λ without friction in a closed form %.1f us\n",
                1e3 * estimating, 1e3 * pushing);
    EXPECT_GE(tips.share(), 0.95);
    // Set after runs had shown 97.2 %, 92.8 % and 2 without any: they guard these figures, and choose none.
    EXPECT_LE(tips.above_four, 5);
    EXPECT_LE(tips.without, 5);
    EXPECT_GE(forces.share(), 0.9);
    EXPECT_LE(forces.above_four, 5);
}

namespace {

/// A course of pushes with a uniform λ, that of `auto` over `finer`.
struct Uniform {
    int finer = 1;
    double seconds = 0, error = 0;  // root mean square of the tips' true errors [mm]
    long long updates = 0;
};

double root_mean_square(const std::vector<Vec3>& tips, const std::vector<Vec3>& truth) {
    double sum = 0;
    for (std::size_t k = 0; k < truth.size(); ++k) sum += (tips.at(k) - truth[k]).squaredNorm();
    return std::sqrt(sum / truth.size());
}

/// Sums over tubes.
struct Compared {
    double seconds = 0, updates = 0, of_uniform = 0, updates_of_uniform = 0, segments = 0;
    int tubes = 0, rests = 0, within = 0, within_twice = 0, not_reached = 0;
};

void compare(std::uint64_t seed, double tolerance, const std::vector<Vec3>& truth,
             const std::vector<Uniform>& uniform, Compared& all) {
    RefinedCourse course(seed, tolerance);
    std::vector<Vec3> tips;
    for (const Vec3& tip : truth) {
        course.push();
        ASSERT_TRUE(course.tube.at_rest) << "seed " << seed;
        tips.push_back(course.tube.chain.tip());
        const double error = (tips.back() - tip).norm();
        ++all.rests;
        all.within += error <= tolerance;
        all.within_twice += error <= 2 * tolerance;
        all.segments += course.tube.chain.segments();
    }
    // The longest λ that is as good; λ/16, at less than its due, where none is.
    const double error = std::max(tolerance, root_mean_square(tips, truth));
    auto chosen = std::ranges::find_if(uniform, [&](const Uniform& u) { return u.error <= error; });
    if (chosen == uniform.end()) --chosen, ++all.not_reached;
    ++all.tubes;
    all.seconds += course.seconds;
    all.updates += static_cast<double>(course.all_updates());
    all.of_uniform += chosen->seconds;
    all.updates_of_uniform += static_cast<double>(chosen->updates);
}

}  // namespace

// 100 tubes, 20 to 40 pushes of at most λ each. The uniform chain is for each tube the cheapest of λ to λ/16
// whose true error over the course is no larger than the tolerance, or than that of the segments led by the
// estimate; a hub feeds one segment at most at a time.
TEST(DiscretisationErrorStudy, SegmentsLedByTheEstimateAgainstUniformOnesOfTheSameError) {
    constexpr double tolerances[] = {0.01, 0.03, 0.1};  // [mm]
    constexpr int finer[] = {1, 2, 3, 4, 6, 8, 12, 16};
    Compared all[std::size(tolerances)];
    int rests = 0, of_finer[std::size(finer)][std::size(tolerances)] = {};
    double seconds_of[std::size(finer)] = {};
    for (int seed = 0; seed < 100; ++seed) {
        std::vector<Vec3> truth;
        std::vector<Uniform> uniform;
        RandomTube fine(seed, {.finer = 16, .pushed = false});
        for (int hand = 0; hand < fine.hands; ++hand) {
            fine.push_all(fine.hand);
            ASSERT_TRUE(fine.at_rest) << "seed " << seed;
            truth.push_back(finest(fine.chain, *fine.wall, 0).tip());
        }
        rests += fine.hands;
        for (std::size_t f = 0; f < std::size(finer); ++f) {
            RandomTube tube(seed, {.finer = finer[f], .pushed = false});
            std::vector<Vec3> tips;
            for (int hand = 0; hand < tube.hands; ++hand) {
                tube.push_all(tube.hand);
                ASSERT_TRUE(tube.at_rest) << "seed " << seed << ", λ/" << finer[f];
                tips.push_back(tube.chain.tip());
                for (std::size_t k = 0; k < std::size(tolerances); ++k)
                    of_finer[f][k] += (tips.back() - truth[hand]).norm() <= tolerances[k];
            }
            seconds_of[f] += tube.seconds_of_pushes;
            uniform.push_back(
                {finer[f], tube.seconds_of_pushes, root_mean_square(tips, truth), tube.updates_of_pushes});
        }
        for (std::size_t k = 0; k < std::size(tolerances); ++k)
            compare(seed, tolerances[k], truth, uniform, all[k]);
    }
    for (std::size_t k = 0; k < std::size(tolerances); ++k) {
        const Compared& c = all[k];
        std::printf(
            "to %.3f mm: within it in %.1f %% of %d rests, within twice in %.2f %%; %.0f segments, %.2f ms "
            "and "
            "%.0f updates a course; uniform ones of the same error %.2f ms (%.2f times) and %.0f updates "
            "(%.2f times), in %d of %d tubes more than lambda/16 would need\n",
            tolerances[k], 100.0 * c.within / c.rests, c.rests, 100.0 * c.within_twice / c.rests,
            c.segments / c.rests, 1e3 * c.seconds / c.tubes, c.updates / c.tubes,
            1e3 * c.of_uniform / c.tubes, c.of_uniform / c.seconds, c.updates_of_uniform / c.tubes,
            c.updates_of_uniform / c.updates, c.not_reached, c.tubes);
    }
    for (std::size_t f = 0; f < std::size(finer); ++f)
        std::printf("lambda/%d for all: %.2f ms a course, within 0.01, 0.03, 0.1 mm in %.1f, %.1f, %.1f %%\n",
                    finer[f], 1e3 * seconds_of[f] / 100, 100.0 * of_finer[f][0] / rests,
                    100.0 * of_finer[f][1] / rests, 100.0 * of_finer[f][2] / rests);
    for (int k : {0, 1}) {
        EXPECT_GE(all[k].updates_of_uniform, 2 * all[k].updates) << tolerances[k] << " mm";
        EXPECT_GE(all[k].within, 0.9 * all[k].rests) << tolerances[k] << " mm";
        EXPECT_GE(all[k].within_twice, 0.99 * all[k].rests) << tolerances[k] << " mm";
    }
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
    int without = 0;
    for (int frame = 0; frame < 150; ++frame) {
        for (exercise::Simulation* one : {&coarse, &fine}) {
            one->apply(script::Advance{lambda});
            one->step();
        }
        if (frame % 10 != 0) continue;
        const auto error = coarse.tip_error();
        // Of a rest whose finer chain has no minimum near there is no estimate.
        if (!error) {
            std::printf("frame %d: no estimate\n", frame);
            ++without;
            continue;
        }
        const double apart = (coarse.tip() - fine.tip()).norm();
        std::printf("frame %d: %.4f mm, estimate %.4f mm\n", frame, apart, error->tip);
        ratios.add(apart / error->tip);
    }
    print("tip of iliac_aorta", ratios);
    EXPECT_LE(without, 1) << "of 15";
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
