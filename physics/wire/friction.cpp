#include "physics/wire/friction.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/wire/bending.h"
#include "physics/wire/rub_forces.h"

namespace physics {
namespace {

const Rub* lumen_rub(const Chain& chain, int inner, int outer) {
    for (const Rub& rub : chain.rubs)
        if (!rub.valve && rub.inner == inner && rub.outer == outer) return &rub;
    return nullptr;
}

/// Moment that a device bears at a joint, of what is distal on what is proximal [N·mm].
Vec3 moment(const Chain& chain, const std::vector<Vec3>& directors, const Device& device, int joint) {
    assert(joint >= 0 && joint < chain.segments());
    const Vec3 &u = chain.tangents[joint], &next = chain.tangents[joint + 1];
    const double spring = device.rigidity[joint] / chain.length_of(joint);
    if (!(spring > 0)) return Vec3::Zero();
    const Vec3 rest =
        device.rest[joint].angle == 0 ? u : rest_direction(u, rest_bend(device, joint, u, directors[joint]));
    return spring / 6 * (7 - rest.dot(next)) * rest.cross(next);
}

/// The device within `outer` that touches its lumen at a joint; -1 for none.
int toucher(const Chain& chain, int outer, int joint) {
    int some = -1;
    for (int k = outer - 1; k >= 0; --k) {
        const double fraction = chain.devices[k].fraction[joint];
        if (fraction >= 0.5) return k;
        if (fraction > 0 && some < 0) some = k;
    }
    return some;
}

/// A joint that touches nothing has lain still as the nearest one that does, for touch goes from joint to
/// joint while the chain lies there; where none does, what comes to touch moves.
void fraction_rest(Chain& chain) {
    const int n = static_cast<int>(chain.grips.size());
    constexpr int none = -1;
    int before = none;
    for (int j = 0; j < n;) {
        if (chain.grips[j].holds()) {
            before = j++;
            continue;
        }
        int after = j;
        while (after < n && !chain.grips[after].holds()) ++after;
        for (; j < after; ++j) {
            const bool nearer = before != none && (after == n || j - before <= after - j);
            chain.grips[j].rested = nearer      ? chain.grips[before].rested
                                    : after < n ? chain.grips[after].rested
                                                : 0.0;
        }
    }
}

/// Part of a straight way over which a slide that it continues stays elastic [-].
double elastic_part(const Vec2& slide, const Vec2& motion) {
    const double square = motion.squaredNorm(), along = slide.dot(motion);
    const double room = std::max(0.0, slip_length * slip_length - slide.squaredNorm());
    if ((slide + motion).squaredNorm() <= slip_length * slip_length || square == 0) return 1;
    const double root = std::sqrt(along * along + square * room);
    // Without cancellation where the slide is outward.
    return std::clamp(along > 0 ? room / (along + root) : (root - along) / square, 0.0, 1.0);
}

/// A valve whose carrier came in or went out is another one's from now on, and begins at ease.
void follow_carriers(Chain& chain) {
    for (Rub& rub : chain.rubs) {
        if (!rub.valve) continue;
        const int carrier = carrier_of_valve(chain, rub.inner);
        if (carrier == rub.outer) continue;
        chain.rub_loss += rub.energy();
        const int inner = rub.inner;
        rub = {};
        rub.inner = inner;
        rub.outer = carrier;
        rub.valve = true;
    }
}

}  // namespace

double radius_of(const Chain& chain, const Rub& rub) {
    return 0.5 * chain.devices[rub.inner].spec.outer_diameter;
}

double largest(const Chain& chain, const Rub& rub, bool holds_fast) {
    const DeviceSpec& spec = chain.devices[rub.valve ? rub.inner : rub.outer].spec;
    if (rub.valve) return holds_fast ? spec.holding_valve_friction() : spec.valve_friction;
    return holds_fast ? spec.holding_inner_friction() : spec.inner_friction;
}

std::vector<double> pressures(const Chain& chain, std::span<const WallContact> contacts) {
    std::vector<double> sums(chain.rubs.size(), 0.0);
    std::vector<LumenContact> lumen;
    int known = in_room;
    for (std::size_t r = 0; r < sums.size(); ++r) {
        const Rub& rub = chain.rubs[r];
        if (rub.valve) {
            sums[r] = chain.devices[rub.inner].inserted > 0;
            continue;
        }
        if (known != rub.outer) lumen = lumen_contacts(chain, contacts, known = rub.outer);
        for (const LumenContact& contact : lumen)
            if (contact.inner == rub.inner) sums[r] += contact.press.norm();
        // A wall that answers nonsense leaves no finite forces.
        if (!std::isfinite(sums[r])) sums[r] = 0;
    }
    return sums;
}

Vec2 force_of(const Chain& chain, const Rub& rub, double pressure) {
    return pressure * largest(chain, rub, rub.holds_fast()) * rub.fraction();
}

int carrier_of_valve(const Chain& chain, int device) {
    assert(device >= 0 && device < static_cast<int>(chain.devices.size()));
    for (int k = device + 1; k < static_cast<int>(chain.devices.size()); ++k)
        if (chain.devices[k].inserted > 0) return k;
    return in_room;
}

std::vector<LumenContact> lumen_contacts(const Chain& chain, std::span<const WallContact> contacts,
                                         int outer) {
    assert(outer >= 1 && outer < static_cast<int>(chain.devices.size()));
    assert(contacts.size() == chain.joints.size());
    const int n = chain.segments();
    std::vector<LumenContact> found(n + 1);
    const std::vector<double>& fraction = chain.devices[outer].fraction;
    std::vector<Vec3> directors;
    if (chain.bent_segments() > 0) directors = physics::directors(chain);
    std::array<double, most_devices> signed_friction = {};
    for (int k = 0; k < outer; ++k)
        if (const Rub* rub = lumen_rub(chain, k, outer))
            signed_friction[k] = largest(chain, *rub, rub->holds_fast()) * rub->fraction().x();
    const auto bears = [&](int joint) {
        Vec3 sum = Vec3::Zero();
        for (int k = 0; joint < n && k < outer; ++k) sum += moment(chain, directors, chain.devices[k], joint);
        return sum;
    };
    Vec3 all = Vec3::Zero();     // on everything distal [N]
    Vec3 within = Vec3::Zero();  // borne by the devices within
    Vec3 distal = Vec3::Zero();  // their moment at the joint [N·mm]
    for (int j = n; j >= 1; --j) {
        const Vec3 load = chain.length_of(j) * chain.load;
        all += load - contacts[j].push();
        if (!chain.grips.empty() && chain.grips[j].holds()) all -= chain.grips[j].push(chain.joints[j]);
        const Vec3 proximal = bears(j - 1), &u = chain.tangents[j];
        const Vec3 shear = u.cross(distal - proximal) / chain.lengths[j];
        distal = proximal;
        const int inner = toucher(chain, outer, j);
        if (!(fraction[j] > 0) || inner < 0) {
            // The outer device is not here, or nothing is in it.
            within = fraction[j] > 0 ? Vec3::Zero() : all;
            continue;
        }
        LumenContact& contact = found[j];
        contact.inner = inner;
        const double weight = std::min(1.0, fraction[j]);
        const Vec3 along = j < n ? Vec3((u + chain.tangents[j + 1]).normalized()) : u;
        if (chain.leading < outer) within += load;
        Vec3 borne = within;
        // Tension and friction depend on each other by half the angle of the joint.
        for (int round = 0; round < 6; ++round) {
            borne = (within.dot(along) + contact.friction - shear.dot(along)) / u.dot(along) * u + shear;
            const Vec3 change = borne - within;
            contact.press = weight * (change - change.dot(along) * along);
            contact.friction = signed_friction[inner] * contact.press.norm();
        }
        within = borne;
    }
    return found;
}

void follow_grips(Chain& chain) {
    const bool sticks = chain.sticks();
    for (std::size_t j = 0; j < chain.grips.size(); ++j) {
        Grip& grip = chain.grips[j];
        const double lost = grip.follow(chain.joints[j]);
        chain.friction_loss += lost;
        if (sticks && lost > 0) grip.rested = just_slipped;
    }
    if (sticks) fraction_rest(chain);
}

void start_rubs(Chain& chain) {
    const int devices = static_cast<int>(chain.devices.size());
    const auto add = [&](int inner, int outer, bool valve) {
        for (const Rub& rub : chain.rubs)
            if (rub.inner == inner && rub.valve == valve && (valve || rub.outer == outer)) return;
        Rub rub;
        rub.inner = inner;
        rub.outer = outer;
        rub.valve = valve;
        chain.rubs.push_back(rub);
    };
    for (int k = 0; k < devices; ++k)
        if (chain.devices[k].spec.holding_valve_friction() > 0) add(k, carrier_of_valve(chain, k), true);
    for (int outer = 1; outer < devices; ++outer)
        for (int inner = 0; inner < outer; ++inner)
            if (chain.devices[outer].spec.holding_inner_friction() > 0) add(inner, outer, false);
}

void add_rubs(const Chain& chain, std::span<const WallContact> contacts, std::span<HubLoad> loads) {
    if (chain.rubs.empty()) return;
    assert(loads.size() == chain.devices.size());
    const std::vector<double> pressure = pressures(chain, contacts);
    for (std::size_t r = 0; r < pressure.size(); ++r) {
        const Rub& rub = chain.rubs[r];
        const Vec2 force = force_of(chain, rub, pressure[r]);
        const double torque = radius_of(chain, rub) * force.y();
        loads[rub.inner].push -= force.x();
        loads[rub.inner].torque -= torque;
        if (rub.outer == in_room) continue;
        loads[rub.outer].push += force.x();
        loads[rub.outer].torque += torque;
    }
}

double valves_on_hub(const Chain& chain, int device) {
    double sum = 0;
    for (const Rub& rub : chain.rubs)
        if (rub.valve && rub.outer == device)
            sum += force_of(chain, rub, chain.devices[rub.inner].inserted > 0).x();
    return sum;
}

std::vector<HubLoad> shaft_loads(const Chain& chain, std::span<const WallContact> contacts,
                                 std::span<const HubLoad> hubs) {
    std::vector<HubLoad> loads(hubs.begin(), hubs.end());
    if (chain.rubs.empty() || loads.empty()) return loads;
    assert(loads.size() == chain.devices.size());
    for (int k = 0; k < static_cast<int>(loads.size()); ++k) loads[k].push -= valves_on_hub(chain, k);
    if (std::ranges::all_of(chain.devices, [](const Device& device) { return device.held; })) return loads;
    const std::vector<double> pressure = pressures(chain, contacts);
    for (std::size_t r = 0; r < pressure.size(); ++r) {
        const Rub& rub = chain.rubs[r];
        if (rub.outer == in_room) continue;
        const double come = force_of(chain, rub, pressure[r]).x() - rub.force.x();
        if (!chain.devices[rub.outer].held) loads[rub.inner].push += come;
        if (!chain.devices[rub.inner].held && !rub.valve) loads[rub.outer].push -= come;
    }
    return loads;
}

void follow_rubs(Chain& chain, std::span<const WallContact> contacts) {
    if (chain.rubs.empty()) return;
    const std::vector<double> pressure = pressures(chain, contacts);
    for (std::size_t r = 0; r < pressure.size(); ++r) {
        Rub& rub = chain.rubs[r];
        const Vec2 force = force_of(chain, rub, pressure[r]);
        const double before = rub.energy();
        const double elastic = elastic_part(rub.slide, rub.moved);
        const Vec2 give = elastic * rub.moved, slip = rub.moved - give, gave = rub.slide + give;
        // What lets go has resisted by the static coefficient as far as it gave.
        const bool slips = rub.slips(), lets_go = slips && rub.rested >= rest_time;
        const Vec2 most = -pressure[r] * gave / slip_length;
        const Vec2 peak = most * largest(chain, rub, lets_go || rub.holds_fast());
        const bool slid = elastic < 1e-9 && rub.rested < rest_time;  // from the beginning
        const Vec2 first = slid ? rub.force : Vec2(most * largest(chain, rub, rub.holds_fast()));
        const double work = -0.5 * ((rub.force + peak).dot(give) + (first + force).dot(slip));
        const Vec2 motion = rub.slide + rub.moved;
        rub.slide = motion * (slip_length / std::max(slip_length, motion.norm()));
        if (slips) rub.rested = just_slipped;
        rub.moved.setZero();
        rub.force = force;
        // Of a device that is out nothing is left.
        if (pressure[r] == 0 && chain.devices[rub.inner].inserted <= 0) {
            rub.slide.setZero();
            rub.force.setZero();
        }
        chain.rub_loss += before + work - rub.energy();
    }
    follow_carriers(chain);
    assert(std::isfinite(chain.rub_loss));
}

bool let_rest(Chain& chain, double seconds) {
    assert(seconds >= 0);
    if (!chain.sticks()) return false;
    const auto rest = [&](double& rested) {  // whether it now is long enough
        if (rested >= rest_time) return false;
        rested = rested < 0 ? 0 : rested + seconds;
        if (rested < rest_time - 1e-9) return false;
        rested = rest_time;
        return true;
    };
    bool stiffer = false;
    for (std::size_t j = 1; j < chain.grips.size(); ++j) {
        Grip& grip = chain.grips[j];
        if (!grip.holds()) continue;
        if (!rest(grip.rested) || !(chain.static_friction[j] > chain.friction[j])) continue;
        const double most = grip.force * chain.static_friction[j] / chain.friction[j];
        chain.friction_loss += grip.strengthen(chain.joints[j], most);
        stiffer = true;
    }
    fraction_rest(chain);
    for (Rub& rub : chain.rubs) {
        if (!rest(rub.rested)) continue;
        const double before = rub.energy(), fast = largest(chain, rub, true);
        if (fast > 0) rub.slide *= largest(chain, rub, false) / fast;
        chain.rub_loss += before - rub.energy();
    }
    return stiffer;
}

}  // namespace physics
