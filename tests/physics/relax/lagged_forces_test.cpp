#include "physics/relax/lagged_forces.h"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>

#include "tests/physics/wires.h"

using namespace physics;

namespace {

/// A wire on a floor that answers each friction force of its last joint by a normal force.
struct Answering {
    Chain wire;
    std::vector<WallContact> contacts;
    LaggedForces lag{LagOptions()};
    TubeWall wall{{Vec3::Zero(), 100 * Vec3::UnitX()}, 5, 1};
    int rounds = 0;

    Answering() : wire(bent_wire(6, 0)), contacts(wire.joints.size()) {
        for (Device& device : wire.devices) device.spec.friction = 0.2;
        assign(wire);
        start_grips(wire);
        for (WallContact& c : contacts) c.stiffness = 1, c.normal = Vec3::UnitZ();
    }
    double force() const { return wire.grips.back().force; }
    /// Rounds until they agree or stop; the force that they end with.
    double run(const std::function<double(double)>& normal_force) {
        for (lag.forget(); lag.next_round(); ++rounds) {
            contacts.back().penetration = normal_force(force());
            if (!lag.update(wire, contacts, wall)) break;
        }
        return force();
    }
};

}  // namespace

TEST(LaggedForces, AgreeWithTheWall) {
    Answering at;
    EXPECT_DOUBLE_EQ(at.run([](double) { return 2.0; }), 0.4);
    EXPECT_EQ(at.rounds, 1);
}

TEST(LaggedForces, ThatJumpBackAndForthMeetHalfWay) {
    // N = 4 − 4.9 F has its rest where F = 0.2 N: F = 0.404; plain rounds go there by 0.98 a round.
    Answering at;
    EXPECT_NEAR(at.run([](double f) { return 4 - 4.9 * f; }), 0.8 / 1.98, 2e-3);
    EXPECT_LE(at.rounds, 6);
}

TEST(LaggedForces, WithoutARestOfTheirOwnAreLeftAsTheyAre) {
    // A wire that snaps away from the wall where friction falls below 0.3 N, and back above.
    Answering at;
    const double end = at.run([](double f) { return f < 0.3 ? 2.5 : 0.5; });
    EXPECT_LT(at.rounds, LagOptions().most_rounds);
    EXPECT_GT(end, 0.09);
    EXPECT_LT(end, 0.51);
}

TEST(LaggedForces, OfAContactThatIsLostHoldNothing) {
    Answering at;
    at.run([](double) { return 2.0; });
    EXPECT_TRUE(at.wire.grips.back().holds());
    at.contacts.back().normal.setZero();
    EXPECT_EQ(at.run([](double) { return -1.0; }), 0);
    EXPECT_FALSE(at.wire.grips.back().holds());
    EXPECT_TRUE(at.wire.grips.back().normal.allFinite());
}
