#pragma once
/// Who holds which device: two hands, and a helper. What any of them holds stays while others are moved.
/// What syringe and injector give, through what.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "engine/exercise/simulation.h"
#include "engine/room/keys.h"
#include "engine/script/command.h"

namespace room {

class Grasp {
public:
    /// The right hand has the wire, the left one what lies around it; the helper what the scenario pins.
    explicit Grasp(const exercise::Simulation&);

    /// One device, all of them, or none. Where one hand holds all, the other is empty.
    std::optional<script::DeviceRole> in(Side side) const { return hands_[static_cast<std::size_t>(side)]; }
    /// From the innermost device outward, then all, then none. A device that the other hand has goes over,
    /// and the other one gets what this one had; an empty hand takes one that the other has not, if there is
    /// one.
    void take_next(Side);
    /// The helper takes what the right hand holds. Where it is empty, he lets go of what no hand has, or
    /// holds it again. Empty, or a sentence: what is in the way.
    std::string call_helper(const exercise::Simulation&);
    /// The commands that make it so.
    std::vector<script::Command> pins(const exercise::Simulation&) const;

    /// Names of what the helper holds and no hand: "wire, catheter"; empty = nothing.
    std::string helper_text() const;
    /// "Right hand: wire, left hand: catheter, helper: nothing".
    std::string sentence() const;
    std::size_t devices() const { return roles_.size(); }

private:
    std::optional<script::DeviceRole>& hand(Side side) { return hands_[static_cast<std::size_t>(side)]; }
    bool has(Side, std::size_t device) const;
    bool in_a_hand(std::size_t device) const { return has(Side::Right, device) || has(Side::Left, device); }

    std::vector<script::DeviceRole> roles_;  // of the devices, innermost first
    std::vector<bool> helped_;               // by the helper, once no hand has the device
    std::array<std::optional<script::DeviceRole>, 2> hands_;
};

/// Through what an injection goes in these vessels, with these devices: "through the catheter", "through the
/// introducer", "through a flush catheter in the aorta, from another access". Never through a wire: where
/// there is nothing else it is the introducer.
std::string site_name(const InjectionPreset&, std::span<const scenario::PlacedDevice>,
                      const anatomy::Anatomy&);

/// One injection now, or the reason against it. A hand gives no more than the lumen passes, and says so; what
/// the injector cannot push through within its pressure is refused.
struct Answer {
    std::optional<script::Inject> command;
    std::string said;  // a sentence
};
Answer inject(const InjectionPreset&, const exercise::Simulation&);

}  // namespace room
