#include "physics/relax/trust_search.h"

#include <algorithm>
#include <cmath>

namespace physics {
namespace {

constexpr double kHopeful = 10;  // of μ when it fitted the step before
constexpr double kTimid = 0.03;  // cap: a step below it is too stiff
constexpr int kSearchTries = 5;
constexpr double kNarrow = 2;           // between too soft and too stiff, which ends the search
constexpr double kFarBelow = 1e-4;      // of μ, where none is too soft
constexpr double kSecantReach = 20;     // caps, below which 1/reach is a straight line in μ
constexpr double kAimedReach = 0.8;     // caps
constexpr double kSecantGrowth = 1000;  // of μ at most
constexpr double kLeastGrowth = 2, kMostGrowth = 30, kCorrectedGrowth = 4;

}  // namespace

void TrustSearch::raise(double reach, bool first_trial, bool corrected) {
    overshoots_ = mu_;
    if (fits_ > 0) {
        mu_ = between();
        return;
    }
    double factor = std::isfinite(reach) ? std::clamp(reach * reach, kLeastGrowth, kMostGrowth) : kMostGrowth;
    if (corrected) factor = kCorrectedGrowth;
    // Back to what the last step fitted with, which may just have been too hopeful.
    if (first_trial && mu_ > 0) factor = std::min(factor, kHopeful);
    double next = std::max(mu_ * factor, kLeastTrust * unit_);
    if (!corrected) {
        // 1/reach is nearly a straight line in μ.
        const double rise = (1 / reach - 1 / last_reach_) / (mu_ - last_mu_);
        if (reach < kSecantReach && last_reach_ < kSecantReach && rise > 0)
            next = std::clamp(mu_ + (1 / kAimedReach - 1 / reach) / rise, 1.5 * mu_, kSecantGrowth * mu_);
        last_mu_ = mu_, last_reach_ = reach;
    }
    mu_ = next;
}

bool TrustSearch::lower(double reach) {
    if (!(reach < kTimid) || overshoots_ < 0 || mu_ <= kNarrow * overshoots_ || tries_ == kSearchTries)
        return false;
    fits_ = mu_;
    mu_ = between();
    return true;
}

double TrustSearch::between() {
    return ++tries_ < kSearchTries ? std::sqrt(std::max(overshoots_, kFarBelow * fits_) * fits_) : fits_;
}

}  // namespace physics
