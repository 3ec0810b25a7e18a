#include "engine/exercise/score.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <fmt/format.h>
#include <limits>
#include <unsupported/Eigen/FFT>
#include <utility>
#include <vector>

#include "engine/anatomy/vessel_paths.h"
#include "physics/geometry/maths.h"
#include "render/panel/readout.h"

namespace exercise {
namespace {

constexpr double clearly_outside = 1;  // of the right branches [mm]

constexpr double highest_frequency = 10;  // [Hz]
constexpr double least_amplitude = 0.05;  // of the greatest amplitude
constexpr std::size_t padding = 16;

/// How long contrast is taken to be seen after an injection has ended [s].
constexpr double in_sight = 2;

std::vector<SetByTeacher> events_of(const Simulation& simulation) {
    const anatomy::Anatomy& anatomy = simulation.anatomy();
    const double rate = simulation.scenario().frame_rate;
    std::vector<SetByTeacher> events;
    for (const Complication& c : simulation.complications()) {
        if (is_torn(c, simulation.treatment())) continue;  // by a balloon
        SetByTeacher& event = events.emplace_back();
        event.what = c;
        event.what.come = 0;
        event.what.closed.clear();
        if (c.branch >= 0) event.branch = anatomy.branches[static_cast<std::size_t>(c.branch)].name;
        event.text = name_of(c, anatomy);
        event.set = c.since / rate;
        if (!c.set()) event.relieved = c.relieved / rate;
    }
    return events;
}

}  // namespace

using Thing = script::TeacherAct::Thing;

std::string id_of(const script::TeacherAct& act) {
    return act.thing == Thing::Paused
               ? "paused"
               : std::string(script::teacher_things[static_cast<std::size_t>(act.thing)]);
}

bool helps(const script::TeacherAct& act) {
    return act.on && (act.thing == Thing::Target || act.thing == Thing::Way);
}

std::string text_of(const script::TeacherAct& act) {
    if (act.thing == Thing::Paused) return "paused";
    if (act.thing == Thing::Window) return act.on ? "window opened" : "window closed";
    return fmt::format("{} {}", id_of(act), act.on ? "shown" : "hidden");
}

std::string moment_text(double seconds) {
    return render::clock_text(seconds);
}

std::string text_of(std::span<const TeacherMark> marks) {
    std::string text;
    for (const TeacherMark& mark : marks)
        text +=
            fmt::format("{}{} at {}", text.empty() ? "" : ", ", text_of(mark.act), moment_text(mark.seconds));
    return text;
}

std::string heading_of(std::span<const TeacherMark> marks) {
    return std::ranges::any_of(marks, [](const TeacherMark& mark) { return helps(mark.act); })
               ? "helped by the teacher"
               : "by the teacher";
}

WrongTurns::WrongTurns(const anatomy::Anatomy& anatomy, const geometry::Vec3& start,
                       const geometry::Vec3& target) {
    const auto to_the_root = [&](const geometry::Vec3& from) {
        std::vector<int> way;
        for (int b = anatomy::nearest_place(anatomy, from).branch; b >= 0; b = anatomy.branches[b].parent)
            way.push_back(b);
        return way;
    };
    std::vector<int> there = to_the_root(start), back = to_the_root(target);
    // What both have in common beyond the fork is on neither's way.
    while (there.size() > 1 && back.size() > 1 && there[there.size() - 2] == back[back.size() - 2]) {
        if (there.back() != back.back()) break;
        there.pop_back();
        back.pop_back();
    }
    right_.assign(anatomy.branches.size(), false);
    for (const auto* way : {&there, &back})
        for (const int b : *way) right_[b] = true;
}

void WrongTurns::observe(const anatomy::Anatomy& anatomy, const geometry::Vec3& tip, double seconds) {
    double of_right = std::numeric_limits<double>::infinity(), of_wrong = of_right;  // outside of them [mm]
    int nearest = -1;                                                                // of the wrong ones
    for (std::size_t b = 0; b < anatomy.branches.size(); ++b) {
        const geometry::CentrelineBranch& branch = anatomy.branches[b];
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            const double outside = (tip - branch.points[i]).norm() - branch.radii[i];
            if (right_[b]) {
                of_right = std::min(of_right, outside);
            } else if (outside < of_wrong) {
                of_wrong = outside;
                nearest = static_cast<int>(b);
            }
        }
    }
    const bool in = nearest >= 0 && of_wrong < of_right && of_right > (inside_ >= 0 ? 0 : clearly_outside);
    if (!in) {
        inside_ = -1;
        return;
    }
    const std::string& name = anatomy.branches[nearest].name;
    auto known = std::ranges::find_if(found_, [&](const auto& f) { return f.name == name; });
    if (known == found_.end()) known = found_.insert(found_.end(), WrongBranch{name, 0, 0});
    const bool came_back = inside_ >= 0 && anatomy.branches[inside_].parent == nearest;
    if (nearest != inside_ && !came_back) ++known->entries;
    known->seconds += seconds;
    inside_ = nearest;
}

