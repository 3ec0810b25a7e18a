#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "engine/studies/claims.h"
#include "engine/studies/lateral_deviation.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/runs.h"
#include "engine/studies/work.h"

namespace studies {
namespace {

constexpr const char* separation_colours[] = {"#CC79A7", "#E69F00", "#009E73",
                                              "#0072B2", "#56B4E9", "#D55E00"};

/// A tube and wire in which separations are tried.
struct Setting {
    PaperScene scene;
    std::string what;
    int joint = 51;  // followed; the paper's joint 50 is the 51st that moves
};
enum Settings { usual, coarse, wide, sharp };

struct Run {
    int setting = 0, varied = 1, separation = 0;
    std::vector<DeviationTrace::Point> points = {};
    double mean = 0;  // |d| over the cycles that count [mm]
    long long records = 0;

    std::string name() const {
        return varied == 1 ? "M = 1" : fmt::format("M = {} δ = {}", varied, separation);
    }
};

const Run& find(const std::vector<Run>& runs, int setting, int varied, int separation) {
    return *std::find_if(runs.begin(), runs.end(), [&](const Run& run) {
        return run.setting == setting && run.varied == varied && run.separation == separation;
    });
}

double best_separation(const std::vector<Run>& runs, int setting, int varied) {
    const Run* best = nullptr;
    for (const Run& run : runs)
        if (run.setting == setting && run.varied == varied && (!best || run.mean < best->mean)) best = &run;
    return best ? best->separation : std::nan("");
}

bool is_good(int separation) {
    return separation >= 10 && separation <= 20;
}

/// "δ = 2: 0.115, δ = 5: 0.119, …".
std::string means(const std::vector<Run>& runs, int setting, int varied,
                  const std::vector<int>& separations) {
    std::string text;
    for (const int delta : separations)
        text += fmt::format("{}δ = {}: {:.3f}", text.empty() ? "" : ", ", delta,
                            find(runs, setting, varied, delta).mean);
    return text;
}

/// What the paper says of Fig. 5, of one tube.
void claim_tube(FigureClaims& fig, const std::vector<Run>& runs, int tube,
                const std::vector<int>& separations, const std::string& name) {
    const double single = find(runs, tube, 1, 0).mean;
    const auto mean = [&](int varied, int delta) { return find(runs, tube, varied, delta).mean; };
    const std::string contacts =
        "The best separation is the distance between contacts, which this tube's sharp bends bring closer "
        "together.";
    for (const int varied : {2, 3}) {
        const double best = best_separation(runs, tube, varied);
        fig.published(fmt::format("separation of the fastest M = {}, {} [segments]", varied, name),
                      "10 to 20", best, best >= 10 && best <= 20, "the least mean is at a δ from 10 to 20",
                      contacts);
    }
    double slowest_good = 0, fastest_other = 1e300, slowest = 0, two = 0, three = 0;
    int won = 0;
    for (const int delta : separations) {
        slowest = std::max(slowest, mean(2, delta));
        if (is_good(delta)) slowest_good = std::max(slowest_good, mean(2, delta));
        if (delta <= 5 || delta >= 30) fastest_other = std::min(fastest_other, mean(2, delta));
        won += mean(3, delta) < mean(2, delta);
        two += mean(2, delta), three += mean(3, delta);
    }
    fig.published(fmt::format("M = 2 is slow with δ of 2 to 5 and from 30 on: least mean of these over the "
                              "largest of 10 to 20, {}",
                              name),
                  "> 1", fastest_other / slowest_good, fastest_other > slowest_good,
                  "every δ of 2, 5, 30 has a larger mean than each of 10, 15, 20", contacts);
    fig.published(
        fmt::format("M = 2 with any δ is faster than M = 1: largest mean over that of M = 1, {}", name),
        "< 1", slowest / single, slowest < single, "the ratio is below 1",
        "The slowest separation, with contacts between the two segments, is as slow as M = 1.");
    fig.published(
        fmt::format("M = 3 is faster than M = 2 at the same δ: separations at which it is, {}", name), "most",
        fmt::format("{} of {}", won, separations.size()), 2 * won > static_cast<int>(separations.size()),
        "more than half of those tried",
        fmt::format("Summed over all δ the mean of M = 3 is {:.2f} of that of M = 2.", three / two));
}

void claim(StudyResult& result, const std::vector<Run>& runs, const std::vector<int>& separations, int joint,
           int counted) {
    std::string measured;
    for (const auto& [tube, name] : {std::pair<int, const char*>{usual, "sinuous"}, {sharp, "sharp"}})
        measured +=
            fmt::format(" {}: M = 1: {:.3f}; M = 2: {}; M = 3: {}.", name, find(runs, tube, 1, 0).mean,
                        means(runs, tube, 2, separations), means(runs, tube, 3, separations));
    FigureClaims fig(
        result, "Fig. 5",
        fmt::format(
            "Measured by the mean of |d_{}| over the first {} cycles [mm], which weighs the whole path to "
            "rest. The published tube is not given: two are tried, neither chosen by a result.{}",
            joint, counted, measured));
    claim_tube(fig, runs, usual, separations, "sinuous");
    claim_tube(fig, runs, sharp, separations, "sharp");

    FigureClaims section(
        result, "Section 3.1",
        "The best separation in other settings, by the same measure with M = 2. Other settings are compared "
        "with the usual one by the distance between contacts that the paper gives as the reason.");
    const double here = best_separation(runs, usual, 2);
    const auto compare = [&](int setting, const std::string& text, const std::string& published, bool holds) {
        const double other = best_separation(runs, setting, 2);
        section.published(text, published, fmt::format("{:g} against {:g}", other, here), holds,
                          "strictly so, among the separations tried",
                          fmt::format("Means there: {}. Neighbouring separations are nearly as good.",
                                      means(runs, setting, 2, separations)));
    };
    compare(coarse, "the optimal δ is larger for smaller λ: best at λ = 2 mm against 1 mm [segments]",
            "smaller at 2 mm", best_separation(runs, coarse, 2) < here);
    compare(wide,
            "the optimal δ is larger in a wider lumen: best at a radius of 2 mm against 1 mm [segments]",
            "larger at 2 mm", best_separation(runs, wide, 2) > here);
    compare(
        sharp,
        "the optimal δ is larger along a smoother axis: best in bends of 3 mm against 12 to 30 mm [segments]",
        "smaller in sharp bends", best_separation(runs, sharp, 2) < here);
}

io::Plot traces_plot(const std::vector<int>& separations, const std::vector<Run>& runs,
                     const Setting& setting, int cycles) {
    io::Plot plot{"separation", "", 1000, 760};
    plot.commands = fmt::format(
        "set multiplot layout 2,1\nset grid lc rgb '#dddddd'\nset key outside right top\nset logscale y\n"
        "set format y '10^{{%L}}'\nset yrange [1e-4:3]\nset xrange [0:{}]\n"
        "set ylabel '|d_{{{}}}| [mm]'\nset label 1 '0.1 mm' at {},0.13 right tc rgb '#666666'\n"
        "set arrow 1 from 0,0.1 to {},0.1 nohead dt 3 lc rgb '#666666'\n",
        cycles, setting.joint, cycles, cycles);
    for (const int varied : {2, 3}) {
        plot.commands += varied == 2
                             ? "set title '(a) two varied segments'\nset xlabel ''\n"
                             : "set title '(b) three varied segments'\nset xlabel 'relaxation cycles'\n";
        const auto line = [&](const std::string& name, const std::string& look) {
            plot.curve(fmt::format(
                "'separation.csv' skip 1 using (strcol(1) eq '{}' ? $2 : 1/0):(abs($3)) {}", name, look));
        };
        plot.commands += "plot ";
        line("M = 1", "with lines lw 2 lc rgb '#999999' title 'M = 1'");
        for (std::size_t k = 0; k < separations.size(); ++k) {
            const Run& run = find(runs, usual, varied, separations[k]);
            line(run.name(), fmt::format("with lines {} lc rgb '{}' title 'δ = {}'",
                                         is_good(separations[k]) ? "lw 2" : "dt 2", separation_colours[k],
                                         separations[k]));
        }
        plot.commands += "\n";
    }
    plot.commands += "unset multiplot\n";
    plot.caption = fmt::format(
        "Lateral deviation of joint {} against relaxation cycles for M = 1 and for two and three varied "
        "segments at a fixed separation δ (the paper's Fig. 5). Solid: the separations that the paper calls "
        "best, 10 to 20. {}.",
        setting.joint, setting.scene.text());
    return plot;
}

io::Plot means_plot(const std::vector<Setting>& settings, const std::vector<Run>& runs, int counted) {
    io::Plot plot{"separation_means", "", 1000, 460};
    plot.commands = fmt::format(
        "set multiplot layout 1,2\nset grid lc rgb '#dddddd'\nset xlabel 'separation δ [segments]'\n"
        "set ylabel 'mean |d| over {} cycles [mm]'\nset xrange [0:32]\nset yrange [0:*]\n"
        "set key bottom right\nset object 1 rectangle from 10, graph 0 to 20, graph 1 behind fc rgb "
        "'#e8f3ec' fs noborder\nset label 1 'published: best' at 15, graph 0.95 center tc rgb '#2d6a4f'\n",
        counted);
    const auto line = [&](int setting, int varied, const std::string& look) {
        return fmt::format("'separation_means.csv' skip 1 using ($1 == {} && $3 == {} ? $4 : 1/0):5 {}",
                           setting + 1, varied, look);
    };
    plot.commands += fmt::format(
        "set title '{}'\nplot {:.6f} with lines lw 2 lc rgb '#999999' title 'M = 1', \\\n     {}, \\\n     "
        "{}\n",
        settings[usual].what, find(runs, usual, 1, 0).mean,
        line(usual, 2, "with linespoints pt 7 lw 2 lc rgb '#0072B2' title 'M = 2'"),
        line(usual, 3, "with linespoints pt 5 lw 2 lc rgb '#009E73' title 'M = 3'"));
    plot.commands += "set title 'M = 2 in other settings'\nset key top right\nunset label 1\nplot ";
    for (int k = usual; k <= sharp; ++k)
        plot.curve(
            line(k, 2,
                 fmt::format("with linespoints pt {} lw 2 lc rgb '{}' title '{}'", 4 + k,
                             std::array{"#0072B2", "#E69F00", "#CC79A7", "#D55E00"}[k], settings[k].what)));
    plot.commands += "\nunset multiplot\n";
    plot.caption =
        "Mean lateral deviation on the way to rest against the separation: which separation is fastest. "
        "Shaded: the best separations published (Section 3.1). " +
        settings[usual].scene.text() + ".";
    return plot;
}

}  // namespace

StudyResult run_separation(const StudyOptions& options) {
    const int cycles = options.quick ? 12 : 100, counted = options.quick ? 8 : 40;
    const int n = options.quick ? 60 : 200;
    const std::vector<Setting> settings = {
        {paper_scene("sinuous", {.segments = n}), "bends of 12 to 30 mm, λ 1 mm, radius 1 mm",
         options.quick ? 21 : 51},
        {paper_scene("sinuous", {.segments = n / 2, .segment_length = 2}), "λ 2 mm", options.quick ? 11 : 26},
        {paper_scene("sinuous", {.segments = n, .radius = 2}), "radius 2 mm", options.quick ? 21 : 51},
        {paper_scene("sharp", {.segments = n}), "bends of 3 mm", options.quick ? 21 : 51}};
    const std::vector<int> separations =
        options.quick ? std::vector<int>{2, 15, 30} : std::vector<int>{2, 5, 10, 15, 20, 25, 30};
    std::vector<Run> runs;
    for (int setting = 0; setting < static_cast<int>(settings.size()); ++setting) {
        runs.push_back({setting, 1, 0});
        for (const int varied : {2, 3})
            for (const int delta : separations) runs.push_back({setting, varied, delta});
    }
    Work work(options, static_cast<int>(settings.size() + runs.size()));
    std::vector<Rest> rests(settings.size());
    work.run(static_cast<int>(settings.size()), [&](int k) {
        rests[k] = paper_rest(settings[k].scene, options.quick ? 40 : 200);
        return fmt::format("reference, {}", settings[k].what);
    });
    work.run(static_cast<int>(runs.size()), [&](int k) {
        Run& run = runs[k];
        const Setting& setting = settings[run.setting];
        const ReferenceCurve curve(rests[run.setting].wire.joints);
        DeviationTrace trace(curve, setting.joint, setting.scene.segments());
        physics::Chain wire = setting.scene.start;
        follow(paper_method(run.varied, run.separation).config, wire, *setting.scene.wall,
               run.setting == usual ? cycles : counted, {&trace, 1});
        run.points = trace.points();
        run.records = trace.records();
        run.mean = trace.mean(counted);
        return fmt::format("{}, {}", run.name(), setting.what);
    });

    StudyResult result;
    io::Table traces{"separation", {"curve", "cycles", "lateral_deviation_mm"}};
    io::Table table{"separation_means",
                    {"number", "setting", "varied_segments", "separation", "mean_deviation_mm"}};
    for (const Run& run : runs) {
        table.add({run.setting + 1.0, settings[run.setting].what, run.varied, run.separation, run.mean});
        if (run.setting != usual) continue;
        for (const auto& point : run.points) traces.add({run.name(), point.cycles, point.deviation});
    }
    claim(result, runs, separations, settings[usual].joint, counted);
    result.plots = {traces_plot(separations, runs, settings[usual], cycles),
                    means_plot(settings, runs, counted)};
    result.page = claims_page(
        "separation", "How far apart varied segments should be",
        fmt::format("The wire starts on the centreline: {}. The reference curve of the lateral deviation is "
                    "the wire after {} cycles with M = 2 and chosen separations, where the largest gradient "
                    "over C is {:.1e}. Methods are the paper's, without safeguard.",
                    settings[usual].scene.text(), options.quick ? 40 : 200, rests[usual].gradient),
        result, options);
    result.tables = {std::move(traces), std::move(table)};
    return result;
}

}  // namespace studies
