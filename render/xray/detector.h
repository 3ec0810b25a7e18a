#pragma once
/// From arriving quanta to the signal read out.

#include <cstdint>

#include "render/picture/image.h"

namespace render {

/// Quanta per nGy of dose and mm² of detector: 30 nGy give 54 quanta per 0.29 mm pixel.
constexpr double quanta_per_dose_and_area = 54.0 / (30.0 * 0.29 * 0.29);

struct DetectorSpec {
    double scintillator_blur = 0.18;  // standard deviation of the light spread [mm]
    double electronic_noise = 3.0;    // standard deviation, in quanta of one pixel, added after the blur
};

/// Random numbers that are a function of their place alone: (seed, frame, pixel) → 64 bits. No generator is
/// shared between frames or pixels, so frames may be rendered in any order, or left out.
class PixelNoise {
public:
    PixelNoise(std::uint64_t seed, std::uint64_t frame);

    std::uint64_t bits(std::uint64_t pixel) const;

    /// Two standard normal numbers from the bits of a pixel: `which` 0 or 1.
    static float normal(std::uint64_t bits, int which);

    /// Number of events when `mean` are expected: Poisson below 25, normal above. 0 for a mean that is not
    /// positive.
    static float quanta(float mean, std::uint64_t bits);

private:
    std::uint64_t key_;
};

/// Draws quanta at random around their expectation, then spreads the light, then adds electronic noise. The
/// result has the shape of `expected`. The order matters: noise that the scintillator has not blurred looks
/// like sand.
Field read_out(Field expected, double pixel_width, const DetectorSpec&, std::uint64_t seed,
               std::uint64_t frame);

}  // namespace render
