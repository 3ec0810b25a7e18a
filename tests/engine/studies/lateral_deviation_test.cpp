#include "engine/studies/lateral_deviation.h"

#include <cmath>
#include <gtest/gtest.h>

#include "engine/studies/paper_scene.h"

namespace studies {
namespace {

using geometry::Vec3;

/// Along +x, then +y: right of it is −y, then +x.
const std::vector<Vec3> bend = {{0, 0, 0}, {1, 0, 0}, {2, 0, 5}, {2, 1, 0}, {2, 2, 0}};

}  // namespace

TEST(ReferenceCurve, DeviationIsPositiveToTheRightInThePlane) {
    const ReferenceCurve curve(bend);
    EXPECT_NEAR(curve.deviation({0.5, -0.2, 3}), 0.2, 1e-12);
    EXPECT_NEAR(curve.deviation({0.5, 0.3, -1}), -0.3, 1e-12);
    EXPECT_NEAR(curve.deviation({2.4, 1.5, 0}), 0.4, 1e-12);
    EXPECT_NEAR(curve.deviation({1.9, 1.5, 0}), -0.1, 1e-12);
    EXPECT_DOUBLE_EQ(curve.deviation({2, 1.2, 7}), 0);
}

TEST(ReferenceCurve, TheSideAtACornerAndBeyondAnEndIsThatOfTheNearestPiece) {
    const ReferenceCurve curve(bend);
    EXPECT_NEAR(curve.deviation({2.3, -0.3, 0}), std::sqrt(0.18), 1e-12);  // outside of the turn to the left
    EXPECT_NEAR(curve.deviation({2.3, 2.4, 0}), 0.5, 1e-12);
    EXPECT_NEAR(curve.deviation({-0.3, 0.4, 0}), -0.5, 1e-12);
}

TEST(DeviationTrace, RecordsTheUpdatesThatMoveTheJoint) {
    const PaperScene scene = paper_scene("sinuous", {40, 0, 0});
    const ReferenceCurve curve(scene.start.joints);
    std::vector<DeviationTrace> traces = {{curve, 7, 40}, {curve, 31, 40}};
    physics::Chain wire = scene.start;
    follow(paper_method(1).config, wire, *scene.wall, 3, traces);
    EXPECT_EQ(traces[0].records(), 3 * 7 * 8 / 2);
    EXPECT_EQ(traces[1].records(), 3 * 31 * 32 / 2);
    const auto points = traces[1].points();
    ASSERT_FALSE(points.empty());
    EXPECT_LE(points.back().cycles, 3);
    double farthest = 0, last = 0;
    for (const auto& point : points) {
        EXPECT_GT(point.cycles, last);
        last = point.cycles;
        farthest = std::max(farthest, std::abs(point.deviation));
    }
    EXPECT_GT(farthest, 0.01);
    EXPECT_LT(farthest, 2);  // of a tube of radius 1 mm
}

TEST(DeviationTrace, SettlesWhereItStaysWithinTheLimit) {
    const ReferenceCurve curve(bend);
    DeviationTrace trace(curve, 1, 2);  // three updates a cycle, of segments 1, 2, 2
    physics::Chain wire;
    const auto cycle = [&](double deviation) {
        wire.joints = {{0, 0, 0}, {0.5, -deviation, 0}, {1, 0, 0}};
        trace.observe(1, wire);
        trace.observe(2, wire);
        trace.observe(2, wire);
    };
    for (const double d : {0.5, 0.05, 0.2, 0.05, -0.04, 0.005, 0.005}) cycle(d);
    EXPECT_NEAR(trace.settled(0.1), 2 + 1.0 / 3, 1e-12);
    EXPECT_NEAR(trace.settled(0.01), 4 + 1.0 / 3, 1e-12);
    EXPECT_TRUE(std::isinf(trace.settled(0.001)));
    EXPECT_NEAR(trace.left_after(1), 0.1, 1e-9);
    EXPECT_DOUBLE_EQ(trace.swing(3), 0);
}

}  // namespace studies
