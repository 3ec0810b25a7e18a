/// `seldinger serve`: an exercise for a program in any language, by lines.

#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/episode/frame_line.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "render/picture/png.h"

namespace app {
namespace {

struct ServeArguments {
    std::string scenario, cache;
    std::vector<std::string> set;
};

/// What a line asks for besides a command of scripts; empty where it is none of these.
std::string answer(episode::Episode& episode, const std::string& line,
                   std::vector<episode::Episode::Snapshot>& kept) {
    const auto word = line.substr(0, line.find(' '));
    const std::string rest = word.size() < line.size() ? line.substr(word.size() + 1) : std::string();
    const auto file = [&] {
        if (rest.empty())
            throw io::InputError(fmt::format("'{}': the name of a file is accepted after it", word));
        return std::filesystem::path(rest);
    };
    if (word == "step") {
        episode.step({});
        return episode::to_json(episode);
    }
    if (word == "state") return episode::to_json(episode);
    if (word == "restart") {
        episode.reset();
        return episode::to_json(episode);
    }
    if (word == "keep") {
        kept.push_back(episode.snapshot());
        return fmt::format("{{\"kept\":{}}}", kept.size() - 1);
    }
    if (word == "back") {
        const std::optional<int> number = io::parse_integer(rest);
        if (!number || *number < 0 || *number >= static_cast<int>(kept.size()))
            throw io::InputError(fmt::format(
                "'{}': the number of a state that was kept, below {}, is accepted", line, kept.size()));
        episode.restore(kept[static_cast<std::size_t>(*number)]);
        return episode::to_json(episode);
    }
    if (word == "image") {
        const std::size_t space = rest.find(' ');
        const std::optional<int> pixels = io::parse_integer(rest.substr(0, space));
        if (!pixels || space == std::string::npos)
            throw io::InputError(fmt::format("'{}': 'image PIXELS FILE.png' is accepted", line));
        const auto png = render::encode_png(episode.image(*pixels, episode::ImageMode::Live));
        io::write_whole(rest.substr(space + 1), {reinterpret_cast<const char*>(png.data()), png.size()});
        return fmt::format("{{\"image\":{}}}", episode::quoted(rest.substr(space + 1)));
    }
    if (word == "save") {
        episode.save(file(), origin());
        return fmt::format("{{\"saved\":{}}}", episode::quoted(rest));
    }
    if (word == "score") return episode::score_line(episode, program);
    return {};
}

int serve(const ServeArguments& arguments) {
    anatomy::ModelCache cache;
    cache.folder = usual_cache(arguments.cache);
    std::unique_ptr<episode::Episode> episode;
    {
        ProgressBar bar;
        report_on(bar, cache);
        episode = std::make_unique<episode::Episode>(
            scenario::load_scenario(scenario::find_scenario(arguments.scenario, assets() / "scenarios"),
                                    assets() / "devices", overrides_of(arguments.set)),
            exercise::Pictures::None, cache);
    }
    std::vector<episode::Episode::Snapshot> kept;
    const auto say = [](const std::string& line) {
        fmt::print("{}\n", line);
        std::fflush(stdout);
    };
    say(episode::to_json(*episode));
    for (std::string line; !stop_requested() && std::getline(std::cin, line);) {
        if (stop_requested()) break;  // the line may be cut
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (line == "quit") break;
        if (line.empty() || line.front() == '#') continue;
        try {
            std::string said = answer(*episode, line, kept);
            // A command of scripts waits for the step.
            if (said.empty()) {
                episode->ask(episode::parse_line(line));
                continue;
            }
            say(said);
        } catch (const io::InputError& error) {
            say(fmt::format("{{\"error\":{}}}", episode::quoted(error.what())));
        }
    }
    return stop_requested() ? interrupted : done;
}

}  // namespace

Command add_serve(CLI::App& parser) {
    const auto arguments = std::make_shared<ServeArguments>();
    CLI::App* command = parser.add_subcommand(
        "serve",
        "An exercise for a program in any language: commands on standard input, states as JSON lines");
    command
        ->add_option("scenario", arguments->scenario,
                     "A scenario file (.toml), or the name of one that ships")
        ->required();
    command->add_option("--set", arguments->set, "KEY=VALUE in place of the scenario's; again for more");
    command->add_option("--cache", arguments->cache,
                        "Folder that keeps grown vessels and distance fields; else the user's own");
    command->footer(
        "Lines:\n"
        "  advance 2 mm, rotate 30 deg, ...   a command of scripts; it waits for the step and is not "
        "answered\n"
        "  step                               makes a frame with the commands since the last one\n"
        "  state, restart                     the state as it is; the start again, bit for bit\n"
        "  keep, back NUMBER                  keeps the state and says its number; goes back to it\n"
        "  image PIXELS FILE.png, save FILE.gw, score, quit\n"
        "Each but a command of scripts is answered by one line of JSON: the state after it (lengths in mm, "
        "forces\n"
        "in N; null where there is no way to the target), or {\"error\": why}, and then nothing was "
        "changed.\n"
        "The first line is the state before any step.\n"
        "Exit codes: 0 end of input or quit, 2 bad scenario, 130 interrupted.");
    return {command, [arguments] { return serve(*arguments); }};
}

}  // namespace app
