/// A shaft that winds up: its torque, its rest, and the whip of a tip that is let go.

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/anatomy/scenes.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

namespace physics {
namespace {

constexpr int sufficient = 10'000'000;

/// A wire with a curved tip in a bend, where its tip has preferred directions.
struct InABend {
    explicit InABend(double torsional_rigidity, double friction = 0)
        : wall(anatomy::draw(
                   std::vector<anatomy::PenMove>{anatomy::Run{60}, anatomy::Arc{30, 1.6}, anatomy::Run{80}}),
               2.5, 5, 0.4),
          hub({}, wall) {
        GuidewireSpec spec;
        spec.curved_length = 20;
        spec.curved_angle = 1;
        spec.torsional_rigidity = torsional_rigidity;
        spec.friction = friction;
        wire = wire_of_length(spec, wall.centreline(), 110);
        hub.settle(wire, sufficient);
        start_grips(wire);
        hub.settle(wire, sufficient);
    }
    HubReport turn(double angle) {
        const HubReport report = hub.move(wire, {0, angle}, sufficient);
        EXPECT_EQ(report.outcome, HubReport::Outcome::AtRest);
        EXPECT_TRUE(report.relax.converged);
        return report;
    }
    double energy() const { return total_energy(wire, all_contacts(wire, wall)).total(); }

    TubeWall wall;
    Hub hub;
    Guidewire wire;
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
    GuidewireSpec spec;
    spec.torsional_rigidity = 188;
    spec.tip_rigidity = spec.shaft_rigidity;  // GJ is then the same everywhere
    const Guidewire wire = straight_wire(spec, {0, 0, 0}, {1, 0, 0}, 100);
    const double length = wire.inserted_length() - wire.curved_segments() * spec.segment_length;
    EXPECT_NEAR(wire.windup_stiffness(), 188 / length, 1e-9);
    spec.torsional_rigidity = 0;
    EXPECT_EQ(straight_wire(spec, {0, 0, 0}, {1, 0, 0}, 100).windup_stiffness(), 0);
    spec.torsional_rigidity = 188;
    spec.curved_angle = 0;  // nothing holds its tip
    EXPECT_EQ(straight_wire(spec, {0, 0, 0}, {1, 0, 0}, 100).windup_stiffness(), 0);
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
    const double k = bend.wire.windup_stiffness();
    double roll = bend.wire.roll;  // it has unwound at the start already
    for (int turn = 1; turn <= 90; ++turn) {
        const double before = bend.wire.roll;
        bend.turn(step);
        roll += std::remainder(bend.wire.roll - before, 2 * M_PI);
        EXPECT_NEAR(roll + bend.wire.windup, turn * step, 1e-9);
        // dE/droll of the rigid wire there is the spring's torque.
        const int at = static_cast<int>(std::lround(roll / step));
        if (at < 1) continue;
        const double slope = (energies[at + 1] - energies[at - 1]) / (2 * step);
        const double bent = (energies[at + 1] - 2 * energies[at] + energies[at - 1]) / (step * step);
        EXPECT_NEAR(slope + bent * (roll - at * step), k * bend.wire.windup, 4e-3) << turn;
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
    const double per_rigidity = InABend(1000).wire.windup_stiffness() / 1000;
    double largest[2] = {};
    for (const bool soft : {false, true}) {
        InABend bend((soft ? 0.85 : 1.2) * critical / per_rigidity);
        for (double turned = 0; turned < 2 * M_PI; turned += degree) {
            const double before = bend.wire.roll;
            bend.turn(degree);
            largest[soft] =
                std::max(largest[soft], std::abs(std::remainder(bend.wire.roll - before, 2 * M_PI)));
        }
    }
    EXPECT_LT(largest[0], 12 * degree) << "critical stiffness " << critical;
    EXPECT_GT(largest[1], 25 * degree) << "critical stiffness " << critical;
}

TEST(Torsion, WildHandsWithFrictionEndAtRest) {
    int refused = 0, motions = 0;
    for (unsigned seed = 0; seed < 12; ++seed) {
        std::mt19937 random(seed);
        const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
        InABend bend(std::exp(std::log(30.0) + 6 * unit()), seed % 3 == 0 ? 0 : 0.3 * unit());
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

}  // namespace
}  // namespace physics
