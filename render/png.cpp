#include "render/png.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <png.h>
#include <stdexcept>
#include <string>
#include <system_error>
#include <unistd.h>
#include <utility>
#include <zlib.h>

namespace render {

namespace {

/// What the callbacks of libpng share with the caller. libpng reports errors by longjmp, which skips
/// destructors: the function that calls setjmp holds nothing that needs one, and callbacks let no exception
/// through C frames.
struct Sink {
    std::vector<std::uint8_t> bytes;
    std::array<char, 128> error{};
};

void append(png_structp png, png_bytep data, std::size_t size) {
    auto& sink = *static_cast<Sink*>(png_get_io_ptr(png));
    bool full = false;
    try {
        sink.bytes.insert(sink.bytes.end(), data, data + size);
    } catch (const std::bad_alloc&) {
        full = true;
    }
    if (full) png_error(png, "out of memory");
}

void fail(png_structp png, png_const_charp message) {
    auto& sink = *static_cast<Sink*>(png_get_error_ptr(png));
    std::strncpy(sink.error.data(), message, sink.error.size() - 1);
    png_longjmp(png, 1);
}

void ignore(png_structp, png_const_charp) {}

/// What distinguishes the kinds of image in a file.
struct Kind {
    int channels;
    int colour_type;
    png_uint_32 format;
    int strategy;  // of zlib: noise in one channel has no repeats, its equal three channels have
    const char* name;
};
constexpr Kind grey = {1, PNG_COLOR_TYPE_GRAY, PNG_FORMAT_GRAY, Z_HUFFMAN_ONLY, "grey"};
constexpr Kind colour_png = {3, PNG_COLOR_TYPE_RGB, PNG_FORMAT_RGB, Z_DEFAULT_STRATEGY, "colour"};

/// False with sink.error filled on failure. `pixels` holds width·height·channels levels.
bool encode(const std::uint8_t* pixels, int width, int height, const Kind& kind, Sink* sink) {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, sink, fail, ignore);
    if (png == nullptr) return false;
    png_infop info = png_create_info_struct(png);
    if (info == nullptr || setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, &info);
        return false;
    }
    png_set_write_fn(png, sink, append, nullptr);
    png_set_compression_level(png, 1);
    png_set_compression_strategy(png, kind.strategy);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8,
                 kind.colour_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    const std::size_t row = static_cast<std::size_t>(width) * kind.channels;
    for (int j = 0; j < height; ++j) png_write_row(png, pixels + j * row);
    png_write_end(png, nullptr);
    png_destroy_write_struct(&png, &info);
    return true;
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& reason) {
    throw std::runtime_error(path.string() + ": " + reason);
}

/// 0, or the errno of the first step that failed.
int write_all(const std::string& path, const std::vector<std::uint8_t>& bytes) {
    const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file < 0) return errno;
    int error = 0;
    for (std::size_t done = 0; done < bytes.size() && error == 0;) {
        const ssize_t written = ::write(file, bytes.data() + done, bytes.size() - done);
        if (written > 0) {
            done += static_cast<std::size_t>(written);
        } else if (written == 0) {
            error = ENOSPC;
        } else if (errno != EINTR) {
            error = errno;
        }
    }
    if (::close(file) != 0 && error == 0) error = errno;
    return error;
}

template <class Image>
std::vector<std::uint8_t> encode_image(const Image& image, const Kind& kind) {
    if (image.width < 1 || image.height < 1 ||
        image.pixels.size() != static_cast<std::size_t>(image.width) * image.height * kind.channels) {
        throw std::invalid_argument("an image of " + std::to_string(image.width) + "x" +
                                    std::to_string(image.height) + " with " +
                                    std::to_string(image.pixels.size()) + " levels cannot be written");
    }
    Sink sink;
    sink.bytes.reserve(image.pixels.size() + 1024);
    if (!encode(image.pixels.data(), image.width, image.height, kind, &sink)) {
        throw std::runtime_error(std::string("PNG encoding failed: ") + sink.error.data());
    }
    return std::move(sink.bytes);
}

void write_file(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes) {
    const std::string part = path.string() + ".part";
    int error = write_all(part, bytes);
    if (error == 0 && std::rename(part.c_str(), path.c_str()) != 0) error = errno;
    if (error != 0) {
        ::unlink(part.c_str());
        refuse(path, "cannot be written: " + std::generic_category().message(error));
    }
}

template <class Image>
Image read_image(const std::filesystem::path& path, const Kind& kind) {
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file) refuse(path, "cannot be read: " + std::generic_category().message(errno != 0 ? errno : EIO));
    const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    if (file.bad()) refuse(path, "cannot be read");

    // The simplified interface of libpng handles its long jumps inside.
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) {
        refuse(path, std::string("is no PNG: ") + png.message);
    }
    // The header's own bit depth and colour type; the interface above would convert silently.
    const int depth = static_cast<unsigned char>(bytes.at(24)),
              type = static_cast<unsigned char>(bytes.at(25));
    if (depth != 8 || type != kind.colour_type || png.format != kind.format) {
        png_image_free(&png);
        refuse(path, "has colour type " + std::to_string(type) + " and " + std::to_string(depth) +
                         " bits; only 8-bit " + kind.name + " without transparency (colour type " +
                         std::to_string(kind.colour_type) + ") is read");
    }
    constexpr unsigned most = 16384;
    if (png.width > most || png.height > most) {
        png_image_free(&png);
        refuse(path, "is larger than 16384 pixels along a side");
    }
    Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
    image.pixels.resize(static_cast<std::size_t>(png.width) * png.height * kind.channels);
    if (png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) == 0) {
        refuse(path, std::string("is damaged: ") + png.message);
    }
    return image;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const GrayImage& image) {
    return encode_image(image, grey);
}
std::vector<std::uint8_t> encode_png(const ColourImage& image) {
    return encode_image(image, colour_png);
}

void write_png(const std::filesystem::path& path, const GrayImage& image) {
    write_file(path, encode_png(image));
}
void write_png(const std::filesystem::path& path, const ColourImage& image) {
    write_file(path, encode_png(image));
}

GrayImage read_png(const std::filesystem::path& path) {
    return read_image<GrayImage>(path, grey);
}
ColourImage read_colour_png(const std::filesystem::path& path) {
    return read_image<ColourImage>(path, colour_png);
}

}  // namespace render
