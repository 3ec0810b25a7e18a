#include "engine/studies/device_cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "engine/anatomy/scenes.h"
#include "engine/studies/plain_wire.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"

namespace studies {
namespace {

using geometry::degree;
using geometry::Vec3;
using physics::Chain;
using physics::Device;
using physics::Hub;
using physics::HubReport;
using physics::TubeWall;

constexpr int no_limit = 100'000'000;  // updates

/// Equation of the curved rod, integrated from its tip.
struct RodEquation {
    double length, stiffness;  // [mm], EI κ₀ κ/GJ [1/mm²]

    /// Hub's angle that leaves the tip at this one [rad].
    double hub_for(double tip) const {
        constexpr int steps = 4000;
        const double h = -length / steps;
        double angle = tip, slope = 0;
        for (int i = 0; i < steps; ++i) {  // midpoint rule
            const double middle = angle + 0.5 * h * slope;
            const double slope_there = slope + 0.5 * h * stiffness * std::sin(angle);
            angle += h * slope_there;
            slope += h * stiffness * std::sin(middle);
        }
        return angle;
    }
    double reach() const { return length * std::sqrt(stiffness); }
    /// Where the branch that starts at 0 ends: the largest hub's angle on it, π where it never ends.
    double fold() const {
        double most = 0;
        constexpr int steps = 720;
        for (int i = 1; i <= steps; ++i) most = std::max(most, hub_for(i * M_PI / steps));
        return most;
    }
};

/// Turns a hub once, or three quarters, round; `tip` is the angle of the distal end after a turn of the hub.
CurvedRod turned_round(Hub& hub, Chain& wire, int device, const RodEquation& equation, double step,
                       double most, const std::function<double(double)>& tip_after) {
    CurvedRod rod;
    rod.reach = equation.reach();
    rod.exact_snap = equation.fold() / degree;
    double before = 0;
    for (int k = 0; k * step <= most; ++k) {
        if (k > 0) {
            const HubReport report = hub.move(wire, {0, step * degree, device}, no_limit);
            rod.unconverged += report.outcome != HubReport::Outcome::AtRest || !report.relax.converged();
        }
        const double turned = k * step, tip = tip_after(turned);
        rod.curve.push_back({turned, tip, equation.hub_for(tip * degree) / degree});
        if (tip - before > rod.largest_step) {
            rod.largest_step = tip - before;
            rod.snap = turned;
        }
        before = tip;
    }
    const bool snaps = rod.reach > M_PI / 2;
    for (const auto& [turned, tip, exact] : rod.curve)
        if (snaps ? turned < rod.snap : turned <= 180) rod.off = std::max(rod.off, std::abs(turned - exact));
    return rod;
}

constexpr int plenty = 100'000'000;  // updates

/// A wire, a micro-catheter and a catheter, each with a curved end.
Device balanced_device(int which, double friction, WindUp windup) {
    struct Kind {
        double outer, inner, tip, shaft;  // [mm], EI [N·mm²]
        std::vector<physics::RestArc> shape;
        double inserted;  // [mm]
    };
    static const std::array<Kind, 3> kinds = {
        Kind{0.889, 0, 6, 250, {{12, 45 * degree, 0}}, 170},
        Kind{1.3, 0.95, 10, 60, {{10, 30 * degree, 0.5}}, 130},
        Kind{1.9, 1.4, 60, 200, {{15, 70 * degree, 0}, {35, -50 * degree, 0}, {40, 40 * degree, 0.3}}, 90}};
    const Kind& kind = kinds[which];
    Device device;
    device.spec.outer_diameter = kind.outer;
    device.spec.inner_diameter = kind.inner;
    device.spec.sections =
        physics::soft_tip(kind.tip, 20, 60, kind.shaft, windup == WindUp::None ? 0 : 0.75 * kind.shaft);
    device.spec.friction = friction;
    device.spec.shape = kind.shape;
    device.inserted = kind.inserted;
    return device;
}

}  // namespace

HeldShaft held_shaft(double friction) {
    constexpr double length = 200, rigidity = 20, load = 0.02, radius = 0.45, step = 3 * degree;
    constexpr double clearance = 0.05;
    const TubeWall wall({{0, 0, 0}, {300, 0, 0}}, clearance, 20);
    Hub hub({}, wall);
    PlainWire spec = PlainWire::uniform(500, 2);
    spec.diameter = 2 * radius;
    spec.torsional_rigidity = rigidity;
    spec.friction = friction;
    // Along the wall: what the introducer bears would not press.
    Chain wire = wire_of_length(spec, {{0, 0, -clearance}, {300, 0, -clearance}}, length);
    wire.load = {0, 0, -load};
    hub.settle(wire, no_limit);
    physics::start_twists(wire, 0);
    physics::start_grips(wire);
    hub.settle(wire, no_limit);

    HeldShaft held;
    held.friction = friction;
    const double pressed = friction * load / std::sqrt(1 + friction * friction) * radius;
    held.exact = pressed * length * length / (2 * rigidity) / degree;
    held.exact_torque = pressed * length;
    const double before = energy_of(wire, wall), lost_before = wire.friction_loss;
    held.curve.push_back({0, 0});
    // Until well after the end has let go.
    const int turns = static_cast<int>(std::ceil((1.5 * held.exact + 45) * degree / step));
    for (int k = 1; k <= turns; ++k) {
        const double torque = hub.move(wire, {0, step}, no_limit).relax.base_torque;
        held.work += 0.5 * (held.torque + torque) * step;
        held.torque = torque;
        held.curve.push_back({k * step / degree, (k * step - wire.devices[0].wound_up()) / degree});
    }
    held.measured = wire.devices[0].wound_up() / degree;
    held.gained = energy_of(wire, wall) - before;
    held.loss = wire.friction_loss - lost_before;
    return held;
}

CurvedRod curved_rod(double length) {
    // So stiff a wall that the rod does not press through the clearance: the hub refuses what would.
    constexpr double curvature = 1.0 / 40, bending = 250, torsion = 188;
    const TubeWall wall(
        anatomy::draw(std::vector<anatomy::PenMove>{anatomy::Arc{1 / curvature, 1.1 * length * curvature}}),
        0.03, 2000);
    Hub hub({}, wall);
    PlainWire spec = PlainWire::uniform(bending, 0.5);
    spec.curved_length = length;
    spec.curved_angle = length * curvature;
    spec.torsional_rigidity = torsion;
    Chain wire = wire_of_length(spec, wall.centreline(), length + spec.segment_length);
    // Without torque the rod curves as the tube does.
    const Vec3 &u = wire.tangents[0], bend = wall.centreline()[2] - wall.centreline()[1];
    const Vec3 toward = (bend - bend.dot(u) * u).normalized();
    wire.devices[0].roll =
        std::atan2(wire.base_director.cross(toward).dot(u), wire.base_director.dot(toward));
    physics::start_twists(wire, 0);
    hub.settle(wire, no_limit);

    return turned_round(hub, wire, 0, {length, bending * curvature * curvature / torsion}, rod_step, 270,
                        [&](double turned) { return turned - wire.devices[0].wound_up() / degree; });
}

CurvedRod concentric_tubes(double reach) {
    constexpr double curvature = 0.03, bending = 100, torsion = 80;
    // EI₁EI₂/(EI₁ + EI₂) is half of each, 1/GJ₁ + 1/GJ₂ twice that of each.
    constexpr double stiffness = curvature * curvature * bending / torsion;
    constexpr int segments = 80;
    const double length = reach / std::sqrt(stiffness);
    const TubeWall free({{-500, 0, 0}, {1500, 0, 0}}, 900, 5);
    physics::Device tube;
    tube.spec.sections = {{0, bending, bending, torsion, torsion}};
    tube.spec.shape = {{length, curvature * length, 0}};
    tube.inserted = length;
    Chain chain = physics::chain_along({tube, tube}, {length / segments}, {{0, 0, 0}, {2 * length, 0, 0}});
    for (const int k : {0, 1}) physics::start_twists(chain, k);
    Hub hub({}, free);
    hub.settle(chain, no_limit);
    return turned_round(hub, chain, 1, {length, stiffness}, tubes_step, 360, [&](double turned) {
        return turned + (chain.devices[0].wound_up() - chain.devices[1].wound_up()) / degree;
    });
}

const char* name_of(WindUp windup) {
    return std::array{"none", "whole", "segments"}[static_cast<std::size_t>(windup)];
}

std::vector<Balance> energy_balances(int devices, double friction, WindUp windup) {
    const physics::TubeWall wall(anatomy::draw(std::vector<anatomy::PenMove>{
                                     anatomy::Run{40}, anatomy::Arc{40, 1.2, Vec3::UnitZ()}, anatomy::Run{30},
                                     anatomy::Arc{35, -1.1, Vec3(0.3, 1, 0).normalized()}, anatomy::Run{90}}),
                                 4, 2.5, 0.4445);
    std::vector<Device> placed = {balanced_device(0, friction, windup)};
    if (devices == 3) placed.push_back(balanced_device(1, friction, windup));
    if (devices > 1) placed.push_back(balanced_device(2, friction, windup));
    physics::Hub hub({}, wall);
    Chain chain = physics::chain_along(placed, {1}, wall.centreline());
    hub.settle(chain, plenty);
    for (int k = 0; k < devices && windup == WindUp::Segments; ++k) physics::start_twists(chain, k);
    physics::start_grips(chain);
    hub.settle(chain, plenty);

    std::vector<Balance> found;
    const auto move = [&](int device, const char* motion, double feed, double turn, int steps) {
        Balance b{devices, friction, windup, device, motion};
        double before = energy_of(chain, wall), lost = chain.friction_loss;
        physics::HubLoad load = hub.loads()[device];
        for (int k = 0; k < steps; ++k) {
            double left = 1, work = 0;
            for (int tries = 0; left > 1e-9 && tries < 64; ++tries) {
                const auto report =
                    hub.move(chain, {left * feed / steps, left * turn / steps, device}, plenty);
                if (report.outcome != physics::HubReport::Outcome::AtRest) break;
                const physics::HubLoad now = hub.loads()[device];
                work += 0.5 * (load.push + now.push) * report.made.feed +
                        0.5 * (load.torque + now.torque) * report.made.turn;
                load = now;
                left -= feed != 0 ? report.made.feed * steps / feed : report.made.turn * steps / turn;
            }
            b.not_at_rest += left > 1e-9;
            const double after = energy_of(chain, wall), gained = after - before,
                         loss = chain.friction_loss - lost;
            before = after, lost = chain.friction_loss;
            b.work += work, b.gained += gained, b.loss += loss;
            b.traffic += std::max(std::abs(work), std::abs(gained) + loss);
            b.missing += std::abs(work - gained - loss);
        }
        found.push_back(b);
    };
    for (int k = 0; k < devices; ++k) {
        move(k, "in", 10, 0, 211);  // whose steps meet no multiple of λ
        move(k, "turned", 0, 40 * degree, 80);
        move(k, "out", -10, 0, 211);
    }
    return found;
}

}  // namespace studies
