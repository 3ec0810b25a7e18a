#pragma once
/// What every sub-command of the command line shares.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <optional>

namespace app {

/// The first of them is 0 as any program's; 1 says that the target was not reached.
enum ExitCode { done = 0, not_reached = 1, bad_input = 2, differs = 3, interrupted = 130 };

/// A sub-command and what is to be done where it was given. The action returns the exit code; it may throw
/// any std::exception, whose text is for the user.
struct Command {
    CLI::App* parser;
    std::function<int()> action;
};

Command add_run(CLI::App&);
Command add_play(CLI::App&);
Command add_relax(CLI::App&);
Command add_render(CLI::App&);
Command add_study(CLI::App&);
Command add_anatomy(CLI::App&);
Command add_list(CLI::App&);

/// "seldinger 0.1.0".
extern const char* const program;

/// Of this program's file, links resolved.
std::filesystem::path program_folder();
/// What ships with the program: scenarios and scripts. Beside the program's own folder, in
/// ../share/seldinger; or in the folder SELDINGER_ASSETS of the environment. Throws io::InputError where
/// there is none.
std::filesystem::path assets();

/// An option that is empty unless given.
template <class Value>
CLI::Option* add_optional(CLI::App* parser, const char* name, std::optional<Value>& value, const char* help) {
    return parser->add_option_function<Value>(
        name, [&value](const Value& given) { value = given; }, help);
}

}  // namespace app
