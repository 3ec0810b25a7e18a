#include "physics/wire/outside_shaft.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/geometry/maths.h"

namespace physics {
namespace {

constexpr double second = 9.0 / 32;  // of Δ², in the elastica's P/P_c

/// b/((1/(1 − p)²) − 1) of the sag alone [mm].
double sag_length(const OutsideShaft& shaft) {
    assert(shaft.length > 0 && shaft.sag > 0);
    return M_PI * M_PI * shaft.sag * shaft.sag / (4 * shaft.length);
}

}  // namespace

double OutsideShaft::push_at(double bow) const {
    const double ratio = bow / sag_length(*this), over = std::max(0.0, bow) / length;
    assert(ratio > -1);
    return critical * (1 - 1 / std::sqrt(1 + ratio) + over / 2 + second * over * over);
}

double OutsideShaft::stiffness_at(double bow) const {
    const double own = sag_length(*this), over = std::max(0.0, bow) / length;
    const double of_sag = 0.5 / own * geometry::pow(1 + bow / own, -1.5);
    return critical * (of_sag + (bow > 0 ? (0.5 + 2 * second * over) / length : 0.0));
}

double OutsideShaft::bow_at(double push) const {
    assert(std::isfinite(push));
    const double own = sag_length(*this), part = push / critical;
    // The sag alone bows by more than both together, and what is past P_c by less than both.
    if (part <= 0) return own * (1 / ((1 - part) * (1 - part)) - 1);
    double low = 0, high = length;
    if (part < 1) high = std::min(high, own * (1 / ((1 - part) * (1 - part)) - 1));
    for (int k = 0; k < 100 && high - low > 1e-13 * length; ++k) {
        const double middle = 0.5 * (low + high);
        (push_at(middle) < push ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

double OutsideShaft::height() const {
    // An arc of the shape (1 − cos)/2 is shorter across by π²a²/4L than it is long.
    const double of_sag = sag_length(*this);
    return std::sqrt(std::max(0.0, 4 * length * (bow + of_sag))) / M_PI;
}

double euler_force(double rigidity, double length) {
    assert(rigidity > 0 && length > 0);
    return 4 * M_PI * M_PI * rigidity / (length * length);
}

}  // namespace physics
