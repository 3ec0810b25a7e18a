#include "engine/run/picture_file.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "render/picture/png.h"
#include "render/xray/detector.h"

namespace run {
namespace {

void write(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes) {
    io::write_whole(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

void write_picture(const std::filesystem::path& path, const render::GrayImage& image) {
    write(path, render::encode_png(image));
}
void write_picture(const std::filesystem::path& path, const render::DeepImage& image) {
    write(path, render::encode_png(image));
}
void write_picture(const std::filesystem::path& path, const render::ColourImage& image) {
    write(path, render::encode_png(image));
}

render::GrayImage read_picture(const std::filesystem::path& path) {
    io::require_no_device(path);
    try {
        return render::read_png(path);
    } catch (const std::runtime_error& error) {
        throw io::InputError(error.what());
    }
}

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
