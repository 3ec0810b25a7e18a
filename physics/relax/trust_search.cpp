#include "physics/relax/trust_search.h"

#include <algorithm>
#include <cmath>

namespace physics {
namespace {

constexpr double hopeful = 10;  // of μ when it fitted the step before
constexpr double timid = 0.03;  // cap: a step below it is too stiff
constexpr int search_tries = 5;
constexpr double narrow = 2;            // between too soft and too stiff, which ends the search
constexpr double far_below = 1e-4;      // of μ, where none is too soft
constexpr double secant_reach = 20;     // caps, below which 1/reach is a straight line in μ
constexpr double aimed_reach = 0.8;     // caps
constexpr double secant_growth = 1000;  // of μ at most
constexpr double least_growth = 2, most_growth = 30, corrected_growth = 4;

}  // namespace

void TrustSearch::raise(double reach, bool first_trial, bool corrected) {
    overshoots_ = mu_;
    if (fits_ > 0) {
        mu_ = between();
        return;
    }
    double factor = std::isfinite(reach) ? std::clamp(reach * reach, least_growth, most_growth) : most_growth;
    if (corrected) factor = corrected_growth;
    // Back to what the last step fitted with, which may just have been too hopeful.
    if (first_trial && mu_ > 0) factor = std::min(factor, hopeful);
    double next = std::max(mu_ * factor, least_trust * unit_);
    if (!corrected) {
        // 1/reach is nearly a straight line in μ.
        const double rise = (1 / reach - 1 / last_reach_) / (mu_ - last_mu_);
        if (reach < secant_reach && last_reach_ < secant_reach && rise > 0)
            next = std::clamp(mu_ + (1 / aimed_reach - 1 / reach) / rise, 1.5 * mu_, secant_growth * mu_);
        last_mu_ = mu_, last_reach_ = reach;
    }
    mu_ = next;
}

bool TrustSearch::lower(double reach) {
    if (!(reach < timid) || overshoots_ < 0 || mu_ <= narrow * overshoots_ || tries_ == search_tries)
        return false;
    fits_ = mu_;
    mu_ = between();
    return true;
}

double TrustSearch::between() {
    return ++tries_ < search_tries ? std::sqrt(std::max(overshoots_, far_below * fits_) * fits_) : fits_;
}

}  // namespace physics
