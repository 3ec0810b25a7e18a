#pragma once
/// Shorter segments where the tip's error comes from, and whole ones again where it no longer does.

#include "physics/relax/discretisation_error.h"

namespace physics {

struct ErrorRefinementOptions {
    double tolerance = 0.01;      // of the tip, by the estimate [mm]
    double least_piece = 0.125;   // of λ: none is halved into shorter ones,
    double least_tip = 1.0 / 64;  // but the last one, of a tip that touches
    double worst_part = 0.25;     // of the largest part of a λ: those with more are halved
    double part_of_slack = 0.5;   // between estimate and tolerance, that merges may use
    double least_saving = 0.1;    // of the segments: fewer are not merged, for each change costs a rest
};

/// What one round has done.
struct ErrorRefinementRound {
    std::optional<double> tip;  // the estimate before its changes [mm]
    int split = 0, merged = 0;  // joints put in and taken out
    int updates = 0;            // of the estimate
    bool changed() const { return split > 0 || merged > 0; }
};

/// Keeps a chain's tip within a tolerance from rest to rest, with few segments: pieces stay in the chain, and
/// nothing else is remembered. A chain that is fed has its tip's pieces go with it if its grid has
/// tip_segments; all others keep their places in the vessel, where bends and contacts stay, too.
class ErrorRefinement {
public:
    /// The wall must outlive it.
    ErrorRefinement(const LumenWall& wall, const ErrorRefinementOptions& options)
        : estimator_(wall), wall_(wall), options_(options) {}

    /// For a chain at a strict minimum, with the contacts of its joints. Beyond the tolerance the last
    /// segment of a tip that touches is halved towards its end, and after that all pieces of each λ that
    /// causes more than a part of what the worst does; within it, pairs of pieces are merged that cost least.
    /// Where something has changed, bring the chain to rest and ask again: until then its error is not known.
    /// After the first round at a rest, only split: what a merge has cost too much is split again.
    ErrorRefinementRound round(Chain&, std::span<const WallContact>, bool may_merge = true);

private:
    int split(Chain&, std::span<const WallContact>, const std::vector<double>& parts) const;
    int merge(Chain&, std::span<const WallContact>, const std::vector<double>& parts, double slack) const;

    ErrorEstimator estimator_;
    const LumenWall& wall_;
    ErrorRefinementOptions options_;
};

}  // namespace physics
