#include "engine/run/picture_file.h"

#include <cstdint>
#include <stdexcept>
#include <vector>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "render/picture/png.h"

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

}  // namespace run
