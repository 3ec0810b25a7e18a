#pragma once
/// Does a solution forgive an inexact hand: a script played with amounts that are a little off, again and
/// again.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/exercise/exercise.h"
#include "engine/exercise/score.h"
#include "engine/script/command.h"

namespace author {

/// Hands that a solution is tried with. 0 does as the script says; all others are off by up to `off` of each
/// amount: 1 always too much, 2 always too little, the others each line at random, drawn from the number.
inline constexpr unsigned exact_hand = 0, last_hand = 10;
/// What every exercise that ships forgives [-].
inline constexpr double usual_off = 0.05;

struct Attempt {
    unsigned hand = exact_hand;
    exercise::Score score;
    double nearest = 0;  // of the tip to the target's middle, of any frame [mm]
    /// The smallest target that the tip stayed in for as long as the target asks [mm]; infinite where the
    /// script is too short for that.
    double smallest_radius = 0;
    std::vector<std::string> defects;  // frames that no solution may have: refused, bowed out, not at rest
};

/// What a hand makes of a command of the script.
using Hand = std::function<script::Command(const script::TimedCommand&)>;
/// Plays the script from the exercise's state with that hand, to the last frame or until time is up.
Attempt attempt(exercise::Exercise&, const script::CommandScript&, const Hand&);
/// The same with one of the hands above.
Attempt attempt(exercise::Exercise&, const script::CommandScript&, unsigned hand, double off);

struct TrialOptions {
    int jobs = 2;
    std::function<void(std::size_t done, std::size_t of)> progress;
    std::function<bool()> interrupted;
};

/// One attempt of each hand but the exact one. `start` must have no images; it is not changed. Empty:
/// interrupted.
std::optional<std::vector<Attempt>> trial(const exercise::Exercise& start, const script::CommandScript&,
                                          double off, const TrialOptions& = {});

bool all_reach(std::span<const Attempt>);
/// The smallest target radius with which all of them would have reached [mm].
double forgiving_radius(std::span<const Attempt>);

/// The largest of the fractions 1, 2, … % at which, and at all below which, all hands reach; 0 where none is.
/// Looks up to `most`. Empty: interrupted.
inline constexpr double widest_tried = 0.2;
std::optional<double> widest_off(const exercise::Exercise& start, const script::CommandScript&,
                                 const TrialOptions& = {}, double most = widest_tried);

}  // namespace author
