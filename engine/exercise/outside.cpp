#include "engine/exercise/outside.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "physics/geometry/maths.h"

namespace exercise {
namespace {

constexpr double seen = 0.05;           // a bow that is off by less is left alone [mm]
constexpr double felt_fraction = 0.01;  // of the critical load
constexpr double stiff = 0.02;          // fraction of a feed that bows no shaft
constexpr double least_feed = 1e-3;     // that is made [mm]
constexpr double stiffest = 1e3;        // answer of a chain [N/mm]
constexpr double least_sag = 0.01;      // no shaft is straighter [mm]

double weight(const scenario::Device& device) {                        // [N/mm]
    constexpr double gravity = 9.81, wire = 6.5e-6, polymer = 1.5e-6;  // [m/s²], [kg/mm³]
    const double outer = device.outer_diameter, inner = device.inner_diameter;
    return 0.25 * M_PI * (outer * outer - inner * inner) * gravity *
           (device.kind == scenario::DeviceKind::Wire ? wire : polymer);
}

}  // namespace

physics::OutsideShaft outside_shaft(std::span<const scenario::Device* const> devices, double distance) {
    assert(distance > 0 && !devices.empty());
    const double fraction = scenario::free_shaft / distance;
    physics::OutsideShaft shaft;
    shaft.length = distance;
    shaft.critical = 0;
    double rigidity = 0, heavy = 0;
    for (const scenario::Device* device : devices) {
        const double stated = device->buckling_force, own = device->shaft_rigidity();
        shaft.critical += stated > 0 ? stated * fraction * fraction : physics::euler_force(own, distance);
        rigidity += own;
        heavy += weight(*device);
    }
    shaft.sag = std::max(least_sag, heavy * geometry::pow(distance, 4) / (384 * rigidity));
    return shaft;
}

physics::OutsideShaft Outside::shaft_of(int device, std::span<const scenario::PlacedDevice> devices,
                                        double distance) const {
    std::vector<const scenario::Device*> within;
    for (int k = 0; k < device; ++k)
        if (device == outermost() && is_within(k)) within.push_back(&devices[k].device);
    within.push_back(&devices[device].device);
    return outside_shaft(within, distance);
}

void Outside::reset(std::span<const scenario::PlacedDevice> devices, double distance) {
    shafts_.clear();
    together_ = 0;
    for (int k = 0; k < static_cast<int>(devices.size()); ++k)
        shafts_.push_back(shaft_of(k, devices, distance));
    answers_.assign(devices.size(), 0.0);
    tries_ = 0;
}

void Outside::grip(int device, std::span<const scenario::PlacedDevice> devices, double distance) {
    physics::OutsideShaft& shaft = shafts_[device];
    const double push = shaft.push_at(shaft.bow), bow = shaft.bow;
    shaft = shaft_of(device, devices, distance);
    // A longer shaft bears less: it takes back what it can't hold from inside.
    shaft.bow = std::min(shaft.bow_at(push), std::max(0.0, bow));
}

int Outside::outermost() const {
    return static_cast<int>(std::bit_width(together_)) - 1;
}

double Outside::bow(int device) const {
    const int outer = outermost();
    return shafts_[device].bow + (is_within(device) && device != outer ? shafts_[outer].bow : 0.0);
}

double Outside::push(int device, std::span<const physics::HubLoad> loads) const {
    if (device != outermost()) return loads[device].push;
    double sum = 0;
    for (int k = 0; k <= device; ++k)
        if (is_within(k)) sum += loads[k].push;
    return sum;
}

void Outside::hold(std::span<const scenario::PlacedDevice> devices, const physics::Chain& chain, bool all) {
    unsigned inside = 0;
    for (int k = 0; all && devices.size() > 1 && k < static_cast<int>(devices.size()); ++k)
        if (chain.devices[k].inserted > 0) inside |= 1U << k;
    const int outer = outermost();
    const bool springs_back = outer >= 0 && !chain.devices[outer].held;
    if (inside != together_) {
        for (int k = 0; springs_back && k < outer; ++k)
            if (is_within(k) && chain.devices[k].held)
                shafts_[k].bow = std::min(bow(k), shafts_[k].most_bow());
        hold_together(devices, inside);
        tries_ = 0;
    }
    for (int k = 0; k < static_cast<int>(devices.size()); ++k)
        if (!chain.devices[k].held) let_go(k);
}

/// The shafts that are others now keep their bow; a sag that a pull has straightened is back.
void Outside::hold_together(std::span<const scenario::PlacedDevice> devices, unsigned inside) {
    const int before = outermost();
    together_ = inside;
    for (const int k : {before, outermost()}) {
        if (k < 0) continue;
        const double bow = std::max(0.0, shafts_[k].bow);
        shafts_[k] = shaft_of(k, devices, shafts_[k].length);
        shafts_[k].bow = bow;
        answers_[k] = 0;
    }
}

double Outside::goes_in(int device, double feed, double push) const {
    const physics::OutsideShaft& shaft = shafts_[device];
    if (!std::isfinite(push)) return feed;
    if (feed < 0) return std::min(0.0, feed + std::max(0.0, shaft.bow));  // the bow comes out first
    // Both give alike: the chain by its answer, the shaft by its stiffness.
    const double bow = std::max(shaft.bow, shaft.bow_at(std::min(push, shaft.push_at(shaft.most_bow()))));
    const double in = feed / (1 + answers_[device] / shaft.stiffness_at(bow));
    if (feed - in < stiff * feed) return feed;
    return in < least_feed ? 0 : in;
}

void Outside::fed(int device, double by, double in, double before, double now) {
    shafts_[device].bow += by - in;
    if (const double answer = (now - before) / in; std::abs(in) > 1e-6 && std::isfinite(answer))
        answers_[device] = std::clamp(answer, 0.0, stiffest);
    if (by != 0) tries_ = 0;
}

bool Outside::takes(int device, double feed) {
    physics::OutsideShaft& shaft = shafts_[device];
    if (shaft.bow + feed > shaft.most_bow()) return false;
    shaft.bow += feed;
    answers_[device] = stiffest;
    tries_ = 0;
    return true;
}

double Outside::bears(int device, double by_hand) const {
    const physics::OutsideShaft& shaft = shafts_[device];
    const double bow = std::clamp(shaft.bow + by_hand, 0.0, shaft.most_bow());
    return std::max(shaft.push_at(bow), felt);
}

std::optional<Outside::Release> Outside::release(const physics::Chain& chain,
                                                 std::span<const physics::HubLoad> loads) {
    if (tries_ >= most_tries || loads.size() != shafts_.size()) return std::nullopt;
    Release found;
    double worst = 0;
    for (int k = 0; k < static_cast<int>(shafts_.size()); ++k) {
        const physics::Device& device = chain.devices[k];
        const physics::OutsideShaft& shaft = shafts_[k];
        const double load = push(k, loads);
        if (!device.held || device.inserted <= 0 || !std::isfinite(load)) continue;
        if (is_within(k) && k != outermost()) continue;  // held at the outermost one's hub
        const double off = shaft.push_at(shaft.bow) - load;
        const double over = std::abs(off) - felt - felt_fraction * shaft.critical;
        const double borne = std::min(load, shaft.push_at(shaft.most_bow()));
        const double excess = shaft.bow - shaft.bow_at(borne);
        if (over <= worst || std::abs(excess) <= seen) continue;
        worst = over;
        // The chain answers a feed by a larger push, the bow by a smaller one.
        const double most = std::min(std::abs(excess), 0.5 * chain.grid.segment_length);
        const double feed = off / (answers_[k] + shaft.stiffness_at(shaft.bow));
        found = {k == outermost() ? physics::every_device : k, std::clamp(feed, -most, most)};
    }
    if (worst == 0) return std::nullopt;
    ++tries_;
    return found;
}

}  // namespace exercise