std::optional<double> spectral_arc_length(std::span<const double> speed, double rate) {
    if (speed.size() < 2 || speed.size() > most_smooth_frames) return {};
    const std::size_t length = padding * std::bit_ceil(speed.size());
    std::vector<double> padded(length, 0.0);
    std::copy(speed.begin(), speed.end(), padded.begin());
    std::vector<std::complex<double>> spectrum;
    Eigen::FFT<double> fft;
    fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
    fft.fwd(spectrum, padded);

    std::vector<double> fraction(spectrum.size());
    for (std::size_t k = 0; k < fraction.size(); ++k) fraction[k] = std::abs(spectrum[k]);
    const double greatest = *std::ranges::max_element(fraction);
    if (!(greatest > 0)) return {};
    for (double& value : fraction) value /= greatest;
    const double step = rate / static_cast<double>(length);
    const auto within = static_cast<std::size_t>(highest_frequency / step);
    if (fraction.size() > within + 1) fraction.resize(within + 1);
    const auto counts = [](double value) { return value >= least_amplitude; };
    const auto first = std::ranges::find_if(fraction, counts);
    const auto last = std::find_if(fraction.rbegin(), fraction.rend(), counts).base();  // one past it
    if (last - first < 2) return 0.0;
    const double band = 1.0 / static_cast<double>(last - first - 1);
    double arc = 0;
    for (auto it = first + 1; it != last; ++it) arc += geometry::hypot(band, *it - *(it - 1));
    return -arc;
}

std::optional<double> log_dimensionless_jerk(std::span<const double> speed, double rate) {
    if (speed.size() < 3) return {};
    const double peak = *std::ranges::max_element(speed);
    double sum = 0;  // ∫ (d²v/dt²)² dt
    for (std::size_t i = 1; i + 1 < speed.size(); ++i) {
        const double second = (speed[i + 1] - 2 * speed[i] + speed[i - 1]) * rate * rate;
        sum += second * second / rate;
    }
    if (!(peak > 0) || !(sum > 0)) return {};
    const double duration = static_cast<double>(speed.size()) / rate;
    return -geometry::log(duration * duration * duration / (peak * peak) * sum);
}

int Score::wrong_entries() const {
    int sum = 0;
    for (const WrongBranch& branch : wrong_branches) sum += branch.entries;
    return sum;
}

void Score::state(geometry::StateStream& s) {
    s(scenario, completed, completed_after, completion_time, beam_on_time, pulses, runs, views, air_kerma,
      area_product, contrast, angiograms, wire_travel, advanced, withdrawn, back_and_forth_ratio, reversals,
      rotation, idle_fraction, tip_path, path_efficiency, mean_tip_speed, spectral_arc_length,
      log_dimensionless_jerk, peak_wall_force, mean_wall_force, time_over_force, wall_force_impulse, deepest,
      buckled_frames, tip_to_target, wrong_branches, handling_errors, duration, resets, frames, interrupted);
    s.beside(cine_runs, dose, treatment);
    s.unless_empty(set_by_teacher);
    s.unless_empty(teacher);
}

Scorer::Scorer(const Simulation& simulation)
    : handling_(simulation), turns_(simulation.anatomy(), simulation.tip_at_start(), simulation.target()) {
    begin(simulation);
}

