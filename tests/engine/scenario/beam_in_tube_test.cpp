#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "engine/scenario/vessel_give.h"

namespace {

using scenario::TubeNode;

/// A tube in waves of this height and length, and a straight beam in it.
std::vector<TubeNode> waves(double height, double length, double clearance) {
    std::vector<TubeNode> nodes(201);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const double s = 2 * static_cast<double>(i);
        nodes[i].centre = {s, height * std::sin(2 * std::numbers::pi * s / length), 0};
        nodes[i].clearance = clearance;
        nodes[i].rigidity = 100;
        nodes[i].modulus = 0.02;
        nodes[i].bending = 50;
    }
    return nodes;
}

/// Of a wave of wave number q the beam takes EI q⁴ against the foundation's k + B q⁴, in series with the
/// wall.
TEST(BeamInATube, ThatFillsItMovesItsWavesAsTwoBeamsOnAFoundationDo) {
    for (const double length : {80.0, 120.0}) {
        const auto aside = scenario::pushed_aside(waves(0.5, length, 0), 2, false);
        const double q4 = std::pow(2 * std::numbers::pi / length, 4), foundation = 0.02 + 50 * q4,
                     wall = 20 * 0.02, beam = 100 * q4, series = 1 / (1 / foundation + 1 / wall);
        const double expected = 0.5 * beam / (beam + series) * series / foundation;
        double most = 0;
        for (std::size_t i = 60; i < 140; ++i) most = std::max(most, aside[i]);
        EXPECT_NEAR(most, expected, 0.03 * expected) << length;
    }
}

TEST(BeamInATube, ThatHasRoomToBeStraightMovesNothing) {
    for (const double way : scenario::pushed_aside(waves(1, 80, 1.1), 2, false)) EXPECT_LT(way, 1e-9);
    double most = 0;
    for (const double way : scenario::pushed_aside(waves(1, 80, 0.5), 2, false)) most = std::max(most, way);
    EXPECT_GT(most, 1e-3);
}

/// A shape that fits in presses on nothing, one that the tube straightens presses more the stiffer it is.
TEST(BeamInATube, ThatIsShapedPressesByWhatTheTubeStraightens) {
    const auto shaped = [](double rigidity, double clearance) {
        auto nodes = waves(0, 80, clearance);
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            nodes[i].rigidity = rigidity;
            if (i + 11 > nodes.size()) nodes[i].rest = {0, 0.05, 0};  // 10 mm aside over 20 mm
        }
        double most = 0;
        for (const double way : scenario::pushed_aside(nodes, 2, true)) most = std::max(most, way);
        return most;
    };
    EXPECT_LT(shaped(10, 12), 1e-6);
    EXPECT_GT(shaped(10, 2), 0.01);
    EXPECT_GT(shaped(40, 2), 2 * shaped(10, 2));
}

}  // namespace
