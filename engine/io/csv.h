#pragma once
/// CSV files: a header that names columns with their units, then one row per line. Files that are read hold
/// numbers only. Tables of words and numbers are written as CSV and as Markdown.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "physics/geometry/vec.h"

namespace io {

/// A word or a number, made of any text or number.
struct CsvCell : std::variant<std::string, double> {
    CsvCell() = default;  // an empty word
    CsvCell(std::string word) : variant(std::move(word)) {}
    CsvCell(std::string_view word) : variant(std::string(word)) {}
    CsvCell(const char* word) : variant(std::string(word)) {}
    template <class Number>
    requires std::is_arithmetic_v<Number> CsvCell(Number number) : variant(static_cast<double>(number)) {}
};

/// Appends a line of RFC 4180 with LF: words with commas, quotes or line ends are quoted. A
/// word that begins with = + - @, which a spreadsheet would take for a formula, gets an apostrophe in front.
/// Numbers take the shortest form that reads back to the same bits; one that is not finite becomes an empty
/// cell.
void append_row(std::string& text, std::span<const CsvCell> row);

/// One joint or centreline point per row [mm].
inline constexpr std::string_view points_header = "x_mm,y_mm,z_mm";

/// The rows below the header, each with as many finite numbers as the header has columns; row i is line i + 2
/// of the file. Line ends may be CR LF, and empty lines at the end are allowed. Throws InputError stating
/// file:line:column, what was found and what is accepted.
std::vector<std::vector<double>> parse_csv(std::string_view text, const std::string& file,
                                           std::string_view header);

/// The points of a file with the header x_mm,y_mm,z_mm. Throws InputError.
geometry::Polyline load_points(const std::filesystem::path&);

/// The text of such a file.
std::string points_csv(std::span<const geometry::Vec3>);

using TableCell = CsvCell;

struct Table {
    std::string name;                  // of the file, without .csv
    std::vector<std::string> columns;  // numbers carry their unit: energy_N_mm
    std::vector<std::vector<TableCell>> rows = {};

    /// Adds a row; it must have as many cells as there are columns (asserted).
    void add(std::vector<TableCell>);

    /// The index of a column by its name, and the content of a cell. These throw std::out_of_range, which
    /// names the table and the column, and std::bad_variant_access where the cell is of the other kind.
    std::size_t column(std::string_view) const;
    double number(std::size_t row, std::string_view column) const;
    const std::string& word(std::size_t row, std::string_view column) const;
};

/// The columns' names and the rows, as append_row() writes them.
std::string to_csv(const Table&);

/// A Markdown table, its numbers right-aligned with `digits` significant digits.
std::string to_markdown(const Table&, int digits = 4);

}  // namespace io
