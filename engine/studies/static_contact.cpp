#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "engine/studies/claims.h"
#include "engine/studies/paper.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/work.h"
#include "physics/relax/segment_relaxer.h"
#include "physics/wire/bending.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using physics::Guidewire;

/// Which terms of Eq. 17 are kept.
struct Case {
    const char* name;
    const char* what;
    int varied_segments;
    bool bending, wall;
};
constexpr std::array<Case, 6> case_table = {{{"a", "A and R, M = 1", 1, true, true},
                                             {"b", "neither, M = 1", 1, false, false},
                                             {"c", "R alone, M = 1", 1, false, true},
                                             {"d", "A alone, M = 1", 1, true, false},
                                             {"e2", "A and R, M = 2", 2, true, true},
                                             {"e3", "A and R, M = 3", 3, true, true}}};

/// What happens to a wire at rest under further updates.
struct Unrest {
    std::vector<double> contact;  // [i]: share of the updates after which joint i touches
    std::vector<double> turn;     // [i]: mean |ε_i| of the updates that vary segment i [-]
    double mean_turn = 0;         // of all

    /// Number of joints that touch at some time, and of those that then leave.
    int touched() const {
        return static_cast<int>(
            std::count_if(contact.begin(), contact.end(), [](double c) { return c > 0; }));
    }
    int bounced() const {
        return static_cast<int>(
            std::count_if(contact.begin(), contact.end(), [](double c) { return c > 0 && c < 1; }));
    }
};

Unrest watch(const PaperScene& scene, Guidewire wire, const Case& c, int settle_cycles, int cycles) {
    physics::RelaxerConfig config = paper_method(c.varied_segments).config;
    config.bending_curvature = c.bending;
    config.wall_curvature = c.wall;
    physics::SegmentRelaxer relaxer(config, *scene.wall);
    const int n = wire.segments();
    relaxer.relax(wire, physics::whole_cycles(n, settle_cycles));
    std::vector<physics::WallContact> contacts = physics::all_contacts(wire, *scene.wall);
    std::vector<geometry::Vec3> before = wire.tangents;
    std::vector<long long> touching(contacts.size()), varied(contacts.size());
    Unrest unrest{std::vector<double>(contacts.size()), std::vector<double>(contacts.size())};
    const auto report =
        relaxer.relax(wire, physics::whole_cycles(n, cycles), [&](int first, const Guidewire& now) {
            for (const int i : relaxer.last_varied()) {
                unrest.turn[i] += (now.tangents[i] - before[i]).norm();
                before[i] = now.tangents[i];
                ++varied[i];
            }
            scene.wall->contacts(std::span(now.joints).subspan(first), std::span(contacts).subspan(first));
            for (int i = 1; i <= n; ++i) touching[i] += contacts[i].touches();
        });
    double sum = 0;
    long long all = 0;
    for (int i = 1; i <= n; ++i) {
        sum += unrest.turn[i];
        all += varied[i];
        unrest.turn[i] = varied[i] > 0 ? unrest.turn[i] / static_cast<double>(varied[i]) : 0.0;
        // A relaxer that has come to rest stops: joints in contact then remain so.
        unrest.contact[i] = report.updates > 0 ? static_cast<double>(touching[i]) / report.updates
                                               : static_cast<double>(contacts[i].touches());
    }
    unrest.mean_turn = all > 0 ? sum / static_cast<double>(all) : 0.0;
    return unrest;
}

/// Traces of R and A at rest.
struct Traces {
    std::vector<double> wall;   // [i]: Tr R₍i,N₎ [N·mm]
    double bending = 0;         // mean Tr A_i [N·mm]
    double bending_spread = 0;  // (largest − least) / mean, without the last segment
    double mean_wall = 0;
};

