#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "engine/io/cpu_clock.h"
#include "engine/studies/accuracy_cases.h"
#include "engine/studies/claims.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/quantile.h"
#include "engine/studies/runs.h"
#include "engine/studies/work.h"
#include "physics/relax/relaxer.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using physics::EndCells;

constexpr std::array rule_table = {EndCells::Half, EndCells::Paper};

std::string word(EndCells ends) {
    return ends == EndCells::Half ? "half" : "paper";
}

/// Slope of log error over log λ through the finest three, by least squares [-]; none where rounding
/// dominates.
double order_of(const std::vector<double>& lambdas, const std::vector<double>& errors) {
    const std::size_t n = lambdas.size(), from = n - 3;
    if (*std::max_element(errors.begin(), errors.end()) < 1e-6)
        return std::numeric_limits<double>::quiet_NaN();
    double x = 0, y = 0, xx = 0, xy = 0;
    for (std::size_t i = from; i < n; ++i) {
        const double a = std::log(lambdas[i]), b = std::log(errors[i]);
        x += a / 3, y += b / 3, xx += a * a / 3, xy += a * b / 3;
    }
    return (xy - x * y) / (xx - x * x);
}

struct Order {
    std::string id, quantity;
    EndCells ends;
    double order = 0;
};

/// A method compared in the bent tube, with the rule for the ends that it uses there.
struct Contender {
    std::string name;
    physics::RelaxerConfig config;
    EndCells ends = EndCells::Paper;
    std::string look;
};

std::vector<Contender> contenders() {
    std::vector<Contender> list = {
        {"global (half cells)", {}, EndCells::Half, "lc rgb '#D55E00' lw 2 pt 7"},
        {"global (clamp of the paper)", {}, EndCells::Paper, "lc rgb '#D55E00' dt 2 pt 6"}};
    physics::RelaxerConfig first;
    first.kind = physics::RelaxerKind::FirstOrder;
    list.push_back({"first order", first, EndCells::Paper, "lc rgb '#999999' pt 4"});
    for (int m = 1; m <= 3; ++m) {
        const NamedMethod method = paper_method(m);
        list.push_back(
            {method.name, method.config, EndCells::Paper, method.look + fmt::format(" pt {}", 4 + 2 * m)});
    }
    return list;
}

struct Cost {
    double cpu = 0, farthest = 0;  // [s], [mm]
};

Cost cost_of(const ExactCase& c, const Contender& contender, int segments, int cycles) {
    const bool global = contender.config.kind == physics::RelaxerKind::Global;
    std::vector<double> times;
    Cost cost;
    for (int k = 0; k < (global ? 9 : 1); ++k) {
        ExactStart s = c.set(segments, contender.ends);
        const auto relaxer = physics::make_relaxer(contender.config, *s.wall);
        const double start = io::thread_cpu_seconds();
        relaxer->relax(s.start, global ? physics::RelaxBudget{1'000'000'000, 0, 0}
                                       : physics::whole_cycles(segments, cycles));
        times.push_back(io::thread_cpu_seconds() - start);
        cost.farthest = c.measure(s.start, *s.wall)[1].measured;
    }
    cost.cpu = quantile(times, 0.5);
    return cost;
}

io::Plot picture(const std::vector<ExactCase>& cases, const std::vector<Contender>& list, int cycles) {
    io::Plot plot{"accuracy", "", 1300, 780};
    plot.commands =
        "set multiplot layout 1,2\nset logscale xy\nset format y '10^{%L}'\nset grid lc rgb '#cccccc'\n"
        "set bmargin 18\nset key below left Left reverse maxrows 8 samplen 3 width -2\n"
        "set title 'Error against the length of the segments'\nset xlabel 'λ [mm]'\n"
        "set ylabel 'error over what is exact, of places over the length of the wire'\n"
        "set xrange [0.08:5]\nset yrange [3e-9:1]\nset xtics (0.1, 0.2, 0.5, 1, 2, 4)\nplot ";
    for (const ExactCase& c : cases)
        for (const EndCells ends : rule_table) {
            if (ends == EndCells::Paper && !c.has_ends) continue;
            const bool half = ends == EndCells::Half;
            plot.curve(fmt::format(
                "'accuracy.csv' skip 1 using (strcol(1) eq '{}' && strcol(2) eq '{}' && strcol(3) eq '{}' ? "
                "$5 : 1/0):8 with linespoints {} {} {}",
                c.id, c.headline, word(ends), c.look, half ? "pt 7 ps 0.8 lw 2" : "pt 6 ps 0.8 dt '- '",
                half ? fmt::format("title '{}'", c.title) : std::string("notitle")));
        }
    plot.curve(
        "(x > 0.3 && x < 3 ? 4e-8*x**2 : 1/0) with lines lc rgb 'black' title 'full lines: half cells; black "
        "∝ λ²', \\\n     (x > 0.3 && x < 3 ? 0.2*x : 1/0) with lines lc rgb 'black' dt '- ' title 'broken: "
        "clamp of the paper; black ∝ λ'\n"
        "set title 'Wire through a bent tube: error against processor time'\n"
        "set xlabel 'processor time from the axis of the tube to where the method stops [s]'\n"
        "set ylabel 'farthest joint from the exact curve [mm]'\nset format x '10^{%L}'\nset xtics auto\n"
        "set autoscale x\nset yrange [2e-5:10]\nplot ");
    for (const Contender& c : list)
        plot.curve(fmt::format(
            "'accuracy_cost.csv' skip 1 using (strcol(1) eq '{0}' ? $6 : 1/0):7 with linespoints {1} ps 0.9 "
            "title '{0}'",
            c.name, c.look));
    plot.curve(fmt::format(
        "'accuracy_cost.csv' skip 1 using (strcol(1) eq '{0}' ? $6 : 1/0):7:(sprintf('%g mm', $4)) with "
        "labels left offset 0.8,0.4 font ',9' notitle\nunset multiplot\n",
        list.front().name));
    plot.caption = fmt::format(
        "Left: error of the chain of segments against the exact wire (helix and arc are looked at far from "
        "the ends, where both rules are the same). Right: the wire through the bent tube, a point for each "
        "λ, from 4 mm at the left of a line halved from point to point; the global method to rest, the "
        "paper's methods with the paper's clamp for {} cycles. Down and to the left is better.",
        cycles);
    return plot;
}

}  // namespace

