#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "engine/studies/claims.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/relax/segment_relaxer.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

/// Which terms of Eq. 17 are kept.
struct ContactCase {
    const char* name;
    const char* what;
    int varied_segments;
    bool bending, wall;
};
constexpr std::array<ContactCase, 6> case_table = {{{"a", "A and R, M = 1", 1, true, true},
                                                    {"b", "neither, M = 1", 1, false, false},
                                                    {"c", "R alone, M = 1", 1, false, true},
                                                    {"d", "A alone, M = 1", 1, true, false},
                                                    {"e2", "A and R, M = 2", 2, true, true},
                                                    {"e3", "A and R, M = 3", 3, true, true}}};

/// What happens to a wire at rest under further updates.
struct Unrest {
    std::vector<double> contact;  // [i]: fraction of the updates after which joint i touches
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

Unrest watch(const PaperScene& scene, Chain wire, const ContactCase& c, int settle_cycles, int cycles) {
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
        relaxer.relax(wire, physics::whole_cycles(n, cycles), [&](int first, const Chain& now) {
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
    double one = 0;  // Tr R of one joint in touch [N·mm]
};

Traces traces_of(const PaperScene& scene, const Chain& wire) {
    const SegmentTerms terms = segment_terms(scene, wire);
    const int n = wire.segments();
    Traces traces;
    traces.one = wire.lengths[n] * wire.lengths[n] * scene.stiffness;
    traces.wall.assign(static_cast<std::size_t>(n) + 1, 0.0);
    double least = 1e300, largest = 0;
    for (int i = 1; i <= n; ++i) {
        const double trace = terms.bending[i].trace();
        traces.wall[i] = terms.wall[i].trace();
        traces.bending += trace / n;
        traces.mean_wall += traces.wall[i] / n;
        if (i == n) continue;
        least = std::min(least, trace);
        largest = std::max(largest, trace);
    }
    traces.bending_spread = (largest - least) / traces.bending;
    return traces;
}

/// Of all time that joints of `b` are in contact, the fraction on joints at most `within` from one that
/// touches in `a`.
double time_near(const Unrest& a, const Unrest& b, int within) {
    const int n = static_cast<int>(a.contact.size()) - 1;
    double near = 0, all = 0;
    for (int i = 1; i <= n; ++i) {
        bool has = false;
        for (int j = std::max(1, i - within); j <= std::min(n, i + within); ++j)
            has = has || a.contact[j] > 0;
        all += b.contact[i];
        if (has) near += b.contact[i];
    }
    return all > 0 ? near / all : std::nan("");
}

/// Mean |ε| of the second and of the first order, from a wire relaxed for so many cycles with M varied
/// segments.
struct Calm {
    int varied_segments = 1, cycles = 0;
    double second = 0, first = 0;
    double ratio() const { return second / first; }
};

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
                     "total_first_order_near_N_mm", "total_first_order_deep_N_mm"}};
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
    return filled_plot("static_contact_energies", 1000, 720,
                       {{"stiffness", j.stiffness},
                        {"bending", j.bending},
                        {"at", j.at},
                        {"second", j.second_order_minimum()},
                        {"near", j.near()},
                        {"first_near", j.first_order_minimum(j.near())},
                        {"deep", j.deep()},
                        {"first_deep", j.first_order_minimum(j.deep())}});
}

io::Plot contact_plot(const PaperScene& scene) {
    return filled_plot("static_contact", 1000, 760,
                       {{"scene", scene.text()}, {"beyond_last", scene.segments() + 1}});
}

