#include "engine/plan/search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <queue>
#include <random>
#include <set>
#include <tuple>

#include "engine/anatomy/vessel_paths.h"
#include "engine/exercise/device_rules.h"
#include "engine/io/error.h"
#include "physics/geometry/parallel.h"

namespace plan {
namespace {

using script::DeviceRole;

constexpr double near_speed = 10;  // of a key that is pressed alone: hands at the keys have no other between
constexpr double push_speed = 30, turn_speed = 225 * geometry::degree;  // [mm/s], [rad/s]
constexpr double spacing = 8;      // of states that are kept, by the way left [mm]
constexpr double backwards = 8;    // that a tip may go before a push has failed [mm]
constexpr double patience = 30;    // fed in vain before a push has failed [mm]
constexpr double beyond = 40;      // that a wire leads past the target, to hold a catheter [mm]
constexpr double drawn_back = 80;  // by one pull, at most [mm]
constexpr double close_grip = 20;  // of a hand that the shaft outside has bowed in front of [mm]
constexpr double forgiven = 0.06;  // of what was fed, that hands may be off by [-]
constexpr int waited = 30;         // frames, for motions that a frame's work did not do
constexpr int width = 8;           // moves tried at a time, whatever the number of threads
constexpr double most_fed = 1500;  // by one move [mm]

/// What is tried from a state.
struct Move {
    enum class Kind {
        Push,         // turn the device and push it
        Lead,         // draw the wire back into the catheter, turn that, and push the wire
        Pull,         // turn the device and draw all back
        Shaped,       // draw the wire back into the catheter, turn that and push it
        WithoutWire,  // take the wire out, turn the catheter and push it
        Exchange      // take the wire out, and push another through what lies around it
    } kind = Kind::Push;
    int device = 0;   // place in the list
    double roll = 0;  // [rad]
    int wire = -1;    // to exchange for: of SearchOptions::wires
};

struct State {
    int parent = -1;
    std::vector<author::ScriptLine> lines;  // since the parent
    int frames = 0;                         // from the start
    int turns = 0;
    int wire = -1;                   // of SearchOptions::wires; -1 = the scenario's
    double value = 0;                // least where the target is near [mm]
    double left = 0;                 // of the target's device [mm]
    std::vector<double> rolls, fed;  // of each device's hub [rad], [mm]
    exercise::Exercise::Snapshot snapshot;
};

struct Tried {
    std::vector<State> states;
    std::vector<State> reached;  // one at most
    std::optional<Failure> failure;
    long frames = 0;
};

/// Whether the wire is to reach the target out of a device that sticks out beyond it at the start: a guiding
/// catheter, which steers, and whose curves take push. Elsewhere a closer grip only leads wires that are
/// stuck farther astray: for all it took coronary_jl4 three times the frames.
bool comes_out_of_guide(const scenario::Scenario& s) {
    return s.index_of(s.target.device).value_or(0) == 0 &&
           std::ranges::any_of(s.devices, [&](const scenario::PlacedDevice& device) {
               return device.inserted > s.devices[0].inserted;
           });
}

/// Distances along the vessels.
class Ways {
public:
    Ways(const exercise::Simulation& simulation)
        : anatomy_(simulation.anatomy()),
          paths_(anatomy_),
          target_(anatomy::nearest_place(anatomy_, simulation.target())),
          at_(simulation.target()),
          entrance_(entrance_of(simulation)),
          entry_(anatomy::nearest_place(anatomy_, entrance_)) {
        const auto whole = paths_.between(entry_, target_);
        if (!whole)
            throw io::InputError(
                "{}: expected a way along the vessels from the entry to the target, found "
                "none",
                simulation.scenario().name);
        whole_ = *whole;
        route_ = paths_.route(entry_, target_);
    }

