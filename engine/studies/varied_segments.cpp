#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "engine/io/cpu_clock.h"
#include "engine/studies/claims.h"
#include "engine/studies/lateral_deviation.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/quantile.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"

namespace studies {
namespace {

/// Sizes of what is followed in the first tube, and the hard joint.
struct VariedSegmentSizes {
    int segments = 200, cycles = 100, counted = 40;
    std::vector<int> joints = {51, 101, 166};  // the paper's 50, 100 and 165, which it counts from 0
    int short_cycles = 10;                     // for the last joint's picture and claims
    int hard_segments = 120, hard_joint = 93, hard_cycles = 80;
    int rest_cycles = 200, long_cycles = 300;
};

VariedSegmentSizes varied_segment_sizes(bool quick) {
    if (!quick) return {};
    return {60, 12, 8, {16, 31, 51}, 10, 60, 47, 10, 40, 30};
}

struct VariedRun {
    NamedMethod method;
    std::vector<DeviationTrace> traces;
};

std::vector<NamedMethod> first_methods() {
    std::vector<NamedMethod> list;
    for (int m = 1; m <= 5; ++m) list.push_back(paper_method(m));
    list.push_back(paper_method(2, 15));
    list.push_back(paper_method(3, 15));
    return list;
}
enum FirstRun { five = 4, two_fixed, three_fixed };  // places in the list above; M = m is at m − 1

std::vector<NamedMethod> hard_methods() {
    std::vector<NamedMethod> list = {paper_method(1), paper_method(2), paper_method(3)};
    NamedMethod combined = paper_method(1);
    combined.name = "M = 1 with geometrical";
    combined.config.kind = physics::RelaxerKind::Combined;
    combined.look = "lc rgb 'black'";
    NamedMethod first = paper_method(1);
    first.name = "first order (Eq. 22)";
    first.config.kind = physics::RelaxerKind::FirstOrder;
    first.look = "lc rgb '#CC79A7'";
    NamedMethod konings = paper_method(1);
    konings.name = "Konings et al.";
    konings.config.kind = physics::RelaxerKind::Konings;
    konings.look = "lc rgb '#D55E00'";
    list.insert(list.end(), {combined, first, konings});
    return list;
}
enum HardRun { combined_run = 3, first_order_run, konings_run };

std::string cycles_text(double cycles) {
    return std::isfinite(cycles) ? fmt::format("{:.1f}", cycles) : std::string("never");
}

/// Median over cycles from `first` on of half the swing of a cycle [mm].
double usual_amplitude(const DeviationTrace& trace, int first, int cycles) {
    std::vector<double> swings;
    for (int c = first; c < cycles; ++c) swings.push_back(0.5 * trace.swing(c));
    return quantile(std::move(swings), 0.5);
}

double largest_amplitude(const DeviationTrace& trace, int first, int cycles) {
    double largest = 0;
    for (int c = first; c < cycles; ++c) largest = std::max(largest, 0.5 * trace.swing(c));
    return largest;
}

void claim_records(const std::vector<VariedRun>& runs, const VariedSegmentSizes& size, bool quick,
                   StudyResult& result) {
    constexpr double published[] = {132e3, 515e3, 139e3};
    for (std::size_t k = 0; k < size.joints.size(); ++k) {
        const int i = size.joints[k], cycles = k < 2 ? size.cycles : size.short_cycles;
        const double records = static_cast<double>(runs[0].traces[k].records()) / size.cycles * cycles;
        FigureClaims(result, fmt::format("Fig. {}", 6 + k))
            .counted(quick, fmt::format("records of joint {} in {} cycles", i, cycles), published[k],
                     0.5 * i * (i + 1) * cycles, records, 1000 / published[k],
                     "within 1000 of the published number, which is cut or rounded, or by the same share",
                     fmt::format("i(i+1)/2 a cycle with i = {}: the paper counts joints from 0.", i));
    }
}

/// What the paper says of Figs. 6 to 8, of one tube.
void claim_joints(const std::vector<VariedRun>& runs, const VariedSegmentSizes& size, const std::string& tube,
                  StudyResult& result) {
    const auto settled = [&](int run, int k) { return runs[run].traces[k].settled(0.1); };
    const auto mean = [&](int run, int k) { return runs[run].traces[k].mean(size.counted); };
    const auto of_each = [&](int k, int most, const auto& what, const char* format) {
        std::string text;
        for (int m = 1; m <= most; ++m) {
            const double value = what(m - 1, k);
            text += fmt::format(
                "{}M = {}: {}", m > 1 ? ", " : "", m,
                std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : std::string("never"));
        }
        return text;
    };
    const bool noted = std::any_of(result.notes.begin(), result.notes.end(),
                                   [](const auto& note) { return note.first == "Fig. 6"; });
    const int half = size.cycles / 2, first = size.joints[0], middle = size.joints[1], last = size.joints[2];
    const auto left = [&](int run) { return runs[run].traces[0].left_after(4); };
    const auto noise = [&](int run, int k) {
        return largest_amplitude(runs[run].traces[k], half, size.cycles);
    };

    FigureClaims six(result, "Fig. 6",
                     noted ? std::string()
                           : fmt::format("Joint {}. Cycles are those after which |d| stays within 0.1 mm; "
                                         "means are of |d| over the first {} cycles [mm].",
                                         first, size.counted));
    six.published("the number of cycles falls with M = 1, 2, 3: mean |d| [mm], " + tube, "falls",
                  of_each(0, 3, mean, "{:.3f}"), mean(1, 0) < mean(0, 0) && mean(2, 0) < mean(1, 0),
                  "each mean is below the one before",
                  fmt::format("Cycles: {}.", of_each(0, 3, settled, "{:.1f}")));
    six.published(
        "δ = 15 is faster at the beginning than chosen δ: part of d left after 5 cycles, " + tube,
        "less with δ = 15",
        fmt::format("M = 2: {:.3f} against {:.3f}, M = 3: {:.3f} against {:.3f}", left(two_fixed), left(1),
                    left(three_fixed), left(2)),
        left(two_fixed) < left(1) && left(three_fixed) < left(2), "with both M",
        "The tube is another than the paper's, and 15 segments another part of the way between contacts.");
    six.published(
        fmt::format("chosen δ is more stable than δ = 15: largest amplitude in a cycle from {} on [mm]",
                    half) +
            ", " + tube,
        "smaller with chosen δ",
        fmt::format("M = 2: {:.1e} against {:.1e}, M = 3: {:.1e} against {:.1e}", noise(1, 0),
                    noise(two_fixed, 0), noise(2, 0), noise(three_fixed, 0)),
        noise(1, 0) < noise(two_fixed, 0) && noise(2, 0) < noise(three_fixed, 0), "with both M",
        "Algorithm 2 may go to and fro between separations that promise as much, which turns the wire a "
        "little each time.");
    const double three = mean(2, 0);
    six.published("M = 4 and 5 are very similar to M = 3: mean |d| [mm], " + tube, "very similar",
                  of_each(0, 5, mean, "{:.3f}"),
                  std::abs(mean(3, 0) - three) < 0.25 * three && std::abs(mean(4, 0) - three) < 0.25 * three,
                  "within a quarter of that of M = 3",
                  "Which contacts the fourth and fifth segment find is the tube's own.");

    FigureClaims seven(result, "Fig. 7",
                       noted ? std::string() : fmt::format("Joint {}, measured as joint {}.", middle, first));
    bool faster = true;
    for (int m = 0; m < 3; ++m) faster = faster && mean(m, 1) < mean(m, 0);
    seven.published(
        fmt::format("all relaxations are faster than those of joint {}: mean |d| [mm]", first) + ", " + tube,
        "faster", of_each(1, 3, mean, "{:.3f}") + " against " + of_each(0, 3, mean, "{:.3f}"), faster,
        "with M = 1, 2 and 3",
        "With M = 1 the joints before this one turn for long and carry it along, so that it is no nearer "
        "than they.");
    const double least = std::min({settled(0, 1), settled(1, 1), settled(2, 1)}),
                 most = std::max({settled(0, 1), settled(1, 1), settled(2, 1)});
    seven.published("similar relaxation times with M = 1, 2 and 3 [cycles], " + tube, "similar",
                    of_each(1, 3, settled, "{:.1f}"), most - least < 0.1 * size.cycles,
                    fmt::format("they differ by less than a tenth of the figure's {} cycles", size.cycles),
                    "With M = 1 the segments before this joint go on turning and carry it along.");
    const double usual = usual_amplitude(runs[0].traces[1], half, size.cycles);
    seven.published("amplitude of the oscillation with M = 1 [mm], " + tube, "1e-4 to 1e-2", usual,
                    usual >= 1e-4 && usual <= 1e-2,
                    fmt::format("half the swing in a cycle, median from cycle {} on, is in that range", half),
                    "How far it swings follows the distance to the next contact.");
    const double quiet = std::max(0.5 * runs[1].traces[1].swing(half), 0.5 * runs[2].traces[1].swing(half));
    seven.published(
        fmt::format("the noise with M = 2 and 3 at about {} cycles is very small [mm]", half) + ", " + tube,
        "very small", quiet, quiet < 1e-3,
        "half the swing in that cycle, the larger of both, is below 0.001 mm",
        "The wire is still on its way.");

    FigureClaims eight(result, "Fig. 8",
                       noted ? std::string()
                             : fmt::format("Joint {}; means are over the {} cycles of the figure.", last,
                                           size.short_cycles));
    const auto brief = [&](int run, int k) { return runs[run].traces[k].mean(size.short_cycles); };
    eight.published("M = 3 relaxes fastest of M = 1, 2 and 3: mean |d| [mm], " + tube, "M = 3",
                    of_each(2, 3, brief, "{:.4f}"), brief(2, 2) < brief(0, 2) && brief(2, 2) < brief(1, 2),
                    "the least mean is that of M = 3",
                    "Methods that settle within a cycle differ by little.");
    const double left_2 = runs[1].traces[2].left_after(1), left_3 = runs[2].traces[2].left_after(1);
    eight.published(
        "very sharp decrease in the beginning with M = 2 and 3: part left after 2 cycles, " + tube,
        "very sharp", fmt::format("M = 2: {:.3f}, M = 3: {:.3f}", left_2, left_3),
        std::max(left_2, left_3) < 0.25, "less than a quarter is left with both",
        "The wire starts close to where it rests here.");
    const double near_tip = usual_amplitude(runs[0].traces[2], half, size.cycles);
    eight.published(
        fmt::format("the noise is larger than that of joint {}: amplitude with M = 1 [mm]", middle) + ", " +
            tube,
        "larger", fmt::format("{:.1e} against {:.1e}", near_tip, usual), near_tip > usual,
        fmt::format("half the swing in a cycle, median from cycle {} on, is larger", half),
        "Noise builds up from joint to joint only where no contact lies between; a contact next to it holds "
        "this joint.");
}

/// Processor time of an update of each method, the least of several cycles [µs].
std::array<double, 2> update_times(const PaperScene& scene,
                                   const std::array<physics::RelaxerConfig, 2>& configs, int repeats) {
    std::array<double, 2> least = {1e300, 1e300};
    std::array<physics::Chain, 2> wires = {scene.start, scene.start};
    std::array relaxers = {physics::make_relaxer(configs[0], *scene.wall),
                           physics::make_relaxer(configs[1], *scene.wall)};
    for (int repeat = 0; repeat < repeats; ++repeat)
        for (std::size_t k = 0; k < 2; ++k) {
            const double start = io::thread_cpu_seconds();
            const auto report = relaxers[k]->relax(wires[k], physics::whole_cycles(scene.segments(), 1));
            if (report.updates > 0)
                least[k] = std::min(least[k], 1e6 * (io::thread_cpu_seconds() - start) / report.updates);
        }
    return least;
}

void claim_hard(const std::vector<VariedRun>& runs, const VariedSegmentSizes& size,
                const std::array<double, 2>& times, StudyResult& result) {
    const auto settled = [&](int run) { return runs[run].traces[0].settled(0.1); };
    const auto text = [&](std::initializer_list<int> list) {
        std::string all;
        for (const int run : list)
            all += fmt::format("{}{}: {}", all.empty() ? "" : ", ", runs[run].method.name,
                               cycles_text(settled(run)));
        return all;
    };
    FigureClaims fig(result, "Fig. 10",
                     fmt::format("Cycles after which |d| of joint {} stays within 0.1 mm. The published wire "
                                 "is that of another paper and not given; ours lies in a hairpin.",
                                 size.hard_joint));
    fig.published("the triple relaxation is the fastest [cycles]", "M = 3", text({0, 1, 2, 3}),
                  settled(2) < std::min({settled(0), settled(1), settled(3)}), "fewest cycles with M = 3",
                  "The published wire is another.");
    const double left = runs[1].traces[0].left_after(0);
    fig.published("M = 2 decreases sharply within the first cycle: part of d left after it", "sharp", left,
                  left < 0.5, "less than half is left", "The published wire is another.");
    fig.published("the relaxation of Konings et al. is essentially the curve of M = 1 [cycles]",
                  "essentially", text({0, konings_run}),
                  settled(konings_run) < 2 * settled(0) && settled(0) < 2 * settled(konings_run),
                  "within a factor of 2",
                  "Ours is that method's small turn of a harmonic joint, without the second order of "
                  "bending, in whole sweeps; its wire and what it takes as relaxed are not published.");
    fig.add(ClaimKind::Extension, "with the geometrical method M = 1 is not much faster than alone [cycles]",
            "not much faster", text({0, combined_run}), settled(combined_run) > 0.5 * settled(0),
            "more than half the cycles",
            "The geometrical method here is our own, not that of Baier et al. 2016.");
    fig.add(ClaimKind::Machine,
            "the recipe of Eq. 22 is by far more efficient than that of Konings et al.: one update [µs]",
            "by far", fmt::format("{:.2f} against {:.2f}", times[0], times[1]), times[0] < times[1],
            "less time",
            "Processor time of a whole update, its wall included, which costs the same in both.");
}

/// How a whole scene comes to rest: cycles until every joint stays within a limit of its own rest.
struct Convergence {
    double to_tenth = 1, to_hundredth = 1;  // cycles; infinite if never
    double energy = 0, gradient = 0;        // [N·mm], |g|/C
};

Convergence converge(const PaperScene& scene, int varied_segments, int cycles) {
    physics::RelaxerConfig config = paper_method(varied_segments).config;
    config.safeguard = true;
    const auto relaxer = physics::make_relaxer(config, *scene.wall);
    physics::Chain wire = scene.start;
    std::vector<physics::Chain> after;
    for (int k = 0; k < cycles; ++k) {
        relaxer->relax(wire, physics::whole_cycles(wire.segments(), 1));
        after.push_back(wire);
    }
    const Rest rest = global_rest(*scene.wall, wire);
    Convergence result;
    const Rest end = as_it_is(*scene.wall, wire);
    result.energy = end.energy;
    result.gradient = end.gradient;
    for (int k = 0; k < cycles; ++k) {
        const double farthest = farthest_joint(after[k], rest.wire);
        if (farthest > 0.1) result.to_tenth = k + 2;
        if (farthest > 0.01) result.to_hundredth = k + 2;
    }
    const double never = std::numeric_limits<double>::infinity();
    if (result.to_tenth > cycles) result.to_tenth = never;
    if (result.to_hundredth > cycles) result.to_hundredth = never;
    return result;
}

/// Outlines of the tube and the wire at the start and at rest.
io::Table wires_table(const PaperScene& scene, const Rest& rest, const VariedSegmentSizes& size) {
    io::Table table{"varied_segments_wires", {"curve", "x_mm", "y_mm"}};
    const geometry::Polyline& path = scene.wall->centreline();
    for (const double side : {-1.0, 1.0}) {
        for (std::size_t i = 0; i + 1 < path.size(); i += 10) {
            const geometry::Vec3 u = (path[i + 1] - path[i]).normalized();
            const geometry::Vec3 x = path[i] + side * scene.wall->radius() * geometry::Vec3(-u.y(), u.x(), 0);
            table.add({side < 0 ? "right wall" : "left wall", x.x(), x.y()});
        }
    }
    for (const auto& x : scene.start.joints) table.add({"initial", x.x(), x.y()});
    for (const auto& x : rest.wire.joints) table.add({"at rest", x.x(), x.y()});
    for (const int i : size.joints) {
        const geometry::Vec3& x = rest.wire.joints[i];
        table.add({fmt::format("joint {}", i), x.x(), x.y()});
    }
    return table;
}

io::Plot wires_plot(const PaperScene& scene, const VariedSegmentSizes& size) {
    const auto joint = [&](std::size_t k) -> TemplateValues {
        return {{"joint", size.joints[k]}, {"shape", 5 + 2 * k}};
    };
    return filled_plot("varied_segments_wires", 1000, 340,
                       {{"scene", scene.text()}, {"joints", rows_of(size.joints.size(), joint)}});
}

io::Plot traces_plot(const std::string& name, const std::vector<VariedRun>& runs, std::size_t count,
                     std::size_t trace, const std::string& figure, const PaperScene& scene, int cycles) {
    const auto method = [&](std::size_t k) -> TemplateValues {
        return {{"method", runs[k].method.name}, {"look", runs[k].method.look}};
    };
    io::Plot plot = filled_plot("varied_segments_joint", 1000, 480,
                                {{"joint", runs[0].traces[trace].joint()},
                                 {"figure", figure},
                                 {"scene", scene.text()},
                                 {"cycles", cycles},
                                 {"table", name},
                                 {"methods", rows_of(count, method)}});
    plot.name = name;
    return plot;
}

io::Table traces_table(const std::string& name, const std::vector<VariedRun>& runs, std::size_t trace,
                       int cycles) {
    io::Table table{name, {"method", "cycles", "lateral_deviation_mm"}};
    for (const VariedRun& run : runs)
        for (const auto& point : run.traces[trace].points())
            if (point.cycles <= cycles) table.add({run.method.name, point.cycles, point.deviation});
    return table;
}

}  // namespace

StudyResult run_varied_segments(const StudyOptions& options) {
    const VariedSegmentSizes size = varied_segment_sizes(options.quick);
    const PaperScene sharp = paper_scene("sharp", {.segments = size.segments}),
                     hairpin = paper_scene("hairpin", {.segments = size.hard_segments});
    const PaperScene sinuous = paper_scene("sinuous", {.segments = size.segments});
    const std::vector<PaperScene> whole = {
        sinuous, paper_scene("spatial", {.segments = options.quick ? 60 : 0}), hairpin};
    const std::vector<NamedMethod> in_sharp = first_methods(), in_hairpin = hard_methods();
    const int sharp_count = static_cast<int>(in_sharp.size()),
              hard_count = static_cast<int>(in_hairpin.size()),
              whole_count = 2 * static_cast<int>(whole.size());
    Work work(options, 4 + 2 * sharp_count + hard_count + whole_count);

    Rest rests[3];
    work.run(3, [&](int k) {
        rests[k] = paper_rest(k == 0 ? sharp : k == 1 ? hairpin : sinuous, size.rest_cycles);
        return std::string("reference");
    });
    const ReferenceCurve curve(rests[0].wire.joints), hard_curve(rests[1].wire.joints),
        sinuous_curve(rests[2].wire.joints);
    std::vector<VariedRun> runs(in_sharp.size()), on_sinuous(in_sharp.size()), hard(in_hairpin.size());
    work.run(2 * sharp_count, [&](int k) {
        const bool first = k < sharp_count;
        const PaperScene& scene = first ? sharp : sinuous;
        VariedRun& run = (first ? runs : on_sinuous)[k % sharp_count];
        run.method = in_sharp[k % sharp_count];
        for (const int joint : size.joints)
            run.traces.emplace_back(first ? curve : sinuous_curve, joint, size.segments);
        physics::Chain wire = scene.start;
        follow(run.method.config, wire, *scene.wall, size.cycles, run.traces);
        return fmt::format("{}, {}", run.method.name, scene.name);
    });
    work.run(hard_count, [&](int k) {
        hard[k].method = in_hairpin[k];
        hard[k].traces.emplace_back(hard_curve, size.hard_joint, size.hard_segments);
        physics::Chain wire = hairpin.start;
        follow(in_hairpin[k].config, wire, *hairpin.wall, size.hard_cycles, hard[k].traces);
        return "hard joint, " + in_hairpin[k].name;
    });
    std::array<double, 2> times{};
    work.run(1, [&](int) {
        times = update_times(hairpin, {in_hairpin[first_order_run].config, in_hairpin[konings_run].config},
                             options.quick ? 3 : 20);
        return std::string("time of an update");
    });
    std::vector<Convergence> convergence(static_cast<std::size_t>(whole_count));
    work.run(whole_count, [&](int k) {
        convergence[k] = converge(whole[k / 2], 2 + k % 2, size.long_cycles);
        return fmt::format("{} to rest", whole[k / 2].name);
    });

    StudyResult result;
    io::Table rest_table{
        "varied_segments_convergence",
        {"scene", "method", "cycles_to_0.1_mm", "cycles_to_0.01_mm", "energy_N_mm", "gradient"}};
    for (int k = 0; k < whole_count; ++k) {
        const Convergence& c = convergence[k];
        rest_table.add({whole[k / 2].name, fmt::format("M = {} safeguarded", 2 + k % 2), c.to_tenth,
                        c.to_hundredth, c.energy, c.gradient});
    }
    io::Table settled{
        "varied_segments_settled",
        {"scene", "joint", "method", "cycles_to_0.1_mm", "cycles_to_0.01_mm", "cycles_to_0.001_mm"}};
    const auto add_settled = [&](const std::string& scene, const std::vector<VariedRun>& list) {
        for (const VariedRun& run : list)
            for (const DeviationTrace& trace : run.traces)
                settled.add({scene, trace.joint(), run.method.name, trace.settled(0.1), trace.settled(0.01),
                             trace.settled(0.001)});
    };
    add_settled("sharp", runs);
    add_settled("sinuous", on_sinuous);
    add_settled("hairpin", hard);
    FigureClaims(result, "Fig. 4")
        .published(fmt::format("{} cycles take the wire to equilibrium: largest |gradient| over C",
                               size.rest_cycles),
                   "equilibrium", rests[0].gradient, rests[0].gradient < 1e-4, "below 1e-4, with M = 2",
                   "The wire is still on its way.");
    claim_joints(runs, size, "sharp", result);
    claim_joints(on_sinuous, size, "sinuous", result);
    claim_hard(hard, size, times, result);
    claim_records(runs, size, options.quick, result);

    result.plots = {wires_plot(sharp, size)};
    for (std::size_t k = 0; k < size.joints.size(); ++k)
        result.plots.push_back(traces_plot(fmt::format("varied_segments_joint_{}", size.joints[k]), runs, 3,
                                           k, fmt::format("Fig. {}", 6 + k), sharp,
                                           k < 2 ? size.cycles : size.short_cycles));
    result.plots.push_back(traces_plot("varied_segments_hard_joint", hard, hard.size(), 0,
                                       "Fig. 10, whose wire is not published; here in a hairpin", hairpin,
                                       size.hard_cycles));
    result.page = filled_page("varied-segments",
                              {{"rest_cycles", size.rest_cycles},
                               {"sharp", rests[0].gradient},
                               {"hairpin", rests[1].gradient},
                               {"sinuous", rests[2].gradient},
                               {"settled", io::to_markdown(settled)},
                               {"long_cycles", size.long_cycles},
                               {"rest", io::to_markdown(rest_table, 7)}},
                              result, options);
    result.tables = {wires_table(sharp, rests[0], size), std::move(settled), std::move(rest_table)};
    for (std::size_t k = 0; k < size.joints.size(); ++k)
        result.tables.push_back(
            traces_table(result.plots[1 + k].name, runs, k, k < 2 ? size.cycles : size.short_cycles));
    result.tables.push_back(traces_table("varied_segments_hard_joint", hard, 0, size.hard_cycles));
    return result;
}

}  // namespace studies
