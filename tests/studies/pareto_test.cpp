/// The quick course of speed against accuracy.

#include <cmath>
#include <gtest/gtest.h>
#include <set>

#include "engine/studies/pareto_measure.h"
#include "engine/studies/runs.h"
#include "tests/studies/quick_study.h"

using io::Table;
using studies::StudyResult;

using test::table_of;

TEST(ParetoStudy, QuickRunMeasuresEveryMethodAgainstRestsThatAreCertified) {
    const StudyResult result = studies::run_pareto(test::quick_study(2));

    const Table& front = table_of(result, "pareto_front");
    ASSERT_GE(front.rows.size(), 2u);
    for (std::size_t r = 1; r < front.rows.size(); ++r)
        EXPECT_LT(front.number(r, "deviation_mm"), front.number(r - 1, "deviation_mm"));

    const Table& pushes = table_of(result, "pareto_pushes");
    std::set<std::string> methods;
    for (std::size_t r = 0; r < pushes.rows.size(); ++r) {
        methods.insert(pushes.word(r, "method"));
        EXPECT_LE(pushes.number(r, "rest_gradient"), 1e-8);
        EXPECT_NE(pushes.word(r, "end"), "diverged");
        const bool newton =
            pushes.word(r, "method") == "global Newton" || pushes.word(r, "method") == "beam FEM";
        if (newton) {
            EXPECT_EQ(pushes.word(r, "end"), "at rest");
        }
        if (pushes.word(r, "method") == "global Newton") {
            EXPECT_LT(pushes.number(r, "left_mm"), 1e-6);
        }
        // Beams share nothing with our wire: their rest is that of another discretisation.
        if (pushes.word(r, "method") == "beam FEM") {
            EXPECT_LT(pushes.number(r, "left_mm"), 0.01);
            EXPECT_LT(pushes.number(r, "basin_mm"), 1e-4);
        }
    }
    EXPECT_EQ(methods.size(), 9u);
    const Table& speed = table_of(result, "pareto_speed");
    ASSERT_EQ(speed.rows.size(), methods.size());
    for (std::size_t r = 0; r < speed.rows.size(); ++r)
        EXPECT_EQ(speed.word(r, "cannot reach").empty(), speed.word(r, "method") == "global Newton");
    ASSERT_EQ(result.plots.size(), 3u);
    EXPECT_EQ(result.plots.front().name, "pareto_speed");
}

TEST(ParetoStudy, AMedianOfPushesThatDoNotGetThereIsNone) {
    studies::ParetoCourse fast, slow, never;
    fast.points = {{0, 0.001, 0.5}, {0, 0.002, 0.05}};
    slow.points = {{0, 0.004, 0.5}, {0, 0.008, 0.05}};
    never.points = {{0, 0.001, 0.5}, {0, 0.02, 0.2}};
    for (auto* course : {&fast, &slow, &never}) course->work = {{1, 10, 100}, {2, 20, 200}};
    const studies::ParetoSpeed most = studies::speed_at({&fast, &slow, &never}, 0.1);
    EXPECT_NEAR(most.reached, 2.0 / 3, 1e-12);
    EXPECT_NEAR(most.cpu_ms, 8, 1e-12);
    EXPECT_EQ(most.work.wall_queries, 20);
    EXPECT_FALSE(std::isfinite(studies::speed_at({&fast, &never, &never}, 0.1).cpu_ms));
    EXPECT_NEAR(studies::speed_at({&fast, &never, &never}, 1).cpu_ms, 1, 1e-12);
}