StudyResult run_accuracy(const StudyOptions& options) {
    const int cycles = options.quick ? 20 : 200;
    const std::vector<ExactCase> cases = exact_cases();
    const std::vector<Contender> list = contenders();
    const ExactCase& raced = cases[1];
    const int lengths = options.quick ? 3 : 5;  // of segments, in the comparison
    struct Found {
        std::vector<AgainstExact> measured;
        double gradient = 0;
        int contacts = 0;
    };
    const int sizes = static_cast<int>(cases.front().segments.size()),
              rules = static_cast<int>(rule_table.size());
    const int rests = static_cast<int>(cases.size()) * rules * sizes,
              races = static_cast<int>(list.size()) * lengths;
    Work work(options, rests + races);
    std::vector<Found> results(static_cast<std::size_t>(rests));
    work.run(rests, [&](int k) {
        const ExactCase& c = cases[k / (rules * sizes)];
        const EndCells ends = rule_table[k / sizes % rules];
        const int n = c.segments[k % sizes];
        ExactStart s = c.set(n, ends);
        bring_to_rest(s.start, *s.wall);
        const auto contacts = physics::all_contacts(s.start, *s.wall);
        const auto touching =
            std::count_if(contacts.begin(), contacts.end(), [](const auto& x) { return x.touches(); });
        results[k] = {c.measure(s.start, *s.wall), physics::relative_gradient(s.start, contacts),
                      static_cast<int>(touching)};
        return fmt::format("{}, {}, N = {}", c.id, word(ends), n);
    });
    std::vector<Cost> costs(static_cast<std::size_t>(races));
    work.run(races, [&](int k) {
        const Contender& contender = list[k / lengths];
        const int n = raced.segments[k % lengths];
        costs[k] = cost_of(raced, contender, n, cycles);
        return fmt::format("{}, N = {}", contender.name, n);
    });

    io::Table errors{"accuracy",
                     {"case", "quantity", "clamp", "segments", "segment_length_mm", "exact", "measured",
                      "relative_error", "contacts", "gradient"}};
    io::Table orders{"accuracy_orders",
                     {"case", "quantity", "clamp", "order", "error_at_1_mm", "finest_error"}};
    std::vector<Order> found;
    const double none = std::numeric_limits<double>::quiet_NaN();
    double at_rest = 0, force_half = none, force_paper = none, tip_200 = none;
    for (int c = 0; c < static_cast<int>(cases.size()); ++c)
        for (int r = 0; r < rules; ++r) {
            const ExactCase& now = cases[c];
            const Found* first = &results[(c * rules + r) * sizes];
            for (std::size_t q = 0; q < first->measured.size(); ++q) {
                std::vector<double> lambdas, off;
                double at_one = none;
                for (int k = 0; k < sizes; ++k) {
                    const AgainstExact& m = first[k].measured[q];
                    lambdas.push_back(now.length / now.segments[k]);
                    off.push_back(m.error);
                    at_rest = std::max(at_rest, first[k].gradient);
                    const bool place = m.quantity == "tip" || m.quantity == "farthest joint";
                    errors.add({now.id, m.quantity, word(rule_table[r]), now.segments[k], lambdas.back(),
                                place ? none : m.exact, m.measured, m.error, first[k].contacts,
                                first[k].gradient});
                    if (lambdas.back() == 1) at_one = m.error;
                    if (now.id == "large load" && m.quantity == "tip" && now.segments[k] == 200 && r == 0)
                        tip_200 = m.error;
                }
                const std::string& quantity = first->measured[q].quantity;
                if (now.id == "wall" && quantity == "force") (r == 0 ? force_half : force_paper) = at_one;
                found.push_back({now.id, quantity, rule_table[r], order_of(lambdas, off)});
                orders.add({now.id, quantity, word(rule_table[r]), found.back().order, at_one, off.back()});
            }
        }
    io::Table race{
        "accuracy_cost",
        {"method", "clamp", "segments", "segment_length_mm", "cycles", "cpu_s", "farthest_joint_mm"}};
    for (int k = 0; k < races; ++k) {
        const Contender& contender = list[k / lengths];
        const int n = raced.segments[k % lengths];
        const bool global = contender.config.kind == physics::RelaxerKind::Global;
        race.add({contender.name, word(contender.ends), n, raced.length / n,
                  global ? none : static_cast<double>(cycles), costs[k].cpu, costs[k].farthest});
    }

    StudyResult result;
    const std::string how = "slope of log error over log λ through the three finest λ";
    for (const Order& o : found) {
        const ExactCase& c =
            *std::find_if(cases.begin(), cases.end(), [&](const ExactCase& x) { return x.id == o.id; });
        if (o.quantity != c.headline || (!c.has_ends && o.ends == EndCells::Paper)) continue;
        const bool half = o.ends == EndCells::Half;
        result.claim(fmt::format("order in λ of the {} ({}), {}", c.headline, c.id,
                                 !c.has_ends ? "far from the ends"
                                 : half      ? "half cells"
                                             : "the paper's clamp"),
                     half ? 2.0 : 1.0, o.order, std::abs(o.order - (half ? 2 : 1)) <= 0.1, how);
    }
    result.claim("force of a clamped wire on a wall at λ = 1 mm, half cells, off by [%]", 0.12,
                 100 * force_half, 100 * force_half <= 0.12 * 1.1,
                 "20 mm of wire; it goes as the square of λ over the wire's length");
    result.claim("force of a clamped wire on a wall at λ = 1 mm, the paper's clamp, off by [%]", 6.9,
                 100 * force_paper, std::abs(100 * force_paper - 6.9) < 0.7,
                 "20 mm of wire; it goes as λ over the wire's length");
    result.claim("tip of a wire under a large load at N = 200, half cells, off by [L]", 2e-5, tip_200,
                 tip_200 <= 2e-5 * 1.1, "the tip sinks by half the wire's length");
    result.plots = {picture(cases, list, cycles)};

    std::string introduction =
        "A wire is a chain of straight segments with a spring at each joint. Here it is held to the exact "
        "wire, the elastica, in cases where that is known: from closed forms, or by integrating its "
        "differential equations (shooting, Runge and Kutta's fourth order in 4000 and 8000 steps), which "
        "know nothing of the chain. With **half cells** the first and the last joint stand for half of their "
        "one segment, as all others stand for half of each of their two: EI/(λ/2) at the clamp, half a "
        "segment's load and wall at the tip. By the **paper's clamp** they stand for a whole one.\n";
    for (const ExactCase& c : cases) introduction += fmt::format("\n- **{}**: {}.", c.id, c.text);
    double residual = 0, step_error = 0;
    for (const ExactCase& c : cases)
        residual = std::max(residual, c.exact_residual),
        step_error = std::max(step_error, c.exact_step_error);
    introduction += fmt::format(
        "\n\nEI = {:g} N·mm² but for nested rods. The exact curves miss what the tip asks for by {:.0e} N·mm "
        "and N at most and move by {:.0e} mm when their steps are halved; the chains are at rest to a "
        "gradient over C of {:.0e}. A tip that alone meets a wall has the same stiffness by either rule and "
        "in the exact wire, {:g} N/mm on the flat wall and {:g} in the bent tube; helix and arc lie on {:g} "
        "N/mm for each mm of wire.\n\n{}",
        exact_rigidity, residual, step_error, at_rest, flat_stiffness, bent_stiffness, per_length,
        io::to_markdown(orders, 3));
    introduction += fmt::format(
        "\nErrors of places are over the length of the wire, all others over the exact number. Where no "
        "order is given the error is rounding: the wall of an arc balances its compression in a polygon "
        "too.\n\n### Processor time\n\nThe wire through the bent tube, from the tube's axis: the global "
        "method until it is at rest (the median of nine starts), the paper's methods for {} cycles; the "
        "paper takes a wire for at rest after 200, though fewer may do. A segment's length sets how near a "
        "method can come; the clamp, how fast it comes nearer as segments shrink.\n\n{}",
        cycles, io::to_markdown(race, 3));
    result.tables = {std::move(errors), std::move(orders), std::move(race)};
    result.page = claims_page("accuracy", "How exact is a wire of segments?", introduction, result, options);
    return result;
}

}  // namespace studies