void Scorer::begin(const Simulation& simulation) {
    const scenario::Scenario& scenario = simulation.scenario();
    const int resets = score_.resets;
    score_ = {};
    score_.scenario = scenario.name;
    score_.resets = resets;
    turns_ = WrongTurns(simulation.anatomy(), simulation.tip_at_start(), simulation.target());
    frame_time_ = 1.0 / scenario.frame_rate;
    hold_ = scenario.target.hold;
    target_radius_ = scenario.target.radius;
    first_motion_.reset();
    on_target_since_.reset();
    net_insertion_ = moving_path_ = force_sum_ = shortest_ = 0;
    direction_ = active_frames_ = moving_frames_ = frames_ = beam_frames_ = frames_over_force_ = 0;
    first_tip_ = last_tip_ = simulation.tip_at_start();
    speeds_.clear();
    injects_ = shown_ = cine_runs_on_ = false;
    last_injection_.reset();
    mode_ = script::ImagingMode::Live;
    views_.clear();
    ballooned_.clear();
    treated_ = 0;
    observe_treatment(simulation);
}

void Scorer::observe(const Frame& frame) {
    const Simulation& simulation = frame.simulation;
    if (frame.motion.reset) {
        earlier_.push_back(finish());
        if (frame.dose) {
            earlier_.back().air_kerma = frame.dose->air_kerma;
            earlier_.back().area_product = frame.dose->area_product;
            earlier_.back().dose = *frame.dose;
        }
        ++score_.resets;
        begin(simulation);
    }
    score_.frames = frame.time.index + 1;
    score_.duration = frame.time.seconds;
    ++frames_;
    score_.contrast = simulation.contrast().injected();
    observe_teacher(frame);
    observe_console(frame);
    observe_motion(frame);
    observe_wall(frame);
    observe_target(frame);
    if (!simulation.complications().empty()) score_.set_by_teacher = events_of(simulation);
    observe_treatment(simulation);
    handling_.observe(frame);
    turns_.observe(simulation.anatomy(), simulation.tip(), frame_time_);
}

/// Made anew whenever something of it has changed.
void Scorer::observe_treatment(const Simulation& simulation) {
    const Treatment& treatment = simulation.treatment();
    if (!treatment.given()) return;
    if (treatment.inflation() && treatment.inflation()->inflated()) note_balloon(simulation, ballooned_);
    geometry::Hash hash;
    const std::uint64_t state = geometry::state_hash_of(treatment);
    const auto set = std::ranges::count_if(simulation.complications(), &Complication::set);
    hash.add(&state, sizeof state);
    hash.add(&set, sizeof set);
    if (score_.treatment && hash.value() == treated_) return;
    treated_ = hash.value();
    score_.treatment = treatment_score(simulation, ballooned_);
}

void Scorer::observe_console(const Frame& frame) {
    const Console& console = frame.simulation.console();
    const bool injects = frame.simulation.contrast().injection_rate() > 0;
    if (injects && !injects_) shown_ = false;
    injects_ = injects;
    if (injects) last_injection_ = frame.time.seconds;
    if (frame.motion.console.pulse && last_injection_ && frame.time.seconds <= *last_injection_ + in_sight &&
        !std::exchange(shown_, true))
        ++score_.angiograms;
    if (console.beam_on()) score_.beam_on_time = ++beam_frames_ * frame_time_;
    cine_runs_on_ = cine_runs_on_ && console.beam_on();
    if (!frame.motion.console.pulse) return;
    ++score_.pulses;
    const bool dsa = console.mode() == script::ImagingMode::Dsa;
    score_.runs += dsa && (mode_ != script::ImagingMode::Dsa || frame.motion.console.mask);
    const bool cine = console.mode() == script::ImagingMode::Cine;
    const bool went_on = std::exchange(cine_runs_on_, cine);
    score_.cine_runs += cine && !went_on;
    mode_ = console.mode();
    if (std::ranges::find(views_, console.arm()) == views_.end()) views_.push_back(console.arm());
    score_.views = static_cast<int>(views_.size());
}

/// What is still shown or hidden when an attempt begins is so from its first frame on.
void Scorer::observe_teacher(const Frame& frame) {
    using Thing = script::TeacherAct::Thing;
    const auto note = [&](const script::TeacherAct& act) {
        score_.teacher.push_back({act, frame.time.index, frame.time.seconds});
    };
    if (frame.motion.reset)
        for (std::size_t k = 0; k < screen_.size(); ++k)
            if (screen_[k] != script::usual_screen[k]) note({static_cast<Thing>(k), screen_[k]});
    for (const script::Command& command : frame.commands) {
        const auto* act = std::get_if<script::TeacherAct>(&command);
        if (!act) continue;
        if (act->thing != Thing::Paused) screen_[static_cast<std::size_t>(act->thing)] = act->on;
        note(*act);
    }
}

