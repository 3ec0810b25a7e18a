#include "engine/exercise/handling.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/organs.h"
#include "physics/wire/energy.h"

namespace exercise {
namespace {

constexpr double tip_follows = 0.1;  // fraction of the feed by which a tip that is not stuck moves on [-]
constexpr int pulses_of_a_map = 2;   // the mask and one with contrast

bool moves(const StepReport& report) {
    return report.rotation != 0 ||
           std::ranges::any_of(report.insertions, [](double insertion) { return insertion != 0; });
}

/// Whether a balloon's pressure changes, or a stent leaves its sheath: what has to be watched.
bool treats(const Simulation& simulation) {
    const Inflation* inflation = simulation.treatment().inflation();
    return inflation &&
           (inflation->pressure != inflation->wanted || inflation->uncovered < inflation->to_uncover);
}

/// Both ways [mm].
double asked_feed(std::span<const script::Command> commands) {
    double sum = 0;
    for (const script::Command& command : commands) {
        if (const auto* advance = std::get_if<script::Advance>(&command)) sum += advance->length;
        if (const auto* withdraw = std::get_if<script::Withdraw>(&command)) sum += withdraw->length;
    }
    return sum;
}

}  // namespace

Handling::Handling(const Simulation& simulation, const HandlingErrorLimits& limits) : limits_(limits) {
    begin(simulation);
}

void Handling::begin(const Simulation& simulation) {
    std::vector<Feed> devices;
    for (const scenario::PlacedDevice& placed : simulation.devices()) {
        Feed& feed = devices.emplace_back();
        feed.inserted = simulation.inserted(placed.role) + simulation.hand(placed.role).bow;
        feed.stops.push_back({0, simulation.tip_of(placed.role).at});
    }
    marks_.clear();
    open_ = {};
    idle_since_.reset();
    was_at_target_ = false;
    injects_through_ = script::DeviceRole::All;
    against_stop_ = 0;
    devices_ = std::move(devices);
    mapped_.reset();
    map_ = injuries_ = open_injury_ = 0;
}

void Handling::note(HandlingError kind, const Frame& frame, bool now, std::optional<double> amount,
                    std::optional<int> since) {
    if (!now) return;
    const double rate = frame.simulation.scenario().frame_rate;
    int& open = open_[static_cast<std::size_t>(kind)];
    const int here = frame.time.index;
    if (open == 0 || here - marks_[open - 1].last > 1 + limits_.pause * rate) {
        HandlingErrorMark mark;
        mark.kind = kind;
        mark.first = since.value_or(here);
        mark.start = std::max(0.0, frame.time.seconds - (here - mark.first + 1) / rate);
        mark.place = frame.simulation.tip();
        const anatomy::Anatomy& anatomy = frame.simulation.anatomy();
        mark.branch = anatomy.branches[anatomy::nearest_place(anatomy, mark.place).branch].name;
        marks_.push_back(mark);
        open = static_cast<int>(marks_.size());
    }
    HandlingErrorMark& mark = marks_[open - 1];
    mark.last = here;
    mark.amount = std::max(mark.amount, amount.value_or((here - mark.first + 1) / rate));
}

void Handling::note_injuries(const Frame& frame) {
    const Simulation& simulation = frame.simulation;
    const std::span<const Injury> all = simulation.injuries().all();
    for (const Injury& injury : all.subspan(static_cast<std::size_t>(injuries_))) {
        HandlingErrorMark mark;
        mark.kind =
            injury.kind == InjuryKind::Perforation ? HandlingError::Perforation : HandlingError::Dissection;
        mark.first = frame.time.index;
        mark.start = std::max(0.0, frame.time.seconds - 1 / simulation.scenario().frame_rate);
        mark.place = injury.place;
        mark.branch = simulation.anatomy().branches[static_cast<std::size_t>(injury.branch)].name;
        mark.wall = InjuredWall{injury.device, injury.along, injury.threshold, source_of(injury)};
        marks_.push_back(mark);
        open_injury_ = static_cast<int>(marks_.size());
    }
    injuries_ = static_cast<int>(all.size());
    const Injury* open = simulation.injuries().open();
    if (!open || open_injury_ == 0) return;
    HandlingErrorMark& mark = marks_[static_cast<std::size_t>(open_injury_ - 1)];
    mark.last = frame.time.index;
    mark.amount = open->force;
}

/// What has been fed in vain so far, if the hand feeds on in this frame; else 0 [mm].
double Handling::stuck(Feed& feed, script::DeviceRole held, const Simulation& simulation) const {
    // What has bowed the shaft outside has been fed in vain, too.
    const double inserted = simulation.inserted(held) + simulation.hand(held).bow,
                 change = inserted - feed.inserted;
    feed.inserted = inserted;
    if (change < 0) {
        feed.stops.clear();
        feed.in_vain = 0;
    }
    const double before = feed.stops.empty() ? 0 : feed.stops.back().fed;
    const geometry::Vec3 tip = simulation.tip_of(held).at;
    if (change != 0 || feed.stops.empty()) feed.stops.push_back({before + std::max(0.0, change), tip});
    const double fed = feed.stops.back().fed;
    while (feed.stops.size() > 2 && fed - feed.stops[1].fed >= limits_.stuck_feed) feed.stops.pop_front();
    const double seen = fed - feed.stops.front().fed;
    if (seen < limits_.stuck_feed) return 0;
    const bool goes_on = (tip - feed.stops.front().tip).norm() > tip_follows * seen;
    feed.in_vain = goes_on ? 0 : std::max(seen, feed.in_vain + change);
    return change > 0 ? feed.in_vain : 0;
}

void Handling::follow_roadmap(const Frame& frame) {
    const Console& console = frame.simulation.console();
    if (!frame.motion.console.pulse) return;
    const bool other_view = !mapped_ || !(*mapped_ == console.arm()) || frame.motion.console.mask;
    mapped_ = console.arm();
    if (other_view) map_ = 0;
    if (console.mode() == script::ImagingMode::Dsa) ++map_;
}

void Handling::observe(const Frame& frame) {
    const Simulation& simulation = frame.simulation;
    const StepReport& report = frame.motion;
    const Console& console = simulation.console();
    if (report.reset) begin(simulation);
    const double rate = simulation.scenario().frame_rate;
    const bool moving = moves(report), beam = console.beam_on();
    follow_roadmap(frame);

    note(HandlingError::BlindMotion, frame, moving && !beam);
    note(HandlingError::OutOfView, frame, moving && beam && !in_open_field(simulation, simulation.tip()));
    note(HandlingError::StaleRoadmap, frame,
         moving && beam && console.mode() == script::ImagingMode::Roadmap && map_ < pulses_of_a_map);

    const bool useful =
        moving || !beam || simulation.contrast().injecting() || treats(simulation) ||
        std::ranges::any_of(frame.commands, [](const auto& command) {
            return !std::holds_alternative<script::Beam>(command) && !script::is_of_teacher(command);
        });
    if (useful)
        idle_since_.reset();
    else if (!idle_since_)
        idle_since_ = frame.time.index;
    const double idle = idle_since_ ? (frame.time.index - *idle_since_ + 1) / rate : 0;
    note(HandlingError::IdleBeam, frame, idle > limits_.idle_beam, idle, idle_since_);

    double fed = 0;
    for (std::size_t k = 0; k < devices_.size(); ++k)
        fed = std::max(fed, stuck(devices_[k], simulation.devices()[k].role, simulation));
    const bool stopped =
        report.withdrawal_stopped || report.whole_wire_is_in || report.buckled || report.too_thick;
    against_stop_ = stopped ? against_stop_ + asked_feed(frame.commands) : 0;
    note(HandlingError::AgainstStop, frame, stopped || fed > 0, std::max(fed, against_stop_));

    const auto press = hard_press(frame, limits_.force);
    note(HandlingError::HardPress, frame, press.has_value(), press);
    note_injuries(frame);

    const double distance = simulation.tip_to_target(), radius = simulation.scenario().target.radius;
    was_at_target_ = was_at_target_ || (distance <= radius && moving);
    const bool lost = was_at_target_ && distance > limits_.lost * radius;
    note(HandlingError::TargetLost, frame, lost, distance);
    if (lost) was_at_target_ = false;

    for (const script::Command& command : frame.commands)
        if (const auto* inject = std::get_if<script::Inject>(&command))
            injects_through_ = inject->through_device() ? inject->through : script::DeviceRole::All;
    if (!simulation.contrast().injecting()) injects_through_ = script::DeviceRole::All;
    const double against =
        injects_through_ == script::DeviceRole::All ? 0 : end_on_wall(simulation, injects_through_).force;
    note(HandlingError::InjectionAtWall, frame, against > limits_.tip_force, against);
}

std::string amount_text(const HandlingErrorMark& mark) {
    const std::string_view unit = handling_error_units[static_cast<std::size_t>(mark.kind)];
    if (mark.wall) return fmt::format("{:.3g} N, the wall bears {:.3g} N", mark.amount, mark.wall->threshold);
    return fmt::format("{:.{}f} {}", mark.amount, unit == "mm" ? 0 : unit == "N" ? 2 : 1, unit);
}

std::string place_text(const HandlingErrorMark& mark) {
    const std::string name = anatomy::clinical_name(mark.branch);
    return mark.wall ? fmt::format("{}, {:.0f} mm along", name, mark.wall->along) : name;
}

std::array<int, handling_error_kinds> counts(std::span<const HandlingErrorMark> marks) {
    std::array<int, handling_error_kinds> counts = {};
    for (const HandlingErrorMark& mark : marks) ++counts[static_cast<std::size_t>(mark.kind)];
    return counts;
}

std::optional<double> hard_press(const Frame& frame, double limit) {
    const Treatment& treatment = frame.simulation.treatment();
    if (treatment.inflation() &&
        (treatment.inflation()->inflated() || treatment.deflates() || frame.motion.settling))
        return {};
    const double force = physics::largest_force(frame.simulation.contacts());
    return force > limit ? std::optional(force) : std::nullopt;
}

bool in_open_field(const Simulation& simulation, const geometry::Vec3& place) {
    const render::CArm arm = simulation.console().arm();
    const render::Pixel at = render::project(arm, simulation.place_now(place));
    const render::PixelBox open = render::opening_of(arm);
    return at.depth > 0 && at.x >= open.left && at.x <= open.right && at.y >= open.top && at.y <= open.bottom;
}

geometry::Vec3 table_to_show(const Simulation& simulation, const geometry::Vec3& place) {
    const Console& console = simulation.console();
    return console.arm().isocentre + console.table() - simulation.place_now(place);
}

}  // namespace exercise
