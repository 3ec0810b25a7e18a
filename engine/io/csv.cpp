#include "engine/io/csv.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fstream>
#include <sstream>

#include "engine/io/error.h"
#include "engine/io/text.h"

namespace io {
namespace {

/// Short enough for one line of a message, with bytes that are not text left out.
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

/// Takes the next line off the text, without its end.
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
                place, fmt::format("'{}' is one column too many; {} are accepted", shown(word), columns)));
        }
        const std::optional<double> number = parse_number(word);
        if (!number || !std::isfinite(*number)) {
            throw InputError(
                located(place, fmt::format("'{}' was found; a finite number is accepted", shown(word))));
        }
        row.push_back(*number);
        at = end + 1;
    }
    if (row.size() < columns) {
        place.column = static_cast<int>(line.size()) + 1;
        throw InputError(located(
            place, fmt::format("the row ends after {} numbers; {} are accepted", row.size(), columns)));
    }
    return row;
}

}  // namespace

std::vector<std::vector<double>> parse_csv(std::string_view text, const std::string& file,
                                           std::string_view header) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // a byte-order mark of some editors
    const std::string_view found = take_line(text);
    if (found != header) {
        throw InputError(located(
            {file, 1, 1}, fmt::format("'{}' was found; the header '{}' is accepted", shown(found), header)));
    }
    const std::size_t columns = static_cast<std::size_t>(std::count(header.begin(), header.end(), ',')) + 1;
    std::vector<std::vector<double>> rows;
    for (int line = 2; !text.empty(); ++line) {
        const std::string_view row = take_line(text);
        if (row.empty() && text.find_first_not_of("\r\n") == std::string_view::npos) break;
        rows.push_back(parse_row(row, {file, line, 0}, columns));
    }
    return rows;
}

geometry::Polyline load_points(const std::filesystem::path& path) {
    std::error_code ignored;
    std::ifstream stream(path, std::ios::binary);
    if (!std::filesystem::is_regular_file(path, ignored) || !stream) {
        throw InputError(
            fmt::format("{}: no such file can be read; a CSV file with the header '{}' is accepted",
                        path.string(), kPointsHeader));
    }
    std::stringstream text;
    text << stream.rdbuf();
    geometry::Polyline points;
    for (const std::vector<double>& row : parse_csv(text.str(), path.string(), kPointsHeader))
        points.emplace_back(row[0], row[1], row[2]);
    return points;
}

std::string points_csv(std::span<const geometry::Vec3> points) {
    std::string text = std::string(kPointsHeader) + '\n';
    for (const geometry::Vec3& p : points)
        text += number_text(p.x()) + ',' + number_text(p.y()) + ',' + number_text(p.z()) + '\n';
    return text;
}

}  // namespace io
