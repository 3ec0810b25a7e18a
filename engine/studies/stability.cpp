#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

#include "engine/studies/runs.h"
#include "engine/studies/stability_cell.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
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
                     "gradient", "max_penetration_mm", "updates", "cpu_s", "energy", "figures"}};
    for (std::size_t r = 0; r < cases.size(); ++r) {
        for (std::size_t k = 0; k < columns.size(); ++k) {
            const StabilityCell& cell = cells[r * columns.size() + k];
            const CellMeasure& m = cell.measure;
            table.add({r, k, cases[r].what, columns[k].name, outcome_text(cell.outcome),
                       static_cast<int>(cell.outcome), cell.energy, references[r].energy,
                       references[r].gradient, m.deviation, m.basin_deviation, m.gradient, m.penetration,
                       cell.updates, cell.cpu, m.finite ? energy_text(cell.energy) : std::string(),
                       figures(cell)});
        }
    }
    return table;
}

io::Table map_table(const std::vector<BreakingCase>& cases, const std::vector<StabilityReference>& references,
                    const std::vector<Method>& columns, const std::vector<StabilityCell>& cells) {
    io::Table table{"stability_map", {"what breaks methods", "reference"}};
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
    std::string text;
    for (std::size_t r = 0; r < cases.size(); ++r) {
        const BreakingCase& c = cases[r];
        text += fmt::format("\n- **{}**: {} {} cycles of work. {}.", c.what, c.how, c.cycles, numbers_of(c));
        if (references[r].gradient > rules.gradient)
            text += fmt::format(" The reference itself stops at a gradient over C of {:.1e}.",
                                references[r].gradient);
    }
    return filled_text("stability", {{"quick", quick ? " --quick" : ""},
                                     {"map", io::to_markdown(map)},
                                     {"outside", rules.outside},
                                     {"times_reference", rules.times_reference},
                                     {"gradient", rules.gradient},
                                     {"basin", rules.basin},
                                     {"samples", rules.samples},
                                     {"rise", rules.rise},
                                     {"stuck", rules.stuck},
                                     {"cases", text}}) +
           "\n";
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
    return filled_plot("stability", 1180, static_cast<int>(110 + 58 * cases.size()),
                       {{"last_method", columns.size() - 1},
                        {"last_case", cases.size() - 1},
                        {"methods", tics(top)},
                        {"cases", tics(left)}});
}

}  // namespace

StudyResult run_stability(const StudyOptions& options) {
    const std::vector<BreakingCase> cases = breaking_cases(options);
    const std::vector<Method> columns = methods();
    const int rows = static_cast<int>(cases.size()), count = rows * static_cast<int>(columns.size());
    std::vector<StabilityReference> references(cases.size());
    std::vector<StabilityCell> cells(static_cast<std::size_t>(count));
    Work work(options, rows + count);
    work.run(rows, [&](int r) {
        references[r] = find_reference(cases[r]);
        return cases[r].what + ", reference";
    });
    // The longest come first, so that no thread is left with one at the end.
    std::vector<int> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), 0);
    const auto effort = [&](int index) {
        const BreakingCase& c = cases[index / columns.size()];
        return static_cast<double>(c.cycles) * std::pow(c.start.segments(), 3);
    };
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return effort(a) > effort(b); });
    work.run(count, [&](int k) {
        const int index = order[k];
        const BreakingCase& c = cases[index / columns.size()];
        const Method& method = columns[index % columns.size()];
        cells[index] = run_cell(c, references[index / columns.size()], method.config);
        return fmt::format("{}, {}", c.what, method.name);
    });

    StudyResult result;
    result.tables = {numbers_table(cases, references, columns, cells)};
    result.plots = {map_plot(cases, columns)};
    result.page = page(cases, references, map_table(cases, references, columns, cells), options.quick);
    return result;
}

}  // namespace studies
