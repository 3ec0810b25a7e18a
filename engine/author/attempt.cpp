#include "engine/author/attempt.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <mutex>
#include <random>

#include "physics/geometry/parallel.h"

namespace author {
namespace {

constexpr int tail = 10;  // frames after the last command of a script without an end

/// What a hand makes of the amounts of a line.
class Inexact {
public:
    Inexact(unsigned hand, double off) : hand_(hand), off_(off), random_(hand) {}
    double factor(int line) {
        if (hand_ == exact_hand) return 1;
        if (hand_ < 3) return hand_ == 1 ? 1 + off_ : 1 - off_;
        const auto [at, fresh] = factors_.try_emplace(line, 1.0);
        if (fresh) at->second = 1 + off_ * (2 * std::ldexp(static_cast<double>(random_()), -32) - 1);
        return at->second;
    }
    script::Command operator()(const script::TimedCommand& timed) {
        script::Command command = timed.command;
        const double by = factor(timed.place.line);
        if (auto* advance = std::get_if<script::Advance>(&command)) advance->length *= by;
        if (auto* withdraw = std::get_if<script::Withdraw>(&command)) withdraw->length *= by;
        if (auto* rotate = std::get_if<script::Rotate>(&command)) rotate->angle *= by;
        return command;
    }

private:
    unsigned hand_;
    double off_;
    std::mt19937 random_;
    std::map<int, double> factors_;
};

/// Where the tip was after a frame.
struct Moment {
    double time, distance;  // [s], to the target's middle [mm]
};

/// As Scorer::observe_target counts the hold, from the frame of the first motion on.
double smallest_radius(std::span<const Moment> moments, const scenario::Scenario& s) {
    const double frame_time = 1 / s.frame_rate;
    double smallest = std::numeric_limits<double>::infinity();
    for (std::size_t first = 0; first < moments.size(); ++first) {
        const double since = moments[first].time - frame_time;
        double farthest = 0;
        for (const Moment& moment : moments.subspan(first)) {
            farthest = std::max(farthest, moment.distance);
            if (moment.time - since < s.target.hold - 0.5 * frame_time) continue;
            smallest = std::min(smallest, farthest);
            break;
        }
    }
    return smallest;
}

void note_defects(const exercise::Exercise& exercise, const exercise::StepReport& report, int frame,
                  std::vector<std::string>& defects) {
    const auto say = [&](const std::string& what) {
        defects.push_back(fmt::format("frame {}: {}", frame, what));
    };
    for (const std::string& wrong : physics::validate(exercise.simulation().wire())) say(wrong);
    if (!report.settling && report.relax.newton_steps != 0 && !report.relax.at_rest())
        say("the wire is not at rest");
    if (report.buckled) say("a push bows the shaft outside");
    if (report.too_thick) say("a device is too thick to go on");
    if (report.refused) say("a motion is refused");
}

}  // namespace

Attempt attempt(exercise::Exercise& exercise, const script::CommandScript& script, const Hand& hand) {
    Attempt made;
    std::vector<Moment> moments;
    made.nearest = std::numeric_limits<double>::infinity();
    for (int frame = 0; frame <= script.last_frame(tail) && !exercise.time_is_up(); ++frame) {
        std::vector<script::Command> commands;
        for (const script::TimedCommand& timed : script.at(frame)) commands.push_back(hand(timed));
        note_defects(exercise, exercise.next_frame(commands).motion, frame, made.defects);
        moments.push_back({exercise.time().seconds, exercise.simulation().tip_to_target()});
        made.nearest = std::min(made.nearest, moments.back().distance);
    }
    made.score = exercise.finish();
    made.smallest_radius = smallest_radius(moments, exercise.simulation().scenario());
    return made;
}

Attempt attempt(exercise::Exercise& exercise, const script::CommandScript& script, unsigned hand,
                double off) {
    assert(off >= 0 && off < 1);
    Attempt made = attempt(exercise, script, Inexact(hand, off));
    made.hand = hand;
    return made;
}

std::optional<std::vector<Attempt>> trial(const exercise::Exercise& start,
                                          const script::CommandScript& script, double off,
                                          const TrialOptions& options) {
    std::vector<Attempt> attempts(last_hand);
    std::atomic<bool> stopped = false;
    std::mutex mutex;
    std::size_t done = 0;
    geometry::for_each_index(static_cast<int>(last_hand), std::max(1, options.jobs), [&](int k) {
        if (stopped) return;
        exercise::Exercise own(start);
        attempts[static_cast<std::size_t>(k)] = attempt(own, script, static_cast<unsigned>(k) + 1, off);
        const std::lock_guard lock(mutex);
        if (options.progress) options.progress(++done, last_hand);
        if (options.interrupted && options.interrupted()) stopped = true;
    });
    if (stopped) return std::nullopt;
    return attempts;
}

bool all_reach(std::span<const Attempt> attempts) {
    return std::ranges::all_of(attempts, [](const Attempt& one) { return one.score.completed; });
}

double forgiving_radius(std::span<const Attempt> attempts) {
    double radius = 0;
    for (const Attempt& one : attempts) radius = std::max(radius, one.smallest_radius);
    return radius;
}

std::optional<double> widest_off(const exercise::Exercise& start, const script::CommandScript& script,
                                 const TrialOptions& options, double most) {
    const int levels = static_cast<int>(std::lround(100 * most));
    double widest = 0;
    for (int level = 1; level <= levels; ++level) {
        TrialOptions of_level = options;
        if (options.progress)
            of_level.progress = [&](std::size_t done, std::size_t of) {
                options.progress(static_cast<std::size_t>(level - 1) * of + done,
                                 static_cast<std::size_t>(levels) * of);
            };
        const auto attempts = trial(start, script, 0.01 * level, of_level);
        if (!attempts) return std::nullopt;
        if (!all_reach(*attempts)) break;
        widest = 0.01 * level;
    }
    return widest;
}

}  // namespace author
