#include "physics/wire/coaxial.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "physics/wall/wall.h"
#include "physics/wire/bending.h"
#include "physics/wire/guidewire.h"

namespace physics {
namespace {

constexpr double thickest = WireLimits::diameter;  // [mm]
constexpr double least_segments = 2;

/// A stretch of a device with constant rest curvature, by its distance from the introducer on the chain.
struct Stretch {
    double from = 0, to = 0;        // [mm]
    Vec2 curvature = Vec2::Zero();  // in the device's two planes [1/mm]
};

/// From the distal end proximally.
std::vector<Stretch> stretches_of(const CoaxialDevice& device) {
    std::vector<Stretch> stretches;
    double end = device.inserted;
    for (const RestArc& arc : device.spec.shape) {
        const Vec2 plane(std::cos(arc.plane), std::sin(arc.plane));
        stretches.push_back({end - arc.length, end, arc.angle / arc.length * plane});
        end -= arc.length;
    }
    stretches.push_back({-1e9, end, Vec2::Zero()});
    return stretches;
}

/// The device's arrays on the chain. What a joint stands for is weighted by a tent between its neighbours, so
/// that the energy is smooth while the device moves: A = ∫EI, B = ∫EI κ₀ and C = ∫EI κ₀² under the tent make
/// ½A(κ − B/A)² + ½(C − B²/A), κ the joint's curvature.
void assign_device(const Guidewire& wire, CoaxialDevice& device) {
    const int n = wire.segments();
    device.share.assign(n + 1, 0.0);
    device.rigidity.assign(n + 1, 0.0);
    device.bend.assign(n + 1, Vec2::Zero());
    device.stored.assign(n + 1, 0.0);
    const std::vector<Stretch> stretches = stretches_of(device);
    std::size_t now = stretches.size() - 1;
    double a = 0;
    for (int j = 1; j <= n && a < device.inserted; ++j) {
        const double length = wire.lengths[j], b = a + length;
        while (now > 0 && stretches[now].to <= a) --now;
        for (std::size_t k = now + 1; k-- > 0 && stretches[k].from < b;) {
            const double from = std::max(a, stretches[k].from), to = std::min(b, stretches[k].to);
            if (!(to > from)) continue;
            const double distal = ((to - a) * (to - a) - (from - a) * (from - a)) / (2 * length);
            const double weights[] = {to - from - distal, distal};
            const double ei = rigidity_at(device.spec, device.inserted - 0.5 * (from + to));
            const Vec2& curvature = stretches[k].curvature;
            for (const int side : {0, 1}) {
                const double weight = weights[side];
                const int joint = j - 1 + side;
                device.share[joint] += weight;
                device.rigidity[joint] += ei * weight;
                device.bend[joint] += ei * weight * curvature;
                device.stored[joint] += ei * weight * curvature.squaredNorm();
            }
        }
        a = b;
    }
    for (int j = 0; j <= n; ++j) {
        const double stiff = device.rigidity[j], length = wire.length_of(j);
        if (stiff == 0) continue;
        const Vec2 moment = device.bend[j];
        device.share[j] = std::min(1.0, device.share[j] / length);
        device.rigidity[j] = stiff / length;
        device.bend[j] = length / stiff * moment;
        device.stored[j] = std::max(0.0, 0.5 * (device.stored[j] - moment.squaredNorm() / stiff));
    }
    device.bends = std::any_of(device.bend.begin(), device.bend.end() - 1,
                               [](const Vec2& bend) { return !bend.isZero(0); });
}

bool moves(const CoaxialDevice& device, std::size_t index, int which) {
    return which == every_device ? device.inserted > 0 : static_cast<int>(index) == which;
}

/// Index of the outermost device at a place of the chain.
int outermost(std::span<const CoaxialDevice> devices, double s) {
    for (int k = static_cast<int>(devices.size()) - 1; k > 0; --k)
        if (devices[k].inserted > s) return k;
    return 0;
}

std::vector<double> places_of(const Guidewire& wire) {
    std::vector<double> places(wire.joints.size(), 0.0);
    for (std::size_t j = 1; j < places.size(); ++j) places[j] = places[j - 1] + wire.lengths[j];
    return places;
}

/// Grips of the chain after devices have moved by `mm`, from the chain before. Force and normal stay at their
/// place; the anchor at a joint is that of the material of the outermost device which now lies there.
/// Material that was inside another device, or outside the body, holds on where it is. What lets go so is
/// added to the chain's friction loss.
void carry_grips(const Guidewire& before, Guidewire& wire, int which, double mm) {
    if (before.grips.empty()) return;
    const std::vector<double> old_places = places_of(before), places = places_of(wire);
    const auto first_at = [&](double s) {  // old joint there or next distal of it
        const auto at = std::lower_bound(old_places.begin() + 1, old_places.end() - 1, s);
        return static_cast<std::size_t>(at - old_places.begin());
    };
    constexpr double same_place = 1e-9;  // [mm]
    wire.grips.assign(wire.joints.size(), {});
    for (std::size_t j = 0; j < places.size(); ++j) {
        Grip& grip = wire.grips[j];
        const std::size_t old = j == 0 ? 0 : first_at(places[j] - same_place);
        const bool there = std::abs(old_places[old] - places[j]) <= same_place;
        if (there) grip = before.grips[old];
        const int owner = outermost(wire.devices, places[j]);
        const bool moved = moves(before.devices[owner], owner, which);
        // A joint keeps the anchor of material that has not moved.
        if (!moved && there && outermost(before.devices, old_places[old]) == owner) continue;
        const double s = places[j] - (moved ? mm : 0);
        const bool held = s >= 0 && s <= old_places.back() && outermost(before.devices, s) == owner;
        if (held) {
            const std::size_t i = first_at(s);
            const double share = std::clamp((s - old_places[i - 1]) / before.lengths[i], 0.0, 1.0);
            const Vec3 &a = before.grips[i - 1].anchor, &b = before.grips[i].anchor;
            grip.anchor = a + share * (b - a);
        } else {
            if (grip.holds()) wire.friction_loss += grip.energy(wire.joints[j]);
            grip.anchor = wire.joints[j];
        }
    }
    for (std::size_t j = 0; j < before.grips.size(); ++j)
        if (old_places[j] > places.back() + same_place && before.grips[j].holds())
            wire.friction_loss += before.grips[j].energy(before.joints[j]);
}

}  // namespace

std::vector<std::string> problems(const DeviceSpec& s) {
    std::vector<std::string> out;
    const auto need = [&](const char* name, double value, double least, double most, const char* unit) {
        if (std::isfinite(value) && value >= least && value <= most) return;
        std::ostringstream text;
        text << name << " must lie in [" << least << ", " << most << "] " << unit << '.';
        out.push_back(text.str());
    };
    using Limits = WireLimits;
    need("outer_diameter", s.outer_diameter, 1e-3, thickest, "mm");
    need("inner_diameter", s.inner_diameter, 0, s.outer_diameter, "mm");
    need("shaft_rigidity", s.shaft_rigidity, 1e-6, Limits::rigidity, "N·mm²");
    need("tip_rigidity", s.tip_rigidity, 1e-6, Limits::rigidity, "N·mm²");
    need("tip_length", s.tip_length, 0, Limits::soft_length, "mm");
    need("transition_length", s.transition_length, 0, Limits::soft_length, "mm");
    need("torsional_rigidity", s.torsional_rigidity, 0, Limits::rigidity, "N·mm²");
    need("friction", s.friction, 0, Limits::friction, "");
    need("buckling_force", s.buckling_force, 0, Limits::buckling_force, "N");
    need("length", s.length, 1, 1e4, "mm");
    for (const RestArc& arc : s.shape) {
        need("shape.length", arc.length, 1e-3, 1e3, "mm");
        need("shape.angle", arc.angle, -4 * M_PI - 1e-9, 4 * M_PI + 1e-9, "rad");
        need("shape.plane", arc.plane, -M_PI - 1e-9, M_PI + 1e-9, "rad");
    }
    if (out.empty() && shaped_length(s) > s.length)
        out.push_back("the shape must not be longer than the device.");
    return out;
}

double shaped_length(const DeviceSpec& spec) {
    double sum = 0;
    for (const RestArc& arc : spec.shape) sum += arc.length;
    return sum;
}

RestBend rest_bend(const CoaxialDevice& device, int joint, const Vec3& u, const Vec3& director) {
    const Vec2& bend = device.bend[joint];
    const double angle = bend.norm();
    if (angle == 0) return {};
    const double c = std::cos(device.roll), s = std::sin(device.roll);
    const Vec2 way = Vec2(c * bend[0] - s * bend[1], s * bend[0] + c * bend[1]) / angle;
    return {angle, way[0] * director + way[1] * u.cross(director)};
}

void assign_devices(Guidewire& wire) {
    const int n = wire.segments();
    wire.rigidity.assign(n + 1, 0.0);
    wire.rest_angle.assign(n + 1, 0.0);
    wire.thickness.assign(n + 1, 0.0);
    wire.surface_friction.assign(n + 1, 0.0);
    wire.bent = 0;
    for (CoaxialDevice& device : wire.devices) assign_device(wire, device);
    for (int j = 0; j <= n; ++j) {
        double radius = 0.5 * wire.spec.diameter, friction = wire.devices[0].spec.friction;
        for (const CoaxialDevice& device : wire.devices) {
            wire.rigidity[j] += device.rigidity[j];
            const double share = device.share[j];
            radius += share * (0.5 * device.spec.outer_diameter - radius);
            friction += share * (device.spec.friction - friction);
            if (j < n && wire.bent == 0 && !device.bend[j].isZero(0)) wire.bent = n - j;
        }
        wire.thickness[j] = radius - 0.5 * wire.spec.diameter;
        wire.surface_friction[j] = friction;
    }
}

Guidewire coaxial_chain(const std::vector<CoaxialDevice>& devices, double segment_length,
                        const Polyline& path) {
    if (devices.empty()) throw std::invalid_argument("a chain needs a device");
    double length = 0;
    for (const CoaxialDevice& device : devices) {
        if (const auto wrong = problems(device.spec); !wrong.empty())
            throw std::invalid_argument(wrong.front());
        if (!std::isfinite(device.inserted) || device.inserted < 0)
            throw std::invalid_argument("a device's length inside must be 0 mm or more");
        length = std::max(length, device.inserted);
    }
    GuidewireSpec spec;
    spec.segment_length = segment_length;
    spec.diameter = devices[0].spec.outer_diameter;
    spec.curved_length = spec.curved_angle = 0;
    for (const CoaxialDevice& device : devices) spec.friction = std::max(spec.friction, device.spec.friction);
    if (length < least_segments * segment_length * (1 - 1e-9))
        throw std::invalid_argument("a chain needs two segments inside");
    Guidewire wire = wire_of_length(spec, path, length);
    wire.devices = devices;
    assign_devices(wire);
    return wire;
}

double least_chain(const Guidewire& wire) {
    return least_segments * wire.spec.segment_length;
}

double windup_stiffness(const CoaxialDevice& device) {
    const double shaped = shaped_length(device.spec);
    if (device.spec.torsional_rigidity == 0 || !device.bends) return 0;
    // A shaft that is hardly inside is as stiff as its first millimetres.
    constexpr double step = 2;  // [mm]
    const double shaft = std::max(step, device.inserted - shaped);
    const int steps = static_cast<int>(std::ceil(shaft / step));
    double give = 0;
    for (int k = 0; k < steps; ++k)
        give += shaft / steps / torsional_rigidity_at(device.spec, shaped + (k + 0.5) * shaft / steps);
    return 1 / give;
}

double windup_energy(const Guidewire& wire) {
    double energy = 0;
    for (const CoaxialDevice& device : wire.devices)
        if (device.windup != 0) energy += 0.5 * windup_stiffness(device) * device.windup * device.windup;
    return energy;
}

double feed_device(Guidewire& wire, int which, double mm) {
    const double lambda = wire.spec.segment_length;
    mm = std::clamp(mm, -lambda, lambda);
    double still = 0, moving = 0;  // length of the longest that stays where it is, and that moves
    for (std::size_t k = 0; k < wire.devices.size(); ++k) {
        const CoaxialDevice& device = wire.devices[k];
        if (!moves(device, k, which)) {
            still = std::max(still, device.inserted);
        } else {
            moving = std::max(moving, device.inserted);
            mm = std::max(mm, -device.inserted);
        }
    }
    if (still < least_chain(wire)) mm = std::max(mm, least_chain(wire) - moving);
    if (mm == 0) return 0;
    const Guidewire before = wire;
    const double length = wire.inserted_length(), wanted = std::max(still, moving + mm);
    for (std::size_t k = 0; k < wire.devices.size(); ++k) {
        CoaxialDevice& device = wire.devices[k];
        if (moves(before.devices[k], k, which)) device.inserted += mm;
    }
    wire.grips.clear();
    if (wanted != length) feed(wire, wanted - length);
    // The chain's length is a sum of its segments': the device that makes it is exactly as long.
    const double reached = wire.inserted_length();
    for (CoaxialDevice& device : wire.devices)
        if (device.inserted > reached - 1e-9) device.inserted = reached;
    assign_devices(wire);
    carry_grips(before, wire, which, mm);
    // A shaft that nothing holds any more has let go.
    for (CoaxialDevice& device : wire.devices)
        if (device.windup != 0 && windup_stiffness(device) == 0) {
            device.roll = std::remainder(device.roll + device.windup, 2 * M_PI);
            device.windup = 0;
        }
    return mm;
}

void rotate_device(Guidewire& wire, int which, double angle) {
    for (std::size_t k = 0; k < wire.devices.size(); ++k) {
        if (which != every_device && static_cast<int>(k) != which) continue;
        CoaxialDevice& device = wire.devices[k];
        if (windup_stiffness(device) > 0)
            device.windup += angle;
        else
            device.roll = std::remainder(device.roll + angle, 2 * M_PI);
    }
}

double coaxial_energy(const Guidewire& wire, int joint, const Vec3& director) {
    const Vec3 &u = wire.tangents[joint], &next = wire.tangents[joint + 1];
    const double length = wire.length_of(joint);
    double straight = 0, energy = 0;
    for (const CoaxialDevice& device : wire.devices) {
        if (device.rigidity[joint] == 0) continue;
        energy += device.stored[joint];
        const RestBend rest = rest_bend(device, joint, u, director);
        if (rest.angle == 0)
            straight += device.rigidity[joint];
        else
            energy += joint_energy(device.rigidity[joint] / length, rest_direction(u, rest), next);
    }
    return energy + joint_energy(straight / length, u, next);
}

std::vector<HubLoad> hub_loads(const Guidewire& wire, std::span<const WallContact> contacts) {
    constexpr double by = 1e-3;  // [mm]
    const int n = wire.segments();
    const std::vector<Vec3> frames = directors(wire);
    std::vector<HubLoad> loads(wire.devices.size());
    const double reach = wire.inserted_length();
    std::vector<double> torque;
    for (std::size_t k = 0; k < loads.size(); ++k) {
        if (wire.devices[k].inserted <= 0) continue;
        double ends[2];
        for (const int side : {0, 1}) {
            const double step = side == 0 ? -by : by;
            Guidewire moved = wire;
            CoaxialDevice& device = moved.devices[k];
            device.inserted += step;
            double longest = 0;
            for (const CoaxialDevice& d : moved.devices) longest = std::max(longest, d.inserted);
            const double change = longest - reach;
            moved.lengths[n] += change;
            for (CoaxialDevice& d : moved.devices) assign_device(moved, d);
            double& energy = ends[side];
            energy = 0;
            for (int j = 0; j < n; ++j) energy += coaxial_energy(moved, j, frames[j]);
            Vec3 tip = contacts[n].push() - wire.length_of(n) * wire.load;
            if (!wire.grips.empty()) tip += wire.grips[n].push(wire.joints[n]);
            energy += change * tip.dot(wire.tangents[n]);
        }
        loads[k].push = (ends[1] - ends[0]) / (2 * by);
        device_torque(wire, static_cast<int>(k), frames, torque);
        loads[k].torque = torque[0];
    }
    if (wire.grips.empty()) return loads;
    const std::vector<double> places = places_of(wire);
    for (int j = 1; j <= n; ++j)
        if (wire.grips[j].holds())
            loads[outermost(wire.devices, places[j])].push +=
                wire.grips[j].push(wire.joints[j]).dot(wire.tangents[j]);
    return loads;
}

}  // namespace physics
