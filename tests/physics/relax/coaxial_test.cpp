/// Several devices on one centreline, against closed forms and single wires.

#include <Eigen/Geometry>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/anatomy/scenes.h"
#include "engine/studies/plain_wire.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/bending.h"
#include "physics/wire/energy.h"
#include "tests/finite_difference.h"

namespace physics {
namespace {

constexpr int plenty = 10'000'000;

DeviceSpec rod(double rigidity, double curvature = 0, double length = 400) {
    DeviceSpec spec;
    spec.outer_diameter = 0.8;
    spec.sections = soft_tip(rigidity, 0, 0, rigidity);
    spec.length = length;
    if (curvature != 0) spec.shape = {{length, curvature * length, 0}};
    return spec;
}

DeviceSpec cobra(double torsional_rigidity = 0) {
    DeviceSpec spec;
    spec.outer_diameter = 1.67;
    spec.inner_diameter = 1.1;
    spec.sections = soft_tip(60, 20, 60, 200, torsional_rigidity);
    spec.length = 650;
    spec.shape = {{15, 90 * degree, 0}, {35, -60 * degree, 0}, {60, 40 * degree, 0.3}};
    return spec;
}

DeviceSpec angled_wire(double torsional_rigidity = 0) {
    DeviceSpec spec;
    spec.sections = soft_tip(6, 30, 150, 250, torsional_rigidity);
    spec.shape = {{12, 45 * degree, 0}};
    return spec;
}

Device on_chain(const DeviceSpec& spec, double inserted, double roll = 0) {
    Device device;
    device.spec = spec;
    device.inserted = inserted;
    device.roll = roll;
    return device;
}

/// So wide that nothing touches it.
TubeWall free_space() {
    return TubeWall({{-500, 0, 0}, {1500, 0, 0}}, 900, 5, 0.4);
}

/// The chain as it comes to rest in the vessel.
Chain at_rest(Chain wire, const LumenWall& wall) {
    EXPECT_TRUE(Hub({}, wall).settle(wire, plenty).relax.converged());
    return wire;
}

TubeWall bent_vessel(double radius = 4.0) {
    using anatomy::Arc, anatomy::Run;
    return TubeWall(
        anatomy::draw(std::vector<anatomy::PenMove>{Run{60}, Arc{35, 1.4}, Run{40}, Arc{30, -1.2}, Run{80}}),
        radius, 5, 0.45);
}

TEST(Coaxial, TwoPrecurvedRodsBendByTheVectorSumOfTheirMoments) {
    const double ei[2] = {40, 90}, kappa[2] = {1.0 / 60, 1.0 / 110};
    const TubeWall wall = free_space();
    for (const double apart : {0.0, 90 * degree, 180 * degree, 37 * degree}) {
        // In one plane they fold it: both planes turn with the rods only where the sum is in one.
        Chain wire =
            chain_along({on_chain(rod(ei[0], kappa[0]), 120), on_chain(rod(ei[1], kappa[1]), 120, apart)},
                        {0.5}, {{0, 0, 0}, {300, 0, 0}});
        Hub hub({}, wall);
        ASSERT_EQ(hub.settle(wire, plenty).outcome, HubReport::Outcome::AtRest);
        const Vec2 sum =
            ei[0] * kappa[0] * Vec2(1, 0) + ei[1] * kappa[1] * Vec2(std::cos(apart), std::sin(apart));
        const double expected = sum.norm() / (ei[0] + ei[1]);
        // Eq. 1 is the spring up to the fourth order of the angle.
        for (int j = 20; j < wire.segments() - 20; ++j) {
            const double angle = std::acos(std::clamp(wire.tangents[j].dot(wire.tangents[j + 1]), -1.0, 1.0));
            EXPECT_NEAR(angle / wire.length_of(j), expected, 1e-6) << apart << " at " << j;
        }
    }
}

TEST(Coaxial, DevicesWhoseStiffnessAddsUpToOnesHaveItsShape) {
    const TubeWall wall = bent_vessel();
    const Chain both =
        at_rest(chain_along({on_chain(rod(60), 180), on_chain(rod(140), 180)}, {2}, wall.centreline()), wall);
    const Chain one = at_rest(chain_along({on_chain(rod(200), 180)}, {2}, wall.centreline()), wall);
    for (int j = 0; j <= both.segments(); ++j) EXPECT_LT((both.joints[j] - one.joints[j]).norm(), 1e-9) << j;
    // And a wire without shape alone is one device.
    const Chain wire =
        at_rest(studies::wire_of_length(studies::PlainWire::uniform(200, 2), wall.centreline(), 180), wall);
    for (int j = 0; j <= wire.segments(); ++j) EXPECT_LT((wire.joints[j] - one.joints[j]).norm(), 1e-9) << j;
}

TEST(Coaxial, ACatheterWithoutStiffnessLeavesTheWireAlone) {
    const TubeWall wall = bent_vessel();
    DeviceSpec soft = cobra();
    soft.sections = soft_tip(1e-6, 0, 0, 1e-6);
    soft.outer_diameter = 0.9;
    soft.inner_diameter = 0;
    DeviceSpec inner = angled_wire();
    inner.outer_diameter = 0.9;
    const Chain with =
        at_rest(chain_along({on_chain(inner, 190), on_chain(soft, 150)}, {2}, wall.centreline()), wall);
    const Chain without = at_rest(chain_along({on_chain(inner, 190)}, {2}, wall.centreline()), wall);
    for (int j = 0; j <= with.segments(); ++j)
        EXPECT_LT((with.joints[j] - without.joints[j]).norm(), 1e-4) << j;
}

TEST(Coaxial, TheGradientAgreesWithDifferencesForTwoRolls) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> within(-1, 1);
    const TubeWall wall({{0, -2, 0}, {40, 3, 2}, {90, -2, 5}}, 2.5, 30, 0.45);
    for (int round = 0; round < 8; ++round) {
        Chain wire = chain_along({on_chain(angled_wire(), 60 + 20 * within(random), 3 * within(random)),
                                  on_chain(cobra(), 60 + 20 * within(random), 3 * within(random))},
                                 {2}, {{0, 0, 0}, {200, 0, 0}});
        for (int i = 1; i <= wire.segments(); ++i)
            wire.tangents[i] =
                (wire.tangents[i - 1] + 0.15 * Vec3(within(random), within(random), within(random)))
                    .normalized();
        rebuild_joints(wire);
        const auto contacts = all_contacts(wire, wall);
        ASSERT_GT(total_energy(wire, contacts).wall, 0.1);
        const auto gradient = energy_gradient(wire, contacts);
        for (int i = 1; i <= wire.segments(); ++i) {
            Vec3 a, b;
            tangent_basis(wire.tangents[i], a, b);
            const auto total = [&](const Eigen::VectorXd& t) {
                Chain turned = wire;
                turned.tangents[i] = (wire.tangents[i] + t[0] * a + t[1] * b).normalized();
                rebuild_joints(turned);
                return total_energy(turned, all_contacts(turned, wall)).total();
            };
            const Eigen::VectorXd slope = finite_gradient(total, Eigen::VectorXd::Zero(2), 1e-5);
            const double scale = std::max({1.0, gradient[i].norm(), wire.spring_constant(i - 1)});
            EXPECT_NEAR(slope[0], gradient[i].dot(a), 1e-7 * scale) << round << " at " << i;
            EXPECT_NEAR(slope[1], gradient[i].dot(b), 1e-7 * scale) << round << " at " << i;
        }
        // The torque at each hub.
        const auto loads = hub_loads(wire, contacts);
        for (int k : {0, 1}) {
            const auto total = [&](double turn) {
                Chain turned = wire;
                rotate(turned, k, turn);
                return total_energy(turned, contacts).total();
            };
            EXPECT_NEAR(loads[k].torque, (total(1e-4) - total(-1e-4)) / 2e-4, 1e-6);
        }
    }
}

/// A wire and a Cobra catheter in a bent vessel, at rest.
struct InAVessel {
    explicit InAVessel(double wire_inside = 190, double catheter_inside = 0, double friction = 0,
                       bool shaped = true, double radius = 4.0)
        : wall(bent_vessel(radius)), hub({}, wall) {
        DeviceSpec inner = angled_wire(), outer = cobra();
        inner.friction = outer.friction = friction;
        if (!shaped) outer.shape.clear();
        wire = chain_along({on_chain(inner, wire_inside), on_chain(outer, catheter_inside)}, {2},
                           wall.centreline());
        hub.settle(wire, plenty);
        start_grips(wire);
        if (friction > 0) hub.settle(wire, plenty);
    }
    /// Moves a device by parts of at most 1 mm or 5°.
    void move(int device, double mm, double turn = 0) {
        const int parts =
            std::max(1, static_cast<int>(std::ceil(std::max(std::abs(mm), std::abs(turn) / 0.09))));
        for (int k = 0; k < parts; ++k) {
            double left = 1;
            for (int tries = 0; left > 1e-9 && tries < 64; ++tries) {
                const HubReport report =
                    hub.move(wire, {left * mm / parts, left * turn / parts, device}, plenty);
                ASSERT_EQ(report.outcome, HubReport::Outcome::AtRest) << device << " " << mm << " " << turn;
                ASSERT_TRUE(report.relax.converged());
                left -= mm != 0 ? report.made.feed / (mm / parts) : report.made.turn / (turn / parts);
            }
        }
    }
    double energy() const { return total_energy(wire, all_contacts(wire, wall)).total(); }

