#include "engine/exercise/device_rules.h"

#include <fmt/format.h>

#include "engine/exercise/lumen_flow.h"
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

std::filesystem::path file_of_wire(const std::string& name, const scenario::Scenario& scenario) {
    // A file stands next to the scenario's.
    return name.ends_with(".toml") ? std::filesystem::path(scenario.place("").file).parent_path() / name
                                   : scenario::find_device(name, scenario.devices);
}

scenario::Device wire_of_catalogue(const std::string& name, const scenario::Scenario& scenario) {
    const scenario::Device device = scenario::load_device(file_of_wire(name, scenario));
    if (device.kind != scenario::DeviceKind::Wire)
        throw io::InputError(fmt::format("'{}' is a catheter; a wire is accepted", name));
    if (device.outer_diameter >= scenario.catheter->device.inner_diameter)
        throw io::InputError(fmt::format(
            "the wire '{}' of {:g} mm does not fit a lumen of {:g} mm; a thinner wire is accepted", name,
            device.outer_diameter, scenario.catheter->device.inner_diameter));
    return device;
}

std::vector<std::string> device_problems(const script::CommandScript& script,
                                         const scenario::Scenario& scenario) {
    std::vector<std::string> found;
    // A wire is out once it was removed, until it is pushed again.
    bool wire_is_out = false;
    for (const script::TimedCommand& timed : script.commands) {
        const script::Command& command = timed.command;
        const auto say = [&](const std::string& text) { found.push_back(io::located(timed.place, text)); };
        if (std::holds_alternative<script::Reset>(command)) wire_is_out = false;
        if (!scenario.catheter && needs_catheter(command)) {
            say(no_catheter(command));
            continue;
        }
        if (const auto* push = std::get_if<script::Advance>(&command);
            push && push->held == script::Held::Wire && push->length > 0)
            wire_is_out = false;
        if (const auto* out = std::get_if<script::Remove>(&command); out && out->held == script::Held::Wire)
            wire_is_out = true;
        if (const auto* exchange = std::get_if<script::Exchange>(&command)) {
            try {
                static_cast<void>(wire_of_catalogue(exchange->device, scenario));
                if (!wire_is_out) say("the wire is still in; 'exchange' is accepted after 'remove wire'");
            } catch (const io::InputError& error) {
                say(error.what());
            }
        }
        if (const auto* inject = std::get_if<script::Inject>(&command); inject && inject->branch.empty()) {
            const physics::DeviceSpec spec = scenario.catheter->device;
            const double most = largest_flow(spec, 0, 0);
            if (inject->rate > most)
                say(
                    fmt::format("the catheter's lumen of {:g} mm passes {:.1f} ml/s at most; {:g} ml/s "
                                "were asked for",
                                spec.inner_diameter, most, inject->rate));
        }
        if (found.size() > 20) break;
    }
    return found;
}

}  // namespace exercise
