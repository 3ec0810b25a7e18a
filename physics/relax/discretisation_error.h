#pragma once
/// How far a chain at rest is from the one that infinitely short segments would make of it.

#include <optional>
#include <span>
#include <vector>

#include "physics/relax/contact_set.h"
#include "physics/relax/newton_model.h"

namespace physics {

/// An estimate for λ → 0, everything else as it is: normal forces of friction and the vessels' ways are held.
struct DiscretisationError {
    Vec3 tip_moves = Vec3::Zero();  // where the tip would be, less where it is [mm]
    double tip = 0;                 // the same as a distance, at least what rounding and tolerance hide [mm]
    /// Of the largest force with which a length λ of the chain presses on the wall: what it would be, less
    /// what it is, at least a hundredth of that [N]. A joint bears the force of half of each of its segments;
    /// on the finer chain that of the same length counts.
    double wall_force = 0;
    /// [i] = the part of `tip` that segment i causes, i = 1…N, [0] unused; parts may be negative, and add up
    /// to it [mm]. Empty unless asked for.
    std::vector<double> segments;
};

/// Cuts the segments in halves, those at which contacts begin or end in eighths and those at a tip that
/// touches down to 1/32 of λ, along a curve through the chain, and takes one step of Newton's method of that
/// finer chain from there, with its wall corrected until tip and largest force stay: docs/solver.md derives
/// it. Keeps scratch from call to call, and nothing else: estimates do not depend on each other. Belongs to
/// one wall, which must outlive it.
class ErrorEstimator {
public:
    explicit ErrorEstimator(const LumenWall& wall) : contacts_(wall) {}

    /// Of a chain at a strict minimum, with the contacts of its joints; neither changes. Empty where there is
    /// none: a chain of one segment, or a finer one that has no minimum near.
    std::optional<DiscretisationError> of(const Chain&, std::span<const WallContact>,
                                          bool by_segment = false);

    /// Passes over the finer chain's segments that the last estimate has made.
    int updates() const { return passes_ * fine_.segments(); }

private:
    void cut(const Chain&, std::span<const WallContact>);
    void lay(const Chain&);
    void place_grips(const Chain&);
    void share_forces(const Chain&, std::span<const WallContact>);
    struct ForceChange {
        double change = 0, largest = 0;  // of the largest force, and that as it is [N]
    };
    ForceChange change_of_force(const Chain&, std::span<const WallContact>) const;
    std::vector<double> parts_of(const Chain&);

    ContactSet contacts_;
    NewtonModel model_;
    int passes_ = 0;
    Chain fine_;
    std::vector<int> parts_;      // [i] = pieces of segment i
    std::vector<double> place_;   // [k] = of joint k of the finer chain in its segment, a fraction of that
    std::vector<int> near_;       // [k] = joint of the chain that is nearest to joint k of the finer one
    std::vector<double> forces_;  // of the wall on the joints of the finer chain [N]
};

}  // namespace physics
