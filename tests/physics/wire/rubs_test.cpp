/// Friction of devices in each other and in their valves, against closed forms.

#include <array>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <limits>

#include "engine/anatomy/scenes.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/drag.h"
#include "physics/wire/energy.h"
#include "physics/wire/friction.h"
#include "physics/wire/torsion.h"

namespace physics {
namespace {

constexpr int unbounded = 1'000'000'000;

Device device_of(double diameter, double rigidity, double inserted) {
    Device device;
    device.spec.outer_diameter = diameter;
    device.spec.sections = soft_tip(rigidity, 0, 0, rigidity);
    device.spec.length = 1e4;
    device.inserted = inserted;
    return device;
}

/// Devices in a tube, at rest, under hands.
class InTube {
public:
    InTube(const Polyline& line, double radius, std::vector<Device> devices, double lambda,
           const Vec3& load = Vec3::Zero())
        : wall_(line, radius, 20 * lambda, 0), hub_({}, wall_) {
        chain = chain_along(std::move(devices), {lambda, EndCells::Half}, line);
        chain.load = load;
        hub_.settle(chain, unbounded);
        start_grips(chain);
        start_rubs(chain);
        hub_.settle(chain, unbounded);
        follow_rubs(chain, hub_.contacts());
    }
    void twist_by_segments(int device) {
        start_twists(chain, device);
        hub_.settle(chain, unbounded);
    }
    /// The motion, and what friction drags along. Returns the number of its parts.
    int move(int device, double mm, double turn = 0) {
        const HubReport report = hub_.move(chain, {mm, turn, device}, unbounded);
        EXPECT_EQ(report.outcome, HubReport::Outcome::AtRest);
        EXPECT_NEAR(report.made.feed, mm, 1e-12);
        EXPECT_NEAR(report.made.turn, turn, 1e-12);
        search_.restart();
        while (const auto next = drag(chain, hub_.contacts(), hub_.loads(), search_)) {
            if (search_.tries > 20) break;
            EXPECT_EQ(hub_.move(chain, {next->feed, next->turn, next->device}, unbounded).outcome,
                      HubReport::Outcome::AtRest);
            turned[next->device] += next->turn;
        }
        follow_rubs(chain, hub_.contacts());
        return search_.tries;
    }
    double push(int device) const { return hub_.loads()[device].push; }
    double torque(int device) const { return hub_.loads()[device].torque; }
    std::span<const WallContact> contacts() const { return hub_.contacts(); }
    double energy() const { return total_energy(chain, all_contacts(chain, wall_)).total(); }
    double loss() const { return chain.friction_loss + chain.rub_loss; }

