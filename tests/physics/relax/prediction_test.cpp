#include "physics/relax/prediction.h"

#include <gtest/gtest.h>

#include "physics/relax/global_relaxer.h"
#include "tests/physics/wires.h"

namespace physics {
namespace {

/// Newton steps to rest of `feeds` feeds of `mm`, of a wire whose tip is curved by `angle` [rad].
struct Steps {
    int predicted = 0, slid = 0;  // from its answer, and from where it merely slides on
};
Steps steps_of(double angle, double mm, int feeds) {
    const SmoothVessel vessel = smooth_vessel();
    GlobalRelaxer predicting({}, vessel.wall), sliding({}, vessel.wall);
    Chain wire = wire_of_length(tipped(2, angle), vessel.line, 61.3);
    EXPECT_TRUE(predicting.relax(wire, unlimited).converged());
    Chain other = wire;
    sliding.relax(other, unlimited);
    Steps steps;
    for (int k = 0; k < feeds; ++k) {
        HubMotion motion{mm, 0};
        steps.predicted += predicting.move(wire, motion, unlimited).newton_steps;
        EXPECT_EQ(motion.feed, mm) << angle << " " << k;
        feed(other, every_device, mm);
        steps.slid += sliding.relax(other, unlimited).newton_steps;
        EXPECT_LT((wire.tip() - other.tip()).norm(), 1e-5) << angle << " " << k;
    }
    return steps;
}

}  // namespace

// Moves count from the joints before the feed. Counted from those behind it, the answer of a shaped tip,
// whose rest shape the feed moves along the wire, lacked the feed: half as many steps again as here, while a
// straight wire took as many as before.
TEST(Prediction, OfAShapedTipIsAsNearItsRestAsThatOfAStraightWire) {
    int shaped = 0, straight = 0, slid = 0;
    for (const double mm : {0.05, 0.1, 0.3}) {
        const Steps curved = steps_of(0.8, mm, 60);
        shaped += curved.predicted;
        slid += curved.slid;
        straight += steps_of(0, mm, 60).predicted;
    }
    EXPECT_LE(shaped, straight);
    EXPECT_LT(shaped, 0.7 * slid);
}

}  // namespace physics
