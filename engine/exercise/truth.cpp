#include "engine/exercise/truth.h"

namespace exercise {
namespace {

render::GrayImage mask(int pixels, const std::vector<std::uint32_t>& set) {
    render::GrayImage image{pixels, pixels,
                            std::vector<std::uint8_t>(static_cast<std::size_t>(pixels) * pixels, 0)};
    for (const std::uint32_t pixel : set) image.pixels[pixel] = 255;
    return image;
}

}  // namespace

Truth truth_of(Monitor& monitor, const Simulation& simulation, const TruthParts& parts) {
    const Pulse& pulse = *monitor.last_pulse();
    render::Fluoroscope& fluoroscope = monitor.fluoroscope();
    const int pixels = pulse.arm.pixels;
    const geometry::Vec3& shift = pulse.exposure.vessel_shift;
    Truth truth{pulse, {}, mask(pixels, fluoroscope.vessel_pixels(pulse.arm, shift))};
    for (const PulsedDevice& device : pulse.devices)
        truth.devices.push_back(
            mask(pixels, fluoroscope.device_pixels(pulse.arm, {device.joints, &device.look}, shift)));
    truth.dose = monitor.last_dose();
    if (parts.signal) {
        truth.signal = monitor.last_signal();
        const auto dose = static_cast<float>(truth.dose);
        for (float& value : truth.signal->values) value *= dose;
    }
    if (parts.expected) truth.expected = fluoroscope.expected_quanta(pulse.arm, pulse.seen(), pulse.exposure);
    if (parts.labels) {
        const blood::BloodFlow& blood = simulation.contrast().blood();
        std::vector<std::uint16_t> of_node;
        for (const blood::FlowCell& cell : blood.cells)
            of_node.push_back(static_cast<std::uint16_t>(cell.branch + 1));
        truth.labels = fluoroscope.vessel_labels(pulse.arm, shift, of_node);
        for (const auto& branch : simulation.anatomy().branches) truth.branches.push_back(branch.name);
    }
    if (parts.lengths) truth.lengths = fluoroscope.layer_lengths(pulse.arm, pulse.exposure);
    return truth;
}

}  // namespace exercise
