#pragma once
/// What files of Simulation share.

#include <algorithm>
#include <cmath>

#include "physics/relax/relaxer.h"

namespace exercise {

/// Sums the reports of a frame, whose sharpest bend counts and not the last.
inline void accumulate(physics::RelaxReport& sum, const physics::RelaxReport& part) {
    const double bend = std::max(sum.largest_bend, part.largest_bend);
    sum.add(part);
    sum.largest_bend = bend;
}

/// Equal parts of a motion, each no larger than `step`.
inline int steps_of(double amount, double step) {
    return static_cast<int>(std::ceil(std::abs(amount) / step * (1 - 1e-12)));
}

}  // namespace exercise
