#include "engine/studies/hands_behaviours.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

#include "physics/wall/past_end.h"

namespace studies {

/// A course, and what is written of it. It begins with the wire turned and fed by long steps, and drawn
/// there.
class Trial {
public:
    Trial(const StudyOptions&, const Behaviour&);

    HandCourse course;
    /// Keeps where every device lies now.
    void draw(const std::string& moment);
    static constexpr double far_turn = 5 * geometry::degree;
    /// Steps for the way to where something is measured.
    void far_steps() { course.feed_step = quick_ ? 1.0 : 0.5; }
    void fine_steps() { course.feed_step = quick_ ? 0.25 : 0.1; }
    /// The vessel that holds the place deepest.
    struct Place {
        std::string vessel;
        double along = 0;  // from its start [mm]
    };
    Place place_of(const Vec3&) const;
    std::string vessel_at(const Vec3& x) const { return place_of(x).vessel; }
    /// The lowest place of a path past the plane at which the aortic root begins [mm].
    double past_junction(const Polyline&) const;
    /// Past this is the ventricle: where the cusps' lowest places are, and 2 mm of their wall [mm].
    double depth_of_root() const;
    /// How far the end of the path rises again above its lowest place, where that is in the ascending aorta,
    /// within 90 mm of the root along the vessel; else 0 [mm].
    double leg_in_ascending_aorta(const Polyline&) const;
    BehaviourRun finish(double measured, bool appears, const std::string& note,
                        script::DeviceRole shown = script::DeviceRole::Wire);

private:
    BehaviourRun run_;
    bool quick_;
};

Trial::Trial(const StudyOptions& options, const Behaviour& behaviour)
    : course(options, behaviour.scene), quick_(options.quick) {
    run_.behaviour = behaviour.name, run_.scenario = behaviour.scene.scenario;
    run_.devices = behaviour.devices, run_.manipulation = behaviour.manipulation;
    far_steps();
    const double fine_turn = std::exchange(course.turn_step, far_turn);
    if (behaviour.turned != 0) course.turn(behaviour.turned);
    course.turn_step = fine_turn;
    if (behaviour.fed != 0) course.feed(behaviour.fed);
    if (behaviour.turned != 0 || behaviour.fed != 0) draw("before");
}

void Trial::draw(const std::string& moment) {
    for (const scenario::PlacedDevice& device : course.simulation().devices())
        if (const Polyline path = course.path(device.role); path.size() > 1)
            run_.paths.push_back({moment, std::string(script::name_of(device.role)), path});
}

Trial::Place Trial::place_of(const Vec3& x) const {
    double deepest = std::numeric_limits<double>::infinity();
    Place place;
    for (const geometry::CentrelineBranch& branch : course.simulation().anatomy().branches) {
        double along = 0;
        for (std::size_t k = 0; k < branch.points.size(); ++k) {
            if (k > 0) along += (branch.points[k] - branch.points[k - 1]).norm();
            if (const double out = (x - branch.points[k]).norm() - branch.radii[k]; out < deepest)
                deepest = out, place = {branch.name, along};
        }
    }
    return place;
}

double Trial::leg_in_ascending_aorta(const Polyline& path) const {
    constexpr double ascending = 90, end = 120;  // [mm]
    std::size_t lowest = path.size() - 1;
    double s = 0;
    for (std::size_t k = path.size() - 1; k > 0 && s < end; --k) {
        if (path[k].z() < path[lowest].z()) lowest = k;
        s += (path[k] - path[k - 1]).norm();
    }
    const Place at = place_of(path[lowest]);
    return at.vessel == "aorta" && at.along < ascending ? path.back().z() - path[lowest].z() : 0.0;
}

double Trial::past_junction(const Polyline& path) const {
    double past = 0;
    for (const geometry::OpenEnd& end : course.simulation().anatomy().openings())
        if (end.goes_on == geometry::Continuation::Root)
            for (const Vec3& x : path) past = std::max(past, end.beyond(x));
    return past;
}

double Trial::depth_of_root() const {
    constexpr double into_the_wall = 2;  // [mm]
    for (const geometry::OpenEnd& end : course.simulation().anatomy().openings())
        if (end.goes_on == geometry::Continuation::Root) return physics::floor_of_root(end) + into_the_wall;
    return 0;
}

BehaviourRun Trial::finish(double measured, bool appears, const std::string& note, script::DeviceRole shown) {
    run_.measured = measured, run_.appears = appears, run_.note = note;
    run_.samples = course.samples();
    run_.device = course.at(shown);
    run_.balance = course.balance();
    run_.vessels = course.simulation().anatomy().branches;
    return std::move(run_);
}

namespace {

using geometry::degree;
using script::DeviceRole;

double largest_push(const HandCourse& course, std::size_t first = 0, DeviceRole held = DeviceRole::Wire) {
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
BehaviourRun whip(Trial& trial) {
    HandCourse& course = trial.course;
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
BehaviourRun wind_up(Trial& trial) {
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

BehaviourRun stick_slip(Trial& trial) {
    HandCourse& course = trial.course;
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
            const double travel = r.inserted - course.samples()[first - 1].devices[0].inserted;
            if (travel < 1) peak = std::max(peak, r.push);
            if (travel > 2) slides += r.push, ++count;
        }
        slides /= count;
        ratio += peak / slides / times;
        each += fmt::format("{}{:.3f} over {:.3f}", k > 0 ? ", " : "", peak, slides);
    }
    return trial.finish(ratio, ratio > 1.02, "each time [N]: " + each);
}

BehaviourRun prolapse(Trial& trial) {
    HandCourse& course = trial.course;
    course.feed(50);
    const Recoil back = recoil(course.samples(), 0, 0);
    const HandSample &from = course.samples()[back.from], &to = course.samples()[back.to];
    trial.draw("after");
    return trial.finish(
        back.length, back.length > 2,
        fmt::format("from {} to {}, push {:.2f} to {:.2f} N", trial.vessel_at(from.devices[0].tip),
                    trial.vessel_at(to.devices[0].tip), from.devices[0].push, to.devices[0].push));
}

BehaviourRun buckling(Trial& trial) {
    const bool bowed = trial.course.feed(530, DeviceRole::Wire, [&] { return trial.course.last().buckled; });
    trial.draw("at the end");
    return trial.finish(largest_push(trial.course), bowed,
                        fmt::format("after {:.0f} mm; Euler's load of the shaft's 100 mm outside is {:.2f} N",
                                    trial.course.reading().inserted, trial.course.simulation().passes_on()));
}

/// A stiffer part of the wire comes into the siphon, which takes up the slack of the microcatheter.
BehaviourRun kick_back(Trial& trial) {
    HandCourse& course = trial.course;
    course.feed(50);
    course.feed(40, DeviceRole::Microcatheter);
    trial.draw("before");
    const std::size_t first = course.samples().size() - 1;
    course.begin();
    course.feed(75, DeviceRole::Wire, [&] { return course.last().buckled; });
    trial.draw("after");
    const std::size_t device = course.at(DeviceRole::Microcatheter);
    const Recoil back = recoil(course.samples(), device, first);
    const auto& samples = course.samples();
    return trial.finish(
        back.length, back.length > 1,
        fmt::format("the microcatheter's tip, its hub held; the wire {:.0f} to {:.0f} mm inside",
                    samples[back.from].devices[0].inserted, samples[back.to].devices[0].inserted),
        DeviceRole::Microcatheter);
}

BehaviourRun deep_seating(Trial& trial) {
    HandCourse& course = trial.course;
    course.begin();
    const bool bowed = course.feed(112, DeviceRole::Catheter,
                                   [&] { return course.last().buckled || course.last().refused; });
    trial.draw("at the end");
    const HandReading& end = course.reading(DeviceRole::Catheter);
    return trial.finish(end.inserted, end.inserted > 15,
                        fmt::format("in {}, {} at {:.2f} N", trial.vessel_at(end.tip),
                                    bowed ? "the shaft bows" : "the way ends", end.push),
                        DeviceRole::Catheter);
}

BehaviourRun wire_drag(Trial& trial) {
    HandCourse& course = trial.course;
    const double inside = course.reading().inserted;
    course.begin();
    course.feed(30, DeviceRole::Catheter);
    const double on = course.reading().inserted - inside;
    course.begin();
    course.feed(-60, DeviceRole::Catheter);
    trial.draw("after");
    const double back = course.reading().inserted - inside - on;
    const double most = std::max(std::abs(on) / 30, std::abs(back) / 60);
    return trial.finish(
        most, most > 0.02,
        fmt::format("the wire goes {:.2f} mm with the catheter in, {:.2f} mm with it out", on, back),
        DeviceRole::Catheter);
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
    course.feed(into_artery, DeviceRole::All);
    course.feed(knee_at_mouth, DeviceRole::Catheter);
    course.feed(-below_knee);
    trial.draw("knee at the mouth");
    course.begin();
    double leg = 0, pushed = 0, past = 0;
    for (int part = 0; part < parts; ++part) {
        course.turn(twisted / parts, DeviceRole::Catheter);
        course.feed(on / parts, DeviceRole::Catheter);
        const Polyline path = course.path(DeviceRole::Catheter);
        leg = std::max(leg, trial.leg_in_ascending_aorta(path));
        pushed = std::max(pushed, course.reading(DeviceRole::Catheter).push);
        past = std::max(past, trial.past_junction(path));
    }
    trial.draw("at the end");
    const Trial::Place tip = trial.place_of(course.reading(DeviceRole::Catheter).tip);
    return trial.finish(
        leg, leg > 15 && past < trial.depth_of_root(),
        fmt::format("the tip ends in {}, {:.0f} mm along it, with {:.0f} mm inside; push up "
                    "to {:.2f} N; 65 mm in the catalogue's shape",
                    tip.vessel, tip.along, course.reading(DeviceRole::Catheter).inserted, pushed),
        DeviceRole::Catheter);
}

/// The hub is drawn back until the tip has moved by a millimetre.
BehaviourRun release(Trial& trial) {
    HandCourse& course = trial.course;
    const double pushed = course.reading().push, stored = course.last().stored,
                 inside = course.reading().inserted;
    const Vec3 tip = course.reading().tip;
    course.begin();
    trial.fine_steps();
    const bool follows =
        course.feed(-40, DeviceRole::Wire, [&] { return (course.reading().tip - tip).norm() > 1; });
    trial.draw("released");
    const double back = inside - course.reading().inserted;
    return trial.finish(follows ? back : std::nan(""), follows && back > 1.5,
                        fmt::format("push {:.2f} to {:.2f} N, energy stored {:.1f} to {:.1f} N mm", pushed,
                                    course.reading().push, stored, course.last().stored));
}

/// The bend comes down into a sinus, and the wire folds over it.
BehaviourRun root_loop(Trial& trial) {
    HandCourse& course = trial.course;
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
        fmt::format(
            "with {:.0f} mm inside, its turn {:.0f} mm below the sinotubular junction; push up to {:.2f} N",
            inside, past, largest_push(course)));
}

BehaviourRun straightening(Trial& trial) {
    double most = 0, at = 0;
    trial.course.feed(430, DeviceRole::Wire, [&] {
        const double now = trial.course.last().vessel_moved;
        if (now > most) most = now, at = trial.course.reading().inserted;
        return trial.course.last().buckled;
    });
    trial.draw("after");
    return trial.finish(
        most, most > 0.5,
        fmt::format("with {:.0f} mm inside; push up to {:.2f} N", at, largest_push(trial.course)));
}

BehaviourRun wedge(Trial& trial) {
    HandCourse& course = trial.course;
    trial.fine_steps();
    const bool bowed = course.feed(60, DeviceRole::Wire, [&] { return course.last().buckled; });
    trial.draw("at the end");
    const double end = course.reading().inserted;
    std::size_t k = course.samples().size() - 1;
    while (k > 0 && course.samples()[k].devices[0].inserted > end - 5) --k;
    const HandReading& before = course.samples()[k].devices[0];
    const double travel = (course.reading().tip - before.tip).norm();
    return trial.finish(course.reading().push - before.push, bowed && travel < 4,
                        fmt::format("in {}; the tip goes {:.1f} mm of the 5, the push rises to {:.2f} N",
                                    trial.vessel_at(course.reading().tip), travel, course.reading().push));
}

const Behaviour all[] = {
    {.name = "whip",
     .scene = {"arch", {{"chain.adaptive", "false"}}},
     .devices = "glide035 with a bend of 130 deg over 45 mm",
     .manipulation = "420 mm in, then the hub is turned by 400 deg and back",
     .fed = 420,
     .make = whip},
    {.name = "wind-up",
     .scene = {"cerebral"},
     .devices = "floppy014",
     .manipulation = "57 mm on, into the first part of the middle cerebral artery, then the hub is turned by "
                     "a turn to and fro, three times",
     .fed = 57,
     .make = wind_up},
    {.name = "stick-slip",
     .scene = {"renal"},
     .devices = "glide035",
     .manipulation = "200 mm in; five times the hand rests for 0.4 s and pushes on by 3 mm",
     .fed = 200,
     .make = stick_slip},
    {.name = "prolapse",
     .scene = {"renal"},
     .devices = "glide035 with a bend of 100 deg over 30 mm",
     .manipulation = "turned by 60 deg, so that its tip goes into the internal iliac artery, and 180 mm in",
     .turned = 60 * degree,
     .fed = 130,
     .make = prolapse},
    {.name = "buckling",
     .scene = {"iliac_aorta", {{"guidewire.buckling_force_N", "0"}}},
     .devices = "glide035 without a stated force of buckling",
     .manipulation = "pushed on until the narrowing aorta above the image holds the tip and the shaft bows",
     .make = buckling},
    {.name = "kick-back",
     .scene = {"cerebral_micro"},
     .devices = "floppy014 in micro17 in guide6f",
     .manipulation = "wire 50 mm on, microcatheter 40 mm after it, then the wire 75 mm on alone",
     .make = kick_back},
    {.name = "deep seating",
     .scene = {"coronary_lad",
               {{"catheter.device", "\"guide6f\""},
                {"catheter.outer_diameter_mm", "1.67"},
                {"catheter.inner_diameter_mm", "1.42"},
                {"catheter.inserted_mm", "8"}}},
     .devices = "floppy014 in guide6f of 5F",
     .manipulation = "wire 60 mm down the anterior descending artery, then the catheter after it",
     .fed = 60,
     .make = deep_seating},
    {.name = "drag",
     .scene = {"crossover", {{"guidewire.pinned", "false"}}},
     .devices = "bentson035, held by its valve alone, in omniflush5f",
     .manipulation =
         "wire 40 mm out of the catheter's loop; then the catheter alone, 30 mm on and 60 mm back",
     .fed = 40,
     .make = wire_drag},
    {.name = "release",
     .scene = {"renal"},
     .devices = "glide035 with a bend of 100 deg over 30 mm",
     .manipulation = "115 mm in, its tip in the internal iliac artery, then drawn back",
     .fed = 115,
     .make = release},
    {.name = "Simmons",
     .scene = {"carotid_vertebral",
               {{"catheter.device", "\"simmons2-5f\""},
                {"entry.inserted_mm", "226"},
                {"catheter.inserted_mm", "155"}}},
     .devices = "glide035 in simmons2-5f",
     .manipulation =
         "from the descending aorta, 71 mm of wire ahead: both 100 mm on, the wire into the left subclavian "
         "artery; the catheter 70 mm over it, until its knee is at the mouth; the wire 116 mm back, below "
         "the knee; then the catheter 160 mm on while it is turned by 270 deg",
     .make = reformed_simmons},
    {.name = "root loop",
     .scene = {"coronary"},
     .devices = "glide035 with a bend of 90 deg over 45 mm",
     .manipulation = "from the right arm, turned by 180 deg and 300 mm in",
     .turned = 180 * degree,
     .make = root_loop},
    {.name = "straightening",
     .scene = {"iliac_aorta", {{"guidewire.device", "\"lunderquist035\""}}},
     .devices = "lunderquist035, vessels in tissue",
     .manipulation = "from the groin up the aorta, 450 mm, so that the shaft lies in the iliac artery",
     .fed = 20,
     .make = straightening},
    {.name = "wedge",
     .scene = {"coronary_lad"},
     .devices = "floppy014",
     .manipulation = "pushed on until a branch is too narrow for its tip and the shaft outside bows",
     .fed = 80,
     .make = wedge},
};

}  // namespace

BehaviourRun Behaviour::run(const StudyOptions& options) const {
    Trial trial(options, *this);
    return make(trial);
}

std::span<const Behaviour> behaviours() {
    return all;
}

Recoil recoil(std::span<const HandSample> samples, std::size_t device, std::size_t first) {
    Recoil most;
    double travel = 0, farthest = 0;
    std::size_t from = first;
    for (std::size_t k = first + 1; k < samples.size(); ++k) {
        const HandReading &a = samples[k - 1].devices[device], &b = samples[k].devices[device];
        travel += (b.tip - a.tip).dot(a.along);
        if (travel > farthest) farthest = travel, from = k;
        if (farthest - travel > most.length) most = {farthest - travel, from, k};
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