    TubeWall wall;
    Hub hub;
    Chain wire;
};

TEST(Coaxial, ACatheterOverAFixedWireAndBackLeavesItAsItWas) {
    InAVessel vessel;
    const std::vector<Vec3> before = vessel.wire.joints;
    vessel.move(1, 150);
    EXPECT_NEAR(vessel.wire.devices[1].inserted, 150, 1e-9);
    EXPECT_NEAR(vessel.wire.devices[0].inserted, 190, 1e-9);
    double moved = 0;
    for (std::size_t j = 0; j < before.size(); ++j)
        moved = std::max(moved, (vessel.wire.joints[j] - before[j]).norm());
    EXPECT_GT(moved, 0.5);  // the catheter bends the wire
    vessel.move(1, -150);
    EXPECT_EQ(vessel.wire.devices[1].inserted, 0);
    for (std::size_t j = 0; j < before.size(); ++j)
        EXPECT_LT((vessel.wire.joints[j] - before[j]).norm(), 1e-6) << j;
}

TEST(Coaxial, TheLongestDeviceMakesTheChain) {
    InAVessel vessel(120, 0);
    vessel.move(1, 150);
    EXPECT_NEAR(vessel.wire.inserted_length(), 150, 1e-9);  // the wire's tip is inside the catheter
    vessel.move(0, -120);
    EXPECT_EQ(vessel.wire.devices[0].inserted, 0);
    EXPECT_NEAR(vessel.wire.inserted_length(), 150, 1e-9);
    vessel.move(1, -20);
    EXPECT_NEAR(vessel.wire.inserted_length(), 130, 1e-9);
    vessel.move(0, 170);
    EXPECT_NEAR(vessel.wire.inserted_length(), 170, 1e-9);
    vessel.move(every_device, 10);
    EXPECT_NEAR(vessel.wire.devices[0].inserted, 180, 1e-9);
    EXPECT_NEAR(vessel.wire.devices[1].inserted, 140, 1e-9);
    EXPECT_TRUE(validate(vessel.wire).empty());
}

TEST(Coaxial, TheHandsWorkIsTheChangeOfEnergy) {
    // Over a catheter pushed over a wire, a wire pushed through it and a turn of each hub.
    InAVessel vessel(190, 0);
    const auto insert = [&](int device, double mm, double turn) {
        const double before = vessel.energy();
        double work = 0, scale = 0;
        const int steps = 307;  // so that they do not fall together with joints
        HubLoad last = hub_loads(vessel.wire, vessel.hub.contacts())[device];
        for (int k = 0; k < steps; ++k) {
            vessel.move(device, mm / steps, turn / steps);
            const HubLoad now = hub_loads(vessel.wire, vessel.hub.contacts())[device];
            const double part =
                0.5 * (last.push + now.push) * mm / steps + 0.5 * (last.torque + now.torque) * turn / steps;
            work += part;
            scale += std::abs(part);
            last = now;
        }
        EXPECT_NEAR(vessel.energy() - before, work, 0.01 * scale + 1e-3)
            << device << " " << mm << " " << turn;
    };
    insert(1, 60, 0);
    insert(1, 0, 0.8);
    insert(0, 0, -0.7);
    insert(0, 6, 0);
    insert(1, 60, 0);
}

/// Of a wire and a catheter that both wind up, turned at their hubs.
TEST(Coaxial, ShaftsThatWindUpRestWhereTheirTorquesBalance) {
    for (const auto& [wire_gj, catheter_gj] : {std::pair(400.0, 0.0), {0.0, 800.0}, {400.0, 800.0}}) {
        InAVessel vessel(170, 0);
        vessel.wire.devices[0].spec.sections = angled_wire(wire_gj).sections;
        vessel.wire.devices[1].spec.sections = cobra(catheter_gj).sections;
        assign(vessel.wire);
        vessel.hub.settle(vessel.wire, plenty);
        vessel.move(1, 150);
        double turned[2] = {0, 0};
        std::mt19937 random(11);
        for (int k = 0; k < 24; ++k) {
            const int device = static_cast<int>(random() % 2);
            const double turn = (random() % 2 ? 1 : -1) * 8 * degree;
            const double before = vessel.energy();
            const HubLoad load = hub_loads(vessel.wire, vessel.hub.contacts())[device];
            vessel.move(device, 0, turn);
            turned[device] += turn;
            const auto contacts = all_contacts(vessel.wire, vessel.wall);
            EXPECT_LT(relative_gradient(vessel.wire, contacts), 1e-7);
            const HubLoad now = hub_loads(vessel.wire, vessel.hub.contacts())[device];
            // The hands' work to second order, unless the tip has sprung.
            const double work = 0.5 * (load.torque + now.torque) * turn;
            EXPECT_LT(vessel.energy() - before, work + 0.02 * std::abs(work) + 2e-3);
        }
        for (int k : {0, 1}) {
            const Device& device = vessel.wire.devices[k];
            EXPECT_NEAR(std::remainder(device.roll + device.windup - turned[k], 2 * M_PI), 0, 1e-9);
            EXPECT_EQ(device.windup != 0, device.spec.twists());
        }
    }
}

/// The turn of the shapes against the hubs, minimised over by hand.
TEST(Coaxial, AStifferShaftFollowsItsHubCloser) {
    double before = 1e9;
    for (const double gj : {50.0, 200.0, 800.0, 1e5}) {
        InAVessel vessel(150, 150);
        vessel.move(0, -150);
        vessel.wire.devices[1].spec.sections = cobra(gj).sections;
        assign(vessel.wire);
        vessel.hub.settle(vessel.wire, plenty);
        vessel.move(1, 0, 40 * degree);
        const double lag = std::abs(vessel.wire.devices[1].windup);
        EXPECT_GT(lag, 0);
        EXPECT_LT(lag, before);
        before = lag;
    }
    EXPECT_LT(before, 1 * degree);
}

/// A shaft that no bend holds turns at once, also one whose bend is not inside yet, and is at rest.
TEST(Coaxial, WithoutABendOnTheChainAShaftDoesNotWindUp) {
    InAVessel vessel(150, 0);
    DeviceSpec& spec = vessel.wire.devices[1].spec;
    spec.sections = cobra(400).sections;
    spec.shape = {{30, 0, 0}, {15, 1, 0}};  // straight before the bend
    assign(vessel.wire);
    vessel.hub.settle(vessel.wire, plenty);
    vessel.move(1, 10);
    vessel.move(1, 0, 0.5);
    EXPECT_EQ(vessel.wire.devices[1].windup, 0);
    EXPECT_NEAR(vessel.wire.devices[1].roll, 0.5, 1e-12);
    vessel.move(1, 60);
    vessel.move(1, 0, 0.5);
    EXPECT_NE(vessel.wire.devices[1].windup, 0);
    vessel.move(1, -70);
    EXPECT_EQ(vessel.wire.devices[1].windup, 0);
    EXPECT_NEAR(vessel.wire.devices[1].roll, 1, 1e-9);
}

TEST(Coaxial, AThickDeviceLiesFartherFromTheWall) {
    // Its axis can be off the vessel's by 4 − 0.835 mm, a wire's by 4 − 0.45.
    InAVessel vessel(150, 150);
    vessel.move(0, -150);
    const auto contacts = all_contacts(vessel.wire, vessel.wall);
    for (int j = 1; j < vessel.wire.segments() - 2; ++j) {
        EXPECT_NEAR(vessel.wire.thickness[j], 0.5 * (1.67 - 0.889), 1e-12);
        EXPECT_NEAR(contacts[j].clearance, 4.0 - 0.45 - 0.5 * (1.67 - 0.889), 1e-12);
    }
}

TEST(Coaxial, AWireStaysWhileACatheterIsPulledBackOverItsPinnedEnd) {
    InAVessel vessel(200, 160, 0.05, false, 1.2);  // which leaves the catheter little way aside
    const Vec3 tip = vessel.wire.tip();
    double farthest = 0;
    for (int k = 0; k < 60; ++k) {
        vessel.move(1, -1);
        farthest = std::max(farthest, (vessel.wire.tip() - tip).norm());
    }
    EXPECT_LT(farthest, 1.0);
}

TEST(Coaxial, MotionsNobodyChoseEndAtRestInsideTheVessel) {
    for (const unsigned seed : {1u, 2u, 3u}) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> within(-1, 1);
        InAVessel vessel(150, 40, seed == 1 ? 0.0 : 0.08);
        int refused = 0, moved = 0;
        for (int k = 0; k < 400; ++k) {
            const int device = static_cast<int>(random() % 3) - 1;
            const double mm = std::abs(within(random)) < 0.5 ? 0 : 1.0 * within(random) + 0.25;
            const double turn = mm == 0 ? 10 * degree * within(random) : 0;
            double longest = 0;
            for (const Device& d : vessel.wire.devices) longest = std::max(longest, d.inserted);
            if (longest > 230 && mm > 0) continue;
            const HubReport report = vessel.hub.move(vessel.wire, {mm, turn, device}, plenty);
            ASSERT_NE(report.outcome, HubReport::Outcome::Working);
            refused += report.outcome == HubReport::Outcome::Refused;
            ++moved;
            ASSERT_TRUE(validate(vessel.wire).empty()) << seed << " " << k;
            const auto contacts = all_contacts(vessel.wire, vessel.wall);
            ASSERT_LT(largest_penetration(contacts), 1.0) << seed << " " << k;
        }
        EXPECT_GT(moved, 200) << seed;
        EXPECT_LT(refused, moved / 20) << seed;
    }
}

}  // namespace
}  // namespace physics
