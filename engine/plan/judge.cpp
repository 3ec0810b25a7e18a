#include "engine/plan/judge.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "engine/author/attempt.h"
#include "engine/exercise/observation.h"
#include "engine/room/played_hand.h"
#include "physics/geometry/parallel.h"

namespace plan {
namespace {

constexpr double off = author::usual_off;
constexpr int played_hands = 5;

bool reaches(const author::Attempt& attempt, const scenario::Scenario& s) {
    return attempt.smallest_radius <= s.target.radius;
}

bool plays_to_target(const exercise::Exercise& start, const script::CommandScript& script,
                     const room::Speeds& speeds, std::uint64_t seed) {
    exercise::Exercise exercise(start);
    const scenario::Scenario& s = exercise.simulation().scenario();
    room::PlayedHand hand(script, speeds, s.frame_rate, {}, seed);
    Stay stay(s);
    exercise::StepReport last;
    const int still = static_cast<int>((s.target.hold + 1) * s.frame_rate);
    for (int after = 0; after < still && !stay.stayed() && !exercise.time_is_up(); after += hand.done()) {
        last = exercise.next_frame(hand.next(last)).motion;
        stay.look(exercise.simulation());
    }
    return stay.stayed();
}

/// The number of inexact hands that reach the target.
int trial_of(const exercise::Exercise& start, const script::CommandScript& script,
             const JudgeOptions& options) {
    author::TrialOptions trial;
    trial.jobs = options.threads;
    const auto attempts = author::trial(start, script, off, trial);
    const scenario::Scenario& s = start.simulation().scenario();
    return static_cast<int>(
        std::ranges::count_if(*attempts, [&](const author::Attempt& one) { return reaches(one, s); }));
}

}  // namespace

double Worth::success() const {
    return hands + played > 0 ? static_cast<double>(hands_reach + played_reach) / (hands + played) : 0;
}

std::tuple<double, double, double, int, double> Worth::order() const {
    constexpr double force_step = 0.05, mean_step = 0.02;  // [N]
    return {-success(), std::round(peak_force / force_step), std::round(mean_force / mean_step), turns,
            seconds};
}

void play(exercise::Exercise& exercise, const script::CommandScript& script,
          const std::function<void()>& look) {
    for (int frame = 0; frame <= script.last_frame(0) && !exercise.time_is_up(); ++frame) {
        std::vector<script::Command> commands;
        for (const script::TimedCommand& timed : script.at(frame)) commands.push_back(timed.command);
        exercise.next_frame(commands);
        look();
    }
}

void play_with_dose(Judged& judged, const scenario::Scenario& scenario, const JudgeOptions& options) {
    exercise::Exercise exercise(scenario, exercise::Pictures::Dose, options.cache);
    judged.moments.clear();
    judged.left_out.clear();
    judged.tip_error = judged.force_error = std::nullopt;
    Stay stay(scenario);
    const exercise::Reader reader(exercise.simulation());
    play(exercise, judged.course.script(), [&] {
        const exercise::Observation seen = reader.read(exercise);
        const auto& pushes = seen.push.of;
        judged.moments.push_back(
            {seen.time, exercise.simulation().tip_to_target(), seen.wall_force,
             *std::ranges::max_element(pushes, {}, [](double push) { return std::abs(push); }),
             exercise.simulation().tip()});
        stay.look(exercise.simulation());
    });
    judged.reaches = stay.stayed();
    if (const auto error = exercise.simulation().tip_error()) {
        judged.tip_error = error->tip;
        judged.force_error = std::abs(error->wall_force);
    }
    const exercise::Simulation& end = exercise.simulation();
    judged.model_errors = exercise::model_errors(end);
    for (std::size_t k = 0; k < end.wire().devices.size(); ++k) {
        const std::string said = end.torsion_sentence(static_cast<int>(k));
        if (!said.empty()) judged.left_out.push_back(said);
    }
    if (const std::string said = end.vessels_sentence(); !said.empty()) judged.left_out.push_back(said);
    judged.score = exercise.finish();
    judged.peak_force = judged.score.peak_wall_force;
    judged.mean_force = judged.score.mean_wall_force;
    judged.seconds = judged.score.duration;
}

Judged judge(const exercise::Exercise& start, const Course& course, const JudgeOptions& options) {
    Judged judged;
    judged.course = course;
    const script::CommandScript script = course.script();
    const scenario::Scenario& s = start.simulation().scenario();
    judged.hands = static_cast<int>(author::last_hand);
    judged.hands_reach = trial_of(start, script, options);
    judged.played = played_hands;
    std::vector<char> reached(played_hands);
    geometry::for_each_index(played_hands, options.threads, [&](int k) {
        reached[static_cast<std::size_t>(k)] =
            plays_to_target(start, script, options.speeds, static_cast<std::uint64_t>(k) + 1);
    });
    judged.played_reach = static_cast<int>(std::ranges::count(reached, 1));
    {
        exercise::Exercise exercise(start);
        const author::Attempt exact = author::attempt(exercise, script, author::exact_hand, 0);
        judged.reaches = reaches(exact, s);
        judged.defects = exact.defects;
        judged.score = exact.score;
    }
    judged.peak_force = judged.score.peak_wall_force;
    judged.mean_force = judged.score.mean_wall_force;
    judged.turns = course.turns();
    judged.seconds = judged.score.duration;
    return judged;
}

Judged improved(const exercise::Exercise& start, Judged judged, const JudgeOptions& options) {
    if (judged.hands_reach == judged.hands) return judged;
    for (std::size_t line = 0; line < judged.course.lines.size(); ++line) {
        const auto* turn = std::get_if<script::Rotate>(&judged.course.lines[line].command);
        if (!turn) continue;
        const author::ScriptLine usual = judged.course.lines[line];
        const int frames = usual.last - usual.first + 1;
        // Hands that reach, of turns in steps of 15 degrees to either side.
        constexpr int sides = 3;
        std::array<int, 2 * sides + 1> reach = {};
        const auto turned = [&](int step) {
            Course course = judged.course;
            auto& command = std::get<script::Rotate>(course.lines[line].command);
            command.angle += step * 15 * geometry::degree / frames;
            command.angle = std::round(command.angle / geometry::degree * 10) / 10 * geometry::degree;
            return course;
        };
        for (int step = -sides; step <= sides; ++step) {
            if (options.stop && options.stop()) return judged;
            reach[static_cast<std::size_t>(step + sides)] =
                step == 0 ? judged.hands_reach : trial_of(start, turned(step).script(), options);
        }
        const int most = *std::ranges::max_element(reach);
        if (most <= judged.hands_reach) continue;
        // The middle of the longest row of the best.
        int from = 0, length = 0;
        for (int k = 0; k < static_cast<int>(reach.size());) {
            int end = k;
            while (end < static_cast<int>(reach.size()) && reach[static_cast<std::size_t>(end)] == most)
                ++end;
            if (end - k > length) from = k, length = end - k;
            k = std::max(end, k + 1);
        }
        Judged other = judge(start, turned(from + (length - 1) / 2 - sides), options);
        if (other.reaches && other.success() > judged.success()) judged = std::move(other);
        if (judged.hands_reach == judged.hands) break;
    }
    return judged;
}

std::vector<Sensitivity> sensitivities(const scenario::Scenario& scenario,
                                       const script::CommandScript& script, const JudgeOptions& options) {
    struct End {
        geometry::Vec3 tip = geometry::Vec3::Zero();
        double force = 0;
        bool reached = false;
    };
    const auto end_of = [&](const scenario::Scenario& s, double pushes, double turns) {
        exercise::Exercise exercise(s, exercise::Pictures::None, options.cache);
        script::CommandScript changed = script;
        for (script::TimedCommand& timed : changed.commands) {
            if (auto* advance = std::get_if<script::Advance>(&timed.command)) advance->length *= pushes;
            if (auto* withdraw = std::get_if<script::Withdraw>(&timed.command)) withdraw->length *= pushes;
            if (auto* rotate = std::get_if<script::Rotate>(&timed.command)) rotate->angle *= turns;
        }
        Stay stay(s);
        play(exercise, changed, [&] { stay.look(exercise.simulation()); });
        return End{exercise.simulation().tip(), exercise.score().peak_wall_force, stay.stayed()};
    };
    exercise::Exercise exact(scenario, exercise::Pictures::None, options.cache);
    play(exact, script, [] {});
    const exercise::Simulation& usual = exact.simulation();
    const double usual_force = exact.score().peak_wall_force;
    const std::optional<physics::Response> response = exercise::response_of(usual, physics::Grips::Slide);
    const auto at_end = [&](Sensitivity& of, const std::optional<physics::Moved>& moved) {
        if (!moved) return;
        of.at_end = moved->tip().norm();
        of.force_at_end = std::abs(moved->largest_force(response->contacts()));
    };
    struct Change {
        Sensitivity of;
        std::function<End(double)> end;
    };
    std::vector<Change> changes;
    using Alter = std::function<void(scenario::Scenario&, double)>;
    const auto add = [&](const std::string& what, double by, const char* unit, const Alter& alter) {
        changes.push_back({{what, by, unit}, [&, alter](double part) {
                               scenario::Scenario s = scenario;
                               alter(s, part);
                               return end_of(s, 1, 1);
                           }});
    };
    for (std::size_t k = 0; k < scenario.devices.size(); ++k) {
        const std::string name(scenario.devices[k].name());
        add("EI of the " + name, 5, "%", [k](scenario::Scenario& s, double part) {
            for (physics::StiffnessSection& section : s.devices[k].device.sections) {
                section.rigidity_distal *= 1 + 0.05 * part;
                section.rigidity_proximal *= 1 + 0.05 * part;
            }
        });
        if (response) at_end(changes.back().of, response->to_rigidity(static_cast<int>(k), 0.05));
    }
    add("friction on the wall", 20, "%",
        [](scenario::Scenario& s, double part) { s.wall_friction *= 1 + 0.2 * part; });
    add("stiffness of the wall", 50, "%",
        [](scenario::Scenario& s, double part) { s.wall_stiffness *= 1 + 0.5 * part; });
    if (response) at_end(changes.back().of, response->to_wall_stiffness(0.5));
    // What a device leaves free of a vessel is all that contact knows of either.
    add("radius of the vessels", 0.05, "mm", [](scenario::Scenario& s, double part) {
        for (std::size_t k = 0; k < s.devices.size(); ++k) {
            physics::DeviceSpec& device = s.devices[k].device;
            // It still holds its own lumen, and fits that of the next.
            const double most = k + 1 < s.devices.size() ? s.devices[k + 1].device.inner_diameter - 0.01
                                                         : std::numeric_limits<double>::infinity();
            device.outer_diameter = std::min(
                std::max(device.outer_diameter - 0.1 * part, 1.02 * device.inner_diameter + 0.05), most);
        }
    });
    if (response) at_end(changes.back().of, response->to_radius(0.05));
    const auto add_hand = [&](const char* what, double pushes, double turns) {
        changes.push_back({{what, 5, "%"}, [&, pushes, turns](double part) {
                               return end_of(scenario, 1 + pushes * part, 1 + turns * part);
                           }});
    };
    add_hand("amounts of pushes", 0.05, 0);
    add_hand("amounts of turns", 0, 0.05);

    std::vector<End> ends(2 * changes.size());
    for (std::size_t first = 0; first < ends.size(); first += 4) {
        if (options.stop && options.stop()) return {};
        geometry::for_each_index(static_cast<int>(std::min<std::size_t>(4, ends.size() - first)),
                                 options.threads, [&](int k) {
                                     const std::size_t index = first + static_cast<std::size_t>(k);
                                     ends[index] = changes[index / 2].end(k % 2 == 0 ? 1 : -1);
                                 });
    }
    std::vector<Sensitivity> all;
    for (std::size_t k = 0; k < changes.size(); ++k) {
        Sensitivity one = changes[k].of;
        for (const End& end : {ends[2 * k], ends[2 * k + 1]}) {
            one.tip = std::max(one.tip, (end.tip - usual.tip()).norm());
            one.force = std::max(one.force, std::abs(end.force - usual_force));
            one.reach += end.reached;
        }
        all.push_back(one);
    }
    return all;
}

}  // namespace plan
