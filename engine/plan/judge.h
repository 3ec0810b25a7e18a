#pragma once
/// What a course is worth: in hands that are off, in force, turns, time and dose; and what it depends on.

#include <functional>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "engine/anatomy/model_cache.h"
#include "engine/exercise/model_errors.h"
#include "engine/exercise/score.h"
#include "engine/plan/search.h"
#include "engine/room/keys.h"

namespace plan {

/// A frame of the course as the exact hand plays it.
struct Moment {
    double seconds = 0;
    double left = 0;                              // from the tip to the target's middle [mm]
    double force = 0;                             // the largest of a joint on the wall [N]
    double push = 0;                              // of the hand on the device that it feels most of [N]
    geometry::Vec3 tip = geometry::Vec3::Zero();  // of the device that is to reach the target [mm]
};

/// What courses are ranked by.
struct Worth {
    int hands = 0, hands_reach = 0;         // each off by up to 5 % of every amount: author::trial
    int played = 0, played_reach = 0;       // hands at the keys, off by up to 5 %: room::PlayedHand
    double peak_force = 0, mean_force = 0;  // on the wall, of one joint: Score [N]
    int turns = 0;                          // of hubs
    double seconds = 0;

    /// Of all inexact hands [-].
    double success() const;
    /// The least is the best: by success, then the largest force (in steps of 0.05 N), its mean (0.02 N),
    /// turns, time.
    std::tuple<double, double, double, int, double> order() const;
};

struct Judged : Worth {
    Course course;
    bool reaches = false;              // the exact hand
    exercise::Score score;             // of the exact hand, with dose
    std::vector<std::string> defects;  // frames that no course should have
    std::vector<Moment> moments;
    /// At the end: how far the foremost tip and the largest force are from those of infinitely short
    /// segments; empty where there is no estimate [mm], [N].
    std::optional<double> tip_error, force_error;
    /// At the end likewise: what the wall's field and the models that the simulation chose cost the tip.
    exercise::ModelErrors model_errors;
    /// What the models that the simulation chose leave out, a sentence each.
    std::vector<std::string> left_out;
};

struct JudgeOptions {
    int threads = 2;
    room::Speeds speeds;  // of the played hands
    anatomy::ModelCache cache;
    std::function<bool()> stop;
};

/// Without dose.
Judged judge(const exercise::Exercise& start, const Course&, const JudgeOptions&);

/// The frames of the exact hand; where the course sets beam and views, the score with their dose.
void play_with_dose(Judged&, const scenario::Scenario&, const JudgeOptions&);

/// Plays a script as it is, until time is up, and calls `look` after each frame.
void play(exercise::Exercise&, const script::CommandScript&, const std::function<void()>& look);

/// The course with each of its turns led to the middle of what succeeds, as far as more hands reach with it.
Judged improved(const exercise::Exercise& start, Judged, const JudgeOptions&);

/// How the end of a course answers to what is not known exactly.
struct Sensitivity {
    std::string of;     // what is changed
    double change = 0;  // to either side
    std::string unit;   // of the change
    double tip = 0;     // how far the tip lies elsewhere at the end, the larger of both [mm]
    double force = 0;   // change of the largest force on the wall, the larger of both [N]
    int reach = 0;      // of the two
    /// Of the foremost tip alone at the end, hubs held there, to first order by the solver's
    /// recursion (physics::Response with grips that slide), and the change of the largest force there. Of
    /// what has a derivative at a rest: not of friction, whose forces the way makes, and not of pushes [mm],
    /// [N].
    std::optional<double> at_end = {}, force_at_end = {};
};
/// Plays the course with one quantity changed to either side, each in turn: stiffness of each device,
/// friction, stiffness of the wall, radius of the vessels, amounts of pushes and turns. Central differences
/// of whole courses: what is a snap counts in full. Empty when stopped.
std::vector<Sensitivity> sensitivities(const scenario::Scenario&, const script::CommandScript&,
                                       const JudgeOptions&);

}  // namespace plan