void claim(StudyResult& result, const std::vector<Unrest>& all, const Traces& traces, const Joint1D& joint,
           const std::vector<Calm>& calm, int usual_cycles, const Traces& sinuous) {
    const Unrest &a = all[0], &b = all[1], &c = all[2], &d = all[3];
    FigureClaims fig(result, "Fig. 11",
                     fmt::format("Mean |ε| falls with every cycle of the second order, so its ratio is taken "
                                 "after the {} cycles that the paper calls equilibrium (Section 3), with M = "
                                 "1 as in the figure; a joint counts by the time it touches.",
                                 usual_cycles));
    const auto bounced = [&](int k) { return static_cast<double>(all[k].bounced()); };
    fig.published("(a) with A and R joints in contact stay so: joints that leave the wall", 0.0, bounced(0),
                  a.bounced() == 0, "none leaves", fmt::format("Of {} that touch.", a.touched()));
    fig.published("(b) without A and R joints bounce: joints that leave the wall", "most", bounced(1),
                  b.bounced() > b.touched() / 2, "more than half of those that touch",
                  fmt::format("Of {} that touch.", b.touched()));
    const double near = time_near(a, b, 2);
    fig.published(
        "nearly the same joints touch in (a) and (b): share of the time in contact in (b) on joints at most "
        "two from one of (a)",
        "nearly all", near, near > 0.9, "more than 90 %",
        fmt::format("On the very joints of (a): {:.0f} %, within one: {:.0f} %.", 100 * time_near(a, b, 0),
                    100 * time_near(a, b, 1)));
    const auto after = [&](int varied, int cycles) {
        return *std::find_if(calm.begin(), calm.end(), [&](const Calm& each) {
            return each.varied_segments == varied && each.cycles == cycles;
        });
    };
    const Calm usual = after(1, usual_cycles);
    const double ratio = usual.ratio();
    fig.published(fmt::format("mean |ε| in (a) over that in (b), after {} cycles", usual_cycles), 1e-7, ratio,
                  ratio > 1e-8 && ratio < 1e-6, "within a factor of 10",
                  fmt::format("Mean |ε| is {:.1e} and {:.1e}. After half as many cycles the ratio is {:.1e}; "
                              "with M = 2 before, {:.1e}.",
                              usual.second, usual.first, after(1, usual_cycles / 2).ratio(),
                              after(2, usual_cycles).ratio()));
    FigureClaims terms(
        result, "Section 3.3",
        "Cases (c) to (e), which the paper describes without a figure, and the traces of R and A.");
    const double c_ratio = c.mean_turn / a.mean_turn;
    terms.published(
        "(c) R alone is like (a): time in contact on the joints of (a); mean |ε| over that of (a)",
        "the same; comparable", fmt::format("{:.2f}; {:.2g}", time_near(a, c, 0), c_ratio),
        time_near(a, c, 0) > 0.95 && c_ratio > 0.1 && c_ratio < 10 && c.bounced() == 0,
        "more than 95 %, within a factor of 10, and no joint leaves the wall",
        fmt::format("{} joints leave the wall.", c.bounced()));
    const double d_ratio = d.mean_turn / b.mean_turn;
    terms.published(
        "(d) A alone is almost identical to (b): time in contact within one joint; mean |ε| over that of (b)",
        "almost identical", fmt::format("{:.2f}; {:.2g}", time_near(b, d, 1), d_ratio),
        time_near(b, d, 1) > 0.95 && d_ratio > 0.5 && d_ratio < 2 && 2 * d.bounced() > d.touched(),
        "more than 95 %, within a factor of 2, and most joints bounce",
        fmt::format("{} of {} joints leave the wall.", d.bounced(), d.touched()));
    terms.published("(e) M = 2 and M = 3 with A and R give the same as (a): joints that leave the wall", 0.0,
                    bounced(4) + bounced(5), bounced(4) + bounced(5) == 0, "none leaves",
                    fmt::format("Mean |ε| {:.1e} and {:.1e}.", all[4].mean_turn, all[5].mean_turn));
    const int n = static_cast<int>(traces.wall.size()) - 1;
    const double ends = traces.wall[1] / traces.one;
    terms.published(
        "Tr R of the first segment over that of the last that a contact acts on", 18.0, ends,
        std::abs(ends / 18 - 1) < 0.1, "within a tenth",
        fmt::format("It is the number of contacts, which is the tube's; of sinuous {:g}. The last joint {}.",
                    sinuous.wall[1] / sinuous.one,
                    traces.wall[n] > 0 ? "touches" : "of the wire does not touch here"));
    const double dominance = traces.mean_wall / traces.bending;
    terms.published(
        "mean Tr R over Tr A", 22.7, dominance, std::abs(dominance / 22.7 - 1) < 0.1, "within a tenth",
        fmt::format("It grows with k, which is not published: 0.84 EI/λ³ here, from another argument. On "
                    "scene sinuous, whose {:g} contacts are not the published number, {:.3g}.",
                    sinuous.wall[1] / sinuous.one, sinuous.mean_wall / sinuous.bending));
    terms.add(ClaimKind::Identity, "Tr A does not depend on i: largest less least, over the mean", 0.0,
              traces.bending_spread, traces.bending_spread < 0.01,
              "below 0.01: C is the same for all segments",
              "The last segment aside, which has one neighbour.");
    terms.add(ClaimKind::Identity, "Tr R is larger for smaller i", "yes",
              std::is_sorted(traces.wall.rbegin(), traces.wall.rend() - 1) ? "yes" : "no",
              std::is_sorted(traces.wall.rbegin(), traces.wall.rend() - 1), "a sum of positive terms");
    FigureClaims model(result, "Fig. 12",
                       "One joint, a spring for the wire and one for the wall: x_a and x_b are chosen as "
                       "half and twice the minimum, so that these cannot fail.");
    model.add(ClaimKind::Identity, "(b) the minimum of the second order lies in the wall, at any x0 [mm]",
              "> 0", joint.second_order_minimum(), joint.second_order_minimum() > 0, "");
    model.add(ClaimKind::Identity,
              "(c) from a small x0 the first order's minimum is deeper than x0: minimum and x0 [mm]",
              "minimum > x0",
              fmt::format("{:.4f}, {:.4f}", joint.first_order_minimum(joint.near()), joint.near()),
              joint.first_order_minimum(joint.near()) > joint.near(), "");
    model.add(ClaimKind::Identity, "(d) from a large x0 the first order's minimum is out of the wall [mm]",
              "< 0", joint.first_order_minimum(joint.deep()), joint.first_order_minimum(joint.deep()) < 0,
              "");
}

