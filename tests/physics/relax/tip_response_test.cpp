#include "physics/relax/tip_response.h"

#include <gtest/gtest.h>

#include "tests/physics/random_tube.h"

namespace {

/// With EI and GJ of all sections by this factor.
physics::Chain stiffer(physics::Chain chain, double factor) {
    for (physics::Device& device : chain.devices)
        for (physics::StiffnessSection& section : device.spec.sections) {
            section.rigidity_distal *= factor;
            section.rigidity_proximal *= factor;
            section.torsional_distal *= factor;
            section.torsional_proximal *= factor;
        }
    physics::assign(chain);
    return chain;
}

}  // namespace

/// The recursion's derivative against differences of equilibria, in random tubes.
TEST(TipResponse, IsTheDerivativeThatDifferencesOfEquilibriaShow) {
    constexpr double step = 1e-4;
    int compared = 0, kinks = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        const RandomTube tube(seed);
        if (!tube.at_rest) continue;
        const auto response = physics::tip_response(*tube.wall, stiffer(tube.chain, 1 + step));
        ASSERT_TRUE(response) << "seed " << seed;
        geometry::Vec3 tips[2];
        for (int side = 0; side < 2; ++side) {
            physics::Chain chain = stiffer(tube.chain, side == 0 ? 1 + step : 1 - step);
            physics::GlobalRelaxer({}, *tube.wall).relax(chain, {1'000'000'000, 0, 0});
            tips[side] = chain.tip();
        }
        const geometry::Vec3 ahead = tips[0] - tube.chain.tip(), behind = tube.chain.tip() - tips[1];
        // Where a joint begins or ends to touch within the step, there are two derivatives.
        const double scale = std::max(ahead.norm(), 1e-7);
        if ((ahead - behind).norm() > 0.05 * scale) {
            ++kinks;
            continue;
        }
        ++compared;
        EXPECT_LT((*response - ahead).norm(), 0.03 * scale + 2e-7)
            << "seed " << seed << ": by the recursion " << response->norm() << " mm, by differences "
            << ahead.norm();
    }
    // Most are compared.
    EXPECT_GE(compared, 45) << kinks << " with a kink";
}

TEST(TipResponse, AnUnchangedChainStaysAndOneOfOneSegmentHasNone) {
    const RandomTube tube(3);
    ASSERT_TRUE(tube.at_rest);
    const auto none = physics::tip_response(*tube.wall, tube.chain);
    ASSERT_TRUE(none);
    EXPECT_LT(none->norm(), 1e-6);
    physics::Chain one = tube.chain;
    one.joints.resize(2);
    one.tangents.resize(2);
    EXPECT_FALSE(physics::tip_response(*tube.wall, one));
}