    /// From a tip to the target; negative past it [mm].
    double left(const geometry::Vec3& tip) const {
        const anatomy::VesselPlace place = anatomy::nearest_place(anatomy_, tip);
        const double way = paths_.between(place, target_).value_or(whole_);
        const double from_entry = paths_.between(entry_, place).value_or(0);
        const double straight = (tip - at_).norm();
        if (from_entry > whole_ && std::abs(from_entry - whole_ - way) < 3 && straight > 3)
            return -std::max(way, straight);
        return std::max(way, straight);
    }
    /// What has happened to a tip that no longer comes nearer.
    Ending lost_at(const geometry::Vec3& tip) const {
        const anatomy::VesselPlace place = anatomy::nearest_place(anatomy_, tip);
        Ending ending = Ending::Slips;
        for (const anatomy::VesselPaths::Piece& piece : route_) {
            if (piece.branch != place.branch) continue;
            if (place.sample >= std::min(piece.from, piece.to) &&
                place.sample <= std::max(piece.from, piece.to))
                return Ending::FallsBack;
            ending = Ending::Passes;
        }
        return ending;
    }
    const anatomy::Anatomy& anatomy() const { return anatomy_; }
    const geometry::Vec3& entrance() const { return entrance_; }

private:
    static geometry::Vec3 entrance_of(const exercise::Simulation& simulation) {
        const auto end = anatomy::find_end(simulation.anatomy(), simulation.scenario().entry.end);
        return simulation.anatomy().ends[static_cast<std::size_t>(end.value())].opening.centre;
    }

    const anatomy::Anatomy& anatomy_;
    anatomy::VesselPaths paths_;
    anatomy::VesselPlace target_;
    geometry::Vec3 at_, entrance_;
    anatomy::VesselPlace entry_;
    double whole_ = 0;
    std::vector<anatomy::VesselPaths::Piece> route_;
};

/// Tries one move at a time on an exercise of its own.
class Hand {
public:
    Hand(const exercise::Exercise& start, const Ways& ways, const std::vector<std::string>& wires)
        : exercise_(start), ways_(ways), wires_(wires) {
        const scenario::Scenario& s = sim().scenario();
        target_ = s.index_of(s.target.device).value_or(0);
        for (const scenario::PlacedDevice& device : s.devices) roles_.push_back(device.role);
        rate_ = s.frame_rate;
        slow_ = std::clamp(1.4 * s.target.radius / Stay(s).frames(), 0.1, near_speed / rate_);
    }

    int target() const { return target_; }
    int devices() const { return static_cast<int>(roles_.size()); }
    State initial() {
        now_ = {};
        now_.rolls.assign(roles_.size(), 0.0);
        now_.fed.assign(roles_.size(), 0.0);
        return kept();
    }

    Tried attempt(const State& from, int parent, const Move& move) {
        tried_ = {};
        for (std::optional<int> grip;;) {
            exercise_.restore(from.snapshot);
            now_ = from;
            now_.snapshot = {};
            now_.parent = parent;
            now_.lines.clear();
            tried_.states.clear();
            tried_.failure.reset();
            stay_.emplace(sim().scenario());
            injuries_ = sim().injuries().all().size();
            frame_budget_ = 4000;
            last_ = {};
            bowed_.reset();
            if (grip) frame({script::Grip{close_grip, roles_[static_cast<std::size_t>(*grip)]}});
            // A wire that was taken out to steer without it stays out.
            const bool goes_in = move.device == target_ || (move.kind == Move::Kind::Push && move.device > 0);
            if ((!is_out(move.device) || goes_in || move.kind == Move::Kind::Exchange) &&
                !turns_in_vain(move))
                carry_out(move);
            // A shaft that bows outside bears more where less of it is free.
            if (!bowed_ || grip) break;
            grip = bowed_;
        }
        return std::move(tried_);
    }

private:
    const exercise::Simulation& sim() const { return exercise_.simulation(); }
    bool is_out(int device) const { return sim().inserted(roles_[static_cast<std::size_t>(device)]) <= 0; }
    geometry::Vec3 tip(int device) const {
        return is_out(device) ? ways_.entrance() : sim().tip_of(roles_[static_cast<std::size_t>(device)]).at;
    }
    double inserted(int device) const { return sim().inserted(roles_[static_cast<std::size_t>(device)]); }
    double left(int device) const {
        // The tip that the exercise is about may not be the device's end, as of a balloon.
        return ways_.left(device == target_ && !is_out(device) ? sim().tip() : tip(device));
    }
    double value() const {
        const double own = std::abs(left(target_));
        if (target_ == 0) return own;
        return 0.6 * own + 0.4 * (is_out(0) ? own : std::max(0.0, left(0) + 0.6 * beyond));
    }

