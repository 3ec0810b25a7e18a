#include "physics/relax/contact_set.h"

#include <gtest/gtest.h>

#include "physics/wire/energy.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {
void turn_some(Chain& wire, int i, double by) {
    wire.tangents[i] = (wire.tangents[i] + by * Vec3(0.3, -0.8, 0.5)).normalized();
    rebuild_joints(wire, i);
}

/// A scene with the distal part of its wire shifted by about 2 mm, through the wall.
SceneSetup pressed_aside(const char* name) {
    SceneSetup scene = scene_setup(name);
    for (int i = 10; i < 30; ++i) turn_some(scene.wire, i, 0.1);
    return scene;
}
}  // namespace

TEST(ContactSet, SkipsQueriesWithoutEverMissingAContact) {
    auto [wall, wire] = scene_setup("sinuous");
    ContactSet set(wall);
    set.reset(wire);
    const long long all = wire.segments();
    EXPECT_EQ(set.queries(), all);
    for (int k = 0; k < 120; ++k) {
        const int i = 1 + (k * 37) % wire.segments();
        turn_some(wire, i, k % 2 ? 0.004 : -0.004);
        set.evaluate(wire.joints, i);
        set.commit();
        const auto fresh = all_contacts(wire, wall);
        for (int j = 1; j <= wire.segments(); ++j) {
            ASSERT_EQ(set.contacts()[j].touches(), fresh[j].touches()) << k << " " << j;
            if (fresh[j].touches()) {
                ASSERT_NEAR(set.contacts()[j].penetration, fresh[j].penetration, 1e-9);
            }
        }
    }
    EXPECT_LT(set.queries(), 120 * all / 3);
}

TEST(ContactSet, ForgetsAnEvaluationThatIsNotCommitted) {
    auto [wall, wire] = pressed_aside("hairpin");
    ContactSet set(wall);
    set.reset(wire);
    const double energy = set.energy(wire.joints, 1);
    Chain moved = wire;
    turn_some(moved, 10, 0.1);
    EXPECT_NE(set.evaluate(moved.joints, 10), energy);
    EXPECT_EQ(set.energy(wire.joints, 1), energy);
    set.evaluate(wire.joints, 10);
    set.commit();
    EXPECT_DOUBLE_EQ(set.energy(wire.joints, 1), energy);
}

TEST(ContactSet, SumsForceAndStiffnessFromAJointToTheTip) {
    auto [wall, wire] = pressed_aside("hairpin");
    ContactSet set(wall);
    set.reset(wire);
    ASSERT_GT(set.touching(), 5);
    for (int from : {1, 30, 60, 119, 120}) {
        Vec3 force = Vec3::Zero();
        Mat3 stiffness = Mat3::Zero();
        for (int j = from; j <= wire.segments(); ++j) {
            const WallContact& c = set.contacts()[j];
            if (!c.touches()) continue;
            force += c.stiffness * c.penetration * c.normal;
            stiffness += c.stiffness * c.normal * c.normal.transpose();
        }
        EXPECT_LT((set.sum_from(from).force - force).norm(), 1e-9 * (1 + force.norm()));
        EXPECT_LT((set.sum_from(from).stiffness - stiffness).norm(), 1e-9 * (1 + stiffness.norm()));
    }
    EXPECT_EQ(set.sum_from(wire.segments() + 1).force, Vec3::Zero());
}

TEST(ContactSet, AWallIsAsStiffPerLengthOfACoarserWire) {
    auto [wall, wire] = pressed_aside("hairpin");
    for (int i = 1; i < 40; ++i) merge_segments(wire, i);
    const auto fresh = all_contacts(wire, wall);
    ContactSet set(wall);
    set.reset(wire);
    EXPECT_DOUBLE_EQ(fresh[20].stiffness, 2 * fresh[70].stiffness);
    double energy = 0;
    for (int i = 1; i <= wire.segments(); ++i) {
        EXPECT_EQ(set.contacts()[i].stiffness, fresh[i].stiffness) << i;
        energy += fresh[i].touches() ? fresh[i].energy() : 0.0;
    }
    ASSERT_GT(set.touching(), 20);
    EXPECT_DOUBLE_EQ(set.energy(wire.joints, 1), energy);
    EXPECT_DOUBLE_EQ(set.evaluate(wire.joints, 1), energy);
}

TEST(ContactSet, AsksAgainOnlyForJointsThatMoved) {
    auto [wall, wire] = pressed_aside("sinuous");
    ContactSet set(wall);
    set.update(wire);
    EXPECT_EQ(set.queries(), wire.segments());
    for (int i = 1; i <= wire.segments(); ++i) wire.stations[i] = set.contacts()[i].station;
    set.update(wire);
    EXPECT_EQ(set.queries(), wire.segments());
    turn_some(wire, 190, 0.2);
    move(wire, wire.grid.segment_length);
    set.update(wire);
    EXPECT_LE(set.queries(), wire.segments() + 12);
    const auto fresh = all_contacts(wire, wall);
    for (int j = 1; j <= wire.segments(); ++j) EXPECT_EQ(set.contacts()[j].force(), fresh[j].force()) << j;
    for (int i = 1; i < 40; ++i) merge_segments(wire, i);
    set.update(wire);
    const auto coarser = all_contacts(wire, wall);
    for (int j = 1; j <= wire.segments(); ++j)
        EXPECT_EQ(set.contacts()[j].stiffness, coarser[j].stiffness) << j;
}

