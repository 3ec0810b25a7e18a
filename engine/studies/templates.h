#pragma once
/// Scripts of gnuplot and pages, kept as files in templates/ and built into the program.

#include <concepts>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/studies/study.h"

namespace studies {

struct TemplateValue;
using TemplateValues = std::vector<std::pair<std::string_view, TemplateValue>>;
using TemplateRows = std::vector<TemplateValues>;

/// A number, a text, or rows of values that a part of the text is repeated for.
struct TemplateValue {
    template <std::integral T>
    TemplateValue(T number) : value(static_cast<long long>(number)) {}
    TemplateValue(char letter) : value(std::string(1, letter)) {}
    TemplateValue(double number) : value(number) {}
    TemplateValue(std::string text) : value(std::move(text)) {}
    TemplateValue(std::string_view text) : value(std::string(text)) {}
    TemplateValue(const char* text) : value(std::string(text)) {}
    TemplateValue(TemplateRows list) : rows(std::move(list)) {}

    std::variant<std::monostate, long long, double, std::string> value;  // nothing in place of rows
    TemplateRows rows;
};

/// The text with every @name@ or @name:format@ replaced by its value; the format is fmt's. What stands
/// between @for name@ and @end@ is repeated for each row of that value, whose own values come before all
/// others: parts that end in a line break one after another, other parts as the curves of a plot command.
/// Throws std::logic_error for a placeholder without a value, and for a value, be it one of a row, without
/// a placeholder.
std::string fill(std::string_view text, const TemplateValues&);

/// The same of the file templates/NAME.md without its last line break. A line that ends in a backslash goes
/// on in the next.
std::string filled_text(std::string_view name, const TemplateValues&);

/// Of templates/NAME.gp: first the caption, as a comment, then gnuplot's commands.
io::Plot filled_plot(const std::string& name, int width, int height, const TemplateValues&);

/// The page of templates/ID.md, an introduction under its title, with the plots and claims of the result.
std::string filled_page(std::string_view id, const TemplateValues&, const StudyResult&, const StudyOptions&);

/// The rows that `of` makes of 0 … count − 1.
template <class Of>
TemplateRows rows_of(std::size_t count, const Of& of) {
    TemplateRows rows;
    for (std::size_t k = 0; k < count; ++k) rows.push_back(of(k));
    return rows;
}

}  // namespace studies