    State kept() {
        now_.value = value();
        now_.left = left(target_);
        State state = now_;
        state.snapshot = exercise_.snapshot();
        return state;
    }
    void keep() { tried_.states.push_back(kept()); }

    /// A line that goes on from the last frame becomes one with it.
    void note(const script::Command& command) {
        const int frame = now_.frames - 1;
        const auto same = [&](const author::ScriptLine& line) {
            if (line.last + 1 != frame || line.command.index() != command.index()) return false;
            return script::to_text(line.command) == script::to_text(command);
        };
        for (auto line = now_.lines.rbegin(); line != now_.lines.rend() && line->last + 2 > frame; ++line)
            if (same(*line)) {
                line->last = frame;
                return;
            }
        now_.lines.push_back({frame, frame, command});
    }

    /// Makes a frame. False where the move is over.
    bool frame(const std::vector<script::Command>& commands) {
        const exercise::StepReport report = exercise_.next_frame(commands).motion;
        ++now_.frames;
        ++tried_.frames;
        for (const script::Command& command : commands) note(command);
        last_ = report;
        if (!is_out(target_)) stay_->look(sim());
        return --frame_budget_ > 0;
    }
    void let_finish() {
        for (int k = 0; k < waited && (sim().readings().waits || last_.settling); ++k)
            if (!frame({})) return;
    }

    bool turn(int device, double angle) {
        if (angle == 0) return true;
        const int frames = std::max(1, static_cast<int>(std::ceil(std::abs(angle) * rate_ / turn_speed)));
        // Whole tenths of a degree, so that the script says what was done.
        const double part = std::round(angle / frames / geometry::degree * 10) / 10 * geometry::degree;
        ++now_.turns;
        now_.rolls[static_cast<std::size_t>(device)] += part * frames;
        for (int k = 0; k < frames; ++k)
            if (!frame({script::Rotate{part, roles_[static_cast<std::size_t>(device)]}})) return false;
        let_finish();
        return true;
    }

    std::vector<script::Command> feed(int device, double length) {
        const double rounded = std::round(length * 100) / 100;
        now_.fed[static_cast<std::size_t>(device)] += std::abs(rounded);
        const DeviceRole role = roles_[static_cast<std::size_t>(device)];
        if (rounded >= 0) return {script::Advance{rounded, role}};
        return {script::Withdraw{-rounded, role}};
    }

    void fail(Ending ending, int device) {
        const geometry::Vec3 at = tip(device);
        const anatomy::VesselPlace place = anatomy::nearest_place(ways_.anatomy(), at);
        tried_.failure = Failure{ending,
                                 roles_[static_cast<std::size_t>(device)],
                                 ways_.anatomy().branches[static_cast<std::size_t>(place.branch)].name,
                                 anatomy::along(ways_.anatomy(), place),
                                 std::abs(ways_.left(at)),
                                 1};
    }
    bool injured() const { return sim().injuries().all().size() > injuries_; }

    /// The wire goes back until the bend of the catheter is free of it.
    bool draw_wire_in(int catheter) {
        if (is_out(0)) return true;
        double shape = 10;
        for (const physics::RestArc& arc :
             sim().scenario().devices[static_cast<std::size_t>(catheter)].device.shape)
            shape += arc.length;
        const double goal = inserted(catheter) - std::min(shape, 60.0);
        // The sheath's end of the vessels is as far as it may go.
        for (double goes = inserted(0) - std::max(goal, 5.0); goes > 0.05;) {
            const double step = std::min(goes, push_speed / rate_);
            if (!frame(feed(0, -step)) || injured()) return false;
            goes -= step;
        }
        let_finish();
        return true;
    }

    bool take_wire_out() {
        if (!frame({script::Remove{DeviceRole::Wire}})) return false;
        // It comes out at the speed of a hand.
        for (int k = 0; k < 400 && !is_out(0); ++k)
            if (!frame({})) return false;
        return is_out(0);
    }

