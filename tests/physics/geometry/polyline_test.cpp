#include "physics/geometry/polyline.h"

#include <gtest/gtest.h>
#include <vector>

namespace geometry {
namespace {

const Polyline corner = {{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {4, 2, 0}};

TEST(Polyline, LengthIsThatOfThePieces) {
    EXPECT_DOUBLE_EQ(length_of(corner), 6);
    EXPECT_EQ(length_of(Polyline{Vec3(1, 2, 3)}), 0);
    EXPECT_EQ(arc_lengths(corner, 0.5), (std::vector<double>{0.5, 1.5, 3.5, 6.5}));
}

TEST(Polyline, ResamplingKeepsLengthAndEnds) {
    const Polyline line = resampled(corner, 0.5);
    ASSERT_EQ(line.size(), 13u);
    EXPECT_EQ(line.front(), Vec3(0, 0, 0));
    EXPECT_EQ(line.back(), Vec3(4, 2, 0));
    EXPECT_NEAR(length_of(line), 6, 1e-12);
}

TEST(Polyline, TheClosestFractionStaysOnThePiece) {
    const Vec3 a(1, 1, 0), b(5, 1, 0);
    EXPECT_DOUBLE_EQ(closest_fraction(a, b, {2, 7, -3}), 0.25);
    EXPECT_EQ(closest_fraction(a, b, {-4, 1, 0}), 0);
    EXPECT_EQ(closest_fraction(a, b, {9, 0, 0}), 1);
}

}  // namespace
}  // namespace geometry
