#include "physics/wall/opening.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/geometry/maths.h"

namespace physics {
namespace {

/// Loss of radius over which a stent that is balloon-expandable comes to bear all that it can [-].
constexpr double give_of_stent = 0.05;
constexpr double widest = 50;     // of any vessel [mm]
constexpr double settled = 1e-9;  // so near to its balance a place stays where it is [mm]

/// Outwards [atm].
double stent_pressure(const StentLaw& law, const OpenedPlace& place, double radius) {
    if (place.stent <= 0) return 0;
    if (law.self_expanding) {
        const double oversize = std::max(0.0, 1 - radius / law.free_radius);
        return (radius < place.radius ? law.strength : law.outward) * oversize;
    }
    const double holds = place.stent * (1 - law.recoil);
    if (radius < holds) return law.strength * std::min(1.0, (holds - radius) / (give_of_stent * holds));
    return radius > place.stent ? -law.opens_at : 0.0;
}

}  // namespace

double PlaqueLaw::closes_to(const OpenedPlace& place) const {
    if (stiffness <= 0) return place.before;
    return place.before + (1 - recoil) * std::max(0.0, place.largest - yields_at(place));
}

double PlaqueLaw::pressure(const OpenedPlace& place, double radius) const {
    if (stiffness <= 0) return 0;
    const double yields = yields_at(place);
    if (radius >= place.largest || place.largest <= yields)
        return radius <= yields ? stiffness * std::max(0.0, radius - place.before) / place.reference
                                : yield + hardening * (radius - yields) / place.reference;
    const double closed = closes_to(place);
    return radius <= closed ? 0.0
                            : std::min(recoil_pressure, yield) * (radius - closed) / (place.largest - closed);
}

double VesselLaw::pressure(double strain) const {
    return strain <= 0 ? 0.0 : stiffness * (geometry::exp(exponent * std::min(strain, 5.0)) - 1) / exponent;
}

double contact_pressure(const Loads& loads, double radius) {
    if (!loads.balloon || loads.fraction <= 0) return 0;
    return std::max(0.0, loads.pressure - loads.balloon->wall_pressure(2 * radius / loads.fraction));
}

/// All that presses outwards falls with the radius and all that presses inwards rises: one root, by
/// bisection.
double balanced_radius(const OpenedPlace& place, const PlaqueLaw& plaque, const VesselLaw& vessel,
                       const Loads& loads) {
    const auto outwards = [&](double r) {
        return contact_pressure(loads, r) + (loads.stent ? stent_pressure(*loads.stent, place, r) : 0.0) -
               plaque.pressure(place, r) - vessel.pressure(r / place.reference - 1);
    };
    double low = std::max(plaque.closes_to(place), loads.device), high = widest;
    if (!(outwards(low) > 0)) return low;
    for (int k = 0; k < 60; ++k) (outwards(0.5 * (low + high)) > 0 ? low : high) = 0.5 * (low + high);
    return low;
}

void open_place(OpenedPlace& place, const PlaqueLaw& plaque, const VesselLaw& vessel, const Loads& loads,
                double most) {
    assert(place.reference > 0 && most >= 0);
    double wanted = balanced_radius(place, plaque, vessel, loads);
    if (std::abs(wanted - place.radius) < settled) wanted = place.radius;
    const double r = std::clamp(wanted, place.radius - most, place.radius + most);
    place.contact = contact_pressure(loads, r);
    if (loads.stent && place.stent > 0) {
        const StentLaw& stent = *loads.stent;
        if (stent.self_expanding) {
            place.stent = std::min(stent.free_radius, r);
        } else {
            if (loads.balloon && loads.pressure >= stent.opens_at) {
                const double blown = 0.5 * loads.fraction * loads.balloon->diameter(loads.pressure);
                place.stent = std::max(place.stent, std::min({blown, r, stent.free_radius}));
            }
            const double crushed = r / ((1 - stent.recoil) * (1 - give_of_stent));
            place.stent = std::min(place.stent, crushed);
        }
    }
    place.radius = r;
    place.device = loads.device;
    place.largest = std::max(place.largest, r);
}

/// Estimates, so that full opening takes pressures like those observed: docs/treatment.md.
PlaqueLaw law_of(Plaque kind) {
    switch (kind) {
        case Plaque::Soft:
            return {40, 2, 2, 0.3, 0.5};
        case Plaque::Fibrous:
            return {80, 6, 3, 0.3, 0.8};
        case Plaque::Calcified:
            return {160, 13, 4, 0.25, 1};
    }
    return {};
}

}  // namespace physics
