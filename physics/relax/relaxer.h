#pragma once
/// A relaxer lowers the energy of a wire in a vessel by turning its segments, a stated amount of work at a
/// time.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "physics/wall/wall.h"
#include "physics/wire/feed.h"

namespace physics {

enum class RelaxerKind {
    FirstOrder,  // Eq. 22, M = 1 without A and R
    Segment,     // second order, M varied segments (Eqs. 26 to 34)
    Geometric,   // closed pieces of wire between joints that stay (GeometricStep)
    Combined,    // each update of Segment followed by one of Geometric
    Konings,     // M = 1 by small turns of a harmonic joint, whole sweeps from the introducer: before Eq. 22
    Global       // Newton on all segments at once
};
enum class CycleOrder {
    Nested,  // the paper's: for k = 1…N, for b = k…N
    Uniform  // the same number of updates as whole sweeps 1…N
};

struct RelaxerConfig {
    RelaxerKind kind = RelaxerKind::Global;
    int varied_segments = 2;        // M, 1 to 5
    std::optional<int> separation;  // fixed δ between varied segments; empty: Algorithm 2, per update
    double turn_limit = 0.1;        // Δu_max of Eq. 24 [-]
    // Section 3.3 of the paper, without safeguard: (a) both, (b) neither, which is FirstOrder, (c) R alone,
    // (d) A alone, (e) both with M = 2 and 3.
    bool bending_curvature = true;  // keep A
    bool wall_curvature = true;     // keep R
    bool safeguard = true;  // always descend (PHYSICS: Section 2); off = the plain method of the paper
    bool printed = false;   // Segment: the paper's 4M × 4M system, in place of 2M in the planes ⟂ v; plain
    bool stored_planes = false;  // Segment: asks once a sweep, near the wall only; the same equilibrium
    CycleOrder order = CycleOrder::Nested;
    double tolerance = 1e-8;  // Global: largest |dU/du| over C at rest [-]
};

/// Everything that makes the configuration unusable; empty when it is fine.
std::vector<std::string> problems(const RelaxerConfig&);

/// Work for one call: `updates` updates, `distal_share` of them in the `distal_segments` segments at the tip.
struct RelaxBudget {
    int updates = 400;
    double distal_fraction = 0.75;
    int distal_segments = 60;
};
/// The budget of `cycles` whole relaxation cycles, ½N(N+1) updates each, on a wire of N segments.
RelaxBudget whole_cycles(int segments, int cycles);

/// Why a relaxation ended.
enum class Termination {
    NotStarted,     // nothing has been relaxed
    StrictMinimum,  // |dU/du|/C within tolerance, and every pivot of the recursion at μ = 0 positive
    Stationary,     // the former alone: a flat minimum, or a saddle from which no kick leads down
    Settled,        // segment methods: no turn above 1e-10 in a whole sweep
    OutOfBudget,    // the updates ran out; another call goes on
    Stuck           // no step lowers the energy, in softer walls neither
};
/// The same in a sentence.
std::string message(Termination);

constexpr bool at_rest(Termination end) {
    return end == Termination::StrictMinimum || end == Termination::Stationary || end == Termination::Settled;
}

struct RelaxReport {
    int updates = 0;
    int contacts = 0;  // joints that touch the wall at the end
    long long wall_queries = 0;
    double largest_turn = 0;  // largest |u_new − u| of any update [-]
    int rejected = 0;         // updates not made: they would have raised the energy, or were not finite
    Termination termination = Termination::NotStarted;
    // Of the global relaxer only:
    int newton_steps = 0;     // each charged an update for every segment of its window
    int window = 0;           // distal segments that moved; the others kept their tangents
    double gradient = 0;      // largest |dU/du| over C at the end [-]
    double largest_bend = 0;  // of a joint from its rest shape [rad]; above π/3 is a kink
    double push_force = 0;    // along the wire at the introducer, > 0 where the hand must push [N]
    double base_torque = 0;   // against which the hand must hold the hub [N·mm]
    int lag_rounds = 0;       // rests sought, each with fixed normal forces of the grips

    /// The wire is at an equilibrium within the method's tolerance; a strict minimum or not.
    bool at_rest() const { return physics::at_rest(termination); }
    /// Of the segment methods at rest; of the global one at a strict minimum.
    bool converged() const { return termination == Termination::Settled || strict_minimum(); }
    bool strict_minimum() const { return termination == Termination::StrictMinimum; }
    bool out_of_budget() const { return termination == Termination::OutOfBudget; }

    /// Adds a later relaxation: work, largest turn and window cover both; everything else is as the later one
    /// left it.
    void add(const RelaxReport& later);

    void state(StateStream& s) {
        s(updates, contacts, wall_queries, largest_turn, rejected, termination, newton_steps, window,
          gradient, largest_bend, push_force, base_torque, lag_rounds);
    }
};

/// The motion of a hand at the hub: feeds wire, or a device, in (negative: out) and turns it.
struct HubMotion {
    double feed = 0;            // [mm]
    double turn = 0;            // [rad]
    int device = every_device;  // of a chain of several

    void state(StateStream& s) { s(feed, turn, device); }
};

/// Called after each update with the first joint that moved.
using UpdateObserver = std::function<void(int first_moved_joint, const Chain&)>;

/// Why a relaxer cannot relax a chain of these devices: one sentence, empty where it can. All take any number
/// of devices with shapes and sections; all but the global one turn segments alone, with hubs and frames as
/// they are: the paper's relaxers know neither friction nor shafts that twist.
std::string why_not(RelaxerKind, std::span<const Device>);

/// Belongs to one wall, which must outlive it and must not change: a relaxer may remember the wire and its
/// contacts from one call to the next.
class Relaxer {
public:
    virtual ~Relaxer() = default;
    /// A trial state that is not finite is neither evaluated nor taken: the wire ends in its last good state.
    /// Throws std::logic_error for a wire that is not finite as it comes.
    virtual RelaxReport relax(Chain&, const RelaxBudget&, const UpdateObserver& = {}) = 0;
    /// What it remembers between calls.
    virtual void state(StateStream&) = 0;
};

/// Throws std::invalid_argument with the first of problems(config).
std::unique_ptr<Relaxer> make_relaxer(const RelaxerConfig&, const LumenWall&);

}  // namespace physics
