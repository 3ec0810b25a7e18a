#include "render/xray/distal_vessels.h"

#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <numeric>

namespace render {
namespace {

using geometry::Vec3;

CArm arm_at(double lao) {
    return CArm{.lao = lao * geometry::degree, .detector_width = 150};
}

Field thickness(const std::vector<VesselPiece>& pieces, const CArm& arm, const PixelShift& shift = {}) {
    Field out(arm.pixels, arm.pixels);
    std::vector<std::uint32_t> touched;
    const std::vector<float> iodine = {1.0f};
    add_iodine(DistalVessels(pieces, 1).at(arm), iodine, std::vector<PixelShift>{shift}, out, touched);
    for (const std::uint32_t pixel : touched) EXPECT_GT(out.values[pixel], 0);
    return out;
}

double volume(const Field& field, const CArm& arm) {
    const double width = pixel_width(arm) * arm.sod / arm.sid;
    return std::accumulate(field.values.begin(), field.values.end(), 0.0) * width * width;
}

}  // namespace

TEST(DistalVessels, TheirVolumeIsOnTheImageFromEverySide) {
    for (const double radius : {0.1, 0.15, 0.4, 3.0}) {
        for (const double lao : {0.0, 35.0, 70.0}) {
            const std::vector<VesselPiece> piece = {
                {Vec3(-8, 1, 2), Vec3(9, -2, -4), static_cast<float>(radius), 1, 0}};
            const double wanted = std::numbers::pi * radius * radius * (piece[0].to - piece[0].from).norm();
            EXPECT_NEAR(volume(thickness(piece, arm_at(lao)), arm_at(lao)), wanted, 0.02 * wanted)
                << radius << " " << lao;
        }
    }
}

TEST(DistalVessels, PiecesInARowAreOneVessel) {
    std::vector<VesselPiece> row;
    for (int k = 0; k < 50; ++k) row.push_back({Vec3(k - 25.0, 0, 0), Vec3(k - 24.0, 0, 0), 3, 1, 0});
    const CArm arm = arm_at(40);
    const Field pieces = thickness(row, arm),
                whole = thickness({{Vec3(-25, 0, 0), Vec3(25, 0, 0), 3, 1, 0}}, arm);
    const int middle = arm.pixels / 2;
    for (int i = middle - 100; i <= middle + 100; i += 10) {
        const double one = whole.values[static_cast<std::size_t>(middle) * arm.pixels + i];
        EXPECT_NEAR(pieces.values[static_cast<std::size_t>(middle) * arm.pixels + i], one, 0.05 * one);
    }
    EXPECT_NEAR(whole.values[static_cast<std::size_t>(middle) * arm.pixels + middle],
                6 / std::cos(40 * geometry::degree), 0.1);
}

TEST(DistalVessels, MoveWithTheHeart) {
    const std::vector<VesselPiece> piece = {{Vec3(-8, 0, 2), Vec3(9, 0, -4), 0.5f, 1, 0}};
    const CArm arm = arm_at(0);
    const Field at_rest = thickness(piece, arm), moved = thickness(piece, arm, {3, -2});
    for (int j = 10; j < arm.pixels - 10; ++j)
        for (int i = 10; i < arm.pixels - 10; ++i)
            ASSERT_NEAR(moved.values[static_cast<std::size_t>(j - 2) * arm.pixels + i + 3],
                        at_rest.values[static_cast<std::size_t>(j) * arm.pixels + i], 1e-6);
}

TEST(DistalVessels, FillAndNodesAreTheirOwn) {
    const CArm arm = arm_at(0);
    const DistalVessels two(
        {{Vec3(0, 0, 10), Vec3(8, 0, 10), 0.5f, 0.5f, 1}, {Vec3(0, 0, 0), Vec3(8, 0, 0), 0.5f, 1, 0}}, 3);
    const DistalMatrix matrix = two.at(arm);
    ASSERT_EQ(matrix.starts.size(), 4u);
    EXPECT_EQ(matrix.starts[2], matrix.starts[3]);
    double sums[2] = {0, 0};
    for (int n = 0; n < 2; ++n)
        for (std::uint32_t k = matrix.starts[n]; k < matrix.starts[n + 1]; ++k) sums[n] += matrix.lengths[k];
    EXPECT_NEAR(sums[1], sums[0] / 2, 0.01 * sums[0]);
}

TEST(DistalVessels, RefuseWhatIsNoVessel) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(DistalVessels({{Vec3(nan, 0, 0), Vec3(8, 0, 0), 0.5f, 1, 0}}, 1), std::invalid_argument);
    EXPECT_THROW(DistalVessels({{Vec3(0, 0, 0), Vec3(8, 0, 0), 0.0f, 1, 0}}, 1), std::invalid_argument);
    EXPECT_THROW(DistalVessels({{Vec3(0, 0, 0), Vec3(8, 0, 0), 0.5f, 1, 1}}, 1), std::invalid_argument);
    // Behind the source, or of no length: nothing is seen, nothing fails.
    EXPECT_TRUE(
        DistalVessels({{Vec3(0, 2000, 0), Vec3(8, 2000, 0), 0.5f, 1, 0}}, 1).at(arm_at(0)).pixels.empty());
    EXPECT_TRUE(DistalVessels({{Vec3(1, 0, 0), Vec3(1, 0, 0), 0.5f, 1, 0}}, 1).at(arm_at(0)).pixels.empty());
}

}  // namespace render
