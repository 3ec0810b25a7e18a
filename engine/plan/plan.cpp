#include "engine/plan/plan.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <set>
#include <tuple>

#include "engine/exercise/device_rules.h"
#include "engine/exercise/exercise.h"
#include "engine/io/csv.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/plan/way_views.h"
#include "physics/geometry/hash.h"

namespace plan {
namespace {

constexpr double enough_success = 0.9;  // of inexact hands

/// Those that differ in what is done, not only in when a turn is made: the fewest turns, then the shortest
/// first.
std::vector<Course> distinct(std::vector<Course> courses) {
    std::ranges::stable_sort(courses, {},
                             [](const Course& one) { return std::pair(one.turns(), one.frames); });
    std::set<std::string> known;
    std::vector<Course> kept;
    for (Course& course : courses) {
        std::string what;
        for (const author::ScriptLine& line : course.lines) {
            const auto* turn = std::get_if<script::Rotate>(&line.command);
            what += turn ? fmt::format("turn {} {:.0f};", static_cast<int>(turn->held),
                                       turn->angle * (line.last - line.first + 1) / geometry::degree / 20)
                    : std::holds_alternative<script::Exchange>(line.command)
                        ? script::to_text(line.command)
                        : fmt::format("{};", line.command.index());
        }
        if (known.insert(what).second) kept.push_back(std::move(course));
    }
    return kept;
}

bool is_within(const Judged& judged, const PlanOptions& options) {
    return !(options.most_force && judged.peak_force > *options.most_force) &&
           !(options.most_turns && judged.turns > *options.most_turns);
}

/// The beam is on from the start.
Course with_beam(Course course) {
    course.lines.insert(course.lines.begin(), author::ScriptLine{0, 0, script::Beam{true}});
    return course;
}

/// The wires that this scenario's may be exchanged for; of others `planned` says why not.
std::vector<std::string> exchangeable(const std::vector<std::string>& wires,
                                      const scenario::Scenario& scenario, Planned& planned) {
    std::vector<std::string> fit;
    if (wires.empty()) return fit;
    if (scenario.devices.size() < 2) {
        planned.not_tried.push_back(
            "The wire was not exchanged: nothing lies around it that would keep its place");
        return fit;
    }
    for (const std::string& wire : wires) {
        if (wire == scenario.wire().device.name) continue;
        try {
            static_cast<void>(exercise::device_of_catalogue(script::DeviceRole::Wire, wire, scenario));
            fit.push_back(wire);
        } catch (const io::InputError& error) {
            planned.not_tried.push_back(fmt::format("The wire was not exchanged: {}", error.what()));
        }
    }
    return fit;
}

void take(Planned& planned, const Judged& judged) {
    static_cast<Worth&>(planned) = judged;
    planned.impulse = judged.score.wall_force_impulse;
    planned.travel = judged.score.wire_travel;
    planned.air_kerma = judged.score.air_kerma;
    planned.area_product = judged.score.area_product;
    planned.contrast = judged.score.contrast;
    planned.tip_error = judged.tip_error;
    planned.force_error = judged.force_error;
    planned.model_errors = judged.model_errors;
    planned.left_out = judged.left_out;
    planned.handling_errors = static_cast<int>(judged.score.handling_errors.size());
    planned.exchanges = judged.course.exchanges();
    planned.defects = judged.defects;
    planned.moments = judged.moments;
    planned.left = judged.course.left;
}

}  // namespace

void rank(std::vector<Planned>& all) {
    const auto order = [](const Planned& one) {
        const int group = !one.refused.empty() ? 3 : !one.reached ? 2 : !one.within_limits ? 1 : 0;
        return std::tuple(group, one.reached ? 0 : std::abs(one.left), one.order(), one.name);
    };
    std::ranges::stable_sort(all, [&](const Planned& a, const Planned& b) { return order(a) < order(b); });
}

std::string identity_of(const CaseText& text, const Candidate& candidate, const PlanOptions& options) {
    geometry::Hash hash;
    const auto add = [&hash](const std::string& part) {
        hash.add(std::uint64_t{part.size()});
        hash.add(part.data(), part.size());
    };
    const scenario::Scenario scenario = scenario::parse_scenario(text.toml, text.file, options.catalogue);
    hash.add(scenario.content);
    hash.add(anatomy::hash_of(scenario::anatomy_of(scenario, options.cache)));
    add(candidate.name);
    add(options.program);
    for (const std::string& wire : options.search.wires) add(wire);
    add(fmt::format("{} {} {} {} {} {}", options.search.seed, options.search.restarts,
                    options.search.most_frames, options.search.courses, options.most_force.value_or(-1),
                    options.most_turns.value_or(-1)));
    return io::hash_text(hash.value());
}

Planned plan(const CaseText& text, const Candidate& candidate, const PlanOptions& options) {
    Planned planned;
    planned.name = candidate.name.empty() ? "own" : candidate.name;
    planned.identity = identity_of(text, candidate, options);
    planned.settings = fmt::format("seed {}, up to {} simulated frames in each search, {} restart{}",
                                   options.search.seed, options.search.most_frames, options.search.restarts,
                                   options.search.restarts == 1 ? "" : "s");
    const CaseText own = with_devices(text, candidate);
    planned.scenario = moved_to(own, own.file).toml;
    const scenario::Scenario scenario = scenario::parse_scenario(own.toml, own.file, options.catalogue);
    for (const scenario::PlacedDevice& device : scenario.devices)
        planned.devices.push_back(fmt::format("{}: {}", device.name(), device.device.title));
    const auto say = [&](double part, const std::string& doing) {
        if (options.progress) options.progress(part, fmt::format("{}: {}", planned.name, doing));
    };
    const auto stop_asked = [&] {
        if (options.stop && options.stop()) throw Stopped();
    };
    say(0, "vessels");
    std::optional<exercise::Exercise> start;
    try {
        start.emplace(scenario, exercise::Pictures::None, options.cache);
    } catch (const io::InputError& error) {
        planned.refused = error.what();
        return planned;
    }
    SearchOptions search = options.search;
    search.wires = exchangeable(options.search.wires, scenario, planned);
    search.progress = [&](double part, double left) {
        say(0.7 * part, fmt::format("{:.0f} mm from the target", std::abs(left)));
    };
    bool interrupted = false;
    search.stop = [&] {
        interrupted = options.stop && options.stop();
        return interrupted || (options.time_is_up && options.time_is_up());
    };
    const JudgeOptions judging{options.search.threads, options.speeds, options.cache, options.stop};
    const auto preferred = [&](const Judged& a, const Judged& b) {
        const bool in_a = is_within(a, options), in_b = is_within(b, options);
        return in_a != in_b ? in_a : a.order() < b.order();
    };
    std::optional<Judged> best;
    const auto is_enough = [&] {
        return best && best->success() >= enough_success && is_within(*best, options);
    };
    // Where few hands could follow what was found, it searches again, with other angles.
    for (int again = 0; again <= options.search.restarts && !is_enough() && !planned.stopped; ++again) {
        if (again > 0 && !best) break;
        search.other_angles = again > 0;
        search.seed = options.search.seed + static_cast<std::uint64_t>(again);
        const Found found = plan::search(*start, search);
        if (interrupted) throw Stopped();
        planned.frames += found.frames;
        planned.states += found.states;
        planned.courses += found.courses.size();
        planned.stopped = found.stopped;
        if (again == 0) {
            planned.failures = found.failures;
            planned.left = found.nearest.left;
            planned.course = with_beam(found.nearest).text();
        }
        int judged = 0;
        for (const Course& course : distinct(found.courses)) {
            stop_asked();
            say(0.7 + 0.02 * judged++, "inexact hands");
            Judged one = judge(*start, course, judging);
            if (one.reaches && (!best || preferred(one, *best))) best = std::move(one);
            if (best && best->success() >= 1 && is_within(*best, options)) break;
        }
        if (!best || is_enough()) continue;
        say(0.85, "turns to the middle of what succeeds");
        best = improved(*start, std::move(*best), judging);
        stop_asked();
    }
    if (!best) return planned;
    say(0.9, "views and dose");
    const anatomy::Anatomy& vessels = start->simulation().anatomy();
    const std::vector<StepViews> steps = views_on_way(scenario, vessels, options.cache);
    const Course bare = best->course;
    best->course = with_views(bare, steps, *start, true);
    play_with_dose(*best, scenario, judging);
    if (!best->reaches) {
        // Time was up, or waiting changed what came of a push.
        best->course = with_views(bare, steps, *start, false);
        play_with_dose(*best, scenario, judging);
    }
    planned.reached = true;
    planned.within_limits = is_within(*best, options);
    take(planned, *best);
    planned.course = best->course.text();
    return planned;
}

void add_sensitivities(std::vector<Planned>& all, const PlanOptions& options) {
    if (all.empty() || !all.front().reached || !all.front().sensitivities.empty()) return;
    Planned& first = all.front();
    if (options.progress) options.progress(0.95, "what the best course depends on");
    const scenario::Scenario scenario =
        scenario::parse_scenario(first.scenario, first.name + ".toml", options.catalogue);
    first.sensitivities =
        plan::sensitivities(scenario, script::parse_commands(first.course, first.name),
                            {options.search.threads, options.speeds, options.cache, options.stop});
    if (options.stop && options.stop()) throw Stopped();
}

std::string to_csv(const std::vector<Planned>& all) {
    io::Table table{"plan",
                    {"rank",
                     "devices",
                     "reached",
                     "within_limits",
                     "success",
                     "hands_reach",
                     "hands",
                     "played_reach",
                     "played",
                     "peak_wall_force_N",
                     "mean_wall_force_N",
                     "turns",
                     "exchanges",
                     "travel_mm",
                     "time_s",
                     "air_kerma_mGy",
                     "area_product_Gy_cm2",
                     "contrast_ml",
                     "handling_errors",
                     "tip_error_mm",
                     "wall_force_error_N",
                     "tip_error_wall_mm",
                     "tip_error_vessels_mm",
                     "tip_error_twist_mm",
                     "left_mm",
                     "ends",
                     "frames_simulated",
                     "stopped",
                     "refused"}};
    int place = 0;
    for (const Planned& one : all) {
        const auto known = [](const std::optional<double>& value) {
            return value ? io::TableCell(*value) : io::TableCell();
        };
        const auto of = [&](double value) { return one.reached ? io::TableCell(value) : io::TableCell(); };
        std::string ends;
        if (!one.reached && !one.failures.empty()) {
            const Failure& why = one.failures.front();
            ends = fmt::format("{} {} in {} at {:.0f} mm", script::name_of(why.device),
                               ending_names[static_cast<std::size_t>(why.ending)], why.branch, why.along);
        }
        table.add({++place,
                   one.name,
                   one.reached ? "yes" : "no",
                   one.within_limits ? "yes" : "no",
                   of(one.success()),
                   of(one.hands_reach),
                   of(one.hands),
                   of(one.played_reach),
                   of(one.played),
                   of(one.peak_force),
                   of(one.mean_force),
                   of(one.turns),
                   of(one.exchanges),
                   of(one.travel),
                   of(one.seconds),
                   known(one.air_kerma),
                   known(one.area_product),
                   of(one.contrast),
                   of(one.handling_errors),
                   known(one.tip_error),
                   known(one.force_error),
                   known(one.model_errors.wall),
                   known(one.model_errors.vessels),
                   known(one.model_errors.twist),
                   one.reached ? 0.0 : std::abs(one.left),
                   ends,
                   static_cast<double>(one.frames),
                   one.stopped ? "yes" : "no",
                   one.refused});
    }
    return io::to_csv(table);
}

}  // namespace plan
