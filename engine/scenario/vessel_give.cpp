#include "engine/scenario/vessel_give.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <tuple>
#include <utility>

namespace scenario {
namespace {

using geometry::Vec3;

constexpr double step = 3;        // of nodes [mm]
constexpr double lead_step = 10;  // of how far tips are past each other [mm]
constexpr double tip_step = 4;    // of the places where a tip is tried [mm]
constexpr double past_tip = 30;   // of vessel that a tip's force is borne by [mm]
/// Where the beam is cut off from the rest of the device it is free, and presses as a tip does: so much does
/// not count [mm].
constexpr double cut = 40;
/// Stated is so many times what the beam does: with it 3 of 343 places are below what the whole chain does
/// there, without it a tenth, mostly by a fifth (docs/solver.md, section 8).
constexpr double margin = 1.5;
constexpr double turns = 20;  // over which a bend is looked at, where the tip is straight [mm]

struct Bend {
    double curvature = 0, plane = 0;  // [1/mm], [rad]
};
Bend shape_at(const physics::Device& device, double from_tip) {
    for (const physics::RestArc& arc : device.spec.shape) {
        if (from_tip < arc.length) return {arc.angle / arc.length, arc.plane};
        from_tip -= arc.length;
    }
    return {};
}

/// The curvature of the unloaded device in space, at a place of a way whose tangent and side are given.
Vec3 rest_of(const Bend& bend, const Vec3& along, const Vec3& side) {
    return bend.curvature * (std::cos(bend.plane) * side + std::sin(bend.plane) * along.cross(side));
}

using Place = VesselGives::Place;

/// Places at equal distances along stations from the first one on.
std::vector<Place> resampled(std::span<const geometry::Station> stations, const std::vector<int>& path,
                             double most) {
    std::vector<Place> places;
    double begin = 0;  // of the piece
    for (std::size_t k = 0; k + 1 < path.size() && begin <= most; ++k) {
        const Vec3 from = stations[path[k]].centre, piece = stations[path[k + 1]].centre - from;
        const double length = piece.norm();
        for (double next = step * static_cast<double>(places.size()); next < begin + length && next <= most;
             next = step * static_cast<double>(places.size()))
            places.push_back({from + (next - begin) / length * piece, path[k], 0});
        begin += length;
    }
    return places;
}

/// Means over a radius to both sides: what is across a bend sharper than the lumen is wide has no order along
/// the way.
std::vector<Place> rounded(std::span<const geometry::Station> stations, const std::vector<Place>& places) {
    std::vector<Place> round = places;
    const int count = static_cast<int>(places.size());
    for (int i = 0; i < count; ++i) {
        const int reach = std::min(
            {i, count - 1 - i, static_cast<int>(std::lround(stations[places[i].station].radius / step))});
        Vec3 sum = Vec3::Zero();
        for (int k = i - reach; k <= i + reach; ++k) sum += places[k].centre;
        round[i].centre = sum / (2 * reach + 1);
        round[i].off = (round[i].centre - places[i].centre).norm();
    }
    return round;
}

}  // namespace

std::string vessels_sentence(const VesselGive& give, bool stay, bool as_asked) {
    if (give.branch.empty())
        return fmt::format("vessels {}{}: within reach devices push none aside",
                           stay ? "stay where they are" : "make way", as_asked ? " as asked" : "");
    return fmt::format("vessels {}{}: within reach devices can push '{}' aside by {:.2g} mm{}",
                       stay ? "stay where they are" : "make way", as_asked ? " as asked" : "", give.branch,
                       give.most, stay ? ", which is left out" : "");
}

VesselGives::VesselGives(std::shared_ptr<const Reach> reach, std::vector<physics::Tissue> tissues,
                         const geometry::OpenEnd& entry)
    : reach_(std::move(reach)), tissues_(std::move(tissues)) {
    std::tie(before_, lengths_) = reach_->paths_from(entry);
}

VesselGive VesselGives::around(const physics::Chain& chain, double ahead, double enough) {
    VesselGive found;
    const int count = static_cast<int>(chain.devices.size());
    std::vector<int> tips;
    for (const physics::Device& device : chain.devices)
        tips.push_back(reach_->station_of(chain, device.inserted));
    for (int k = 0; k < count; ++k) {
        const double radius = 0.5 * chain.devices[k].spec.outer_diameter;
        for (const int s : reach_->near(tips[k], ahead)) {
            const Case wanted = case_of(k, s, tips, ahead);
            if (!is_tried(s) || reach_->stations()[s].radius < radius - geometry::centreline_error) continue;
            const auto [known, is_new] = known_.try_emplace(wanted);
            if (is_new) known->second = of(wanted, chain.devices);
            if (known->second.most > found.most) found = known->second;
            if (found.most > enough) return found;
        }
    }
    return found;
}

/// Of places less than tip_step apart one is tried.
bool VesselGives::is_tried(int station) const {
    const int before = before_[station];
    return lengths_[station] >= 0 && (before < 0 || std::floor(lengths_[station] / tip_step) !=
                                                        std::floor(lengths_[before] / tip_step));
}

VesselGives::Case VesselGives::case_of(int device, int station, const std::vector<int>& tips,
                                       double ahead) const {
    Case wanted{device, station, {}};
    for (std::size_t other = 0; other < tips.size(); ++other) {
        const double lead = lengths_[tips[other]] + ahead - lengths_[station];
        if (static_cast<int>(other) != device)
            wanted.leads[other] = static_cast<int>(std::ceil(std::clamp(lead, -500.0, 500.0) / lead_step));
    }
    return wanted;
}

/// From the tip back towards the entry, as far as the devices change along it and what is cut off after that.
std::vector<Place> VesselGives::path_back(int tip, const std::vector<physics::Device>& devices) const {
    double window = turns;
    for (const physics::Device& device : devices)
        window = std::max(window, physics::varying_length(device.spec));
    window += 2 * cut;
    std::vector<int> path;
    for (int s = tip; s >= 0 && lengths_[tip] - lengths_[s] <= window + step; s = before_[s])
        path.push_back(s);
    return rounded(reach_->stations(), resampled(reach_->stations(), path, window));
}

/// The vessels along places that are given from the tip back, in the order of the way in, and some vessel
/// past the tip.
std::vector<TubeNode> VesselGives::tube(const std::vector<Place>& places) const {
    const int count = static_cast<int>(places.size()), past = static_cast<int>(past_tip / step);
    const Vec3 onward = places[0].centre - places[1].centre;
    std::vector<TubeNode> nodes(static_cast<std::size_t>(count + past));
    for (int i = 0; i < count + past; ++i) {
        const int back = count - 1 - i;
        const Place& place = places[std::max(back, 0)];
        const geometry::Station& station = reach_->stations()[place.station];
        const physics::Tissue& tissue = tissues_[station.branch];
        TubeNode& node = nodes[i];
        node.centre = place.centre - std::min(back, 0) * onward;
        node.modulus = tissue.modulus;
        node.bending = std::numbers::pi * std::pow(station.radius, 4) * tissue.wall;
        // A branch begins within its parent's lumen.
        node.clearance = std::max(station.radius - place.off, reach_->room(place.centre, place.station));
    }
    return nodes;
}

/// Lays the devices in: shapes are turned away from the bend next to the tip, at worst.
void VesselGives::lay(const Case& wanted, const std::vector<physics::Device>& devices, int count,
                      std::vector<TubeNode>& nodes) const {
    double shaped = turns;
    for (const physics::Device& device : devices)
        shaped = std::max(shaped, physics::shaped_length(device.spec));
    const auto centre = [&](int back) { return nodes[count - 1 - std::clamp(back, 0, count - 1)].centre; };
    const int far = std::min(count - 1, static_cast<int>(shaped / step));
    Vec3 side = 2 * centre(far / 2) - centre(far) - centre(0);
    for (int back = 0; back < count; ++back) {
        TubeNode& node = nodes[count - 1 - back];
        const Vec3 along = (centre(back - 1) - centre(back + 1)).normalized();
        side -= side.dot(along) * along;
        if (side.norm() < 1e-6) side = along.unitOrthogonal();
        side.normalize();
        double thickest = 0;
        for (std::size_t k = 0; k < devices.size(); ++k) {
            const double from_tip = step * back + lead_step * wanted.leads[k];
            if (from_tip < 0) continue;
            const double rigidity = physics::rigidity_at(devices[k].spec, from_tip);
            node.rigidity += rigidity;
            node.rest += rigidity * rest_of(shape_at(devices[k], from_tip), along, side);
            thickest = std::max(thickest, 0.5 * devices[k].spec.outer_diameter);
        }
        node.rest /= node.rigidity;
        node.clearance = std::max(0.0, node.clearance - thickest);
    }
}

VesselGive VesselGives::of(const Case& wanted, const std::vector<physics::Device>& devices) const {
    const std::vector<Place> places = path_back(wanted.station, devices);
    const int count = static_cast<int>(places.size());
    if (count < 4) return {};
    std::vector<TubeNode> nodes = tube(places);
    lay(wanted, devices, count, nodes);
    const bool from_entry = lengths_[places.back().station] <= step;
    const std::vector<double> aside = pushed_aside(nodes, step, from_entry);
    VesselGive found;
    for (int i = from_entry ? 0 : static_cast<int>(cut / step); i < count; ++i)
        if (const double aside_most = margin * aside[i]; aside_most > found.most)
            found = {aside_most, reach_->name_of(places[count - 1 - i].station)};
    return found;
}

}  // namespace scenario
