#pragma once
/// Tables of words and numbers, as CSV and as Markdown.

#include <string>
#include <string_view>
#include <vector>

#include "engine/io/csv.h"

namespace io {

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