Traces traces_of(const PaperScene& scene, const Guidewire& wire) {
    const int n = wire.segments();
    const auto contacts = physics::all_contacts(wire, *scene.wall);
    const auto directors = physics::directors(wire);
    std::vector<double> torque;
    physics::tip_torque(wire, directors, torque);
    Traces traces;
    traces.wall.assign(static_cast<std::size_t>(n) + 1, 0.0);
    double sum = 0, least = 1e300, largest = 0;
    for (int i = n; i >= 1; --i) {
        const double lambda = wire.lengths[i];
        traces.wall[i] = i < n ? traces.wall[i + 1] : 0.0;
        if (contacts[i].touches()) traces.wall[i] += lambda * lambda * contacts[i].stiffness;
        const double trace = physics::bending_terms(wire, directors, torque, i).curvature.trace();
        traces.bending += trace / n;
        traces.mean_wall += traces.wall[i] / n;
        sum += trace;
        if (i == n) continue;
        least = std::min(least, trace);
        largest = std::max(largest, trace);
    }
    traces.bending_spread = (largest - least) / (sum / n);
    return traces;
}

std::vector<int> touching_joints(const Unrest& unrest) {
    std::vector<int> list;
    for (std::size_t i = 1; i < unrest.contact.size(); ++i)
        if (unrest.contact[i] > 0) list.push_back(static_cast<int>(i));
    return list;
}

/// Of the joints that touch in `a` or `b`, the share that touches in both.
double common_part(const Unrest& a, const Unrest& b) {
    const auto of_a = touching_joints(a), of_b = touching_joints(b);
    std::vector<int> both, either;
    std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), std::back_inserter(both));
    std::set_union(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), std::back_inserter(either));
    return either.empty() ? 1.0 : static_cast<double>(both.size()) / static_cast<double>(either.size());
}

/// Of the joints that touch in `a`, the share that also touches in `b`.
double kept_part(const Unrest& a, const Unrest& b) {
    const auto of_a = touching_joints(a), of_b = touching_joints(b);
    const auto kept = std::count_if(of_a.begin(), of_a.end(),
                                    [&](int i) { return std::binary_search(of_b.begin(), of_b.end(), i); });
    return of_a.empty() ? 1.0 : static_cast<double>(kept) / static_cast<double>(of_a.size());
}

/// Fig. 12: a joint at x held by a bent wire, c/2 (x − x_b)², and by the wall.
struct Joint1D {
    double stiffness = 42;  // k [N/mm]
    double bending = 21;    // c [N/mm]
    double at = 0.1;        // x_b, where the wire alone would have it [mm]

    double second_order_minimum() const { return bending * at / (bending + stiffness); }
    double first_order_minimum(double x0) const { return at - stiffness * x0 / bending; }
    double near() const { return 0.5 * second_order_minimum(); }  // x_a: the first order overshoots it
    double deep() const { return 2 * second_order_minimum(); }    // x_b: and ejects it from the wall
};

io::Table energies_table(const Joint1D& j) {
    io::Table table{"static_contact_energies",
                    {"x_mm", "wall_second_order_N_mm", "wall_first_order_near_N_mm",
                     "wall_first_order_deep_N_mm", "bending_N_mm", "total_second_order_N_mm",
                     "total_first_order_near_N_mm", "total_first_order_deep_N_mm"},
                    {}};
    for (int i = -40; i <= 140; ++i) {
        const double x = 0.001 * i, bending = 0.5 * j.bending * (x - j.at) * (x - j.at);
        const double second = x > 0 ? 0.5 * j.stiffness * x * x : 0.0,
                     near = x > 0 ? j.stiffness * j.near() * x : 0.0,
                     deep = x > 0 ? j.stiffness * j.deep() * x : 0.0;
        table.add({x, second, near, deep, bending, bending + second, bending + near, bending + deep});
    }
    return table;
}

