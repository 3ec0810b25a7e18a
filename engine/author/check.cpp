#include "engine/author/check.h"

#include <algorithm>
#include <fmt/format.h>
#include <random>
#include <span>

#include "engine/author/attempt.h"
#include "engine/exercise/exercise.h"
#include "engine/exercise/grade.h"
#include "engine/io/error.h"
#include "engine/run/headless.h"
#include "engine/run/picture_file.h"
#include "engine/run/still.h"
#include "engine/scenario/model_choice.h"
#include "engine/scenario/placement.h"
#include "physics/geometry/polyline.h"
#include "render/picture/resample.h"

namespace author {
namespace {

using Verdict = Finding::Verdict;

/// What was looked at so far.
class Findings {
public:
    /// Takes what `look` says, or what it refuses with. Returns whether it is fine.
    template <class Look>
    bool look(const std::string& what, const Look& look) {
        try {
            list_.push_back({Verdict::Fine, what, look()});
        } catch (const io::InputError& error) {
            list_.push_back({Verdict::Wrong, what, error.what()});
        }
        return list_.back().verdict == Verdict::Fine;
    }
    void missing(const char* what, std::string said) {
        list_.push_back({Verdict::Missing, what, std::move(said)});
    }
    std::vector<Finding> take() { return std::move(list_); }

private:
    std::vector<Finding> list_;
};

/// Throws InputError where no way through the vessels leads the device there.
std::string path_to_target(const scenario::Scenario& s, const anatomy::Anatomy& vessels) {
    const geometry::Vec3 target = scenario::target_of(s, vessels);
    const scenario::Reach reach(vessels);
    const auto stations = reach.stations();
    const auto nearest =
        std::ranges::min_element(stations, {}, [&](const geometry::Station& at) { return at.power(target); });
    const int end = static_cast<int>(nearest - stations.begin());
    const auto [before, lengths] =
        reach.paths_from(vessels.ends[*anatomy::find_end(vessels, s.entry.end)].opening);
    const scenario::Device& device = s.devices[static_cast<std::size_t>(*s.index_of(s.target.device))].device;
    const auto refuse = [&](const std::string& why) {
        throw io::InputError(io::located(s.place("target"), "the target cannot be reached: " + why));
    };
    const double length = lengths[static_cast<std::size_t>(end)];
    if (length < 0) refuse(fmt::format("no vessel leads there from '{}'", s.entry.end));
    if (length > device.length)
        refuse(fmt::format("it is {:.0f} mm from '{}', and the {} is {:.0f} mm long", length, s.entry.end,
                           script::name_of(s.target.device), device.length));
    // A branch begins within its parent, which is wider there.
    const auto room = [&](int at) {
        return std::max(stations[at].radius, reach.room(stations[at].centre, at));
    };
    int narrowest = end;
    for (int at = end; at >= 0; at = before[static_cast<std::size_t>(at)])
        if (room(at) < room(narrowest)) narrowest = at;
    if (!physics::enters(device.outer_diameter, room(narrowest)))
        refuse(fmt::format("'{}' is {:.2g} mm wide at its narrowest on the way, and the {} {:.2g} mm thick",
                           reach.name_of(narrowest), 2 * room(narrowest), script::name_of(s.target.device),
                           device.outer_diameter));
    return fmt::format("{:.0f} mm from '{}', in '{}'; the narrowest on the way is {:.1f} mm wide, in '{}'",
                       length, s.entry.end, reach.name_of(end), 2 * room(narrowest),
                       reach.name_of(narrowest));
}

std::string played(const scenario::Scenario& s, const script::CommandScript& solution,
                   const anatomy::ModelCache& cache) {
    run::check(s, solution);
    exercise::Exercise exercise(s, exercise::Pictures::None, cache, &solution);
    const Attempt made = attempt(exercise, solution, exact_hand, 0);
    if (!made.score.completed)
        throw io::InputError("{}: it does not reach the target; its tip is {:.1f} mm away at its nearest",
                             solution.file, made.nearest);
    return fmt::format("reaches the target after {:.1f} s", *made.score.completion_time);
}

double clumsy_attempt(const exercise::Exercise& start, const scenario::Benchmark& skilled, unsigned seed) {
    exercise::Exercise exercise(start);
    std::mt19937 random(seed);
    const auto pick = [&random](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    const double rate = exercise.simulation().scenario().frame_rate;
    const int frames = std::min(600, static_cast<int>(3 * skilled.completed_after.mean() * rate));
    double push = 0, turn = 0;
    for (int frame = 0; frame < frames && !exercise.time_is_up(); ++frame) {
        std::vector<script::Command> commands;
        if (frame % 20 == 0) {
            push = pick(10) - 4;
            turn = 0.1 * (pick(7) - 3);
            commands.push_back(script::Beam{pick(3) > 0});
        }
        if (push > 0) commands.push_back(script::Advance{push});
        if (push < 0) commands.push_back(script::Withdraw{-push});
        if (turn != 0) commands.push_back(script::Rotate{turn});
        exercise.next_frame(commands);
        if (exercise.score().completed) break;
    }
    return exercise::grade(exercise.finish(), skilled).points;
}

}  // namespace

std::vector<Finding> check(const scenario::ExerciseFiles& files, const std::filesystem::path& catalogue,
                           const anatomy::ModelCache& cache) {
    Findings found;
    scenario::Scenario s;
    anatomy::Anatomy vessels;
    const bool usable = found.look("scenario", [&] {
        s = scenario::load_scenario(files.file, catalogue);
        return s.title;
    }) && found.look("vessels", [&] {
        vessels = scenario::anatomy_of(s, cache);
        return fmt::format("{} branches, {} ends, {} targets", vessels.branches.size(), vessels.ends.size(),
                           vessels.targets.size());
    });
    bool placed = usable && found.look("entry", [&] {
        const double length = geometry::length_of(scenario::entry_of(s, vessels).points);
        return fmt::format("{:g} mm of wire from '{}', at most {:.0f} would fit", s.wire().inserted,
                           s.entry.end, length);
    });
    if (usable) {
        const bool has_path = anatomy::find_end(vessels, s.entry.end).has_value();
        placed &= found.look("target", [&] {
            if (has_path) return path_to_target(s, vessels);
            scenario::target_of(s, vessels);
            return std::string("lies in a vessel");
        });
    }
    placed = placed && found.look("wall, image", [&] {
        const exercise::Exercise exercise(s, exercise::Pictures::All, cache);
        const scenario::ModelChoice& choice = exercise.simulation().choice();
        return fmt::format("can be made; the vessels ask for segments of {:.2g} mm or less",
                           choice.segment_length);
    });
    for (std::size_t k = 0; usable && k < s.lesson.patients.size(); ++k)
        found.look(fmt::format("patient {}", k + 2), [&] {
            const scenario::Scenario other =
                scenario::load_scenario(files.file, catalogue, {}, std::to_string(k + 2));
            const exercise::Exercise exercise(other, exercise::Pictures::None, cache);
            return other.patient_who + ", target " + path_to_target(other, exercise.simulation().anatomy());
        });
    if (files.solution.empty())
        found.missing("solution", fmt::format("there is none: {}.gw", files.name));
    else if (placed)
        found.look("solution", [&] { return played(s, script::load_commands(files.solution), cache); });
    if (files.picture.empty())
        found.missing("picture", fmt::format("there is none: {}.png", files.name));
    else
        found.look("picture", [&] {
            const render::GrayImage image = run::read_picture(files.picture);
            return fmt::format("{} x {} pixels", image.width, image.height);
        });
    return found.take();
}

bool is_usable(const std::vector<Finding>& findings) {
    return std::ranges::none_of(findings, [](const Finding& one) { return one.verdict == Verdict::Wrong; });
}

void write_thumbnail(const std::filesystem::path& png, const scenario::Scenario& s,
                     const anatomy::ModelCache& cache) {
    constexpr int side = 256;  // as those that ship
    run::StillRequest request;
    request.mode = script::ImagingMode::Dsa;
    run::write_picture(
        png, render::resized(run::render_still(s, script::CommandScript(), request, cache), side, side));
}

std::vector<std::string> missing_of_lesson(const scenario::ExerciseFiles& files,
                                           const scenario::Scenario& s) {
    std::vector<std::string> missing;
    const scenario::Lesson& lesson = s.lesson;
    if (lesson.level < 1) missing.push_back("[lesson] level");
    if (lesson.briefing.empty()) missing.push_back("[lesson] briefing");
    if (lesson.hints.empty()) missing.push_back("[lesson] hints");
    if (lesson.views.empty()) missing.push_back("[[lesson.view]]");
    if (!lesson.benchmark.given() && !lesson.guided())
        missing.push_back(fmt::format("{} of {}", files.name, scenario::benchmark_file));
    if (files.picture.empty()) missing.push_back(files.name + ".png");
    return missing;
}

std::vector<std::string> faults_of_solution(const scenario::Scenario& s, const Attempt& made) {
    std::vector<std::string> faults = made.defects;
    const exercise::Score& score = made.score;
    if (!score.completed)
        faults.push_back(
            fmt::format("the target is not reached: the tip is {:.2f} mm away at its nearest", made.nearest));
    for (const exercise::HandlingErrorMark& mark : score.handling_errors)
        faults.push_back(fmt::format("frame {}: {}", mark.first,
                                     exercise::handling_error_texts[static_cast<std::size_t>(mark.kind)]));
    if (const int wrong = score.wrong_entries(); wrong > 0)
        faults.push_back(fmt::format("{} entries into wrong branches", wrong));
    const scenario::Benchmark& skilled = s.lesson.benchmark;
    if (!skilled.given() || !score.completed) return faults;
    if (const double points = exercise::grade(score, skilled).points; points < least_points_of_solution)
        faults.push_back(fmt::format("it is worth {:.1f} points by the benchmark, {:g} or more are right",
                                     points, least_points_of_solution));
    // The benchmark is of this way: a script can be up to four times as fast as keys are.
    const auto is_near = [&](const char* key, double mean, double most) {
        if (mean >= most)
            faults.push_back(
                fmt::format("the benchmark's {} of {:.4g} is far above the solution's; less than "
                            "{:.4g} is near it",
                            key, mean, most));
    };
    is_near("completed_after_s", skilled.completed_after.mean(), 4 * *score.completed_after + 2);
    is_near("wire_travel_mm", skilled.wire_travel.mean(), 1.1 * score.wire_travel + 5);
    return faults;
}

scenario::Benchmark benchmark_for(const scenario::Scenario& s, const exercise::Score& solution) {
    if (s.lesson.benchmark.given()) return s.lesson.benchmark;
    return exercise::benchmark_of(std::span(&solution, 1), "the solution alone", s.content);
}

std::vector<double> clumsy_points(const exercise::Exercise& start, const scenario::Benchmark& skilled) {
    std::vector<double> points;
    for (unsigned seed = 1; seed <= clumsy_hands; ++seed)
        points.push_back(clumsy_attempt(start, skilled, seed));
    return points;
}

}  // namespace author
