#pragma once
/// Classical rods for comparison: what they compute, and how a caller watches them work. They share no code
/// with physics/: wall, bending and solver are their own.
///
/// A rod of N segments has nodes x_0…x_N. x_0 and the direction of the wire there are held. The first and the
/// last node stand for half a segment, so the last has half the wall's stiffness.

#include <Eigen/Geometry>
#include <vector>

namespace baselines {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// A piece of the centreline: the heading turns steadily by `angle` about `axis` over `length`.
struct Piece {
    double length = 0;          // [mm]
    double angle = 0;           // right-handed [rad]; 0 = straight
    Vec3 axis = Vec3::UnitZ();  // any length; not perpendicular to the heading makes a helix
};

/// What the wall answers a point.
struct Touch {
    double depth = 0;               // outside the lumen, > 0 where the wall pushes back [mm]
    Vec3 normal = Vec3::Zero();     // ∇ depth, out of the lumen
    Mat3 curvature = Mat3::Zero();  // ∇² depth [1/mm]
};

/// The rivals' own wall, in closed form. The lumen is the set of points within `radius` of the centreline of
/// straight runs, arcs and helices, which leaves the origin along +x.
class Tube {
public:
    /// Throws std::invalid_argument where there is no piece, a length is not positive, a number is not
    /// finite, or the radius is not positive.
    Tube(const std::vector<Piece>& pieces, double radius);

    double radius() const { return radius_; }  // [mm]
    double length() const { return total_; }   // of the centreline [mm]
    Vec3 point(double arc) const;              // of the centreline, 0 ≤ way ≤ length()

    /// The way along the centreline of its point nearest to x, of all points [mm].
    double nearest_arc(const Vec3& x) const;
    /// Follows the nearest point from `direction`, which must be near, and updates it. The curvature is
    /// computed only where it is asked for.
    Touch touch(const Vec3& x, double& arc, bool with_curvature) const;

private:
    /// c(s) = start + along·s + (sin ωs/ω) across + ((1 − cos ωs)/ω) beside.
    struct Curve {
        double from = 0, length = 0, turn = 0;  // way of its start [mm], [mm], ω [rad/mm]
        Vec3 start, along, across, beside;      // parts of the heading along and across the axis
    };
    struct Place {
        Vec3 point, heading, bend;  // c, c', c''
    };
    static Place place(const Curve&, double s);
    const Curve& curve_at(double arc) const;

    std::vector<Curve> curves_;
    double radius_, total_ = 0;
};

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

class Baseline {
public:
    Baseline(RodSpec spec, const Tube* tube) : spec_(std::move(spec)), tube_(tube) {}
    virtual ~Baseline() = default;
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
        return tube_->touch(nodes_[i], arcs_[i], with_curvature);
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
    std::vector<double> arcs_;
    Tally tally_;
    bool diverged_ = false;

private:
    int still_ = 0;  // rounds in which nothing moved
};

}  // namespace baselines
