#pragma once
/// The paper's measure of a joint's path to equilibrium: its lateral deviation d_i from a reference curve in
/// a plane, followed through the updates of a relaxation.

#include <span>
#include <vector>

#include "physics/relax/relaxer.h"
#include "physics/wire/chain.h"

namespace studies {

/// A wire's joints projected on the xy plane, the plane of the paper's tubes.
class ReferenceCurve {
public:
    /// Needs two joints or more, no two consecutive ones at the same place (asserted).
    explicit ReferenceCurve(std::span<const geometry::Vec3> joints);
    /// d: least distance in the plane, > 0 to the right of the curve [mm].
    double deviation(const geometry::Vec3&) const;

private:
    std::vector<geometry::Vec2> points_, along_;  // along_[k]: unit, from point k to k + 1
    std::vector<double> lengths_;
};

/// d_i of one joint after every update that moves it, b ≤ i, as a function of the number of cycles.
class DeviationTrace {
public:
    DeviationTrace(const ReferenceCurve& curve, int joint, int segments);

    void observe(int first_moved, const physics::Chain&);

    int joint() const { return joint_; }
    long long records() const { return records_; }
    /// Cycles after which |d_i| stays within `limit` to the end; infinite if it never does. Limits in
    /// limit_table.
    double settled(double limit) const;
    /// Largest minus least d_i over the cycle `cycle` (from 0) [mm].
    double swing(int cycle) const;
    /// |d_i| at the end of cycle `cycle` (from 0), divided by that at the first record [-].
    double left_after(int cycle) const;

    /// Mean of |d_i| over the records of the first `cycles` cycles [mm].
    double mean(int cycles) const;

    /// The trace as some thousand points: the least and the largest d_i of each twentieth of a cycle, in the
    /// order they occurred, so that oscillations keep their width.
    struct Point {
        double cycles, deviation;  // [-], [mm]
    };
    std::vector<Point> points() const;

    static constexpr double limit_table[] = {0.1, 0.01, 0.001};  // [mm]

private:
    struct Extremes {
        Point least, largest, last;
        double sum = 0;  // of |d_i| [mm]
        long long records = 0;
    };
    const ReferenceCurve& curve_;
    int joint_;
    double per_cycle_;  // updates
    long long updates_ = 0, records_ = 0;
    double exceeded_[3] = {};
    double start_ = 0;  // d_i of the first record [mm]
    std::vector<std::pair<long long, Extremes>> bins_;
};

/// Relaxes the wire for this many cycles and passes the updates to the traces.
physics::RelaxReport follow(const physics::RelaxerConfig&, physics::Chain&, const physics::LumenWall&,
                            int cycles, std::span<DeviationTrace>);

}  // namespace studies
