#include <algorithm>

#include "physics/wall/opening.h"

namespace physics {
namespace {
double line(double a, double b, double fa, double fb, double x) { return fa + (x - a) / (b - a) * (fb - fa); }
}  // namespace
double BalloonLaw::diameter(double p) const {
    if (p <= 0) return profile;
    const double unfolded = std::min(unfolds_at, table.front().pressure);
    const auto on_table = [&](double q) {
        std::size_t k = 1;
        while (k + 1 < table.size() && q > table[k].pressure) ++k;
        return line(table[k - 1].pressure, table[k].pressure, table[k - 1].diameter, table[k].diameter, q);
    };
    if (p < unfolded) return line(0, unfolded, profile, on_table(unfolded), p);
    return on_table(p);
}
double BalloonLaw::wall_pressure(double d) const {
    double low = 0, high = 200;
    if (d <= profile) return 0;
    for (int k = 0; k < 60; ++k) (diameter(0.5 * (low + high)) < d ? low : high) = 0.5 * (low + high);
    return low;
}
}  // namespace physics
