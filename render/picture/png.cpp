#include "render/picture/png.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <libdeflate.h>
#include <memory>
#include <new>
#include <png.h>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include "render/picture/deflate.h"

namespace render {

namespace {

/// What distinguishes the kinds of image in a file.
struct Kind {
    int channels;
    int colour_type;
    png_uint_32 format;
    int bits;  // of a channel
    const char* name;
};
constexpr Kind kind_of(const GrayImage&) {
    return {1, PNG_COLOR_TYPE_GRAY, PNG_FORMAT_GRAY, 8, "grey"};
}
constexpr Kind kind_of(const DeepImage&) {
    return {1, PNG_COLOR_TYPE_GRAY, PNG_FORMAT_LINEAR_Y, 16, "grey"};
}
constexpr Kind kind_of(const ColourImage&) {
    return {3, PNG_COLOR_TYPE_RGB, PNG_FORMAT_RGB, 8, "colour"};
}

using Bytes = std::vector<std::uint8_t>;

/// Each row's filter (PNG specification, chapter 9), then the filtered row. `row`: bytes of one row.
enum class Filter : std::uint8_t { Sub = 1, Average = 3 };

/// Noise compresses best as its difference from the average of the pixels to its left and above; where a
/// panel is flat, all that is left are zeros. `apart`: bytes from a pixel to the next. Valid until the next
/// call by the same thread, which keeps the memory.
const Bytes& averaged(const std::uint8_t* pixels, std::size_t row, std::size_t rows, std::size_t apart) {
    thread_local Bytes filtered;
    filtered.resize((row + 1) * rows);
    filtered[0] = static_cast<std::uint8_t>(Filter::Sub);
    std::copy_n(pixels, apart, filtered.data() + 1);
    for (std::size_t i = apart; i < row; ++i)
        filtered[1 + i] = static_cast<std::uint8_t>(pixels[i] - pixels[i - apart]);
    for (std::size_t j = 1; j < rows; ++j) {
        const std::uint8_t *own = pixels + j * row, *above = own - row;
        std::uint8_t* to = filtered.data() + j * (row + 1);
        *to++ = static_cast<std::uint8_t>(Filter::Average);
        for (std::size_t i = 0; i < apart; ++i) to[i] = static_cast<std::uint8_t>(own[i] - above[i] / 2);
        for (std::size_t i = apart; i < row; ++i)
            to[i] = static_cast<std::uint8_t>(own[i] - (own[i - apart] + above[i]) / 2);
    }
    return filtered;
}

/// Highest byte first.
void append_number(Bytes& to, std::size_t number) {
    for (int shift = 24; shift >= 0; shift -= 8) to.push_back(static_cast<std::uint8_t>(number >> shift));
}

/// Appends a chunk, whose contents are written by `append`.
template <class Append>
void append_chunk(Bytes& to, std::string_view type, const Append& append) {
    const std::size_t start = to.size();
    append_number(to, 0);  // its length, filled in once known
    to.insert(to.end(), type.begin(), type.end());
    append();
    const std::size_t length = to.size() - start - 8;
    if (length > PNG_UINT_31_MAX) throw std::length_error("an image too large for a PNG");
    Bytes size;
    append_number(size, length);
    std::copy(size.begin(), size.end(), to.begin() + static_cast<std::ptrdiff_t>(start));
    append_number(to, libdeflate_crc32(0, to.data() + start + 4, length + 4));
}

template <class Image>
const std::uint8_t* pixel_bytes(const Image& image) {
    return image.pixels.data();
}
/// Highest byte first. Valid until the next call by the same thread.
const std::uint8_t* pixel_bytes(const DeepImage& image) {
    thread_local Bytes bytes;
    bytes.resize(2 * image.pixels.size());
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        bytes[2 * i] = static_cast<std::uint8_t>(image.pixels[i] >> 8);
        bytes[2 * i + 1] = static_cast<std::uint8_t>(image.pixels[i]);
    }
    return bytes.data();
}

/// Appends a zlib stream of a panel's rows, whose text and lines repeat.
void deflate_panel(std::span<const std::uint8_t> rows, Bytes& to) {
    constexpr int quick = 1;
    const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
        libdeflate_alloc_compressor(quick), libdeflate_free_compressor);
    if (!compressor) throw std::bad_alloc();
    const std::size_t start = to.size(), most = libdeflate_zlib_compress_bound(compressor.get(), rows.size());
    to.resize(start + most);
    to.resize(start + libdeflate_zlib_compress(compressor.get(), rows.data(), rows.size(), &to[start], most));
}

