#include "engine/anatomy/vtk_encoding.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <libdeflate.h>
#include <memory>
#include <vector>

namespace anatomy {
namespace {

/// zlib packs a byte into a thousandth at best.
constexpr std::uint64_t best_compression = 1040;

constexpr std::array<signed char, 256> base64_values = [] {
    std::array<signed char, 256> values;
    values.fill(-1);
    const std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < letters.size(); ++i)
        values[static_cast<unsigned char>(letters[i])] = static_cast<signed char>(i);
    return values;
}();

/// Bytes one after another. In base64 lengths and data may each be padded by themselves: what follows a
/// padding is read on.
class ByteStream {
public:
    ByteStream(std::string_view text, bool base64, const RefuseBytes& refuse)
        : text_(text), base64_(base64), refuse_(refuse) {}

    std::string take(std::uint64_t count) {
        const std::uint64_t most = base64_ ? text_.size() / 4 * 3 + held_.size() : text_.size();
        if (count > most)
            refuse_(fmt::format("{} bytes are left where {} should be", most, count),
                    "a whole file is accepted");
        std::string bytes;
        bytes.reserve(count);
        if (!base64_) {
            bytes = text_.substr(0, count);
            text_.remove_prefix(count);
            return bytes;
        }
        bytes = held_.substr(0, count);
        held_.erase(0, bytes.size());
        while (bytes.size() < count) {
            const std::string three = next_three();
            const std::size_t wanted = std::min<std::size_t>(three.size(), count - bytes.size());
            bytes.append(three, 0, wanted);
            held_.append(three, wanted);
        }
        return bytes;
    }

private:
    /// Three bytes, or fewer where four letters end in '='.
    std::string next_three() {
        std::uint32_t bits = 0;
        int letters = 0, padding = 0;
        while (letters < 4) {
            while (!text_.empty() &&
                   (text_[0] == '\n' || text_[0] == ' ' || text_[0] == '\r' || text_[0] == '\t'))
                text_.remove_prefix(1);
            if (text_.empty()) refuse_("the base64 text ends too early", "a whole file is accepted");
            const signed char value = base64_values[static_cast<unsigned char>(text_[0])];
            if (value < 0 && !(text_[0] == '=' && letters >= 2))
                refuse_(fmt::format("a byte {} stands in base64 text", static_cast<unsigned char>(text_[0])),
                        "letters, digits, '+', '/' and '=' at the end are accepted");
            padding += value < 0;
            if (value >= 0 && padding > 0)
                refuse_("base64 text goes on after '='", "groups of four letters are accepted");
            bits = bits << 6 | static_cast<std::uint32_t>(value < 0 ? 0 : value);
            ++letters;
            text_.remove_prefix(1);
        }
        std::string three = {static_cast<char>(bits >> 16 & 0xff), static_cast<char>(bits >> 8 & 0xff),
                             static_cast<char>(bits & 0xff)};
        three.resize(static_cast<std::size_t>(3 - padding));
        return three;
    }

    std::string_view text_;
    bool base64_;
    const RefuseBytes& refuse_;
    std::string held_;  // decoded, not yet taken
};

std::uint64_t length_in(std::string_view bytes, const VtkEncoding& encoding) {
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < bytes.size(); ++k)
        value =
            value << 8 | static_cast<unsigned char>(bytes[encoding.big_endian ? k : bytes.size() - 1 - k]);
    return value;
}

void check_size(std::uint64_t size, std::uint64_t most, const RefuseBytes& refuse) {
    if (size > most)
        refuse(fmt::format("an array of {} bytes was found", size),
               fmt::format("up to {} are accepted", most));
}

}  // namespace

std::string array_bytes(std::string_view text, const VtkEncoding& encoding, std::uint64_t most,
                        const RefuseBytes& refuse) {
    ByteStream stream(text, encoding.base64, refuse);
    const std::size_t width = encoding.wide ? 8 : 4;
    const auto length = [&] { return length_in(stream.take(width), encoding); };
    const std::uint64_t first = length();
    if (!encoding.compressed) {
        check_size(first, most, refuse);
        return stream.take(first);
    }
    // The number of blocks, the size of each and of the last where it is smaller, their packed sizes.
    const std::uint64_t blocks = first;
    if (blocks == 0) return {};
    const std::uint64_t whole = length(), last = length();
    check_size(blocks, text.size() / width, refuse);
    check_size(last, whole, refuse);
    // The last block alone may be smaller than blocks are.
    if (blocks > 1) check_size(whole, most / (blocks - 1), refuse);
    if (last == 0) check_size(whole, most, refuse);
    const std::uint64_t total = (blocks - 1) * whole + (last > 0 ? last : whole);
    check_size(total, most, refuse);
    std::vector<std::uint64_t> packed(blocks);
    std::uint64_t packed_total = 0;
    for (std::uint64_t& size : packed) {
        size = length();
        check_size(size, text.size(), refuse);
        packed_total += size;
    }
    check_size(packed_total, text.size(), refuse);
    check_size(total, best_compression * (packed_total + blocks), refuse);
    std::string bytes(total, '\0');
    const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> unpacker(
        libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
    std::uint64_t at = 0;
    for (std::uint64_t b = 0; b < blocks; ++b) {
        const std::string block = stream.take(packed[b]);
        const std::uint64_t size = b + 1 == blocks && last > 0 ? last : whole;
        std::size_t unpacked_size = 0;
        if (libdeflate_zlib_decompress(unpacker.get(), block.data(), block.size(), bytes.data() + at, size,
                                       &unpacked_size) != LIBDEFLATE_SUCCESS ||
            unpacked_size != size)
            refuse(fmt::format("block {} of {} does not unpack to {} bytes", b + 1, blocks, size),
                   "blocks packed by zlib are accepted");
        at += size;
    }
    return bytes;
}

}  // namespace anatomy
