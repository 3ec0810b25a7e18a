#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "engine/studies/claims.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/quantile.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/relax/segment_step.h"

namespace studies {
namespace {

using physics::Chain, geometry::Mat3, geometry::Vec3;

/// The minimum of Eq. 17, or of Eq. 35, and the turns that lead there.
struct Relaxed {
    double gain = 0;  // energy released, by the model [N·mm]
    std::array<Vec3, 2> turn = {Vec3::Zero(), Vec3::Zero()};
};

Relaxed relaxed(const Chain& wire, const SegmentTerms& terms, std::initializer_list<int> segments) {
    physics::SegmentProblem problem;
    std::array<int, 2> index{};
    for (const int i : segments) {
        index[static_cast<std::size_t>(problem.count)] = i;
        problem.tangent[problem.count] = wire.tangents[i];
        problem.pull[problem.count] = terms.pull[i];
        problem.curvature[problem.count][problem.count] = terms.bending[i] + terms.wall[i];
        ++problem.count;
    }
    if (problem.count == 2) problem.curvature[0][1] = problem.curvature[1][0] = terms.wall[index[1]];
    const auto solution = physics::descending_step(problem);
    Relaxed result;
    result.gain = -physics::model_energy(problem, solution.tangent);
    for (int m = 0; m < problem.count; ++m) result.turn[m] = solution.tangent[m] - problem.tangent[m];
    return result;
}

/// One pair of segments of a wire on its way to rest.
struct Pair {
    int between = 0;         // joints in touch from i to j − 1
    double together = 0;     // energy released by the pair [N·mm]
    double alone = 0;        // by each of the two from the same state, added [N·mm]
    double cosine = 0;       // between ε_i and ε_j
    double interaction = 0;  // |ε_i·R₍j,N₎·ε_j| over ε_i·R₍i,N₎·ε_i
};

std::vector<Pair> pairs_at(const std::vector<std::pair<Chain, SegmentTerms>>& states, int separation) {
    std::vector<Pair> pairs;
    for (const auto& [wire, terms] : states)
        for (int i = 1; i + separation <= terms.last_touching(); ++i) {
            const int j = i + separation;
            const Relaxed both = relaxed(wire, terms, {i, j});
            const double sizes = both.turn[0].norm() * both.turn[1].norm(),
                         own = both.turn[0].dot(terms.wall[i] * both.turn[0]);
            if (!(sizes > 0 && own > 0)) continue;
            pairs.push_back({terms.touching_between(i, j), both.gain,
                             relaxed(wire, terms, {i}).gain + relaxed(wire, terms, {j}).gain,
                             both.turn[0].dot(both.turn[1]) / sizes,
                             std::abs(both.turn[0].dot(terms.wall[j] * both.turn[1])) / own});
        }
    return pairs;
}

struct Summary {
    int pairs = 0;
    double synergy = 0;      // energy released together over that released alone, each summed over the pairs
    double cosine = 0;       // median
    double opposite = 0;     // fraction of pairs whose turns are against each other
    double interaction = 0;  // median
    double between = 0;      // mean number of joints in touch between
};

Summary summary(const std::vector<Pair>& pairs) {
    Summary s;
    double together = 0, alone = 0;
    std::vector<double> cosines, interactions;
    for (const Pair& pair : pairs) {
        together += pair.together, alone += pair.alone;
        cosines.push_back(pair.cosine);
        interactions.push_back(pair.interaction);
        s.opposite += pair.cosine < 0;
        s.between += pair.between;
    }
    s.pairs = static_cast<int>(pairs.size());
    s.synergy = together / alone;
    s.cosine = quantile(cosines, 0.5);
    s.interaction = quantile(interactions, 0.5);
    s.opposite /= s.pairs;
    s.between /= s.pairs;
    return s;
}

/// The pairs of several separations together.
std::vector<Pair> joined(const std::vector<std::vector<Pair>>& all, int from, int to) {
    std::vector<Pair> list;
    for (int delta = from; delta <= to && delta < static_cast<int>(all.size()); ++delta)
        list.insert(list.end(), all[delta].begin(), all[delta].end());
    return list;
}

std::vector<Pair> with_between(const std::vector<Pair>& pairs, int least, int most) {
    std::vector<Pair> list;
    std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(list),
                 [&](const Pair& pair) { return pair.between >= least && pair.between <= most; });
    return list;
}

constexpr int many = 4;  // contacts between segments that are far from each other

struct Size {
    int segments, farthest;
    std::vector<int> cycles;  // after which states are taken
};

void claim(StudyResult& result, const std::vector<std::vector<Pair>>& all, int farthest, double quadratic,
           double quadratic_trace) {
    FigureClaims fig(
        result, "Section 2.3.1 and Fig. 3",
        "Synergy is the energy that a double relaxation of i and j releases, over that which each of the two "
        "releases alone from the same state, both summed over all i: 0.5 where the second segment adds "
        "nothing, 1 where they are independent, above 1 where they do together what neither can alone.");
    const Summary next = summary(joined(all, 2, 2)), close = summary(joined(all, 2, 4)),
                  good = summary(joined(all, 10, 20));
    const std::vector<Pair> every = joined(all, 2, farthest);
    const Summary few = summary(with_between(every, 0, 0)), far = summary(with_between(every, many, 1000));
    fig.published("close segments improve only marginally on one: synergy of δ = 2 to 4", "about 0.5",
                  close.synergy, close.synergy > 0.4 && close.synergy < 0.65, "0.4 to 0.65",
                  fmt::format("The paper takes b_i = b_j and ε_i = ε_j, as near equilibrium; on its way the "
                              "bending of neighbours is not alike, and only {:.0f} % of these pairs turn the "
                              "same way ({:.0f} % of those at δ = 2).",
                              100 * (1 - close.opposite), 100 * (1 - next.opposite)));
    fig.published("the nearest segments turn alike, ε_i ≈ ε_j: median cosine between them at δ = 2", 1.0,
                  next.cosine, next.cosine > 0.9, "above 0.9");
    fig.published(
        "segments that are not close lower the energy more: synergy of δ = 10 to 20 over that of 2 to 4",
        "> 1", good.synergy / close.synergy, good.synergy > close.synergy, "the ratio is above 1");
    fig.published("they turn against each other, ε_i ≈ −ε_j: share of pairs of δ = 10 to 20 that do", "most",
                  good.opposite, good.opposite > 0.5, "more than half",
                  fmt::format("Their median cosine is {:.2f}.", good.cosine));
    fig.published(fmt::format("far segments hardly interact: median of |ε_i·R_(j,N)·ε_j| over "
                              "ε_i·R_(i,N)·ε_i with {} contacts or more between, over that with none between",
                              many),
                  "≪ 1", far.interaction / few.interaction, far.interaction < 0.5 * few.interaction,
                  "less than half",
                  fmt::format("{} pairs and {} pairs; {:.2f} and {:.2f}.", far.pairs, few.pairs,
                              far.interaction, few.interaction));
    fig.published(
        fmt::format(
            "far segments give no advantage over single ones: synergy with {} contacts or more between",
            many),
        "about 1", far.synergy, std::abs(far.synergy - 1) < 0.1, "0.9 to 1.1",
        fmt::format("It is largest with two or three contacts between, {:.2f}, and {:.2f} with eight or "
                    "more: the second segment still cancels the contacts beyond both.",
                    summary(with_between(every, 2, 3)).synergy,
                    summary(with_between(every, 8, 1000)).synergy));
    fig.published(
        "the quadratic energy of the wall is much larger than that of bending: of ε at the minima of single "
        "relaxations, summed",
        "≫ 1", quadratic, quadratic > 5, "more than 5 times",
        fmt::format("The traces are in the ratio {:.3g}.", quadratic_trace));
}

/// Tr R₍i,N₎ against Tr A_i along the wire, where it rests.
io::Table traces_table(const Chain& wire, const SegmentTerms& terms) {
    io::Table table{"pair_relaxation_traces", {"segment", "trace_R_N_mm", "trace_A_N_mm"}};
    for (int i = 1; i <= wire.segments(); ++i)
        table.add({i, terms.wall[i].trace(), terms.bending[i].trace()});
    return table;
}

}  // namespace

