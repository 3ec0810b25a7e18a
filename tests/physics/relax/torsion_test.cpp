/// A shaft that winds up: its torque, its rest, and the whip of a tip that is let go.

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/anatomy/scenes.h"
#include "engine/studies/plain_wire.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

namespace physics {
namespace {

constexpr int sufficient = 10'000'000;

/// A wire with a curved tip in a bend, where its tip has preferred directions.
struct InABend {
    explicit InABend(double torsional_rigidity, double friction = 0, bool segments = false)
        : wall(anatomy::draw(
                   std::vector<anatomy::PenMove>{anatomy::Run{60}, anatomy::Arc{30, 1.6}, anatomy::Run{80}}),
               2.5, 5, 0.4),
          hub({}, wall) {
        studies::PlainWire spec{.curved_length = 20,
                                .curved_angle = 1,
                                .friction = friction,
                                .torsional_rigidity = torsional_rigidity};
        wire = wire_of_length(spec, wall.centreline(), 110);
        hub.settle(wire, sufficient);
        if (segments) start_twists(wire, 0);
        start_grips(wire);
        hub.settle(wire, sufficient);
    }
    HubReport turn(double angle) {
        const HubReport report = hub.move(wire, {0, angle}, sufficient);
        EXPECT_EQ(report.outcome, HubReport::Outcome::AtRest);
        EXPECT_TRUE(report.relax.converged());
        return report;
    }
    double energy() const { return total_energy(wire, all_contacts(wire, wall)).total(); }

