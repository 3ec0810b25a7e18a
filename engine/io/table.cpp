#include "engine/io/table.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <fmt/format.h>
#include <stdexcept>

namespace io {
namespace {

std::string markdown_cell(const TableCell& cell, int digits) {
    if (const double* number = std::get_if<double>(&cell))
        return std::isfinite(*number) ? fmt::format("{:.{}g}", *number, digits) : std::string("–");
    std::string text;
    for (const char c : std::get<std::string>(cell)) {
        if (c == '|')
            text += "\\|";
        else if (c == '\n')
            text += "<br>";
        else
            text += c;
    }
    return text;
}

}  // namespace

std::size_t Table::column(std::string_view of) const {
    const auto at = std::find(columns.begin(), columns.end(), of);
    if (at == columns.end()) throw std::out_of_range(fmt::format("table '{}' has no column '{}'", name, of));
    return static_cast<std::size_t>(at - columns.begin());
}

double Table::number(std::size_t row, std::string_view of) const {
    return std::get<double>(rows.at(row).at(column(of)));
}

const std::string& Table::word(std::size_t row, std::string_view of) const {
    return std::get<std::string>(rows.at(row).at(column(of)));
}

void Table::add(std::vector<TableCell> row) {
    assert(row.size() == columns.size());
    rows.push_back(std::move(row));
}

std::string to_csv(const Table& table) {
    std::string text;
    append_row(text, std::vector<CsvCell>(table.columns.begin(), table.columns.end()));
    for (const auto& row : table.rows) append_row(text, row);
    return text;
}

std::string to_markdown(const Table& table, int digits) {
    std::string text = "|", rule = "|";
    for (std::size_t k = 0; k < table.columns.size(); ++k) {
        const bool numbers = !table.rows.empty() && std::holds_alternative<double>(table.rows.front()[k]);
        text += ' ' + markdown_cell(table.columns[k], digits) + " |";
        rule += numbers ? " ---: |" : " --- |";
    }
    text += '\n' + rule + '\n';
    for (const auto& row : table.rows) {
        text += '|';
        for (const TableCell& cell : row) text += ' ' + markdown_cell(cell, digits) + " |";
        text += '\n';
    }
    return text;
}

}  // namespace io
