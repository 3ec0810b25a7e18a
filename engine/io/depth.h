#pragma once
/// How deep texts that people and programs write may be nested: what reads them calls itself level by level.

#include <string>
#include <string_view>

namespace io {

inline constexpr int deepest_nesting = 64;

/// Throws InputError "FILE:LINE: …" for JSON with brackets nested deeper.
void check_json_depth(std::string_view text, const std::string& file);
/// The same for TOML; a dotted key counts a level for each of its dots.
void check_toml_depth(std::string_view text, const std::string& file);

}  // namespace io
