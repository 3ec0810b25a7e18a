#pragma once
/// The arguments of a command line: what options take, and the one place that refuses what is wrong with
/// them.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/error.h"

namespace app {

/// An argument that a command refuses after they have been read. "seldinger COMMAND: " and where its help is
/// are put around the text.
class BadArgument : public io::InputError {
public:
    using InputError::InputError;
};

/// What options accept. The help says the range or the words.
CLI::Validator whole_number(std::int64_t least, std::int64_t most);
CLI::Validator number(double least = -std::numeric_limits<double>::infinity(),
                      double most = std::numeric_limits<double>::infinity());
CLI::Validator one_of(const std::vector<std::string>& words);
/// A text that `good` accepts; `expected` says what that is.
CLI::Validator text_that(const std::function<bool(const std::string&)>& good, const std::string& expected);
/// KEY=VALUE of a scenario, and FILE.png.
CLI::Validator key_and_value();
CLI::Validator picture_name();
/// "i/n", of --shard.
CLI::Validator shard();

/// An option that is empty unless given.
template <class Value>
CLI::Option* add_optional(CLI::App* parser, const char* name, std::optional<Value>& value, const char* help) {
    return parser->add_option_function<Value>(
        name, [&value](const Value& given) { value = given; }, help);
}

/// Reads the arguments. Returns the exit code where nothing is left to do: help or version was printed, or
/// what is wrong was told: unknown words before values that are not accepted, and these before missing ones.
std::optional<int> parse(CLI::App&, int count, char** values);
/// The words of the command line, without the program's own name.
const std::vector<std::string>& given_words();
/// "seldinger run: TEXT ('seldinger run --help')", of the command that was given.
std::string refusal(const CLI::App&, const std::string& text);

/// The command and those below it: "seldinger anatomy import".
std::string path_of(const CLI::App&);
/// The first line of its description.
std::string summary_of(const CLI::App&);
/// What it takes, such as "FILE"; empty for a flag.
std::string kind_of(const CLI::Option&);
/// The words that it accepts, if it is held to some.
std::vector<std::string> words_of(const CLI::Option&);

}  // namespace app
