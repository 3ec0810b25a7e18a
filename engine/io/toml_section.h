#pragma once
/// Tables of TOML files written by people: values are checked one by one, and all errors collected with their
/// lines.

#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/io/error.h"
#include "physics/geometry/vec.h"

namespace toml {
inline namespace v3 {
class node;
class table;
struct source_region;
}  // namespace v3
}  // namespace toml

namespace io {

struct Range {
    double least, most;
    std::string text() const;
};

/// What the reading has found so far: where each key stands, and all errors.
struct ParseContext {
    std::string file;
    std::map<std::string, TextPlace> places;
    std::vector<std::pair<TextPlace, std::string>> wrong;
    std::vector<std::filesystem::path> files = {};  // others that were read for it

    TextPlace place(const toml::source_region&) const;
    void refuse(const toml::source_region&, const std::string& text);
    /// The text of the file. Throws InputError for what is not TOML, or is nested too deep: see
    /// check_toml_depth.
    toml::table parse(std::string_view text) const;
    /// Throws InputError with what has been found wrong, one problem a line in the order of the file, if
    /// anything.
    void end();
};

/// A table being read. Each query also records its key as known, so that finish() can list the unknown keys.
/// A query whose value is unusable records that in the reading and leaves the variable unchanged.
class Section {
public:
    /// `table` may be null: then no key is given.
    Section(ParseContext&, const toml::table*, std::string name);

    bool given() const { return table_ != nullptr; }
    /// Where it begins.
    TextPlace place() const;
    const toml::node* find(std::string_view key);
    void refuse(std::string_view key, const toml::node&, const std::string& accepted);

    void number(std::string_view key, double& value, Range, double unit = 1.0);
    void number(std::string_view key, std::optional<double>& value, Range range, double unit = 1.0) {
        double read = std::numeric_limits<double>::quiet_NaN();
        number(key, read, range, unit);
        if (!std::isnan(read)) value = read;
    }
    template <class Integer>
    void whole(std::string_view key, Integer& value, Range range) {
        if (const std::optional<long long> read = whole_number(key, range))
            value = static_cast<Integer>(*read);
    }
    void flag(std::string_view key, bool& value);
    bool word(std::string_view key, std::string& value);
    bool is_word(std::string_view key);
    /// The index of the value among the accepted words.
    std::optional<std::size_t> choice(std::string_view key, std::span<const std::string_view> accepted);
    bool point(std::string_view key, geometry::Vec3& value, double most);
    Section section(std::string_view key, bool required);
    /// The tables of a list [[key]]; empty when it is absent.
    std::vector<Section> sections(std::string_view key);
    void missing(std::string_view key, const std::string& what);
    void refuse_whole(const std::string& text);
    /// Every file has schema = 1.
    void schema();
    void finish() const;

private:
    std::optional<long long> whole_number(std::string_view key, Range);
    ParseContext& reading_;
    const toml::table* table_;
    std::string name_;
    std::vector<std::string_view> keys_;
};

}  // namespace io
