#include "engine/anatomy/ply_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <optional>
#include <vector>

#include "engine/anatomy/mesh_file.h"
#include "engine/anatomy/text_scanner.h"
#include "engine/io/error.h"
#include "engine/io/number_type.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

constexpr io::NumberNames ply_names = {
    "char,int8", "uchar,uint8",   "short,int16",   "ushort,uint16", "int,int32", "uint,uint32", "",
    "",          "float,float32", "double,float64"};

struct PlyProperty {
    std::string name;
    std::optional<io::NumberType> count;  // of a list
    io::NumberType type = io::NumberType::Float32;
};

struct PlyElement {
    std::string name;
    std::int64_t count = 0;
    std::vector<PlyProperty> properties;

    /// Least bytes of one such element in a file.
    std::size_t least_size(bool text) const {
        std::size_t size = 0;
        for (const PlyProperty& property : properties)
            size += text ? 2 : io::size_of(property.count.value_or(property.type));
        return size;
    }
    int index_of(std::initializer_list<std::string_view> names) const {
        for (std::size_t i = 0; i < properties.size(); ++i)
            if (std::ranges::find(names, properties[i].name) != names.end()) return static_cast<int>(i);
        return -1;
    }
};

enum class PlyOrder { Text, Little, Big };

struct PlyHeader {
    PlyOrder order = PlyOrder::Text;
    std::vector<PlyElement> elements;
};

constexpr std::size_t longest_header = 64 * 1024;  // [bytes]
constexpr int longest_list = 1000000;
constexpr int most_ply_properties = 100, most_ply_elements = 100;

io::NumberType type_of(TextScanner& words) {
    if (const auto type = io::number_type_named(words.word(), ply_names)) return *type;
    words.refuse("char, uchar, short, ushort, int, uint, float or double");
}

/// Reads up to the line end_header. `words` holds the header alone.
PlyHeader read_ply_header(TextScanner& words) {
    PlyHeader header;
    if (!words.take("ply")) {
        words.word();
        words.refuse("'ply' at the start of the file");
    }
    bool has_format = false;
    while (true) {
        const std::string_view key = words.word();
        if (key == "end_header") break;
        if (key == "comment" || key == "obj_info") {
            words.rest_of_line();
        } else if (key == "format") {
            const std::string_view order = words.word();
            if (order == "ascii")
                header.order = PlyOrder::Text;
            else if (order == "binary_little_endian")
                header.order = PlyOrder::Little;
            else if (order == "binary_big_endian")
                header.order = PlyOrder::Big;
            else
                words.refuse("'ascii', 'binary_little_endian' or 'binary_big_endian'");
            if (words.word() != "1.0") words.refuse("version '1.0'");
            has_format = true;
        } else if (key == "element") {
            PlyElement element;
            element.name = words.word();
            if (header.elements.size() == most_ply_elements)
                words.refuse(fmt::format("up to {} elements", most_ply_elements));
            element.count = words.whole("the number of such elements", 0, std::int64_t{1} << 40);
            header.elements.push_back(std::move(element));
        } else if (key == "property") {
            if (header.elements.empty()) words.refuse("'element' before the first 'property'");
            PlyElement& element = header.elements.back();
            if (element.properties.size() == most_ply_properties)
                words.refuse(fmt::format("up to {} properties of an element", most_ply_properties));
            PlyProperty property;
            if (words.take("list")) {
                property.count = type_of(words);
                if (*property.count >= io::NumberType::Float32)
                    words.refuse("a whole number's type for a list's length");
            }
            property.type = type_of(words);
            property.name = words.word();
            element.properties.push_back(std::move(property));
        } else {
            words.refuse("format, comment, obj_info, element, property or end_header");
        }
    }
    if (!has_format) words.refuse_found("a header without 'format'", "a header with one");
    return header;
}

/// The values behind the header, one after the other.
class PlyValues {
public:
    PlyValues(const std::string& bytes, std::size_t from, PlyOrder order, const std::string& file)
        : words_(bytes, file, from), order_(order) {}

