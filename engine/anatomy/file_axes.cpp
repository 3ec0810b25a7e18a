#include "engine/anatomy/file_axes.h"

#include <cctype>
#include <fmt/format.h>

#include "engine/io/error.h"
#include "engine/io/text.h"

namespace anatomy {

StatedAxes axes_named(std::string_view word, std::string where) {
    std::string axes = io::lower_case(word);
    if (axes == "left-posterior-superior") axes = "lps";
    if (axes == "right-anterior-superior") axes = "ras";
    return {std::move(axes), std::move(where)};
}

std::optional<StatedAxes> axes_in_line(std::string_view line, std::string_view place) {
    const auto in_word = [](char c) {
        return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-';
    };
    const std::string small = io::lower_case(line);
    constexpr std::string_view key = "space=";
    for (std::size_t at = 0; (at = small.find(key, at)) != std::string::npos; at += key.size()) {
        if (at > 0 && in_word(small[at - 1])) continue;
        std::size_t end = at + key.size();
        while (end < line.size() && in_word(line[end])) ++end;
        const std::string_view word = line.substr(at + key.size(), end - at - key.size()).substr(0, 40);
        return axes_named(word, fmt::format("{} says SPACE={}", place, word));
    }
    return std::nullopt;
}

TakenAxes taken_axes(const std::string& file, const std::optional<StatedAxes>& stated,
                     const std::string& given, const std::string& asked, const std::string& otherwise) {
    for (const std::string& axes : {given, otherwise})
        if (!axes.empty() && axes != "lps" && axes != "ras")
            throw io::InputError("{}: expected lps or ras", asked);
    if (!stated) {
        if (!given.empty()) return {given, asked, true};
        return {otherwise, "the file does not say", false};
    }
    if (stated->axes != "lps" && stated->axes != "ras") {
        if (!given.empty()) return {given, fmt::format("{}, though {}", asked, stated->where), true};
        throw io::InputError("{}: {}; expected LPS or RAS, or the axes to take it in (axes lps or ras)", file,
                             stated->where);
    }
    if (!given.empty() && given != stated->axes)
        throw io::InputError(
            "{}: {}, and {} was given; expected no axes beside those that a file states: leave them out, and "
            "turn a file that is wrong about itself by 180° about z",
            file, stated->where, asked);
    return {stated->axes, stated->where, true};
}

}  // namespace anatomy
