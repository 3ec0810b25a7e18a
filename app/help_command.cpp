/// `seldinger help` and `seldinger version`.

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "app/command.h"

namespace app {
namespace {

const char* const script_help =
    "Scripts (.gw) are lines of 'FRAME verb arguments', as in\n"
    "\n"
    "  0 beam on\n"
    "  4..60 advance 2 mm                      in each of these frames\n"
    "  9 rotate 30 deg                         80 withdraw 10 mm\n"
    "  120 end                                 # a comment\n"
    "\n"
    "Devices:\n"
    "  advance catheter 5 mm                   rotate all 20 deg\n"
    "  remove wire                             exchange wire rosen035\n"
    "Image:\n"
    "  arm lao 30 deg cranial 10 deg           table 0 0 -40 mm\n"
    "  collimate 120 90 mm                     pulse 7.5 per second\n"
    "  mode dsa (live, roadmap)                mask, reference\n"
    "Contrast:\n"
    "  inject 12 ml at 6 ml/s into aorta of 320 mg/ml\n"
    "  inject 6 ml at 3 ml/s through catheter  contrast 12 mg/ml\n"
    "Training:\n"
    "  reset                                   the attempt begins again\n"
    "  complication spasm of LRA at 10 mm over 20 mm by 60 percent\n"
    "  relieve all\n"
    "Recordings also state what came of it, for 'seldinger replay':\n"
    "  state 60 0123456789abcdef\n"
    "\n"
    "docs/script.md has all verbs with their ranges.\n";

/// The help of a command, or a topic.
int help(const CLI::App& root, const std::vector<std::string>& words) {
    if (words == std::vector<std::string>{"script"}) {
        print("{}", script_help);
        return done;
    }
    const CLI::App* at = &root;
    for (const std::string& word : words) {
        const auto below = at->get_subcommands([](const CLI::App*) { return true; });
        const auto found = std::ranges::find(below, word, &CLI::App::get_name);
        if (found == below.end()) {
            std::vector<std::string> known;
            for (const CLI::App* one : below) known.push_back(one->get_name());
            if (at == &root) known.emplace_back("script");
            throw BadArgument("'{}' is not a command{}{}", word,
                              io::suggestion(word, std::vector<std::string_view>(known.begin(), known.end())),
                              known.empty() ? "" : "; there is help for: " + io::joined(known));
        }
        at = *found;
    }
    print("{}", at->get_formatter()->make_help(at, "", CLI::AppFormatMode::Normal));
    return done;
}

}  // namespace

Command add_help(CLI::App& parser) {
    const auto words = std::make_shared<std::vector<std::string>>();
    CLI::App* command = parser.add_subcommand("help",
                                              "Help on a command, or on scripts\n\n"
                                              "Examples:\n"
                                              "  seldinger help run\n"
                                              "  seldinger help script");
    command->add_option("topic", *words, "A command, such as 'anatomy import', or 'script'")
        ->type_name("COMMAND");
    return {command, [&parser, words] { return help(parser, *words); }};
}

Command add_version(CLI::App& parser) {
    CLI::App* command = parser.add_subcommand("version",
                                              "The program's version\n\n"
                                              "Example:\n"
                                              "  seldinger version");
    return {command, [] {
                print("{}\n", program);
                return done;
            }};
}

}  // namespace app