    /// To the end of what lies around it, which has kept its place.
    bool push_other_wire(int wire) {
        if (!frame({script::Exchange{wires_[static_cast<std::size_t>(wire)], DeviceRole::Wire}}))
            return false;
        now_.wire = wire;
        now_.fed[0] = 0;
        const double step = push_speed / rate_;
        for (double goal = inserted(1), in = 0; in < goal; in = inserted(0)) {
            if (!frame(feed(0, std::min(step, goal - in + 0.01)))) return false;
            if (injured()) fail(Ending::Injures, 0);
            if (last_.refused || last_.buckled) fail(last_.refused ? Ending::Refused : Ending::Wedges, 0);
            if (last_.whole_wire_is_in) fail(Ending::Used, 0);
            if (tried_.failure) return false;
        }
        let_finish();
        keep();
        return true;
    }

    /// Of wires in exchange some may have a shape, and the one in use none.
    bool turns_in_vain(const Move& move) const {
        return move.kind == Move::Kind::Push && move.device == 0 && move.roll != 0 &&
               !is_shaped(sim().devices()[0].device);
    }

    void carry_out(const Move& move) {
        switch (move.kind) {
            case Move::Kind::Push:
                if (turn(move.device, move.roll)) push(move.device);
                return;
            case Move::Kind::Lead:
                if (!is_out(0) && draw_wire_in(move.device) && turn(move.device, move.roll)) push(0);
                return;
            case Move::Kind::Pull:
                if (turn(move.device, move.roll)) pull(move.device);
                return;
            case Move::Kind::Shaped:
                if (draw_wire_in(move.device) && turn(move.device, move.roll)) push(move.device);
                return;
            case Move::Kind::WithoutWire:
                if (!is_out(0) && take_wire_out() && turn(move.device, move.roll)) push(move.device);
                return;
            case Move::Kind::Exchange:
                // With nothing around it another wire is another candidate.
                if (!is_out(1) && (is_out(0) || take_wire_out()) && push_other_wire(move.wire)) push(0);
                return;
        }
    }

    bool can_grip_closer(int device) const {
        if (device != 0 || !comes_out_of_guide(sim().scenario())) return false;
        const std::optional<double> now = sim().gripped_at(roles_[static_cast<std::size_t>(device)]);
        return now && *now > close_grip;
    }

    /// What a push is to lessen [mm].
    double ahead(int device) const {
        const double way = left(device);
        return device < target_ ? way + beyond : way < 0 ? -way : way;
    }

    void push(int device) {
        double best = ahead(device), kept_at = best, in_vain = 0, fed = 0;
        int stuck = 0;
        const double step = push_speed / rate_;
        while (fed < most_fed) {
            const double total = now_.fed[static_cast<std::size_t>(device)];
            const double slow_from = sim().scenario().target.radius + forgiven * total + 5;
            const bool near = device == target_ && ahead(device) < slow_from;
            const double part = near ? slow_ : step;
            const bool going = frame(feed(device, part));
            fed += part;
            if (injured()) return fail(Ending::Injures, device);
            if (stay_->stayed() && device == target_) return arrive(device);
            if (!going) return fail(Ending::Prolapses, device);
            if (last_.buckled && can_grip_closer(device)) {
                bowed_ = device;
                return;
            }
            const bool stands = last_.buckled || last_.too_thick || last_.refused;
            stuck = stands ? stuck + 1 : 0;
            if (stuck >= 4) return fail(last_.refused ? Ending::Refused : Ending::Wedges, device);
            if (last_.past_vessel_end) return fail(Ending::Leaves, device);
            if (last_.whole_wire_is_in) return fail(Ending::Used, device);
            const double now = ahead(device);
            if (device < target_ && now <= 0) {
                let_finish();
                return keep();
            }
            if (now < best - 0.2) {
                best = now;
                in_vain = 0;
            } else {
                in_vain += part;
            }
            if (now > best + backwards) return fail(ways_.lost_at(tip(device)), device);
            if (in_vain > patience) return fail(Ending::Prolapses, device);
            if (now <= kept_at - spacing && !last_.settling && !sim().readings().waits) {
                kept_at = now;
                keep();
            }
        }
    }

    /// All come back together, and the best place on the way is kept.
    void pull(int device) {
        double best = value() - 3;
        const double step = 0.5 * push_speed / rate_;
        std::optional<State> found;
        for (double back = 0; back < drawn_back; back += step) {
            std::vector<script::Command> commands;
            for (int k = 0; k < devices(); ++k) {
                if (is_out(k)) continue;
                if (inserted(k) < step + 20) return;
                for (script::Command& one : feed(k, -step)) commands.push_back(one);
            }
            const bool going = frame(commands);
            if (injured()) return fail(Ending::Injures, device);
            if (stay_->stayed()) break;
            if (!going) return;
            if (value() < best && !last_.settling) {
                best = value() - 1;
                found = kept();
            }
        }
        if (stay_->stayed()) {
            let_finish();
            tried_.reached.push_back(kept());
            return;
        }
        if (found) tried_.states.push_back(std::move(*found));
    }