void Scorer::observe_motion(const Frame& frame) {
    const Simulation& simulation = frame.simulation;
    for (const double insertion : frame.motion.insertions) {
        if (insertion == 0) continue;
        (insertion > 0 ? score_.advanced : score_.withdrawn) += std::abs(insertion);
        net_insertion_ += insertion;
        const int direction = insertion > 0 ? 1 : -1;
        if (direction_ != 0 && direction != direction_) ++score_.reversals;
        direction_ = direction;
    }
    score_.buckled_frames += frame.motion.buckled;
    score_.wire_travel = score_.advanced + score_.withdrawn;
    score_.rotation += frame.motion.rotation;
    if (!first_motion_ && (score_.wire_travel > 0 || score_.rotation > 0))
        first_motion_ = frame.time.seconds - frame_time_;
    const double moved = (simulation.tip() - last_tip_).norm();
    score_.tip_path += moved;
    if (first_motion_ && !score_.completed) {
        const bool moving =
            frame.motion.rotation != 0 ||
            std::ranges::any_of(frame.motion.insertions, [](double insertion) { return insertion != 0; });
        if (++active_frames_ <= static_cast<int>(most_smooth_frames))
            speeds_.push_back(static_cast<float>(moved / frame_time_));
        else
            speeds_ = {};  // so that a run without end does not grow
        moving_frames_ += moving;
        moving_path_ += moving ? moved : 0;
    }
    last_tip_ = simulation.tip();
    shortest_ = anatomy::centreline_distance(simulation.anatomy(), first_tip_, last_tip_);
}

void Scorer::observe_wall(const Frame& frame) {
    const std::span<const physics::WallContact> contacts = frame.simulation.contacts();
    double sum = 0, largest = 0;
    for (std::size_t i = 1; i < contacts.size(); ++i) {  // joint 0 is held by the introducer
        const physics::WallContact& contact = contacts[i];
        sum += contact.force();
        largest = std::max(largest, contact.force());
        score_.peak_wall_force = std::max(score_.peak_wall_force, contact.force());
        // In the wall, wherever its vessel has gone.
        if (const double depth = contact.pressed_in(); depth > score_.deepest.penetration)
            score_.deepest = {depth, static_cast<int>(i), frame.time.index, contact.force() / depth,
                              contact.force()};
    }
    score_.wall_force_impulse += sum * frame_time_;
    force_sum_ += largest;
    if (largest > handling_.limits().force) score_.time_over_force = ++frames_over_force_ * frame_time_;
}

void Scorer::observe_target(const Frame& frame) {
    const double time = frame.time.seconds;
    score_.tip_to_target = frame.simulation.tip_to_target();
    if (score_.tip_to_target > target_radius_) {
        on_target_since_.reset();
        return;
    }
    if (!on_target_since_) on_target_since_ = time - frame_time_;
    // Half a frame of slack: sums of 1/rate do not add up exactly.
    if (score_.completed || time - *on_target_since_ < hold_ - 0.5 * frame_time_) return;
    if (!first_motion_) return;  // without an action, nothing counts as reached
    const std::optional<double>& residual = frame.simulation.scenario().target.residual;
    if (residual && !frame.simulation.treatment().has_opened(*residual)) return;
    score_.completed = true;
    score_.completed_after = time;
    score_.completion_time = time - *first_motion_;
}

Score Scorer::score() const {
    Score result = score_;
    if (result.wire_travel > 0) {
        result.back_and_forth_ratio = (result.wire_travel - std::abs(net_insertion_)) / result.wire_travel;
    }
    if (result.tip_path > 0) result.path_efficiency = std::min(1.0, shortest_ / result.tip_path);
    if (active_frames_ > 0) result.idle_fraction = 1 - static_cast<double>(moving_frames_) / active_frames_;
    if (moving_frames_ > 0) result.mean_tip_speed = moving_path_ / (moving_frames_ * frame_time_);
    if (frames_ > 0) result.mean_wall_force = force_sum_ / frames_;
    result.wrong_branches = turns_.branches();
    result.handling_errors = handling_.marks();
    return result;
}

Score Scorer::finish() const {
    Score result = score();
    const std::vector<double> speeds(speeds_.begin(), speeds_.end());
    result.spectral_arc_length = spectral_arc_length(speeds, 1 / frame_time_);
    result.log_dimensionless_jerk = log_dimensionless_jerk(speeds, 1 / frame_time_);
    return result;
}

}  // namespace exercise
