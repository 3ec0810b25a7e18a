#include "engine/io/csv.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <fmt/format.h>
#include <stdexcept>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"

namespace io {
namespace {

/// The text shortened to fit in one line of a message, without bytes that are not text.
std::string shown(std::string_view found) {
    std::string text;
    for (const char c : found.substr(0, 40)) text += c >= ' ' && c <= '~' ? c : '?';
    return found.size() > 40 ? text + "..." : text;
}

std::string_view trimmed(std::string_view word) {
    while (!word.empty() && word.front() == ' ') word.remove_prefix(1);
    while (!word.empty() && word.back() == ' ') word.remove_suffix(1);
    return word;
}

/// Removes the next line from the text and returns it without its line end.
std::string_view take_line(std::string_view& text) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
}

std::vector<double> parse_row(std::string_view line, TextPlace place, std::size_t columns) {
    std::vector<double> row;
    for (std::size_t at = 0; at <= line.size();) {
        const std::size_t end = std::min(line.find(',', at), line.size());
        const std::string_view word = trimmed(line.substr(at, end - at));
        place.column = static_cast<int>(at) + 1;
        if (row.size() == columns) {
            throw InputError(located(
                place, fmt::format("'{}' is one column too many; expected {}", shown(word), columns)));
        }
        const std::optional<double> number = parse_number(word);
        if (!number || !std::isfinite(*number)) {
            throw InputError(
                located(place, fmt::format("'{}' was found; expected a finite number", shown(word))));
        }
        row.push_back(*number);
        at = end + 1;
    }
    if (row.size() < columns) {
        place.column = static_cast<int>(line.size()) + 1;
        throw InputError(
            located(place, fmt::format("the row ends after {} numbers; expected {}", row.size(), columns)));
    }
    return row;
}

std::string written(const CsvCell& cell) {
    if (const double* number = std::get_if<double>(&cell))
        return std::isfinite(*number) ? number_text(*number) : std::string();
    std::string word = std::get<std::string>(cell);
    // A spreadsheet takes such a word for a formula; the apostrophe makes it text there.
    if (!word.empty() && std::string_view("=+-@\t\r").find(word.front()) != std::string_view::npos)
        word.insert(0, 1, '\'');
    if (word.find_first_of(",\"\n\r") == std::string::npos) return word;
    std::string quoted = "\"";
    for (const char c : word) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + '"';
}

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

void append_row(std::string& text, std::span<const CsvCell> row) {
    for (std::size_t k = 0; k < row.size(); ++k) {
        if (k > 0) text += ',';
        text += written(row[k]);
    }
    text += '\n';
}

std::vector<std::vector<double>> parse_csv(std::string_view text, const std::string& file,
                                           std::string_view header) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte-order mark, written by some editors
    const std::string_view found = take_line(text);
    if (found != header) {
        throw InputError(located(
            {file, 1, 1}, fmt::format("'{}' was found; expected the header '{}'", shown(found), header)));
    }
    const std::size_t columns = static_cast<std::size_t>(std::ranges::count(header, ',')) + 1;
    std::vector<std::vector<double>> rows;
    for (int line = 2; !text.empty(); ++line) {
        const std::string_view row = take_line(text);
        if (row.empty() && text.find_first_not_of("\r\n") == std::string_view::npos) break;
        rows.push_back(parse_row(row, {file, line, 0}, columns));
    }
    return rows;
}

geometry::Polyline load_points(const std::filesystem::path& path) {
    const std::string text =
        read_text(path, "file", fmt::format("expected a CSV file with the header '{}'", points_header));
    geometry::Polyline points;
    for (const std::vector<double>& row : parse_csv(text, path.string(), points_header))
        points.emplace_back(row[0], row[1], row[2]);
    return points;
}

std::string points_csv(std::span<const geometry::Vec3> points) {
    std::string text = std::string(points_header) + '\n';
    for (const geometry::Vec3& p : points) append_row(text, std::array<CsvCell, 3>{p.x(), p.y(), p.z()});
    return text;
}

std::size_t Table::column(std::string_view of) const {
    const auto at = std::ranges::find(columns, of);
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