    /// On through the target, for hands that feed less.
    void arrive(int device) {
        const double more = std::min(forgiven * now_.fed[static_cast<std::size_t>(device)],
                                     3 * sim().scenario().target.radius);
        State there = kept();
        for (double fed = 0; fed < more; fed += slow_) {
            if (!frame(feed(device, slow_)) || injured() || last_.refused || last_.buckled) break;
            there = kept();
        }
        tried_.reached.push_back(std::move(there));
    }

    exercise::Exercise exercise_;
    const Ways& ways_;
    const std::vector<std::string>& wires_;
    int target_ = 0;
    std::vector<DeviceRole> roles_;
    double rate_ = 15, slow_ = 1;

    State now_;
    Tried tried_;
    exercise::StepReport last_;
    int frame_budget_ = 0;
    std::optional<Stay> stay_;  // in the move
    std::optional<int> bowed_;  // device that bowed outside, which a hand that holds it closer would not let
    std::size_t injuries_ = 0;
};

/// `other_wires` to exchange for, of which one has a shape.
std::vector<Move> moves_of(const scenario::Scenario& s, int target, double offset, int other_wires,
                           bool any_is_shaped) {
    const int count = static_cast<int>(s.devices.size());
    const auto shaped = [&](int k) { return is_shaped(s.devices[static_cast<std::size_t>(k)].device); };
    const auto angles = [&](std::initializer_list<double> degrees) {
        std::vector<double> all;
        for (const double angle : degrees) all.push_back((angle + offset) * geometry::degree);
        return all;
    };
    const std::vector<double> turns = angles({180, 90, -90, 45, -45, 135, -135});
    using Kind = Move::Kind;
    std::vector<Move> moves = {{Kind::Push, 0, 0}}, of_wire, of_catheter;
    // So is what is to lead the target's device and starts outside, and what a wire is exchanged through.
    for (int k = 1; k < count; ++k) {
        const scenario::PlacedDevice& device = s.devices[static_cast<std::size_t>(k)];
        const bool leads = !device.starts_inside() && device.role != DeviceRole::Balloon;
        if (k <= target || leads || other_wires > 0) moves.push_back({Kind::Push, k, 0});
    }
    for (int wire = 0; wire < other_wires; ++wire) moves.push_back({Kind::Exchange, 0, 0, wire});
    if (shaped(0) || any_is_shaped)
        for (const double roll : turns) of_wire.push_back({Kind::Push, 0, roll});
    // What steers is the outermost device with a bend, or else the device to be brought there.
    int catheter = target > 0 ? target : count > 1 ? 1 : 0;
    for (int k = 1; k < count; ++k)
        if (shaped(k)) catheter = k;
    const auto add = [&](Kind kind, double roll) { of_catheter.push_back({kind, catheter, roll}); };
    if (catheter > 0) {
        add(Kind::Pull, 0);
        add(Kind::Lead, 0);
    }
    if (catheter > 0 && shaped(catheter)) {
        for (const double roll : angles({90, -90, 180})) {
            add(Kind::Lead, roll);
            add(Kind::Pull, roll);
        }
        for (const double roll : angles({0, 180, 90, -90})) add(Kind::Shaped, roll);
        for (const double roll : angles({45, -45, 135, -135})) {
            add(Kind::Lead, roll);
            add(Kind::Pull, roll);
            add(Kind::Shaped, roll);
        }
        for (const double roll : angles({0, 90, -90, 180})) add(Kind::WithoutWire, roll);
    }
    const bool catheter_leads = catheter > 0 && comes_out_of_guide(s);
    for (const std::vector<Move>* of :
         {catheter_leads ? &of_catheter : &of_wire, catheter_leads ? &of_wire : &of_catheter})
        moves.insert(moves.end(), of->begin(), of->end());
    return moves;
}

/// States that are this near to each other are one.
using Key = std::vector<int>;

class Search {
public:
    Search(const exercise::Exercise& start, const SearchOptions& options)
        : options_(options), ways_(start.simulation()) {
        for (int k = 0; k < width; ++k) hands_.emplace_back(start, ways_, options_.wires);
        scenario_ = &start.simulation().scenario();
        for (const std::string& wire : options_.wires)
            shaped_wires_ =
                is_shaped(exercise::device_of_catalogue(DeviceRole::Wire, wire, *scenario_)) || shaped_wires_;
    }

