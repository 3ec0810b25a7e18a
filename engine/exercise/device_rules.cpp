#include "engine/exercise/device_rules.h"

#include <fmt/format.h>

#include "engine/exercise/lumen_flow.h"
#include "engine/io/error.h"

namespace exercise {

std::string missing_device(const script::Command& command, const scenario::Scenario& scenario) {
    using script::Held;
    // Without a device around the wire there is nothing to take it out of.
    const bool alone = scenario.devices.size() == 1;
    Held asked = Held::Wire;
    const auto of = [&](Held held) { asked = held == Held::All && alone ? Held::Catheter : held; };
    if (const auto* c = std::get_if<script::Advance>(&command)) of(c->held);
    if (const auto* c = std::get_if<script::Withdraw>(&command)) of(c->held);
    if (const auto* c = std::get_if<script::Rotate>(&command)) of(c->held);
    if (const auto* c = std::get_if<script::Inject>(&command); c && c->branch.empty()) of(c->through);
    if (const auto* c = std::get_if<script::Remove>(&command)) of(alone ? Held::Catheter : c->held);
    if (std::holds_alternative<script::Exchange>(command) && alone) of(Held::Catheter);
    if (asked == Held::All || scenario.index_of(asked)) return "";
    const std::string_view name = script::name_of(asked);
    return fmt::format("'{}' asks for a {}, and the scenario has none; a section [{}] is accepted",
                       script::to_text(command), name, name);
}

std::filesystem::path file_of_wire(const std::string& name, const scenario::Scenario& scenario) {
    // A file stands next to the scenario's.
    return name.ends_with(".toml") ? std::filesystem::path(scenario.place("").file).parent_path() / name
                                   : scenario::find_device(name, scenario.catalogue);
}

scenario::Device wire_of_catalogue(const std::string& name, const scenario::Scenario& scenario) {
    scenario::Device device = scenario::load_device(file_of_wire(name, scenario));
    if (scenario.torsion == scenario::TorsionModel::Rigid) physics::stiffen(device);
    if (device.kind != scenario::DeviceKind::Wire)
        throw io::InputError("'{}' is a catheter; a wire is accepted", name);
    const double lumen = scenario.devices.at(1).device.inner_diameter;
    if (device.outer_diameter >= lumen)
        throw io::InputError(
            "the wire '{}' of {:g} mm does not fit a lumen of {:g} mm; a thinner wire is accepted", name,
            device.outer_diameter, lumen);
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
        if (const std::string wrong = missing_device(command, scenario); !wrong.empty()) {
            say(wrong);
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
            const scenario::PlacedDevice& through = scenario.devices[*scenario.index_of(inject->through)];
            const double most = largest_flow(through.device, 0, 0);
            if (inject->rate > most)
                say(fmt::format(
                    "the {}'s lumen of {:g} mm passes {:.1f} ml/s at most; {:g} ml/s were asked for",
                    through.name(), through.device.inner_diameter, most, inject->rate));
        }
        if (found.size() > 20) break;
    }
    return found;
}

}  // namespace exercise
