#include "engine/studies/hands_catheters.h"

#include <algorithm>
#include <fmt/format.h>

#include "engine/studies/hands_trial.h"

namespace studies {

using geometry::degree;
using script::Held;

/// A stiffer part of the wire comes into the siphon, which takes up the slack of the microcatheter.
BehaviourRun kick_back(const StudyOptions& options) {
    Trial trial(options, "kick-back", {"cerebral_micro", {}}, "floppy014 in micro17 in guide6f",
                "wire 50 mm on, microcatheter 40 mm after it, then the wire 75 mm on alone");
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

BehaviourRun deep_seating(const StudyOptions& options) {
    const std::vector<scenario::Override> extension = {{"catheter.device", "\"guide6f\""},
                                                       {"catheter.outer_diameter_mm", "1.67"},
                                                       {"catheter.inner_diameter_mm", "1.42"},
                                                       {"catheter.inserted_mm", "8"}};
    Trial trial(options, "deep seating", {"coronary_lad", extension}, "floppy014 in guide6f of 5F",
                "wire 60 mm down the anterior descending artery, then the catheter after it");
    HandCourse& course = trial.course;
    course.feed(60);
    trial.draw("before");
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

BehaviourRun wire_drag(const StudyOptions& options) {
    Trial trial(options, "drag", {"crossover", {{"guidewire.pinned", "false"}}},
                "bentson035, held by its valve alone, in omniflush5f",
                "wire 40 mm out of the catheter's loop; then the catheter alone, 30 mm on and 60 mm back");
    HandCourse& course = trial.course;
    course.feed(40);
    trial.draw("before");
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

/// By the left subclavian artery: it holds the tip while the knee forms in the arch, and the push with a turn
/// lets this slide down the ascending aorta and draws the tip out.
BehaviourRun reformed_simmons(const StudyOptions& options) {
    constexpr double turned = 300 * degree, twisted = 300 * degree, into_subclavian = 60, on = 160;
    constexpr int parts = 24;
    Trial trial(
        options, "Simmons", {"carotid_vertebral", {{"catheter.device", "\"simmons2-5f\""}}},
        "glide035 in simmons2-5f",
        "the wire drawn out, the catheter turned by 300 deg and pushed 60 mm into the left subclavian "
        "artery, then 160 mm on while it is turned by 300 deg");
    HandCourse& course = trial.course;
    course.turn_step = 5 * degree;
    course.feed(-270);
    course.turn(turned, Held::Catheter);
    course.feed(into_subclavian, Held::Catheter);
    trial.draw("in the left subclavian artery");
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
