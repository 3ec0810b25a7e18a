#include "engine/run/deep_picture.h"

#include <algorithm>

#include "render/xray/detector.h"

namespace run {

double quanta_per_level(const render::CArm& arm, double dose) {
    constexpr double level = 4096;
    const double pixel = render::pixel_width(arm);
    return dose * render::quanta_per_dose_and_area * pixel * pixel / level;
}

render::DeepImage deep_picture(const render::Field& field, double per_level) {
    render::DeepImage image{field.width, field.height, {}};
    image.pixels.reserve(field.values.size());
    const auto levels = static_cast<float>(1 / per_level);
    for (const float value : field.values) {
        const float level = value > 0 ? std::min(value * levels + 0.5f, 65535.0f) : 0.0f;
        image.pixels.push_back(static_cast<std::uint16_t>(level));
    }
    return image;
}

}  // namespace run
