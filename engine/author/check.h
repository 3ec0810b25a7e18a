#pragma once
/// Everything that would be refused, or could not be done, when an exercise is run; what exercises that ship
/// are held to.

#include <filesystem>
#include <string>
#include <vector>

#include "engine/anatomy/model_cache.h"
#include "engine/author/attempt.h"
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

/// What an exercise lacks of a lesson: level, briefing, hints, views, benchmark (a
/// guided lesson has none), picture.
std::vector<std::string> missing_of_lesson(const scenario::ExerciseFiles&, const scenario::Scenario&);

inline constexpr double least_points_of_solution = 90;  // what is done after the target counts too
/// What is wrong with a solution, as the exact hand carried it out: target, errors of handling, wrong
/// branches, defects; with a benchmark also too few points, and figures of it that are far above the
/// solution's.
std::vector<std::string> faults_of_solution(const scenario::Scenario&, const Attempt&);

/// The scenario's benchmark, or that which the solution alone makes.
scenario::Benchmark benchmark_for(const scenario::Scenario&, const exercise::Score& solution);

/// Points of hands that push, pull and turn without sense, one for each seed from 1, in three times the
/// skilled's time and up to 600 frames. `start` is not changed.
inline constexpr unsigned clumsy_hands = 3;
inline constexpr double most_clumsy_points = 75;  // that an exercise may give them
std::vector<double> clumsy_points(const exercise::Exercise& start, const scenario::Benchmark&);

}  // namespace author
