#include "engine/studies/stability.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <mutex>
#include <numeric>

#include "engine/studies/stability_cell.h"
#include "physics/geometry/parallel.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

struct Method {
    std::string_view name;
    physics::RelaxerConfig config;
};

physics::RelaxerConfig plain(int varied) {
    physics::RelaxerConfig config;
    config.kind = physics::RelaxerKind::Segment;
    config.varied_segments = varied;
    config.safeguard = false;
    return config;
}

std::vector<Method> methods() {
    physics::RelaxerConfig first_order, safe, global;
    first_order.kind = physics::RelaxerKind::FirstOrder;
    safe.kind = physics::RelaxerKind::Segment;
    return {{"first order", first_order}, {"M = 1", plain(1)},  {"M = 2", plain(2)},
            {"M = 3", plain(3)},          {"M = 2 safe", safe}, {"global", global}};
}

std::string length_text(double mm) {
    if (mm < 0.001) return "< 0.001 mm";
    return mm < 10 ? fmt::format("{:.2g} mm", mm) : fmt::format("{:.0f} mm", mm);
}
std::string time_text(double seconds) {
    if (seconds < 0.01) return fmt::format("{:.2g} ms", 1e3 * seconds);
    if (seconds < 1) return fmt::format("{:.0f} ms", 1e3 * seconds);
    return seconds < 10 ? fmt::format("{:.1f} s", seconds) : fmt::format("{:.0f} s", seconds);
}
std::string energy_text(double energy) {  // rounding residues become 0
    return std::abs(energy) < 1e-9 ? std::string("0 N·mm") : fmt::format("{:.6g} N·mm", energy);
}

/// The figures under a cell's word.
std::string figures(const StabilityCell& cell) {
    if (!cell.measure.finite) return time_text(cell.cpu);
    return fmt::format("{}, {}", length_text(cell.measure.deviation), time_text(cell.cpu));
}

io::Table numbers_table(const std::vector<BreakingCase>& cases,
                        const std::vector<StabilityReference>& references, const std::vector<Method>& columns,
                        const std::vector<StabilityCell>& cells) {
    io::Table table{"stability",
                    {"row", "column", "case", "method", "outcome", "code", "energy_N_mm",
                     "reference_energy_N_mm", "reference_gradient", "deviation_mm", "basin_deviation_mm",
                     "gradient", "max_penetration_mm", "updates", "cpu_s", "energy", "energy", "figures"},
                    {}};
    for (std::size_t r = 0; r < cases.size(); ++r) {
        for (std::size_t k = 0; k < columns.size(); ++k) {
            const StabilityCell& cell = cells[r * columns.size() + k];
            const CellMeasure& m = cell.measure;
            table.add({static_cast<double>(r), static_cast<double>(k), cases[r].what,
                       std::string(columns[k].name), std::string(outcome_text(cell.outcome)),
                       static_cast<double>(cell.outcome), cell.energy, references[r].energy,
                       references[r].gradient, m.deviation, m.basin_deviation, m.gradient, m.penetration,
                       static_cast<double>(cell.updates), cell.cpu,
                       m.finite ? energy_text(cell.energy) : std::string(), figures(cell)});
        }
    }
    return table;
}

io::Table map_table(const std::vector<BreakingCase>& cases, const std::vector<StabilityReference>& references,
                    const std::vector<Method>& columns, const std::vector<StabilityCell>& cells) {
    io::Table table{"stability_map", {"what breaks methods", "reference"}, {}};
    for (const Method& method : columns) table.columns.emplace_back(method.name);
    for (std::size_t r = 0; r < cases.size(); ++r) {
        std::vector<io::TableCell> row = {cases[r].what, energy_text(references[r].energy)};
        for (std::size_t k = 0; k < columns.size(); ++k) {
            const StabilityCell& cell = cells[r * columns.size() + k];
            std::string text = cell.outcome == Outcome::Converged
                                   ? fmt::format("**{}**", outcome_text(cell.outcome))
                                   : std::string(outcome_text(cell.outcome));
            if (cell.measure.finite) text += "\n" + energy_text(cell.energy);
            row.emplace_back(text + "\n" + figures(cell));
        }
        table.add(std::move(row));
    }
    return table;
}

std::string numbers_of(const BreakingCase& c) {
    const auto contacts = physics::all_contacts(c.start, *c.wall);
    return fmt::format("N = {}, λ = {:g} mm, EI = {:g} N·mm² (tip {:g}), k = {:g} N/mm a joint",
                       c.start.segments(), c.start.grid.segment_length,
                       c.start.devices[0].spec.shaft_rigidity(),
                       physics::rigidity_at(c.start.devices[0].spec, 0), contacts.back().stiffness);
}

