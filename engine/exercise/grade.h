#pragma once
/// What an attempt is worth: its figures held against those of skilled attempts at the same exercise.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/exercise/score.h"
#include "engine/scenario/benchmark.h"

namespace exercise {

/// A member of the score as a figure.
template <auto member>
std::optional<double> figure_of(const Score& score) {
    return std::invoke(member, score);
}

/// Something that attempts are measured by.
struct Measure {
    const char *id, *name, *unit;
    int digits;
    double most;   // points that it costs at most
    double grain;  // a difference that does not matter, in the unit
    scenario::Sample scenario::Benchmark::*sample;
    std::optional<double> (*value)(const Score&);  // empty: not reached, or not measured
    bool of_looking;                               // what looking at the vessels costs
    const char* advice;                            // why it matters and what to do instead
    const char* evidence;                          // published: whether it separates the experienced
};
std::span<const Measure> measures();

/// An attempt worth so many points passes the exercise, unless a course asks for others: the skilled's time,
/// dose, contrast and way about twice, without an error.
inline constexpr double pass_mark = 70;

struct GradeLine {
    const Measure* measure = nullptr;
    std::optional<double> yours, mean, spread;  // mean and spread of the skilled; empty: they have none
    bool unseen = false;                        // lost whole, as nothing was looked at
    double cost = 0;                            // points
};

/// Injuries have no benchmark: each costs its points. What they cost is in proportion to how many patients
/// die of them (docs/injury.md).
inline constexpr double points_of_dissection = 15, points_of_perforation = 50;

struct Grade {
    bool reached = false;
    std::vector<GradeLine> lines;
    int dissections = 0, perforations = 0;
    double points = 0;  // 100 less all costs; 0 when the target was not reached

    double cost_of_injuries() const {
        return dissections * points_of_dissection + perforations * points_of_perforation;
    }
};

/// How points are lost, in words.
extern const char* const grade_formula;

/// A line costs most · (1 − √((mean + grain) / (yours + grain))) where yours is above the mean of the
/// skilled attempts, else nothing. Where each of these took an angiogram, an attempt without one loses the
/// lines of what looking costs whole: so looking is never dearer than going blind.
Grade grade(const Score&, const scenario::Benchmark&);

/// Where unseen lines are lost.
inline constexpr const char* blind_advice =
    "No angiogram was taken, and the way was found by luck. Look at the vessels first: dose and contrast are "
    "judged against attempts that did.";

/// "21.4 ± 2.1 s"; "-" where the skilled have none.
std::string skilled_text(const GradeLine&);
/// "24.0 s"; "-" where there is none.
std::string own_text(const GradeLine&);

/// The benchmark that attempts make, all of which must have reached the target.
scenario::Benchmark benchmark_of(std::span<const Score> attempts, std::string by, std::uint64_t scenario);

}  // namespace exercise
