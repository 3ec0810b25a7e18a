#pragma once
/// Tables of words and numbers, as CSV and as Markdown.

#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace io {

using TableCell = std::variant<std::string, double>;

struct Table {
    std::string name;                  // of the file, without .csv
    std::vector<std::string> columns;  // numbers carry their unit: energy_N_mm
    std::vector<std::vector<TableCell>> rows;

    /// Adds a row; as many cells as columns (asserted).
    void add(std::vector<TableCell>);

    /// Of a column by its name, and what stands there in a row. Throw std::out_of_range, which names the
    /// table and the column, and std::bad_variant_access where the cell is of the other kind.
    std::size_t column(std::string_view) const;
    double number(std::size_t row, std::string_view column) const;
    const std::string& word(std::size_t row, std::string_view column) const;
};

/// RFC 4180 with LF: words with commas, quotes or line ends are quoted. Numbers read back to the same bits;
/// one that is not finite is an empty cell.
std::string to_csv(const Table&);

/// A Markdown table, numbers with `digits` significant digits and flush right.
std::string to_markdown(const Table&, int digits = 4);

}  // namespace io
