#include "engine/exercise/complications.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <fmt/format.h>

#include "engine/anatomy/organs.h"

namespace exercise {
namespace {

using geometry::Vec3;
using script::ComplicationKind;

constexpr double clot_shear = 1e-3;      // that a fresh clot bears: 1 kPa, an estimate [N/mm²]
constexpr double spasm_pressure = 1e-2;  // on what lies in it: 10 kPa, an estimate [N/mm²]
constexpr double full_pressure = 0.2;    // is reached where a device keeps the wall away by this [mm]

bool narrows(ComplicationKind kind) {
    return kind == ComplicationKind::Spasm || kind == ComplicationKind::Dissection;
}

/// Part of the lumen's radius that is to be left [-].
double left_of(const Complication& c) {
    return 1 - c.percent / 100;
}

}  // namespace

std::string name_of(const Complication& c, const anatomy::Anatomy& anatomy) {
    if (c.kind == ComplicationKind::Breath)
        return c.breath == script::BreathManner::Cough ? "cough" : "deep breathing";
    return fmt::format("{} {} the {}", script::name_of(c.kind), script::preposition(c.kind),
                       anatomy::clinical_name(anatomy.branches[static_cast<std::size_t>(c.branch)].name));
}

std::string Complications::problem(const script::Complicate& c, const anatomy::Anatomy& anatomy) {
    if (c.kind == ComplicationKind::Breath) return {};
    return stretch_problem(anatomy, c.branch, c.at, c.over, script::name_of(c.kind));
}

std::string Complications::problem(const script::Relieve& r, const anatomy::Anatomy& anatomy) {
    return !r.kind || anatomy::branch_named(anatomy, r.branch) ? "" : unknown_branch(r.branch, anatomy);
}

void Complications::set(const script::Complicate& c, const anatomy::Anatomy& anatomy, int frame,
                        const std::function<bool(const Complication&)>& stays) {
    assert(problem(c, anatomy).empty());
    Complication made{c.kind, -1, c.at, c.over, c.percent, c.breath, frame};
    if (c.kind == ComplicationKind::Breath) {
        for (Complication& other : all_)
            if (other.kind == c.kind && other.set()) other.relieved = frame;
        if (c.breath == script::BreathManner::Free) return;
        if (c.breath == script::BreathManner::Cough) made.relieved = frame;
    } else {
        made.branch = *anatomy::branch_named(anatomy, c.branch);
        for (Complication& other : all_)
            if (other.set() && other.kind == made.kind && other.branch == made.branch &&
                !(stays && stays(other)))
                other.relieved = frame;
    }
    all_.push_back(made);
    places_.push_back(place_of(made, anatomy));
    if (narrows(made.kind)) all_.back().closed.assign(places_.back().axis.size(), 0.0);
}

void Complications::relieve(const script::Relieve& r, const anatomy::Anatomy& anatomy, int frame) {
    const int branch = r.kind ? *anatomy::branch_named(anatomy, r.branch) : -1;
    for (Complication& c : all_)
        if (c.set() && (!r.kind || (c.kind == *r.kind && c.branch == branch))) c.relieved = frame;
}

void Complications::relieve(std::size_t which, int frame) {
    if (all_[which].set()) all_[which].relieved = frame;
}

bool Complications::in_vessels() const {
    return std::ranges::any_of(all_, [](const Complication& c) { return c.branch >= 0 && !c.gone(); });
}

void Complications::find_places(const anatomy::Anatomy& anatomy) {
    places_.clear();
    for (const Complication& c : all_) places_.push_back(c.gone() ? BranchStretch() : place_of(c, anatomy));
}

BranchStretch Complications::place_of(const Complication& c, const anatomy::Anatomy& anatomy) {
    return c.branch < 0 ? BranchStretch() : stretch_of(anatomy, c.branch, c.at, c.over);
}

/// How far each sample may be closed for the devices that lie in it, and for balloons, which open it again
/// [-].
Complications::Room Complications::room_for(const physics::Chain& chain, const Complication& c,
                                            const BranchStretch& place) {
    constexpr std::size_t beside = 3;  // samples on either side that a joint's device reaches
    Room room{std::vector<double>(place.axis.size(), 1.0), std::vector<double>(place.axis.size(), 1.0)};
    double arc = 0;
    for (std::size_t j = 0; j < chain.joints.size(); ++j) {
        if (j > 0) arc += chain.lengths[j];
        std::size_t nearest = 0;
        for (std::size_t k = 1; k < place.axis.size(); ++k)
            if ((chain.joints[j] - place.axis[k]).squaredNorm() <
                (chain.joints[j] - place.axis[nearest]).squaredNorm())
                nearest = k;
        if ((chain.joints[j] - place.axis[nearest]).norm() >
            BranchStretch::uneven * place.lumen[nearest] + physics::Narrowing::spacing)
            continue;
        double balloon = 0;
        for (const physics::Device& device : chain.devices)
            for (const physics::Bulge& bulge : device.bulge)
                balloon = std::max(balloon, bulge.radius(device.inserted - arc));
        const double needed = std::max(chain.inner_radius() + chain.thickness[j], balloon) + room_left;
        for (std::size_t k = nearest < beside ? 0 : nearest - beside;
             k < std::min(nearest + beside + 1, room.devices.size()); ++k) {
            const double closes = place.open[k] - left_of(c) * place.lumen[k];
            const double most = std::clamp((place.open[k] - needed) / closes, 0.0, 1.0);
            room.devices[k] = std::min(room.devices[k], most);
            if (balloon > 0) room.balloon[k] = std::min(room.balloon[k], most);
        }
    }
    return room;
}

bool Complications::move(Complication& c, const BranchStretch& place, const physics::Chain& chain,
                         double seconds) {
    double farthest = 0;  // way of the wall [mm]
    for (std::size_t k = 0; narrows(c.kind) && k < place.axis.size(); ++k)
        farthest = std::max(farthest, place.open[k] - left_of(c) * place.lumen[k]);
    const double part = std::min(seconds / time_to_come, farthest > 0 ? largest_move / farthest : 1.0);
    const double came = c.come;
    c.come = c.set() ? std::min(1.0, c.come + part) : std::max(0.0, c.come - part);
    bool changed = c.come != came;
    if (c.gone()) {
        c.closed.clear();
        return changed;
    }
    if (!narrows(c.kind)) return changed;
    const bool balloon =
        std::ranges::any_of(chain.devices, [](const physics::Device& d) { return !d.bulge.empty(); });
    std::optional<Room> room;
    if (balloon) room = room_for(chain, c, place);
    for (std::size_t k = 0; k < c.closed.size(); ++k) {
        const double wanted = c.come * place.shape[k], before = c.closed[k];
        if (wanted > before) {
            if (!room) room = room_for(chain, c, place);
            c.closed[k] = std::min({wanted, before + part, std::max(before, room->devices[k])});
            c.held_off = c.held_off || wanted > room->devices[k];
        } else {
            c.closed[k] = wanted;
        }
        if (balloon) c.closed[k] = std::min(c.closed[k], room->balloon[k]);
        changed = changed || c.closed[k] != before;
    }
    return changed;
}

bool Complications::step(double seconds, const physics::Chain& chain) {
    assert(places_.size() == all_.size());
    bool changed = false;
    for (std::size_t k = 0; k < all_.size(); ++k) {
        if (all_[k].branch < 0 || all_[k].gone()) continue;
        changed = move(all_[k], places_[k], chain, seconds) || changed;
        if (all_[k].gone()) places_[k] = {};
    }
    return changed;
}

Complications Complications::as_seen() const {
    constexpr double steps = 4;
    Complications seen = *this;
    for (Complication& c : seen.all_) {
        if (c.come == 0 || c.come == 1) continue;
        const double shown = std::floor(c.come * steps) / steps;
        for (double& closed : c.closed) closed *= shown / c.come;
        c.come = shown;
    }
    return seen;
}

std::vector<physics::Narrowing> Complications::narrowings() const {
    std::vector<physics::Narrowing> made;
    for (std::size_t n = 0; n < all_.size(); ++n) {
        const Complication& c = all_[n];
        const BranchStretch& place = places_[n];
        if (c.branch < 0 || c.gone()) continue;
        physics::Narrowing& narrowing = made.emplace_back();
        for (std::size_t k = 0; k < place.axis.size(); ++k) {
            const double narrow = left_of(c) * place.lumen[k];
            physics::Narrowing::Sample sample =
                place.sample(k, narrow, c.kind == ComplicationKind::Thrombus ? 0.0 : c.closed[k]);
            if (c.kind == ComplicationKind::Thrombus) {
                sample.shear = clot_shear * c.come * place.shape[k];
            } else if (c.kind == ComplicationKind::Dissection) {
                // The vessel's wall is as much farther from the tube's axis on the flap's side.
                const double aside = c.closed[k] * (place.lumen[k] - narrow);
                sample.aside = aside * place.side[k];
                sample.lumen += aside;
            } else {
                sample.pressure =
                    spasm_pressure * std::min(1.0, (c.come * place.shape[k] - c.closed[k]) *
                                                       (place.open[k] - narrow) / full_pressure);
            }
            narrowing.samples.push_back(sample);
        }
    }
    return made;
}

std::vector<blood::Obstruction> Complications::obstructions() const {
    std::vector<blood::Obstruction> made;
    for (std::size_t n = 0; n < all_.size(); ++n) {
        const Complication& c = all_[n];
        const BranchStretch& place = places_[n];
        if (c.branch < 0 || c.gone()) continue;
        std::vector<double> radii;
        for (std::size_t k = 0; c.kind != ComplicationKind::Thrombus && k < place.axis.size(); ++k)
            radii.push_back(place.open[k] + c.closed[k] * (left_of(c) * place.lumen[k] - place.open[k]));
        made.push_back(place.obstruction(c.branch, radii));
        if (c.kind == ComplicationKind::Thrombus) made.back().passes = 1 - c.come;
    }
    return made;
}

}  // namespace exercise