TEST(ContactSet, PushesWithTheLoadAsWell) {
    auto [wall, wire] = pressed_aside("hairpin");
    ContactSet set(wall);
    set.reset(wire);
    const double wall_energy = set.energy(wire.joints, 40);
    const Vec3 wall_force = set.sum_from(40).force;
    EXPECT_EQ(set.load_scale(40), 0.0);
    wire.load = Vec3(0.01, -0.02, 0.005);
    set.update(wire);
    double work = 0, length = 0;
    for (int j = 40; j <= wire.segments(); ++j) {
        work += wire.length_of(j) * wire.load.dot(wire.joints[j] - wire.joints[39]);
        length += wire.length_of(j);
    }
    EXPECT_NEAR(set.energy(wire.joints, 40), wall_energy - work, 1e-12 * set.load_scale(40));
    EXPECT_EQ(set.evaluate(wire.joints, 40), set.energy(wire.joints, 40));
    EXPECT_GE(set.load_scale(40), std::abs(work));
    EXPECT_LT((set.sum_from(40).force - (wall_force - length * wire.load)).norm(), 1e-12);
    EXPECT_EQ(set.sum_from(wire.segments() + 1).force, Vec3::Zero());
}

namespace {

/// A vessel along x, station 0, and one that leaves it at x = 20 along y, station 1. Each answers for itself.
class TwoVessels final : public LumenWall {
public:
    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        for (std::size_t i = 0; i < joints.size(); ++i) {
            const bool side = contacts[i].station == 1;
            Vec3 from_axis = side ? Vec3(joints[i] - Vec3(20, 0, 0)) : joints[i];
            from_axis[side ? 1 : 0] = 0;
            contacts[i] = {};
            contacts[i].station = side ? 1 : 0;
            contacts[i].penetration = from_axis.norm() - (side ? 1.5 : 3.0);
            contacts[i].normal = from_axis.normalized();
            contacts[i].stiffness = 10;
            contacts[i].clearance = side ? 1.5 : 3;
        }
    }
    bool same_vessel(int a, int b) const override { return a == b; }
};

/// A wire along the first vessel whose distal joints are held by the second.
Chain drawn_back(double x, double y, int held) {
    studies::PlainWire spec{.segment_length = 1, .curved_length = 0, .curved_angle = 0};
    Chain wire = wire_along(spec, Polyline{{0, 0, 0}, {x, 0, 0}, {x, y + 5, 0}}, static_cast<int>(x + y));
    for (int i = 0; i <= wire.segments(); ++i) wire.stations[i] = i > wire.segments() - held ? 1 : 0;
    return wire;
}

}  // namespace

TEST(ContactSet, ATipDrawnBackOutOfASideBranchIsHeldByTheVesselItCameInto) {
    const TwoVessels wall;
    const Chain wire = drawn_back(24, 2, 3);  // 4 mm past the branch's axis, well inside the first vessel
    ContactSet set(wall);
    set.reset(wire);
    ASSERT_EQ(set.touching(), 3);
    const double held = set.energy(wire.joints, 1);
    EXPECT_EQ(set.rejoin_vessels(wire), wire.segments() - 2);
    for (int i = 1; i <= wire.segments(); ++i) EXPECT_EQ(set.contacts()[i].station, 0) << i;
    EXPECT_EQ(set.touching(), 0);
    EXPECT_GT(held, 1.0);
    EXPECT_EQ(set.energy(wire.joints, 1), 0.0);
    EXPECT_EQ(set.rejoin_vessels(wire), -1);
}

TEST(ContactSet, AJointBesideTheMouthKeepsTheContactThatIsLessDeep) {
    const TwoVessels wall;
    // The tip is 1.7 mm from the branch's axis, 0.2 mm in its wall, and 5 mm from the first vessel's: 2 mm.
    const Chain wire = drawn_back(21.7, 5, 5);
    ContactSet set(wall);
    set.reset(wire);
    const int tip = wire.segments();
    ASSERT_GT(wire.tip().y(), 3.4);
    ASSERT_TRUE(set.contacts()[tip].touches());
    set.rejoin_vessels(wire);
    EXPECT_EQ(set.contacts()[tip].station, 1);
    EXPECT_GT(set.contacts()[tip].penetration, 0.0);
    // Its neighbours in the first vessel's lumen are no longer held by the branch.
    EXPECT_EQ(set.contacts()[tip - 4].station, 0);
}

TEST(ContactSet, NoJointInItsOwnVesselLooksElsewhere) {
    const TwoVessels wall;
    Chain wire = drawn_back(24, 2, 0);
    ContactSet set(wall);
    set.reset(wire);
    const long long asked = set.queries();
    EXPECT_EQ(set.rejoin_vessels(wire), -1);
    EXPECT_EQ(set.queries(), asked);
}
