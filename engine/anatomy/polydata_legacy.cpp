#include <algorithm>
#include <fmt/format.h>

#include "engine/anatomy/polydata.h"
#include "engine/anatomy/text_scanner.h"

namespace anatomy {
namespace {

class LegacyVtkReader {
public:
    LegacyVtkReader(const std::string& text, const std::string& file) : words_(text, file), file_(file) {}

    PolyData read() {
        read_head();
        while (!words_.at_end()) read_section();
        add_piece(data_, points_, cells_, file_);
        drop_incomplete_arrays();
        take_axes(data_);
        return std::move(data_);
    }

private:
    enum class Owner { File, Points, Cells };

    void read_head() {
        const std::string_view first = words_.rest_of_line();
        if (!first.starts_with("# vtk DataFile Version"))
            words_.refuse_found(fmt::format("'{}'", first.substr(0, 30)), "'# vtk DataFile Version …'");
        data_.axes = axes_in_line(words_.rest_of_line(), "the title");
        if (words_.take("BINARY"))
            binary_ = true;
        else if (!words_.take("ASCII"))
            refuse_next("ASCII or BINARY");
        if (!words_.take("DATASET")) refuse_next("DATASET");
        if (!words_.take("POLYDATA")) refuse_next("POLYDATA: a surface or lines, not a volume or a grid,");
    }
    [[noreturn]] void refuse_next(std::string_view expected) {
        words_.word();
        words_.refuse(expected);
    }

    void read_section() {
        constexpr std::array<const char*, 4> sections = {"VERTICES", "LINES", "POLYGONS", "TRIANGLE_STRIPS"};
        for (std::size_t kind = 0; kind < sections.size(); ++kind)
            if (words_.take(sections[kind])) return read_cells(cells_[kind]);
        if (words_.take("POINTS")) return read_points();
        if (words_.take("METADATA")) return skip_metadata();
        if (words_.take("POINT_DATA")) return begin_data(Owner::Points);
        if (words_.take("CELL_DATA")) return begin_data(Owner::Cells);
        if (words_.take("FIELD")) return read_field();
        if (words_.take("SCALARS")) return read_scalars();
        if (words_.take("LOOKUP_TABLE")) return skip_lookup_table();
        if (words_.take("COLOR_SCALARS")) return skip_colours();
        for (const auto& [name, components] : {std::pair{"VECTORS", 3},
                                               {"NORMALS", 3},
                                               {"TENSORS", 9},
                                               {"TENSORS6", 6},
                                               {"GLOBAL_IDS", 1},
                                               {"PEDIGREE_IDS", 1}})
            if (words_.take(name)) return skip_attribute(components);
        if (words_.take("TEXTURE_COORDINATES")) {
            words_.word();
            const auto dimension = words_.whole("the dimension", 1, 3);
            skip(type(), dimension * tuples_);
            return;
        }
        refuse_next(
            "POINTS, LINES, POLYGONS, TRIANGLE_STRIPS, POINT_DATA, CELL_DATA, FIELD, SCALARS or another "
            "section of PolyData");
    }

    NumberType type() {
        if (const auto known = number_type_named(words_.word())) return *known;
        words_.refuse("a type such as float, double, int or vtktypeint64");
    }
    /// Binary numbers follow the line end of their section's head.
    template <class Number>
    std::vector<Number> numbers(NumberType type, std::int64_t count, std::string_view what) {
        if (binary_) {
            words_.rest_of_line();
            return unpacked<Number>(words_.bytes(what, static_cast<std::size_t>(count) * io::size_of(type)),
                                    type, true);
        }
        if (static_cast<std::size_t>(count) > words_.left())
            words_.refuse_found(fmt::format("{} bytes for {} numbers, {},", words_.left(), count, what),
                                "a whole file");
        std::vector<Number> read(static_cast<std::size_t>(count));
        for (Number& number : read) {
            if constexpr (std::is_same_v<Number, std::int64_t>)
                number = words_.whole(what, -(std::int64_t{1} << 52), std::int64_t{1} << 52);
            else
                number = words_.number(what);
        }
        return read;
    }
    void skip(NumberType type, std::int64_t count) {
        if (binary_) {
            words_.rest_of_line();
            words_.bytes("an array", static_cast<std::size_t>(count) * io::size_of(type));
            return;
        }
        for (std::int64_t i = 0; i < count; ++i)
            if (words_.word().empty()) words_.refuse("a number");
    }

    void read_points() {
        const auto count = words_.whole("the number of points", 0, most_points);
        const std::vector<double> places = numbers<double>(type(), 3 * count, "a coordinate");
        points_.clear();
        for (std::size_t i = 0; i < places.size(); i += 3)
            points_.emplace_back(places[i], places[i + 1], places[i + 2]);
    }

