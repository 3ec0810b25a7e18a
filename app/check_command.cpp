/// `seldinger check`: what would be refused of exercises.

#include <memory>
#include <string>
#include <vector>

#include "app/command.h"
#include "engine/author/check.h"

namespace app {
namespace {

struct CheckArguments {
    std::vector<std::string> scenarios, exercises;
    std::string cache;
};

/// Returns whether it can be used.
bool check_one(const scenario::ExerciseFiles& files, const CheckArguments& arguments) {
    std::vector<author::Finding> findings;
    {
        ProgressBar bar;
        anatomy::ModelCache cache;
        cache.folder = usual_cache(arguments.cache);
        report_on(bar, cache);
        findings = author::check(files, catalogue(), cache);
    }
    print("{}: {}\n", files.name, files.file.string());
    for (const author::Finding& one : findings) {
        const char* const verdict = one.verdict == author::Finding::Verdict::Fine      ? "ok"
                                    : one.verdict == author::Finding::Verdict::Missing ? "-"
                                                                                       : "WRONG";
        print("  {:<6} {:<12} {}\n", verdict, one.what, one.said);
    }
    return author::is_usable(findings);
}

int check(const CheckArguments& arguments) {
    bool usable = true;
    for (const std::string& named : arguments.scenarios) {
        usable &= check_one(exercise_named({named, arguments.exercises}), arguments);
        if (stop_requested()) return interrupted;
    }
    return usable ? done : bad_input;
}

}  // namespace

Command add_check(CLI::App& parser) {
    const auto arguments = std::make_shared<CheckArguments>();
    CLI::App* command =
        parser.add_subcommand("check",
                              "Everything about an exercise that would be refused when it is run\n\n"
                              "Examples:\n"
                              "  seldinger check mine.toml\n"
                              "  seldinger check renal coronary");
    command
        ->add_option("scenarios", arguments->scenarios,
                     "Scenario files (.toml), or names of exercises, one or more")
        ->required()
        ->type_name("SCENARIO");
    add_exercises(command, arguments->exercises);
    add_cache_folder(command, arguments->cache);
    command->footer(
        "What is looked at: scenario, vessels, entry, target and the way there, wall and image, solution "
        "(which is\n"
        "played), picture. '-': there is none yet.\n"
        "Exit codes: 0 nothing is wrong, 2 something is, 130 interrupted.");
    return {command, [arguments] { return check(*arguments); }};
}

}  // namespace app
