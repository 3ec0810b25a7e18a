#include "physics/relax/trust_region.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace physics {

void TrustRegion::set_unit(double unit) {
    assert(unit > 0);
    unit_ = unit;
}

void TrustRegion::set(double mu) {
    assert(mu >= 0);
    mu_ = mu;
}

void TrustRegion::begin_step() {
    assert(unit_ > 0 && mu_ >= 0);
    went_too_far_ = -1, fell_short_ = 0;
    last_mu_ = 0, last_reach_ = std::numeric_limits<double>::infinity();
    bisections_ = 0;
}

void TrustRegion::too_far(double reach, bool first_trial, bool corrected) {
    assert(!(reach <= 1));
    const TrustOptions& o = options_;
    went_too_far_ = mu_;
    if (fell_short_ > mu_) {
        mu_ = bisected();
        return;
    }
    double factor =
        std::isfinite(reach) ? std::clamp(reach * reach, o.least_growth, o.most_growth) : o.most_growth;
    if (corrected) factor = o.corrected_growth;
    // Back to what the last step fitted with, which may just have been too hopeful.
    if (first_trial && mu_ > 0) factor = std::min(factor, o.first_growth);
    double next = std::max(mu_ * factor, o.least_fraction * unit_);
    if (!corrected) {
        const double rise = (1 / reach - 1 / last_reach_) / (mu_ - last_mu_);
        if (reach < o.secant_reach && last_reach_ < o.secant_reach && rise > 0)
            next = std::clamp(mu_ + (1 / o.secant_aim - 1 / reach) / rise, o.secant_least * mu_,
                              o.secant_most * mu_);
        last_mu_ = mu_, last_reach_ = reach;
    }
    mu_ = next;
    assert(mu_ >= went_too_far_);
}

bool TrustRegion::too_short(double reach) {
    assert(reach <= 1);
    if (!(reach < options_.short_step) || went_too_far_ < 0 || mu_ <= options_.bracket * went_too_far_ ||
        bisections_ == options_.most_bisections)
        return false;
    fell_short_ = mu_;
    mu_ = bisected();
    return true;
}

double TrustRegion::bisected() {
    assert(fell_short_ > 0 && went_too_far_ < fell_short_);
    if (++bisections_ >= options_.most_bisections) return fell_short_;
    return std::sqrt(std::max(went_too_far_, options_.lowest_fraction * fell_short_) * fell_short_);
}

void TrustRegion::rejected() {
    mu_ = std::max(options_.corrected_growth * mu_, options_.rejected_fraction * unit_);
    assert(mu_ > 0);
}

void TrustRegion::accepted(double reach, bool after_rejection) {
    assert(reach >= 0 && reach <= 1);
    const double least = after_rejection ? options_.cautious_shrink : options_.least_shrink;
    double next = mu_ * std::clamp(reach * reach, least, 1.0);
    // Where this step went too far before it fitted, the secant says what will just fit.
    if (const double rise = (1 / reach - 1 / last_reach_) / (mu_ - last_mu_);
        std::isfinite(last_reach_) && rise > 0)
        next = std::clamp(last_mu_ + (1 / options_.secant_aim - 1 / last_reach_) / rise, next, mu_);
    assert(next <= mu_);  // the next step is as long at least
    mu_ = next;
    if (mu_ < options_.forgotten_fraction * unit_) mu_ = 0;
}

void TrustRegion::crawled() {
    mu_ = std::max(options_.first_growth * mu_, options_.least_fraction * unit_);
    assert(mu_ > 0);
}

}  // namespace physics
