#include "engine/exercise/device_rules.h"

#include <fmt/format.h>

#include "engine/io/error.h"

namespace exercise {

std::string no_catheter(const script::Command& command) {
    return fmt::format(
        "'{}' asks for a catheter, and the scenario has none; a section [catheter] is accepted",
        script::to_text(command));
}

bool needs_catheter(const script::Command& command) {
    const auto held = [](const auto& c) { return c.held != script::Held::Wire; };
    if (const auto* c = std::get_if<script::Advance>(&command)) return held(*c);
    if (const auto* c = std::get_if<script::Withdraw>(&command)) return held(*c);
    if (const auto* c = std::get_if<script::Rotate>(&command)) return held(*c);
    if (const auto* c = std::get_if<script::Inject>(&command)) return c->branch.empty();
    return std::holds_alternative<script::Remove>(command) ||
           std::holds_alternative<script::Exchange>(command);
}

scenario::Device wire_of_catalogue(const std::string& name, const scenario::Scenario& scenario) {
    // A file stands next to the scenario's.
    const std::filesystem::path file =
        name.ends_with(".toml") ? std::filesystem::path(scenario.place("").file).parent_path() / name
                                : scenario::find_device(name, scenario.devices);
    const scenario::Device device = scenario::load_device(file);
    if (device.kind != scenario::DeviceKind::Wire)
        throw io::InputError(fmt::format("'{}' is a catheter; a wire is accepted", name));
    if (device.outer_diameter >= scenario.catheter->device.inner_diameter)
        throw io::InputError(fmt::format(
            "the wire '{}' of {:g} mm does not fit a lumen of {:g} mm; a thinner wire is accepted", name,
            device.outer_diameter, scenario.catheter->device.inner_diameter));
    return device;
}

}  // namespace exercise
