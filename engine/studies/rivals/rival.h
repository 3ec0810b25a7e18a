#pragma once
/// Classical rods for comparison: what they compute, and how a caller watches them work. They share no code
/// with physics/: wall, bending and solver are their own.
///
/// A rod of N segments has nodes x_0…x_N. x_0 and the direction of the wire there are held. The first and the
/// last node stand for half a segment, so the last has half the wall's stiffness.

#include <memory>
#include <string>
#include <vector>

#include "engine/studies/rivals/tube.h"

namespace rivals {

struct RodSpec {
    double segment_length = 1;       // λ [mm]
    double bending = 50;             // EI [N·mm²]
    double axial = 6300;             // EA [N]; position-based rods have none, they keep their lengths
    double wall_stiffness = 42;      // k of a node [N/mm]
    Vec3 base = Vec3::Zero();        // x_0 [mm]
    Vec3 direction = Vec3::UnitX();  // of the wire at x_0
    Vec3 load = Vec3::Zero();        // on the last node [N]
    Vec3 moment = Vec3::Zero();      // on the last node, of BeamRod alone and in one plane [N·mm]
};

/// Work so far. Processor time depends on the machine, these do not.
struct Tally {
    long long rounds = 0;        // substeps, time steps, Newton steps
    long long wall_queries = 0;  // points that the wall was asked about
    long long solves = 0;        // of a whole rod's linear system, or projections of one constraint
};

enum class Progress {
    Going,
    AtRest,   // nothing moves any more to the precision of the arithmetic
    Stuck,    // no step lowers the energy, but the forces do not balance
    Diverged  // a number is not finite, or a node is farther from x_0 than the rod is long, twice over
};

class Rival {
public:
    Rival(RodSpec spec, const Tube* tube) : spec_(std::move(spec)), tube_(tube) {}
    virtual ~Rival() = default;
    /// Takes the rod as it lies, N+1 nodes, and forgets all else. Throws std::invalid_argument for fewer than
    /// two nodes or one that is not finite.
    virtual void start(const std::vector<Vec3>& nodes) = 0;
    /// Works on, at most so many rounds. A rod that has diverged stays as it was when this was noticed.
    virtual Progress advance(int rounds) = 0;
    virtual double energy() const = 0;  // [N·mm]

    const std::vector<Vec3>& nodes() const { return nodes_; }
    const Tally& tally() const { return tally_; }

protected:
    void take(const std::vector<Vec3>& nodes);
    /// Wall of node i ≥ 1; without a tube there is none.
    Touch touch(int i, bool with_curvature) {
        ++tally_.wall_queries;
        return tube_->touch(nodes_[i], ways_[i], with_curvature);
    }
    double wall_stiffness(int i) const { return (i == segments() ? 0.5 : 1.0) * spec_.wall_stiffness; }
    /// EI over the length that joint i stands for [N·mm].
    double joint_stiffness(int i) const { return (i == 0 ? 2 : 1) * spec_.bending / spec_.segment_length; }
    double wall_energy() const;
    int segments() const { return static_cast<int>(nodes_.size()) - 1; }
    bool lost() const;
    /// Counts rounds in which nothing moved farther than `little` [mm]; a rod is at rest after 20 of them.
    bool rests(double farthest, double little) {
        still_ = farthest < little ? still_ + 1 : 0;
        return still_ >= 20;
    }

    RodSpec spec_;
    const Tube* tube_;  // null = free space
    std::vector<Vec3> nodes_;
    std::vector<double> ways_;
    Tally tally_;
    bool diverged_ = false;

private:
    int still_ = 0;  // rounds in which nothing moved
};

}  // namespace rivals
