#include "engine/room/grasp.h"

#include <algorithm>
#include <fmt/format.h>

namespace room {

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
        next = *(std::find(roles_.begin(), roles_.end(), *had) + 1);
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

}  // namespace room