    double next(io::NumberType type, const char* what) {
        if (order_ == PlyOrder::Text) return words_.number(what);
        const std::string_view bytes = words_.bytes(what, io::size_of(type));
        return io::with_stored_type(type, [&]<class Stored>(Stored) {
            return static_cast<double>(io::stored_number<Stored>(bytes.data(), order_ == PlyOrder::Big));
        });
    }
    std::size_t left() const { return words_.left(); }
    bool text() const { return order_ == PlyOrder::Text; }

private:
    TextScanner words_;
    PlyOrder order_;
};

/// Takes the elements one after the other, and of them the surface.
class PlyReader {
public:
    PlyReader(const std::string& bytes, std::size_t from, const PlyHeader& header, const std::string& file)
        : values_(bytes, from, header.order, file), file_(file) {}

    void read(const PlyElement& element) {
        const std::size_t least = element.least_size(values_.text());
        if (least == 0 && element.count > 0)
            refuse(fmt::format("element '{}' without properties", element.name), "one with properties");
        // The last number of a text needs no space behind it.
        if (least > 0 && static_cast<std::uint64_t>(element.count) > (values_.left() + 1) / least)
            refuse(fmt::format("{} of element '{}' in the {} bytes that are left", element.count,
                               element.name, values_.left()),
                   "a whole PLY file");
        if (element.name == "vertex")
            vertices(element);
        else if (element.name == "face")
            faces(element);
        else if (element.name == "tristrips")
            strips(element);
        else
            for (std::int64_t i = 0; i < element.count; ++i)
                for (const PlyProperty& property : element.properties) skip(property, element, i);
    }

    TriangleMesh mesh;

private:
    [[noreturn]] void refuse(const std::string& found, const std::string& accepted) const {
        throw io::InputError("{}: {}; expected {}", file_, found, accepted);
    }

    int list_length(const PlyProperty& property, int most, const PlyElement& element, std::int64_t i) {
        const double length = values_.next(*property.count, "the length of a list");
        if (length != std::floor(length) || length < 0 || length > most)
            refuse(fmt::format("a list of length {:g} in '{}' {}", length, element.name, i),
                   fmt::format("0 to {}", most));
        return static_cast<int>(length);
    }

    void skip(const PlyProperty& property, const PlyElement& element, std::int64_t i) {
        const int length = property.count ? list_length(property, longest_list, element, i) : 1;
        for (int n = 0; n < length; ++n) values_.next(property.type, "a property");
    }

    void vertices(const PlyElement& element) {
        if (corners_ >= 0) refuse("a second element 'vertex'", "one");
        if (static_cast<double>(element.count) > 3 * most_triangles)
            refuse(fmt::format("{} corners", element.count),
                   fmt::format("up to {:.0f} million", 3 * most_triangles / 1e6));
        corners_ = element.count;
        const std::array<int, 3> axes = {element.index_of({"x"}), element.index_of({"y"}),
                                         element.index_of({"z"})};
        for (const int axis : axes)
            if (axis < 0 || element.properties[axis].count)
                refuse("an element 'vertex' without x, y and z", "one that has them");
        mesh.vertices.reserve(static_cast<std::size_t>(corners_));
        for (std::int64_t i = 0; i < corners_; ++i) {
            Vec3 point;
            for (int p = 0; p < static_cast<int>(element.properties.size()); ++p) {
                const auto axis = std::ranges::find(axes, p);
                if (axis == axes.end())
                    skip(element.properties[p], element, i);
                else
                    point[axis - axes.begin()] = values_.next(element.properties[p].type, "a coordinate");
            }
            if (!point.allFinite() || point.cwiseAbs().maxCoeff() > 1e30)
                refuse(fmt::format("corner {} at ({:g}, {:g}, {:g})", i, point.x(), point.y(), point.z()),
                       "finite numbers up to 1e30");
            mesh.vertices.push_back(point.cast<float>().cast<double>());
        }
    }

