#include "engine/author/check.h"

#include <algorithm>
#include <fmt/format.h>
#include <optional>

#include "engine/author/attempt.h"
#include "engine/exercise/exercise.h"
#include "engine/io/error.h"
#include "engine/run/headless.h"
#include "engine/run/picture_file.h"
#include "engine/run/still.h"
#include "engine/scenario/placement.h"
#include "engine/scenario/reach.h"
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

}  // namespace author
