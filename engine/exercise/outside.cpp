#include "engine/exercise/outside.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace exercise {
namespace {

constexpr double seen = 0.05;        // a bow that is off by less is left alone [mm]
constexpr double felt = 1e-3;        // [N]
constexpr double felt_share = 0.01;  // of the critical load
constexpr double stiff = 0.02;       // share of a feed that bows no shaft
constexpr double least_feed = 1e-3;  // that is made [mm]
constexpr double stiffest = 1e3;     // answer of a chain [N/mm]
constexpr double least_sag = 0.01;   // no shaft is straighter [mm]

double weight(const scenario::Device& device) {                        // [N/mm]
    constexpr double gravity = 9.81, wire = 6.5e-6, polymer = 1.5e-6;  // [m/s²], [kg/mm³]
    const double outer = device.outer_diameter, inner = device.inner_diameter;
    return 0.25 * M_PI * (outer * outer - inner * inner) * gravity *
           (device.kind == scenario::DeviceKind::Wire ? wire : polymer);
}

}  // namespace

physics::OutsideShaft outside_shaft(const scenario::Device& device, double distance) {
    assert(distance > 0);
    const double rigidity = device.shaft_rigidity(), share = scenario::free_shaft / distance;
    physics::OutsideShaft shaft;
    shaft.length = distance;
    shaft.critical = device.buckling_force > 0 ? device.buckling_force * share * share
                                               : physics::euler_force(rigidity, distance);
    shaft.sag = std::max(least_sag, weight(device) * std::pow(distance, 4) / (384 * rigidity));
    return shaft;
}

void Outside::reset(std::span<const scenario::PlacedDevice> devices, double distance) {
    shafts_.clear();
    for (const scenario::PlacedDevice& placed : devices)
        shafts_.push_back(outside_shaft(placed.device, distance));
    answers_.assign(devices.size(), 0.0);
    tries_ = 0;
}

void Outside::grip(int device, const scenario::Device& of, double distance) {
    physics::OutsideShaft& shaft = shafts_[device];
    const double push = shaft.push_at(shaft.bow), bow = shaft.bow;
    shaft = outside_shaft(of, distance);
    // A longer shaft bears less: it takes back what it can't hold from inside.
    shaft.bow = std::min(shaft.bow_at(push), std::max(0.0, bow));
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
        if (!device.held || device.inserted <= 0 || !std::isfinite(loads[k].push)) continue;
        const double off = shaft.push_at(shaft.bow) - loads[k].push;
        const double over = std::abs(off) - felt - felt_share * shaft.critical;
        const double push = std::min(loads[k].push, shaft.push_at(shaft.most_bow()));
        const double excess = shaft.bow - shaft.bow_at(push);
        if (over <= worst || std::abs(excess) <= seen) continue;
        worst = over;
        // The chain answers a feed by a larger push, the bow by a smaller one.
        const double most = std::min(std::abs(excess), 0.5 * chain.grid.segment_length);
        const double feed = off / (answers_[k] + shaft.stiffness_at(shaft.bow));
        found = {k, std::clamp(feed, -most, most)};
    }
    if (worst == 0) return std::nullopt;
    ++tries_;
    return found;
}

}  // namespace exercise
