#include <algorithm>
#include <array>
#include <cstdint>
#include <fmt/format.h>
#include <functional>
#include <libdeflate.h>
#include <memory>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "engine/anatomy/polydata.h"
#include "engine/anatomy/text_scanner.h"

namespace anatomy {
namespace {

struct VtkEncoding {
    bool base64 = false, compressed = false, big_endian = false;
    bool wide = false;  // lengths are of 64 bits, else of 32
};

/// Called with what was found and what is accepted; throws.
using RefuseBytes = std::function<void(const std::string& found, const std::string& accepted)>;

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
                    "expected a whole file");
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
            if (text_.empty()) refuse_("the base64 text ends too early", "expected a whole file");
            const signed char value = base64_values[static_cast<unsigned char>(text_[0])];
            if (value < 0 && !(text_[0] == '=' && letters >= 2))
                refuse_(fmt::format("a byte {} stands in base64 text", static_cast<unsigned char>(text_[0])),
                        "expected letters, digits, '+', '/' and '=' at the end");
            padding += value < 0;
            if (value >= 0 && padding > 0)
                refuse_("base64 text goes on after '='", "expected groups of four letters");
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
        refuse(fmt::format("an array of {} bytes was found", size), fmt::format("expected at most {}", most));
}

/// The array that begins where the text does; what follows it is not looked at. An array of more than `most`
/// bytes, one that is not whole, or one that does not unpack is refused before memory is taken for it.
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
                   "expected blocks packed by zlib");
        at += size;
    }
    return bytes;
}

constexpr std::ptrdiff_t most_elements = 100'000;

class VtpReader {
public:
    VtpReader(const std::string& text, const std::string& file) : text_(text), file_(file) {}

    PolyData read() {
        parse();
        const pugi::xml_node root = document_.child("VTKFile"), poly = root.child("PolyData");
        if (!root) refuse_polydata(file_, "", "there is no <VTKFile>", "expected an XML file of VTK");
        if (!poly)
            refuse_polydata(file_, "<VTKFile>",
                            fmt::format("type '{}' was found", root.attribute("type").value()),
                            "expected type 'PolyData': save the surface or the lines as .vtp");
        read_encoding(root);
        for (const pugi::xml_node piece : poly.children("Piece")) read_piece(piece);
        if (!poly.child("Piece"))
            refuse_polydata(file_, "<PolyData>", "there is no <Piece>", "expected one or more");
        for (const pugi::xml_node array : poly.child("FieldData").children("Array")) read_field(array);
        for (const pugi::xml_node array : poly.child("FieldData").children("DataArray")) read_field(array);
        take_axes(data_);
        return std::move(data_);
    }

private:
    /// Appended data may be raw bytes, which are no XML: they are cut off first.
    void parse() {
        const std::size_t head = text_.find("<AppendedData");
        std::string_view xml = text_;
        std::string closed;
        if (head != std::string::npos) {
            const std::size_t close = text_.find('>', head), start = text_.find('_', head);
            if (close == std::string::npos || start == std::string::npos || start < close)
                refuse_polydata(file_, "<AppendedData>", "it has no data after '_'", "expected a whole file");
            const std::string tag = text_.substr(head, close - head);
            appended_base64_ = tag.find("\"base64\"") != std::string::npos;
            appended_ = std::string_view(text_).substr(start + 1);
            xml = closed = text_.substr(0, head) + "</VTKFile>";
        }
        if (std::ranges::count(xml, '<') > most_elements)
            refuse_polydata(file_, "", "there are too many elements",
                            fmt::format("expected at most {}", most_elements));
        const pugi::xml_parse_result parsed =
            document_.load_buffer(xml.data(), xml.size(), pugi::parse_minimal | pugi::parse_escapes);
        if (!parsed)
            refuse_polydata(fmt::format("{}:{}", file_, line_at(parsed.offset)), "",
                            fmt::format("this is not XML ({})", parsed.description()),
                            "expected a VTK PolyData file");
    }
    int line_at(std::ptrdiff_t offset) const {
        const auto end =
            text_.begin() + std::min<std::ptrdiff_t>(std::max<std::ptrdiff_t>(offset, 0), std::ssize(text_));
        return 1 + static_cast<int>(std::count(text_.begin(), end, '\n'));
    }