    TubeWall wall;
    Hub hub;
    Chain wire;
};

/// Energy of the torsionally rigid wire at rolls in whole steps.
std::vector<double> rigid_energies(double step, int count) {
    InABend rigid(0);
    std::vector<double> energies = {rigid.energy()};
    for (int k = 0; k < count; ++k) {
        rigid.turn(step);
        energies.push_back(rigid.energy());
    }
    return energies;
}

TEST(Torsion, AShaftWindsUpByTheSumOfItsGive) {
    studies::PlainWire spec{.torsional_rigidity = 188};
    spec.tip_rigidity = spec.shaft_rigidity;  // GJ is then the same everywhere
    const auto stiffness = [&] {
        return straight_wire(spec, {0, 0, 0}, {1, 0, 0}, 100).devices[0].windup_stiffness;
    };
    EXPECT_NEAR(stiffness(), 188 / (200 - spec.curved_length), 1e-9);
    spec.tip_rigidity = 6;  // each section by itself, and the transition by its integral
    double give = 0;
    for (double s = spec.curved_length + 5e-4; s < 200; s += 1e-3)
        give += 1e-3 / torsional_rigidity_at(spec.device(), s);
    EXPECT_NEAR(stiffness(), 1 / give, 1e-6 / give);
    spec.torsional_rigidity = 0;
    EXPECT_EQ(stiffness(), 0);
    spec.torsional_rigidity = 188;
    spec.curved_angle = 0;  // nothing holds its tip
    EXPECT_EQ(stiffness(), 0);
}

TEST(Torsion, TheHubsTorqueIsTheSlopeOfTheEnergy) {
    InABend bend(1000);
    for (int k = 0; k < 40; ++k) {
        const double h = 1e-3;
        bend.turn(0.05);
        const double low = bend.energy();
        const double torque = bend.turn(h).relax.base_torque;
        const double high = (bend.turn(h), bend.energy());
        EXPECT_NEAR((high - low) / (2 * h), torque, 1e-4 + 1e-3 * std::abs(torque)) << k;
        EXPECT_LT(relative_gradient(bend.wire, all_contacts(bend.wire, bend.wall)), 1e-7);
    }
}

TEST(Torsion, ItsRestIsThatOfTheRigidWireOnASpring) {
    constexpr double step = 2 * degree;
    const std::vector<double> energies = rigid_energies(step, 180);
    InABend bend(1500);
    const double k = bend.wire.devices[0].windup_stiffness;
    double roll = bend.wire.devices[0].roll;  // it has unwound at the start already
    for (int turn = 1; turn <= 90; ++turn) {
        const double before = bend.wire.devices[0].roll;
        bend.turn(step);
        roll += std::remainder(bend.wire.devices[0].roll - before, 2 * M_PI);
        EXPECT_NEAR(roll + bend.wire.devices[0].windup, turn * step, 1e-9);
        // dE/droll of the rigid wire there is the spring's torque.
        const int at = static_cast<int>(std::lround(roll / step));
        if (at < 1) continue;
        const double slope = (energies[at + 1] - energies[at - 1]) / (2 * step);
        const double bent = (energies[at + 1] - 2 * energies[at] + energies[at - 1]) / (step * step);
        EXPECT_NEAR(slope + bent * (roll - at * step), k * bend.wire.devices[0].windup, 4e-3) << turn;
    }
}

/// Where the rigid wire's energy falls off more steeply than the shaft's spring, the tip lets go and whips
/// round.
TEST(Torsion, ATipWhipsRoundOnlyBelowTheCriticalStiffness) {
    constexpr double step = 2 * degree;
    const std::vector<double> energies = rigid_energies(step, 180);
    double critical = 0;
    for (std::size_t k = 1; k + 1 < energies.size(); ++k)
        critical = std::max(critical, -(energies[k + 1] - 2 * energies[k] + energies[k - 1]) / (step * step));
    const double per_rigidity = InABend(1000).wire.devices[0].windup_stiffness / 1000;
    double largest[2] = {};
    for (const bool soft : {false, true}) {
        InABend bend((soft ? 0.85 : 1.2) * critical / per_rigidity);
        for (double turned = 0; turned < 2 * M_PI; turned += degree) {
            const double before = bend.wire.devices[0].roll;
            bend.turn(degree);
            largest[soft] = std::max(largest[soft],
                                     std::abs(std::remainder(bend.wire.devices[0].roll - before, 2 * M_PI)));
        }
    }
    EXPECT_LT(largest[0], 12 * degree) << "critical stiffness " << critical;
    EXPECT_GT(largest[1], 25 * degree) << "critical stiffness " << critical;
}

void be_wild(bool segments) {
    int refused = 0, motions = 0;
    for (unsigned seed = 0; seed < 12; ++seed) {
        std::mt19937 random(seed);
        const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
        InABend bend(std::exp(std::log(30.0) + 6 * unit()), seed % 3 == 0 ? 0 : 0.3 * unit(), segments);
        for (int k = 0; k < 80; ++k, ++motions) {
            const HubMotion motion = {random() % 2 == 0 ? 4 * (unit() - 0.45) : 0,
                                      random() % 2 == 0 ? 0.34 * (unit() - 0.5) : 0};
            const double length = bend.wire.inserted_length();
            const HubReport report = bend.hub.move(bend.wire, motion, sufficient);
            refused += report.outcome == HubReport::Outcome::Refused;
            ASSERT_NE(report.outcome, HubReport::Outcome::Working);
            ASSERT_TRUE(validate(bend.wire).empty()) << "seed " << seed << ", motion " << k;
            ASSERT_NEAR(bend.wire.inserted_length(), length + report.made.feed, 1e-9);
            ASSERT_LT(relative_gradient(bend.wire, all_contacts(bend.wire, bend.wall)), 1e-6)
                << "seed " << seed << ", motion " << k;
        }
    }
    EXPECT_LE(refused, motions / 100);
}

TEST(Torsion, WildHandsOnAShaftThatTwistsAsAWholeOrSegmentBySegmentEndAtRest) {
    for (const bool segments : {false, true}) {
        SCOPED_TRACE(segments ? "segment by segment" : "as a whole");
        be_wild(segments);
    }
}

/// Without friction the torque is the same all along the shaft: it then winds up as a whole, but that the
/// curved tip gives as well.
TEST(Torsion, WithoutFrictionSegmentsTwistAsTheWholeShaftDoes) {
    InABend whole(1000), segments(1000, 0, true);
    for (int k = 0; k < 30; ++k) {
        const double torque = whole.turn(0.1).relax.base_torque, each = segments.turn(0.1).relax.base_torque;
        const Chain& wire = segments.wire;
        const Device& device = wire.devices[0];
        const int shaft = wire.segments() - 11;  // 20 mm of shape and a last segment of up to 3 mm
        for (int i = 1; i <= shaft; ++i)
            ASSERT_NEAR(-device.torsion[i] * (device.wound[i] - device.wound[i - 1]), each,
                        1e-6 + 1e-6 * std::abs(each))
                << k << " " << i;
        EXPECT_NEAR(each, torque, 0.05 * std::abs(torque) + 0.02) << k;
    }
}

/// A straight wire in a narrow tube, pressed down on all its length.
struct Pressed {
    static constexpr double length = 200, rigidity = 20, load = 0.02, friction = 0.1;  // [mm, N·mm², N/mm, -]
    Pressed() : wall({{0, 0, 0}, {300, 0, 0}}, 0.05, 20), hub({}, wall) {
        studies::PlainWire spec = studies::PlainWire::uniform(500, 2);
        spec.diameter = 0.9;
        spec.torsional_rigidity = rigidity;
        spec.friction = friction;
        // Along the wall: what the introducer bears would not press.
        wire = wire_of_length(spec, {{0, 0, -0.05}, {300, 0, -0.05}}, length);
        wire.load = {0, 0, -load};
        hub.settle(wire, sufficient);
        start_twists(wire, 0);
        start_grips(wire);
        hub.settle(wire, sufficient);
    }
    /// Turn of the distal end that it has not made.
    double lag() const { return wire.devices[0].wound_up(); }

