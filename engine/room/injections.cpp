#include "engine/room/injections.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/exercise/device_rules.h"

namespace room {
namespace {

using Site = InjectionPreset::Site;

constexpr double least_rate = 0.1;    // of a command [ml/s]
constexpr double rate_digits = 1e-2;  // of a hand that the lumen slows, rounded down [ml/s]

/// Largest flow at 1200 psi of a 5 F flush catheter for the abdomen, as the catalogue's omniflush5f [ml/s].
double largest_flush() {
    physics::DeviceSpec catheter;
    catheter.inner_diameter = 1.1;
    catheter.length = 650;
    return exercise::largest_flow(catheter, 0, 0);
}

/// A branch by its name or the start of its name, as commands take it.
bool has_branch(const anatomy::Anatomy& anatomy, const std::string& name) {
    return std::any_of(anatomy.branches.begin(), anatomy.branches.end(), [&](const auto& branch) {
        return branch.name == name || branch.name.starts_with(name + "+");
    });
}

/// The way that is there.
Site site_of(const InjectionPreset& preset, std::size_t devices, const anatomy::Anatomy& anatomy) {
    const bool there = preset.site == Site::Device ? devices > 1 : has_branch(anatomy, preset.branch);
    return there ? preset.site : Site::Introducer;
}

}  // namespace

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
    if (site == Site::Device) {
        inject.through = devices[1].role;
        const std::string_view name = devices[1].name();
        if (simulation.inserted(inject.through) <= 0)
            return {{}, fmt::format("Nothing was injected: the {} is not inside", name)};
        const double most = std::floor(simulation.largest_flow(inject.through) / rate_digits) * rate_digits;
        if (most < least_rate)
            return {
                {},
                fmt::format("Nothing was injected: the {} fills the {}'s lumen", devices[0].name(), name)};
        if (inject.rate > most && !hand)
            return {{},
                    fmt::format("The {}'s lumen passes {:.1f} ml/s at the pump's 1200 psi; {:g} ml/s were "
                                "asked for",
                                name, most, preset.rate)};
        if (inject.rate > most)
            slowed = fmt::format(", all that its lumen passes around the {}", devices[0].name());
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
