#pragma once
/// How far a diseased vessel opens: the radius at one place on which a balloon, the plaque, the vessel's wall
/// and a stent agree. Each of them is a law between its pressure and a radius, and places along the vessel do
/// not act on each other: a balloon shows a waist because the plaque is narrow there. Pressures in atm, as on
/// the dial of an inflation device, above the blood's. Sources of the numbers: docs/treatment.md.

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "physics/geometry/state.h"

namespace physics {

inline constexpr double atmosphere = 0.101325;  // [N/mm²]

/// A balloon in air. Folded it has its profile; it unfolds, against next to nothing, by `unfolds_at`, and
/// from there on follows its maker's table, between whose rows and beyond whose ends it is linear.
struct BalloonLaw {
    struct Row {
        double pressure = 0, diameter = 0;  // [atm], [mm]
        void state(geometry::StateStream& s) { s(pressure, diameter); }
    };
    static constexpr double unfolds_at = 1;  // or by the table's first pressure, where that is lower [atm]

    double profile = 1;      // diameter when folded [mm]
    std::vector<Row> table;  // at least two, pressures and diameters rising

    double diameter(double pressure) const;
    /// The pressure that its own wall bears at a diameter; 0 when folded. What it is inflated with beyond
    /// that presses on what holds it there [atm].
    double wall_pressure(double diameter) const;
    void state(geometry::StateStream& s) { s(profile, table); }
};

/// What one place of a vessel has become.
struct OpenedPlace {
    double reference = 0;  // R: of the vessel without plaque [mm]
    double before = 0;     // r_0: of the lumen before the treatment [mm]
    double radius = 0;     // r: of the lumen now [mm]
    double stent = 0;      // r_s; 0 = none [mm]
    double largest = 0;    // r_m [mm]
    double contact = 0;    // of the balloon on the wall or the stent [atm]
    double device = 0;     // radius of what lies in it, an inflated balloon aside [mm]

    bool operator==(const OpenedPlace&) const = default;
    void state(geometry::StateStream& s) { s(reference, before, radius, stent, largest, contact, device); }
};

enum class Plaque { Soft, Fibrous, Calcified };
inline constexpr std::array<std::string_view, 3> plaque_names = {"soft", "fibrous", "calcified"};
inline constexpr std::string_view name_of(Plaque p) {
    return plaque_names[static_cast<std::size_t>(p)];
}

/// Plaque in a vessel of radius R. With r the lumen's radius, r_0 the one before the treatment, and r_m the
/// largest so far, plaque that is opened farther than ever bears K (r − r_0)/R, and from where that has
/// reached the yield pressure, at r_y, on, yield + hardening (r − r_y)/R. What has yielded is torn: up to r_m
/// it bears no more than the recoil pressure, falling linearly to 0 at r_0 + (1 − recoil) (r_m − r_y), to
/// where it closes without a load.
struct PlaqueLaw {
    double stiffness = 0;        // K [atm]; 0 = no plaque
    double yield = 0;            // [atm]
    double hardening = 0;        // [atm]
    double recoil = 0;           // of what it was opened by beyond r_y [-]
    double recoil_pressure = 1;  // [atm]

    /// At a radius [atm].
    double pressure(const OpenedPlace&, double radius) const;
    /// To which it closes without a load [mm].
    double closes_to(const OpenedPlace&) const;

private:
    double yields_at(const OpenedPlace& place) const {
        return place.before + place.reference * yield / stiffness;
    }
};
PlaqueLaw law_of(Plaque);

/// A vessel's wall beyond its radius R without a load: a Fung exponential, c (exp(b ε) − 1)/b with ε = r/R
/// − 1.
struct VesselLaw {
    double stiffness = 0.8;                // c [atm]
    double exponent = 10;                  // b [-]
    double pressure(double strain) const;  // 0 where it is not stretched
};

/// A stent of expanded radius r_s. One that is balloon-expandable keeps r_s (1 − recoil) against all
/// pressures up to its strength, above which it yields inwards; it opens farther under `opens_at`. A
/// self-expanding one presses outwards with `outward` times its oversize 1 − r/r_free, and bears `strength`
/// times that.
struct StentLaw {
    bool self_expanding = false;
    double free_radius = 0;  // self-expanding, or the largest to which it may be dilated [mm]
    double recoil = 0;       // [-]
    double strength = 0;     // [atm]
    double outward = 0;      // [atm]
    double opens_at = 0;     // [atm]
    void state(geometry::StateStream& s) {
        s(self_expanding, free_radius, recoil, strength, outward, opens_at);
    }
};

/// What acts on a place from within.
struct Loads {
    const BalloonLaw* balloon = nullptr;  // null where none lies
    double pressure = 0;                  // in it [atm]
    double fraction = 1;                  // of its diameter there: its cones are narrower [-]
    const StentLaw* stent = nullptr;      // null where none lies
    double device = 0;                    // radius of what lies there besides [mm]
};

/// Moves a place towards the radius at which all are in balance, by at most `most` [mm]; no place is narrower
/// than the device in it. Unconditionally stable; a larger pressure never gives a smaller radius.
void open_place(OpenedPlace&, const PlaqueLaw&, const VesselLaw&, const Loads&, double most);
/// The radius towards which it would move [mm].
double balanced_radius(const OpenedPlace&, const PlaqueLaw&, const VesselLaw&, const Loads&);
/// Of a balloon on what is around it at a radius [atm].
double contact_pressure(const Loads&, double radius);

}  // namespace physics
