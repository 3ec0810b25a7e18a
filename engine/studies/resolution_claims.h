#pragma once
/// What the resolution study says of the paper's Fig. 13.

#include "engine/studies/resolution.h"
#include "engine/studies/study.h"

namespace studies {

/// A tube whose curves are taken at several offsets of its pieces.
struct TubeFamily {
    std::string name;
    ResolutionTube tube;
    std::vector<ResolutionCurve> curves = {};
};

/// The first of the families: the calibrated scene with the artery in pieces as published, with pieces of 0.5
/// mm, and smooth.
enum Places { main_family = 0, half_pieces = 1, smooth = 2 };

/// Factors on the radii of the bends of scene coronary and on its k, which are both calibrated.
struct Candidate {
    double bends, stiffness;
    std::vector<ResolutionCurve> curves = {};

    /// Whether c1 and ΔU/U at η = 3 are both within 15 % of the published ones.
    bool accepted() const;
};

/// Adds the claims of Fig. 13. They name the jumps in the other tubes that the calibration would accept.
void claim_fig_13(StudyResult&, const std::vector<TubeFamily>&, const std::vector<Candidate>&);

}  // namespace studies
