#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "engine/studies/claims.h"
#include "engine/studies/lateral_deviation.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/quantile.h"
#include "engine/studies/resolution.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"

namespace studies {
namespace {

using Rows = std::vector<std::vector<double>>;

constexpr int examples = 5;
constexpr double density_reach = 0.1;  // of the picture of deviations [mm]
constexpr const char* wall_variation_colours[] = {"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00"};

struct WallVariationSizes {
    int segments = 175, realisations = 5000;
    int pieces_of_artery = 162;  // Ω, spanned by the wire
    std::array<int, 3> joints = {30, 100, 175};
};
WallVariationSizes wall_variation_sizes(const StudyOptions& options) {
    if (!options.quick) return {};
    return {60, 40, 56, {10, 34, 60}};
}

/// The wire in one of two tubes: that of Fig. 13, which the paper varies the wall of, and a gently bent one.
struct WallSetting {
    WallVariationSizes size;
    std::string name;
    PaperScene scene;
    Rest rest;  // under a uniform wall

    double length() const { return size.segments * scene.start.grid.segment_length; }  // [mm]
};
constexpr int tube_count = 2;
enum Tubes { like_fig_13, gentle };

std::vector<WallSetting> settings(const StudyOptions& options) {
    const WallVariationSizes size = wall_variation_sizes(options);
    std::vector<WallSetting> list;
    list.push_back({size, "tube of Fig. 13", fig_13_scene(size.segments), {}});
    list.push_back({size, "sinuous", paper_scene("sinuous", {.segments = size.segments}), {}});
    for (WallSetting& s : list) s.rest = global_rest(*s.scene.wall, s.scene.start);
    return list;
}

physics::WallStiffness profile(const WallSetting& s, std::uint64_t seed, int realisation) {
    return physics::drawn_variation(seed, physics::published_terms, realisation)
        .of(s.scene.stiffness, s.length());
}

/// K(ω)/k, ω = 1 … Ω.
std::vector<double> profile_samples(const WallSetting& s, std::uint64_t seed, int realisation) {
    const physics::WallStiffness stiffness = profile(s, seed, realisation);
    std::vector<double> samples;
    for (int w = 1; w <= s.size.pieces_of_artery; ++w)
        samples.push_back(stiffness.at(s.length() * w / s.size.pieces_of_artery) / stiffness.mean());
    return samples;
}

int pieces(const StudyOptions& options) {
    return wall_variation_sizes(options).realisations;
}

std::vector<std::string> columns(const StudyOptions& options) {
    std::vector<std::string> names = {"realisation"};
    for (const char* tube : {"fig_13", "sinuous"}) {
        names.push_back(fmt::format("{}_gradient", tube));
        for (int i = 1; i <= wall_variation_sizes(options).segments; ++i)
            names.push_back(fmt::format("{}_d_{}_mm", tube, i));
    }
    return names;
}

/// One row per realisation: for each tube the gradient over C at rest, then d_i of joints 1 … N from the wire
/// in a uniform wall.
Rows rows(const StudyOptions& options, int first, int last) {
    const std::vector<WallSetting> both = settings(options);
    std::vector<ReferenceCurve> curves;
    for (const WallSetting& s : both) curves.emplace_back(s.rest.wire.joints);
    Rows all(static_cast<std::size_t>(last - first));
    Work work(options, last - first);
    work.run(last - first, [&](int k) {
        const int realisation = first + k;
        std::vector<double>& row = all[static_cast<std::size_t>(k)];
        row = {static_cast<double>(realisation)};
        for (std::size_t t = 0; t < both.size(); ++t) {
            const WallSetting& s = both[t];
            const physics::TubeWall wall(s.scene.wall->centreline(), s.scene.wall->radius(),
                                         profile(s, options.seed, realisation));
            const Rest rest = global_rest(wall, s.rest.wire);
            row.push_back(rest.gradient);
            for (std::size_t i = 1; i < rest.wire.joints.size(); ++i)
                row.push_back(curves[t].deviation(rest.wire.joints[i]));
        }
        return fmt::format("realisation {}", realisation + 1);
    });
    return all;
}

double gradient(const std::vector<double>& row, int tube) {
    return row[1 + static_cast<std::size_t>(tube) * (row.size() - 1) / tube_count];
}
double deviation(const std::vector<double>& row, int tube, int joint) {
    return row[1 + static_cast<std::size_t>(tube) * (row.size() - 1) / tube_count +
               static_cast<std::size_t>(joint)];
}

struct MeanAndRms {
    double mean = 0, rms = 0;
};

/// Mean and rms for joint i in the first `count` realisations [mm].
MeanAndRms over(const Rows& rows, int tube, int joint, std::size_t count) {
    double sum = 0, squares = 0;
    for (std::size_t r = 0; r < count; ++r) {
        const double d = deviation(rows[r], tube, joint);
        sum += d;
        squares += d * d;
    }
    return {sum / static_cast<double>(count), std::sqrt(squares / static_cast<double>(count))};
}

io::Table running_table(const std::vector<WallSetting>& both, const Rows& rows) {
    io::Table table{"wall_variation_running", {"tube", "joint", "realisations", "mean_mm", "rms_mm"}};
    const std::size_t step = std::max<std::size_t>(1, rows.size() / 500);
    for (int tube = 0; tube < tube_count; ++tube)
        for (const int joint : both[0].size.joints) {
            double sum = 0, squares = 0;
            for (std::size_t r = 0; r < rows.size(); ++r) {
                const double d = deviation(rows[r], tube, joint);
                sum += d;
                squares += d * d;
                const double count = static_cast<double>(r + 1);
                if (r % step == 0 || r + 1 == rows.size())
                    table.add({both[static_cast<std::size_t>(tube)].name, joint, count, sum / count,
                               std::sqrt(squares / count)});
            }
        }
    return table;
}

/// Density of values over [from, to] in so many bins; values outside count for the normalisation only.
io::Table density_table(const std::string& name, const std::string& unit, const std::vector<double>& values,
                        double from, double to, int bins) {
    std::vector<long long> counts(static_cast<std::size_t>(bins));
    for (const double value : values) {
        const double at = (value - from) / (to - from) * bins;
        if (at >= 0 && at < bins) ++counts[static_cast<std::size_t>(at)];
    }
    io::Table table{name, {"middle" + unit, "density"}};
    const double width = (to - from) / bins;
    for (int b = 0; b < bins; ++b)
        table.add({from + (b + 0.5) * width, static_cast<double>(counts[static_cast<std::size_t>(b)]) /
                                                 (static_cast<double>(values.size()) * width)});
    return table;
}

struct Spread {
    double mean = 0, deviation = 0, inside = 0, least = 1e300, largest = -1e300, mean_error = 0;
};

/// Spread of K/k over all realisations; `inside` is the fraction in (0.5, 1.5).
Spread spread_of(const std::vector<double>& values, std::size_t per_realisation) {
    Spread s;
    const double count = static_cast<double>(values.size());
    double squares = 0, means = 0;
    for (std::size_t r = 0; r < values.size(); r += per_realisation) {
        double sum = 0;
        for (std::size_t k = r; k < r + per_realisation; ++k) {
            const double v = values[k];
            sum += v;
            squares += v * v;
            s.inside += v > 0.5 && v < 1.5 ? 1 / count : 0;
            s.least = std::min(s.least, v);
            s.largest = std::max(s.largest, v);
        }
        s.mean += sum / count;
        means += sum * sum / static_cast<double>(per_realisation * per_realisation);
    }
    s.deviation = std::sqrt(std::max(0.0, squares / count - s.mean * s.mean));
    const double realisations = count / static_cast<double>(per_realisation);
    s.mean_error = std::sqrt(std::max(0.0, means / realisations - s.mean * s.mean) / realisations);
    return s;
}

void claim_walls(StudyResult& result, const WallVariationSizes& size, std::size_t realisations,
                 const Spread& k, bool quick) {
    FigureClaims eq(result, "Eq. 41");
    eq.add(ClaimKind::Identity, "K is positive: least K/k", "> 0", k.least, k.least > 0, "above 0",
           "Amplitudes of at most 2^−g k add up to less than k.");
    eq.add(ClaimKind::Identity, "K is bounded: largest K/k", "< 2", k.largest, k.largest < 2, "below 2");
    eq.add(ClaimKind::Identity, "a tenth term would add less than 0.1 % of k [%]", "< 0.1",
           100 * std::ldexp(1.0, -(physics::published_terms + 1)),
           100 * std::ldexp(1.0, -(physics::published_terms + 1)) < 0.1, "below 0.1");
    FigureClaims fig(result, "Fig. 15", fmt::format("{} realisations of the wall.", realisations));
    const double points = static_cast<double>(realisations) * size.pieces_of_artery;
    fig.counted(quick, "points of K, realisations times Ω", 5000.0 * 162,
                static_cast<double>(size.realisations) * size.pieces_of_artery, points, 0, "exactly");
    fig.published("part of the points with 0.5 < K/k < 1.5 [%]", 96.6, 100 * k.inside,
                  std::abs(100 * k.inside - 96.6) <= 0.5, "within half a per cent, about two standard errors",
                  "Too few realisations for that.");
    fig.published("mean of K/k", 1.0012, k.mean,
                  std::abs(k.mean - 1.0012) <= 3 * std::sqrt(2.0) * k.mean_error,
                  fmt::format("within three standard errors of the difference of two such means, {:.4f}",
                              3 * std::sqrt(2.0) * k.mean_error),
                  "Expected is 1.");
    fig.published("standard deviation of K/k", 0.236, k.deviation, std::abs(k.deviation - 0.236) <= 0.005,
                  "within 0.005", "Expected is 0.2357.");
}

/// What the paper says of Figs. 16 to 18, of one tube.
void claim_wire(StudyResult& result, const WallSetting& s, int tube, const Rows& rows,
                const std::vector<MeanAndRms>& of_joint, const std::vector<double>& deviations) {
    double largest_gradient = 0;
    for (const auto& row : rows) largest_gradient = std::max(largest_gradient, gradient(row, tube));
    FigureClaims section(result, "Section 3.5");
    section.published(
        fmt::format("for each realisation the equilibrium is found: largest |gradient| over C, {}", s.name),
        "equilibrium", largest_gradient, largest_gradient <= 1e-7, "at most 1e-7",
        "The relaxer stopped before rest.");
    double drift = 0;
    for (const int joint : s.size.joints) {
        const MeanAndRms half = over(rows, tube, joint, rows.size() / 2),
                         all = over(rows, tube, joint, rows.size());
        drift = std::max({drift, std::abs(half.mean - all.mean) / all.rms, std::abs(half.rms / all.rms - 1)});
    }
    FigureClaims(result, "Fig. 16",
                 tube > 0 ? std::string() : fmt::format("Joints {}.", fmt::join(s.size.joints, ", ")))
        .published(fmt::format("mean and rms reach stable values: largest change over the second half of the "
                               "realisations, of the rms, {}",
                               s.name),
                   "stable", drift, drift < 0.05, "below 0.05", "Too few realisations for that.");
    double inside = 0;
    for (const MeanAndRms& m : of_joint) inside += 2 * m.mean * m.mean < m.rms * m.rms;
    const double joints = static_cast<double>(of_joint.size());
    FigureClaims(
        result, "Fig. 17",
        tube > 0 ? std::string()
                 : "That |mean| is smaller than the rms is so for any numbers; what can fail is that the "
                   "wire in a uniform wall lies within the range of the others, which the paper concludes.")
        .published(fmt::format("the reference lies inside the range of the variable wires: joints with "
                               "|mean| below the standard deviation, {} [%]",
                               s.name),
                   "most", 100 * inside / joints, inside > 0.5 * joints, "more than half",
                   "A wall that is softer in one place and harder in another moves the wire to one side on "
                   "the mean.");
    const auto within =
        std::count_if(deviations.begin(), deviations.end(), [](double d) { return std::abs(d) <= 0.005; });
    const double part = 100 * static_cast<double>(within) / static_cast<double>(deviations.size());
    double largest = 0;
    std::vector<double> sizes_of;
    for (const double d : deviations) {
        largest = std::max(largest, std::abs(d));
        sizes_of.push_back(std::abs(d));
    }
    const std::string why = fmt::format(
        "Half of all |d| are above {:.4f} mm. Study paper-tubes tries further tubes: a wall as soft as the "
        "traces of Section 3.3 imply does not have Fig. 13 and Fig. 18 at once, one ten times as stiff does.",
        quantile(sizes_of, 0.5));
    FigureClaims fig(result, "Fig. 18");
    fig.published(fmt::format("d varies by about ±0.005 mm or less: part of all d within it, {} [%]", s.name),
                  "nearly all", part, part >= 95, "at least 95 %", why);
    fig.published(
        fmt::format("an uneven wall is negligible for a simulator: largest |d| of all, {} [mm]", s.name),
        "negligible", largest, largest < 0.1, "below 0.1 mm, a pixel", why);
}

std::string where(const WallSetting& s) {
    return fmt::format("{}; G = {} terms over {:g} mm of artery, Ω = {}", s.scene.text(),
                       physics::published_terms, s.length(), s.size.pieces_of_artery);
}

std::vector<io::Plot> pictures(const std::vector<WallSetting>& both, std::size_t realisations) {
    const WallSetting& s = both[like_fig_13];
    TemplateRows running, tubes, coloured;
    for (const WallSetting& tube : both) {
        for (const int joint : s.size.joints)
            running.push_back({{"tube", tube.name},
                               {"joint", joint},
                               {"label", joint == s.size.joints.back() ? "realisations" : ""}});
        tubes.push_back({{"tube", tube.name}});
        coloured.push_back({{"tube", tube.name}, {"colour", coloured.empty() ? "#D55E00" : "#0072B2"}});
    }
    const auto example = [](std::size_t k) -> TemplateValues {
        return {{"number", k + 1}, {"colour", wall_variation_colours[k]}};
    };
    return {filled_plot("wall_variation_profiles", 900, 460,
                        {{"where", where(s)}, {"examples", rows_of(examples, example)}}),
            filled_plot("wall_variation_stiffness", 800, 460,
                        {{"realisations", realisations},
                         {"terms", physics::published_terms},
                         {"pieces", s.size.pieces_of_artery}}),
            filled_plot("wall_variation_running", 1100, 800, {{"where", where(s)}, {"panels", running}}),
            filled_plot("wall_variation_joints", 1100, 460,
                        {{"realisations", realisations}, {"where", where(s)}, {"tubes", tubes}}),
            filled_plot("wall_variation_deviation", 900, 480,
                        {{"realisations", realisations}, {"where", where(s)}, {"tubes", coloured}})};
}

StudyResult finish(const StudyOptions& options, const Rows& rows) {
    const std::vector<WallSetting> both = settings(options);
    const WallSetting& s = both[like_fig_13];
    const auto realisations = static_cast<int>(rows.size());
    std::vector<double> stiffness;
    io::Table profiles{"wall_variation_profiles", {"realisation", "piece", "stiffness_over_k"}};
    for (int r = 0; r < realisations; ++r) {
        const auto samples = profile_samples(s, options.seed, r);
        stiffness.insert(stiffness.end(), samples.begin(), samples.end());
        for (std::size_t w = 0; r < examples && w < samples.size(); ++w)
            profiles.add({r + 1.0, w + 1.0, samples[w]});
    }
    StudyResult result;
    claim_walls(result, s.size, rows.size(),
                spread_of(stiffness, static_cast<std::size_t>(s.size.pieces_of_artery)), options.quick);
    io::Table joints{"wall_variation_joints", {"tube", "joint", "mean_mm", "rms_mm"}},
        density{"wall_variation_deviation", {"tube", "middle_deviation_mm", "density_per_mm"}};
    for (int tube = 0; tube < tube_count; ++tube) {
        const WallSetting& here = both[static_cast<std::size_t>(tube)];
        std::vector<double> deviations;
        for (const auto& row : rows)
            for (int i = 1; i <= s.size.segments; ++i) deviations.push_back(deviation(row, tube, i));
        std::vector<MeanAndRms> of_joint;
        for (int i = 1; i <= s.size.segments; ++i) {
            of_joint.push_back(over(rows, tube, i, rows.size()));
            joints.add({here.name, i, of_joint.back().mean, of_joint.back().rms});
        }
        claim_wire(result, here, tube, rows, of_joint, deviations);
        for (const auto& row : density_table("", "_mm", deviations, -density_reach, density_reach, 320).rows)
            density.add({here.name, row[0], row[1]});
    }
    result.plots = pictures(both, rows.size());
    result.page = filled_page("wall-variation",
                              {{"realisations", realisations},
                               {"seed", options.seed},
                               {"gradient0", both[0].rest.gradient},
                               {"gradient1", both[1].rest.gradient},
                               {"name0", both[0].name},
                               {"where0", where(both[0])},
                               {"piece", published_piece},
                               {"name1", both[1].name},
                               {"where1", where(both[1])}},
                              result, options);
    result.tables = {std::move(profiles),
                     density_table("wall_variation_stiffness", "_stiffness_over_k", stiffness, 0, 2, 100),
                     running_table(both, rows), std::move(joints), std::move(density)};
    return result;
}

}  // namespace

const PieceWork wall_variation_pieces = {pieces, columns, rows, finish};

StudyResult run_wall_variation(const StudyOptions& options) {
    return finish(options, rows(options, 0, pieces(options)));
}

}  // namespace studies
