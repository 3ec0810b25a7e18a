#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <fmt/format.h>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "engine/anatomy/scenes.h"
#include "engine/studies/claims.h"
#include "engine/studies/plain_wire.h"
#include "engine/studies/quantile.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"

namespace studies {
namespace {

using geometry::degree;
using physics::Device;
using physics::Hub;
using physics::HubReport;
using physics::TubeWall;

/// A straight wire of length ℓ pressed down on all its length by q, in a narrow tube: friction holds it, and
/// its end follows the hub less μ q r ℓ²/2GJ. It climbs the tube's wall to the angle of friction, so that q
/// is the load over √(1 + μ²).
struct HeldShaft {
    double friction = 0;
    std::vector<std::array<double, 2>> curve;  // hub, end [deg]
    double measured = 0, exact = 0;            // lag of the end [deg]
    double torque = 0, exact_torque = 0;       // at the hub: μ q r ℓ [N·mm]
    double work = 0, gained = 0, loss = 0;     // of the hand, and where it went [N·mm]
};

/// A rod of uniform rest curvature κ₀ and length L in a tube of curvature κ: GJ ψ'' = EI κ₀ κ sin ψ with ψ(0)
/// the hub's angle and ψ'(L) = 0. It turns smoothly where L √(EI κ₀ κ/GJ) < π/2, and else snaps: the
/// stability condition of concentric-tube robots.
struct CurvedRod {
    double reach = 0;                          // L √(EI κ₀ κ/GJ)
    std::vector<std::array<double, 3>> curve;  // hub, tip, hub at which the equation has that tip [deg]
    double largest_step = 0;                   // of the tip in a step of the hub [deg]
    double snap = 0, exact_snap = 0;  // hub's angle at the largest step, and where the equation folds [deg]
    double off = 0;                   // largest |hub − equation's| before any snap, up to 180 without [deg]
    int unconverged = 0;
};
constexpr double rod_step = 5;  // of the hub [deg]

/// Two free tubes of one curvature κ, one in the other, the outer's hub turned against the inner's: their
/// angle θ obeys θ'' = c sin θ, c = κ² EI₁EI₂/(EI₁ + EI₂) (1/GJ₁ + 1/GJ₂), and they snap where L√c > π/2
/// (P. Dupont et al., Design and control of concentric-tube robots, 2010). Their largest step is that of the
/// angle at the distal end.
constexpr double tubes_step = 1;  // of the hub [deg]

/// What lets a shaft twist.
enum class WindUp { None, Whole, Segments };

/// One device of a chain moved by small steps with the others held.
struct Balance {
    int devices = 1;  // on the chain: a wire, in a catheter, in a micro-catheter in a catheter
    double friction = 0;
    WindUp windup = WindUp::None;
    int moved = 0;                          // index of the device
    std::string motion;                     // in, turned or out
    double work = 0, gained = 0, loss = 0;  // of the hand; of the energy; by friction [N·mm]
    double traffic = 0;   // Σ over steps of the larger of |work| and |gained| + loss [N·mm]
    double missing = 0;   // Σ over steps of |work − gained − loss| [N·mm]
    int not_at_rest = 0;  // steps
    double off() const { return missing / traffic; }
};

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

/// Below the limit and above it at lengths of 40 and 60 mm.
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

/// Tubes of this L√c.
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

/// Each device of a chain in a bent vessel, fed in by 10 mm, turned by 40° and drawn back. Work is summed by
/// the trapezoidal rule: where the push jumps, as where an end passes a joint that touches, it is off by the
/// jump times half a step.
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
    hub.settle(chain, no_limit);
    for (int k = 0; k < devices && windup == WindUp::Segments; ++k) physics::start_twists(chain, k);
    physics::start_grips(chain);
    hub.settle(chain, no_limit);