StudyResult run_pair_relaxation(const StudyOptions& options) {
    const Size size = options.quick ? Size{80, 30, {1, 3}} : Size{200, 60, {1, 2, 3, 5, 8}};
    const PaperScene scene = paper_scene("sharp", {.segments = size.segments});
    Work work(options, 2 + size.farthest - 1);
    std::vector<std::pair<Chain, SegmentTerms>> states;
    Rest rest;
    work.run(2, [&](int k) {
        if (k == 1) {
            rest = paper_rest(scene, options.quick ? 30 : 200);
            return std::string("rest");
        }
        Chain wire = scene.start;
        const auto relaxer = physics::make_relaxer(paper_method(1).config, *scene.wall);
        int made = 0;
        for (const int cycles : size.cycles) {
            relaxer->relax(wire, physics::whole_cycles(wire.segments(), cycles - made));
            made = cycles;
            states.emplace_back(wire, segment_terms(scene, wire));
        }
        return std::string("on its way");
    });
    std::vector<std::vector<Pair>> all(static_cast<std::size_t>(size.farthest) + 1);
    work.run(size.farthest - 1, [&](int k) {
        all[static_cast<std::size_t>(k) + 2] = pairs_at(states, k + 2);
        return fmt::format("δ = {}", k + 2);
    });
    double by_wall = 0, by_bending = 0, trace_wall = 0, trace_bending = 0;
    for (const auto& [wire, terms] : states)
        for (int i = 1; i <= terms.last_touching(); ++i) {
            const Vec3 turn = relaxed(wire, terms, {i}).turn[0];
            by_wall += turn.dot(terms.wall[i] * turn);
            by_bending += turn.dot(terms.bending[i] * turn);
            trace_wall += terms.wall[i].trace();
            trace_bending += terms.bending[i].trace();
        }

    StudyResult result;
    const auto add = [](io::Table& table, int number, const std::vector<Pair>& pairs) {
        if (pairs.empty()) return;
        const Summary s = summary(pairs);
        table.add({number, s.synergy, s.cosine, s.interaction, s.opposite, s.between, s.pairs});
    };
    const std::vector<std::string> columns = {"synergy",        "median_cosine",    "interaction",
                                              "opposite_share", "contacts_between", "pairs"};
    io::Table table{"pair_relaxation", {"separation"}}, contacts{"pair_relaxation_contacts", {"contacts"}};
    for (io::Table* each : {&table, &contacts})
        each->columns.insert(each->columns.end(), columns.begin(), columns.end());
    for (int delta = 2; delta <= size.farthest; ++delta)
        add(table, delta, all[static_cast<std::size_t>(delta)]);
    const std::vector<Pair> every = joined(all, 2, size.farthest);
    for (int between = 0; between <= 12; ++between)
        add(contacts, between, with_between(every, between, between));
    claim(result, all, size.farthest, by_wall / by_bending, trace_wall / trace_bending);
    result.plots = {
        filled_plot("pair_relaxation", 1000, 760, {{"scene", scene.text()}, {"farthest", size.farthest}}),
        filled_plot("pair_relaxation_traces", 900, 420, {{"scene", scene.text()}})};
    result.page = filled_page("pair-relaxation",
                              {{"scene", scene.text()},
                               {"cycles", size.cycles.back()},
                               {"each", fmt::format("{}", fmt::join(size.cycles, ", "))}},
                              result, options);
    result.tables = {std::move(table), std::move(contacts),
                     traces_table(rest.wire, segment_terms(scene, rest.wire))};
    return result;
}

}  // namespace studies
