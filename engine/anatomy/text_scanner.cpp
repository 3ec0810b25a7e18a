#include "engine/anatomy/text_scanner.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/io/error.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

bool is_space(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/// Short enough for a message, and without bytes that a terminal cannot show.
std::string shown(std::string_view word) {
    std::string text(word.substr(0, 40));
    for (char& c : text)
        if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) > 0x7e) c = '?';
    return word.size() > 40 ? text + "..." : text;
}

/// Writers of numbers may put a plus sign in front, which std::from_chars does not take.
std::string_view without_plus(std::string_view word) {
    return word.size() > 1 && word[0] == '+' && word[1] != '-' ? word.substr(1) : word;
}

}  // namespace

bool same_word(std::string_view a, std::string_view b) {
    return a.size() == b.size() && io::lower_case(a) == io::lower_case(b);
}

std::string extension_of(const std::filesystem::path& path) {
    return io::lower_case(path.extension().string());
}

void TextScanner::skip_space() {
    while (at_ < text_.size()) {
        if (is_space(text_[at_]))
            ++at_;
        else if (comments && text_[at_] == '#')
            rest_of_line();
        else
            return;
    }
}

std::string_view TextScanner::word() {
    skip_space();
    last_ = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    return text_.substr(last_, at_ - last_);
}

std::string_view TextScanner::rest_of_line() {
    const std::size_t from = at_;
    at_ = std::min(text_.find('\n', at_), text_.size());
    std::string_view line = text_.substr(from, at_ - from);
    if (at_ < text_.size()) ++at_;
    while (!line.empty() && is_space(line.back())) line.remove_suffix(1);
    while (!line.empty() && is_space(line.front())) line.remove_prefix(1);
    return line;
}

bool TextScanner::take(std::string_view expected) {
    const std::size_t before = at_, last = last_;
    if (same_word(word(), expected)) return true;
    at_ = before;
    last_ = last;
    return false;
}

double TextScanner::number(std::string_view what) {
    const auto value = io::parse_number(without_plus(word()));
    if (!value || !std::isfinite(*value)) refuse(fmt::format("a finite number, {},", what));
    return *value;
}

std::int64_t TextScanner::whole(std::string_view what, std::int64_t least, std::int64_t most) {
    const auto value = io::parse_number(without_plus(word()));
    if (!value || *value != std::floor(*value) || *value < static_cast<double>(least) ||
        *value > static_cast<double>(most))
        refuse(fmt::format("{}, a whole number from {} to {},", what, least, most));
    return static_cast<std::int64_t>(*value);
}

std::string_view TextScanner::bytes(std::string_view what, std::size_t count) {
    last_ = at_;
    if (count > left())
        refuse_found(fmt::format("the end of the file {} bytes into {}, which has {},", left(), what, count),
                     "a whole file");
    at_ += count;
    return text_.substr(last_, count);
}

bool TextScanner::at_end() {
    skip_space();
    return at_ == text_.size();
}

void TextScanner::refuse(std::string_view expected) const {
    const std::string_view word = text_.substr(last_, at_ - last_);
    refuse_found(word.empty() ? "the end of the file" : fmt::format("'{}'", shown(word)), expected);
}

void TextScanner::refuse_found(const std::string& found, std::string_view expected) const {
    const auto lines = std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(last_), '\n');
    throw io::InputError(io::located({file_, 1 + static_cast<int>(lines), 0},
                                     fmt::format("{} was found; expected {}", found, expected)));
}

}  // namespace anatomy
