#include "engine/exercise/worst_treatment.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace exercise {

WorstTreatment worst_of(const TreatmentScore& score) {
    using Value = std::optional<double>;
    const auto least = [](Value& worst, const Value& value) {
        if (value) worst = std::min(worst.value_or(*value), *value);
    };
    const auto most = [](Value& worst, const Value& value) {
        if (value) worst = std::max(worst.value_or(*value), *value);
    };
    const auto farthest = [](Value& worst, const Value& value) {
        if (value && (!worst || std::abs(*value) > std::abs(*worst))) worst = value;
    };
    WorstTreatment made;
    for (const LesionScore& lesion : score.lesions) {
        most(made.residual, lesion.after.residual);
        least(made.lumen, lesion.after.lumen);
        most(made.gradient, lesion.after.gradient());
        if (!score.stents.empty()) least(made.covered, lesion.stented ? lesion.stented->covered : 0.0);
        if (!lesion.stented) continue;
        most(made.missed_proximal, lesion.stented->missed_proximal);
        most(made.missed_distal, lesion.stented->missed_distal);
        farthest(made.proximal_off, lesion.stented->proximal_off);
        farthest(made.distal_off, lesion.stented->distal_off);
    }
    if (score.tally.largest_ratio > 0) made.balloon_to_artery = score.tally.largest_ratio;
    made.inflations = score.tally.inflations;
    made.bursts = score.bursts;
    made.dissections = score.dissections;
    made.dissections_left = score.dissections_left;
    made.ruptures = score.ruptures;
    return made;
}

std::array<std::pair<std::string_view, double>, 14> columns_of(const std::optional<WorstTreatment>& row) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    const WorstTreatment t = row.value_or(WorstTreatment());
    const auto count = [&row](int value) { return row ? static_cast<double>(value) : none; };
    return {{{"residual_percent", t.residual.value_or(none)},
             {"lumen_mm", t.lumen.value_or(none)},
             {"gradient_mmHg", t.gradient.value_or(none)},
             {"stent_covered_percent", t.covered.value_or(none)},
             {"missed_proximal_mm", t.missed_proximal.value_or(none)},
             {"missed_distal_mm", t.missed_distal.value_or(none)},
             {"proximal_off_plan_mm", t.proximal_off.value_or(none)},
             {"distal_off_plan_mm", t.distal_off.value_or(none)},
             {"balloon_to_artery", t.balloon_to_artery.value_or(none)},
             {"inflations", count(t.inflations)},
             {"bursts", count(t.bursts)},
             {"balloon_dissections", count(t.dissections)},
             {"balloon_dissections_left", count(t.dissections_left)},
             {"ruptures", count(t.ruptures)}}};
}

}  // namespace exercise
