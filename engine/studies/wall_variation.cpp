#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <random>

#include "engine/studies/claims.h"
#include "engine/studies/lateral_deviation.h"
#include "engine/studies/paper.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/work.h"
#include "physics/wall/wall_stiffness.h"

namespace studies {
namespace {

using physics::WallStiffness;
using Rows = std::vector<std::vector<double>>;

constexpr int term_count = 9;  // G of Eq. 41
constexpr int examples = 5;
constexpr const char* colours[] = {"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00"};

struct Sizes {
    int segments = 175, realisations = 5000;
    int pieces_of_artery = 162;  // Ω, spanned by the wire
    std::array<int, 3> joints = {30, 100, 175};
};
Sizes sizes(const StudyOptions& options) {
    if (!options.quick) return {};
    return {60, 40, 56, {10, 34, 60}};
}

struct Setting {
    Sizes size;
    PaperScene scene;
    Rest rest;  // under a uniform wall

    double length() const { return size.segments * scene.start.spec.segment_length; }  // [mm]
};

Setting setting(const StudyOptions& options) {
    Setting s{sizes(options), paper_scene("sinuous", {sizes(options).segments, 0, 0}), {}};
    s.rest = global_rest(*s.scene.wall, s.scene.start);
    return s;
}

/// Uniform in [0, 1), the same on every machine.
double uniform(std::mt19937_64& random) {
    return std::ldexp(static_cast<double>(random() >> 11), -53);
}

/// k_g in [0, 2^−g k] and φ_g in [0, 2π), determined by seed and number of the realisation alone.
WallStiffness profile(const Setting& s, std::uint64_t seed, int realisation) {
    std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                           static_cast<std::uint32_t>(realisation)};
    std::mt19937_64 random(sequence);
    std::vector<WallStiffness::Term> terms;
    for (int g = 1; g <= term_count; ++g) {
        const double amplitude = std::ldexp(s.scene.stiffness, -g) * uniform(random);
        terms.push_back({amplitude, 2 * std::numbers::pi * uniform(random)});
    }
    return {s.scene.stiffness, s.length(), terms};
}

/// K(ω)/k, ω = 1 … Ω.
std::vector<double> profile_samples(const Setting& s, std::uint64_t seed, int realisation) {
    const WallStiffness stiffness = profile(s, seed, realisation);
    std::vector<double> samples;
    for (int w = 1; w <= s.size.pieces_of_artery; ++w)
        samples.push_back(stiffness.at(s.length() * w / s.size.pieces_of_artery) / stiffness.mean());
    return samples;
}

int pieces(const StudyOptions& options) {
    return sizes(options).realisations;
}

std::vector<std::string> columns(const StudyOptions& options) {
    std::vector<std::string> names = {"realisation", "gradient"};
    for (int i = 1; i <= sizes(options).segments; ++i) names.push_back(fmt::format("d_{}_mm", i));
    return names;
}

/// One row per realisation: the gradient over C at rest, then d_i of joints 1 … N from the wire in a uniform
/// wall.
Rows rows(const StudyOptions& options, int first, int last) {
    const Setting s = setting(options);
    const ReferenceCurve curve(s.rest.wire.joints);
    Rows all(static_cast<std::size_t>(last - first));
    Work work(options, last - first);
    work.run(last - first, [&](int k) {
        const int realisation = first + k;
        const physics::TubeWall wall(s.scene.wall->centreline(), s.scene.wall->radius(),
                                     profile(s, options.seed, realisation));
        const Rest rest = global_rest(wall, s.rest.wire);
        std::vector<double>& row = all[static_cast<std::size_t>(k)];
        row = {static_cast<double>(realisation), rest.gradient};
        for (std::size_t i = 1; i < rest.wire.joints.size(); ++i)
            row.push_back(curve.deviation(rest.wire.joints[i]));
        return fmt::format("realisation {}", realisation + 1);
    });
    return all;
}

double deviation(const std::vector<double>& row, int joint) {
    return row[static_cast<std::size_t>(joint) + 1];
}

struct MeanAndRms {
    double mean = 0, rms = 0;
};

/// Mean and rms for joint i in the first `count` realisations [mm].
MeanAndRms over(const Rows& rows, int joint, std::size_t count) {
    double sum = 0, squares = 0;
    for (std::size_t r = 0; r < count; ++r) {
        const double d = deviation(rows[r], joint);
        sum += d;
        squares += d * d;
    }
    return {sum / static_cast<double>(count), std::sqrt(squares / static_cast<double>(count))};
}

io::Table running_table(const Setting& s, const Rows& rows) {
    io::Table table{"wall_variation_running", {"joint", "realisations", "mean_mm", "rms_mm"}, {}};
    const std::size_t step = std::max<std::size_t>(1, rows.size() / 500);
    for (const int joint : s.size.joints) {
        double sum = 0, squares = 0;
        for (std::size_t r = 0; r < rows.size(); ++r) {
            const double d = deviation(rows[r], joint);
            sum += d;
            squares += d * d;
            const double count = static_cast<double>(r + 1);
            if (r % step == 0 || r + 1 == rows.size())
                table.add({static_cast<double>(joint), count, sum / count, std::sqrt(squares / count)});
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
    io::Table table{name, {"middle" + unit, "density"}, {}};
    const double width = (to - from) / bins;
    for (int b = 0; b < bins; ++b)
        table.add({from + (b + 0.5) * width, static_cast<double>(counts[static_cast<std::size_t>(b)]) /
                                                 (static_cast<double>(values.size()) * width)});
    return table;
}

struct Spread {
    double mean = 0, deviation = 0, inside = 0, least = 1e300, largest = -1e300, mean_error = 0;
};

/// Spread of K/k over all realisations; `inside` is the share in (0.5, 1.5).
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

std::vector<Claim> claims(const Setting& s, const Rows& rows, const Spread& k,
                          const std::vector<MeanAndRms>& of_joint, const std::vector<double>& deviations) {
    std::vector<Claim> list;
    const auto add = [&](const std::string& text, io::TableCell published, io::TableCell measured, bool holds,
                         const std::string& note) {
        list.push_back({text, std::move(published), std::move(measured), holds, note});
    };
    const std::string count = fmt::format("{} realisations.", rows.size());
    double gradient = 0;
    for (const auto& row : rows) gradient = std::max(gradient, row[1]);
    add("Section 3.5: for each realisation the equilibrium is found: largest |gradient| over C",
        std::string("equilibrium"), gradient, gradient <= 1e-7, count + " Equilibrium: at most 1e-7.");
    add("Eq. 41: K is positive: least K/k", std::string("> 0"), k.least, k.least > 0, count);
    add("Eq. 41: K is bounded: largest K/k", std::string("< 2"), k.largest, k.largest < 2, count);
    add("Eq. 41: a tenth term would add less than 0.1 % of k [%]", std::string("< 0.1"),
        100 * std::ldexp(1.0, -10), true, "Its largest amplitude.");
    const double points = static_cast<double>(rows.size()) * s.size.pieces_of_artery;
    add("Fig. 15: points of K, realisations times Ω", 5000.0 * 162, points, points == 5000.0 * 162,
        fmt::format("{} times {}.", rows.size(), s.size.pieces_of_artery));
    add("Fig. 15: part of the points with 0.5 < K/k < 1.5 [%]", 96.6, 100 * k.inside,
        std::abs(100 * k.inside - 96.6) <= 0.5,
        "Holds within half a per cent, about two standard errors. " + count);
    add("Fig. 15: mean of K/k", 1.0012, k.mean,
        std::abs(k.mean - 1.0012) <= 3 * std::sqrt(2.0) * k.mean_error,
        fmt::format("Expected is 1. Holds within three standard errors of the difference of two such means, "
                    "{:.4f}. {}",
                    3 * std::sqrt(2.0) * k.mean_error, count));
    add("Fig. 15: standard deviation of K/k", 0.236, k.deviation, std::abs(k.deviation - 0.236) <= 0.005,
        "Expected is 0.2357. Holds within 0.005. " + count);
    double drift = 0;
    for (const int joint : s.size.joints) {
        const MeanAndRms half = over(rows, joint, rows.size() / 2), all = over(rows, joint, rows.size());
        drift = std::max({drift, std::abs(half.mean - all.mean) / all.rms, std::abs(half.rms / all.rms - 1)});
    }
    add("Fig. 16: mean and rms reach stable values: largest change over the second half of the realisations, "
        "of the rms",
        std::string("stable"), drift, drift < 0.05,
        fmt::format("Of joints {}. Stable: below 0.05.", fmt::join(s.size.joints, ", ")));
    double smaller = 0, well_smaller = 0;
    for (const MeanAndRms& m : of_joint) {
        smaller += std::abs(m.mean) < m.rms;
        well_smaller += 2 * m.mean * m.mean < m.rms * m.rms;  // |mean| below the standard deviation
    }
    const double joints = static_cast<double>(of_joint.size());
    add("Fig. 17: |mean| is mostly smaller than the rms: part of the joints [%]", std::string("most"),
        100 * smaller / joints, smaller > 0.5 * joints,
        fmt::format("It cannot be larger. It is smaller than the standard deviation at {:.0f} %.",
                    100 * well_smaller / joints));
    const auto within =
        std::count_if(deviations.begin(), deviations.end(), [](double d) { return std::abs(d) <= 0.005; });
    const double part = 100 * static_cast<double>(within) / static_cast<double>(deviations.size());
    double largest = 0;
    for (const double d : deviations) largest = std::max(largest, std::abs(d));
    add("Fig. 18: d varies by about ±0.005 mm or less: part of all d within it [%]",
        std::string("nearly all"), part, part >= 95, "Nearly all: 95 %. " + count);
    add("Section 3.5: an uneven wall is negligible for a simulator: largest |d| of all [mm]",
        std::string("negligible"), largest, largest < 0.1, "Negligible: below 0.1 mm, a pixel. " + count);
    return list;
}

std::string where(const Setting& s) {
    return fmt::format("{}; G = {} terms over {:g} mm of artery, Ω = {}", s.scene.text(), term_count,
                       s.length(), s.size.pieces_of_artery);
}

std::vector<io::Plot> pictures(const Setting& s, std::size_t realisations) {
    const std::string grid = "set grid lc rgb '#dddddd'\n";
    std::vector<io::Plot> plots;
    io::Plot profiles{"wall_variation_profiles", "", 900, 460};
    profiles.commands = grid +
                        "set xlabel 'piece of artery ω'\nset ylabel 'K/k'\nset yrange [0:2]\nset key outside "
                        "right top\nplot ";
    for (int r = 1; r <= examples; ++r)
        profiles.commands += fmt::format(
            "{}'wall_variation_profiles.csv' skip 1 using ($1 == {} ? $2 : 1/0):3 with lines lw 1.5 "
            "lc rgb '{}' title 'realisation {}'",
            r > 1 ? ", \\\n     " : "", r, colours[r - 1], r);
    profiles.commands += "\n";
    profiles.caption =
        "The first of the random walls, stiffness along the artery (the paper's Fig. 14): " + where(s) + ".";
    plots.push_back(profiles);

    io::Plot stiffness{"wall_variation_stiffness", "", 800, 460};
    stiffness.commands = grid +
                         "set style fill solid 0.8 noborder\nset xlabel 'K/k'\nset ylabel 'density'\nset "
                         "xrange [0:2]\nset yrange "
                         "[0:*]\nunset key\nplot 'wall_variation_stiffness.csv' skip 1 using 1:2 with boxes "
                         "lc rgb '#0072B2'\n";
    stiffness.caption =
        fmt::format("Density of the wall's stiffness in {} realisations (the paper's Fig. 15): {}.",
                    realisations, where(s));
    plots.push_back(stiffness);

    io::Plot running{"wall_variation_running", "", 900, 900};
    running.commands =
        grid + "set multiplot layout 3,1\nset ylabel 'deviation d [µm]'\nset key outside right top\n";
    for (std::size_t k = 0; k < s.size.joints.size(); ++k)
        running.commands += fmt::format(
            "set title 'joint {0}'\nset xlabel '{1}'\n"
            "plot 'wall_variation_running.csv' skip 1 using ($1 == {0} ? $2 : 1/0):(1000*$3) with lines lw "
            "1.5 lc "
            "rgb '#009E73' "
            "title 'mean', \\\n     '' skip 1 using ($1 == {0} ? $2 : 1/0):(1000*$4) with lines lw 1.5 lc "
            "rgb "
            "'#D55E00' title 'rms'\n",
            s.size.joints[k], k + 1 == s.size.joints.size() ? "realisations" : "");
    running.commands += "unset multiplot\n";
    running.caption =
        "Mean and rms of the lateral deviation against the number of realisations (the paper's Fig. 16): " +
        where(s) + ".";
    plots.push_back(running);

    io::Plot joints{"wall_variation_joints", "", 900, 460};
    joints.commands =
        grid +
        "set xlabel 'joint i'\nset ylabel 'deviation d_i [µm]'\nset key outside right top\n"
        "plot 'wall_variation_joints.csv' skip 1 using 1:(1000*$2) with lines lw 1.5 lc rgb '#009E73' "
        "title 'mean', \\\n"
        "     '' skip 1 using 1:(1000*$3) with lines lw 1.5 lc rgb '#D55E00' title 'rms'\n";
    joints.caption = fmt::format(
        "Mean and rms of the lateral deviation of each joint in {} realisations (the paper's Fig. 17): {}.",
        realisations, where(s));
    plots.push_back(joints);

    io::Plot density{"wall_variation_deviation", "", 800, 460};
    density.commands =
        grid +
        "set style fill solid 0.8 noborder\nset xlabel 'lateral deviation d [µm]'\nset ylabel "
        "'density [1/µm]'\n"
        "set yrange [0:*]\nunset key\n"
        "plot 'wall_variation_deviation.csv' skip 1 using (1000*$1):($2/1000) with boxes lc rgb '#0072B2'\n";
    density.caption = fmt::format(
        "Density of the lateral deviation of all joints in {} realisations (the paper's Fig. 18): {}.",
        realisations, where(s));
    plots.push_back(density);
    return plots;
}

StudyResult finish(const StudyOptions& options, const Rows& rows) {
    const Setting s = setting(options);
    const auto realisations = static_cast<int>(rows.size());
    std::vector<double> stiffness, deviations;
    io::Table profiles{"wall_variation_profiles", {"realisation", "piece", "stiffness_over_k"}, {}};
    for (int r = 0; r < realisations; ++r) {
        const auto samples = profile_samples(s, options.seed, r);
        stiffness.insert(stiffness.end(), samples.begin(), samples.end());
        for (std::size_t w = 0; r < examples && w < samples.size(); ++w)
            profiles.add({r + 1.0, w + 1.0, samples[w]});
        deviations.insert(deviations.end(), rows[static_cast<std::size_t>(r)].begin() + 2,
                          rows[static_cast<std::size_t>(r)].end());
    }
    std::vector<MeanAndRms> of_joint;
    io::Table joints{"wall_variation_joints", {"joint", "mean_mm", "rms_mm"}, {}};
    double squares = 0;
    for (int i = 1; i <= s.size.segments; ++i) {
        of_joint.push_back(over(rows, i, rows.size()));
        joints.add({static_cast<double>(i), of_joint.back().mean, of_joint.back().rms});
        squares += of_joint.back().rms * of_joint.back().rms / s.size.segments;
    }
    const Spread k = spread_of(stiffness, static_cast<std::size_t>(s.size.pieces_of_artery));
    const double reach = 8 * std::sqrt(squares);

    StudyResult result;
    result.claims = claims(s, rows, k, of_joint, deviations);
    result.plots = pictures(s, rows.size());
    result.page = claims_page("wall-variation", "How far an uneven wall moves the wire",
                              fmt::format("{}. Random numbers of seed {}, those of a realisation from its "
                                          "number alone. Each of {} realisations "
                                          "comes to rest by the global relaxer from the rest under a uniform "
                                          "wall (gradient over C {:.1e}), which is "
                                          "the reference of the lateral deviation.",
                                          where(s), options.seed, realisations, s.rest.gradient),
                              result, options);
    result.tables = {
        std::move(profiles),
        density_table("wall_variation_stiffness", "_stiffness_over_k", stiffness, 0, 2, 100),
        running_table(s, rows), std::move(joints),
        density_table("wall_variation_deviation", "_deviation_mm", deviations, -reach, reach, 160)};
    return result;
}

}  // namespace

const PieceWork wall_variation_pieces = {pieces, columns, rows, finish};

StudyResult run_wall_variation(const StudyOptions& options) {
    return finish(options, rows(options, 0, pieces(options)));
}

}  // namespace studies
