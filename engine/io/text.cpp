#include "engine/io/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <numeric>

#include "engine/io/error.h"

namespace io {
namespace {

template <class Number, class... Options>
std::optional<Number> parse_whole(std::string_view word, Options... options) {
    Number number{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number, options...);
    if (error != std::errc{} || end != word.data() + word.size() || word.empty()) return std::nullopt;
    return number;
}

/// Levenshtein distance, two rows at a time.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t above = row[j];
            row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
            diagonal = above;
        }
    }
    return row.back();
}

/// Bytes of the character of UTF-8 that the text, which is not empty, begins with; 0 where there is none.
std::size_t character_length(std::string_view text) {
    const auto byte = [&text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    if (byte(0) < 0x80) return 1;
    const std::size_t length = byte(0) >= 0xf0 ? 4 : byte(0) >= 0xe0 ? 3 : 2;
    if (byte(0) < 0xc2 || byte(0) > 0xf4 || text.size() < length) return 0;
    for (std::size_t i = 1; i < length; ++i)
        if ((byte(i) & 0xc0) != 0x80) return 0;
    // What fits in fewer bytes, surrogates, and what is beyond Unicode.
    const bool wrong = (byte(0) == 0xe0 && byte(1) < 0xa0) || (byte(0) == 0xed && byte(1) > 0x9f) ||
                       (byte(0) == 0xf0 && byte(1) < 0x90) || (byte(0) == 0xf4 && byte(1) > 0x8f);
    return wrong ? 0 : length;
}

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

bool is_utf8(std::string_view text) {
    while (!text.empty()) {
        const std::size_t length = character_length(text);
        if (length == 0) return false;
        text.remove_prefix(length);
    }
    return true;
}

std::string as_utf8(std::string_view text) {
    std::string valid;
    while (!text.empty()) {
        const std::size_t length = character_length(text);
        if (length == 0)
            valid += "\uFFFD";
        else
            valid += text.substr(0, length);
        text.remove_prefix(std::max<std::size_t>(length, 1));
    }
    return valid;
}

std::string without_control(std::string_view text) {
    std::string shown;
    shown.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        // In UTF-8 the control characters from 0x80 to 0x9f follow a byte 0xc2.
        const bool control = (byte < 0x20 && byte != '\n') || byte == 0x7f ||
                             (byte >= 0x80 && byte < 0xa0 &&
                              (i == 0 || static_cast<unsigned char>(text[i - 1]) == 0xc2 ||
                               static_cast<unsigned char>(text[i - 1]) < 0x80));
        shown += control ? '?' : text[i];
    }
    return shown;
}

std::string toml_text(std::string_view text) {
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\')
            quoted += std::string("\\") + c;
        else if (static_cast<unsigned char>(c) < 0x20 || c == '\x7f')
            quoted += fmt::format("\\u{:04X}", static_cast<unsigned char>(c));
        else
            quoted += c;
    }
    return quoted + "\"";
}

std::string toml_key(std::string_view text) {
    const auto bare = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
               c == '-';
    };
    return !text.empty() && std::ranges::all_of(text, bare) ? std::string(text) : toml_text(text);
}

std::string_view trimmed(std::string_view text) {
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && blank(text.back())) text.remove_suffix(1);
    return text;
}

std::string lower_case(std::string_view text) {
    std::string result(text);
    for (char& c : result) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return result;
}

std::string html_escaped(std::string_view text) {
    constexpr std::pair<char, const char*> marks[] = {
        {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}};
    std::string safe;
    for (const char c : text) {
        const auto* const mark = std::ranges::find(marks, c, &std::pair<char, const char*>::first);
        if (mark != std::end(marks))
            safe += mark->second;
        else
            safe += static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t' ? ' ' : c;
    }
    return safe;
}

std::string file_name_of(std::string_view text) {
    std::string name;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        const bool plain = byte >= 0x20 && byte != 0x7f &&
                           std::string_view("/\\:*?\"<>|%").find(c) == std::string_view::npos &&
                           !(c == '.' && name.empty());
        name += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
    }
    return name;
}

std::string printable(const std::string& text) {
    constexpr std::size_t longest_line = 1000;
    // One line more is shown as it is: it may be the one that says how many were left out before.
    const auto all = static_cast<std::size_t>(std::ranges::count(text, '\n')) + 1;
    const std::size_t most_lines = all == 101 ? 101 : 100;
    std::string shown;
    std::size_t lines = 0, left_out = 0;
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        if (lines == most_lines) {
            ++left_out;
        } else {
            if (lines++ > 0) shown += '\n';
            std::size_t length = std::min(end - at, longest_line);
            // Not in the middle of a character of UTF-8.
            while (length < end - at && length > 0 &&
                   (static_cast<unsigned char>(text[at + length]) & 0xc0) == 0x80)
                --length;
            shown += without_control(std::string_view(text).substr(at, length));
            if (length < end - at) shown += fmt::format(" … ({} bytes more)", end - at - length);
        }
        at = end + 1;
    }
    if (left_out > 0) shown += fmt::format("\n… and {} lines more", left_out);
    return shown;
}