io::Plot energies_plot(const Joint1D& j) {
    io::Plot plot{"static_contact_energies", "", 1000, 720};
    plot.commands =
        "set multiplot layout 2,2\nset grid lc rgb '#dddddd'\nset xlabel 'x [mm], > 0 in the wall'\nset "
        "ylabel 'energy [N·mm]'\n"
        "set xrange [-0.04:0.14]\nset key top left\n"
        "set arrow 1 from 0, graph 0 to 0, graph 0.62 nohead lc rgb '#999999'\n"
        "set title '(a) wall alone'\nset yrange [-0.05:0.45]\n"
        "plot 'static_contact_energies.csv' skip 1 using 1:2 with lines lw 2 lc rgb '#D55E00' title 'second "
        "order', \\\n"
        "     '' skip 1 using 1:3 with lines lw 2 lc rgb '#009E73' title 'first order, x_0 small', \\\n"
        "     '' skip 1 using 1:4 with lines lw 2 lc rgb '#0072B2' title 'first order, x_0 large'\nset "
        "yrange [*:*]\n";
    const auto panel = [&](char letter, const char* title, int column, const char* colour, double minimum,
                           double from) {
        std::string text = fmt::format("set title '({}) {}'\n", letter, title);
        text +=
            fmt::format("set arrow 2 from {0:.6f}, graph 0 to {0:.6f}, graph 0.62 nohead dt 2 lc rgb '{1}'\n",
                        minimum, colour);
        if (from > 0)
            text += fmt::format(
                "set arrow 3 from {0:.6f}, graph 0 to {0:.6f}, graph 0.62 nohead dt 3 lc rgb 'black'\n",
                from);
        text += fmt::format(
            "plot 'static_contact_energies.csv' skip 1 using 1:5 with lines lc rgb '#CC79A7' title 'bending "
            "alone', \\\n     '' skip 1 using 1:{} with lines lw 2 lc rgb '{}' title 'bending and wall'",
            column, colour);
        text += fmt::format(
            ", \\\n     -1 with lines dt 2 lc rgb '{}' title 'where the model has its minimum'", colour);
        if (from > 0) text += ", \\\n     -1 with lines dt 3 lc rgb 'black' title 'x_0'";
        return text + "\nunset arrow 2\nunset arrow 3\n";
    };
    plot.commands += "set yrange [0:0.8]\n";
    plot.commands +=
        panel('b', "second order", 6, "#D55E00", j.second_order_minimum(), 0) +
        panel('c', "first order from a small x_0", 7, "#009E73", j.first_order_minimum(j.near()), j.near()) +
        panel('d', "first order from a large x_0", 8, "#0072B2", j.first_order_minimum(j.deep()), j.deep()) +
        "unset multiplot\n";
    plot.caption = fmt::format(
        "Energy of one joint at depth x in the wall (the paper's Fig. 12): k = {:g} N/mm, a wire that bends "
        "as a spring of "
        "{:g} N/mm and would have the joint at {:g} mm. The minimum of the second order does not depend on "
        "x_0; that of "
        "the first overshoots to either side.",
        j.stiffness, j.bending, j.at);
    return plot;
}

io::Plot contact_plot(const PaperScene& scene) {
    io::Plot plot{"static_contact", "", 1000, 760};
    plot.commands =
        "set multiplot layout 2,1\nset style fill solid 0.7 noborder\nset boxwidth 0.9\nset yrange [0:105]\n"
        "set ylabel 'in contact [% of updates]'\nset y2label 'mean |ε_i|'\nset logscale y2\n"
        "set ytics nomirror\nset y2tics format '10^{%L}'\nset key outside top horizontal\n"
        "set xrange [0:" +
        std::to_string(scene.segments() + 1) + "]\n";
    for (const int k : {0, 1}) {
        const char* name = case_table[k].name;
        plot.commands += fmt::format(
            "set title '({0}) {1}'\nset xlabel '{2}'\n"
            "plot 'static_contact.csv' skip 1 using (strcol(1) eq '{0}' ? $2 : 1/0):3 with boxes lc rgb "
            "'#D55E00' title "
            "'in contact', \\\n"
            "     '' skip 1 using (strcol(1) eq '{0}' && $4 > 0 ? $2 : 1/0):4 axes x1y2 with lines lc rgb "
            "'black' title "
            "'mean |ε_i|'\n",
            name, k == 0 ? "with A and R" : "without A and R", k == 1 ? "joint i" : "");
    }
    plot.commands += "unset multiplot\n";
    plot.caption = fmt::format(
        "How long each joint of a wire at rest touches the wall, and the mean size of an update (the "
        "paper's Fig. 11): {}, M = 1.",
        scene.text());
    return plot;
}

