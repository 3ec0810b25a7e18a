#pragma once
/// Where exercises are. An exercise is NAME.toml with, beside it, NAME.gw, its solution, and NAME.png, its
/// picture; solutions of what ships lie in a folder of their own.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace scenario {

struct ExerciseFiles {
    std::string name;
    std::filesystem::path file, solution, picture;  // the last two are empty where there is none
    /// Scenarios of the same name in less specific folders, which this one stands before.
    std::vector<std::filesystem::path> hides = {};
};

/// Letters, digits, '-' and '_', up to 64, a letter or digit first: never a path, and fit for a file's name.
bool is_exercise_name(std::string_view);

/// The folders that are searched, from the least specific: what ships, the user's own, those that are named.
class ExerciseFolders {
public:
    /// `assets` holds scenarios/ and scripts/; `users` may be missing, or empty for none. Throws InputError
    /// for a named folder that cannot be read, and where two of them hold one name.
    ExerciseFolders(std::filesystem::path assets, const std::filesystem::path& users,
                    const std::vector<std::filesystem::path>& named);

    /// In the order of their names, the most specific of each. TOML that has neither [entry] nor [target],
    /// as that of a device or of vessels, is no exercise.
    std::vector<ExerciseFiles> all() const;
    /// Of one folder, which need not be one of those that are searched.
    std::vector<ExerciseFiles> in(const std::filesystem::path& folder) const;
    /// A path to a scenario file as it is, or the exercise of that name. Throws InputError that says where
    /// was searched.
    ExerciseFiles find(const std::string& path_or_name) const;
    /// The exercise with the files beside the scenario's.
    ExerciseFiles of(const std::filesystem::path& scenario) const;
    /// That of a recording, which names it: of that name and content in any of the folders, beside the
    /// recording or in the folder above; where no content is equal, the first of that name, in this order.
    /// `catalogue` holds the devices. Throws InputError, also for a name that would be a path.
    ExerciseFiles of_recording(const script::CommandScript&, const std::filesystem::path& catalogue) const;

    /// Every scenario file of all folders: what no output may replace.
    std::vector<std::filesystem::path> files() const;
    /// The folder that exercises of the user's own are kept in; empty without one.
    const std::filesystem::path& users() const { return users_; }
    /// For messages.
    std::string text() const;

private:
    std::filesystem::path assets_, users_;
    std::vector<std::filesystem::path> folders_;  // the most specific first
};

}  // namespace scenario