std::string located(const TextPlace& place, const std::string& message) {
    std::string text = place.file;
    if (place.line > 0) text += ':' + std::to_string(place.line);
    if (place.line > 0 && place.column > 0) text += ':' + std::to_string(place.column);
    return text.empty() ? message : text + ": " + message;
}

std::string number_text(double number) {
    std::array<char, 64> buffer;
    const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number);
    return error == std::errc{} ? std::string(buffer.data(), end) : std::string("nan");
}

std::string rounded_text(double value, int digits) {
    constexpr double least = 1e-6;
    if (std::abs(value) < least) return "0";
    if (!std::isfinite(value)) return number_text(value);
    // Rounding first may add a digit: 9.96 becomes 10.
    const double rounded = std::stod(fmt::format("{:.{}e}", value, digits - 1));
    const int before = static_cast<int>(std::floor(std::log10(std::abs(rounded)) + 1e-9));
    return fmt::format("{:.{}f}", rounded, std::max(0, digits - 1 - before));
}

std::optional<double> parse_number(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    return parse_whole<double>(word);
}

std::optional<int> parse_integer(std::string_view word) {
    return parse_whole<int>(word);
}

std::string hash_text(std::uint64_t hash) {
    return fmt::format("{:016x}", hash);
}

std::optional<std::uint64_t> parse_hash(std::string_view word) {
    if (word.size() != 16) return std::nullopt;
    return parse_whole<std::uint64_t>(word, 16);
}

namespace {

/// The accepted words that are nearest to the one written, whatever its case, in their order.
std::vector<std::string_view> nearest_words(std::string_view written,
                                            std::span<const std::string_view> accepted) {
    // A vessel is named after the arteries along it, such as LM+LAD.
    for (const std::string_view word : accepted) {
        const std::string chain = "+" + std::string(word) + "+";
        if (!written.empty() && word != written &&
            chain.find("+" + std::string(written) + "+") != std::string::npos)
            return {word};
    }
    const std::string typed = lower_case(written);
    std::vector<std::string_view> best;
    std::size_t least = std::max<std::size_t>(2, written.size() / 3);
    for (const std::string_view word : accepted) {
        const std::string known = lower_case(word);
        const bool continues = typed.size() >= 3 && (known.starts_with(typed) || typed.starts_with(known));
        const std::size_t apart = edit_distance(typed, known);
        const std::size_t distance = continues ? std::min<std::size_t>(apart, 1) : apart;
        if (distance >= std::max(typed.size(), known.size())) continue;  // they have nothing in common
        if (distance < least) best.clear();
        if (distance <= least) least = distance, best.push_back(word);
    }
    return best;
}

}  // namespace

std::string nearest_word(std::string_view written, std::span<const std::string_view> accepted) {
    const std::vector<std::string_view> near = nearest_words(written, accepted);
    return near.empty() ? std::string() : std::string(near.front());
}

std::string suggestion(std::string_view written, std::span<const std::string_view> accepted) {
    std::vector<std::string_view> near = nearest_words(written, accepted);
    if (near.empty()) return {};
    if (near.size() > 2) near.resize(1);  // many are no help
    return " (did you mean '" + joined(near, "' or '") + "'?)";
}

std::vector<std::string_view> split(std::string_view text, char separator) {
    std::vector<std::string_view> parts;
    for (std::size_t end; (end = text.find(separator)) != std::string_view::npos;) {
        parts.push_back(text.substr(0, end));
        text.remove_prefix(end + 1);
    }
    parts.push_back(text);
    return parts;
}

std::vector<std::string_view> words_of(std::string_view text) {
    constexpr std::string_view blanks = " \t";
    std::vector<std::string_view> words;
    for (std::size_t end = 0, at; (at = text.find_first_not_of(blanks, end)) < text.size();) {
        end = std::min(text.find_first_of(blanks, at), text.size());
        words.push_back(text.substr(at, end - at));
    }
    return words;
}

std::string joined(std::span<const std::string_view> words, std::string_view separator) {
    return fmt::to_string(fmt::join(words, separator));
}
std::string joined(const std::vector<std::string>& words, std::string_view separator) {
    return fmt::to_string(fmt::join(words, separator));
}

std::string place_text(const geometry::Vec3& p) {
    return fmt::format("({:.2f}, {:.2f}, {:.2f})", p.x(), p.y(), p.z());
}

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

Shard parse_shard(std::string_view text) {
    const std::size_t slash = text.find('/');
    if (slash != std::string_view::npos) {
        const auto index = parse_integer(text.substr(0, slash)),
                   count = parse_integer(text.substr(slash + 1));
        if (index && count && *index >= 1 && *index <= *count && *count <= most_shards)
            return {*index, *count};
    }
    throw InputError("--shard: '{}' was found; expected i/n with 1 <= i <= n <= {}", text, most_shards);
}

}  // namespace io
