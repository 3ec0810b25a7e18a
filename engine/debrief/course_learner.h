#pragma once
/// Where one learner stands in a course, and what she needs.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/debrief/course.h"

namespace debrief {

/// At one exercise.
struct Standing {
    const PlannedExercise* exercise = nullptr;
    std::vector<const CourseRow*> attempts;  // in order
    std::optional<double> best, last;        // points
    bool passed = false;

    bool overdue(Day today) const { return !passed && exercise->due && *exercise->due < today; }
};

/// Points of three attempts running, each less than the one before.
struct Falling {
    const PlannedExercise* exercise = nullptr;
    std::array<double, 3> points = {};
};

/// What costs points, and what to do instead.
struct Costly {
    std::string what, advice;
    double points = 0;  // an attempt
};

inline constexpr std::size_t recent_attempts = 5;  // that what is costly is taken from
inline constexpr std::size_t most_costly = 3;      // lines told
inline constexpr double least_cost = 0.5;          // points an attempt that are told
inline constexpr double clear_fall = 10;           // points over three attempts that are told

struct LearnerCourse {
    std::string name;                        // empty = nobody's
    bool expected = true;                    // named by the plan, or the plan names nobody
    std::vector<Standing> exercises;         // each of the plan's, in its order
    std::vector<const CourseRow*> attempts;  // all that count, in order, also outside the course

    const Standing* next() const;  // the first not passed; null: all are
    std::vector<const Standing*> overdue(Day today) const;
    /// Days since the last attempt; empty without one.
    std::optional<int> idle(Day today) const;
    std::vector<Falling> falling() const;
    /// Of the last attempts, the dearest first.
    std::vector<Costly> costly() const;
};

/// Those the plan expects, in its order, then all others who have attempts. Rows and plan must outlive them.
std::vector<LearnerCourse> learners_of(std::span<const CourseRow>, const CoursePlan&);

}  // namespace debrief
