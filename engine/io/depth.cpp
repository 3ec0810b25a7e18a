#include "engine/io/depth.h"

#include <algorithm>
#include <fmt/format.h>

#include "engine/io/error.h"

namespace io {
namespace {

[[noreturn]] void refuse_depth(std::string_view text, std::size_t at, const std::string& file) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    throw InputError(
        located({file, static_cast<int>(line), 0},
                fmt::format("more than {0} levels, one within another, were found; expected at most {0}",
                            deepest_nesting)));
}

/// The byte behind a string that begins at `at` with `quote`; `escapes`: whether a backslash hides the next
/// byte.
std::size_t behind_string(std::string_view text, std::size_t at, std::string_view quote, bool escapes) {
    for (std::size_t i = at + quote.size(); i < text.size(); ++i) {
        if (escapes && text[i] == '\\')
            ++i;
        else if (text.substr(i, quote.size()) == quote)
            return i + quote.size();
        else if (quote.size() == 1 && text[i] == '\n')
            return i;  // not closed: the parser reports it
    }
    return text.size();
}

}  // namespace

void check_json_depth(std::string_view text, const std::string& file) {
    int depth = 0;
    for (std::size_t i = 0; i < text.size();) {
        const char c = text[i];
        if (c == '"') {
            i = behind_string(text, i, "\"", true);
            continue;
        }
        if ((c == '[' || c == '{') && ++depth > deepest_nesting) refuse_depth(text, i, file);
        if (c == ']' || c == '}') --depth;
        ++i;
    }
}

void check_toml_depth(std::string_view text, const std::string& file) {
    int depth = 0, dots = 0;
    for (std::size_t i = 0; i < text.size();) {
        const char c = text[i];
        if (c == '"' || c == '\'') {
            const std::string_view three = text.substr(i, 3);
            const bool long_string = three == "\"\"\"" || three == "\'\'\'";
            i = behind_string(text, i, long_string ? three : text.substr(i, 1), c == '"');
            continue;
        }
        if (c == '#') {
            i = std::min(text.find('\n', i), text.size());
            continue;
        }
        if (c == '[' || c == '{') ++depth;
        if (c == ']' || c == '}') --depth;
        if (c == '.') ++dots;
        // Levels of a key end with it.
        if (c == '\n' || c == '=' || c == ',') dots = 0;
        if (depth + dots > deepest_nesting) refuse_depth(text, i, file);
        ++i;
    }
}

}  // namespace io
