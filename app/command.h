#pragma once
/// What all sub-commands of the command line share.

#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <optional>
#include <utility>

#include "app/arguments.h"
#include "app/progress_bar.h"
#include "engine/anatomy/model_cache.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/scenario/exercise_folders.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace app {

/// 0 is success, as for any program; 1 means that the target was not reached.
enum ExitCode { done = 0, not_reached = 1, bad_input = 2, differs = 3, interrupted = 130 };

/// A sub-command and the action to run when it is given. The action returns the exit code; it may throw any
/// std::exception, whose text is shown to the user.
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
Command add_device(CLI::App&);
Command add_score(CLI::App&);
Command add_replay(CLI::App&);
Command add_debrief(CLI::App&);
Command add_course(CLI::App&);
Command add_batch(CLI::App&);
Command add_show(CLI::App&);
Command add_cache(CLI::App&);
Command add_serve(CLI::App&);
Command add_bake(CLI::App&);
Command add_views(CLI::App&);
Command add_benchmark(CLI::App&);
Command add_check(CLI::App&);
Command add_new(CLI::App&);
Command add_author(CLI::App&);
Command add_plan(CLI::App&);
Command add_help(CLI::App&);
Command add_version(CLI::App&);
Command add_completion(CLI::App&);

/// Ends what a signal has stopped.
struct Interrupted {};

/// To be called first. From here on Ctrl-C, SIGTERM and SIGHUP ask the command to stop. One that asks
/// stop_requested() has time to keep what it has; a second signal, or work that does not ask for half a
/// second, ends the program with exit code 130, and what was being written is removed. Writing beyond a quota
/// or to a closed pipe is an error of the write instead of a signal that ends the program; only print() ends
/// by the signal, as any program does whose reader has left. A standard stream that is closed stays without
/// effect: no file takes its number.
void catch_signals();
bool stop_requested();

/// Writes to standard error, without control characters. That it cannot be written to is no reason to end.
template <class... Values>
void tell(fmt::format_string<Values...> text, Values&&... values) {
    std::string line = fmt::format(text, std::forward<Values>(values)...);
    const bool ends = line.ends_with('\n');
    if (ends) line.pop_back();
    std::fputs((io::printable(line) + (ends ? "\n" : "")).c_str(), stderr);
}

/// Writes to standard output. Throws std::system_error where that is not possible.
void write_out(const std::string&);
/// Writes to standard output, without control characters. All that commands print goes through here.
template <class... Values>
void print(fmt::format_string<Values...> text, Values&&... values) {
    write_out(io::without_control(fmt::format(text, std::forward<Values>(values)...)));
}

/// "seldinger 0.1.0".
extern const char* const program;
/// What recordings say of this program: its name, version and the hash of its file; and whose they are.
script::Origin origin(const std::string& learner = {});
/// The program's folder below the one that the variable names, otherwise below the user's home; empty without
/// either.
std::filesystem::path user_folder(const char* variable, const char* under_home);
/// Reads the arguments, runs the action and returns its exit code. Reports what is wrong with the arguments,
/// or prints the help that they ask for; reports what the action throws, and an output that could not be
/// written.
int run_action(CLI::App&, int count, char** values, const std::function<int()>& action);
/// The folder that is named, else the user's own cache, as of `play`.
std::filesystem::path usual_cache(const std::string& named);
/// Shows on the bar what is made for the cache, and notes what cannot be kept. The bar must outlive its use.
void report_on(ProgressBar&, anatomy::ModelCache&);
/// What names a scenario on a command line.
struct ScenarioChoice {
    std::string named;                   // a file (.toml), or the name of an exercise
    std::vector<std::string> exercises;  // folders of --exercises
    std::string patient = {};            // of --patient; empty: the first, or a recording's
};
/// Where exercises are: what ships, the user's own, the folders named. Throws InputError.
scenario::ExerciseFolders exercise_folders(const std::vector<std::string>& named = {});
/// The folder of devices that a scenario takes by name.
std::filesystem::path catalogue();
/// The files of the exercise; tells of scenarios of its name that it stands before. Throws InputError.
scenario::ExerciseFiles exercise_named(const ScenarioChoice&);
/// The scenario of it, with values as overrides_of() reads them. Throws InputError.
scenario::Scenario scenario_named(const ScenarioChoice&, const std::vector<std::string>& set = {});
/// The scenario of a recording: the one named, or that which the recording names. Throws InputError.
scenario::Scenario scenario_of(const script::CommandScript&, const ScenarioChoice&);
/// An exercise that can be chosen.
struct LoadedExercise {
    scenario::ExerciseFiles files;
    scenario::Scenario scenario;
};
/// In the order of the curriculum: by level, the quicker first; those outside it come last. Tells which could
/// not be loaded, and what stands behind another of its name.
std::vector<LoadedExercise> loaded(const std::vector<scenario::ExerciseFiles>&);
/// The scenario in the file, measured by the user's own benchmark where there is one. Throws InputError.
scenario::Scenario load_exercise(const std::filesystem::path&, const std::vector<std::string>& set = {},
                                 const std::string& patient = {});
/// The script in the file; the exercise's solution where "solution" is named, or nothing and there is one;
/// what standard input has for "-". Throws InputError.
std::optional<script::CommandScript> script_for(const scenario::ExerciseFiles&, const std::string& named);
/// The same, where one has to be named.
script::CommandScript required_script(const scenario::ExerciseFiles&, const std::string& named);

/// "guidewire.friction=0.1", as --set takes it.
std::vector<scenario::Override> overrides_of(const std::vector<std::string>&);

/// This program's file, links resolved, and its folder.
std::filesystem::path program_file();
std::filesystem::path program_folder();
/// Folder of the scenarios and scripts distributed with the program: ../share/seldinger beside the program's
/// own folder, or the folder in the environment variable SELDINGER_ASSETS. Throws io::InputError where there
/// is none.
std::filesystem::path assets();

/// Adds --exercises, which may have an older name too.
void add_exercises(CLI::App*, std::vector<std::string>& folders, const char* names = "--exercises");
/// Adds --patient, of an exercise.
void add_patient(CLI::App*, ScenarioChoice&);
/// Adds the argument that scenario_named() takes, which has to be given, and --exercises.
void add_scenario(CLI::App*, ScenarioChoice&);
/// Adds --scenario, of recordings, --exercises and --patient.
void add_scenario_of_recording(CLI::App*, ScenarioChoice&);
/// Adds --commands: a script, "solution" or "-".
CLI::Option* add_script(CLI::App*, std::string& named, const char* otherwise = nullptr);
/// Adds --set.
void add_overrides(CLI::App*, std::vector<std::string>& set);
/// Adds --learner, and says why.
void add_learner(CLI::App*, std::string& learner);
/// Adds --cache, the folder for what is made of vessels, and says which it is without one.
void add_cache_folder(CLI::App*, std::string& folder, const char* otherwise = "the user's");

}  // namespace app