    TubeWall wall;
    Hub hub;
    Chain wire;
};

/// DEVICES: the tip follows when the hub has turned by μqrℓ²/2GJ. A wire that rolls in a tube climbs its wall
/// to the angle of friction, so that of the load only 1/√(1 + μ²) presses.
TEST(Torsion, FrictionHoldsAPressedShaftBackByItsClosedForm) {
    Pressed p;
    const double pressed = Pressed::load / std::sqrt(1 + Pressed::friction * Pressed::friction);
    const double expected =
        Pressed::friction * pressed * 0.45 * Pressed::length * Pressed::length / (2 * Pressed::rigidity);
    double turned = 0, energy = 0, work = 0, torque = 0;
    const auto stored = [&] { return total_energy(p.wire, all_contacts(p.wire, p.wall)).total(); };
    energy = stored();
    const double loss = p.wire.friction_loss;
    for (int k = 0; k < 80; ++k) {
        const HubReport report = p.hub.move(p.wire, {0, 0.05}, sufficient);
        ASSERT_EQ(report.outcome, HubReport::Outcome::AtRest) << k;
        ASSERT_TRUE(report.relax.converged()) << k;
        turned += 0.05;
        work += 0.5 * (torque + report.relax.base_torque) * 0.05;
        torque = report.relax.base_torque;
        ASSERT_NEAR(relative_gradient(p.wire, all_contacts(p.wire, p.wall)), 0, 1e-6) << k;
    }
    EXPECT_NEAR(p.lag(), expected, 0.02 * expected);
    EXPECT_NEAR(torque, Pressed::friction * pressed * 0.45 * Pressed::length, 0.02 * torque);
    EXPECT_NEAR(work, stored() - energy + p.wire.friction_loss - loss, 0.02 * work);
    // Turned back, friction holds the other way.
    for (int k = 0; k < 120; ++k) p.hub.move(p.wire, {0, -0.05}, sufficient);
    EXPECT_NEAR(p.lag(), -expected, 0.02 * expected);
}

/// Advancing while turning lets the torque out: slip along the wire takes the whole grip.
TEST(Torsion, AFeedLetsHeldTorqueOut) {
    Pressed p;
    for (int k = 0; k < 20; ++k) p.hub.move(p.wire, {0, 0.05}, sufficient);
    const double held = std::abs(p.hub.settle(p.wire, sufficient).relax.base_torque);
    ASSERT_GT(held, 0.05);
    for (int k = 0; k < 30; ++k) p.hub.move(p.wire, {1, 0}, sufficient);
    EXPECT_LT(std::abs(p.hub.settle(p.wire, sufficient).relax.base_torque), 0.1 * held);
}

}  // namespace
}  // namespace physics
