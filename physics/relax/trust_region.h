#pragma once
/// The trust region of Newton's method: a weight μ [N/mm²] that adds μλ to the stiffness of every joint, so
/// that no joint moves farther than a cap. This class alone changes it.

#include <limits>

#include "physics/geometry/state.h"
#include "physics/relax/global_options.h"

namespace physics {

using namespace geometry;

/// Finds the μ with which a step just fits its cap, by trials. `reach` is how far a trial moved a joint, over
/// the cap.
class TrustRegion {
public:
    explicit TrustRegion(const TrustOptions& options) : options_(options) {}

    double mu() const { return mu_; }
    double unit() const { return unit_; }
    /// μ₀, the wire's stiffness over the width of the lumen [N/mm²].
    void set_unit(double unit);
    void set(double mu);
    /// No trust region: the whole step.
    void reset() { mu_ = 0; }
    /// Whether a step with this μ still moves a joint by more than its place is rounded by.
    bool moves_joints() const { return mu_ <= options_.most_fraction * unit_; }

    /// Forgets the trials of the step before.
    void begin_step();
    /// After a trial with reach > 1, or that led to no finite place: raises μ. A trial whose wall was
    /// `corrected` says little about others.
    void too_far(double reach, bool first_trial, bool corrected);
    /// After a trial that fits but is too short to lead anywhere: bisects between it and one that went too
    /// far, and returns whether there is such a μ to try. Negative curvature can make every step far too long
    /// or far too short.
    bool too_short(double reach);
    /// After a trial that fits, was corrected as often as is allowed, and still does not lower the energy.
    void rejected();
    /// After an accepted step: the next one is to just fit as well.
    void accepted(double reach, bool after_rejection);
    /// After an accepted step that crawls because many pivots were shifted one by one: with a stiffer trust
    /// region fewer are negative and the step is longer.
    void crawled();

    void state(StateStream& s) { s(mu_, unit_); }

private:
    double bisected();

    TrustOptions options_;
    double mu_ = 0, unit_ = 0;
    // Of the step's trials so far.
    double went_too_far_ = -1, fell_short_ = 0;  // largest and least such μ; -1, 0 = none
    double last_mu_ = 0, last_reach_ = std::numeric_limits<double>::infinity();
    int bisections_ = 0;
};

}  // namespace physics