    void read_encoding(const pugi::xml_node& root) {
        encoding_.big_endian = std::string_view(root.attribute("byte_order").value()) == "BigEndian";
        encoding_.wide = std::string_view(root.attribute("header_type").value()) == "UInt64";
        const std::string_view compressor = root.attribute("compressor").value();
        encoding_.compressed = !compressor.empty();
        if (encoding_.compressed && compressor != "vtkZLibDataCompressor")
            refuse_polydata(file_, "<VTKFile>", fmt::format("compressor '{}' was found", compressor),
                            "expected 'vtkZLibDataCompressor' or none");
    }

    std::string place_of(const pugi::xml_node& array) const {
        return fmt::format("<{}> '{}'", array.parent().name(), array.attribute("Name").value());
    }
    NumberType type_of(const pugi::xml_node& array) const {
        const std::string_view name = array.attribute("type").value();
        if (name == "String") return NumberType::UInt8;
        if (const auto type = number_type_named(name)) return *type;
        refuse_polydata(file_, place_of(array), fmt::format("type '{}' was found", name),
                        "expected Float32, Float64, Int8 to Int64, UInt8 to UInt64 or String");
    }
    template <class Number>
    std::vector<Number> numbers_of(const pugi::xml_node& array, std::int64_t most) const {
        const std::string place = place_of(array);
        const NumberType type = type_of(array);
        const std::string_view format = array.attribute("format").value();
        std::vector<Number> numbers;
        if (format == "ascii" || format.empty()) {
            const pugi::xml_node content = array.first_child();
            if (!content) return numbers;
            const auto from = static_cast<std::size_t>(std::max<std::ptrdiff_t>(content.offset_debug(), 0));
            TextScanner words(text_, file_, from, text_.find('<', from));
            while (!words.at_end()) {
                if (std::ssize(numbers) == most)
                    words.refuse_found("a number too many", fmt::format("{}", most));
                numbers.push_back(next<Number>(words, place));
            }
            return numbers;
        }
        VtkEncoding encoding = encoding_;
        std::string_view text = array.first_child().value();
        if (format == "appended") {
            const std::uint64_t offset = array.attribute("offset").as_ullong();
            if (offset >= appended_.size())
                refuse_polydata(file_, place, fmt::format("offset {} was found", offset),
                                fmt::format("{} bytes of data are there", appended_.size()));
            text = appended_.substr(offset);
            encoding.base64 = appended_base64_;
        } else if (format == "binary") {
            encoding.base64 = true;
        } else {
            refuse_polydata(file_, place, fmt::format("format '{}' was found", format),
                            "expected ascii, binary and appended");
        }
        const std::string bytes =
            array_bytes(text, encoding, static_cast<std::uint64_t>(most) * io::size_of(type),
                        [&](const std::string& found, const std::string& accepted) {
                            refuse_polydata(file_, place, found, accepted);
                        });
        return unpacked<Number>(bytes, type, encoding.big_endian);
    }
    template <class Number>
    static Number next(TextScanner& words, const std::string& place) {
        if constexpr (std::is_same_v<Number, std::int64_t>)
            return words.whole(place, -(std::int64_t{1} << 52), std::int64_t{1} << 52);
        else
            return words.number(place);
    }

    std::int64_t count_in(const pugi::xml_node& piece, const char* attribute, std::int64_t most) const {
        const long long count = piece.attribute(attribute).as_llong();
        if (count < 0 || count > most)
            refuse_polydata(file_, "<Piece>",
                            fmt::format("{} = '{}' was found", attribute, piece.attribute(attribute).value()),
                            fmt::format("expected 0 to {}", most));
        return count;
    }