std::string page(const std::vector<BreakingCase>& cases, const std::vector<StabilityReference>& references,
                 const io::Table& map, bool quick) {
    const StabilityRules rules;
    std::string text =
        "# What breaks which method\n\nGenerated by `seldinger study stability" +
        std::string(quick ? " --quick" : "") +
        "`; never edited by hand. Each cell: what came of it, the energy at the end, the farthest joint from "
        "the reference, and processor time.\n\n![The map](stability.svg)\n\n" +
        io::to_markdown(map) + "\n## Rules\n\nThe first that holds names the cell.\n\n";
    text += "1. **NaN**: a joint or the energy is not a finite number.\n";
    text += fmt::format(
        "2. **left the lumen**: a joint is farther beyond the wall than {} of the lumen's radius there, and "
        "than {} times the deepest joint of the reference, which is as deep as the force explains.\n",
        rules.outside, rules.times_reference);
    text += fmt::format(
        "3. **wrong basin**: the largest gradient over C is at most {:g}, but the slow flow from there ends "
        "more than {} mm from the reference.\n",
        rules.gradient, rules.basin);
    text += fmt::format(
        "4. **converged**: the gradient is as small and every joint within {} mm of the reference.\n",
        rules.basin);
    text += fmt::format(
        "5. **oscillates**: the gradient is larger, and in the last quarter of {} samples over the work the "
        "energy rose at least once by more than {:g} of it.\n",
        rules.samples, rules.rise);
    text += fmt::format(
        "6. **stuck**: the gradient is larger, yet no joint moved by {:g} mm in the last quarter of the "
        "work, as where the planes of a mesh meet in an edge.\n",
        rules.stuck);
    text +=
        "7. **still moving**: none of these when the work was done.\n\nThe **reference** is a very slow "
        "descent of the true energy from the same start: implicit steps in a viscous medium, no joint "
        "farther than 0.02 mm a step, until the gradient over C is 1e-9 or no step lowers the energy. It "
        "shares no code with the methods but wire, bending and wall.\n\nWhere the work is half spent before "
        "the last of several disturbances, each has an equal part of it. All methods get the same number of "
        "segment updates; a step of the global one counts N. It stops when it has converged, and its time is "
        "what that took.\n\n## Cases\n\n";
    for (std::size_t r = 0; r < cases.size(); ++r) {
        const BreakingCase& c = cases[r];
        text += fmt::format("- **{}**: {} {} cycles of work. {}.", c.what, c.how, c.cycles, numbers_of(c));
        if (references[r].gradient > rules.gradient)
            text += fmt::format(" The reference itself stops at a gradient over C of {:.1e}.",
                                references[r].gradient);
        text += '\n';
    }
    return text;
}

/// `'text' 0, 'text' 1, …` in the form gnuplot expects for tics.
std::string tics(const std::vector<std::string>& texts) {
    std::string list;
    for (std::size_t k = 0; k < texts.size(); ++k)
        list += fmt::format("{}'{}' {}", k > 0 ? ", " : "", texts[k], k);
    return "(" + list + ")";
}

/// A grid of coloured cells (Okabe and Ito's colours, distinguishable by the colour-blind) with words in
/// them.
io::Plot map_plot(const std::vector<BreakingCase>& cases, const std::vector<Method>& columns) {
    std::vector<std::string> left, top;
    for (const BreakingCase& c : cases) left.push_back(c.what);
    for (const Method& method : columns) top.emplace_back(method.name);
    io::Plot plot{"stability", "", 1180, static_cast<int>(110 + 58 * cases.size())};
    plot.commands =
        "set title 'What breaks which method: energy, farthest joint from the reference, processor time' "
        "font ',14'\n"
        "unset key\nunset colorbox\nset tics scale 0\nset border 0\n"
        "set palette maxcolors 7\n"
        "set palette defined (0 '#009E73', 1 '#F0E442', 2 '#E69F00', 3 '#56B4E9', 4 '#D55E00', 5 '#999999', "
        "6 '#CC79A7')\n"
        "set cbrange [-0.5:6.5]\nunset xtics\n";
    plot.commands +=
        fmt::format("set xrange [-0.5:{0}.5]\nset x2range [-0.5:{0}.5]\nset yrange [{1}.5:-0.5]\n",
                    columns.size() - 1, cases.size() - 1);
    plot.commands +=
        fmt::format("set x2tics {} font ',12'\nset ytics {} font ',12'\n", tics(top), tics(left));
    // Cells a little smaller than their place leave white lines between them.
    plot.commands +=
        "plot 'stability.csv' skip 1 using 2:1:(0.485):(0.47):6 with boxxyerror fillstyle solid noborder "
        "palette, \\\n"
        "     '' skip 1 using 2:($1-0.26):5 with labels font ',12', \\\n"
        "     '' skip 1 using 2:($1+0.04):16 with labels font ',9', \\\n"
        "     '' skip 1 using 2:($1+0.29):17 with labels font ',9'\n";
    plot.caption =
        "What breaks which method: outcome, energy at the end, farthest joint from the reference, processor "
        "time. The scene of each case, with N, λ, EI and k, is in stability.md.";
    return plot;
}

}  // namespace

StudyResult run_stability(const StudyOptions& options) {
    const std::vector<BreakingCase> cases = breaking_cases(options);
    const std::vector<Method> columns = methods();
    const int rows = static_cast<int>(cases.size()), count = rows * static_cast<int>(columns.size());
    std::vector<StabilityReference> references(cases.size());
    std::vector<StabilityCell> cells(static_cast<std::size_t>(count));
    std::mutex telling;
    int done = 0;
    const auto show = [&](const std::string& what) {
        const std::lock_guard lock(telling);
        ++done;
        if (options.progress) options.progress({done, rows + count, what});
    };
    geometry::for_each_index(rows, options.threads, [&](int r) {
        references[r] = find_reference(cases[r]);
        show(cases[r].what + ", reference");
    });
    // The longest come first, so that no thread is left with one at the end.
    std::vector<int> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), 0);
    const auto effort = [&](int index) {
        const BreakingCase& c = cases[index / columns.size()];
        return static_cast<double>(c.cycles) * std::pow(c.start.segments(), 3);
    };
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return effort(a) > effort(b); });
    geometry::for_each_index(count, options.threads, [&](int k) {
        const int index = order[k];
        const BreakingCase& c = cases[index / columns.size()];
        const Method& method = columns[index % columns.size()];
        cells[index] = run_cell(c, references[index / columns.size()], method.config);
        show(fmt::format("{}, {}", c.what, method.name));
    });

    StudyResult result;
    result.tables = {numbers_table(cases, references, columns, cells)};
    result.plots = {map_plot(cases, columns)};
    result.page = page(cases, references, map_table(cases, references, columns, cells), options.quick);
    return result;
}

}  // namespace studies
