#include "physics/wire/drag.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/wire/rub_forces.h"

namespace physics {
namespace {

constexpr double balanced = 1e-3, valve_fraction = 0.01;  // [N], of the valve's force
constexpr double least = 1e-7;                            // [mm]
constexpr double stiffest = 1e3;                          // [N/mm]
constexpr double largest_turn = 10 * degree;              // at once [rad]

/// A device's rub. Ways and forces of the device are along, and about its axis at its own radius.
struct OwnRub {
    const Rub* rub;
    double sign;   // whether it is the inner device
    double lever;  // radius of the rub over that of the device
    double pressure;
    bool holds_fast;
    Vec2 now;  // force on the device [N]

    Vec2 further(const Vec2& motion) const { return sign * Vec2(motion.x(), lever * motion.y()); }
    Vec2 on_device(const Vec2& force) const { return sign * Vec2(force.x(), lever * force.y()); }
};

std::vector<OwnRub> rubs_of(const Chain& chain, std::span<const WallContact> contacts, int device) {
    const std::vector<double> pressure = pressures(chain, contacts);
    const double radius = 0.5 * chain.devices[device].spec.outer_diameter;
    std::vector<OwnRub> own;
    for (std::size_t r = 0; r < pressure.size(); ++r) {
        const Rub& rub = chain.rubs[r];
        if (rub.inner != device && rub.outer != device) continue;
        OwnRub o{&rub,        rub.inner == device ? 1.0 : -1.0, radius_of(chain, rub) / radius,
                 pressure[r], rub.rested >= rest_time,          Vec2::Zero()};
        o.now = o.on_device(force_of(chain, rub, pressure[r]));
        own.push_back(o);
    }
    return own;
}

/// Where a function that never falls is zero, within `most` of 0 either way, or the end nearest to it.
template <class Function>
double root(const Function& f, double most) {
    constexpr double nothing = 1e-12;
    const double at_0 = f(0.0);
    if (std::abs(at_0) <= nothing) return 0;
    double near = 0, far = at_0 > 0 ? -most : most;
    for (int k = 0; k < 40; ++k) {
        const double middle = 0.5 * (near + far);
        (f(middle) * at_0 > 0 ? near : far) = middle;
    }
    return 0.5 * (near + far);
}

/// Load at the hub along and about the axis, at the device's radius [N].
Vec2 load_of(const Chain& chain, const HubLoad& load, int device) {
    return {load.push, load.torque / (0.5 * chain.devices[device].spec.outer_diameter)};
}

/// The device that no hand holds and whose hub bears the most; −1 for none.
int most_loaded(const Chain& chain, std::span<const HubLoad> loads) {
    int found = -1;
    double worst = 0;
    for (int k = 0; k < static_cast<int>(loads.size()); ++k) {
        const Device& device = chain.devices[k];
        const Vec2 load = load_of(chain, loads[k], k);
        if (device.held || device.inserted <= 0 || !load.allFinite()) continue;
        const double over =
            load.cwiseAbs().maxCoeff() - balanced - valve_fraction * device.spec.valve_friction;
        if (over <= worst) continue;
        worst = over;
        found = k;
    }
    return found;
}

}  // namespace

std::optional<Drag> drag(const Chain& chain, std::span<const WallContact> contacts,
                         std::span<const HubLoad> loads, DragSearch& search) {
    assert(search.tries >= 0 && contacts.size() == chain.joints.size());
    if (chain.rubs.empty() || loads.size() != chain.devices.size()) return std::nullopt;
    const int device = most_loaded(chain, loads);
    if (device < 0) return std::nullopt;
    const double radius = 0.5 * chain.devices[device].spec.outer_diameter;
    const Vec2 load = load_of(chain, loads[device], device);
    std::vector<OwnRub> own = rubs_of(chain, contacts, device);
    Vec2 most = Vec2::Zero(), of_chain = load;
    for (const OwnRub& o : own) {
        most = most.cwiseMax(Vec2(std::abs(o.rub->moved.x()), std::abs(o.rub->moved.y()) / o.lever));
        of_chain += o.now;
    }
    most = (most + Vec2::Constant(2 * slip_length))
               .cwiseMin(Vec2(0.5 * chain.grid.segment_length, largest_turn * radius));
    // The chain's own load changes, too: as it did at the last try.
    std::array<double, 2>& stiffness = search.stiffness[device];
    if (search.device == device && search.motion.norm() > least)
        for (int c = 0; c < 2; ++c) {
            const double missed = of_chain[c] - search.load[c] - stiffness[c] * search.motion[c];
            stiffness[c] = std::clamp(stiffness[c] + missed * search.motion[c] / search.motion.squaredNorm(),
                                      0.0, stiffest);
        }
    // Rises with the way, as the gradient of a convex function does.
    const auto load_at = [&](const Vec2& motion) {
        Vec2 sum = load + Vec2(stiffness[0] * motion.x(), stiffness[1] * motion.y());
        for (const OwnRub& o : own)
            sum -= o.on_device(o.pressure * largest(chain, *o.rub, o.holds_fast) *
                               o.rub->fraction(o.further(motion))) -
                   o.now;
        return sum;
    };
    const auto turned = [&](double feed) {
        return root([&](double turn) { return load_at({feed, turn}).y(); }, most.y());
    };
    Vec2 motion;
    for (bool let_go = true; let_go;) {
        motion.x() = root([&](double feed) { return load_at({feed, turned(feed)}).x(); }, most.x());
        motion.y() = turned(motion.x());
        let_go = false;
        for (OwnRub& o : own) {
            if (!o.holds_fast || !o.rub->slips(o.further(motion))) continue;
            o.holds_fast = false;
            let_go = true;
        }
    }
    if (!(motion.norm() >= least)) return std::nullopt;
    ++search.tries;
    search.device = device;
    search.motion = motion;
    search.load = of_chain;
    return Drag{device, motion.x(), motion.y() / radius};
}

}  // namespace physics
