#include "engine/studies/hands_behaviours.h"

#include <algorithm>
#include <fmt/format.h>

#include "engine/studies/hands_catheters.h"
#include "engine/studies/hands_trial.h"

namespace studies {
namespace {

using geometry::degree;
using script::Held;

double largest_push(const HandCourse& course, std::size_t first = 0, Held held = Held::Wire) {
    double most = 0;
    const auto& samples = course.samples();
    for (std::size_t k = first; k < samples.size(); ++k)
        most = std::max(most, samples[k].devices[course.at(held)].push);
    return most;
}

/// The hub's angle at which the tip's passes this one first, of the samples of a chapter; not a number where
/// it does not [rad].
double hub_at(const std::vector<HandSample>& samples, int chapter, double tip) {
    for (std::size_t k = 1; k < samples.size(); ++k) {
        if (samples[k].chapter != chapter || samples[k - 1].chapter != chapter) continue;
        const HandReading &a = samples[k - 1].devices[0], &b = samples[k].devices[0];
        if ((a.tip_roll - tip) * (b.tip_roll - tip) > 0 || a.tip_roll == b.tip_roll) continue;
        return a.turned + (tip - a.tip_roll) / (b.tip_roll - a.tip_roll) * (b.turned - a.turned);
    }
    return std::nan("");
}

/// The widest that the hub's angle differs between a chapter of turning right and one of turning left, at the
/// same angle of the tip [rad].
double hysteresis(const std::vector<HandSample>& samples, int right, int left) {
    double low = 1e9, high = -1e9, widest = 0;
    for (const HandSample& s : samples)
        if (s.chapter == right)
            low = std::min(low, s.devices[0].tip_roll), high = std::max(high, s.devices[0].tip_roll);
    // Not where the hand has just turned about, and what friction held is let go.
    for (double tip = low + 0.05 * (high - low); tip < high - 0.05 * (high - low); tip += degree) {
        const double width = hub_at(samples, right, tip) - hub_at(samples, left, tip);
        if (std::isfinite(width)) widest = std::max(widest, std::abs(width));
    }
    return widest;
}

/// The wire's bend, wide for the arch, meets both walls of the aorta: the hub winds it up until it flips.
BehaviourRun whip(const StudyOptions& options) {
    Trial trial(options, "whip", {"arch", {{"chain.adaptive", "false"}}},
                "glide035 with a bend of 130 deg over 45 mm",
                "420 mm in, then the hub is turned by 400 deg and back");
    HandCourse& course = trial.course;
    course.feed(420);
    trial.draw("before");
    const std::size_t first = course.samples().size();
    course.begin();
    course.turn(400 * degree);
    trial.draw("after");
    course.begin();
    course.turn(-400 * degree);
    double largest = 0, hub = 0;
    const auto& samples = course.samples();
    for (std::size_t k = first; k < samples.size() && samples[k].chapter == 1; ++k) {
        const Vec3 &a = samples[k - 1].devices[0].along, &b = samples[k].devices[0].along;
        const double angle = std::acos(std::clamp(a.dot(b), -1.0, 1.0));
        if (angle > largest) largest = angle, hub = samples[k].devices[0].turned;
    }
    return trial.finish(largest / degree, largest > 10 * degree,
                        fmt::format("at {:.0f} deg of the hub; hysteresis {:.0f} deg of the hub",
                                    hub / degree, hysteresis(samples, 1, 2) / degree));
}

/// The wire of the bench, in an artery that bends: where the exercise's expert turns it.
BehaviourRun wind_up(const StudyOptions& options) {
    Trial trial(
        options, "wind-up", {"cerebral", {}}, "floppy014",
        "57 mm on, into the first part of the middle cerebral artery, then the hub is turned by a turn "
        "to and fro, three times");
    trial.course.feed(57);
    trial.draw("before");
    for (const double turn : {360.0, -360.0, 360.0}) {
        trial.course.begin();
        trial.course.turn(turn * degree);
    }
    const auto& samples = trial.course.samples();
    const double widest = hysteresis(samples, 3, 2);
    double torque = 0;
    for (const HandSample& s : samples) torque = std::max(torque, std::abs(s.devices[0].torque));
    return trial.finish(widest / degree, widest > 1 * degree,
                        fmt::format("torque at the hub up to {:.2f} N mm", torque));
}

BehaviourRun stick_slip(const StudyOptions& options) {
    Trial trial(options, "stick-slip", {"renal", {}}, "glide035",
                "200 mm in; five times the hand rests for 0.4 s and pushes on by 3 mm");
    HandCourse& course = trial.course;
    course.feed(200);
    trial.draw("before");
    double ratio = 0;
    std::string each;
    constexpr int times = 5;
    for (int k = 0; k < times; ++k) {
        course.begin();
        course.hold(6);
        const std::size_t first = course.samples().size();
        course.feed_step = 0.05;
        course.feed(3);
        double peak = 0, slides = 0;
        int count = 0;
        for (std::size_t n = first; n < course.samples().size(); ++n) {
            const HandReading& r = course.samples()[n].devices[0];
            const double way = r.inserted - course.samples()[first - 1].devices[0].inserted;
            if (way < 1) peak = std::max(peak, r.push);
            if (way > 2) slides += r.push, ++count;
        }
        slides /= count;
        ratio += peak / slides / times;
        each += fmt::format("{}{:.3f} over {:.3f}", k > 0 ? ", " : "", peak, slides);
    }
    return trial.finish(ratio, ratio > 1.02, "each time [N]: " + each);
}

BehaviourRun prolapse(const StudyOptions& options) {
    Trial trial(options, "prolapse", {"renal", {}}, "glide035 with a bend of 100 deg over 30 mm",
                "turned by 60 deg, so that its tip goes into the internal iliac artery, and 180 mm in");
    HandCourse& course = trial.course;
    course.turn_step = 5 * degree;
    course.turn(60 * degree);
    course.feed(130);
    trial.draw("in the branch");
    course.feed(50);
    const WayBack back = way_back(course.samples(), 0, 0);
    const HandSample &from = course.samples()[back.from], &to = course.samples()[back.to];
    trial.draw("after");
    return trial.finish(
        back.length, back.length > 2,
        fmt::format("from {} to {}, push {:.2f} to {:.2f} N", trial.vessel_at(from.devices[0].tip),
                    trial.vessel_at(to.devices[0].tip), from.devices[0].push, to.devices[0].push));
}

BehaviourRun buckling(const StudyOptions& options) {
    Trial trial(options, "buckling", {"iliac_aorta", {{"guidewire.buckling_force_N", "0"}}},
                "glide035 without a stated force of buckling",
                "pushed on until the narrowing aorta above the image holds the tip and the shaft bows");
    const bool bowed = trial.course.feed(530, Held::Wire, [&] { return trial.course.last().buckled; });
    trial.draw("at the end");
    return trial.finish(largest_push(trial.course), bowed,
                        fmt::format("after {:.0f} mm; Euler's load of the shaft's 100 mm outside is {:.2f} N",
                                    trial.course.reading().inserted, trial.course.simulation().passes_on()));
}

/// The hub is drawn back until the tip has moved by a millimetre.
BehaviourRun release(const StudyOptions& options) {
    Trial trial(options, "release", {"renal", {}}, "glide035 with a bend of 100 deg over 30 mm",
                "115 mm in, its tip in the internal iliac artery, then drawn back");
    HandCourse& course = trial.course;
    course.feed(115);
    trial.draw("pushed");
    const double pushed = course.reading().push, stored = course.last().stored,
                 inside = course.reading().inserted;
    const Vec3 tip = course.reading().tip;
    course.begin();
    trial.fine_steps();
    const bool follows =
        course.feed(-40, Held::Wire, [&] { return (course.reading().tip - tip).norm() > 1; });
    trial.draw("released");
    const double back = inside - course.reading().inserted;
    return trial.finish(follows ? back : std::nan(""), follows && back > 1.5,
                        fmt::format("push {:.2f} to {:.2f} N, energy stored {:.1f} to {:.1f} N mm", pushed,
                                    course.reading().push, stored, course.last().stored));
}

/// The bend comes down into a sinus, and the wire folds over it.
BehaviourRun root_loop(const StudyOptions& options) {
    Trial trial(options, "root loop", {"coronary", {}}, "glide035 with a bend of 90 deg over 45 mm",
                "from the right arm, turned by 180 deg and 300 mm in");
    HandCourse& course = trial.course;
    course.turn_step = 5 * degree;
    course.turn(180 * degree);
    double width = 0, past = 0, inside = 0;
    for (int k = 0; k < 60; ++k) {
        course.feed(5);
        const Polyline path = course.path();
        const double now = loop_width(path, -Vec3::UnitZ(), 15);
        if (!(now > width)) continue;
        if (width == 0) trial.draw("as the loop forms");
        width = now, inside = course.reading().inserted, past = trial.past_junction(path);
    }
    trial.draw("at the end");
    return trial.finish(
        width > 0 ? width : std::nan(""), width > 0 && past < trial.depth_of_root(),
        fmt::format("with {:.0f} mm inside, its turn {:.0f} mm below the sinotubular junction; "
                    "push up to {:.2f} N",
                    inside, past, largest_push(course)));
}

BehaviourRun straightening(const StudyOptions& options) {
    Trial trial(options, "straightening", {"iliac_aorta", {{"guidewire.device", "\"lunderquist035\""}}},
                "lunderquist035, vessels in tissue",
                "from the groin up the aorta, 450 mm, so that the shaft lies in the iliac artery");
    trial.course.feed(20);
    trial.draw("before");
    double most = 0, at = 0;
    trial.course.feed(430, Held::Wire, [&] {
        const double now = trial.course.last().vessel_moved;
        if (now > most) most = now, at = trial.course.reading().inserted;
        return trial.course.last().buckled;
    });
    trial.draw("after");
    return trial.finish(
        most, most > 0.5,
        fmt::format("with {:.0f} mm inside; push up to {:.2f} N", at, largest_push(trial.course)));
}

BehaviourRun wedge(const StudyOptions& options) {
    Trial trial(options, "wedge", {"coronary_lad", {}}, "floppy014",
                "pushed on until a branch is too narrow for its tip and the shaft outside bows");
    HandCourse& course = trial.course;
    course.feed(80);
    trial.fine_steps();
    const bool bowed = course.feed(60, Held::Wire, [&] { return course.last().buckled; });
    trial.draw("at the end");
    const double end = course.reading().inserted;
    std::size_t k = course.samples().size() - 1;
    while (k > 0 && course.samples()[k].devices[0].inserted > end - 5) --k;
    const HandReading& before = course.samples()[k].devices[0];
    const double way = (course.reading().tip - before.tip).norm();
    return trial.finish(course.reading().push - before.push, bowed && way < 4,
                        fmt::format("in {}; the tip goes {:.1f} mm of the 5, the push rises to {:.2f} N",
                                    trial.vessel_at(course.reading().tip), way, course.reading().push));
}

const Behaviour all[] = {whip,      wind_up,       stick_slip, prolapse, buckling,
                         kick_back, deep_seating,  wire_drag,  release,  reformed_simmons,
                         root_loop, straightening, wedge};

}  // namespace

std::span<const Behaviour> behaviours() {
    return all;
}

WayBack way_back(std::span<const HandSample> samples, std::size_t device, std::size_t first) {
    WayBack most;
    double way = 0, farthest = 0;
    std::size_t from = first;
    for (std::size_t k = first + 1; k < samples.size(); ++k) {
        const HandReading &a = samples[k - 1].devices[device], &b = samples[k].devices[device];
        way += (b.tip - a.tip).dot(a.along);
        if (way > farthest) farthest = way, from = k;
        if (farthest - way > most.length) most = {farthest - way, from, k};
    }
    return most;
}

double loop_width(const Polyline& path, const Vec3& direction, double behind) {
    const auto reach = [&](std::size_t k) { return path[k].dot(direction); };
    std::size_t turn = 0;
    for (std::size_t k = 0; k < path.size(); ++k) {
        if (reach(k) > reach(turn)) turn = k;
        if (reach(k) > reach(turn) - behind) continue;
        std::size_t before = turn;
        while (before > 0 && reach(before) > reach(turn) - behind) --before;
        if (reach(before) <= reach(turn) - behind) return (path[before] - path[k]).norm();
        turn = k;  // the path began there, and has only come back
    }
    return std::nan("");
}

}  // namespace studies
