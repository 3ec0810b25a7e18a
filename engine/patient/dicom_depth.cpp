#include "engine/patient/dicom_depth.h"

#include <algorithm>
#include <cstdint>
#include <fmt/format.h>
#include <optional>
#include <string>
#include <vector>
#include <zlib.h>

#include "engine/io/files.h"
#include "engine/patient/ct_samples.h"

namespace patient {
namespace {

using namespace std::string_view_literals;

constexpr std::size_t preamble = 132;  // 128 bytes and "DICM"
constexpr std::uint32_t undefined = 0xFFFFFFFF;
constexpr std::uint32_t item = 0xFFFEE000, end_of_item = 0xFFFEE00D, end_of_sequence = 0xFFFEE0DD,
                        pixel_data = 0x7FE00010, transfer_syntax = 0x00020010;

struct Syntax {
    bool is_explicit = true, is_big = false;
};

/// Steps through elements without calling itself, and counts how deep sequences lie in one another.
class Walk {
public:
    Walk(std::string_view bytes, std::size_t from, Syntax syntax)
        : bytes_(bytes), at_(from), syntax_(syntax) {}

    /// The deepest level; empty where the bytes do not follow the rules of PS3.5, chapter 7.
    std::optional<int> deepest() {
        int deepest = 0;
        while (true) {
            while (!open_.empty() && at_ >= open_.back().end) {
                if (at_ > open_.back().end) return std::nullopt;
                open_.pop_back();
            }
            if (at_ >= bytes_.size()) return deepest;
            if (!step()) return std::nullopt;
            const auto levels = std::ranges::count_if(open_, [](const Open& o) { return o.is_sequence; });
            deepest = std::max(deepest, static_cast<int>(levels));
            if (deepest > most_dicom_levels) return deepest;
        }
    }

    std::string transfer_syntax_uid;  // of the last such element that was passed

private:
    struct Open {
        bool is_sequence = false;
        bool is_implicit = false;  // a sequence of unknown representation holds implicit ones (PS3.5, 6.2.2)
        bool is_pixels = false;    // its items hold fragments instead of elements
        std::size_t end = 0;
    };

    std::optional<std::uint32_t> number(int bytes) {
        if (bytes_.size() - at_ < static_cast<std::size_t>(bytes)) return std::nullopt;
        std::uint32_t value = 0;
        for (int k = 0; k < bytes; ++k) {
            const auto byte = static_cast<unsigned char>(bytes_[at_ + k]);
            value |= static_cast<std::uint32_t>(byte) << 8 * (syntax_.is_big ? bytes - 1 - k : k);
        }
        at_ += bytes;
        return value;
    }

    void open(Open one, std::uint32_t length) {
        const std::size_t limit = open_.empty() ? bytes_.size() : open_.back().end;
        one.end = length == undefined ? limit : std::min(limit, at_ + length);
        open_.push_back(one);
    }

    bool skip(std::uint32_t length) {
        if (length == undefined || bytes_.size() - at_ < length) return false;
        at_ += length;
        return true;
    }

    /// Whether the element's value begins as a sequence does.
    bool begins_with_item() const {
        const std::string_view next = bytes_.substr(at_, 4);
        return next == (syntax_.is_big ? "\xFF\xFE\xE0\x00"sv : "\xFE\xFF\x00\xE0"sv);
    }

    bool step() {
        const auto group = number(2), element = number(2);
        if (!group || !element) return false;
        const std::uint32_t tag = *group << 16 | *element;
        if (*group == 0xFFFE) return delimiter(tag);
        const bool implicit = !syntax_.is_explicit || (!open_.empty() && open_.back().is_implicit);
        std::string_view kind = "UN";
        std::optional<std::uint32_t> length;
        if (implicit) {
            length = number(4);
        } else {
            kind = bytes_.substr(std::min(at_, bytes_.size()), 2);
            at_ += kind.size();
            constexpr std::string_view with_long_length[] = {"OB", "OD", "OF", "OL", "OV", "OW", "SQ",
                                                             "SV", "UC", "UN", "UR", "UT", "UV"};
            if (std::ranges::find(with_long_length, kind) != std::end(with_long_length)) {
                if (!number(2)) return false;
                length = number(4);
            } else {
                length = number(2);
            }
        }
        if (!length) return false;
        if (tag == pixel_data && *length == undefined) {
            open({true, false, true, 0}, *length);
            return true;
        }
        const bool unknown = implicit || kind == "UN";
        if (kind == "SQ" || (unknown && (*length == undefined || begins_with_item()))) {
            open({true, implicit || kind == "UN", false, 0}, *length);
            return true;
        }
        if (tag == transfer_syntax)
            transfer_syntax_uid = bytes_.substr(std::min(at_, bytes_.size()), *length);
        return skip(*length);
    }