    Found run() {
        std::mt19937_64 random(options_.seed);
        State first = hands_.front().initial();
        for (int restart = 0; restart <= options_.restarts && !done(); ++restart) {
            // The first time the angles are round ones.
            const double offset = restart == 0 && !options_.other_angles
                                      ? 0
                                      : std::ldexp(static_cast<double>(random() >> 11), -53) * 45 - 22.5;
            moves_ = moves_of(*scenario_, hands_.front().target(), offset,
                              static_cast<int>(options_.wires.size()), shaped_wires_);
            limit_ = options_.most_frames * (restart + 1) / (options_.restarts + 1);
            states_.clear();
            seen_.clear();
            exchanged_.clear();
            queue_ = {};
            add(first);
            while (!queue_.empty() && !done() && found_.frames < limit_) round();
        }
        std::vector<Failure> failures;
        for (auto& [key, failure] : failures_) failures.push_back(failure);
        std::ranges::stable_sort(failures, {}, &Failure::left);
        found_.failures = std::move(failures);
        return std::move(found_);
    }

private:
    struct Entry {
        double priority;
        int state, move;
        bool operator<(const Entry& other) const {
            return std::tie(priority, state, move) > std::tie(other.priority, other.state, other.move);
        }
    };

    bool done() const {
        if (found_.stopped || found_.courses.size() >= options_.courses) return true;
        // What was found early is compared with a few others.
        return !found_.courses.empty() && found_.frames >= enough_;
    }

    Key key(const State& state) const {
        Key key;
        key.push_back(static_cast<int>(std::lround(state.value / 3)));
        key.push_back(state.wire);
        for (const double roll : state.rolls)
            key.push_back(static_cast<int>(
                std::lround(std::remainder(roll, 360 * geometry::degree) / (20 * geometry::degree))));
        for (const double fed : state.fed) key.push_back(static_cast<int>(std::lround(fed / 6)));
        return key;
    }

    void add(State state) {
        if (!seen_.insert(key(state)).second) return;
        const int index = static_cast<int>(states_.size());
        states_.push_back(std::move(state));
        ++found_.states;
        queue(index, 0);
        const State& kept = states_.back();
        if (index == 0 && found_.states == 1) {
            found_.nearest = course_of(kept);
            nearest_ = kept.value;
        } else if (kept.value < nearest_) {
            found_.nearest = course_of(kept);
            nearest_ = kept.value;
        }
    }

    void queue(int state, int move) {
        if (move >= static_cast<int>(moves_.size())) return;
        const State& of = states_[static_cast<std::size_t>(state)];
        const double each = moves_.size() > 10 ? 3 : 6;  // [mm]
        queue_.push({of.value + each * move + 2 * of.turns, state, move});
    }

    /// A wire is exchanged once, and for each other one only once with what lies around it in one place:
    /// where the wire was does not matter.
    bool worth_trying(const Entry& entry) {
        const Move& move = moves_[static_cast<std::size_t>(entry.move)];
        if (move.kind != Move::Kind::Exchange) return true;
        const State& state = states_[static_cast<std::size_t>(entry.state)];
        Key around = key(state);
        around.erase(around.begin(), around.begin() + 1);  // how near the tip is
        around[0] = move.wire;
        const std::size_t devices = state.fed.size();
        around[1] = around[1 + devices] = 0;  // of the wire
        return state.wire < 0 && exchanged_.insert(around).second;
    }

