#include "engine/studies/resolution.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <memory>
#include <span>
#include <tuple>

#include "engine/studies/claims.h"
#include "engine/studies/lateral_deviation.h"
#include "engine/studies/runs.h"
#include "engine/studies/study.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/geometry/polyline.h"

namespace studies {
namespace {

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

bool Candidate::accepted() const {
    const double at_three = quantiles(curves, &ResolutionCurve::at_three).median;
    return std::abs(quantiles(curves, &Fit::c1).median / published_fit.c1 - 1) < 0.15 &&
           std::abs(at_three / published_fit.at(3) - 1) < 0.15;
}

/// Adds the claims of Fig. 13. They name the jumps in the other tubes that the calibration would accept.
void claim_fig_13(StudyResult& result, const std::vector<TubeFamily>& all,
                  const std::vector<Candidate>& candidates) {
    const std::span<const ResolutionCurve> curves(all[main_family].curves);
    const auto figure = [&](double ResolutionCurve::*what) { return quantiles(curves, what); };
    std::vector<double> dispersion, ratio;
    for (const ResolutionCurve& curve : curves) {
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
    const Quantiles of_c1 = quantiles(curves, &Fit::c1), of_c2 = quantiles(curves, &Fit::c2),
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

struct ResolutionSizes {
    Resolution resolution;
    int offsets = 25, few_offsets = 7;
};
ResolutionSizes resolution_sizes(bool quick) {
    if (!quick) return {};
    return {{60, 180, 12}, 3, 1};
}

std::string family_name(const std::string& tube, double piece) {
    return piece > 0 ? fmt::format("{}, pieces of {:.3g} mm", tube, piece) : tube + ", smooth";
}

std::vector<TubeFamily> families(const ResolutionSizes& size) {
    std::vector<TubeFamily> list;
    for (const auto& [name, scene, stiffness] :
         {std::tuple{"calibrated", "coronary", calibrated_stiffness}, std::tuple{"coronary", "coronary", 1.0},
          std::tuple{"coronary-tight", "coronary-tight", 1.0}, std::tuple{"sharp", "sharp", 1.0},
          std::tuple{"sinuous", "sinuous", 1.0}})
        for (const double piece : {published_piece, 0.5, 0.0}) {
            const int offsets = piece == 0 ? 1 : list.size() < 2 ? size.offsets : size.few_offsets;
            list.push_back({family_name(name, piece), {scene, 1, piece, stiffness, 0, offsets}});
        }
    return list;
}
io::Plot energy_plot(const std::vector<TubeFamily>& all, const Resolution& resolution) {
    const std::vector<ResolutionCurve>& main = all[main_family].curves;
    return filled_plot("resolution", 1000, 560,
                       {{"coarse", resolution.coarse},
                        {"finest", resolution.finest},
                        {"c1", quantiles(main, &Fit::c1).median},
                        {"c2", quantiles(main, &Fit::c2).median},
                        {"published_c1", published_fit.c1},
                        {"published_c2", published_fit.c2},
                        {"piece", published_piece},
                        {"stiffness", 42 * calibrated_stiffness}});
}

/// The joint of the largest separation, but at the free end, which moves as a whole.
int farthest_bent(const ResolutionCurve& curve) {
    const ReferenceCurve reference(curve.fine.joints);
    int farthest = 1;
    double largest = 0;
    for (int i = 1; i + 10 < curve.coarse.segments(); ++i)
        if (const double d = std::abs(reference.deviation(curve.coarse.joints[i])); d > largest)
            largest = d, farthest = i;
    return farthest;
}

/// The wall's outline, both wires, and a window around their largest separation.
io::Plot wire_plot(const ResolutionCurve& curve) {
    const int farthest = farthest_bent(curve);
    const geometry::Vec3 at = curve.coarse.joints[static_cast<std::size_t>(farthest)];
    constexpr double half = 2.4;
    return filled_plot("resolution_wire", 1100, 620,
                       {{"left", at.x() - half},
                        {"right", at.x() + half},
                        {"low", at.y() - half},
                        {"high", at.y() + half},
                        {"joint", farthest},
                        {"apart", std::abs(ReferenceCurve(curve.fine.joints).deviation(at))},
                        {"coarse", curve.coarse.segments()},
                        {"fine", curve.fine.segments()}});
}

io::Table wire_table(const ResolutionCurve& curve, const PaperScene& scene) {
    io::Table table{"resolution_wire", {"curve", "x_mm", "y_mm"}};
    const geometry::Polyline& path = scene.path;
    const double shown = curve.coarse.segments() * curve.coarse.lengths.back() + 25;
    for (const double side : {1.0, -1.0}) {
        double walked = 0;
        for (std::size_t i = 0; i + 1 < path.size() && walked < shown; ++i) {
            const geometry::Vec3 step = path[i + 1] - path[i], u = step.normalized();
            walked += step.norm();
            if (i % 3 != 0) continue;
            const geometry::Vec3 x = path[i] + side * scene.wall->radius() * geometry::Vec3(-u.y(), u.x(), 0);
            table.add({side > 0 ? "left wall" : "right wall", x.x(), x.y()});
        }
    }
    for (const auto& x : curve.coarse.joints) table.add({"coarse", x.x(), x.y()});
    for (const auto& x : curve.fine.joints) table.add({"fine", x.x(), x.y()});
    return table;
}

io::Table separation_table(const ResolutionCurve& curve) {
    io::Table table{"resolution_separation", {"joint", "separation_mm", "bend_rad"}};
    const ReferenceCurve reference(curve.fine.joints);
    const physics::Chain& wire = curve.coarse;
    for (int i = 1; i < wire.segments(); ++i)
        table.add({i, std::abs(reference.deviation(wire.joints[static_cast<std::size_t>(i)])),
                   turn_between(wire.tangents[i], wire.tangents[i + 1])});
    return table;
}

/// The same N' of all curves: ΔU/U in per cent.
std::vector<double> at_point(const std::vector<ResolutionCurve>& curves, std::size_t k,
                             double (*part)(const Resolved&)) {
    std::vector<double> values;
    for (const ResolutionCurve& curve : curves)
        values.push_back(100 * (part(curve.points[k]) - part(curve.points.front())) /
                         curve.points.front().energy());
    return values;
}

}  // namespace

StudyResult run_resolution(const StudyOptions& options) {
    const ResolutionSizes size = resolution_sizes(options.quick);
    std::vector<TubeFamily> all = families(size);
    std::vector<Candidate> candidates;
    for (const double bends :
         options.quick ? std::vector<double>{1} : std::vector<double>{0.97, 1, 1.03, 1.045})
        for (const double stiffness : {0.9, 1.0, 1.1}) candidates.push_back({bends, stiffness});
    struct Piece {
        ResolutionCurve* into;
        ResolutionTube tube;
        Resolution resolution;
        bool disturb;
        std::string what;
    };
    std::vector<std::unique_ptr<Piece>> pieces;
    for (TubeFamily& family : all) {
        family.curves.resize(static_cast<std::size_t>(family.tube.offsets));
        for (int k = 0; k < family.tube.offsets; ++k) {
            ResolutionTube tube = family.tube;
            tube.offset = k;
            pieces.push_back(
                std::make_unique<Piece>(Piece{&family.curves[static_cast<std::size_t>(k)], tube,
                                              size.resolution, &family == &all[main_family], family.name}));
        }
    }
    for (Candidate& candidate : candidates) {
        candidate.curves.resize(static_cast<std::size_t>(size.offsets));
        for (int k = 0; k < size.offsets; ++k)
            pieces.push_back(
                std::make_unique<Piece>(Piece{&candidate.curves[static_cast<std::size_t>(k)],
                                              ResolutionTube{"coronary", candidate.bends, published_piece,
                                                             candidate.stiffness, k, size.offsets},
                                              size.resolution, false,
                                              fmt::format("calibration, bends × {:.3f}, k × {:.1f}",
                                                          candidate.bends, candidate.stiffness)}));
    }
    Work work(options, static_cast<int>(pieces.size()));
    work.run(static_cast<int>(pieces.size()), [&](int k) {
        const Piece& piece = *pieces[static_cast<std::size_t>(k)];
        *piece.into = resolution_curve(piece.tube, piece.resolution, piece.disturb);
        return piece.what;
    });
    const EnergyParts parts = energy_parts(all[main_family].curves, size.resolution),
                      smooth_parts = energy_parts(all[smooth].curves, size.resolution);

    StudyResult result;
    io::Table table{"resolution",
                    {"segments", "eta", "energy_N_mm", "one_offset_percent", "low_percent", "median_percent",
                     "high_percent", "smooth_percent"}};
    io::Table parts_table{
        "resolution_parts",
        {"eta", "smooth_bending_percent", "smooth_wall_percent", "bending_percent", "wall_percent"}};
    const auto energy = [](const Resolved& p) { return p.energy(); };
    const auto bending = [](const Resolved& p) { return p.bending; };
    const auto wall = [](const Resolved& p) { return p.wall; };
    const std::vector<ResolutionCurve>&main_curves = all[main_family].curves,
          &smooth_curve = all[smooth].curves;
    const ResolutionCurve& one = main_curves[main_curves.size() / 2];
    for (std::size_t k = 0; k < one.points.size(); ++k) {
        const Resolved& p = one.points[k];
        const Quantiles q = quantiles(at_point(main_curves, k, energy));
        table.add({size.resolution.coarse + size.resolution.step * static_cast<int>(k), p.eta, p.energy(),
                   100 * (p.energy() / one.points.front().energy() - 1), q.low, q.median, q.high,
                   at_point(smooth_curve, k, energy)[0]});
        parts_table.add({p.eta, at_point(smooth_curve, k, bending)[0], at_point(smooth_curve, k, wall)[0],
                         quantiles(at_point(main_curves, k, bending)).median,
                         quantiles(at_point(main_curves, k, wall)).median});
    }
    const std::vector<std::string> figures = {"c1",
                                              "c2",
                                              "at_eta_3",
                                              "mean_change",
                                              "largest_change",
                                              "mean_separation_mm",
                                              "separation_deviation_mm",
                                              "bent_over_straight",
                                              "wall_share",
                                              "largest_gradient"};
    io::Table tubes{"resolution_tubes", {"tube", "offsets"}},
        calibration{"resolution_calibration", {"bends_and_stiffness_times", "offsets"}};
    for (io::Table* each : {&tubes, &calibration})
        each->columns.insert(each->columns.end(), figures.begin(), figures.end());
    const auto row = [&](const std::string& name, const std::vector<ResolutionCurve>& curves) {
        double gradient = 0;
        for (const ResolutionCurve& curve : curves)
            for (const Resolved& point : curve.points) gradient = std::max(gradient, point.gradient);
        std::vector<double> numbers = {static_cast<double>(curves.size()), quantiles(curves, &Fit::c1).median,
                                       quantiles(curves, &Fit::c2).median};
        for (const auto what :
             {&ResolutionCurve::at_three, &ResolutionCurve::mean_change, &ResolutionCurve::largest_change,
              &ResolutionCurve::separation, &ResolutionCurve::spread, &ResolutionCurve::bent_over_straight,
              &ResolutionCurve::wall_fraction})
            numbers.push_back(quantiles(curves, what).median);
        numbers.push_back(gradient);
        std::vector<io::TableCell> cells(numbers.begin(), numbers.end());
        cells.insert(cells.begin(), name);
        return cells;
    };
    for (const TubeFamily& family : all) tubes.add(row(family.name, family.curves));
    for (const Candidate& candidate : candidates)
        calibration.add(
            row(fmt::format("{:.3f}, {:.1f}", candidate.bends, candidate.stiffness), candidate.curves));

    claim_fig_13(result, all, candidates);
    claim_parts(result, parts, smooth_parts);
    const PaperScene scene =
        paper_scene("coronary", all[smooth].tube.change(size.resolution, size.resolution.coarse));
    result.plots = {energy_plot(all, size.resolution), wire_plot(smooth_curve[0]),
                    energy_parts_plot(parts, smooth_parts)};
    result.page = filled_page("resolution",
                              {{"coarse", size.resolution.coarse},
                               {"stiffness", calibrated_stiffness},
                               {"finest", size.resolution.finest},
                               {"calibration", io::to_markdown(calibration, 3)},
                               {"tubes", io::to_markdown(tubes, 3)}},
                              result, options);
    result.tables = {std::move(table),
                     std::move(parts_table),
                     wire_table(smooth_curve[0], scene),
                     separation_table(smooth_curve[0]),
                     std::move(tubes),
                     std::move(calibration)};
    return result;
}

}  // namespace studies
