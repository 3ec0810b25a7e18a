#include "physics/wire/friction.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/wire/bending.h"

namespace physics {
namespace {

const Rub* rub_of(const Chain& chain, int inner, int outer) {
    for (const Rub& rub : chain.rubs)
        if (rub.inner == inner && rub.outer == outer) return &rub;
    return nullptr;
}

/// Coefficient of a lumen [-], force of a valve [N].
double largest(const Chain& chain, const Rub& rub, bool holds_fast) {
    const DeviceSpec& spec = chain.devices[rub.outer == valve ? rub.inner : rub.outer].spec;
    if (rub.outer == valve) return holds_fast ? spec.holding_valve_friction() : spec.valve_friction;
    return holds_fast ? spec.holding_inner_friction() : spec.inner_friction;
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
        const double share = chain.devices[k].share[joint];
        if (share >= 0.5) return k;
        if (share > 0 && some < 0) some = k;
    }
    return some;
}

/// Of each rub: the normal force that its friction is proportional to, summed over the joints; 1 of a valve
/// that something is in.
std::vector<double> pressures(const Chain& chain, std::span<const WallContact> contacts) {
    std::vector<double> sums(chain.rubs.size(), 0.0);
    std::vector<LumenContact> lumen;
    int known = valve;
    for (std::size_t r = 0; r < sums.size(); ++r) {
        const Rub& rub = chain.rubs[r];
        if (rub.outer == valve) {
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

/// A joint that touches nothing has lain still as the nearest one that does, for touch goes from joint to
/// joint while the chain lies there; where none does, what comes to touch moves.
void share_rest(Chain& chain) {
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

double force_of(const Chain& chain, const Rub& rub, double pressure) {
    return pressure * largest(chain, rub, rub.holds_fast()) * rub.share();
}

}  // namespace

std::vector<LumenContact> lumen_contacts(const Chain& chain, std::span<const WallContact> contacts,
                                         int outer) {
    assert(outer >= 1 && outer < static_cast<int>(chain.devices.size()));
    assert(contacts.size() == chain.joints.size());
    const int n = chain.segments();
    std::vector<LumenContact> found(n + 1);
    const std::vector<double>& share = chain.devices[outer].share;
    std::vector<Vec3> directors;
    if (chain.bent_segments() > 0) directors = physics::directors(chain);
    std::array<double, most_devices> signed_friction = {};
    for (int k = 0; k < outer; ++k)
        if (const Rub* rub = rub_of(chain, k, outer))
            signed_friction[k] = largest(chain, *rub, rub->holds_fast()) * rub->share();
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
        if (!(share[j] > 0) || inner < 0) {
            // The outer device is not here, or nothing is in it.
            within = share[j] > 0 ? Vec3::Zero() : all;
            continue;
        }
        LumenContact& contact = found[j];
        contact.inner = inner;
        const double weight = std::min(1.0, share[j]);
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
    if (sticks) share_rest(chain);
}

void start_rubs(Chain& chain) {
    const int devices = static_cast<int>(chain.devices.size());
    const auto add = [&](int inner, int outer) {
        if (rub_of(chain, inner, outer)) return;
        Rub rub;
        rub.inner = inner;
        rub.outer = outer;
        chain.rubs.push_back(rub);
    };
    for (int k = 0; k < devices; ++k)
        if (chain.devices[k].spec.holding_valve_friction() > 0) add(k, valve);
    for (int outer = 1; outer < devices; ++outer)
        for (int inner = 0; inner < outer; ++inner)
            if (chain.devices[outer].spec.holding_inner_friction() > 0) add(inner, outer);
}

void add_rubs(const Chain& chain, std::span<const WallContact> contacts, std::span<HubLoad> loads) {
    if (chain.rubs.empty()) return;
    assert(loads.size() == chain.devices.size());
    const std::vector<double> pressure = pressures(chain, contacts);
    for (std::size_t r = 0; r < pressure.size(); ++r) {
        const Rub& rub = chain.rubs[r];
        const double force = force_of(chain, rub, pressure[r]);
        loads[rub.inner].push -= force;
        if (rub.outer != valve) loads[rub.outer].push += force;
    }
}

void follow_rubs(Chain& chain, std::span<const WallContact> contacts) {
    if (chain.rubs.empty()) return;
    const std::vector<double> pressure = pressures(chain, contacts);
    for (std::size_t r = 0; r < pressure.size(); ++r) {
        Rub& rub = chain.rubs[r];
        const double force = force_of(chain, rub, pressure[r]), before = rub.energy();
        const double slide = std::clamp(rub.slide + rub.moved, -slip_length, slip_length);
        const double give = slide - rub.slide, slip = rub.slide + rub.moved - slide;
        // What lets go has resisted by the static coefficient as far as it gave.
        const double peak = rub.slips() && rub.rested >= rest_time
                                ? pressure[r] * largest(chain, rub, true) * rub.share()
                                : force;
        const bool slid = give == 0 && rub.rested < rest_time;  // from the beginning
        const double first = slid ? rub.force : force;          // when it began to slip
        const double work = -0.5 * ((rub.force + peak) * give + (first + force) * slip);
        if (rub.slips()) rub.rested = just_slipped;
        rub.slide = slide;
        rub.moved = 0;
        rub.force = force;
        // Of a device that is out nothing is left.
        if (pressure[r] == 0 && chain.devices[rub.inner].inserted <= 0) rub.slide = rub.force = 0;
        chain.rub_loss += before + work - rub.energy();
    }
    assert(std::isfinite(chain.rub_loss));
}

std::optional<Drag> drag(const Chain& chain, std::span<const WallContact> contacts,
                         std::span<const HubLoad> loads, DragSearch& search) {
    assert(search.tries >= 0 && contacts.size() == chain.joints.size());
    constexpr double balanced = 1e-3, share = 0.01;  // [N], of the valve's force
    constexpr double least = 1e-7;                   // [mm]
    constexpr double stiffest = 1e3;                 // [N/mm]
    if (chain.rubs.empty() || loads.size() != chain.devices.size()) return std::nullopt;
    Drag found;
    double worst = 0, load = 0;
    for (int k = 0; k < static_cast<int>(loads.size()); ++k) {
        const Device& device = chain.devices[k];
        if (device.held || device.inserted <= 0 || !std::isfinite(loads[k].push)) continue;
        const double over = std::abs(loads[k].push) - balanced - share * device.spec.valve_friction;
        if (over <= worst) continue;
        worst = over;
        load = loads[k].push;
        found.device = k;
    }
    if (worst == 0) return std::nullopt;
    const std::vector<double> pressure = pressures(chain, contacts);
    struct Own {
        const Rub* rub;
        double sign, pressure, now;  // now: force on the inner device [N]
        bool holds_fast;
    };
    std::vector<Own> own;
    double most = 0;
    for (std::size_t r = 0; r < pressure.size(); ++r) {
        const Rub& rub = chain.rubs[r];
        if (rub.inner != found.device && rub.outer != found.device) continue;
        own.push_back({&rub, rub.inner == found.device ? 1.0 : -1.0, pressure[r],
                       force_of(chain, rub, pressure[r]), rub.rested >= rest_time});
        most = std::max(most, std::abs(rub.moved));
    }
    most = std::min(most + 2 * slip_length, 0.5 * chain.grid.segment_length);
    // The chain's own load changes, too: as it did at the last try.
    double of_chain = load;
    for (const Own& o : own) of_chain += o.sign * o.now;
    double& stiffness = search.stiffness[found.device];
    if (search.device == found.device && std::abs(search.feed) > least)
        stiffness = std::clamp((of_chain - search.load) / search.feed, 0.0, stiffest);
    const auto load_at = [&](double feed) {
        double sum = load + stiffness * feed;
        for (const Own& o : own)
            sum -= o.sign *
                   (o.pressure * largest(chain, *o.rub, o.holds_fast) * o.rub->share(o.sign * feed) - o.now);
        return sum;
    };
    for (;;) {
        // The load rises with the feed.
        double low = -most, high = most;
        for (int k = 0; k < 50; ++k) {
            const double middle = 0.5 * (low + high);
            (load_at(middle) > 0 ? high : low) = middle;
        }
        found.feed = 0.5 * (low + high);
        bool let_go = false;
        for (Own& o : own) {
            const double slide = o.rub->slide + o.rub->moved + o.sign * found.feed;
            if (!o.holds_fast || std::abs(slide) <= slip_length * (1 + 1e-9)) continue;
            o.holds_fast = false;
            let_go = true;
        }
        if (!let_go) break;
    }
    if (std::abs(found.feed) < least) return std::nullopt;
    ++search.tries;
    search.device = found.device;
    search.feed = found.feed;
    search.load = of_chain;
    return found;
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
    share_rest(chain);
    for (Rub& rub : chain.rubs) {
        if (!rest(rub.rested)) continue;
        const double before = rub.energy(), fast = largest(chain, rub, true);
        if (fast > 0) rub.slide *= largest(chain, rub, false) / fast;
        chain.rub_loss += before - rub.energy();
    }
    return stiffer;
}

}  // namespace physics
