/// `seldinger play`.

#include <algorithm>
#include <functional>
#include <memory>
#include <string>

#include "app/command.h"
#include "engine/io/error.h"

#ifdef SELDINGER_WINDOW

#include "app/play/play.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/run/headless.h"
#include "engine/script/recording.h"
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
    throw io::InputError("--size {}: WIDTHxHEIGHT from 320x240 to 8192x8192 is accepted", words);
}

Exercise exercise_of(const std::filesystem::path& file) {
    Exercise exercise;
    exercise.file = file;
    exercise.scenario = load_exercise(file);
    const std::filesystem::path folder = assets(),
                                script = folder / "scripts" / (exercise.scenario.name + ".gw");
    exercise.picture = file.parent_path() / (exercise.scenario.name + ".png");
    std::error_code ignored;
    const bool ships = std::filesystem::equivalent(file.parent_path().empty() ? "." : file.parent_path(),
                                                   folder / "scenarios", ignored);
    if (ships && std::filesystem::exists(script)) exercise.solution = script::load_commands(script);
    return exercise;
}

/// In the user's folder, unless that cannot be written, which is told on the briefing's page.
void keep_by_itself(const std::string& learner, PlayOptions& options) {
    const std::filesystem::path folder = user_folder("XDG_DATA_HOME", ".local/share");
    try {
        if (folder.empty())
            throw io::InputError(
                "expected HOME or XDG_DATA_HOME to name a folder, found neither; --record names one");
        const room::Attempts attempts(folder / "recordings" / room::folder_of(learner) / "");
        attempts.require_writable();
        options.record = attempts;
    } catch (const io::InputError& error) {
        options.record_problem = error.what();
    }
}

/// The recording with the place of its exercise, which is the one named on the command line or in the file.
Replay replay_of(const std::filesystem::path& file, const std::string& named,
                 const std::function<std::size_t(const std::string&)>& place_of) {
    Replay replay;
    replay.recording = script::load_commands(file);
    const std::string recorded = replay.recording.origin ? replay.recording.origin->scenario : "";
    if (named.empty() && recorded.empty())
        throw io::InputError(
            "--replay {}: it does not say which scenario it is of; 'seldinger play SCENARIO --replay FILE' "
            "is accepted",
            file.string());
    const std::string name = std::filesystem::path(named).stem().string();
    if (!named.empty() && !recorded.empty() && recorded != name)
        throw io::InputError("--replay {}: it is a recording of '{}'; one of '{}' is accepted", file.string(),
                             recorded, name);
    replay.exercise = place_of(named.empty() ? recorded : named);
    return replay;
}

int play(const PlayArguments& arguments) {
    PlayOptions options;
    options.origin = origin(arguments.learner);
    std::tie(options.width, options.height) = size_of(arguments.size);
    options.keys = room::load_keys(assets() / "keys.toml");
    if (!arguments.keys.empty()) options.keys = room::load_keys(arguments.keys, options.keys);
    options.free_practice = arguments.free_practice;
    options.measure = arguments.measure;
    options.interrupted = stop_requested;
    if (const auto folder = user_folder("XDG_DATA_HOME", ".local/share"); !folder.empty())
        options.results = folder / "results.json";
    options.cache = usual_cache(arguments.cache);
    if (const auto folder = user_folder("XDG_CONFIG_HOME", ".config"); !folder.empty())
        options.settings = folder / "room";

    if (!arguments.record.empty()) {
        options.record = room::Attempts(arguments.record);
        options.record.require_writable();
    } else {
        keep_by_itself(arguments.learner, options);
    }
    if (!arguments.measure.empty()) io::require_writable(arguments.measure);

    const std::filesystem::path folder = assets() / "scenarios";
    for (const std::filesystem::path& file : scenario::shipped_scenarios(folder))
        options.exercises.push_back(exercise_of(file));
    // The easy ones first, as a trainee meets them; those of one level by name.
    std::stable_sort(options.exercises.begin(), options.exercises.end(),
                     [](const Exercise& a, const Exercise& b) {
                         return a.scenario.lesson.level < b.scenario.lesson.level;
                     });
    const auto place_of = [&](const std::string& name) {
        const std::filesystem::path file = scenario::find_scenario(name, folder);
        std::error_code ignored;
        for (std::size_t k = 0; k < options.exercises.size(); ++k)
            if (std::filesystem::equivalent(file, options.exercises[k].file, ignored)) return k;
        options.exercises.push_back(exercise_of(file));
        return options.exercises.size() - 1;
    };
    if (!arguments.replay.empty()) {
        for (const std::filesystem::path& file : script::recordings_of(arguments.replay))
            options.replays.push_back(replay_of(file, arguments.scenario, place_of));
        for (const Replay& replay : options.replays)
            run::check(options.exercises[replay.exercise].scenario, replay.recording);
    } else if (!arguments.scenario.empty()) {
        options.start = place_of(arguments.scenario);
    }
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
                        "Folder that keeps every attempt as a recording (.gw) of its own, or the file of the "
                        "first; else a folder of the user's for each learner");
    command->add_option("--learner", arguments->learner, "Whose recording it is: a name, for 'course'");
    command->add_option("--size", arguments->size, "Of the window, WIDTHxHEIGHT [pixels]");
    command->add_option("--keys", arguments->keys,
                        "File that replaces keys and speeds of assets/keys.toml (.toml)");
    command->add_option("--replay", arguments->replay,
                        "Recording that is played in place of your hands (.gw), or a folder of them");
    command->add_flag("--free", arguments->free_practice,
                      "Free practice: no score, and seconds can be taken back");
    add_cache_folder(command, arguments->cache);
    command->add_option("--measure", arguments->measure,
                        "File for the delays of image and interface, at the end (.json)");
    return {command, [arguments] { return play(*arguments); }};
}

}  // namespace app
