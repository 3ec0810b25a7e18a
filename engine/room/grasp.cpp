#include "engine/room/grasp.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/exercise/device_rules.h"
#include "engine/exercise/lines.h"

namespace room {
namespace {

using Site = InjectionPreset::Site;

constexpr double least_rate = 0.1;    // of a command [ml/s]
constexpr double rate_digits = 1e-2;  // of a hand that the lumen slows, rounded down [ml/s]

/// Of a flush catheter [ml/s].
double largest_flush() {
    return exercise::largest_flow(exercise::flush_catheter(), 0, 0);
}

/// A branch by its name or the start of its name, as commands take it.
bool has_branch(const anatomy::Anatomy& anatomy, const std::string& name) {
    return std::ranges::any_of(anatomy.branches, [&](const auto& branch) {
        return branch.name == name || branch.name.starts_with(name + "+");
    });
}

/// The site that is there.
Site site_of(const InjectionPreset& preset, std::size_t devices, const anatomy::Anatomy& anatomy) {
    const bool there = preset.site == Site::Device ? devices > 1 : has_branch(anatomy, preset.branch);
    return there ? preset.site : Site::Introducer;
}

}  // namespace

using script::DeviceRole;

Grasp::Grasp(const exercise::Simulation& simulation) {
    for (const scenario::PlacedDevice& device : simulation.devices()) {
        roles_.push_back(device.role);
        helped_.push_back(device.pinned);
    }
    hand(Side::Right) = roles_[0];
    if (roles_.size() > 1) hand(Side::Left) = roles_[1];
}

bool Grasp::has(Side side, std::size_t device) const {
    const std::optional<DeviceRole> held = in(side);
    return held && (*held == DeviceRole::All || *held == roles_[device]);
}

void Grasp::take_next(Side side) {
    if (roles_.size() == 1) return;
    const Side other = side == Side::Right ? Side::Left : Side::Right;
    const std::optional<DeviceRole> had = in(side);
    std::optional<DeviceRole> next = DeviceRole::All;
    if (!had) {
        std::size_t k = 0;
        while (k + 1 < roles_.size() && has(other, k)) ++k;
        next = roles_[has(other, k) ? 0 : k];
    } else if (*had == DeviceRole::All) {
        next.reset();
    } else if (*had != roles_.back()) {
        next = *(std::ranges::find(roles_, *had) + 1);
    }
    if (next && in(other) == next)
        hand(other) = had;
    else if (next && (next == DeviceRole::All || in(other) == DeviceRole::All))
        hand(other).reset();
    hand(side) = next;
}

std::string Grasp::call_helper(const exercise::Simulation& simulation) {
    if (roles_.size() == 1) return "This exercise has one device: nothing else could move the wire";
    std::vector<std::size_t> found;
    const bool from_hand = in(Side::Right).has_value();
    for (std::size_t k = 0; k < roles_.size(); ++k)
        if (from_hand ? has(Side::Right, k) : !in_a_hand(k)) found.push_back(k);
    if (from_hand) {
        hand(Side::Right).reset();
        for (const std::size_t k : found) helped_[k] = true;
        return {};
    }
    if (found.empty()) return "The left hand holds all: there is nothing for the helper to hold";
    const bool lets_go = std::ranges::any_of(found, [this](std::size_t k) { return helped_[k]; });
    std::string kept;
    for (const std::size_t k : found) {
        const scenario::PlacedDevice& device = simulation.devices()[k];
        const bool stays = lets_go && device.device.holding_valve_friction() == 0;
        if (stays)
            kept = fmt::format("The {}'s valve has no friction: the helper cannot let go", device.name());
        if (!stays) helped_[k] = !lets_go;
    }
    return kept;
}

std::vector<script::Command> Grasp::pins(const exercise::Simulation& simulation) const {
    std::vector<script::Command> commands;
    for (std::size_t k = 0; k < roles_.size(); ++k)
        if (const bool held = in_a_hand(k) || helped_[k]; held != simulation.devices()[k].pinned)
            commands.push_back(script::Pin{held, roles_[k]});
    return commands;
}

std::string Grasp::helper_text() const {
    std::string names;
    for (std::size_t k = 0; k < roles_.size(); ++k)
        if (helped_[k] && !in_a_hand(k))
            names += fmt::format("{}{}", names.empty() ? "" : ", ", script::name_of(roles_[k]));
    return names;
}

std::string Grasp::sentence() const {
    const auto name = [this](Side side) { return in(side) ? script::name_of(*in(side)) : "nothing"; };
    const std::string helped = helper_text();
    return fmt::format("Right hand: {}, left hand: {}, helper: {}", name(Side::Right), name(Side::Left),
                       helped.empty() ? "nothing" : helped);
}

std::string site_name(const InjectionPreset& preset, std::span<const scenario::PlacedDevice> devices,
                      const anatomy::Anatomy& anatomy) {
    switch (site_of(preset, devices.size(), anatomy)) {
        case Site::Device:
            return fmt::format("through the {}", devices[1].name());
        case Site::Branch:
            return fmt::format("through a flush catheter in the {}, from another access", preset.branch);
        case Site::Introducer:
            break;
    }
    return "through the introducer";
}

Answer inject(const InjectionPreset& preset, const exercise::Simulation& simulation) {
    const auto devices = simulation.devices();
    const blood::ContrastFlow& contrast = simulation.contrast();
    const bool hand = preset.by == InjectionPreset::By::Hand;
    if (contrast.injecting())
        return {{},
                fmt::format("One injection at a time: this one takes {:.1f} s more", contrast.time_left())};
    if (preset.volume > contrast.left())
        return {{},
                fmt::format("{:g} ml more is beyond the patient's limit of contrast: {:.0f} ml are left",
                            preset.volume, std::floor(contrast.left()))};
    const Site site = site_of(preset, devices.size(), simulation.anatomy());
    const std::string through = site_name(preset, devices, simulation.anatomy());
    script::Inject inject{preset.volume, preset.rate, site == Site::Branch ? preset.branch : "",
                          preset.iodine};
    inject.introducer = site == Site::Introducer;
    std::string slowed;
    if (site != Site::Branch) {
        const bool introducer = site == Site::Introducer;
        if (!introducer) inject.through = devices[1].role;
        const std::string_view name = introducer ? "introducer" : devices[1].name();
        if (!introducer && simulation.inserted(inject.through) <= 0)
            return {{}, fmt::format("Nothing was injected: the {} is not inside", name)};
        const double flow =
            introducer ? simulation.largest_flow_of_introducer() : simulation.largest_flow(inject.through);
        const double most = std::floor(flow / rate_digits) * rate_digits;
        const std::string_view filled_by = introducer ? "device in it" : devices[0].name();
        if (most < least_rate)
            return {{}, fmt::format("Nothing was injected: the {} fills the {}'s lumen", filled_by, name)};
        if (inject.rate > most && !hand)
            return {{},
                    fmt::format("The {}'s lumen passes {:.1f} ml/s at the pump's 1200 psi; {:g} ml/s were "
                                "asked for",
                                name, most, preset.rate)};
        if (inject.rate > most) slowed = fmt::format(", all that its lumen passes around the {}", filled_by);
        inject.rate = std::min(inject.rate, most);
    }
    if (site == Site::Branch && inject.rate > largest_flush())
        return {{},
                fmt::format("A 5 F flush catheter passes {:.0f} ml/s at the pump's 1200 psi; {:g} ml/s were "
                            "asked for",
                            largest_flush(), preset.rate)};
    return {inject, fmt::format("{}: {:g} ml at {:g} ml/s {}{}", hand ? "Hand" : "Pump", inject.volume,
                                inject.rate, through, slowed)};
}

}  // namespace room
