#include "engine/run/frame_sink.h"

#include <fmt/format.h>
#include <utility>

#include "engine/io/text.h"
#include "engine/run/picture_file.h"

namespace run {

std::string frame_file_name(int frame) {
    return fmt::format("frame_{:06}.png", frame);
}

int frame_of_file_name(const std::string& name) {
    if (!name.starts_with("frame_") || !name.ends_with(".png") || name.size() <= 10) return -1;
    const auto number = io::parse_integer(std::string_view(name).substr(6, name.size() - 10));
    return number && *number >= 0 && frame_file_name(*number) == name ? *number : -1;
}

PngFolder::PngFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

void PngFolder::accept(int frame, const render::GrayImage& image) {
    queue_.put([path = folder_ / frame_file_name(frame), image] { write_picture(path, image); });
}

void PngFolder::accept(int frame, const render::ColourImage& image) {
    queue_.put([path = folder_ / frame_file_name(frame), image] { write_picture(path, image); });
}

void PngFolder::finish() {
    queue_.finish();
}

}  // namespace run
