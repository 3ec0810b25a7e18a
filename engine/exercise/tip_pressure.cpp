#include "engine/exercise/tip_pressure.h"

#include <algorithm>
#include <cmath>

#include "engine/exercise/device_rules.h"

namespace exercise {

double heart_phase_at(const Simulation& simulation, double time) {
    return blood::heart_phase(time, simulation.scenario().blood.heart_rate);
}

std::optional<TipPressure> pressure_at_tip(const Simulation& simulation, script::DeviceRole role) {
    const std::optional<blood::Beat> beat = beat_at_tip(simulation, role);
    if (!beat) return {};
    return TipPressure{beat->pressure(heart_phase_at(simulation, simulation.time())), beat->systolic,
                       beat->diastolic, beat->mean};
}

std::optional<blood::Beat> beat_at_tip(const Simulation& simulation, script::DeviceRole role) {
    const auto devices = simulation.devices();
    const auto found = std::ranges::find(devices, role, &scenario::PlacedDevice::role);
    if (found == devices.begin() || found == devices.end() || simulation.inserted(role) <= 0) return {};
    const int device = static_cast<int>(found - devices.begin());
    const Simulation::Bore bore = simulation.bore_of(device);
    const double resistance = bore_resistance(found->device, bore.inner, bore.inside);
    if (std::isinf(resistance) || simulation.contrast().out_of_line(device).flow > 0) return {};

    const blood::BloodFlow& flow = simulation.contrast().blood();
    const blood::FlowSpec& spec = simulation.scenario().blood;
    const geometry::Vec3 tip = simulation.tip_of(role).at;
    const int cell = flow.nearest(tip);
    const auto in = static_cast<std::size_t>(cell);
    const double vessel = std::min(flow.cells[in].radius, simulation.wall().narrowest(tip));
    return blood::damped(blood::wedged(blood::beat_of(spec, blood::mean_pressure_in(flow, cell)),
                                       std::max(0.0, flow.resting()[in]),
                                       blood::gap_resistance(vessel, 0.5 * found->device.outer_diameter)),
                         resistance, spec.heart_rate);
}

std::optional<script::DeviceRole> pressure_device(const Simulation& simulation) {
    const auto devices = simulation.devices();
    for (std::size_t k = 1; k < devices.size(); ++k)
        if (devices[k].device.inner_diameter > 0 && simulation.inserted(devices[k].role) > 0)
            return devices[k].role;
    return {};
}

double ecg_at(const Simulation& simulation, double time) {
    return blood::ecg(heart_phase_at(simulation, time), simulation.scenario().blood.heart_rate);
}

}  // namespace exercise