template <class Image>
Bytes encode_image(const Image& image) {
    const Kind kind = kind_of(image);
    if (image.width < 1 || image.height < 1 ||
        image.pixels.size() != static_cast<std::size_t>(image.width) * image.height * kind.channels) {
        throw std::invalid_argument("an image of " + std::to_string(image.width) + "x" +
                                    std::to_string(image.height) + " with " +
                                    std::to_string(image.pixels.size()) + " levels cannot be written");
    }
    const std::size_t apart = static_cast<std::size_t>(kind.channels) * kind.bits / 8;
    const std::size_t row = static_cast<std::size_t>(image.width) * apart;
    Bytes bytes = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    bytes.reserve(row * image.height + image.height + 1024);
    append_chunk(bytes, "IHDR", [&] {
        append_number(bytes, static_cast<std::size_t>(image.width));
        append_number(bytes, static_cast<std::size_t>(image.height));
        const auto type = static_cast<std::uint8_t>(kind.colour_type);
        // Bits, colour; the only compression, the only filtering; no interlace.
        bytes.insert(bytes.end(), {static_cast<std::uint8_t>(kind.bits), type, 0, 0, 0});
    });
    append_chunk(bytes, "IDAT", [&] {
        const Bytes& rows = averaged(pixel_bytes(image), row, image.height, apart);
        kind.channels == 1 ? deflate_noise(rows, bytes) : deflate_panel(rows, bytes);
    });
    append_chunk(bytes, "IEND", [] {});
    return bytes;
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& reason) {
    throw std::runtime_error(path.string() + ": " + reason);
}

/// What libpng found, without its own name.
std::string finding(const png_image& png) {
    std::string text = png.message;
    if (const std::size_t name = text.find(" (libpng)"); name != std::string::npos) text.erase(name);
    return text;
}

template <class Image>
Image read_image(const std::filesystem::path& path) {
    const Kind kind = kind_of(Image{});
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file) refuse(path, "cannot be read: " + std::generic_category().message(errno != 0 ? errno : EIO));
    const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    if (file.bad()) refuse(path, "cannot be read");

    // The simplified interface of libpng handles its long jumps inside.
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) {
        refuse(path, "is no PNG: " + finding(png));
    }
    // The header's own bit depth and colour type; the interface above would convert silently.
    const int depth = static_cast<unsigned char>(bytes.at(24)),
              type = static_cast<unsigned char>(bytes.at(25));
    if (depth != kind.bits || type != kind.colour_type || png.format != kind.format) {
        png_image_free(&png);
        refuse(path, "has colour type " + std::to_string(type) + " and " + std::to_string(depth) +
                         " bits; only " + std::to_string(kind.bits) + "-bit " + kind.name +
                         " without transparency (colour type " + std::to_string(kind.colour_type) +
                         ") is read");
    }
    constexpr unsigned most = 16384;
    if (png.width > most || png.height > most) {
        png_image_free(&png);
        refuse(path, "is larger than 16384 pixels along a side");
    }
    Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
    image.pixels.resize(static_cast<std::size_t>(png.width) * png.height * kind.channels);
    if (png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) == 0) {
        refuse(path, "is damaged: " + finding(png) + "; expected a whole PNG");
    }
    return image;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const GrayImage& image) {
    return encode_image(image);
}
std::vector<std::uint8_t> encode_png(const DeepImage& image) {
    return encode_image(image);
}
std::vector<std::uint8_t> encode_png(const ColourImage& image) {
    return encode_image(image);
}

GrayImage read_png(const std::filesystem::path& path) {
    return read_image<GrayImage>(path);
}
DeepImage read_deep_png(const std::filesystem::path& path) {
    return read_image<DeepImage>(path);
}
ColourImage read_colour_png(const std::filesystem::path& path) {
    return read_image<ColourImage>(path);
}

}  // namespace render
