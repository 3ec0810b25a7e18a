#include "engine/exercise/simulation.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <utility>

#include "engine/exercise/device_rules.h"
#include "engine/exercise/simulation_parts.h"
#include "engine/exercise/treatment_score.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/scenario/placement.h"
#include "physics/relax/error_refinement.h"
#include "physics/wall/astray.h"
#include "physics/wire/crossings.h"
#include "physics/wire/energy.h"

namespace exercise {
namespace {

using geometry::Vec3;

/// |g|/C that counts as rest on a mesh, whose planes jump by about that.
constexpr double tolerance_of_planes = 1e-3;
/// Updates a segment before frame 0: a wire put in along the centreline is far from rest.
constexpr int updates_at_start = 200;
constexpr int budgets_at_start = 100;  // of those, at most; sheaths that nearly fill their vessel take 30
/// A part of a motion begins where this times the usual work of one is left, which 19 of 20 do not exceed.
constexpr double probable_work = 3;
constexpr double parts_in_mean = 8;  // about a frame's, so that it follows the devices' change of place
/// A crossing is mended by a joint at its deepest place, or by one in each of the parts.
constexpr int rounds_of_mending = 4;
/// Splits and merges after one motion: a tip that has come to touch is graded, and what it rests on
/// quartered.
constexpr int rounds_of_refining = 6;
/// The shaft outside has bowed visibly where less of what a hand feeds goes in.
constexpr double hardly = 0.5;
constexpr double lost = 1e-3;  // gradient of a wire that came to no rest [-]

std::string problem_of(const script::Command& command, const scenario::Scenario& scenario,
                       const anatomy::Anatomy& anatomy) {
    const auto* set = std::get_if<script::Complicate>(&command);
    if (const auto* relieve = std::get_if<script::Relieve>(&command))
        return Complications::problem(*relieve, anatomy);
    if (!set) return {};
    if (set->kind != script::ComplicationKind::Breath &&
        scenario.relaxer.kind != physics::RelaxerKind::Global)
        return fmt::format("a {} needs [relaxer] kind = \"global\"", script::name_of(set->kind));
    return Complications::problem(*set, anatomy);
}

Console start_console(const scenario::Scenario& scenario) {
    return Console(scenario.c_arm, scenario.frame_rate, scenario.imaging.pulse_rate);
}

}  // namespace

Simulation::Simulation(const scenario::Scenario& scenario, const anatomy::ModelCache& cache,
                       const script::CommandScript* script)
    : scenario_(scenario),
      anatomy_(std::make_shared<anatomy::Anatomy>(scenario::anatomy_of(scenario, cache))),
      console_(start_console(scenario)) {
    reach_ = std::make_shared<scenario::Reach>(*anatomy_);
    choice_ = scenario::choose(scenario_, *anatomy_, *reach_);
    entry_ = scenario::entry_of(scenario_, *anatomy_);
    target_ = scenario::target_of(scenario_, *anatomy_);
    try {
        contrast_ = std::make_unique<blood::ContrastFlow>(*anatomy_, scenario_.blood);
    } catch (const io::InputError& error) {
        throw io::InputError(io::located(scenario_.place("contrast.blood_from"), error.what()));
    }
    motion_.emplace(scenario_.motion, contrast_->blood());
    if (!scenario_.entry.flush_catheter.empty()) {
        try {
            contrast_->entry_of(scenario_.entry.flush_catheter);
        } catch (const io::InputError& error) {
            throw io::InputError(io::located(scenario_.place("entry.flush_catheter"), error.what()));
        }
    }
    if (script)
        if (const auto wrong = problems(*script); !wrong.empty())
            throw io::InputError(io::joined(wrong, "\n"));
    if (const auto wrong = Treatment::problems(scenario_, *anatomy_); !wrong.empty())
        throw io::InputError(io::joined(wrong, "\n"));
    wall_ = open_wall_of(scenario_, *anatomy_, cache);
    know_vessels();
    reset();
    was_reset_ = false;
}

Simulation::Simulation(const Simulation& like)
    : scenario_(like.scenario_),
      anatomy_(like.anatomy_),
      lumen_query_(like.lumen_query_),
      choice_(like.choice_),
      entry_(like.entry_),
      target_(like.target_),
      wall_(std::make_shared<physics::NarrowedWall>(like.wall_->vessels(), like.wall_->wire_radius())),
      reach_(like.reach_),
      gives_(like.gives_),
      contrast_(std::make_unique<blood::ContrastFlow>(*like.contrast_)),
      motion_(like.motion_),
      console_(like.console_),
      was_reset_(like.was_reset_),
      denied_(like.denied_) {
    make_relaxers();
    geometry::restore_state(*this, geometry::state_of(like));
}

Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;

void Simulation::reset() {
    was_reset_ = true;
    exchanged_name_.clear();
    pinned_otherwise_.clear();
    place_devices();
    if (gives_) gives_->forget();
    readings_ = {};
    readings_.hands.resize(devices_.size());
    waiting_.clear();
    denied_.clear();
    console_ = start_console(scenario_);
    frames_ = 0;
    breathing_ = {};
    iodine_ = scenario_.imaging.iodine;
    contrast_->reset();
    flushed_.clear();
    injuries_.clear();
    complications_.clear();
    treatment_.start(scenario_, *anatomy_);
    take_up_changes();
    model_changes_ = {};
    lay(entry_.points);
    stand_tubes();
    tip_at_start_ = tip();
}

void Simulation::aim(const scenario::Target& target) {
    scenario::Scenario changed = scenario_;
    changed.target = target;
    if (const auto wrong = scenario::problems(changed); !wrong.empty())
        throw io::InputError(io::joined(wrong, "\n"));
    target_ = scenario::target_of(changed, *anatomy_);
    scenario_.target = target;
}

void Simulation::make_relaxers() {
    const bool global = scenario_.relaxer.kind == physics::RelaxerKind::Global;
    hub_.reset();
    relaxer_.reset();
    physics::RelaxerConfig config = scenario_.relaxer;
    if (global && !wall_->smooth()) config.tolerance = std::max(config.tolerance, tolerance_of_planes);
    if (global)
        hub_ = std::make_unique<physics::Hub>(config, *wall_);
    else
        relaxer_ = physics::make_relaxer(config, *wall_);
}

/// A new chain along the path, brought to rest by new relaxers, since old ones remember where they stopped.
/// One that was there before passes on the turns of its hubs.
void Simulation::lay(const geometry::Polyline& path, const physics::Chain* before) {
    make_relaxers();
    deepest_crossing_ = usual_work_ = part_work_ = 0;
    rounds_of_refining_ = 0;
    push_before_ = 0;
    drags_ = {};
    outside_.reset(devices_, scenario_.hand_distance);
    StepReport ignored;
    physics::Chain laid = chain_of(scenario_, devices_, path, before);
    prepare_balloon(laid);
    if (hub_) {
        moving_ = std::move(laid);
        moving_.vessels_stay = before ? before->vessels_stay : vessels_can_stay();
        const auto settle = [&] {
            const int updates = updates_at_start * moving_.segments();
            bool at_rest = hub_->settle(moving_, updates).relax.at_rest();
            for (int k = 1; !at_rest && k < budgets_at_start; ++k) {
                const bool goes_on = hub_->working();
                if (!goes_on && !wall_->smooth()) return;  // planes jump, and there may be no rest
                at_rest = (goes_on ? hub_->resume(moving_, updates) : hub_->settle(moving_, updates))
                              .relax.at_rest();
            }
        };
        settle();
        if (scenario_.adaptive) {
            physics::refine(moving_, *wall_, scenario_.refinement);
            settle();
        }
        bool segments = false;
        for (int k = 0; k < static_cast<int>(devices_.size()); ++k) {
            if (!twists_by_segments(before ? &before->devices[k] : nullptr)) continue;
            physics::start_twists(moving_, k);
            segments = true;
        }
        physics::start_grips(moving_, wall_->foundation() && !moving_.vessels_stay);
        physics::start_rubs(moving_);
        if (!moving_.grips.empty() || segments) settle();
        if (renew_torsion(nullptr)) settle();
        if (renew_vessels(nullptr)) settle();
        rounds_of_mending_ = 0;
        show();
        mend_crossings(ignored);
    } else {
        wire_ = std::move(laid);
        relax(updates_at_start * wire_.segments(), ignored);
        if (scenario_.adaptive) {
            physics::refine(wire_, *wall_, scenario_.refinement);
            relax(updates_at_start * wire_.segments(), ignored);
        }
        contacts_ = physics::all_contacts(wire_, *wall_);
    }
}

/// One call for each kind of command: one that is new and not handled here does not compile.
struct Simulation::Apply {
    Simulation& at;
    void operator()(const script::Advance& c) const {
        at.waiting_.push_back({c.length, 0, at.device_of(c.held)});
    }
    void operator()(const script::Withdraw& c) const {
        at.waiting_.push_back({-c.length, 0, at.device_of(c.held)});
    }
    void operator()(const script::Rotate& c) const {
        at.waiting_.push_back({0, c.angle, at.device_of(c.held)});
    }
    void operator()(const script::Remove& c) const {
        at.waiting_.push_back({0, 0, at.device_of(c.held), true});
    }
    void operator()(const script::Exchange& c) const {
        static_cast<void>(device_of_catalogue(c.held, c.device, at.scenario_));
        at.waiting_.push_back({0, 0, *at.scenario_.index_of(c.held), false, c.device});
    }
    void operator()(const script::Grip& c) const { at.grip(*at.scenario_.index_of(c.held), c.distance); }
    void operator()(const script::Pin& c) const { at.pin(*at.scenario_.index_of(c.held), c.on); }
    void operator()(const script::Contrast& c) const { at.iodine_ = c.iodine; }
    void operator()(const script::Inject& c) const { at.inject_through(c); }
    void operator()(const script::Reset&) const { at.reset(); }
    void operator()(const script::Complicate& c) const {
        at.complications_.set(c, *at.anatomy_, at.frames_,
                              [&](const Complication& other) { return is_torn(other, at.treatment_); });
        if (c.kind == script::ComplicationKind::Breath) at.breathing_.breathe(c.breath);
    }
    void operator()(const script::Relieve& c) const {
        at.complications_.relieve(c, *at.anatomy_, at.frames_);
        if (!c.kind) at.breathing_.breathe(script::BreathManner::Free);
    }
    template <class Other>
    requires requires(Console& console, const Other& c) { console.apply(c); }
    void operator()(const Other& c) const { at.console_.apply(c); }
    void operator()(const script::Breathe& c) const { at.breathing_.ask(c.hold); }
    void operator()(const script::TeacherAct&) const {}  // the score's alone
    void operator()(const script::Inflate& c) const { at.inflate(c.pressure); }
    void operator()(const script::Deflate&) const { at.inflate(0); }
    void operator()(const script::Deploy&) const { at.deploy(); }
    void operator()(const script::RetrieveSheath& c) const { at.retrieve_sheath(c.length); }
};

void Simulation::apply(const script::Command& command) {
    if (const std::string wrong = missing_device(command, scenario_); !wrong.empty())
        throw io::InputError(wrong);
    if (const std::string wrong = problem_of(command, scenario_, *anatomy_); !wrong.empty())
        throw io::InputError(wrong);
    std::visit(Apply{*this}, command);
}

std::vector<std::string> Simulation::problems(const script::CommandScript& script) const {
    std::vector<std::string> found = device_problems(script, scenario_);
    blood::ContrastFlow trial(*anatomy_, scenario_.blood);
    for (const script::TimedCommand& timed : script.commands) {
        if (found.size() > 20) break;
        if (std::holds_alternative<script::Reset>(timed.command)) trial.reset();
        if (const std::string wrong = problem_of(timed.command, scenario_, *anatomy_); !wrong.empty())
            found.push_back(io::located(timed.place, wrong));
        const script::Inject* inject = std::get_if<script::Inject>(&timed.command);
        if (!inject || !missing_device(timed.command, scenario_).empty()) continue;
        try {
            // Where a device's tip will be is not known yet; the limit of contrast is.
            if (inject->branch.empty()) {
                trial.inject({target_, inject->rate, inject->volume, inject->iodine});
            } else {
                trial.inject({inject->branch, inject->rate, inject->volume, inject->iodine});
                if (const double most = exercise::largest_flow(flush_catheter(), 0, 0); inject->rate > most)
                    found.push_back(io::located(
                        timed.place, fmt::format("a 5 F flush catheter passes {:.1f} ml/s at most; {:g} ml/s "
                                                 "were asked for",
                                                 most, inject->rate)));
            }
        } catch (const io::InputError& error) {
            found.push_back(io::located(timed.place, error.what()));
        }
    }
    return found;
}

StepReport Simulation::step() {
    StepReport report;
    hub_ ? move_hub(report) : move_segments(report);
    for (const Motion& m : waiting_) {
        report.waiting_insertion += std::abs(m.insertion);
        report.waiting_rotation += std::abs(m.rotation);
    }
    report.past_vessel_end = tip_has_left();
    keep_readings(report);
    report.injuries = look_for_injuries();
    lead_lines();
    contrast_->step(1 / scenario_.frame_rate);
    ++frames_;
    report.breath = breathing_.step(time(), 1 / scenario_.frame_rate, scenario_.motion);
    report.console = console_.end_frame();
    report.reset = std::exchange(was_reset_, false);
    if (report.denied.empty()) report.denied = std::move(denied_);
    denied_.clear();
    return report;
}

/// Of the wire shown, which is looked at when it is at rest. The blood leaks where it has gone through.
int Simulation::look_for_injuries() {
    if (!hub_ || !readings_.at_rest || readings_.motion.settling) return 0;
    const int found = injuries_.look(*this);
    for (const Injury& injury : injuries_.all().last(static_cast<std::size_t>(found)))
        if (injury.kind == InjuryKind::Perforation)
            contrast_->pierce(injury.place, injury.outward, injury.diameter);
    return found;
}

void Simulation::keep_readings(const StepReport& report) {
    if (report.relax.updates > 0) {
        readings_.at_rest = report.relax.at_rest();
        readings_.strict_minimum = report.relax.converged();
    }
    readings_.motion = report;
    readings_.waits = report.waiting_insertion != 0 || report.waiting_rotation != 0;
}

double Simulation::time() const {
    return frames_ / scenario_.frame_rate;
}

double Simulation::breath() const {
    return breathing_.depth(time(), scenario_.motion);
}

Vec3 Simulation::vessel_shift() const {
    return scenario_.motion.with_breath(time(), breath());
}

Vec3 Simulation::place_now(const Vec3& x) const {
    if (motion_->rigid()) return x + vessel_shift();
    return x + motion_->at(x, scenario::contraction(time(), scenario_.motion.heart_rate), breath());
}

/// Of a frame with the global relaxer. One update takes twice as long where vessels make way.
int Simulation::frame_updates() const {
    return scenario_.budget.updates / (wall_->foundation() && !moving_.vessels_stay ? 2 : 1);
}

int Simulation::updates_left(const StepReport& report) const {
    return std::max(frame_updates() - report.relax.updates, 0);
}

/// Whether the frame has updates left to begin so many things with, and probably to end them; one that has
/// done nothing always has, as has one with more than half of them: a frame is never idle for want of
/// certainty.
bool Simulation::may_begin(const StepReport& report, int things) const {
    const double probable = std::min(things * probable_work * usual_work_, 0.5 * frame_updates());
    return report.relax.updates == 0 ||
           updates_left(report) >= std::max<double>(physics::Hub::least_updates(moving_), probable);
}

void Simulation::move_hub(StepReport& report) {
    // Vessels open, and balloons deflate, around a chain that finds no rest, too: from its last one, in wider
    // vessels.
    if (hub_->working() && (going(complications_) || treatment_.deflates())) {
        hub_->wall_has_changed();
        moving_ = wire_;
    }
    if (hub_->working()) {
        account(hub_->resume(moving_, frame_updates()), report);
        count_released();
        if (hub_is_idle()) balance();
    } else {
        const bool stiffer = physics::let_rest(moving_, 1 / scenario_.frame_rate);
        change_vessels(report);
        if (hub_is_idle() && stiffer) account(hub_->settle(moving_, updates_left(report)), report);
    }
    if (hub_is_idle() && !waiting_.empty() && may_begin(report)) renew_models(report);
    if (hub_is_idle() && !waiting_.empty() && may_begin(report)) prepare_motion(report);
    // Crossings that a motion leaves are mended in its frame.
    while (hub_is_idle() && !waiting_.empty() && may_begin(report, 2)) {
        if (!make_motion(waiting_.front(), report)) waiting_.erase(waiting_.begin());
        if (hub_is_idle()) balance();
        if (hub_is_idle()) show_rest(report);
    }
    if (hub_is_idle()) {
        if (report.relax.updates == 0) account(hub_->settle(moving_, frame_updates()), report);
        if (report.relax.updates > 0) show_rest(report);
    }
    // A crossing that there was no work left for is mended now.
    const bool waits = deepest_crossing_ > 0 && rounds_of_mending_ < rounds_of_mending;
    if (contacts_.empty() || (waits && hub_is_idle())) mend_crossings(report);
    if (scenario_.tip_error) keep_tip_error(report);
    report.deepest_crossing = deepest_crossing_;
    report.settling = hub_->working();
}

/// Makes segments whole again that were split at a crossing, where they are clear of the wall again, and
/// splits those that come near an edge of it.
void Simulation::prepare_motion(StepReport& report) {
    // Of a chain that keeps an error of its tip, pieces are merged at rest.
    int changed = scenario_.tip_error ? 0 : physics::merge_pieces(moving_, *wall_, scenario_.adaptive);
    if (scenario_.adaptive) {
        const physics::RefinementReport made = physics::refine(moving_, *wall_, scenario_.refinement);
        changed += made.split + made.merged;
    }
    if (wall_->smooth()) changed += physics::split_before_edges(moving_, *wall_);
    rounds_of_mending_ = rounds_of_refining_ = 0;
    if (changed > 0) account(hub_->settle(moving_, updates_left(report)), report);
}

/// Makes a part of the motion; the rest stays in it. False when the motion is finished.
bool Simulation::make_motion(Motion& motion, StepReport& report) {
    if (!motion.exchange.empty()) {
        exchange_device(motion, report);
        return false;
    }
    if (motion.device == balloon() || (motion.device == physics::every_device && balloon() >= 0))
        if (const std::string why = treatment_.problem_with_motion(); motion.by_hand() && !why.empty()) {
            report.denied = "The balloon catheter was not moved: " + why;
            return false;
        }
    if (motion.removes) motion.insertion = -moving_.devices[motion.device].inserted;
    StepReport of_no_hand;
    motion.insertion = allowed_feed(motion, motion.by_hand() ? report : of_no_hand);
    if (motion.removes && motion.insertion == 0) motion.removes = false;
    if (motion.insertion == 0 && motion.rotation == 0) return false;
    const double turn = physics::Hub::largest_turn;
    const double longest = (moving_.grips.empty() ? 1 : 0.5) * moving_.grid.segment_length;
    physics::HubMotion part;
    part.device = motion.device;
    if (motion.insertion != 0) part.feed = motion.insertion / steps_of(motion.insertion, longest);
    if (motion.rotation != 0 && (motion.insertion == 0 || motion.dragged))
        part.turn = motion.rotation / steps_of(motion.rotation, turn);
    take_in_hand(motion);
    motion.goes_in = 1;
    const int fed = fed_by_hand(motion);
    bear(motion, part.feed);
    if (const auto loads = shaft_loads(); fed >= 0 && !motion.removes && !loads.empty()) {
        push_before_ = outside_.push(fed, loads);
        const double in = outside_.goes_in(fed, part.feed, push_before_);
        report.buckled = report.buckled || (part.feed > 0 && in < hardly * part.feed);
        if (in == 0 && part.feed < 0) return bow_out(motion, part.feed);
        if (in == 0) {
            refuse_push(motion, part.feed, report);
            return !motion.done();
        }
        motion.goes_in = in / part.feed;
        part.feed = in;
    }
    const physics::HubReport made = hub_->move(moving_, part, updates_left(report));
    account(made, report);
    const bool moved = made.made.feed != 0 || made.made.turn != 0;
    if (made.outcome == physics::HubReport::Outcome::AtRest && !moved) motion = {};
    return !motion.done();
}

/// Takes what was made off the motion that it is part of; what was refused is not asked for again.
void Simulation::account(const physics::HubReport& made, StepReport& report) {
    accumulate(report.relax, made.relax);
    part_work_ += made.relax.updates;
    if (made.outcome != physics::HubReport::Outcome::Working && part_work_ > 0)
        usual_work_ += (std::exchange(part_work_, 0) - usual_work_) / parts_in_mean;
    report.buckled = report.buckled || (made.buckled && (waiting_.empty() || waiting_.front().by_hand()));
    if (made.outcome == physics::HubReport::Outcome::Refused) refuse(waiting_.front(), made, report);
    if (made.outcome != physics::HubReport::Outcome::AtRest) return;
    if (made.made.feed == 0 && made.made.turn == 0) return;
    Motion& motion = waiting_.front();
    const auto take = [](double& whole, double part) {
        whole = std::abs(whole - part) < 1e-12 * (std::abs(whole) + std::abs(part)) ? 0 : whole - part;
    };
    const double by_hand = made.made.feed / motion.goes_in;
    const int fed = shaft_of(motion);
    take(motion.insertion, by_hand);
    take(motion.rotation, made.made.turn);
    const auto loads = shaft_loads();
    if (fed >= 0 && made.made.feed != 0 && !loads.empty())
        outside_.fed(fed, motion.released ? 0.0 : by_hand, made.made.feed, push_before_,
                     outside_.push(fed, loads));
    count_turn(made.made.device, made.made.turn);
    if (!motion.by_hand()) return;
    if (made.made.feed != 0) report.insertions.push_back(made.made.feed);
    report.rotation += std::abs(made.made.turn);
}

void Simulation::count_turn(int device, double angle) {
    for (int k = 0; k < static_cast<int>(devices_.size()); ++k)
        if (device == physics::every_device || device == k) readings_.hands[k].turned += angle;
}

/// The wire at rest is what is seen, felt and scored.
void Simulation::show() {
    wire_ = moving_;
    contacts_.clear();
    const auto loads = hub_->loads();
    for (std::size_t k = 0; k < loads.size(); ++k) {
        readings_.hands[k].load = loads[k];
        readings_.hands[k].bow = outside_.bow(static_cast<int>(k));
    }
}

/// Whether the wire found no rest inside the vessel, as with a joint astray between two that share a wide
/// mouth.
bool Simulation::is_lost() const {
    const physics::RelaxReport& last = hub_->last_report();
    const auto contacts = hub_->contacts();
    return (wall_->smooth() && !last.at_rest() && last.gradient > lost) ||
           std::ranges::any_of(contacts, physics::astray);
}

/// The same, but a wire that is lost goes back to the last one.
void Simulation::show_rest(StepReport& report) {
    if (!is_lost()) return show();
    moving_ = wire_;
    rounds_of_mending_ = rounds_of_mending;
    // Around a balloon there may be none yet: the next frame goes on with it from the last rest.
    if (treatment_.given()) return hub_->wall_has_changed();
    account(hub_->settle(moving_, 2 * moving_.segments()), report);
}

/// Asks for the contacts of the wire shown, finds its crossings and mends them in the wire that goes on. The
/// hub's own contacts would not do: it does not ask again for a joint that can touch nothing.
void Simulation::mend_crossings(StepReport& report) {
    for (;;) {
        contacts_ = physics::all_contacts(wire_, *wall_);
        const std::vector<physics::Crossing> found = physics::crossings(wire_, contacts_, *wall_);
        deepest_crossing_ = 0;
        for (const physics::Crossing& crossing : found)
            deepest_crossing_ = std::max(deepest_crossing_, crossing.depth);
        if (found.empty() || hub_->working() || rounds_of_mending_ >= rounds_of_mending || !may_begin(report))
            return;
        if (physics::split_crossings(moving_, found) == 0) {
            rounds_of_mending_ = rounds_of_mending;
            return;
        }
        ++rounds_of_mending_;
        account(hub_->settle(moving_, updates_left(report)), report);
        if (hub_->working()) return;
        show_rest(report);
    }
}

/// Splits and merges segments of the wire that goes on by the estimate for the one shown, until its tip is as
/// near as stated. An estimate counts as the passes that it makes.
void Simulation::keep_tip_error(StepReport& report) {
    physics::ErrorRefinement refinement(*wall_, {.tolerance = *scenario_.tip_error});
    while (hub_is_idle() && rounds_of_refining_ < rounds_of_refining && may_begin(report)) {
        if (!hub_->last_report().strict_minimum()) return;
        const bool first = rounds_of_refining_++ == 0;
        const physics::ErrorRefinementRound round = refinement.round(moving_, contacts_, first);
        report.relax.updates += round.updates;
        if (!round.changed()) {
            rounds_of_refining_ = rounds_of_refining;
            return;
        }
        account(hub_->settle(moving_, updates_left(report)), report);
        if (hub_->working()) return;
        show_rest(report);
        mend_crossings(report);
    }
}

void Simulation::state(geometry::StateStream& s) {
    // What is restored into new relaxers has nothing of the old ones' reports.
    if (s.restores()) make_relaxers();
    s(wire_, contacts_, waiting_, deepest_crossing_, rounds_of_mending_, usual_work_, part_work_, *contrast_,
      console_, frames_, iodine_, tip_at_start_, exchanged_name_, breathing_, drags_, outside_, push_before_,
      injuries_, model_changes_);
    s.unless_empty(pinned_otherwise_);
    s.unless_empty(flushed_);
    s.unless_zero(rounds_of_refining_);
    complications_.state(s);
    s.beside(readings_);
    treatment_.state(s);
    if (s.restores()) {
        complications_.find_places(*anatomy_);
        treatment_.find_places(scenario_, *anatomy_);
        take_up_changes();
        place_devices();
        stand_tubes();
        if (gives_) gives_->forget();
    }
    if (hub_)
        s(*hub_, moving_);
    else
        s(*relaxer_);
}

}  // namespace exercise