    void read_piece(const pugi::xml_node& piece) {
        const std::int64_t count = count_in(piece, "NumberOfPoints", most_points);
        const pugi::xml_node place_array = piece.child("Points").child("DataArray");
        if (count > 0 && !place_array)
            refuse_polydata(file_, "<Piece>", "it has no <Points>", "expected an array of x, y, z");
        std::vector<double> places;
        if (count > 0) places = numbers_of<double>(place_array, 3 * count);
        if (std::ssize(places) != 3 * count)
            refuse_polydata(file_, "<Points>", fmt::format("{} numbers were found", places.size()),
                            fmt::format("expected {}, x, y, z of {} points", 3 * count, count));
        geometry::Polyline points;
        for (std::size_t i = 0; i < places.size(); i += 3)
            points.emplace_back(places[i], places[i + 1], places[i + 2]);
        std::array<CellList, 4> cells;
        for (std::size_t kind = 0; kind < cells.size(); ++kind)
            cells[kind] = cells_of(piece, cell_kinds[kind]);
        const int points_before = static_cast<int>(data_.points.size()), cells_before = data_.cells;
        add_piece(data_, points, cells, file_);
        add_arrays(data_.of_points, arrays_of(piece.child("PointData"), count), points_before);
        add_arrays(data_.of_cells, arrays_of(piece.child("CellData"), data_.cells - cells_before),
                   cells_before);
    }

    CellList cells_of(const pugi::xml_node& piece, const char* kind) const {
        CellList list;
        const std::string counted = fmt::format("NumberOf{}", kind);
        const std::int64_t count = count_in(piece, counted.c_str(), most_indices);
        for (const pugi::xml_node array : piece.child(kind).children("DataArray")) {
            const std::string_view name = array.attribute("Name").value();
            if (name != "connectivity" && name != "offsets") continue;
            if (const NumberType type = type_of(array);
                type == NumberType::Float32 || type == NumberType::Float64)
                refuse_polydata(file_, place_of(array), "fractions were found", "expected whole numbers");
            (name == "offsets" ? list.ends : list.indices) = numbers_of<std::int64_t>(array, most_indices);
        }
        if (std::ssize(list.ends) != count)
            refuse_polydata(file_, fmt::format("<{}>", kind),
                            fmt::format("{} cells were found", list.ends.size()),
                            fmt::format("expected {}, as {} says", count, counted));
        return list;
    }

    static bool is_text(const pugi::xml_node& array) {
        return std::string_view(array.attribute("type").value()) == "String";
    }
    static bool is_kept(const pugi::xml_node& array) {
        return array.attribute("NumberOfComponents").as_int(1) == 1 &&
               (is_text(array) || keeps_numbers(array.attribute("Name").value()));
    }
    /// Arrays that are of no use here are not unpacked.
    std::vector<PolyData::Array> arrays_of(const pugi::xml_node& data, std::int64_t count) const {
        std::vector<PolyData::Array> arrays;
        for (const pugi::xml_node array : data.children()) {
            if (!is_kept(array)) continue;
            PolyData::Array read = array_of(array, count);
            if (std::ssize(read.numbers) + std::ssize(read.texts) == count) arrays.push_back(std::move(read));
        }
        return arrays;
    }
    PolyData::Array array_of(const pugi::xml_node& array, std::int64_t count) const {
        PolyData::Array read;
        read.name = array.attribute("Name").value();
        if (is_text(array)) {
            constexpr std::int64_t most_text = 1 << 20;
            std::string bytes;
            for (const std::int64_t code : numbers_of<std::int64_t>(array, most_text))
                bytes += static_cast<char>(code);
            read.texts = texts_of(bytes);
        } else {
            read.numbers = numbers_of<double>(array, count);
        }
        return read;
    }
    void read_field(const pugi::xml_node& array) {
        constexpr std::int64_t most_of_file = 100'000;
        if (is_kept(array)) data_.of_file.push_back(array_of(array, most_of_file));
    }

    const std::string& text_;
    const std::string& file_;
    pugi::xml_document document_;
    std::string_view appended_;
    bool appended_base64_ = false;
    VtkEncoding encoding_;
    PolyData data_;
};

}  // namespace

PolyData parse_vtp(const std::string& text, const std::string& file) {
    return VtpReader(text, file).read();
}

}  // namespace anatomy
