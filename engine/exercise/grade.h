#pragma once
/// What an attempt is worth against its par, line by line.

#include <optional>
#include <string>
#include <vector>

#include "engine/exercise/score.h"
#include "engine/scenario/lesson.h"

namespace exercise {

struct GradeLine {
    std::string name, unit;
    std::optional<double> yours;  // empty: not reached
    std::optional<double> par;    // empty: there is none, and the line costs nothing
    double most = 0;              // points that it can cost at most
    double cost = 0;              // points
};

struct Grade {
    bool reached = false;
    std::vector<GradeLine> lines;
    double points = 0;  // 100 less all costs; 0 when the target was not reached
};

/// How points are lost, in words.
extern const char* const grade_formula;

/// A line above its par costs most · min(1, yours / par − 1); each entry into a wrong branch and each error
/// of handling costs its points, up to the line's most.
Grade grade(const Score&, const scenario::Par&);

/// The figures of a score as a par.
scenario::Par par_of(const Score&);

}  // namespace exercise
