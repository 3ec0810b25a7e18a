#include "engine/exercise/grade.h"

#include <algorithm>

namespace exercise {
namespace {

constexpr double wrong_entry = 5, mishap = 4;  // points each

}  // namespace

const char* const grade_formula =
    "100 points less what each line costs. Time, beam, contrast and travel cost nothing up to their par and "
    "most · (yours / par - 1) above it: at most 25, 25, 10 and 10 points. Each entry into a wrong branch "
    "costs 5 points, 10 at most; each error of handling costs 4, 20 at most. Without the target there are no "
    "points.";

Grade grade(const Score& score, const scenario::Par& par) {
    Grade result;
    result.reached = score.completed;
    const auto above_par = [&](const char* name, const char* unit, std::optional<double> yours,
                               std::optional<double> its_par, double most) {
        double cost = 0;
        if (yours && its_par && *its_par > 0) cost = most * std::clamp(*yours / *its_par - 1, 0.0, 1.0);
        result.lines.push_back({name, unit, yours, its_par, most, cost});
    };
    const auto each = [&](const char* name, double count, double points, double most) {
        result.lines.push_back({name, "", count, 0.0, most, std::min(most, points * count)});
    };
    above_par("Time to the target", "s", score.completion_time, par.completion_time, 25);
    above_par("Beam", "s", score.beam_on_time, par.beam_on_time, 25);
    above_par("Contrast", "ml", score.contrast, par.contrast, 10);
    above_par("Travel of the devices", "mm", score.wire_travel, par.wire_travel, 10);
    each("Wrong branches", score.wrong_entries(), wrong_entry, 10);
    each("Errors of handling", static_cast<double>(score.mishaps.size()), mishap, 20);
    result.points = 100;
    for (const GradeLine& line : result.lines) result.points -= line.cost;
    if (!result.reached) result.points = 0;
    return result;
}

scenario::Par par_of(const Score& score) {
    return {score.completion_time, score.beam_on_time, score.contrast, score.wire_travel};
}

}  // namespace exercise
