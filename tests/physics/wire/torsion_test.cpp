#include "physics/wire/torsion.h"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "physics/wire/energy.h"
#include "physics/wire/feed.h"

namespace physics {
namespace {

DeviceSpec twisting_spec() {
    DeviceSpec spec;
    spec.sections = soft_tip(6, 20, 60, 250, 188);
    spec.shape = {{10, 0.8, 0}};
    spec.friction = 0.1;
    return spec;
}

/// Bent over 60°, its hub turned by 1.2 rad that have not reached the tip, with grips that hold.
Chain wound_wire(Torsion torsion) {
    Polyline path = {{0, 0, 0}};
    for (int i = 1; i <= 300; ++i) {
        const double s = i, turn = std::clamp((s - 100) / 100, 0.0, 1.0) * std::numbers::pi / 3;
        path.push_back(path.back() + Vec3(std::cos(turn), std::sin(turn), 0));
    }
    Device device;
    device.spec = twisting_spec();
    device.inserted = 200;
    device.roll = 0.3;
    device.outside = 100;
    Chain chain = chain_along({device}, {2.0}, path);
    if (torsion == Torsion::Rigid) change_torsion(chain, 0, twisting_spec(), Torsion::Rigid);
    if (torsion == Torsion::Segments) start_twists(chain, 0);
    start_grips(chain);
    for (std::size_t j = 1; j < chain.grips.size(); ++j) {
        Grip& grip = chain.grips[j];
        grip.normal = Vec3::UnitZ();
        grip.force = 0.02;
        grip.around = 0.4 * chain.tangents[j].cross(grip.normal);
    }
    rotate(chain, 0, 1.2);
    return chain;
}

double hub_of(const Device& device, const Chain& chain) {
    return std::remainder(device.angle_at(chain.segments()) + device.wound_up(), 2 * std::numbers::pi);
}

TEST(TorsionChange, AChangeLosesNoAngle) {
    for (const Torsion from : {Torsion::Rigid, Torsion::Whole, Torsion::Segments})
        for (const Torsion to : {Torsion::Rigid, Torsion::Whole, Torsion::Segments}) {
            if (from == to) continue;
            Chain chain = wound_wire(from);
            const double hub = hub_of(chain.devices[0], chain),
                         tip = chain.devices[0].angle_at(chain.segments());
            const double wound = chain.devices[0].wound_up();
            EXPECT_NEAR(hub, 1.5, 1e-12);
            change_torsion(chain, 0, twisting_spec(), to);
            EXPECT_TRUE(validate(chain).empty());
            const Device& device = chain.devices[0];
            EXPECT_EQ(torsion_of(device), to);
            EXPECT_NEAR(hub_of(device, chain), hub, 1e-12);
            if (to == Torsion::Rigid) continue;
            EXPECT_NEAR(device.angle_at(chain.segments()), tip, 1e-12) << "the tip stands still";
            EXPECT_NEAR(device.wound_up(), wound, 1e-12);
        }
}

TEST(TorsionChange, AChangeKeepsThePushOfEveryGrip) {
    for (const Torsion to : {Torsion::Rigid, Torsion::Whole}) {
        Chain chain = wound_wire(Torsion::Segments);
        std::vector<Vec3> pushes;
        double rolled = 0;
        for (std::size_t j = 0; j < chain.grips.size(); ++j) {
            pushes.push_back(chain.grips[j].push(chain.joints[j]));
            rolled = std::max(rolled, std::abs(chain.grips[j].roll));
        }
        EXPECT_GT(rolled, 0.1);
        const double stored = grip_energy(chain.grips, chain.joints, 1);
        change_torsion(chain, 0, twisting_spec(), to);
        for (std::size_t j = 0; j < chain.grips.size(); ++j) {
            EXPECT_EQ(chain.grips[j].roll, 0);
            EXPECT_LT((chain.grips[j].push(chain.joints[j]) - pushes[j]).norm(), 1e-12);
        }
        EXPECT_NEAR(grip_energy(chain.grips, chain.joints, 1), stored, 1e-12);
    }
}

/// What was wound up as a whole is twisted by segments with the energy that it had, less what the millimetres
/// of the shape now take of it.
TEST(TorsionChange, AChangeToSegmentsGainsNoEnergy) {
    Chain chain = wound_wire(Torsion::Whole);
    const double before = twist_energy(chain), grips = grip_energy(chain.grips, chain.joints, 1);
    change_torsion(chain, 0, twisting_spec(), Torsion::Segments);
    EXPECT_LE(twist_energy(chain), before * (1 + 1e-12));
    EXPECT_GT(twist_energy(chain), 0.5 * before);
    EXPECT_EQ(grip_energy(chain.grips, chain.joints, 1), grips);
    chain = wound_wire(Torsion::Segments);
    change_torsion(chain, 0, twisting_spec(), Torsion::Segments);
    EXPECT_LT(std::abs(twist_energy(chain) / twist_energy(wound_wire(Torsion::Segments)) - 1), 0.05);
}

/// Against the sum over the joints by hand: 0.02 N at a radius of 0.4445 mm.
TEST(TorsionChange, GripsHoldBackByTheirForceAndTheShaftBehindThem) {
    const Chain chain = wound_wire(Torsion::Whole);
    const DeviceSpec spec = twisting_spec();
    double held = 0;
    for (int j = 1; j <= chain.segments(); ++j)
        held += 0.02 * 0.5 * spec.outer_diameter * torsional_give(spec, 200 - std::min(200.0, 2.0 * j), 300);
    EXPECT_NEAR(held_back(chain, 0, spec), held, 0.02 * held);
    DeviceSpec rigid = spec;
    stiffen(rigid);
    EXPECT_EQ(held_back(chain, 0, rigid), 0);
}

}  // namespace
}  // namespace physics
