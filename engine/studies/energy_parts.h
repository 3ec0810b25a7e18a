#pragma once
/// What Eqs. 6 to 8 and 16 of the paper say of the energies of bending and of the wall, each by itself.

#include <span>

#include "engine/io/plot.h"
#include "engine/studies/resolution.h"
#include "engine/studies/study.h"

namespace studies {

struct EnergyParts {
    double eq_6 = 0;        // largest |Eq. 6 over Eq. 5 − 1|, of the coarsest and the finest rest
    double eq_8 = 0;        // its constant ⟨θ⁴⟩/(24⟨θ²⟩) at η = 1
    double same_shape = 0;  // that constant measured, of one curve divided ever more finely
    double uneven = 0;  // ⟨|Δθ|²⟩/(6⟨θ²⟩): what angles between chords miss where curvature changes
    double linear = 0;        // rms of ΔU_wall about Υ(1 − 1/η), over its value at the finest
    double upsilon = 0;       // Υ/U, fitted
    double slope = 0;         // Υ/U by Eq. 16', from η up to 1.2
    double bending_gain = 0;  // ΔU_bend/U at the finest, median over the offsets
    double wall_gain = 0;     // ΔU_wall/U there
    double wall_share = 0;    // of U at η = 1, median
    Fit fit;                  // of the first curve
};

/// Of one tube; `curves` are its offsets, one or more.
EnergyParts energy_parts(std::span<const ResolutionCurve> curves, const Resolution&);

/// Adds the claims of Eqs. 6 to 8 and 16, from the artery in pieces and the smooth one.
void claim_parts(StudyResult&, const EnergyParts& in_pieces, const EnergyParts& smooth);

/// Both energies against η; draws resolution_parts.csv.
io::Plot energy_parts_plot(const EnergyParts& in_pieces, const EnergyParts& smooth);

double turn_between(const geometry::Vec3& u, const geometry::Vec3& v);  // [rad]

}  // namespace studies
