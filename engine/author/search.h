#pragma once
/// A course to the target, found by trying: is an exercise possible at all?

#include <functional>
#include <optional>
#include <string>

#include "engine/exercise/exercise.h"
#include "engine/script/command.h"

namespace author {

struct SearchOptions {
    double push = 6;        // of one step [mm]
    int most_steps = 1500;  // that are tried in all
    std::function<bool()> interrupted;
};

struct FoundCourse {
    std::string text;              // a script that reaches the target, exact to the bit
    script::CommandScript script;  // the same, read
    int tried = 0;                 // steps
    double seconds = 0;            // of the exercise, to the end of the hold
};

/// Pushes the device that the exercise is about, step by step, and goes on from where its tip is nearest to
/// the target along the vessels; where a push does not bring it nearer, from where it was, turned first or
/// drawn back and turned. What injures the wall is no step. `start` must have no images; it is not changed,
/// and the same start gives the same course. Empty: none was found, or it was interrupted.
std::optional<FoundCourse> find_course(const exercise::Exercise& start, const SearchOptions& = {});

}  // namespace author
