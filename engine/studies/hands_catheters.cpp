#include "engine/studies/hands_catheters.h"

#include <algorithm>
#include <fmt/format.h>

#include "engine/studies/hands_trial.h"

namespace studies {

using geometry::degree;
using script::Held;

/// A stiffer part of the wire comes into the siphon, which takes up the slack of the microcatheter.
BehaviourRun kick_back(Trial& trial) {
    HandCourse& course = trial.course;
    course.feed(50);
    course.feed(40, Held::Microcatheter);
    trial.draw("before");
    const std::size_t first = course.samples().size() - 1;
    course.begin();
    course.feed(75, Held::Wire, [&] { return course.last().buckled; });
    trial.draw("after");
    const std::size_t device = course.at(Held::Microcatheter);
    const WayBack back = way_back(course.samples(), device, first);
    const auto& samples = course.samples();
    return trial.finish(
        back.length, back.length > 1,
        fmt::format("the microcatheter's tip, its hub held; the wire {:.0f} to {:.0f} mm inside",
                    samples[back.from].devices[0].inserted, samples[back.to].devices[0].inserted),
        Held::Microcatheter);
}

BehaviourRun deep_seating(Trial& trial) {
    HandCourse& course = trial.course;
    course.begin();
    const bool bowed =
        course.feed(112, Held::Catheter, [&] { return course.last().buckled || course.last().refused; });
    trial.draw("at the end");
    const HandReading& end = course.reading(Held::Catheter);
    return trial.finish(end.inserted, end.inserted > 15,
                        fmt::format("in {}, {} at {:.2f} N", trial.vessel_at(end.tip),
                                    bowed ? "the shaft bows" : "the way ends", end.push),
                        Held::Catheter);
}

BehaviourRun wire_drag(Trial& trial) {
    HandCourse& course = trial.course;
    const double inside = course.reading().inserted;
    course.begin();
    course.feed(30, Held::Catheter);
    const double on = course.reading().inserted - inside;
    course.begin();
    course.feed(-60, Held::Catheter);
    trial.draw("after");
    const double back = course.reading().inserted - inside - on;
    const double most = std::max(std::abs(on) / 30, std::abs(back) / 60);
    return trial.finish(
        most, most > 0.02,
        fmt::format("the wire goes {:.2f} mm with the catheter in, {:.2f} mm with it out", on, back),
        Held::Catheter);
}

/// By the left subclavian artery, as physicians make it. The wire leads into the artery, the catheter follows
/// until its knee is at the mouth, and the wire goes back below the knee. The artery then holds the tip while
/// the push with a turn slides the knee down the ascending aorta.
BehaviourRun reformed_simmons(Trial& trial) {
    constexpr double into_artery = 100, knee_at_mouth = 70;
    constexpr double below_knee = 116, twisted = 270 * degree, on = 160;
    constexpr int parts = 24;
    HandCourse& course = trial.course;
    course.turn_step = Trial::far_turn;
    course.feed(into_artery, Held::All);
    course.feed(knee_at_mouth, Held::Catheter);
    course.feed(-below_knee);
    trial.draw("knee at the mouth");
    course.begin();
    double leg = 0, pushed = 0, past = 0;
    for (int part = 0; part < parts; ++part) {
        course.turn(twisted / parts, Held::Catheter);
        course.feed(on / parts, Held::Catheter);
        const Polyline path = course.path(Held::Catheter);
        leg = std::max(leg, trial.leg_in_ascending_aorta(path));
        pushed = std::max(pushed, course.reading(Held::Catheter).push);
        past = std::max(past, trial.past_junction(path));
    }
    trial.draw("at the end");
    const Trial::Place tip = trial.place_of(course.reading(Held::Catheter).tip);
    return trial.finish(
        leg, leg > 15 && past < trial.depth_of_root(),
        fmt::format("the tip ends in {}, {:.0f} mm along it, with {:.0f} mm inside; push up to {:.2f} N; "
                    "65 mm in the catalogue's shape",
                    tip.vessel, tip.along, course.reading(Held::Catheter).inserted, pushed),
        Held::Catheter);
}

}  // namespace studies
