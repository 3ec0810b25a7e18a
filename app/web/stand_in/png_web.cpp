/// PNG of a page: written without compression, as pictures of debriefings alone need it; none is read.

#include <array>
#include <stdexcept>
#include <string_view>

#include "render/picture/png.h"

namespace render {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append(Bytes& to, std::uint32_t number) {
    for (int shift = 24; shift >= 0; shift -= 8) to.push_back(static_cast<std::uint8_t>(number >> shift));
}

/// CRC-32 of ISO 3309, as PNG has it.
std::uint32_t crc(const std::uint8_t* at, std::size_t size) {
    static const std::array<std::uint32_t, 256> table = [] {
        std::array<std::uint32_t, 256> made{};
        for (std::uint32_t n = 0; n < 256; ++n) {
            std::uint32_t c = n;
            for (int k = 0; k < 8; ++k) c = (c & 1) != 0 ? 0xedb88320u ^ (c >> 1) : c >> 1;
            made[n] = c;
        }
        return made;
    }();
    std::uint32_t c = 0xffffffffu;
    for (std::size_t k = 0; k < size; ++k) c = table[(c ^ at[k]) & 0xffu] ^ (c >> 8);
    return ~c;
}

void append_chunk(Bytes& to, std::string_view kind, const Bytes& data) {
    append(to, static_cast<std::uint32_t>(data.size()));
    const std::size_t start = to.size();
    to.insert(to.end(), kind.begin(), kind.end());
    to.insert(to.end(), data.begin(), data.end());
    append(to, crc(to.data() + start, to.size() - start));
}

/// zlib's format (RFC 1950) with stored blocks alone.
Bytes stored(const Bytes& data) {
    Bytes made{0x78, 0x01};
    constexpr std::size_t longest = 65535;
    std::uint32_t a = 1, b = 0;
    for (std::size_t at = 0; at < data.size(); at += longest) {
        const std::size_t size = std::min(longest, data.size() - at);
        made.push_back(at + size == data.size() ? 1 : 0);
        for (const std::size_t number : {size, ~size}) {
            made.push_back(static_cast<std::uint8_t>(number));
            made.push_back(static_cast<std::uint8_t>(number >> 8));
        }
        made.insert(made.end(), data.begin() + static_cast<std::ptrdiff_t>(at),
                    data.begin() + static_cast<std::ptrdiff_t>(at + size));
        for (std::size_t k = at; k < at + size; ++k) a = (a + data[k]) % 65521, b = (b + a) % 65521;
    }
    append(made, b << 16 | a);
    return made;
}

/// `line`: bytes of a row.
Bytes encoded(int width, int height, std::uint8_t depth, std::uint8_t colour, std::size_t line,
              const Bytes& pixels) {
    if (width <= 0 || height <= 0 || pixels.size() != line * static_cast<std::size_t>(height))
        throw std::invalid_argument("a PNG needs an image with pixels");
    Bytes made{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'}, header, rows;
    append(header, static_cast<std::uint32_t>(width));
    append(header, static_cast<std::uint32_t>(height));
    for (const std::uint8_t byte : {depth, colour, std::uint8_t{0}, std::uint8_t{0}, std::uint8_t{0}})
        header.push_back(byte);
    append_chunk(made, "IHDR", header);
    for (std::size_t at = 0; at < pixels.size(); at += line) {
        rows.push_back(0);  // no filter
        rows.insert(rows.end(), pixels.begin() + static_cast<std::ptrdiff_t>(at),
                    pixels.begin() + static_cast<std::ptrdiff_t>(at + line));
    }
    append_chunk(made, "IDAT", stored(rows));
    append_chunk(made, "IEND", {});
    return made;
}

[[noreturn]] void refuse(const std::filesystem::path& file) {
    throw std::runtime_error(file.string() + ": a page reads no pictures");
}

}  // namespace

Bytes encode_png(const GrayImage& image) {
    return encoded(image.width, image.height, 8, 0, static_cast<std::size_t>(image.width), image.pixels);
}
Bytes encode_png(const ColourImage& image) {
    return encoded(image.width, image.height, 8, 2, 3 * static_cast<std::size_t>(image.width), image.pixels);
}
Bytes encode_png(const DeepImage& image) {
    Bytes bytes;
    for (const std::uint16_t value : image.pixels) {
        bytes.push_back(static_cast<std::uint8_t>(value >> 8));
        bytes.push_back(static_cast<std::uint8_t>(value));
    }
    return encoded(image.width, image.height, 16, 0, 2 * static_cast<std::size_t>(image.width), bytes);
}
GrayImage read_png(const std::filesystem::path& file) {
    refuse(file);
}
DeepImage read_deep_png(const std::filesystem::path& file) {
    refuse(file);
}
ColourImage read_colour_png(const std::filesystem::path& file) {
    refuse(file);
}

}  // namespace render
