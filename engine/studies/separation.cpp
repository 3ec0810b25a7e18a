#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "engine/studies/claims.h"
#include "engine/studies/lateral_deviation.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
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
    const auto lines = [&](int varied) {
        return rows_of(separations.size(), [&](std::size_t k) -> TemplateValues {
            return {{"run", find(runs, usual, varied, separations[k]).name()},
                    {"look", is_good(separations[k]) ? "lw 2" : "dt 2"},
                    {"colour", separation_colours[k]},
                    {"separation", separations[k]}};
        });
    };
    return filled_plot("separation", 1000, 760,
                       {{"joint", setting.joint},
                        {"scene", setting.scene.text()},
                        {"cycles", cycles},
                        {"two", lines(2)},
                        {"three", lines(3)}});
}

io::Plot means_plot(const std::vector<Setting>& settings, const std::vector<Run>& runs, int counted) {
    return filled_plot("separation_means", 1000, 460,
                       {{"scene", settings[usual].scene.text()},
                        {"counted", counted},
                        {"single", find(runs, usual, 1, 0).mean},
                        {"usual", settings[usual].what},
                        {"coarse", settings[coarse].what},
                        {"wide", settings[wide].what},
                        {"sharp", settings[sharp].what}});
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
    result.page = filled_page("separation",
                              {{"scene", settings[usual].scene.text()},
                               {"cycles", options.quick ? 40 : 200},
                               {"gradient", rests[usual].gradient}},
                              result, options);
    result.tables = {std::move(traces), std::move(table)};
    return result;
}

}  // namespace studies