    bool delimiter(std::uint32_t tag) {
        const auto length = number(4);
        if (!length) return false;
        if (tag == item) {
            if (open_.empty() || !open_.back().is_sequence) return false;
            const Open& sequence = open_.back();
            if (sequence.is_pixels) return skip(*length);
            open({false, sequence.is_implicit, false, 0}, *length);
            return true;
        }
        if (tag != end_of_item && tag != end_of_sequence) return false;
        if (open_.empty() || open_.back().is_sequence != (tag == end_of_sequence)) return false;
        open_.pop_back();
        return true;
    }

    std::string_view bytes_;
    std::size_t at_;
    Syntax syntax_;
    std::vector<Open> open_;
};

/// No more sequences can lie in one another than there are items, whatever the structure.
int items_of(std::string_view bytes) {
    int count = 0;
    for (std::size_t at = bytes.find('\xFE'); at != std::string_view::npos; at = bytes.find('\xFE', at + 1)) {
        const bool little = bytes.substr(at, 4) == "\xFE\xFF\x00\xE0"sv;
        const bool big = at > 0 && bytes.substr(at - 1, 4) == "\xFF\xFE\xE0\x00"sv;
        if ((little || big) && ++count > most_dicom_levels) return count;
    }
    return count;
}

std::string inflated(std::string_view bytes, const std::filesystem::path& name, std::size_t most) {
    z_stream stream{};
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK)
        refuse_ct(name, "zlib does not start", "a working zlib is needed");
    std::string whole;
    std::vector<char> part(1 << 18);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(std::min<std::size_t>(bytes.size(), most));
    int state = Z_OK;
    while (state == Z_OK && whole.size() <= most) {
        stream.next_out = reinterpret_cast<Bytef*>(part.data());
        stream.avail_out = static_cast<uInt>(part.size());
        state = inflate(&stream, Z_NO_FLUSH);
        whole.append(part.data(), part.size() - stream.avail_out);
    }
    inflateEnd(&stream);
    if (whole.size() > most)
        refuse_ct(name, fmt::format("found a deflated file that inflates to more than {} MiB", most >> 20),
                  "expected at most that");
    return whole;  // as far as the data are whole; DCMTK refuses the rest
}

}  // namespace

void check_dicom_depth(std::string_view bytes, const std::filesystem::path& name, std::size_t most_inflated) {
    // The meta header, always explicit and little, up to the first element of another group.
    Syntax syntax;
    std::size_t data = bytes.size() < preamble || bytes.substr(128, 4) != "DICM" ? 0 : preamble;
    std::string uid;
    if (data > 0 && bytes.substr(preamble, 8) == "\x02\x00\x00\x00UL\x04\x00"sv &&
        bytes.size() >= preamble + 12) {
        std::uint32_t length = 0;
        for (int k = 3; k >= 0; --k)
            length =
                length << 8 | static_cast<unsigned char>(bytes[preamble + 8 + static_cast<std::size_t>(k)]);
        data = std::min<std::size_t>(bytes.size(), preamble + 12 + std::size_t{length});
        Walk meta(bytes.substr(0, data), preamble, syntax);
        meta.deepest();
        uid = meta.transfer_syntax_uid;
    } else if (bytes.find("1.2.840.10008.1.2.1.99") != std::string_view::npos) {
        refuse_ct(name, "found a deflated transfer syntax without the length of the meta header, (0002,0000)",
                  "expected that length in the first element");
    }
    while (!uid.empty() && (uid.back() == '\0' || uid.back() == ' ')) uid.pop_back();
    if (items_of(bytes.substr(0, data)) > most_dicom_levels)
        refuse_ct(name, "found sequences in the meta header", "expected none");
    std::string whole;
    std::string_view elements = bytes.substr(data);
    if (uid == "1.2.840.10008.1.2.1.99") {
        whole = inflated(elements, name, most_inflated);
        elements = whole;
    }
    if (items_of(elements) <= most_dicom_levels) return;
    syntax.is_explicit = uid != "1.2.840.10008.1.2";
    syntax.is_big = uid == "1.2.840.10008.1.2.2";
    const std::optional<int> levels = Walk(elements, 0, syntax).deepest();
    if (!levels)
        refuse_ct(name,
                  fmt::format("found more than {} items of sequences whose structure cannot be followed",
                              most_dicom_levels),
                  "expected elements as PS3.5, chapter 7, orders them");
    if (*levels > most_dicom_levels)
        refuse_ct(name, fmt::format("found sequences nested more than {} levels deep", most_dicom_levels),
                  fmt::format("expected {} levels at most", most_dicom_levels));
}

void check_dicom_depth(const std::filesystem::path& file, std::size_t most_inflated) {
    check_dicom_depth(io::read_text(file, "DICOM file", "expected a whole DICOM file"), file, most_inflated);
}

}  // namespace patient
