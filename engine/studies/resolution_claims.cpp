#include "engine/studies/resolution_claims.h"

#include <cmath>
#include <fmt/format.h>
#include <span>

#include "engine/studies/claims.h"

namespace studies {
namespace {

bool near(double a, double b, double factor) {
    return a > b / factor && a < b * factor;
}

std::string range(const Quantiles& q, const char* format) {
    return fmt::format("{} to {}", fmt::format(fmt::runtime(format), q.low),
                       fmt::format(fmt::runtime(format), q.high));
}

/// Of those with the bends of the scene, the accepted one whose k is next to the scene's; null where none is.
const Candidate* chosen(const std::vector<Candidate>& candidates) {
    const Candidate* best = nullptr;
    for (const Candidate& candidate : candidates)
        if (candidate.bends == 1 && candidate.accepted() &&
            (!best || std::abs(std::log(candidate.stiffness)) < std::abs(std::log(best->stiffness))))
            best = &candidate;
    return best;
}

/// What the jumps are in the other tubes that the calibration would accept.
std::string jumps_elsewhere(const std::vector<Candidate>& candidates) {
    std::string text;
    for (const Candidate& candidate : candidates) {
        if (&candidate == chosen(candidates) || !candidate.accepted()) continue;
        text += fmt::format("; bends × {:g} and k × {:g}, also within 15 %: mean {:.3g}, largest {:.3g}",
                            candidate.bends, candidate.stiffness,
                            quantiles(candidate.curves, &ResolutionCurve::mean_change).median,
                            quantiles(candidate.curves, &ResolutionCurve::largest_change).median);
    }
    return text;
}

}  // namespace

bool Candidate::accepted() const {
    std::vector<double> c1;
    for (const ResolutionCurve& curve : curves) c1.push_back(curve.fit.c1);
    const double at_three = quantiles(curves, &ResolutionCurve::at_three).median;
    return std::abs(quantiles(c1).median / published_fit.c1 - 1) < 0.15 &&
           std::abs(at_three / published_fit.at(3) - 1) < 0.15;
}

void claim_fig_13(StudyResult& result, const std::vector<TubeFamily>& all,
                  const std::vector<Candidate>& candidates) {
    const std::span<const ResolutionCurve> curves(all[main_family].curves);
    const auto figure = [&](double ResolutionCurve::*what) { return quantiles(curves, what); };
    std::vector<double> c1, c2, dispersion, ratio;
    for (const ResolutionCurve& curve : curves) {
        c1.push_back(curve.fit.c1);
        c2.push_back(curve.fit.c2);
        dispersion.push_back(curve.upper_scatter / curve.lower_scatter);
        ratio.push_back(curve.spread / curve.separation);
    }
    FigureClaims fig(
        result, "Fig. 13",
        fmt::format(
            "Where the artery's {} pieces begin along the tube is not published, so that every figure is the "
            "median of {} offsets; notes give its values at a tenth and nine tenths of them. Tube and k are "
            "not published: scene coronary was found by a search of 150 tubes for c1 and the separation of "
            "the wires, and k by c1 and ΔU/U at η = 3 (table resolution_calibration). These are "
            "*calibrated*. The length of the pieces is the paper's: Ω = 162 of them along the wire.",
            std::lround(175 / published_piece), curves.size()));
    const Quantiles of_c1 = quantiles(c1), of_c2 = quantiles(c2),
                    at_three = figure(&ResolutionCurve::at_three);
    const Candidate* const calibrated = chosen(candidates);
    fig.add(ClaimKind::Calibrated,
            "factor on k next to 1, in the tube of the search, with c1 and ΔU/U at η = 3 both within 15 %",
            "not published", calibrated ? calibrated->stiffness : 0,
            calibrated && calibrated->stiffness == calibrated_stiffness,
            fmt::format("that of the scene which all figures here are of: {:g}", calibrated_stiffness),
            "Tubes whose bends are a little wider are accepted too, see the table and the note at the "
            "largest change.");
    fig.add(ClaimKind::Calibrated, "c1, of the wall", published_fit.c1, of_c1.median,
            std::abs(of_c1.median / published_fit.c1 - 1) < 0.15, "within 15 %", range(of_c1, "{:.3f}"));
    fig.add(ClaimKind::Calibrated, "ΔU/U at η = 3", published_fit.at(3), at_three.median,
            std::abs(at_three.median / published_fit.at(3) - 1) < 0.15, "within 15 %",
            range(at_three, "{:.4f}"));
    const Quantiles largest = figure(&ResolutionCurve::largest);
    fig.add(ClaimKind::Calibrated, "largest |ΔU/U| up to η = 3", "< 0.025", largest.median,
            largest.median < 0.025, "below 0.025", range(largest, "{:.4f}"));
    fig.add(ClaimKind::Calibrated, "the wall's constant is the larger: c1/c2",
            published_fit.c1 / published_fit.c2, of_c1.median / of_c2.median,
            std::abs(of_c1.median) > std::abs(of_c2.median), "above 1");
    fig.published(
        "c2, of bending", published_fit.c2, of_c2.median, near(of_c2.median, published_fit.c2, 1.5),
        "within a factor of 1.5",
        fmt::format(
            "c1 and c2 belong to nearly the same curve, so that scatter moves one into the other: c2 is {} "
            "over the offsets while ΔU/U at η = 3 is {}; in the smooth tube c1 = {:.4f}, c2 = {:.4f}.",
            range(of_c2, "{:.4f}"), range(at_three, "{:.4f}"), all[smooth].curves[0].fit.c1,
            all[smooth].curves[0].fit.c2));
    const Quantiles change = figure(&ResolutionCurve::mean_change),
                    jump = figure(&ResolutionCurve::largest_change);
    const double half = quantiles(all[half_pieces].curves, &ResolutionCurve::mean_change).median;
    fig.published("mean change of ΔU/U between consecutive N'", 92e-5, change.median,
                  near(change.median, 92e-5, 1.5), "within a factor of 1.5",
                  fmt::format("{}; with pieces of 0.5 mm {:.2g}, in the smooth tube {:.2g}: the scatter is "
                              "that of joints that pass the corners between pieces.",
                              range(change, "{:.2g}"), half, all[smooth].curves[0].mean_change));
    fig.published("largest change of ΔU/U between consecutive N'", 387e-5, jump.median,
                  near(jump.median, 387e-5, 1.5), "within a factor of 1.5",
                  range(jump, "{:.2g}") + jumps_elsewhere(candidates));
    const double disperse = quantiles(dispersion).median;
    fig.published(
        "the data are less disperse as η increases: rms about the fit in the upper half of N' over that in "
        "the lower",
        "< 1", disperse, disperse < 1, "below 1", range(quantiles(dispersion), "{:.2f}"));
    const Quantiles separation = figure(&ResolutionCurve::separation),
                    spread = figure(&ResolutionCurve::spread);
    fig.add(ClaimKind::Calibrated, "mean separation of the wires at η = 1 and 3 [mm]", 0.027,
            separation.median, near(separation.median, 0.027, 1.5), "within a factor of 1.5",
            range(separation, "{:.3f}"));
    fig.add(ClaimKind::Calibrated, "its standard deviation [mm]", 0.041, spread.median,
            near(spread.median, 0.041, 1.5), "within a factor of 1.5", range(spread, "{:.3f}"));
    const double over = quantiles(ratio).median;
    fig.add(ClaimKind::Calibrated, "the standard deviation is larger than the mean: ratio", 0.041 / 0.027,
            over, over > 1, "above 1", range(quantiles(ratio), "{:.2f}"));
    const Quantiles bent = figure(&ResolutionCurve::bent_over_straight);
    fig.published(
        "the separation is larger where the wire is bent: more bent half over the other", "> 1", bent.median,
        bent.median > 1, "above 1",
        fmt::format(
            "{}: it goes either way. Between contacts a straight run moves with the bends at its ends, so "
            "that the separation follows the distance to contacts more than the bend at a joint.",
            range(bent, "{:.2f}")));
    const Quantiles found = figure(&ResolutionCurve::found_again);
    fig.published(
        "accuracy of ΔU/U, of equilibrium found again after a disturbance: share of the rests within 3e-5",
        1.0, found.median, found.median > 0.9, "more than 90 % of the rests",
        fmt::format("{}; a tangent's turn of up to 0.02 sends the others to a neighbouring rest.",
                    range(found, "{:.2f}")));
}

}  // namespace studies
