#pragma once
/// The trust region of one Newton step, found by trials.

#include <limits>

namespace physics {

/// Least μ relative to its unit, which is a wire's stiffness over the width of the lumen.
constexpr double least_trust = 1e-6;
/// Largest μ relative to it: a step with a larger one moves no joint by as much as its place is rounded by.
constexpr double most_trust = 1e30;

/// Looks for the μ with which a step just fits its cap. `mu` is the value for the next trial [N/mm²].
class TrustSearch {
public:
    TrustSearch(double& mu, double unit) : mu_(mu), unit_(unit) {}

    /// Raises μ after a trial that went `reach` times as far as the cap, or to no finite place. A trial with
    /// a corrected wall says little about others.
    void raise(double reach, bool first_trial, bool corrected);

    /// After a trial that fits: whether to try a μ between it and one that does not instead. Negative
    /// curvature can make every step far too long or far too short.
    bool lower(double reach);

private:
    double between();

    double& mu_;
    double unit_, overshoots_ = -1, fits_ = 0;
    double last_mu_ = 0, last_reach_ = std::numeric_limits<double>::infinity();
    int tries_ = 0;
};

}  // namespace physics
