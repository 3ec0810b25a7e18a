#include "engine/room/played_hand.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace room {
namespace {

/// Of the hand's three speeds the one nearest in proportion.
double nearest_speed(const std::array<double, 3>& speeds, double wanted) {
    double best = speeds[0];
    for (const double speed : speeds)
        if (std::abs(std::log(speed / wanted)) < std::abs(std::log(best / wanted))) best = speed;
    return best;
}

double uniform(std::mt19937_64& random) {
    return std::ldexp(static_cast<double>(random() >> 11), -53);
}

}  // namespace

PlayedHand::PlayedHand(const script::CommandScript& script, const Speeds& speeds, double frame_rate,
                       const Habits& habits, std::uint64_t seed)
    : speeds_(speeds), frame_time_(1 / frame_rate), habits_(habits), random_(seed) {
    struct Line {
        Motion motion;  // of all its frames
        int frames = 0;
    };
    std::map<int, double> factors;  // by line
    std::map<int, Line> group;      // by line, of frames that move by the same lines
    int idle = 0;                   // frames since the last motion
    const auto end_group = [&] {
        std::vector<Motion> motions;
        for (auto& [number, line] : group) {
            const double wanted = std::abs(line.motion.amount) / (line.frames * frame_time_);
            line.motion.speed = nearest_speed(line.motion.turns ? speeds_.rotate : speeds_.advance, wanted);
            motions.push_back(line.motion);
        }
        group.clear();
        if (motions.empty()) return;
        add_group(std::move(motions), idle);
        idle = 0;
    };
    for (int frame = 0, last = script.last_frame(0); frame <= last; ++frame) {
        std::vector<script::Command> others;
        std::vector<std::pair<int, Motion>> moves;
        for (const script::TimedCommand& timed : script.at(frame)) {
            const auto [at, fresh] = factors.try_emplace(timed.place.line, 1.0);
            if (fresh) at->second = 1 + habits_.error * (2 * uniform(random_) - 1);
            Motion motion;
            if (const auto* advance = std::get_if<script::Advance>(&timed.command))
                motion = {false, advance->held, advance->length * at->second};
            else if (const auto* withdraw = std::get_if<script::Withdraw>(&timed.command))
                motion = {false, withdraw->held, -withdraw->length * at->second};
            else if (const auto* rotate = std::get_if<script::Rotate>(&timed.command))
                motion = {true, rotate->held, rotate->angle * at->second};
            if (motion.amount == 0)
                others.push_back(timed.command);
            else
                moves.emplace_back(timed.place.line, motion);
        }
        const bool same = moves.size() == group.size() && std::ranges::all_of(moves, [&](const auto& move) {
                              return group.contains(move.first);
                          });
        if (!same || !others.empty()) end_group();
        if (!others.empty() || moves.empty()) {
            const bool waits = moves.empty();
            steps_.push_back({std::move(others), {}, waits ? 1 : 0, true});
            idle += waits;
        }
        for (const auto& [number, motion] : moves) {
            Line& line = group[number];
            line.motion.turns = motion.turns;
            line.motion.held = motion.held;
            line.motion.amount += motion.amount;
            ++line.frames;
        }
    }
    end_group();
}

double PlayedHand::decision_frames() {
    // Box and Muller's normal number: the library's differ from one to the next.
    const double radius = std::sqrt(-2 * std::log(1 - uniform(random_)));
    const double normal = radius * std::cos(2 * std::numbers::pi * uniform(random_));
    return habits_.decision * std::exp(habits_.decision_spread * normal) / frame_time_;
}

/// Before another kind of movement the hand takes its time, of which the frames that were idle are a part.
void PlayedHand::add_group(std::vector<Motion> motions, int idle_frames) {
    const bool goes_on = motions.size() == before_.size() &&
                         std::equal(motions.begin(), motions.end(), before_.begin(),
                                    [](const Motion& a, const Motion& b) { return a.like(b); });
    if (!goes_on || idle_frames > 0) {
        const int pause = static_cast<int>(std::lround(decision_frames())) - idle_frames;
        if (pause > 0) steps_.push_back({{}, {}, pause, true});
    }
    std::vector<Motion> too_far, back;
    for (Motion motion : motions)
        if (!motion.turns && motion.amount > 0 && habits_.overshoot > 0) {
            motion.amount *= habits_.overshoot;
            too_far.push_back(motion);
            motion.amount = -motion.amount;
            back.push_back(motion);
        }
    before_ = motions;
    steps_.push_back({{}, std::move(motions), 0, !goes_on || idle_frames > 0});
    if (too_far.empty()) return;
    steps_.push_back({{}, std::move(too_far), 0, false});
    steps_.push_back({{}, {}, static_cast<int>(std::lround(decision_frames())), true});
    steps_.push_back({{}, std::move(back), 0, true});
    before_.clear();
}

std::vector<script::Command> PlayedHand::next(const exercise::StepReport& last) {
    std::vector<script::Command> commands;
    while (!done()) {
        Step& step = steps_[step_];
        if (moving_ == 0 && waited_ == 0)
            commands.insert(commands.end(), step.commands.begin(), step.commands.end());
        if (step.motions.empty()) {
            if (++waited_ > step.frames) {  // it only has commands
                waited_ = 0;
                ++step_;
                continue;
            }
            if (waited_ == step.frames) {
                waited_ = 0;
                ++step_;
            } else {
                step.commands.clear();
            }
            return commands;
        }
        if (std::abs(last.waiting_insertion) > Speeds::most_behind ||
            std::abs(last.waiting_rotation) > Speeds::most_behind_in_turn)
            return commands;
        double whole = 0;  // that the step takes at full speed [s]
        for (const Motion& motion : step.motions)
            whole = std::max(whole, std::abs(motion.amount) / motion.speed);
        const double middle = moving_ + frame_time_ / 2;
        const double speed = !step.runs_up || speeds_.run_up <= 0
                                 ? 1
                                 : std::min(1.0, Speeds::first_fraction +
                                                     (1 - Speeds::first_fraction) * middle / speeds_.run_up);
        const double part = std::min(1 - fraction_, speed * frame_time_ / whole);
        for (const Motion& motion : step.motions) {
            const double amount = motion.amount * part;
            if (motion.turns)
                commands.push_back(script::Rotate{amount, motion.held});
            else if (amount > 0)
                commands.push_back(script::Advance{amount, motion.held});
            else
                commands.push_back(script::Withdraw{-amount, motion.held});
        }
        moving_ += frame_time_;
        fraction_ += part;
        if (fraction_ > 1 - 1e-12) {
            moving_ = fraction_ = 0;
            ++step_;
        }
        return commands;
    }
    return commands;
}

}  // namespace room
