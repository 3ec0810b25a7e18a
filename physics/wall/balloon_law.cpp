#include <cassert>

#include "physics/wall/opening.h"

namespace physics {
namespace {

/// A line of diameter over pressure through a row. It meets its row exactly.
struct BalloonLine {
    BalloonLaw::Row at;
    double slope = 0;  // [mm/atm]

    double diameter(double pressure) const { return at.diameter + slope * (pressure - at.pressure); }
    double pressure(double diameter) const { return at.pressure + (diameter - at.diameter) / slope; }
};

BalloonLine line_of(const BalloonLaw::Row& from, const BalloonLaw::Row& to) {
    return {from, (to.diameter - from.diameter) / (to.pressure - from.pressure)};
}

/// Where it has unfolded.
BalloonLaw::Row unfolded_row(const BalloonLaw& law) {
    const BalloonLaw::Row& first = law.table.front();
    if (first.pressure <= BalloonLaw::unfolds_at) return first;
    const double diameter = line_of(first, law.table[1]).diameter(BalloonLaw::unfolds_at);
    return diameter > law.profile ? BalloonLaw::Row{BalloonLaw::unfolds_at, diameter} : first;
}

/// The line of the first piece for whose end, a row, `before(row)` holds; else of the last one, from its end
/// on.
template <class Before>
BalloonLine line_at(const BalloonLaw& law, const Before& before) {
    assert(law.table.size() >= 2);
    if (const BalloonLaw::Row unfolded = unfolded_row(law); before(unfolded))
        return line_of({0, law.profile}, unfolded);
    for (std::size_t k = 1; k < law.table.size(); ++k)
        if (before(law.table[k])) return line_of(law.table[k - 1], law.table[k]);
    BalloonLine last = line_of(law.table[law.table.size() - 2], law.table.back());
    last.at = law.table.back();
    return last;
}

}  // namespace

double BalloonLaw::diameter(double pressure) const {
    if (pressure <= 0) return profile;
    return line_at(*this, [pressure](const Row& row) { return pressure < row.pressure; }).diameter(pressure);
}

double BalloonLaw::wall_pressure(double diameter) const {
    if (diameter <= profile) return 0;
    return line_at(*this, [diameter](const Row& row) { return diameter < row.diameter; }).pressure(diameter);
}

}  // namespace physics
