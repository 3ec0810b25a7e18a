#include "physics/relax/stored_planes.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "physics/relax/relaxer.h"
#include "physics/wall/mesh_wall.h"
#include "physics/wire/energy.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

RelaxerConfig storing(int varied, bool stored) {
    RelaxerConfig config = segment_config(varied);
    config.stored_planes = stored;
    return config;
}

/// A wire of the hairpin past its first turn, pressed against the wall all along.
SceneSetup pressed() {
    SceneSetup scene = past_the_first_turn();
    make_relaxer(storing(2, false), scene.wall)->relax(scene.wire, whole_cycles(70, 2));
    return scene;
}

}  // namespace

TEST(StoredPlanes, SumsAreThoseOfTheContactsWhereTheyWereAsked) {
    auto [wall, wire] = pressed();
    ContactSet all(wall);
    all.reset(wire);
    StoredPlanes planes(wall);
    planes.reset(wire);
    ASSERT_GT(all.touching(), 3);
    EXPECT_EQ(planes.touching(), all.touching());
    EXPECT_EQ(planes.last_touching(), all.last_touching());
    for (const int from : {1, 20, 35, 60, 70}) {
        EXPECT_LT((planes.sum_from(from).force - all.sum_from(from).force).norm(), 1e-12) << from;
        // Besides R, the rise of the wall to the sides: never less stiff.
        const Mat3 more = planes.sum_from(from).stiffness - all.sum_from(from).stiffness;
        EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat3>(more).eigenvalues()[0], -1e-12) << from;
    }
    EXPECT_DOUBLE_EQ(planes.energy(wire, 30, 70), all.energy(wire, 30, 70));
}

TEST(StoredPlanes, EnergyAfterAStepIsTheWallsToThirdOrder) {
    auto [wall, wire] = pressed();
    StoredPlanes planes(wall);
    planes.reset(wire);
    ContactSet all(wall);
    all.reset(wire);
    double error[2];
    for (const int k : {0, 1}) {
        const double h = k == 0 ? 0.01 : 0.005;
        const TailStep steps[] = {{31, h * Vec3(0.5, 0.7, -0.6)}, {44, h * Vec3(-0.9, -0.1, 1.0)}};
        Chain moved = wire;
        error[k] = std::abs(planes.move(wire, steps, 70) - all.move(moved, steps, 70));
        EXPECT_LT(error[k], 0.02 * std::abs(all.energy(wire, 31, 70) - planes.move(wire, steps, 70)));
    }
    EXPECT_LT(error[1], error[0] / 3);
}

TEST(StoredPlanes, MovesJointsWhenTheyAreSettled) {
    auto [wall, start] = pressed();
    Chain wire = start, other = start;
    StoredPlanes planes(wall);
    planes.reset(wire);
    ContactSet all(wall);
    all.reset(other);
    for (int segment = 20; segment < 60; segment += 3) {
        const TailStep steps[] = {{segment, Vec3(1e-4, -2e-4, 1e-4)}, {segment + 7, Vec3(0, 3e-4, -1e-4)}};
        planes.settle(wire, segment);
        planes.move(wire, steps, 70);
        planes.commit();
        all.move(other, steps, 70);
        all.commit();
        for (int i = 0; i < segment; ++i) ASSERT_LT((wire.joints[i] - other.joints[i]).norm(), 1e-13);
        for (int i = 0; i <= 70; ++i)
            ASSERT_LT((planes.settled(wire).joints[i] - other.joints[i]).norm(), 1e-13) << i;
    }
    planes.settle(wire, 5);  // back to the proximal end, as when a new sweep begins
    for (int i = 0; i <= 70; ++i) ASSERT_LT((wire.joints[i] - other.joints[i]).norm(), 1e-13) << i;
}

TEST(StoredPlanes, RestWhereThePlainFormRests) {
    // From the same basin to rest: the energies agree to 1e-9.
    const SceneSetup scene = pressed();
    Chain plain = scene.wire;
    global_relaxer(scene.wall)->relax(plain, {1'000'000, 0, 0});
    const double rest = energy_of(plain, scene.wall);
    for (const int m : {2, 3}) {
        Chain wire = plain;
        for (int i = 30; i < 50; ++i) wire.tangents[i] = (wire.tangents[i] + Vec3(0, 0, 1e-3)).normalized();
        rebuild_joints(wire);
        ASSERT_GT(energy_of(wire, scene.wall), rest * (1 + 1e-6));
        make_relaxer(storing(m, true), scene.wall)->relax(wire, whole_cycles(70, 25));
        EXPECT_NEAR(energy_of(wire, scene.wall), rest, 1e-9 * rest) << m;
    }
}

TEST(StoredPlanes, AreNotDisturbedByWhoLooksOn) {
    const SceneSetup scene = pressed();
    for (const double distal_fraction : {0.0, 0.6}) {
        Chain alone = scene.wire, watched = scene.wire;
        make_relaxer(storing(2, true), scene.wall)->relax(alone, {1500, distal_fraction, 25});
        Chain last = watched;
        make_relaxer(storing(2, true), scene.wall)
            ->relax(watched, {1500, distal_fraction, 25}, [&](int first, const Chain& now) {
                for (int i = 0; i < first; ++i)
                    ASSERT_LT((now.joints[i] - last.joints[i]).norm(), 1e-12) << first;
                ASSERT_TRUE(validate(now).empty());
                last = now;
            });
        EXPECT_EQ(alone.tip(), watched.tip());
    }
}

TEST(StoredPlanes, BearALoadAndACurvedTip) {
    studies::PlainWire spec{.segment_length = 2, .tip_length = 20, .transition_length = 10};
    const TubeWall wall({{0, 0, -1}, {0, 0, 100}}, 2, 20, 0.44);
    double energy[2];
    for (const bool stored : {false, true}) {
        Chain wire = straight_wire(spec, {0, 0, 0}, {0, 0, 1}, 30);
        wire.load = Vec3(2e-3, -1e-3, 0);
        rotate(wire, every_device, 0.4);
        make_relaxer(storing(2, stored), wall)->relax(wire, whole_cycles(30, 80));
        energy[stored] = energy_of(wire, wall);
        EXPECT_TRUE(validate(wire).empty());
    }
    EXPECT_NEAR(energy[0], energy[1], 1e-6 * std::abs(energy[0]));
}
