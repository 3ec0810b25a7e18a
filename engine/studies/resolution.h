#pragma once
/// How a wire's energy at rest depends on the number of its segments (the paper's Fig. 13), in any tube.

#include <span>
#include <string>
#include <vector>

#include "engine/studies/paper_scene.h"
#include "engine/studies/study.h"

namespace studies {

/// The wire of Fig. 13: 175 mm in 175 to 525 segments.
struct Resolution {
    int coarse = 175, finest = 525, step = 1;
};

/// Length of an artery's straight pieces that the paper implies: Ω = 162 of them over 175 mm of wire.
inline constexpr double published_piece = 175.0 / 162;  // [mm]

/// k of scene coronary times this: next to 1 of the factors that study resolution tries, and for which c₁ and
/// ΔU/U at η = 3 are both within 15 % of the published.
inline constexpr double calibrated_stiffness = 0.9;

/// The tube of Fig. 13, as far as it can be known, with a wire of segments of 1 mm on its centreline.
PaperScene fig_13_scene(int segments = 175);

/// A tube of Fig. 13; the artery smooth, or in straight pieces that begin at one of several places.
struct ResolutionTube {
    std::string scene = "coronary";
    double bends = 1;      // radii of the bends times this
    double piece = 0;      // [mm]; 0 = smooth
    double stiffness = 1;  // k times this
    int offset = 0, offsets = 1;

    SceneChange change(const Resolution&, int segments) const;
};

/// A wire of η = N'/N at rest.
struct Resolved {
    double eta = 1;
    double bending = 0, wall = 0;  // [N·mm]
    double again = 0;              // energy of the rest found after a disturbance; nan = not tried [N·mm]
    double gradient = 0;           // |g|/C
    double energy() const { return bending + wall; }
};

/// Eq. 40 fitted, ΔU/U = c₁(1 − 1/η) + c₂(1 − 1/η²), with the rms about it.
struct Fit {
    double c1 = 0, c2 = 0, rms = 0;
    double at(double eta) const { return c1 * (1 - 1 / eta) + c2 * (1 - 1 / (eta * eta)); }
};
inline constexpr Fit published_fit{0.0263, 0.00554, 0};

/// One tube's curve and its figures.
struct ResolutionCurve {
    std::vector<Resolved> points;
    physics::Chain coarse, fine;
    Fit fit;
    double at_three = 0;                          // ΔU/U at the finest
    double largest = 0;                           // |ΔU/U| over all
    double mean_change = 0, largest_change = 0;   // of ΔU/U from one N' to the next
    double lower_scatter = 0, upper_scatter = 0;  // rms about the fit in the halves of N'
    double wall_fraction = 0;                     // of the energy at η = 1
    double separation = 0, spread = 0;            // mean and standard deviation, coarse from finest wire [mm]
    double bent_over_straight = 0;                // mean separation of the more bent half over the other
    double found_again =
        0;  // fraction of rests found again within the published accuracy, 3e-5; nan = not tried
};

/// All wires rest as one wire does: the finest comes to rest from the centreline, and the others from its
/// shape, so that none leaves its basin for another. `disturb` also finds every rest again after its tangents
/// were turned by up to 0.02.
ResolutionCurve resolution_curve(const ResolutionTube&, const Resolution&, bool disturb = false);

/// Median, and the values at a tenth and at nine tenths, of a figure over several curves.
struct Quantiles {
    double low = 0, median = 0, high = 0;
};
Quantiles quantiles(const std::vector<double>&);
Quantiles quantiles(std::span<const ResolutionCurve>, double ResolutionCurve::*);
Quantiles quantiles(std::span<const ResolutionCurve>, double Fit::*);

/// What Eqs. 6 to 8 and 16 of the paper say of the energies of bending and of the wall, each by itself.
struct EnergyParts {
    double eq_6 = 0;        // largest |Eq. 6 over Eq. 5 − 1|, of the coarsest and the finest rest
    double eq_8 = 0;        // its constant ⟨θ⁴⟩/(24⟨θ²⟩) at η = 1
    double same_shape = 0;  // that constant measured, of one curve divided ever more finely
    double uneven = 0;  // ⟨|Δθ|²⟩/(6⟨θ²⟩): what angles between chords miss where curvature changes
    double linear = 0;         // rms of ΔU_wall about Υ(1 − 1/η), over its value at the finest
    double upsilon = 0;        // Υ/U, fitted
    double slope = 0;          // Υ/U by Eq. 16', from η up to 1.2
    double bending_gain = 0;   // ΔU_bend/U at the finest, median over the offsets
    double wall_gain = 0;      // ΔU_wall/U there
    double wall_fraction = 0;  // of U at η = 1, median
    Fit fit;                   // of the first curve
};

/// Of one tube; `curves` are its offsets, one or more.
EnergyParts energy_parts(std::span<const ResolutionCurve> curves, const Resolution&);

/// Adds the claims of Eqs. 6 to 8 and 16, from the artery in pieces and the smooth one.
void claim_parts(StudyResult&, const EnergyParts& in_pieces, const EnergyParts& smooth);

/// Both energies against η; draws resolution_parts.csv.
io::Plot energy_parts_plot(const EnergyParts& in_pieces, const EnergyParts& smooth);

double turn_between(const geometry::Vec3& u, const geometry::Vec3& v);  // [rad]

}  // namespace studies
