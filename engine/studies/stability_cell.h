#pragma once
/// Ways of breaking a relaxation, wires and vessels that are difficult for every method, and one method on
/// one of them: its outcome, by fixed rules on numbers.

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/studies/study.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace studies {

/// One thing done to the wire; it is relaxed afterwards.
struct Disturbance {
    int inserted = 0;  // segments, all at once
    double turn = 0;   // of the hub [rad]
};

/// Symmetry of vessel and start: shapes that it maps onto each other count as one.
enum class Symmetry {
    None,
    MirrorZ,     // in the plane z = 0
    RoundAboutX  // a turn about the x axis, or a mirror
};

struct BreakingCase {
    std::string id, what;  // a word for files; a few words for people
    std::string how;       // a sentence: vessel, wire, what is done
    std::shared_ptr<const physics::LumenWall> wall;
    physics::Chain start;
    std::vector<Disturbance> disturbances;  // in order; empty: the start is relaxed as it is
    int cycles = 100;  // total work, in relaxation cycles of the wire as it is at the end
    Symmetry symmetry = Symmetry::None;
    /// The reference starts with a bow of 1e-4 rad, because an exactly balanced start stays where it is.
    bool bowed_reference = false;
};

/// In the order of the map. Quick ones are shorter and get less work. Throws InputError without the anatomy.
std::vector<BreakingCase> breaking_cases(const StudyOptions&);

enum class Outcome { Converged, StillMoving, Oscillates, WrongBasin, LeftTheLumen, NotANumber, Stuck };
std::string_view outcome_text(Outcome);
inline constexpr int outcomes = 7;

/// The numbers in the rules; the page of the study states them.
struct StabilityRules {
    double gradient = 1e-4;      // |g|/C of a wire at rest [-]
    double basin = 0.05;         // joints this near are in one basin, or at the same place [mm]
    double rise = 1e-6;          // of the energy in a sample of the last quarter: it oscillates
    double stuck = 1e-4;         // joints that move less in the last quarter count as not moving [mm]
    double outside = 0.5;        // of the lumen's radius beyond the wall: it has left the lumen …
    double times_reference = 2;  // … and this many times deeper than the reference is pressed in
    int samples = 40;            // of the energy, over the work after the last disturbance
};

/// The measurements that decide a cell. Arrays cover the samples of the work after the last disturbance.
struct CellMeasure {
    bool finite = true;
    std::vector<double> energies;      // [N·mm]
    double gradient = 0;               // |g|/C at the end [-]
    double deviation = 0;              // of the farthest joint from the reference [mm]
    double basin_deviation = 0;        // the same after the slow flow from here has come to rest [mm]
    double moved = 0;                  // by the farthest joint in the last quarter of the samples [mm]
    double penetration = 0;            // the largest [mm]
    double clearance = 0;              // radius of the lumen at that joint [mm]
    double reference_penetration = 0;  // [mm]
};
Outcome judge(const CellMeasure&, const StabilityRules& = {});

struct StabilityCell {
    Outcome outcome = Outcome::StillMoving;
    CellMeasure measure;
    double energy = 0;  // at the end [N·mm]
    double cpu = 0;     // of relaxing [s]
    long long updates = 0;
};

/// Where the slow flow takes the case, with all its disturbances one after the other.
struct StabilityReference {
    std::vector<geometry::Vec3> joints;  // [mm]
    double energy = 0;                   // [N·mm]
    double gradient = 0;                 // |g|/C [-]
    double penetration = 0;              // the largest [mm]
};
StabilityReference find_reference(const BreakingCase&);

StabilityCell run_cell(const BreakingCase&, const StabilityReference&, const physics::RelaxerConfig&,
                       const StabilityRules& = {});

/// Distance of the farthest pair of joints [mm], the least that the symmetry allows.
double largest_deviation(std::span<const geometry::Vec3>, std::span<const geometry::Vec3>, Symmetry);

}  // namespace studies