    /// Either counts in front of each cell's indices, or, from version 5, two arrays of their own.
    void read_cells(CellList& cells) {
        const auto first = words_.whole("the number of cells", 0, most_indices);
        const auto second = words_.whole("the number of indices", 0, most_indices);
        cells = {};
        if (words_.take("OFFSETS")) {
            cells.ends = numbers<std::int64_t>(whole_type(), first, "an offset");
            if (!words_.take("CONNECTIVITY")) refuse_next("CONNECTIVITY");
            cells.indices = numbers<std::int64_t>(whole_type(), second, "an index");
            if (!cells.ends.empty()) cells.ends.erase(cells.ends.begin());  // the first cell's start
            return;
        }
        const std::vector<std::int64_t> row = numbers<std::int64_t>(NumberType::Int32, second, "an index");
        std::size_t at = 0;
        for (std::int64_t cell = 0; cell < first; ++cell) {
            const auto left = static_cast<std::int64_t>(row.size() - at);
            if (left == 0 || row[at] < 0 || row[at] >= left)
                words_.refuse_found(fmt::format("cell {} of {} indices where {} are left", cell,
                                                left == 0 ? 0 : row[at], std::max<std::int64_t>(left - 1, 0)),
                                    "as many as the head of the section says");
            const auto begin = row.begin() + static_cast<std::ptrdiff_t>(at) + 1;
            cells.indices.insert(cells.indices.end(), begin, begin + static_cast<std::ptrdiff_t>(row[at]));
            at += 1 + static_cast<std::size_t>(row[at]);
            cells.ends.push_back(std::ssize(cells.indices));
        }
    }
    NumberType whole_type() {
        const NumberType read = type();
        if (read == NumberType::Float32 || read == NumberType::Float64)
            words_.refuse("a type of whole numbers");
        return read;
    }

    void begin_data(Owner owner) {
        owner_ = owner;
        tuples_ = words_.whole("the number of values", 0, most_indices);
    }
    std::vector<PolyData::Array>& arrays() {
        return owner_ == Owner::Points  ? data_.of_points
               : owner_ == Owner::Cells ? data_.of_cells
                                        : data_.of_file;
    }
    void read_numbers(const std::string& name, int components, std::int64_t tuples) {
        const NumberType stored = type();
        if (components == 1 && keeps_numbers(name))
            arrays().push_back({name, numbers<double>(stored, tuples, "a value of " + name), {}});
        else
            skip(stored, components * tuples);
    }
    void read_scalars() {
        const std::string name(words_.word()), type_word(words_.word());
        const auto known = number_type_named(type_word);
        if (!known) words_.refuse("a type such as float, double or int");
        // The number of components may stand at the end of the line.
        TextScanner rest(words_.rest_of_line(), file_);
        const int components =
            rest.at_end() ? 1 : static_cast<int>(rest.whole("a number of components", 1, 4));
        if (!words_.take("LOOKUP_TABLE")) refuse_next("LOOKUP_TABLE");
        words_.word();
        if (components == 1 && keeps_numbers(name))
            arrays().push_back({name, numbers<double>(*known, tuples_, "a scalar"), {}});
        else
            skip(*known, components * tuples_);
    }
    void skip_attribute(int components) {
        words_.word();
        skip(type(), components * tuples_);
    }
    void skip_lookup_table() {
        words_.word();
        skip(binary_ ? NumberType::UInt8 : NumberType::Float32,
             4 * words_.whole("the number of colours", 0, most_indices));
    }
    void skip_colours() {
        words_.word();
        const auto components = words_.whole("the number of components", 1, 4);
        skip(binary_ ? NumberType::UInt8 : NumberType::Float32, components * tuples_);
    }
    void read_field() {
        words_.word();
        const auto count = words_.whole("the number of arrays", 0, 10'000);
        for (std::int64_t i = 0; i < count; ++i) {
            while (words_.take("METADATA")) skip_metadata();
            const std::string name(words_.word());
            const auto components = words_.whole("the number of components", 0, 1000);
            const auto tuples = words_.whole("the number of tuples", 0, most_indices);
            if (words_.take("string"))
                read_texts(name, components * tuples);
            else
                read_numbers(name, static_cast<int>(components), tuples);
        }
    }
    void read_texts(const std::string& name, std::int64_t count) {
        words_.rest_of_line();
        PolyData::Array read{name, {}, {}};
        for (std::int64_t i = 0; i < count; ++i) {
            if (words_.left() == 0) words_.refuse("a text");
            read.texts.emplace_back(binary_ ? words_.bytes("a text", text_length()) : words_.rest_of_line());
        }
        arrays().push_back(std::move(read));
    }
    /// The two highest bits of the first byte say how many more bytes the length has.
    std::size_t text_length() {
        const auto next = [this] { return static_cast<unsigned char>(words_.bytes("a length", 1)[0]); };
        const unsigned char first = next();
        constexpr std::array<int, 4> more = {7, 3, 1, 0};
        std::size_t length = first & 0x3f;
        for (int k = 0; k < more[first >> 6]; ++k) length = length << 8 | next();
        return length;
    }
    /// It ends with an empty line.
    void skip_metadata() {
        words_.rest_of_line();
        while (words_.left() > 0 && !words_.rest_of_line().empty()) {
        }
    }

    void drop_incomplete_arrays() {
        const auto other_than = [](std::size_t count) {
            return [count](const PolyData::Array& array) {
                return array.numbers.size() + array.texts.size() != count;
            };
        };
        std::erase_if(data_.of_points, other_than(data_.points.size()));
        std::erase_if(data_.of_cells, other_than(static_cast<std::size_t>(data_.cells)));
    }

    TextScanner words_;
    const std::string& file_;
    bool binary_ = false;
    geometry::Polyline points_;
    std::array<CellList, 4> cells_;
    Owner owner_ = Owner::File;
    std::int64_t tuples_ = 0;
    PolyData data_;
};

}  // namespace

PolyData parse_legacy_vtk(const std::string& text, const std::string& file) {
    return LegacyVtkReader(text, file).read();
}

}  // namespace anatomy