    std::vector<Balance> found;
    const auto move = [&](int device, const char* motion, double feed, double turn, int steps) {
        Balance b{devices, friction, windup, device, motion};
        double before = energy_of(chain, wall), lost = chain.friction_loss;
        physics::HubLoad load = hub.loads()[device];
        for (int k = 0; k < steps; ++k) {
            double left = 1, work = 0;
            for (int tries = 0; left > 1e-9 && tries < 64; ++tries) {
                const auto report =
                    hub.move(chain, {left * feed / steps, left * turn / steps, device}, no_limit);
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

constexpr std::array<double, 3> held_frictions = {0.05, 0.1, 0.2};
constexpr std::array<double, 2> rod_lengths = {40, 60};                      // [mm]
constexpr std::array<double, 5> tube_reaches = {1.2, 1.5, 1.65, 2.2, 2.68};  // L√c; π/2 is the limit
constexpr const char* devices_colours[] = {"#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9"};

PlainWire uniform_spec(double rigidity, double segment_length) {
    PlainWire spec = PlainWire::uniform(rigidity, segment_length);
    spec.diameter = 0.01;
    return spec;
}

/// A wire at rest without friction, then with it.
Chain laid(Hub& hub, const Polyline& line, const PlainWire& spec, double length,
           const Vec3& load = Vec3::Zero()) {
    Chain wire = wire_of_length(spec, line, length);
    wire.load = load;
    hub.settle(wire, no_limit);
    physics::start_grips(wire);
    hub.settle(wire, no_limit);
    return wire;
}

struct Capstan {
    double angle = 0, friction = 0;  // [deg], [-]
    double measured = 0, exact = 0;  // force of the hand [N]
    double error() const { return std::abs(measured / exact - 1); }
};

/// A wire drawn round a bend against the weight of the straight run beyond it, along the inner wall:
/// T' = μ (T/R + w sin φ) + w cos φ.
Capstan capstan(double angle, double friction) {
    constexpr double radius = 20, lumen = 1, run = 200, weight = 0.01, before = 20;  // [mm], [N/mm]
    const auto path = [&](double bend) {
        return anatomy::draw(std::vector<anatomy::PenMove>{
            anatomy::Run{before}, anatomy::Arc{bend, angle * degree}, anatomy::Run{run + 60}});
    };
    const Polyline line = path(radius);
    const Vec3 beyond = (line.back() - line[line.size() - 2]).normalized();
    // It comes in at the inner wall, or the introducer would bear a part of its turn.
    Polyline lifted = path(radius - lumen);
    for (Vec3& p : lifted) p.y() += lumen;
    const TubeWall wall(line, lumen, 42, 0);
    Hub hub({}, wall);
    PlainWire spec = uniform_spec(5, 0.5);
    spec.friction = friction;
    Chain wire = laid(hub, lifted, spec, before + radius * angle * degree + run, weight * beyond);
    for (int k = 0; k < 60; ++k) hub.move(wire, {-0.25, 0}, no_limit);
    Capstan result{angle, friction, -hub.loads()[0].push, 0};

    const double inner = radius - lumen, whole = angle * degree;
    double tension = weight * (wire.inserted_length() - before - inner * whole);
    constexpr int steps = 10'000;
    for (int k = 0; k < steps; ++k) {
        const double at = (k + 0.5) * whole / steps;
        tension += (weight * std::cos(at) + friction * (tension / inner + weight * std::sin(at))) * inner *
                   whole / steps;
    }
    result.exact = tension + before * weight * (std::cos(whole) + friction * std::sin(whole));
    return result;
}

struct Loop {
    double friction = 0;
    std::vector<std::array<double, 2>> curve;  // inserted [mm], force of the hand [N]
    double work = 0, gained = 0, loss = 0;     // over the loop [N·mm]
    double error() const {
        return loss > 0 ? std::abs(work - gained - loss) / loss : std::abs(work - gained);
    }
};

/// Pushed in by `direction` and drawn back.
Loop loop(const anatomy::Scene& scene, double friction, double travel) {
    constexpr double lambda = 0.5, step = 0.05;
    const TubeWall wall(anatomy::draw(scene.path), scene.radius, lambda * scene.wall_stiffness, 0);
    Hub hub({}, wall);
    PlainWire spec = uniform_spec(scene.rigidity, lambda);
    spec.friction = friction;
    Chain wire = laid(hub, wall.centreline(), spec, 100);
    const auto feed = [&](double by) {
        hub.move(wire, {by, 0}, no_limit);
        return hub.loads()[0].push;
    };
    Loop result;
    result.friction = friction;
    double force = feed(step);
    const double before = energy_of(wire, wall), lost_before = wire.friction_loss;
    const int steps = static_cast<int>(std::lround(travel / step));
    for (int k = 0; k < 2 * steps; ++k) {
        const double by = k < steps ? step : -step, next = feed(by);
        result.work += by * 0.5 * (force + next);
        force = next;
        if (k % 4 == 0) result.curve.push_back({wire.inserted_length(), force});
    }
    result.gained = energy_of(wire, wall) - before;
    result.loss = wire.friction_loss - lost_before;
    return result;
}

constexpr double whip_step = 2;  // of the hub [deg]

/// A wire with a curved tip in a bend, its hub turned once round.
struct Whip {
    double stiffness = 0;                      // of the shaft against torsion [N·mm]; 0 = rigid
    std::vector<std::array<double, 2>> curve;  // hub, tip [deg]
    std::vector<double> energies;              // after each step [N·mm]
    double largest_step = 0;                   // of the tip, less the hub's [deg]
};

Whip whip(double torsional_rigidity) {
    const TubeWall wall(anatomy::draw(std::vector<anatomy::PenMove>{anatomy::Run{60}, anatomy::Arc{30, 1.6},
                                                                    anatomy::Run{80}}),
                        2.5, 5, 0.4);
    Hub hub({}, wall);
    PlainWire spec;
    spec.curved_length = 20;
    spec.curved_angle = 1;
    spec.torsional_rigidity = torsional_rigidity;
    Chain wire = laid(hub, wall.centreline(), spec, 110);
    Whip result;
    result.stiffness = wire.devices[0].windup_stiffness;
    double tip = wire.devices[0].roll / degree;
    const auto note = [&](double turned) {
        result.curve.push_back({turned, tip});
        result.energies.push_back(energy_of(wire, wall));
    };
    note(0);
    for (double turned = whip_step; turned <= 360; turned += whip_step) {
        const double before = wire.devices[0].roll;
        hub.move(wire, {0, whip_step * degree}, no_limit);
        const double step = std::remainder(wire.devices[0].roll - before, 2 * M_PI) / degree;
        result.largest_step = std::max(result.largest_step, std::abs(step) - whip_step);
        tip += step;
        note(turned);
    }
    return result;
}

/// Largest fall of the slope of a rigid wire's energy with its roll: a softer shaft lets the tip go [N·mm].
double critical_stiffness(const Whip& rigid) {
    const double step = whip_step * degree;
    double steepest = 0;
    for (std::size_t k = 1; k + 1 < rigid.energies.size(); ++k)
        steepest =
            std::max(steepest,
                     (2 * rigid.energies[k] - rigid.energies[k + 1] - rigid.energies[k - 1]) / (step * step));
    return steepest;
}

struct DeviceCost {
    const char* model;
    double friction, torsional_rigidity;
    bool catheter = false;           // over the wire
    bool each = false;               // segment twists by itself
    std::vector<double> times = {};  // of a part of a push [ms]
    double steps = 0, segments = 0;
    int unconverged = 0;
};

/// The wire 100 mm inside and a catheter of twice its stiffness over 80 mm of it, each with a curved tip.
Chain with_catheter(Hub& hub, const Polyline& line, const PlainWire& spec) {
    physics::Device inner, outer;
    inner.spec = spec.device();
    inner.inserted = 100;
    PlainWire twice = spec;
    twice.shaft_rigidity *= 2;
    twice.tip_rigidity *= 2;
    twice.torsional_rigidity *= 2;
    twice.diameter *= 2;
    outer.spec = twice.device();
    outer.spec.shape = {{8, 60 * degree, 0}, {20, -20 * degree, 0}};
    outer.inserted = 80;
    Chain wire = physics::chain_along({inner, outer}, spec.grid(), line);
    hub.settle(wire, no_limit);
    physics::start_grips(wire);
    hub.settle(wire, no_limit);
    return wire;
}

/// Half segments of λ = 1 pushed into the sinuous scene, from N = 100 on, by a wire with a curved tip.
void measure(const anatomy::Scene& scene, int pushes, DeviceCost& cost) {
    const TubeWall wall(anatomy::draw(scene.path), scene.radius, scene.wall_stiffness, 0);
    Hub hub({}, wall);
    PlainWire spec = uniform_spec(scene.rigidity, 1);
    spec.curved_length = 6;
    spec.curved_angle = 45 * degree;
    spec.friction = cost.friction;
    spec.torsional_rigidity = cost.torsional_rigidity;
    Chain wire =
        cost.catheter ? with_catheter(hub, wall.centreline(), spec) : laid(hub, wall.centreline(), spec, 100);
    if (cost.each) {
        physics::start_twists(wire, 0);
        hub.settle(wire, no_limit);
    }
    for (int k = 0; k < pushes; ++k) {
        physics::HubMotion motion = {0.5, k % 4 == 3 ? 5 * degree : 0};
        if (cost.catheter) motion.device = k % 3 - 1;  // both, the wire, the catheter
        const std::clock_t before = std::clock();
        const HubReport report = hub.move(wire, motion, no_limit);
        cost.times.push_back(1e3 * static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC);
        cost.steps += static_cast<double>(report.relax.newton_steps) / pushes;
        cost.unconverged += !report.relax.converged();
    }
    cost.segments = wire.segments();
}

io::Plot picture(std::span<const double> capstans, std::span<const double> loops,
                 const std::vector<Whip>& whips) {
    const auto by_friction = [](std::span<const double> list) {
        return rows_of(list.size(), [&](std::size_t k) -> TemplateValues {
            return {{"friction", list[k]}, {"colour", devices_colours[k]}};
        });
    };
    const auto beside_exact = [](std::span<const double> list, const char* title) {
        return rows_of(list.size(), [&](std::size_t k) -> TemplateValues {
            return {{"value", list[k]},
                    {"colour", devices_colours[k]},
                    {"exact", k + 1 == list.size() ? title : "notitle"}};
        });
    };
    const auto whip_row = [&](std::size_t k) -> TemplateValues {
        const double shaft = whips[k].stiffness;
        return {{"curve", k},
                {"colour", devices_colours[k]},
                {"shaft", shaft == 0 ? std::string("rigid") : fmt::format("{:.3f} N mm/rad", shaft)}};
    };
    return filled_plot("devices", 1100, 1720,
                       {{"capstans", by_friction(capstans)},
                        {"loops", by_friction(loops)},
                        {"whips", rows_of(whips.size(), whip_row)},
                        {"held", beside_exact(held_frictions, "title 'closed form'")},
                        {"rods", beside_exact(rod_lengths, "title 'equation'")},
                        {"tubes", beside_exact(tube_reaches, "title 'equation'")}});
}

}  // namespace

StudyResult run_devices(const StudyOptions& options) {
    const std::vector<double> angles = {60, 120, 180}, capstan_frictions = {0.1, 0.2, 0.3};
    const std::vector<double> loop_frictions = {0, 0.1, 0.2};
    const anatomy::Scene& scene = *anatomy::find_scene("sinuous");
    std::vector<Capstan> capstans(9);
    std::vector<Loop> loops(loop_frictions.size());
    std::vector<Whip> whips(4);
    std::array<DeviceCost, 7> costs = {DeviceCost{"none", 0, 0},
                                       DeviceCost{"friction", 0.1, 0},
                                       DeviceCost{"torsion", 0, 400},
                                       DeviceCost{"both", 0.1, 400},
                                       DeviceCost{"segments", 0.1, 400, false, true},
                                       DeviceCost{"catheter", 0, 0, true},
                                       DeviceCost{"all", 0.1, 400, true}};
    std::vector<HeldShaft> shafts(held_frictions.size());
    std::vector<CurvedRod> curved(rod_lengths.size());
    std::vector<CurvedRod> tubes(tube_reaches.size());
    std::vector<std::vector<Balance>> balances(18);
    Work work(options, static_cast<int>(capstans.size() + loops.size() + whips.size() + costs.size() +
                                        shafts.size() + curved.size() + tubes.size() + balances.size()));
    work.run(9, [&](int k) {
        capstans[k] = capstan(angles[k % 3], capstan_frictions[k / 3]);
        return fmt::format("capstan of {} deg, friction {}", capstans[k].angle, capstans[k].friction);
    });
    work.run(static_cast<int>(loops.size()), [&](int k) {
        loops[k] = loop(scene, loop_frictions[k], options.quick ? 5 : 30);
        return fmt::format("loop, friction {}", loops[k].friction);
    });
    work.run(static_cast<int>(shafts.size()), [&](int k) {
        shafts[k] = held_shaft(held_frictions[k]);
        return fmt::format("pressed shaft, friction {}", held_frictions[k]);
    });
    work.run(static_cast<int>(curved.size()), [&](int k) {
        curved[k] = curved_rod(rod_lengths[k]);
        return fmt::format("curved rod of {} mm in a bend", rod_lengths[k]);
    });
    work.run(static_cast<int>(tubes.size()), [&](int k) {
        tubes[k] = concentric_tubes(tube_reaches[k]);
        return fmt::format("tubes in each other, reach {}", tube_reaches[k]);
    });
    work.run(static_cast<int>(balances.size()), [&](int k) {
        balances[k] = energy_balances(1 + k / 6, k / 3 % 2 * 0.1, static_cast<WindUp>(k % 3));
        return fmt::format("work of the hand on {} devices", 1 + k / 6);
    });
    whips[0] = whip(0);
    const double critical = critical_stiffness(whips[0]);
    const double per_rigidity = whip(1000).stiffness / 1000;
    work.run(3, [&](int k) {
        constexpr double fractions[] = {3, 1.2, 0.85};
        whips[k + 1] = whip(fractions[k] * critical / per_rigidity);
        return fmt::format("hub turned, {} of the critical stiffness", fractions[k]);
    });
    // One at a time: they are timed.
    for (DeviceCost& cost : costs) measure(scene, options.quick ? 40 : 180, cost);

    StudyResult result;
    io::Table bend{"devices_capstan", {"angle_deg", "friction", "hand_N", "closed_form_N", "off_percent"}};
    for (const Capstan& c : capstans) {
        bend.add({c.angle, c.friction, c.measured, c.exact, 100 * c.error()});
        result.claim(fmt::format("capstan: {} deg, friction {}: force of the hand [N]", c.angle, c.friction),
                     c.exact, c.measured, c.error() < 0.01, "Closed form; within 1 %.");
    }
    io::Table in_and_out{"devices_loop", {"friction", "inserted_mm", "hand_N"}};
    io::Table balance{"devices_balance",
                      {"friction", "work_N_mm", "gained_N_mm", "loss_N_mm", "off_percent"}};
    for (const Loop& l : loops) {
        for (const auto& [inserted, force] : l.curve) in_and_out.add({l.friction, inserted, force});
        balance.add({l.friction, l.work, l.gained, l.loss, 100 * l.error()});
        result.claim(fmt::format("loop of push and pull, friction {}: work of the hand [N mm]", l.friction),
                     l.gained + l.loss, l.work, l.error() < 0.01,
                     "The wire's gain of energy and its loss by friction; within 1 % of the loss.");
    }
    io::Table turned{"devices_whip", {"curve", "shaft_N_mm", "hub_deg", "tip_deg"}};
    for (std::size_t k = 0; k < whips.size(); ++k)
        for (const auto& [hub, tip] : whips[k].curve) turned.add({k, whips[k].stiffness, hub, tip});
    const double smooth = whips[2].largest_step, jump = whips[3].largest_step;
    result.claim(fmt::format("a shaft 1.2 times as stiff as the critical {:.3f} N mm/rad: largest step of "
                             "the tip beyond the hub's [deg]",
                             critical),
                 "no whip: below 20", smooth, smooth < 20,
                 "The critical stiffness is the steepest fall of the rigid wire's dE/droll.");
    result.claim(
        "a shaft 0.85 times as stiff as the critical one: largest step of the tip beyond the hub's [deg]",
        "whips: above 25", jump, jump > 25, "As above.");
    io::Table held{"devices_held", {"friction", "hub_deg", "end_deg", "lag_deg"}};
    const auto near = [](double measured, double exact, double fraction) {
        return std::abs(measured - exact) <= fraction * std::abs(exact);
    };
    for (const HeldShaft& h : shafts) {
        for (const auto& [hub, end] : h.curve) held.add({h.friction, hub, end, h.exact});
        result.claim(fmt::format("pressed shaft, friction {}: lag of its end [deg]", h.friction), h.exact,
                     h.measured, near(h.measured, h.exact, 0.02), "μ q r ℓ²/2GJ; within 2 %.");
        result.claim(fmt::format("pressed shaft, friction {}: torque at the hub [N mm]", h.friction),
                     h.exact_torque, h.torque, near(h.torque, h.exact_torque, 0.02),
                     "μ q r ℓ; within 2 %: the introducer bears the first millimetres' load.");
        result.claim(
            fmt::format("pressed shaft, friction {}: work of the hand that turns it [N mm]", h.friction),
            h.gained + h.loss, h.work, near(h.work, h.gained + h.loss, 0.01),
            "The shaft's gain of energy and its loss by friction; within 1 %.");
    }
    io::Table snaps{"devices_snap", {"length_mm", "hub_deg", "tip_deg", "equation_hub_deg"}};
    for (std::size_t k = 0; k < curved.size(); ++k)
        for (const auto& [hub, tip, exact] : curved[k].curve) snaps.add({rod_lengths[k], hub, tip, exact});
    result.claim(fmt::format("curved rod at {:.2f} of reach, below the limit of 1.57: largest step of its "
                             "tip in {} deg of the hub [deg]",
                             curved[0].reach, rod_step),
                 "no snap: below 30", curved[0].largest_step, curved[0].largest_step < 30,
                 "Stability condition of concentric-tube robots.");
    result.claim("the same rod: largest angle of the hub off the equation's [deg]", 0.0, curved[0].off,
                 curved[0].off < 8, "GJ ψ'' = EI κ₀ κ sin ψ, without clearance; within 8.");
    result.claim(fmt::format("curved rod at {:.2f} of reach, above the limit: largest step of its tip [deg]",
                             curved[1].reach),
                 "snaps: above 60", curved[1].largest_step, curved[1].largest_step > 60, "As above.");
    result.claim("the same rod: hub's angle at which it snaps [deg]", curved[1].exact_snap, curved[1].snap,
                 near(curved[1].snap, curved[1].exact_snap, 0.05), "Where the equation folds; within 5 %.");
    result.claim("both rods: turns without a certified rest", 0.0,
                 curved[0].unconverged + curved[1].unconverged,
                 curved[0].unconverged + curved[1].unconverged == 0, "Of 54 each.");
    io::Table whipped{"devices_tubes", {"reach", "hub_deg", "tip_deg", "equation_hub_deg"}};
    for (std::size_t k = 0; k < tubes.size(); ++k) {
        const CurvedRod& t = tubes[k];
        for (const auto& [hub, tip, exact] : t.curve) whipped.add({tube_reaches[k], hub, tip, exact});
        const std::string name = fmt::format("tubes in each other, L√c = {:g}", tube_reaches[k]);
        if (t.exact_snap > 180 + tubes_step) {
            result.claim(name + ", above the limit of π/2: hub's angle at which they snap [deg]",
                         t.exact_snap, t.snap, near(t.snap, t.exact_snap, 0.02),
                         "θ'' = c sin θ; within 2 %.");
        } else {
            result.claim(name + ", below the limit of π/2: largest step of the end [deg]",
                         "no snap: below 15", t.largest_step, t.largest_step < 15, "In 1 deg of the hub.");
        }
        result.claim(name + ": largest angle of the hub off the equation's [deg]", 0.0, t.off,
                     t.off < 0.02 * t.exact_snap && t.unconverged == 0,
                     "Within 2 % of where it snaps, or of 180; each turn ends at a strict minimum.");
    }
    io::Table works{"devices_work",
                    {"devices", "friction", "windup", "moved", "motion", "work_N_mm", "gained_N_mm",
                     "loss_N_mm", "off_percent"}};
    for (const std::vector<Balance>& some : balances) {
        double worst = 0;
        int not_at_rest = 0;
        for (const Balance& b : some) {
            works.add({b.devices, b.friction, name_of(b.windup), b.moved, b.motion, b.work, b.gained, b.loss,
                       100 * b.off()});
            worst = std::max(worst, 100 * b.off());
            not_at_rest += b.not_at_rest;
        }
        const Balance& b = some.front();
        result.claim(
            fmt::format(
                "work of the hand on {} device{}, friction {:g}, wind-up {}: step off the balance [%]",
                b.devices, b.devices == 1 ? "" : "s", b.friction, name_of(b.windup)),
            0.0, worst, worst <= 1 && not_at_rest == 0,
            "Gain of energy and loss by friction against work, of each device fed in, turned and drawn back; "
            "within 1 % a step.");
    }
    io::Table price{"devices_cost",
                    {"model", "friction", "GJ_N_mm2", "segments", "median_ms", "p99_ms", "max_ms",
                     "newton_steps", "unconverged"}};
    for (const DeviceCost& c : costs) {
        price.add({c.model, c.friction, c.torsional_rigidity, c.segments, quantile(c.times, 0.5),
                   quantile(c.times, 0.99), quantile(c.times, 1), c.steps, c.unconverged});
        result.claim(fmt::format("pushes and turns with {}: without a certified rest", c.model), 0.0,
                     c.unconverged, c.unconverged == 0, "Of all in the cost's table.");
    }
    result.plots = {picture(capstan_frictions, loop_frictions, whips)};
    result.tables = {std::move(bend),   std::move(in_and_out), std::move(balance),
                     std::move(turned), std::move(price),      std::move(whipped),
                     std::move(works),  std::move(held),       std::move(snaps)};
    result.page = filled_page("devices",
                              {{"balance", io::to_markdown(result.tables[2])},
                               {"price", io::to_markdown(result.tables[4])},
                               {"works", io::to_markdown(result.tables[6])}},
                              result, options);
    return result;
}

}  // namespace studies
