#pragma once
/// One row of figures for an attempt at any number of lesions, for tables.

#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include "engine/exercise/treatment_score.h"

namespace exercise {

/// What balloons and stents made of an attempt's lesions; of several the worst, of the plan's ends the
/// farthest. Raw, as in score.json; empty is what has no meaning, as ends without a stent.
struct WorstTreatment {
    std::optional<double> residual;                        // [percent]
    std::optional<double> lumen, gradient;                 // [mm], [mmHg]
    std::optional<double> covered;                         // by stents [percent]
    std::optional<double> missed_proximal, missed_distal;  // [mm]
    std::optional<double> proximal_off, distal_off;        // stents from the plan; + = too far distal [mm]
    std::optional<double> balloon_to_artery;               // [-]
    int inflations = 0, bursts = 0;
    int dissections = 0, dissections_left = 0, ruptures = 0;  // by a balloon
};
WorstTreatment worst_of(const TreatmentScore&);

/// The columns of a table and what stands in them; NaN for what is not there.
std::array<std::pair<std::string_view, double>, 14> columns_of(const std::optional<WorstTreatment>&);

}  // namespace exercise
