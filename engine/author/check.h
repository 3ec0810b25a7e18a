#pragma once
/// Everything that would be refused, or could not be done, when an exercise is run.

#include <filesystem>
#include <string>
#include <vector>

#include "engine/anatomy/model_cache.h"
#include "engine/scenario/exercise_folders.h"

namespace author {

/// One thing that was looked at.
struct Finding {
    enum class Verdict { Fine, Missing, Wrong } verdict = Verdict::Fine;  // Missing: there can be one, later
    std::string what, said;
};

/// The scenario, its vessels, entry, target and devices, wall and image, its other patients, its solution,
/// played, and its picture. What follows from something wrong is not looked at.
std::vector<Finding> check(const scenario::ExerciseFiles&, const std::filesystem::path& catalogue,
                           const anatomy::ModelCache&);
bool is_usable(const std::vector<Finding>&);

/// The exercise's picture: an angiogram of its vessels in the view that it starts with, before a device has
/// moved. Throws InputError.
void write_thumbnail(const std::filesystem::path& png, const scenario::Scenario&, const anatomy::ModelCache&);

}  // namespace author
