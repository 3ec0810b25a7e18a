#include "engine/exercise/device_rules.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>

#include "engine/io/error.h"
#include "physics/geometry/maths.h"
#include "physics/wire/friction.h"

namespace exercise {

physics::DeviceSpec spec_of(const scenario::Scenario& s, const scenario::Device& device) {
    physics::DeviceSpec spec = device;
    spec.friction *= s.wall_friction;
    spec.static_friction *= s.wall_friction;
    return spec;
}

namespace {

bool twists_from_the_start(const scenario::Scenario& s) {
    return s.torsion == scenario::TorsionModel::Compliant || s.torsion == scenario::TorsionModel::Segments;
}

}  // namespace

physics::Chain chain_of(const scenario::Scenario& s, std::span<const scenario::PlacedDevice> devices,
                        const geometry::Polyline& path, const physics::Chain* before) {
    std::vector<physics::Device> placed(devices.size());
    for (std::size_t k = 0; k < devices.size(); ++k) {
        physics::Device& device = placed[k];
        device.spec = spec_of(s, devices[k].device);
        device.inserted = devices[k].inserted;
        device.roll = devices[k].roll;
        const bool twisted = before && before->devices[k].spec.twists();
        if (!twists_from_the_start(s) && !twisted) physics::stiffen(device.spec);
        device.outside = s.relaxer.kind == physics::RelaxerKind::Global ? s.hand_distance : 0;
        if (!before) continue;
        const physics::Device& was = before->devices[k];
        device.inserted = was.inserted;
        device.outside = was.outside;
        device.roll = was.angle_at(before->segments());
        device.windup = was.wound_up();
    }
    physics::Grid grid{s.segment_length};
    // The tip's pieces go with it.
    if (s.tip_error) grid.tip_segments = 1;
    physics::Chain chain = physics::chain_along(std::move(placed), grid, path);
    if (before) {
        chain.tangents[0] = before->tangents[0];
        chain.base_director = before->base_director;
    }
    return chain;
}

void exchange(physics::Chain& chain, int device, const scenario::Scenario& s, const scenario::Device& by) {
    physics::Device& placed = chain.devices[device];
    placed = {};
    placed.outside = s.hand_distance;
    placed.spec = spec_of(s, by);
    if (!twists_from_the_start(s)) physics::stiffen(placed.spec);
    physics::assign(chain);
    if (chain.grips.empty()) physics::start_grips(chain);
    std::erase_if(chain.rubs,
                  [&](const physics::Rub& rub) { return rub.inner == device || rub.outer == device; });
    physics::start_rubs(chain);
}

std::string missing_device(const script::Command& command, const scenario::Scenario& scenario) {
    using script::DeviceRole;
    const bool treats = std::holds_alternative<script::Inflate>(command) ||
                        std::holds_alternative<script::Deflate>(command) ||
                        std::holds_alternative<script::Deploy>(command) ||
                        std::holds_alternative<script::RetrieveSheath>(command);
    if (treats && scenario.relaxer.kind != physics::RelaxerKind::Global)
        return fmt::format("'{}' needs [relaxer] kind = \"global\"", script::to_text(command));
    if (std::holds_alternative<script::Grip>(command) &&
        scenario.relaxer.kind != physics::RelaxerKind::Global)
        return fmt::format("'{}' asks for the shaft outside, which only the relaxer \"global\" knows",
                           script::to_text(command));
    // Without a device around the wire there is nothing to take it out of.
    const bool alone = scenario.devices.size() == 1;
    DeviceRole asked = DeviceRole::Wire;
    const auto of = [&](DeviceRole held) {
        asked = held == DeviceRole::All && alone ? DeviceRole::Catheter : held;
    };
    if (const auto* c = std::get_if<script::Advance>(&command)) of(c->held);
    if (const auto* c = std::get_if<script::Withdraw>(&command)) of(c->held);
    if (const auto* c = std::get_if<script::Rotate>(&command)) of(c->held);
    if (const auto* c = std::get_if<script::Grip>(&command)) of(c->held);
    if (const auto* c = std::get_if<script::Pin>(&command)) of(c->held);
    if (const auto* c = std::get_if<script::Inject>(&command); c && c->through_device()) of(c->through);
    if (const auto* c = std::get_if<script::Remove>(&command)) of(alone ? DeviceRole::Catheter : c->held);
    if (const auto* c = std::get_if<script::Exchange>(&command))
        of(alone && c->held == DeviceRole::Wire ? DeviceRole::Catheter : c->held);
    if (treats) of(DeviceRole::Balloon);
    if (asked == DeviceRole::All || scenario.index_of(asked)) return "";
    const std::string_view name = script::name_of(asked);
    return fmt::format("'{}' asks for a {}, and the scenario has none; expected a section [{}]",
                       script::to_text(command), name, name);
}

std::filesystem::path file_of_device(script::DeviceRole role, const std::string& name,
                                     const scenario::Scenario& scenario) {
    // A file stands next to the scenario's.
    return name.ends_with(".toml")
               ? std::filesystem::path(scenario.place("").file).parent_path() / name
               : scenario::find_device(name, scenario.catalogue, scenario::kinds_of(role));
}

scenario::Device device_of_catalogue(script::DeviceRole role, const std::string& name,
                                     const scenario::Scenario& scenario) {
    scenario::Device device = scenario::load_device(file_of_device(role, name, scenario));
    if (scenario.torsion == scenario::TorsionModel::Rigid) physics::stiffen(device);
    const auto kinds = scenario::kinds_of(role);
    if (std::ranges::count(kinds, device.kind) == 0)
        throw io::InputError("'{}' is a {}; expected a {}", name, scenario::name_of(device.kind),
                             scenario::names_of(kinds));
    const int which = *scenario.index_of(role);
    const auto fits = [&](const scenario::Device& inner, const scenario::Device& outer) {
        if (inner.widest() >= outer.inner_diameter)
            throw io::InputError(
                "the {} '{}' of {:g} mm does not fit a lumen of {:g} mm; expected a thinner {}",
                scenario::name_of(inner.kind), inner.name, inner.widest(), outer.inner_diameter,
                scenario::name_of(inner.kind));
    };
    if (which + 1 < static_cast<int>(scenario.devices.size()))
        fits(device, scenario.devices[static_cast<std::size_t>(which + 1)].device);
    if (which > 0) fits(scenario.devices[static_cast<std::size_t>(which - 1)].device, device);
    return device;
}

std::vector<std::string> device_problems(const script::CommandScript& script,
                                         const scenario::Scenario& scenario) {
    std::vector<std::string> found;
    // A device is out once it was removed, or from the start, until it is pushed again.
    std::array<bool, script::most_devices> is_out, was_out;
    for (int k = 0; k < script::most_devices; ++k) {
        const auto placed = scenario.index_of(static_cast<script::DeviceRole>(k));
        was_out[k] = placed && !scenario.devices[static_cast<std::size_t>(*placed)].starts_inside();
    }
    is_out = was_out;
    for (const script::TimedCommand& timed : script.commands) {
        const script::Command& command = timed.command;
        const auto say = [&](const std::string& text) { found.push_back(io::located(timed.place, text)); };
        if (std::holds_alternative<script::Reset>(command)) is_out = was_out;
        if (const std::string wrong = missing_device(command, scenario); !wrong.empty()) {
            say(wrong);
            continue;
        }
        if (const auto* push = std::get_if<script::Advance>(&command); push && push->length > 0) {
            if (push->held != script::DeviceRole::All) is_out[static_cast<std::size_t>(push->held)] = false;
        }
        if (const auto* out = std::get_if<script::Remove>(&command))
            is_out[static_cast<std::size_t>(out->held)] = true;
        if (const auto* exchange = std::get_if<script::Exchange>(&command)) {
            try {
                static_cast<void>(device_of_catalogue(exchange->held, exchange->device, scenario));
                if (const std::string_view name = script::name_of(exchange->held);
                    !is_out[static_cast<std::size_t>(exchange->held)])
                    say(fmt::format("the {0} is still in; 'exchange' works only after 'remove {0}'", name));
            } catch (const io::InputError& error) {
                say(error.what());
            }
        }
        if (const auto* inject = std::get_if<script::Inject>(&command); inject && inject->through_device()) {
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

namespace {

struct Fluid {
    double viscosity, density;  // [Pa·s], [kg/m³]
};
constexpr Fluid contrast_300{6e-3, 1330};       // 300 mg/ml at 37 °C
constexpr Fluid saline{0.9e-3, 1005};           // at 25 °C
constexpr double rated_pressure = 8.27e6;       // [Pa]
constexpr double bag_pressure = 207 * 133.322;  // 300 mmHg over a mean arterial pressure of 93 [Pa]

/// A stretch of lumen: pressure lost at a flow [m³/s] is the larger of both laws'.
struct Stretch {
    double laminar = 0;    // [Pa·s/m³]
    double turbulent = 0;  // [Pa/(m³/s)^1.75]
};

/// Between radii r < R [m]; r = 0 is an open lumen.
Stretch stretch(const Fluid& fluid, double length, double outer, double inner) {
    if (length <= 0) return {};
    double conductance = geometry::pow(outer, 4);
    if (inner > 0) {
        const double square = outer * outer - inner * inner;
        conductance -= geometry::pow(inner, 4) + square * square / geometry::log(outer / inner);
    }
    const double area = std::numbers::pi * (outer * outer - inner * inner), hydraulic = 2 * (outer - inner);
    return {8 * fluid.viscosity * length / (std::numbers::pi * conductance),
            0.158 * length * geometry::pow(fluid.density, 0.75) * geometry::pow(fluid.viscosity, 0.25) /
                (geometry::pow(hydraulic, 1.25) * geometry::pow(area, 1.75))};
}

/// Flow of a fluid at a pressure [ml/s].
double flow_of(const Fluid& fluid, double pressure, const physics::DeviceSpec& catheter, double wire_diameter,
               double wire_inside) {
    constexpr double m = 1e-3;  // [m/mm]
    const double bore = 0.5 * m * catheter.inner_diameter, wire = 0.5 * m * wire_diameter;
    const double filled = std::clamp(wire_inside, 0.0, catheter.length);
    if (bore <= 0 || (filled > 0 && wire >= bore)) return 0;
    const Stretch parts[] = {stretch(fluid, m * filled, bore, wire),
                             stretch(fluid, m * (catheter.length - filled), bore, 0)};
    double low = 0, high = 1e-3;  // [m³/s]
    for (int k = 0; k < 60; ++k) {
        const double flow = 0.5 * (low + high);
        double lost = 0;
        for (const Stretch& part : parts)
            lost += std::max(part.laminar * flow, part.turbulent * geometry::pow(flow, 1.75));
        (lost < pressure ? low : high) = flow;
    }
    return low * 1e6;
}

}  // namespace

double largest_flow(const physics::DeviceSpec& catheter, double wire_diameter, double wire_inside) {
    return flow_of(contrast_300, rated_pressure, catheter, wire_diameter, wire_inside);
}

double flush_flow(const physics::DeviceSpec& catheter, double wire_diameter, double wire_inside) {
    constexpr double opened = 1;  // by the roller clamp [ml/s]
    return std::min(opened, flow_of(saline, bag_pressure, catheter, wire_diameter, wire_inside));
}

double bore_resistance(const physics::DeviceSpec& catheter, double wire_diameter, double wire_inside) {
    constexpr double m = 1e-3, cubic_m = 1e-6;  // [m/mm], [m³/ml]
    const double bore = 0.5 * m * catheter.inner_diameter, wire = 0.5 * m * wire_diameter;
    const double filled = std::clamp(wire_inside, 0.0, catheter.length);
    if (bore <= 0 || (filled > 0 && wire >= bore)) return std::numeric_limits<double>::infinity();
    return cubic_m * (stretch(saline, m * filled, bore, wire).laminar +
                      stretch(saline, m * (catheter.length - filled), bore, 0).laminar);
}

double bore_volume(const physics::DeviceSpec& catheter, double wire_diameter, double wire_inside) {
    constexpr double cubic_mm_per_ml = 1000;
    const double filled = std::clamp(wire_inside, 0.0, catheter.length), bore = catheter.inner_diameter,
                 wire = std::min(wire_diameter, bore);
    return std::numbers::pi / 4 * (bore * bore * catheter.length - wire * wire * filled) / cubic_mm_per_ml;
}

}  // namespace exercise
