/// The study of walls of triangles at its quick size: whole, and the same on any number of threads.

#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "engine/io/csv.h"
#include "engine/studies/runs.h"
#include "tests/studies/quick_study.h"

namespace test {
namespace {

studies::StudyResult on_threads(int threads) {
    return studies::run_triangle_walls(quick_study(threads));
}

}  // namespace

TEST(TriangleWallsStudy, IsWholeAndTheSameOnAnyNumberOfThreads) {
    const studies::StudyResult one = on_threads(1), three = on_threads(3);
    EXPECT_EQ(one.page, three.page);
    ASSERT_EQ(one.tables.size(), 3u);
    for (std::size_t k = 0; k < one.tables.size(); ++k)
        EXPECT_EQ(io::to_csv(one.tables[k]), io::to_csv(three.tables[k])) << one.tables[k].name;
    EXPECT_EQ(one.plots.size(), 3u);
    for (const io::Plot& plot : one.plots) {
        EXPECT_FALSE(plot.caption.empty());
        EXPECT_NE(one.page.find(plot.name + ".svg"), std::string::npos);
    }
    EXPECT_EQ(one.claims.size(), 12u);
}

TEST(TriangleWallsStudy, OnlyPlanesHaveHopsAndKeepTheGlobalRelaxerFromRest) {
    const studies::StudyResult result = on_threads(2);
    const io::Table& table = result.tables.front();
    int planes = 0, smooth = 0;
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
        const bool plane = table.word(row, "wall") == "plane", sharp = table.word(row, "tube") == "sharp";
        EXPECT_GT(table.number(row, "energy_N_mm"), 0);
        EXPECT_TRUE(std::isfinite(table.number(row, "gradient")));
        if (table.word(row, "method") == "global") {
            if (plane && sharp) {
                EXPECT_EQ(table.word(row, "state"), "stuck");
            } else if (!plane) {
                EXPECT_EQ(table.word(row, "state"), "rests");
            }
        } else if (sharp && plane) {
            EXPECT_GT(table.number(row, "hops_per_contact"), 1);
            ++planes;
        } else {
            smooth += !plane;
        }
    }
    EXPECT_EQ(planes, 10);
    EXPECT_GT(smooth, 20);
}

TEST(TriangleWallsStudy, ThePushOnPlanesJumpsAtTheEdgeAndIsTheSlopeOfTheEnergyElsewhere) {
    const studies::StudyResult result = on_threads(2);
    const io::Table& edge = result.tables.back();
    for (const char* wall : {"closest", "field", "round"}) {
        double worst = 0, largest = 0;
        for (std::size_t row = 1; row + 1 < edge.rows.size(); ++row) {
            if (edge.word(row - 1, "line") != edge.word(row + 1, "line")) continue;
            const double ds = edge.number(row + 1, "place_mm") - edge.number(row - 1, "place_mm");
            const std::string energy = fmt::format("{}_N_mm", wall), push = fmt::format("{}_N", wall);
            // Along the bend a place on its axis is (1 + 1.02 cos 0.3 / 3) as long on the joint's way.
            const double longer = edge.word(row, "line") == "along" ? 1 + 1.02 * std::cos(0.3) / 3 : 1.0;
            const double slope =
                (edge.number(row + 1, energy) - edge.number(row - 1, energy)) / (ds * longer);
            largest = std::max(largest, std::abs(slope));
            worst = std::max(worst, std::abs(slope + edge.number(row, push)));
        }
        const bool round = wall == std::string("round");
        EXPECT_LT(worst, round ? 1e-4 : wall == std::string("closest") ? 0.35 : 0.05) << wall;
        if (!round) {
            EXPECT_GT(largest, 0.3) << wall;
        }
    }
}

}  // namespace test
