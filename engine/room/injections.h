#pragma once
/// What the syringe and the injector give, through what.

#include <optional>
#include <string>

#include "engine/exercise/simulation.h"
#include "engine/room/keys.h"
#include "engine/script/command.h"

namespace room {

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