    void round() {
        std::vector<Entry> taken;
        while (static_cast<int>(taken.size()) < width && !queue_.empty()) {
            const Entry next = queue_.top();
            queue_.pop();
            queue(next.state, next.move + 1);
            if (worth_trying(next)) taken.push_back(next);
        }
        std::vector<Tried> tried(taken.size());
        geometry::for_each_index(static_cast<int>(taken.size()), options_.threads, [&](int k) {
            const Entry& entry = taken[static_cast<std::size_t>(k)];
            tried[static_cast<std::size_t>(k)] = hands_[static_cast<std::size_t>(k)].attempt(
                states_[static_cast<std::size_t>(entry.state)], entry.state,
                moves_[static_cast<std::size_t>(entry.move)]);
        });
        for (Tried& one : tried) {
            found_.frames += one.frames;
            for (State& state : one.states) add(std::move(state));
            for (const State& state : one.reached) {
                if (found_.courses.empty()) enough_ = found_.frames * 3 / 2 + 3000;
                if (found_.courses.size() < options_.courses) found_.courses.push_back(course_of(state));
                found_.nearest = found_.courses.front();
                nearest_ = 0;
            }
            if (one.failure) count(*one.failure);
        }
        if (options_.progress) {
            const double of_frames =
                static_cast<double>(found_.frames) / static_cast<double>(options_.most_frames);
            options_.progress(std::min(1.0, of_frames), nearest_);
        }
        if (options_.stop && options_.stop()) found_.stopped = true;
    }

    void count(const Failure& failure) {
        const auto key = std::tuple(failure.ending, failure.device, failure.branch);
        const auto [at, fresh] = failures_.try_emplace(key, failure);
        if (fresh) return;
        const int times = at->second.times + 1;
        if (failure.left < at->second.left) at->second = failure;
        at->second.times = times;
    }

    Course course_of(const State& last) const {
        std::vector<const State*> chain = {&last};
        for (int k = last.parent; k >= 0; k = states_[static_cast<std::size_t>(k)].parent)
            chain.push_back(&states_[static_cast<std::size_t>(k)]);
        Course course;
        for (auto state = chain.rbegin(); state != chain.rend(); ++state)
            for (const author::ScriptLine& line : (*state)->lines) {
                // What goes on across a state that was kept is one line.
                const auto before = std::ranges::find_if(course.lines, [&](const author::ScriptLine& known) {
                    return known.last + 1 == line.first &&
                           script::to_text(known.command) == script::to_text(line.command);
                });
                if (before != course.lines.end())
                    before->last = line.last;
                else
                    course.lines.push_back(line);
            }
        course.frames = last.frames;
        course.left = last.left;
        return course;
    }

    SearchOptions options_;
    Ways ways_;
    std::vector<Hand> hands_;
    const scenario::Scenario* scenario_;
    bool shaped_wires_ = false;  // of those to exchange for
    std::vector<Move> moves_;
    std::vector<State> states_;
    std::set<Key> seen_, exchanged_;
    std::priority_queue<Entry> queue_;
    std::map<std::tuple<Ending, DeviceRole, std::string>, Failure> failures_;
    Found found_;
    double nearest_ = 0;
    long limit_ = 0, enough_ = 0;
};

}  // namespace

script::CommandScript Course::script() const {
    return script::parse_commands(text(), "plan");
}

std::string Course::text(const std::vector<std::string>& comments) const {
    return author::to_text(lines, frames, comments);
}

int Course::turns() const {
    int turns = 0, before = -2;
    for (const author::ScriptLine& line : lines) {
        if (!std::holds_alternative<script::Rotate>(line.command)) continue;
        turns += line.first > before + 1;
        before = line.last;
    }
    return turns;
}

int Course::exchanges() const {
    return static_cast<int>(std::ranges::count_if(lines, [](const author::ScriptLine& line) {
        return std::holds_alternative<script::Exchange>(line.command);
    }));
}

Stay::Stay(const scenario::Scenario& s)
    : frames_(static_cast<int>(std::ceil(s.target.hold * s.frame_rate + 0.5))) {}

void Stay::look(const exercise::Simulation& simulation) {
    in_ = simulation.tip_to_target() <= simulation.scenario().target.radius ? in_ + 1 : 0;
    stayed_ = stayed_ || in_ >= frames_;
}

bool is_shaped(const physics::DeviceSpec& device) {
    return std::ranges::any_of(device.shape, [](const physics::RestArc& arc) { return arc.angle != 0; });
}

Found search(const exercise::Exercise& start, const SearchOptions& options) {
    return Search(start, options).run();
}

}  // namespace plan