    Chain chain;
    std::array<double, most_devices> turned = {};  // by friction [rad]

private:
    TubeWall wall_;
    Hub hub_;
    DragSearch search_;
};

Polyline bend_of(double radius, double angle, double before, double after) {
    return anatomy::draw(std::vector<anatomy::PenMove>{
        anatomy::Run{before}, anatomy::Arc{radius, angle * degree}, anatomy::Run{after}});
}

/// A limp wire through a catheter that lies in a bend and ends beyond it, against a weight beyond.
InTube capstan_of(double angle, double slides, double still) {
    constexpr double radius = 30, run = 150, weight = 0.01;
    const double tip = 10 + radius * angle * degree + 20;
    const Polyline line = bend_of(radius, angle, 10, run + 80);
    const Vec3 beyond = (line.back() - line[line.size() - 2]).normalized();
    Device wire = device_of(0.3, 0.05, tip + run), catheter = device_of(1.4, 60, tip);
    catheter.spec.inner_diameter = 0.9;
    catheter.spec.inner_friction = slides;
    catheter.spec.static_inner_friction = still;
    return InTube(line, 0.8, {wire, catheter}, 1, weight * beyond);
}

}  // namespace

/// T₂ = T₁ e^{μθ}, θ the turn of the catheter: of a known shape, drawn at with T₁ beyond it.
TEST(Rubs, TheTensionGrowsByTheCapstansLaw) {
    for (const double angle : {60.0, 120.0, 180.0})
        for (const double mu : {0.05, 0.1, 0.2}) {
            constexpr double radius = 30, tension = 0.7;
            const double tip = 10 + radius * angle * degree + 20;
            Device wire = device_of(0.3, 1e-3, tip + 30), catheter = device_of(1.4, 60, tip);
            catheter.spec.inner_friction = mu;
            Chain chain = chain_along({wire, catheter}, {1, EndCells::Half}, bend_of(radius, angle, 10, 80));
            start_rubs(chain);
            std::vector<WallContact> contacts(chain.joints.size());
            contacts.back().stiffness = 1;
            contacts.back().penetration = tension;
            contacts.back().normal = -chain.tangents.back();
            for (const int way : {1, -1}) {
                chain.rubs[0].slide.x() = -way * slip_length;
                double friction = 0;
                for (const LumenContact& contact : lumen_contacts(chain, contacts, 1))
                    friction += contact.friction;
                const double exact = tension * std::exp(way * mu * angle * degree);
                EXPECT_NEAR(tension + friction, exact, 1e-3 * exact) << angle << " deg, mu " << mu;
                std::vector<HubLoad> loads(2);
                add_rubs(chain, contacts, loads);
                EXPECT_NEAR(loads[0].push, -friction, 1e-12);
                EXPECT_NEAR(loads[1].push, friction, 1e-12);
                if (way == 1)
                    std::printf("capstan in a catheter, %3.0f deg, mu %.2f: %.5f N, closed form %.5f N\n",
                                angle, mu, tension + friction, exact);
            }
        }
}

/// Of a chain at rest, against T' = μ|Tκ + w_n| + w_t with the weight w that draws it.
TEST(Rubs, AWireIsDrawnThroughABentCatheterByTheCapstansForce) {
    constexpr double weight = 0.01, radius = 30, before = 10;
    for (const double angle : {60.0, 120.0, 180.0})
        for (const double mu : {0.05, 0.1, 0.2}) {
            const double still = 1.5 * mu, whole = angle * degree;
            InTube at = capstan_of(angle, mu, still);
            const auto exact = [&](double mu) {
                double tension = weight * (at.chain.devices[0].inserted - before - radius * whole);
                constexpr int steps = 10'000;
                for (int k = 0; k < steps; ++k) {
                    const double turn = (k + 0.5) * whole / steps;
                    tension += (weight * std::cos(turn) + mu * (tension / radius + weight * std::sin(turn))) *
                               radius * whole / steps;
                }
                return tension + before * weight * (std::cos(whole) + mu * std::sin(whole));
            };
            const double alone = -at.push(0), outer = at.push(1);  // at ease
            EXPECT_NEAR(alone, exact(0), 0.01 * alone);
            double broken = 0;
            for (int k = 0; k < 300; ++k) {
                at.move(0, -0.0002);
                broken = std::max(broken, -at.push(0));
            }
            const double held = exact(still);
            EXPECT_NEAR(broken, held, 0.01 * held) << angle << " deg, mu " << still;
            for (int k = 0; k < 20; ++k) at.move(0, -0.5);
            const double drawn = -at.push(0), slides = exact(mu);
            EXPECT_NEAR(drawn, slides, 0.01 * slides) << angle << " deg, mu " << mu;
            std::printf(
                "wire in a catheter, %3.0f deg, mu %.2f: drawn %.4f N (closed form %.4f), breaks away "
                "at %.4f (%.4f)\n",
                angle, mu, drawn, slides, broken, held);
            // What the wire's hand bears by friction, the catheter's bears the other way.
            EXPECT_NEAR(at.push(1) - outer, drawn - exact(0), 0.03 * (drawn - exact(0)));
            for (int k = 0; k < 20; ++k) at.move(0, 0.5);
            EXPECT_NEAR(-at.push(0), exact(-mu), 0.01 * exact(-mu));
        }
}

/// A catheter of rest curvature κ⁰ = 4 κ_m s(L − s)/L² on a length L, with a stiff straight wire through it:
/// both have M = EI κ⁰, 1/EI = 1/EI_wire + 1/EI_catheter, so that it presses by |M''| = 8 κ_m EI/L² per
/// length along the bend, and by 4 κ_m EI/L at its two ends.
TEST(Rubs, AStraightenedCatheterPressesTheWireAsTheBeamsFormSays) {
    constexpr double length = 60, most = 1.0 / 60, lambda = 1, catheter_rigidity = 50, wire_rigidity = 2000;
    Device wire = device_of(0.5, wire_rigidity, 140), catheter = device_of(1.4, catheter_rigidity, 120);
    catheter.spec.inner_diameter = 0.9;
    constexpr int arcs = 120;
    catheter.spec.shape.push_back({20, 0, 0});
    for (int k = 0; k < arcs; ++k) {
        const double step = length / arcs, s = (k + 0.5) * step;
        catheter.spec.shape.push_back({step, step * 4 * most * s * (length - s) / (length * length), 0});
    }
    InTube at({{0, 0, 0}, {400, 0, 0}}, 100, {wire, catheter}, lambda);
    const std::vector<LumenContact> found = lumen_contacts(at.chain, at.contacts(), 1);
    const double both = 1 / (1 / wire_rigidity + 1 / catheter_rigidity);
    const double pressure = 8 * most * both / (length * length), end = 4 * most * both / length;
    double ends[2] = {}, place = 0, worst = 0;
    int within = 0;
    Vec3 sum = Vec3::Zero();
    for (int j = 1; j <= at.chain.segments(); ++j) {
        place += at.chain.lengths[j];
        const double s = place - (120 - 20 - length);
        sum += found[j].press;
        if (std::abs(s) <= 2) ends[0] += found[j].press.norm();
        if (std::abs(s - length) <= 2) ends[1] += found[j].press.norm();
        if (s < 4 || s > length - 4) continue;
        const double here = found[j].press.norm() / at.chain.length_of(j);
        worst = std::max(worst, std::abs(here / pressure - 1));
        ++within;
    }
    EXPECT_GT(within, 40);
    EXPECT_LT(worst, 0.01);
    // Each with what the bend presses within the 2 mm, which points the other way.
    for (const double force : ends) EXPECT_NEAR(force, end, 2.5 * pressure + 0.01 * end);
    EXPECT_LT(sum.norm(), 0.01 * end) << "they balance";
    std::printf(
        "straightened catheter: |q| %.6f N/mm, farthest %.3f %% off; ends %.5f, %.5f N (closed form %.5f)\n",
        pressure, 100 * worst, ends[0], ends[1], end);
    for (const LumenContact& contact : found) EXPECT_EQ(contact.friction, 0);
}

namespace {

/// A wire, a catheter and a sheath, or the first two, with all friction there is; `still`: static over
/// kinetic coefficients, 0 = none.
InTube with_all_friction(int count, double still, Torsion torsion) {
    using anatomy::Arc, anatomy::Run;
    const Polyline line = anatomy::draw(std::vector<anatomy::PenMove>{
        Run{30}, Arc{40, 1.2, Vec3::UnitZ()}, Run{10}, Arc{30, -1.3, Vec3::UnitY()}, Run{120}});
    Device wire = device_of(0.889, 150, 110.3), catheter = device_of(1.67, 200, 80.7),
           sheath = device_of(2.4, 400, 52.9);
    wire.spec.sections = soft_tip(6, 30, 60, 150, torsion == Torsion::Rigid ? 0 : 120);
    wire.spec.shape = {{12, 45 * degree, 0}};
    catheter.spec.shape = {{15, 60 * degree, 0}, {25, -40 * degree, 0.4}};
    catheter.spec.inner_diameter = 1.1;
    sheath.spec.inner_diameter = 1.9;
    std::vector<Device> devices = {wire, catheter, sheath};
    devices.resize(count);
    for (Device& device : devices) {
        device.spec.friction = 0.1;
        device.spec.inner_friction = 0.08;
        device.spec.valve_friction = 0.15;
        device.spec.static_friction = 0.1 * still;
        device.spec.static_inner_friction = 0.08 * still;
        device.spec.static_valve_friction = 0.15 * still;
    }
    InTube made(line, 4, devices, 2);
    if (torsion == Torsion::Segments) made.twist_by_segments(0);
    return made;
}

}  // namespace

/// Fed, turned and both, from stick to slip and on: over all steps within 1 % of the work of each hand's
/// part.
TEST(Rubs, TheHandsWorkIsTheGainOfEnergyAndTheLoss) {
    constexpr double step = 0.0125, turn = 0.02;
    struct Way {
        double mm, angle;
    };
    for (const int count : {2, 3})
        for (const double still : {0.0, 1.4})
            for (const Torsion torsion : {Torsion::Rigid, Torsion::Whole, Torsion::Segments}) {
                InTube at = with_all_friction(count, still, torsion);
                ASSERT_EQ(at.chain.rubs.size(), count == 2 ? 3u : 6u);
                for (int device = 0; device < count; ++device)
                    for (const Way way : {Way{step, 0}, Way{-step, 0}, Way{0, turn}, Way{0, -turn},
                                          Way{step, turn}, Way{-step, turn}}) {
                        // A step in which something lets go has no mean force.
                        double missing = 0, work = 0;
                        int counted = 0;
                        let_rest(at.chain, 0), let_rest(at.chain, rest_time);
                        for (int k = 0; k < 24; ++k) {
                            const double push = at.push(device), torque = at.torque(device),
                                         energy = at.energy() + at.loss();
                            const auto holding = [&] {
                                const auto rests = [](const auto& one) { return one.rested >= rest_time; };
                                return std::ranges::count_if(at.chain.rubs, rests) +
                                       std::ranges::count_if(at.chain.grips, rests);
                            };
                            const auto held = holding();
                            at.move(device, way.mm, way.angle);
                            const double made = 0.5 * ((push + at.push(device)) * way.mm +
                                                       (torque + at.torque(device)) * way.angle);
                            if (still > 0 && holding() < held) continue;
                            ++counted;
                            missing += at.energy() + at.loss() - energy - made;
                            work += std::abs(made);
                        }
                        EXPECT_GE(counted, 12);
                        EXPECT_LT(std::abs(missing), 0.01 * work)
                            << count << " devices, " << device << ": " << way.mm << ", " << way.angle << ", "
                            << still << ", " << static_cast<int>(torsion);
                        std::printf(
                            "%d devices, %d by %+.4f mm, %+.3f rad, static %.1f, torsion %d: work "
                            "%.4f N mm, missing %.3f %%\n",
                            count, device, way.mm, way.angle, still, static_cast<int>(torsion), work,
                            100 * missing / work);
                    }
                EXPECT_GT(at.chain.rub_loss, 0.01);
            }
}

/// Along by F v/√(v² + (rω)²), about the axis by r F rω/√(v² + (rω)²): in a valve, and in a catheter that a
/// stiff wire straightens, by the μN that draws it without a turn.
TEST(Rubs, ATurnMakesASlideEasierByCoulombsCircle) {
    constexpr double force = 0.2, r = 0.4445;
    for (const bool in_lumen : {false, true})
        for (const double ratio : {0.0, 0.3, 1.0, 3.0, 10.0}) {  // rω/v
            Device wire = device_of(2 * r, 800, 140), catheter = device_of(1.67, 100, 120);
            catheter.spec.inner_diameter = 1.1;
            catheter.spec.shape = {{20, 0, 0}, {60, 60 * degree, 0}};
            if (in_lumen)
                catheter.spec.inner_friction = 0.3;
            else
                wire.spec.valve_friction = force;
            std::vector<Device> devices = {wire};
            if (in_lumen) devices.push_back(catheter);
            InTube at({{0, 0, 0}, {400, 0, 0}}, 100, devices, 2);
            const double free = at.push(0), untwisted = at.torque(0);
            const double step = 0.02 / std::hypot(1, ratio), turn = ratio * step / r;
            for (int k = 0; k < 30; ++k) at.move(0, step, turn);
            double normal = 0;
            if (in_lumen) {
                for (const LumenContact& contact : lumen_contacts(at.chain, at.contacts(), 1))
                    normal += contact.press.norm();
                EXPECT_GT(normal, 0.5);
            }
            const double most = in_lumen ? 0.3 * normal : force;
            const double push = most / std::hypot(1, ratio), torque = r * push * ratio;
            EXPECT_NEAR(at.push(0) - free, push, 0.01 * push) << ratio;
            EXPECT_NEAR(at.torque(0) - untwisted, torque, 0.01 * torque + 1e-9) << ratio;
            std::printf("%s, r omega/v %4.1f: %.5f N (closed form %.5f), %.5f N mm (%.5f)\n",
                        in_lumen ? "in a catheter" : "in a valve", ratio, at.push(0) - free, push,
                        at.torque(0) - untwisted, torque);
        }
}

/// r μ ∫|q| of a limp wire under a weight: |q| = T/R + w_n, T' = w_t without friction along.
TEST(Rubs, ATurnedWireTurnsTheBentCatheter) {
    constexpr double weight = 0.01, radius = 30, before = 10, r = 0.15;
    for (const double angle : {60.0, 120.0, 180.0})
        for (const double mu : {0.05, 0.2}) {
            InTube at = capstan_of(angle, mu, 1.5 * mu);
            const double whole = angle * degree;
            double tension = weight * (at.chain.devices[0].inserted - before - radius * whole), pressed = 0;
            constexpr int steps = 10'000;
            for (int k = 0; k < steps; ++k) {
                const double turn = (k + 0.5) * whole / steps, length = radius * whole / steps;
                pressed += (tension / radius + weight * std::sin(turn)) * length;
                tension += weight * std::cos(turn) * length;
            }
            pressed += before * weight * std::sin(whole);
            double broken = 0;
            for (int k = 0; k < 100; ++k) {
                at.move(0, 0, 0.01);
                broken = std::max(broken, at.torque(0));
            }
            EXPECT_NEAR(broken, r * 1.5 * mu * pressed, 0.015 * broken);
            EXPECT_NEAR(at.torque(0), r * mu * pressed, 0.01 * r * mu * pressed) << angle << ", " << mu;
            EXPECT_NEAR(at.torque(1), -at.torque(0), 1e-9);
            std::printf("wire turned in a catheter, %3.0f deg, mu %.2f: %.6f N mm, closed form %.6f\n", angle,
                        mu, at.torque(0), r * mu * pressed);
        }
}

/// The wire's valve is on the catheter's hub, and in the room where there is no catheter.
TEST(Rubs, TheValveRidesOnTheNextDevicesHub) {
    constexpr double r = 0.4445, outer = 0.835, held = 0.2, sheath = 0.1;
    const auto made = [&] {
        Device wire = device_of(2 * r, 50, 60), catheter = device_of(2 * outer, 100, 30);
        wire.spec.valve_friction = held;
        catheter.spec.inner_diameter = 1.1;
        catheter.spec.valve_friction = sheath;
        return InTube({{0, 0, 0}, {300, 0, 0}}, 3, {wire, catheter}, 2);
    };
    InTube fed = made();
    fed.move(1, 1);
    EXPECT_NEAR(fed.push(1), sheath + held, 1e-6);
    EXPECT_NEAR(fed.push(0), -held, 1e-6) << "it takes the wire along";
    InTube together = made();
    together.move(every_device, 1);
    EXPECT_NEAR(together.push(1), sheath, 1e-6);
    EXPECT_NEAR(together.push(0), 0, 1e-6);
    together.move(every_device, 0, 0.15);
    EXPECT_NEAR(together.torque(0), 0, 1e-6);
    InTube wire = made();
    wire.move(0, 1);
    EXPECT_NEAR(wire.push(0), held, 1e-6);
    EXPECT_NEAR(wire.push(1), -held, 1e-6);
    InTube turned = made();
    for (int k = 0; k < 4; ++k) turned.move(1, 0, 0.15);
    EXPECT_NEAR(turned.torque(1), sheath * outer + held * r, 1e-6);
    EXPECT_NEAR(turned.torque(0), -held * r, 1e-6);
    // Without the catheter the wire is in a valve in the room; what it was stretched by is lost.
    for (int k = 0; k < 31; ++k) fed.move(1, -1);
    EXPECT_EQ(fed.chain.devices[1].inserted, 0);
    EXPECT_EQ(fed.chain.rubs[0].outer, in_room);
    fed.move(0, 1);
    EXPECT_NEAR(fed.push(0), held, 1e-6);
    EXPECT_NEAR(fed.push(1), 0, 1e-6);
    // Stretched by ε, back by 2ε, and let go; the catheter's valve is gone at the end of the last step.
    constexpr double ways = 1 + 31 - 2.5 * slip_length;
    EXPECT_NEAR(fed.loss(), held * (ways + 1 - slip_length) + sheath * (ways - 0.5), 1e-6);
    fed.move(1, 1);
    EXPECT_EQ(fed.chain.rubs[0].outer, 1);
}

/// A valve's force adds to the hand's against the motion.
TEST(Rubs, AValveResistsTheHandEitherWay) {
    Device wire = device_of(0.889, 50, 60);
    wire.spec.valve_friction = 0.2;
    wire.spec.static_valve_friction = 0.3;
    InTube at({{0, 0, 0}, {300, 0, 0}}, 3, {wire}, 2);
    EXPECT_NEAR(at.push(0), 0, 1e-9);
    at.move(0, 0.5 * slip_length);
    EXPECT_NEAR(at.push(0), 0.15, 1e-6) << "half of what it holds";
    at.move(0, 0.5 * slip_length);
    EXPECT_NEAR(at.push(0), 0.3, 1e-6);
    at.move(0, 1);
    EXPECT_NEAR(at.push(0), 0.2, 1e-6);
    EXPECT_NEAR(at.loss(), 0.2 + 0.1 * slip_length / 2, 1e-6);
    at.move(0, -1);
    EXPECT_NEAR(at.push(0), -0.2, 1e-6);
    EXPECT_FALSE(let_rest(at.chain, 0));
    let_rest(at.chain, rest_time);
    at.move(0, -1e-9);
    EXPECT_NEAR(at.push(0), -0.2, 1e-6) << "a rest changes no force";
    at.move(0, -0.999 * slip_length / 3);
    EXPECT_NEAR(at.push(0), -0.3, 2e-4);
}

/// A catheter that no hand holds goes along with its wire whose friction is more than its valve holds.
TEST(Rubs, WhatNoHandHoldsGoesAlong) {
    for (const double hold : {0.005, 5.0})
        for (const double still : {1.0, 1.3}) {
            Device wire = device_of(0.889, 150, 130), catheter = device_of(1.67, 100, 100);
            catheter.spec.inner_diameter = 1.1;
            catheter.spec.inner_friction = 0.2;
            catheter.spec.static_inner_friction = 0.2 * still;
            catheter.spec.valve_friction = hold;
            catheter.spec.static_valve_friction = hold * still;
            catheter.held = false;
            InTube at(bend_of(25, 150, 20, 200), 3, {wire, catheter}, 2);
            const double from = at.chain.devices[1].inserted;
            int tries = 0;
            double farthest = 0;
            for (int k = 0; k < 20; ++k) {
                tries = std::max(tries, at.move(0, 0.5));
                farthest = std::max(farthest, std::abs(at.push(1)));
                if (k == 9) let_rest(at.chain, 0), let_rest(at.chain, rest_time);
            }
            const double gone = at.chain.devices[1].inserted - from;
            std::printf(
                "valve of %.3f N, static %.1f: the catheter went along by %.3f of 10 mm, %d tries at most, "
                "%.5f N left at its hub; wire %.3f N\n",
                hold, still, gone, tries, farthest, at.push(0));
            EXPECT_LT(farthest, 1e-3 + 0.01 * hold + 1e-9) << "nobody pushes it";
            const double least = hold > 1 ? -2 * slip_length : 9, most = hold > 1 ? 2 * slip_length : 10;
            EXPECT_GT(gone, least);
            EXPECT_LE(gone, most);
            EXPECT_LE(tries, 8);
        }
}

/// The same about the axis, with the wire turned; and the wire's own valve takes it along with the catheter.
TEST(Rubs, WhatNoHandHoldsTurnsAlong) {
    for (const double hold : {0.002, 5.0}) {
        Device wire = device_of(0.889, 150, 130), catheter = device_of(1.67, 100, 100);
        catheter.spec.inner_diameter = 1.1;
        catheter.spec.inner_friction = 0.2;
        catheter.spec.valve_friction = hold;
        catheter.held = false;
        InTube at(bend_of(25, 150, 20, 200), 3, {wire, catheter}, 2);
        int tries = 0;
        double farthest = 0;
        for (int k = 0; k < 20; ++k) {
            tries = std::max(tries, at.move(0, 0, 0.1));
            farthest = std::max(farthest, std::abs(at.torque(1)) / 0.835);
        }
        std::printf(
            "valve of %.3f N: the catheter turned along by %.3f of 2 rad, %d tries at most, wire %.5f N "
            "mm, %.6f N left\n",
            hold, at.turned[1], tries, at.torque(0), farthest);
        EXPECT_LT(farthest, 1e-3 + 0.01 * hold + 1e-9);
        EXPECT_GE(at.turned[1], hold > 1 ? 0.0 : 1.7);
        EXPECT_LT(at.turned[1], hold > 1 ? 0.1 : 2.0);
        EXPECT_LE(tries, 8);
    }
    Device wire = device_of(0.889, 50, 130), catheter = device_of(1.67, 100, 100);
    wire.spec.valve_friction = 0.2;
    wire.held = false;
    catheter.spec.inner_diameter = 1.1;
    catheter.spec.valve_friction = 0.1;
    InTube at({{0, 0, 0}, {300, 0, 0}}, 3, {wire, catheter}, 2);
    for (int k = 0; k < 10; ++k) at.move(1, 0.5), at.move(1, 0, 0.1);
    EXPECT_NEAR(at.chain.devices[0].inserted, 135, 2 * slip_length);
    EXPECT_NEAR(at.turned[0], 1, 2 * slip_length / 0.4445);
    EXPECT_NEAR(std::hypot(at.push(1), at.torque(1) / 0.835), 0.1, 0.005) << "its own valve alone";
}

/// Whatever the contacts say, the state stays finite.
TEST(Rubs, NonsenseDoesNotSpread) {
    InTube at = capstan_of(60, 0.1, 0.15);
    std::vector<WallContact> contacts(at.contacts().begin(), at.contacts().end());
    for (WallContact& contact : contacts)
        contact.penetration = 1, contact.normal.setConstant(std::numeric_limits<double>::quiet_NaN());
    at.chain.rubs[0].moved.x() = 0.3;
    at.chain.devices[0].held = false;
    const HubLoad load{std::numeric_limits<double>::quiet_NaN(), 0};
    DragSearch search;
    EXPECT_FALSE(drag(at.chain, contacts, std::vector<HubLoad>(2, load), search));
    follow_rubs(at.chain, contacts);
    EXPECT_TRUE(std::isfinite(at.chain.rub_loss));
    EXPECT_TRUE(validate(at.chain).empty());
}

TEST(Rubs, ArePartOfTheStateWhereTheyAre) {
    InTube at = capstan_of(60, 0.1, 0.15);
    at.move(0, -0.3);
    ASSERT_EQ(at.chain.rubs.size(), 1u);
    Chain restored;
    geometry::restore_state(restored, geometry::state_of(at.chain));
    EXPECT_EQ(restored.rubs, at.chain.rubs);
    EXPECT_EQ(restored.rub_loss, at.chain.rub_loss);
    const std::uint64_t hash = geometry::state_hash_of(at.chain);
    restored.rubs[0].slide.y() += 1e-6;
    EXPECT_NE(geometry::state_hash_of(restored), hash);
}

}  // namespace physics
