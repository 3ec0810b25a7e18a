#pragma once
/// What was made of lesions: lumen, stents, pressures, in figures. They are raw values; what is a good one is
/// for no program to say (docs/treatment.md names what is published). A value that has no meaning, as the
/// ends of a stent without a stent, is empty.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/exercise/treatment.h"
#include "physics/geometry/state.h"

namespace exercise {

class Simulation;
struct Complication;

/// A lesion before the treatment, or now, with no device in it.
struct LesionState {
    double lumen = 0;      // diameter of its narrowest place: that with the least of the reference [mm]
    double reference = 0;  // diameter of the vessel there without plaque [mm]
    double residual = 0;   // 100 (1 - lumen / reference); below 0 where it is wider than that [percent]
    /// Mean pressures before and behind it, along the flow, and the second over the first: at rest, and in an
    /// assumed hyperaemia, blood::hyperaemia. Other lesions count, complications and balloons do not. Empty
    /// where no blood runs.
    std::optional<double> proximal, distal;   // [mmHg]
    std::optional<double> ratio, hyperaemic;  // [-]

    std::optional<double> gradient() const {
        return proximal && distal ? std::optional(*proximal - *distal) : std::nullopt;
    }
    void state(geometry::StateStream& s) {
        s(lumen, reference, residual, proximal, distal, ratio, hyperaemic);
    }
};

/// Stents against a lesion. Places are arcs along its branch from the origin, below 0 in the vessel that it
/// leaves.
struct StentedLesion {
    double covered = 0;          // of its length [percent]
    double missed_proximal = 0;  // length at its ends that no stent reaches [mm]
    double missed_distal = 0;
    double proximal_end = 0;  // of all its stents [mm]
    double distal_end = 0;
    std::optional<double> proximal_off;  // of these from the plan; + = too far distal [mm]
    std::optional<double> distal_off;
    std::optional<double> protrusion;  // into the vessel that the branch leaves [mm]
    /// What balloons that were inflated in the lesion have pressed on beyond the stents [mm].
    std::optional<double> beyond_proximal, beyond_distal;
    // In the branch; empty where all of the stent lies in the vessel that it leaves.
    std::optional<double> gap;        // the largest between stent and wall, of radii [mm]
    std::optional<double> apposed;    // of the samples, with a gap up to `apposed_within` [percent]
    std::optional<double> expansion;  // least diameter over the reference there [percent]
    std::vector<std::string> jailed;  // branches whose origin lies under a stent

    static constexpr double apposed_within = 0.3;  // [mm]

    void state(geometry::StateStream& s) {
        s(covered, missed_proximal, missed_distal, proximal_end, distal_end, proximal_off, distal_off,
          protrusion, beyond_proximal, beyond_distal, gap, apposed, expansion, jailed);
    }
};

struct LesionScore {
    std::string branch;
    double at = 0, length = 0;  // of what is left of it in its branch: its middle from the origin [mm]
    LesionState before, after;
    std::optional<StentedLesion> stented;

    void state(geometry::StateStream& s) { s(branch, at, length, before, after, stented); }
};

struct StentScore {
    std::string device;
    int frame = 0;          // of the attempt, at which its deployment began
    double length = 0;      // now [mm]
    double diameter = 0;    // mean, as its wall lies [mm]
    int lesion = -1;        // that it counts for: the one it overlaps, or the nearest
    bool attached = false;  // it has not left its balloon or sheath

    void state(geometry::StateStream& s) { s(device, frame, length, diameter, lesion, attached); }
};

struct TreatmentScore {
    std::vector<LesionScore> lesions;
    std::vector<StentScore> stents;
    InflationTally tally;
    int bursts = 0, dissections = 0, ruptures = 0;  // by the balloon
    int dissections_left = 0;                       // of these, whose flap no stent holds

    /// The largest residual stenosis now [percent]; empty without a lesion.
    std::optional<double> worst_residual() const;
    void state(geometry::StateStream& s) {
        s(lesions, stents, tally, bursts, dissections, ruptures, dissections_left);
    }
};

/// A line of a table for people.
struct TreatmentFigure {
    std::string name, before, now;  // `before` is empty where that has no meaning
    std::string meaning;
};
/// "left renal artery, 12 mm from its origin".
std::string name_of(const LesionScore&);
std::vector<TreatmentFigure> figures_of(const LesionScore&);
/// Of balloons, and of what they did to the wall.
std::vector<TreatmentFigure> figures_of(const TreatmentScore&);

/// Stretch of a branch on which balloons have been inflated; none where `to` < `from` [mm].
struct Ballooned {
    double from = 0, to = -1;
    bool any() const { return to >= from; }
    void state(geometry::StateStream& s) { s(from, to); }
};

/// The narrowest place of a lesion, without the samples past its ends, by one of its radii; no pressures.
LesionState lumen_of(const BranchStretch&, std::span<const physics::OpenedPlace>,
                     double physics::OpenedPlace::*radius);

/// A lesion along its branch [mm].
struct LesionExtent {
    int branch = 0;
    double from = 0, to = 0;
    std::optional<std::pair<double, double>> plan = {};  // ends of a stent
};
/// Empty without a sample of a stent.
std::optional<StentedLesion> stents_against(const anatomy::Anatomy&, const LesionExtent&,
                                            std::span<const PlacedStent* const>, const Ballooned& = {});

/// Adds where the balloon is now, for each lesion of which it reaches a part.
void note_balloon(const Simulation&, std::vector<Ballooned>&);
/// As it is now. `ballooned`: of each lesion, or empty.
TreatmentScore treatment_score(const Simulation&, std::span<const Ballooned> ballooned = {});

/// Whether a complication is the flap of a wall that a balloon has torn.
bool is_torn(const Complication&, const Treatment&);

/// A point along a branch from its origin: where it is nearest; minus the distance to the origin for one
/// before it, and past the branch's end by the distance to that [mm].
double signed_arc(const anatomy::Anatomy&, int branch, const geometry::Vec3&);
/// Part of [from, to] that intervals cover, from 0 to 1. In any order, and with overlaps.
double part_covered(double from, double to, std::vector<std::pair<double, double>> intervals);

/// Narrowest place of the first lesion now, without devices [mm]; empty without a lesion.
std::optional<double> narrowest_lumen(const Simulation&);
/// Mean contrast in the first lesion [mg/ml]; empty without a lesion.
std::optional<double> iodine_in_lesion(const Simulation&);
/// Mean pressure that the first lesion takes now, with devices and balloons [mmHg]; empty without a lesion.
std::optional<double> pressure_drop(const Simulation&);

}  // namespace exercise