io::Plot calm_plot(const PaperScene& scene, int usual_cycles) {
    return filled_plot("static_contact_ratio", 900, 420,
                       {{"scene", scene.text()}, {"usual_cycles", usual_cycles}});
}

}  // namespace

StudyResult run_static_contact(const StudyOptions& options) {
    const PaperScene scene = paper_scene("sharp", {.segments = options.quick ? 60 : 0});
    const int settle = options.quick ? 10 : 100, cycles = options.quick ? 5 : 20;
    const int usual_cycles = options.quick ? 20 : 200;
    std::vector<Calm> calm;
    for (const int varied : {1, 2})
        for (const int made : options.quick ? std::vector<int>{5, 10, 20, 30}
                                            : std::vector<int>{20, 40, 60, 80, 100, 130, 160, 200, 250, 300})
            calm.push_back({varied, made});
    Work work(options, 4 + static_cast<int>(case_table.size()) + static_cast<int>(calm.size()));
    Rest rest, sinuous_rest;
    std::vector<Chain> on_the_way(calm.size(), scene.start);
    const PaperScene sinuous = paper_scene("sinuous", {.segments = options.quick ? 60 : 0});
    work.run(4, [&](int k) {
        if (k == 0) rest = paper_rest(scene, options.quick ? 60 : 200);
        if (k == 1) sinuous_rest = paper_rest(sinuous, options.quick ? 60 : 200);
        if (k >= 2) {
            Chain wire = scene.start;
            const auto relaxer = physics::make_relaxer(paper_method(k - 1).config, *scene.wall);
            int made = 0;
            for (std::size_t c = 0; c < calm.size(); ++c) {
                if (calm[c].varied_segments != k - 1) continue;
                relaxer->relax(wire, physics::whole_cycles(wire.segments(), calm[c].cycles - made));
                made = calm[c].cycles;
                on_the_way[c] = wire;
            }
        }
        return std::string("reference");
    });
    std::vector<Unrest> all(case_table.size());
    work.run(static_cast<int>(case_table.size()), [&](int k) {
        all[k] = watch(scene, rest.wire, case_table[k], settle, cycles);
        return fmt::format("({}) {}", case_table[k].name, case_table[k].what);
    });
    work.run(static_cast<int>(calm.size()), [&](int k) {
        calm[k].second = watch(scene, on_the_way[k], case_table[0], 0, 5).mean_turn;
        calm[k].first = watch(scene, on_the_way[k], case_table[1], 0, 5).mean_turn;
        return fmt::format("after {} cycles", calm[k].cycles);
    });
    const Traces traces = traces_of(scene, rest.wire), other = traces_of(sinuous, sinuous_rest.wire);
    const Joint1D joint;

    StudyResult result;
    io::Table joints{"static_contact",
                     {"case", "joint", "in_contact_percent", "mean_update", "trace_R_N_mm"}};
    io::Table cases{"static_contact_cases",
                    {"case", "terms", "joints_touching", "joints_bouncing", "mean_update"}};
    for (std::size_t k = 0; k < all.size(); ++k) {
        for (std::size_t i = 1; i < all[k].contact.size(); ++i)
            joints.add({case_table[k].name, i, 100 * all[k].contact[i], all[k].turn[i], traces.wall[i]});
        cases.add(
            {case_table[k].name, case_table[k].what, all[k].touched(), all[k].bounced(), all[k].mean_turn});
    }
    io::Table ratio{
        "static_contact_ratio",
        {"varied_segments_before", "cycles_before", "mean_update_second_order", "mean_update_first_order"}};
    for (const Calm& each : calm) ratio.add({each.varied_segments, each.cycles, each.second, each.first});
    claim(result, all, traces, joint, calm, usual_cycles, other);
    result.plots = {contact_plot(scene), calm_plot(scene, usual_cycles), energies_plot(joint)};
    result.page = filled_page("static-contact",
                              {{"scene", scene.text()},
                               {"rest_cycles", options.quick ? 60 : 200},
                               {"gradient", rest.gradient},
                               {"settle", settle},
                               {"cycles", cycles},
                               {"wall", traces.mean_wall},
                               {"bending", traces.bending},
                               {"cases", io::to_markdown(cases)}},
                              result, options);
    result.tables = {std::move(joints), std::move(cases), std::move(ratio), energies_table(joint)};
    return result;
}

}  // namespace studies
