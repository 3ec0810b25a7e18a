/// `seldinger play`.

#include <fmt/format.h>
#include <memory>
#include <string>

#include "app/command.h"
#include "engine/io/error.h"

#ifdef SELDINGER_WINDOW

#include "app/play/play.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/run/headless.h"
#endif

namespace app {
namespace {

struct PlayArguments {
    std::string scenario, record, size = "1280x800", keys, replay, cache, measure, learner;
    bool free_practice = false;
};

#ifdef SELDINGER_WINDOW

std::pair<int, int> size_of(const std::string& words) {
    const std::size_t times = words.find('x');
    if (times != std::string::npos) {
        const auto width = io::parse_integer(words.substr(0, times)),
                   height = io::parse_integer(words.substr(times + 1));
        if (width && height && *width >= 320 && *width <= 8192 && *height >= 240 && *height <= 8192)
            return {*width, *height};
    }
    throw io::InputError(fmt::format("--size {}: WIDTHxHEIGHT from 320x240 to 8192x8192 is accepted", words));
}

Exercise exercise_of(const std::filesystem::path& file) {
    Exercise exercise;
    exercise.scenario = scenario::load_scenario(file, assets() / "devices");
    const std::filesystem::path folder = assets(),
                                script = folder / "scripts" / (exercise.scenario.name + ".gw");
    exercise.picture = file.parent_path() / (exercise.scenario.name + ".png");
    std::error_code ignored;
    const bool ships = std::filesystem::equivalent(file.parent_path().empty() ? "." : file.parent_path(),
                                                   folder / "scenarios", ignored);
    if (ships && std::filesystem::exists(script)) exercise.solution = script::load_commands(script);
    return exercise;
}

int play(const PlayArguments& arguments) {
    PlayOptions options;
    options.origin = origin(arguments.learner);
    std::tie(options.width, options.height) = size_of(arguments.size);
    options.keys = room::load_keys(assets() / "keys.toml");
    if (!arguments.keys.empty()) options.keys = room::load_keys(arguments.keys, options.keys);
    options.free_practice = arguments.free_practice;
    options.record = arguments.record;
    options.measure = arguments.measure;
    options.interrupted = stop_requested;
    if (const auto folder = user_folder("XDG_DATA_HOME", ".local/share"); !folder.empty())
        options.results = folder / "results.json";
    options.cache = usual_cache(arguments.cache);
    if (const auto folder = user_folder("XDG_CONFIG_HOME", ".config"); !folder.empty())
        options.settings = folder / "room";

    std::string wanted = arguments.scenario;
    if (!arguments.replay.empty()) {
        options.replay = script::load_commands(arguments.replay);
        const std::string recorded = options.replay->origin ? options.replay->origin->scenario : "";
        if (wanted.empty()) wanted = recorded;
        if (wanted.empty())
            throw io::InputError(
                fmt::format("--replay {}: it does not say which scenario it is of; 'seldinger play "
                            "SCENARIO --replay FILE' is accepted",
                            arguments.replay));
        const std::string name = std::filesystem::path(wanted).stem().string();
        if (!recorded.empty() && recorded != name)
            throw io::InputError(
                fmt::format("--replay {}: it is a recording of '{}'; one of '{}' is accepted",
                            arguments.replay, recorded, name));
    }
    if (wanted.empty() && !arguments.record.empty())
        throw io::InputError(
            "--record: which exercise is recorded? 'seldinger play SCENARIO --record FILE' is accepted");

    const std::filesystem::path folder = assets() / "scenarios";
    for (const std::filesystem::path& file : scenario::shipped_scenarios(folder))
        options.exercises.push_back(exercise_of(file));
    if (!wanted.empty()) {
        const std::filesystem::path file = scenario::find_scenario(wanted, folder);
        std::error_code ignored;
        for (std::size_t k = 0; k < options.exercises.size(); ++k)
            if (std::filesystem::equivalent(file, folder / (options.exercises[k].scenario.name + ".toml"),
                                            ignored))
                options.start = k;
        if (!options.start) {
            options.start = options.exercises.size();
            options.exercises.push_back(exercise_of(file));
        }
    }

    if (options.replay) run::check(options.exercises[*options.start].scenario, *options.replay);
    for (const std::string& file : {arguments.record, arguments.measure})
        if (!file.empty()) io::require_writable(file);
    Window window(options.width, options.height, "Seldinger");
    const bool differed = Play(window, std::move(options)).run();
    return stop_requested() ? interrupted : differed ? differs : done;
}

#else

int play(const PlayArguments&) {
    throw io::InputError(
        "this program was built without a window, as GLFW was not found: install libglfw3-dev and build "
        "again; 'seldinger run' needs none");
}

#endif

}  // namespace

Command add_play(CLI::App& parser) {
    const auto arguments = std::make_shared<PlayArguments>();
    CLI::App* command =
        parser.add_subcommand("play", "The room: wire, pedals and C-arm under your hands, in a window");
    command->add_option("scenario", arguments->scenario,
                        "A scenario file (.toml), or the name of one that ships; else there is a choice");
    command->add_option("--record", arguments->record,
                        "File that the commands are recorded to, as 'run' reads them (.gw)");
    command->add_option("--learner", arguments->learner, "Whose recording it is: a name, for 'course'");
    command->add_option("--size", arguments->size, "Of the window, WIDTHxHEIGHT [pixels]");
    command->add_option("--keys", arguments->keys,
                        "File that replaces keys and speeds of assets/keys.toml (.toml)");
    command->add_option("--replay", arguments->replay,
                        "Recording that is played in place of your hands (.gw)");
    command->add_flag("--free", arguments->free_practice,
                      "Free practice: no score, and seconds can be taken back");
    command->add_option("--cache", arguments->cache,
                        "Folder that keeps grown vessels and distance fields; else the user's");
    command->add_option("--measure", arguments->measure,
                        "File for the delays of image and interface, at the end (.json)");
    return {command, [arguments] { return play(*arguments); }};
}

}  // namespace app