std::vector<Claim> claims(const std::vector<Unrest>& all, const Traces& traces, const Joint1D& joint) {
    const Unrest &a = all[0], &b = all[1], &c = all[2], &d = all[3];
    std::vector<Claim> list;
    const auto add = [&](const std::string& text, io::TableCell published, io::TableCell measured, bool holds,
                         const std::string& note) {
        list.push_back({text, std::move(published), std::move(measured), holds, note});
    };
    const auto bounced = [&](int k) { return static_cast<double>(all[k].bounced()); };
    add("Fig. 11a: with A and R joints in contact stay so: joints that leave the wall", 0.0, bounced(0),
        a.bounced() == 0, fmt::format("Of {} that touch.", a.touched()));
    add("Fig. 11b: without A and R joints bounce: joints that leave the wall", std::string("most"),
        bounced(1), b.bounced() > b.touched() / 2, fmt::format("Of {} that touch.", b.touched()));
    const double same = common_part(a, b);
    add("Fig. 11: nearly the same joints touch in (a) and (b): part in common", std::string("nearly all"),
        same, same > 0.75,
        fmt::format("Of the joints that touch in either; nearly all: three quarters. {:.0f} % of those of "
                    "(a) touch in "
                    "(b) at some time, and so do their neighbours as the wire bounces.",
                    100 * kept_part(a, b)));
    const double ratio = a.mean_turn / b.mean_turn;
    add("Fig. 11: mean |ε| in (a) over that in (b)", 1e-7, ratio, ratio > 1e-8 && ratio < 1e-6,
        fmt::format(
            "Mean |ε| is {:.1e} and {:.1e}. Holds within a factor of 10. That of (a) falls with every cycle, "
            "and how many the published wire had made is not published.",
            a.mean_turn, b.mean_turn));
    const double c_ratio = c.mean_turn / a.mean_turn;
    add("Section 3.3 (c): R alone is like (a): part of touching joints in common; mean |ε| over that of (a)",
        std::string("the same; comparable"), fmt::format("{:.2f}; {:.2g}", common_part(a, c), c_ratio),
        common_part(a, c) > 0.95 && c_ratio > 0.1 && c_ratio < 10,
        fmt::format("{} joints leave the wall.", c.bounced()));
    const double d_ratio = d.mean_turn / b.mean_turn;
    add("Section 3.3 (d): A alone is almost identical to (b): part of touching joints in common; mean |ε| "
        "over that of (b)",
        std::string("almost identical"), fmt::format("{:.2f}; {:.2g}", common_part(b, d), d_ratio),
        common_part(b, d) > 0.75 && d_ratio > 0.5 && d_ratio < 2,
        fmt::format("{} joints leave the wall.", d.bounced()));
    add("Section 3.3 (e): M = 2 and M = 3 with A and R give the same as (a): joints that leave the wall", 0.0,
        bounced(4) + bounced(5), bounced(4) + bounced(5) == 0,
        fmt::format(
            "Part of touching joints in common with (a): {:.2f} and {:.2f}; mean |ε| {:.1e} and {:.1e}.",
            common_part(a, all[4]), common_part(a, all[5]), all[4].mean_turn, all[5].mean_turn));
    add("Section 3.3: Tr A does not depend on i: largest less least, over the mean", 0.0,
        traces.bending_spread, traces.bending_spread < 0.01,
        "The last segment aside, which has one neighbour.");
    const int n = static_cast<int>(traces.wall.size()) - 1;
    const double ends = traces.wall[n] > 0 ? traces.wall[1] / traces.wall[n] : std::nan("");
    add(fmt::format("Section 3.3: Tr R of the first segment over that of the last, {}", n), 18.0, ends,
        std::abs(ends / 18 - 1) < 0.1,
        traces.wall[n] > 0
            ? "The number of contacts, which is the tube's: 18 on the paper's wire. Holds within a tenth."
            : "The last joint does not touch here, so that R of the last segment is zero.");
    const double dominance = traces.mean_wall / traces.bending;
    add("Section 3.3: mean Tr R over Tr A", 22.7, dominance, std::abs(dominance / 22.7 - 1) < 0.1,
        "As many as there are contacts, which is the tube's, and in proportion to k, which is not published. "
        "Holds within a "
        "tenth.");
    add("Fig. 12b: the minimum of the second order lies in the wall, at any x0 [mm]", std::string("> 0"),
        joint.second_order_minimum(), joint.second_order_minimum() > 0, "");
    add("Fig. 12c: from a small x0 the first order's minimum is deeper than x0: minimum and x0 [mm]",
        std::string("minimum > x0"),
        fmt::format("{:.4f}, {:.4f}", joint.first_order_minimum(joint.near()), joint.near()),
        joint.first_order_minimum(joint.near()) > joint.near(), "");
    add("Fig. 12d: from a large x0 the first order's minimum is out of the wall [mm]", std::string("< 0"),
        joint.first_order_minimum(joint.deep()), joint.first_order_minimum(joint.deep()) < 0, "");
    return list;
}

}  // namespace

