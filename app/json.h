#pragma once
/// JSON for programs, of commands with --json; docs/json.md has the fields.

#include <nlohmann/json.hpp>
#include <optional>

#include "app/command.h"

namespace app {

using Json = nlohmann::ordered_json;

/// Prints the document, the same bytes for the same values. Names are whatever was typed: what is not UTF-8
/// is replaced, and nothing but ASCII reaches the terminal.
inline void print_json(const Json& document) {
    write_out(document.dump(2, ' ', true, Json::error_handler_t::replace) + "\n");
}

inline Json or_null(const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
}

/// Adds --json.
inline void add_json(CLI::App* command, bool& json) {
    command->add_flag("--json", json, "JSON for programs, to standard output (docs/json.md)");
}

}  // namespace app
