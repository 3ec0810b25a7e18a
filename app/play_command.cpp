/// `seldinger play`.

#include <algorithm>
#include <memory>
#include <string>

#include "app/command.h"
#include "app/signature.h"
#include "engine/io/error.h"
#include "engine/io/text.h"

#ifdef SELDINGER_WINDOW

#include <array>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "app/play/play.h"
#include "engine/debrief/page.h"
#include "engine/debrief/story.h"
#include "engine/io/files.h"
#include "engine/run/headless.h"
#include "engine/script/recording.h"
#endif

namespace app {
namespace {

struct PlayArguments {
    ScenarioChoice scenario;
    std::string record, size = "1280x800", keys, replay, cache, measure, learner, sign;
    std::string teacher_size = "1280x800";
    bool free_practice = false, open_all = false, teacher = false;
};

std::optional<std::pair<int, int>> size_of(const std::string& words) {
    const std::size_t times = words.find('x');
    if (times != std::string::npos) {
        const auto width = io::parse_integer(words.substr(0, times)),
                   height = io::parse_integer(words.substr(times + 1));
        if (width && height && *width >= 320 && *width <= 8192 && *height >= 240 && *height <= 8192)
            return std::pair(*width, *height);
    }
    return std::nullopt;
}

#ifdef SELDINGER_WINDOW

/// A solution that cannot be read is told, and the exercise has none.
Exercise exercise_of(LoadedExercise loaded) {
    Exercise made{std::move(loaded.scenario), {}, loaded.files.file, loaded.files.picture};
    try {
        made.solution = script_for(loaded.files, {});
    } catch (const io::InputError& error) {
        tell("note: '{}' has no solution: {}\n", loaded.files.name, error.what());
    }
    return made;
}

/// A page about the attempt beside its recording, with the learning curve of those before it.
std::filesystem::path debriefing_of(const std::filesystem::path& recording,
                                    const scenario::Scenario& scenario, const std::filesystem::path& cache,
                                    const std::atomic<bool>& stop) {
    debrief::StoryOptions options;
    options.cache.folder = cache;
    options.interrupted = [&stop] { return stop.load(); };
    constexpr std::size_t most_before = 9;
    std::vector<debrief::Story> stories;
    std::error_code ignored;
    std::vector<std::filesystem::path> before;
    for (const auto& entry : std::filesystem::directory_iterator(recording.parent_path(), ignored))
        if (entry.path().extension() == ".gw" &&
            entry.path().filename().string().starts_with(scenario.name + "-") &&
            entry.path().filename() < recording.filename())
            before.push_back(entry.path());
    std::sort(before.begin(), before.end());
    before.erase(before.begin(),
                 before.end() - static_cast<std::ptrdiff_t>(std::min(most_before, before.size())));
    before.push_back(recording);
    for (const std::filesystem::path& file : before) {
        options.images = file == recording;
        try {
            const script::CommandScript script = script::load_commands(file);
            if (file != recording && script.origin && script.origin->free_practice) continue;
            auto story = debrief::tell(scenario, script, options);
            if (!story) throw io::InputError("the debriefing was interrupted");
            stories.push_back(std::move(*story));
        } catch (const io::InputError&) {
            if (file == recording) throw;  // an earlier one may be of another version
        }
    }
    const std::filesystem::path page = std::filesystem::path(recording).replace_extension(".html");
    if (std::filesystem::exists(page, ignored) &&
        io::read_text(page, "page", "expected a debriefing").find("<title>Debriefing") == std::string::npos)
        throw io::InputError("{}: expected nothing or an earlier debriefing there, found another file",
                             page.string());
    io::write_whole(page, debrief::page(stories, nullptr));
    return page;
}

/// In the browser that the desktop has chosen.
void show_page(const std::filesystem::path& page) {
    constexpr const char* script =
        "command -v xdg-open >/dev/null || exit 9; "
        "[ -z \"$SELDINGER_PORTABLE\" ] || unset LIBGL_DRIVERS_PATH LIBGL_ALWAYS_SOFTWARE "
        "__GLX_VENDOR_LIBRARY_NAME __EGL_VENDOR_LIBRARY_DIRS; xdg-open \"$1\" >/dev/null 2>&1 </dev/null &";
    std::string file = std::filesystem::absolute(page).string();
    std::array<char*, 6> words = {const_cast<char*>("sh"),
                                  const_cast<char*>("-c"),
                                  const_cast<char*>(script),
                                  const_cast<char*>("sh"),
                                  file.data(),
                                  nullptr};
    pid_t child = -1;
    int status = -1;
    if (::posix_spawnp(&child, "sh", nullptr, nullptr, words.data(), environ) == 0)
        ::waitpid(child, &status, 0);
    if (status != 0)
        throw io::InputError("expected xdg-open to open a browser, found none: open the page in any browser");
}

/// The scenario file of a recording: the one named on the command line, or that which the recording names.
std::filesystem::path file_of(const script::CommandScript& recording, const ScenarioChoice& choice) {
    const std::string recorded = recording.origin ? recording.origin->scenario : "";
    if (choice.named.empty() && recorded.empty())
        throw BadArgument(
            "--replay {0}: expected a recording that says which scenario it is of, found none: 'seldinger "
            "play "
            "SCENARIO --replay {0}' says it",
            recording.file);
    if (choice.named.empty())
        return exercise_folders(choice.exercises).of_recording(recording, catalogue()).file;
    const scenario::ExerciseFiles named = exercise_named(choice);
    if (!recorded.empty() && recorded != named.name)
        throw BadArgument("--replay {}: expected a recording of '{}', found one of '{}'", recording.file,
                          named.name, recorded);
    return named.file;
}

int play(const PlayArguments& arguments) {
    PlayOptions options;
    options.origin = origin(arguments.learner);
    std::tie(options.width, options.height) = size_of(arguments.size).value();
    std::tie(options.teacher_width, options.teacher_height) = size_of(arguments.teacher_size).value();
    options.teacher = arguments.teacher;
    options.keys = room::load_keys(assets() / "keys.toml");
    if (!arguments.keys.empty()) options.keys = room::load_keys(arguments.keys, options.keys);
    options.free_practice = arguments.free_practice;
    options.measure = arguments.measure;
    options.interrupted = stop_requested;
    if (const auto folder = user_folder("XDG_DATA_HOME", ".local/share"); !folder.empty())
        options.learners = room::Learners(folder);
    if (!arguments.learner.empty()) options.learner = arguments.learner;
    options.open_all = arguments.open_all;
    options.cache = usual_cache(arguments.cache);
    options.make_debriefing = [cache = options.cache](const std::filesystem::path& recording,
                                                      const scenario::Scenario& scenario,
                                                      const std::atomic<bool>& stop) {
        return debriefing_of(recording, scenario, cache, stop);
    };
    options.show_page = show_page;
    options.of_patient = [](const Exercise& exercise, const std::string& patient) {
        return load_exercise(exercise.file, {}, patient);
    };
    if (const auto folder = user_folder("XDG_CONFIG_HOME", ".config"); !folder.empty())
        options.settings = folder / "room";

    if (!arguments.record.empty()) {
        options.record = room::Attempts(arguments.record);
        options.record->require_writable();
    }
    if (!arguments.measure.empty()) io::require_writable(arguments.measure);
    if (!arguments.sign.empty()) {
        if (!arguments.replay.empty())
            throw BadArgument("--sign: expected it without --replay, which makes no recording");
        if (!arguments.measure.empty())
            io::require_distinct(std::vector<io::Output>{{"--measure", arguments.measure}},
                                 std::vector<std::filesystem::path>{arguments.sign});
        options.recorded = [key = SigningKey(arguments.sign)](const std::filesystem::path& recording) {
            try {
                key.sign(recording);
            } catch (const std::exception& error) {
                tell("note: {} is not signed: {}\n", recording.string(), error.what());
            }
        };
    }

    const scenario::ExerciseFolders folders = exercise_folders(arguments.scenario.exercises);
    for (LoadedExercise& one : loaded(folders.all()))
        options.exercises.push_back(exercise_of(std::move(one)));
    const auto place_of = [&](const std::filesystem::path& file) {
        std::error_code ignored;
        for (std::size_t k = 0; k < options.exercises.size(); ++k)
            if (std::filesystem::equivalent(file, options.exercises[k].file, ignored)) return k;
        options.exercises.push_back(exercise_of({folders.of(file), load_exercise(file)}));
        return options.exercises.size() - 1;
    };
    if (!arguments.replay.empty()) {
        for (const std::filesystem::path& file : script::recordings_of(arguments.replay)) {
            script::CommandScript recording = script::load_commands(file);
            const std::size_t place = place_of(file_of(recording, arguments.scenario));
            const std::string patient = recording.origin ? recording.origin->patient : "";
            run::check(patient.empty() ? options.exercises[place].scenario
                                       : options.of_patient(options.exercises[place], patient),
                       recording);
            options.replays.push_back({place, std::move(recording)});
        }
    } else if (!arguments.scenario.named.empty()) {
        options.start = place_of(exercise_named(arguments.scenario).file);
        options.patient = arguments.scenario.patient == "1" ? "" : arguments.scenario.patient;
        if (!options.patient.empty())  // before a window opens
            static_cast<void>(options.of_patient(options.exercises[*options.start], options.patient));
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
        parser.add_subcommand("play",
                              "The room: wire, pedals and C-arm under your hands, in a window\n\n"
                              "Examples:\n"
                              "  seldinger play                       choose an exercise\n"
                              "  seldinger play renal --learner Ada   one exercise, and whose attempt it is");
    command
        ->add_option("scenario", arguments->scenario.named,
                     "A scenario file (.toml), or the name of an exercise; else there is a choice")
        ->type_name("SCENARIO");
    add_exercises(command, arguments->scenario.exercises);
    add_patient(command, arguments->scenario);
    command
        ->add_option("--record", arguments->record,
                     "Folder that keeps every attempt as a recording (.gw) of its own, or the file of the "
                     "first; else a folder of the user's for each learner")
        ->type_name("FOLDER");
    add_learner(command, arguments->learner);
    const auto size = text_that([](const std::string& words) { return size_of(words).has_value(); },
                                "WIDTHxHEIGHT from 320x240 to 8192x8192");
    command->add_option("--size", arguments->size, "Of the window [pixels]")
        ->type_name("WIDTHxHEIGHT")
        ->check(size);
    command->add_flag("--teacher", arguments->teacher,
                      "Open the teacher's window as well, on a second monitor where there is one");
    command->add_option("--teacher-size", arguments->teacher_size, "Of the teacher's window [pixels]")
        ->type_name("WIDTHxHEIGHT")
        ->check(size);
    command
        ->add_option("--keys", arguments->keys,
                     "File that replaces keys and speeds of assets/keys.toml (.toml)")
        ->type_name("FILE");
    command
        ->add_option("--replay", arguments->replay,
                     "Recording that is played in place of your hands (.gw), or a folder of them")
        ->type_name("FILE");
    add_sign(command, arguments->sign);
    command->add_flag("--open-all", arguments->open_all,
                      "Every exercise is open, whatever the learner has passed: for teachers");
    command->add_flag("--free", arguments->free_practice,
                      "Free practice: no score, and seconds can be taken back");
    add_cache_folder(command, arguments->cache);
    command
        ->add_option("--measure", arguments->measure,
                     "File for the delays of image and interface, at the end (.json)")
        ->type_name("FILE");
    command->footer("Exit codes: 0 done, 2 bad input, 3 a replay led to other states, 130 interrupted.");
    return {command, [arguments] { return play(*arguments); }};
}

}  // namespace app