StudyResult run_static_contact(const StudyOptions& options) {
    const PaperScene scene = paper_scene("sinuous", {options.quick ? 60 : 0, 0, 0});
    const int settle = options.quick ? 10 : 100, cycles = options.quick ? 5 : 20;
    Work work(options, 1 + static_cast<int>(case_table.size()));
    Rest rest;
    work.run(1, [&](int) {
        rest = paper_rest(scene, options.quick ? 60 : 200);
        return std::string("reference");
    });
    std::vector<Unrest> all(case_table.size());
    work.run(static_cast<int>(case_table.size()), [&](int k) {
        all[k] = watch(scene, rest.wire, case_table[k], settle, cycles);
        return fmt::format("({}) {}", case_table[k].name, case_table[k].what);
    });
    const Traces traces = traces_of(scene, rest.wire);
    const Joint1D joint;

    StudyResult result;
    io::Table joints{
        "static_contact", {"case", "joint", "in_contact_percent", "mean_update", "trace_R_N_mm"}, {}};
    io::Table cases{
        "static_contact_cases", {"case", "terms", "joints_touching", "joints_bouncing", "mean_update"}, {}};
    for (std::size_t k = 0; k < all.size(); ++k) {
        for (std::size_t i = 1; i < all[k].contact.size(); ++i)
            joints.add({std::string(case_table[k].name), static_cast<double>(i), 100 * all[k].contact[i],
                        all[k].turn[i], traces.wall[i]});
        cases.add({std::string(case_table[k].name), std::string(case_table[k].what),
                   static_cast<double>(all[k].touched()), static_cast<double>(all[k].bounced()),
                   all[k].mean_turn});
    }
    result.claims = claims(all, traces, joint);
    result.plots = {contact_plot(scene), energies_plot(joint)};
    result.page = claims_page("static-contact", "Which terms keep a wire at rest in touch with the wall",
                              fmt::format("{}: the wire after {} cycles with M = 2, where the largest "
                                          "gradient over C is {:.1e}. From there each "
                                          "case, without safeguard, makes {} cycles unobserved and {} that "
                                          "are watched, update by update. The "
                                          "mean trace of R is {:.4g} N·mm, that of A {:.4g} N·mm.\n\n{}",
                                          scene.text(), options.quick ? 60 : 200, rest.gradient, settle,
                                          cycles, traces.mean_wall, traces.bending, io::to_markdown(cases)),
                              result, options);
    result.tables = {std::move(joints), std::move(cases), energies_table(joint)};
    return result;
}

}  // namespace studies
