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

Truth truth_of(const Pulse& pulse, render::Fluoroscope& fluoroscope, bool has_catheter) {
    const int pixels = pulse.arm.pixels;
    const geometry::Vec3& shift = pulse.exposure.vessel_shift;
    Truth truth{pulse,
                mask(pixels, fluoroscope.wire_pixels(pulse.arm, pulse.seen(), shift)),
                {},
                mask(pixels, fluoroscope.vessel_pixels(pulse.arm, shift))};
    if (has_catheter)
        truth.catheter = mask(pixels, fluoroscope.catheter_pixels(pulse.arm, pulse.seen(), shift));
    return truth;
}

}  // namespace exercise