    void faces(const PlyElement& element) {
        if (corners_ < 0) refuse("element 'face' before 'vertex'", "'vertex' before 'face'");
        if (static_cast<double>(element.count) > most_triangles)
            refuse(fmt::format("{} faces", element.count),
                   fmt::format("up to {:.0f} million", most_triangles / 1e6));
        const int list = element.index_of({"vertex_indices", "vertex_index"});
        if (list < 0 || !element.properties[list].count)
            refuse("an element 'face' without a list 'vertex_indices'", "one that has it");
        for (std::int64_t i = 0; i < element.count; ++i)
            for (int p = 0; p < static_cast<int>(element.properties.size()); ++p) {
                if (p == list)
                    polygon(element.properties[p], element, i);
                else
                    skip(element.properties[p], element, i);
            }
    }

    /// Strips of triangles, which -1 parts; every other triangle of a strip is turned round.
    void strips(const PlyElement& element) {
        if (corners_ < 0) refuse("element 'tristrips' before 'vertex'", "'vertex' before 'tristrips'");
        const int list = element.index_of({"vertex_indices", "vertex_index"});
        if (list < 0 || !element.properties[list].count)
            refuse("an element 'tristrips' without a list 'vertex_indices'", "one that has it");
        constexpr int longest_strip = 16'000'000;
        for (std::int64_t i = 0; i < element.count; ++i)
            for (int p = 0; p < static_cast<int>(element.properties.size()); ++p) {
                const PlyProperty& property = element.properties[p];
                if (p != list) {
                    skip(property, element, i);
                    continue;
                }
                const int length = list_length(property, longest_strip, element, i);
                std::array<int, 2> before{};
                int taken = 0;  // of the current strip
                for (int n = 0; n < length; ++n) {
                    const double value = values_.next(property.type, "a corner's index");
                    if (value == -1) {
                        taken = 0;
                        continue;
                    }
                    if (value != std::floor(value) || value < 0 || value >= static_cast<double>(corners_))
                        refuse(fmt::format("strip {} names corner {:g}", i, value),
                               fmt::format("0 to {}, or -1 between two strips", corners_ - 1));
                    const int corner = static_cast<int>(value);
                    if (taken >= 2 && corner != before[0] && corner != before[1] && before[0] != before[1]) {
                        if (taken % 2 == 0)
                            mesh.triangles.push_back({before[0], before[1], corner});
                        else
                            mesh.triangles.push_back({before[1], before[0], corner});
                    }
                    before = {before[1], corner};
                    ++taken;
                    if (static_cast<double>(mesh.triangles.size()) > most_triangles)
                        refuse("more triangles", fmt::format("up to {:.0f} million", most_triangles / 1e6));
                }
            }
    }

    void polygon(const PlyProperty& property, const PlyElement& element, std::int64_t i) {
        const int length = list_length(property, most_corners_of_face, element, i);
        int first = 0, before = 0;
        for (int n = 0; n < length; ++n) {
            const double value = values_.next(property.type, "a corner's index");
            if (value != std::floor(value) || value < 0 || value >= static_cast<double>(corners_))
                refuse(fmt::format("face {} names corner {:g}", i, value),
                       fmt::format("0 to {}", corners_ - 1));
            const int corner = static_cast<int>(value);
            if (n == 0) first = corner;
            if (n >= 2) mesh.triangles.push_back({first, before, corner});
            before = corner;
        }
        if (static_cast<double>(mesh.triangles.size()) > most_triangles)
            refuse("more triangles", fmt::format("up to {:.0f} million", most_triangles / 1e6));
    }

    PlyValues values_;
    std::string file_;
    std::int64_t corners_ = -1;  // declared; -1 before the element
};

}  // namespace

TriangleMesh parse_ply(const std::string& bytes, const std::string& file) {
    const std::string_view start = std::string_view(bytes).substr(0, longest_header);
    std::size_t end = start.find("end_header");
    if (end != std::string_view::npos) end = start.find('\n', end);
    if (end == std::string_view::npos)
        throw io::InputError("{}: no line 'end_header' in the first {} bytes; expected a whole PLY file",
                             file, start.size());
    TextScanner words(start.substr(0, end), file);
    const PlyHeader header = read_ply_header(words);
    PlyReader reader(bytes, end + 1, header, file);
    for (const PlyElement& element : header.elements) reader.read(element);
    return std::move(reader.mesh);
}

}  // namespace anatomy
