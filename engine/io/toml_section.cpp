#include "engine/io/toml_section.h"

#include <algorithm>
#include <fmt/format.h>
#include <limits>
#include <sstream>
#include <toml++/toml.h>

#include "engine/io/text.h"

namespace io {
namespace {

using geometry::Vec3;

std::string shown(const toml::node& node) {
    std::ostringstream text;
    node.visit([&text](const auto& value) { text << value; });
    std::string line = text.str();
    std::replace(line.begin(), line.end(), '\n', ' ');
    return line.size() > 60 ? line.substr(0, 57) + "..." : line;
}

}  // namespace

std::string Range::text() const {
    return fmt::format("{} to {}", least, most);
}

TextPlace ParseContext::place(const toml::source_region& region) const {
    // A value that was put in place of the file's own has no line in the file.
    if (region.path && *region.path != file) return {*region.path, 0, 0};
    return {file, static_cast<int>(region.begin.line), static_cast<int>(region.begin.column)};
}

void ParseContext::refuse(const toml::source_region& region, const std::string& text) {
    wrong.emplace_back(place(region), text);
}

toml::table ParseContext::parse(std::string_view text) const {
    check_toml_depth(text, file);
    try {
        return toml::parse(text, file);
    } catch (const toml::parse_error& error) {
        throw InputError(
            located(place(error.source()), fmt::format("this is not TOML: {}", error.description())));
    }
}

void ParseContext::end() {
    if (wrong.empty()) return;
    std::ranges::stable_sort(wrong, [](const auto& a, const auto& b) {
        return std::pair(a.first.line, a.first.column) < std::pair(b.first.line, b.first.column);
    });
    std::vector<std::string> lines;
    for (const auto& [place, message] : wrong) lines.push_back(located(place, message));
    throw InputError(joined(lines, "\n"));
}

Section::Section(ParseContext& reading, const toml::table* table, std::string name)
    : reading_(reading), table_(table), name_(std::move(name)) {
    if (table_) reading_.places[name_] = reading_.place(table_->source());
}

void Section::schema() {
    constexpr int known = 1;
    const toml::node* node = find("schema");
    if (!node) return missing("schema", "schema = 1");
    const auto* read = node->as_integer();
    if (read && read->get() > known)
        return reading_.refuse(
            node->source(),
            fmt::format("schema {} is of a later version; this program reads {}", read->get(), known));
    int schema = 0;
    whole("schema", schema, {known, known});
}

const toml::node* Section::find(std::string_view key) {
    if (std::ranges::find(keys_, key) == keys_.end()) keys_.push_back(key);
    const toml::node* node = table_ ? table_->get(key) : nullptr;
    if (node)
        reading_.places[(name_.empty() ? "" : name_ + ".") + std::string(key)] =
            reading_.place(node->source());
    return node;
}

void Section::refuse(std::string_view key, const toml::node& node, const std::string& accepted) {
    // A value that was put in place of the file's own is its own place.
    const bool of_file = reading_.place(node.source()).file == reading_.file;
    reading_.refuse(node.source(),
                    of_file ? fmt::format("{}{} = {} was found; {}", name_.empty() ? "" : "[" + name_ + "] ",
                                          key, shown(node), accepted)
                            : accepted);
}

void Section::number(std::string_view key, double& value, Range range, double unit) {
    const toml::node* node = find(key);
    if (!node) return;
    const std::optional<double> read = node->is_number() ? node->value<double>() : std::nullopt;
    if (read && *read >= range.least && *read <= range.most)
        value = *read * unit;
    else
        refuse(key, *node, fmt::format("expected a number from {}", range.text()));
}

std::optional<long long> Section::whole_number(std::string_view key, Range range) {
    const toml::node* node = find(key);
    if (!node) return std::nullopt;
    const auto* read = node->as_integer();
    if (read && read->get() >= range.least && read->get() <= range.most) return read->get();
    refuse(key, *node, fmt::format("expected a whole number from {}", range.text()));
    return std::nullopt;
}

void Section::flag(std::string_view key, bool& value) {
    const toml::node* node = find(key);
    if (!node) return;
    if (const auto* read = node->as_boolean())
        value = read->get();
    else
        refuse(key, *node, "expected true or false");
}

bool Section::word(std::string_view key, std::string& value) {
    const toml::node* node = find(key);
    if (!node) return false;
    if (const auto* read = node->as_string(); read && !read->get().empty())
        value = read->get();
    else
        refuse(key, *node, "expected a text");
    return node->is_string();
}

bool Section::is_word(std::string_view key) {
    const toml::node* node = find(key);
    return node && node->is_string();
}

std::optional<std::size_t> Section::choice(std::string_view key, std::span<const std::string_view> accepted) {
    const toml::node* node = find(key);
    if (!node) return std::nullopt;
    if (const auto* read = node->as_string()) {
        const auto at = std::ranges::find(accepted, read->get());
        if (at != accepted.end()) return static_cast<std::size_t>(at - accepted.begin());
    }
    refuse(key, *node, "expected " + joined(accepted));
    return std::nullopt;
}

bool Section::point(std::string_view key, Vec3& value, double most) {
    const toml::node* node = find(key);
    if (!node) return false;
    const toml::array* list = node->as_array();
    Vec3 read = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; list && list->size() == 3 && i < 3; ++i) {
        if ((*list)[i].is_number()) read[static_cast<int>(i)] = *(*list)[i].value<double>();
    }
    const bool fine = read.allFinite() && read.cwiseAbs().maxCoeff() <= most;
    if (fine)
        value = read;
    else
        refuse(key, *node, fmt::format("expected three numbers from {} to {}", -most, most));
    return fine;
}

Section Section::section(std::string_view key, bool required) {
    const toml::node* node = find(key);
    std::string name = name_.empty() ? std::string(key) : fmt::format("{}.{}", name_, key);
    if (node && !node->is_table()) refuse(key, *node, fmt::format("expected a section [{}]", name));
    if (!node && required) missing(key, fmt::format("section [{}]", name));
    return Section(reading_, node ? node->as_table() : nullptr, std::move(name));
}

void Section::missing(std::string_view, const std::string& what) {
    refuse_whole(what + " is missing");
}

TextPlace Section::place() const {
    return table_ && !name_.empty() ? reading_.place(table_->source()) : TextPlace{reading_.file, 0, 0};
}

void Section::refuse_whole(const std::string& text) {
    reading_.wrong.emplace_back(place(), text);
}

void Section::finish() const {
    if (!table_) return;
    for (const auto& [key, node] : *table_) {
        if (std::ranges::find(keys_, key.str()) != keys_.end()) continue;
        reading_.refuse(key.source(), fmt::format("unknown key '{}' {}{}; keys are: {}", key.str(),
                                                  name_.empty() ? "at the top" : "in [" + name_ + "]",
                                                  suggestion(key.str(), keys_), joined(keys_)));
    }
}

std::vector<Section> Section::sections(std::string_view key) {
    std::vector<Section> result;
    const toml::node* node = find(key);
    if (!node) return result;
    const toml::array* list = node->as_array();
    if (!list) refuse(key, *node, fmt::format("expected sections [[{}]]", key));
    for (std::size_t i = 0; list && i < list->size(); ++i) {
        if (const toml::table* table = (*list)[i].as_table())
            result.emplace_back(reading_, table, fmt::format("{} {}", key, i + 1));
        else
            refuse(key, (*list)[i], fmt::format("expected a section [[{}]]", key));
    }
    return result;
}

}  // namespace io
