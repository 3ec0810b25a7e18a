#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <span>

#include "engine/anatomy/scenes.h"
#include "engine/io/cpu_clock.h"
#include "engine/studies/claims.h"
#include "engine/studies/lateral_deviation.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/wall/mesh_wall.h"

namespace studies {
namespace {

constexpr int most_turns = 5;  // varied segments

/// A wall that never trusts an earlier answer, so that every joint that moved is queried as in the paper. It
/// can keep the queries to be timed later: reading a clock at each would cost as much as the answer.
class AskedWall final : public physics::LumenWall {
public:
    AskedWall(const physics::LumenWall& wall, bool trusts) : wall_(wall), trusts_(trusts) {}

    void rigid_contacts(std::span<const geometry::Vec3> joints,
                        std::span<physics::WallContact> contacts) const override {
        queries += static_cast<long long>(joints.size());
        if (keeps) {
            sizes_.push_back(joints.size());
            joints_.insert(joints_.end(), joints.begin(), joints.end());
            for (const auto& contact : contacts) stations_.push_back(contact.station);
        }
        wall_.rigid_contacts(joints, contacts);
        if (trusts_) return;
        for (auto& contact : contacts) contact.trust = 0;
    }

    /// Processor time for answering the kept queries again, in the same batches [s].
    double answer_again() const {
        std::vector<physics::WallContact> answers(joints_.size());
        for (std::size_t i = 0; i < answers.size(); ++i) answers[i].station = stations_[i];
        const double start = io::thread_cpu_seconds();
        std::size_t at = 0;
        for (const std::size_t size : sizes_) {
            wall_.contacts(std::span(joints_).subspan(at, size), std::span(answers).subspan(at, size));
            at += size;
        }
        return io::thread_cpu_seconds() - start;
    }
    void forget() const { sizes_.clear(), joints_.clear(), stations_.clear(); }

    mutable long long queries = 0;
    bool keeps = false;

private:
    const physics::LumenWall& wall_;
    bool trusts_;
    mutable std::vector<std::size_t> sizes_;
    mutable std::vector<geometry::Vec3> joints_;
    mutable std::vector<int> stations_;
};

struct WallChoice {
    std::string name, what;
    const physics::LumenWall* wall;
    bool trusts;
    bool printed = false;  // the paper's 4M × 4M system
};

/// Cost of one cycle, as the mean of the first ten.
struct CycleCost {
    double total = 0, surface = 0;  // [s]
    double queries = 0, updates = 0;
    double solution() const { return std::max(0.0, total - surface); }
};

/// The first cycles, averaged; the time of the wall's answers only with `keeps`, which slows the rest.
CycleCost first_cycles(const PaperScene& scene, const WallChoice& choice, int varied_segments, int cycles,
                       bool keeps) {
    CycleCost cost;
    AskedWall wall(*choice.wall, choice.trusts);
    wall.keeps = keeps;
    physics::RelaxerConfig method = paper_method(varied_segments).config;
    method.printed = choice.printed;
    const auto relaxer = physics::make_relaxer(method, wall);
    physics::Chain wire = scene.start;
    for (int k = 0; k < cycles; ++k) {
        const double start = io::thread_cpu_seconds();
        const auto report = relaxer->relax(wire, physics::whole_cycles(wire.segments(), 1));
        cost.total += (io::thread_cpu_seconds() - start) / cycles;
        cost.updates += static_cast<double>(report.updates) / cycles;
        if (keeps) cost.surface += wall.answer_again() / cycles;
        wall.forget();
    }
    cost.queries = static_cast<double>(wall.queries) / cycles;
    return cost;
}

CycleCost time_cycles(const PaperScene& scene, const WallChoice& choice, int varied_segments, int cycles) {
    CycleCost cost = first_cycles(scene, choice, varied_segments, cycles, false);
    cost.surface = first_cycles(scene, choice, varied_segments, cycles, true).surface;
    return cost;
}

/// Cycles until |d_i| stays within 0.1 mm, by M.
std::vector<double> cycles_needed(const PaperScene& scene, int joint, int cycles, Work& work) {
    std::vector<double> needed(most_turns);
    const Rest rest = paper_rest(scene, 2 * cycles);
    const ReferenceCurve curve(rest.wire.joints);
    work.run(most_turns, [&](int k) {
        DeviationTrace trace(curve, joint, scene.segments());
        physics::Chain wire = scene.start;
        follow(paper_method(k + 1).config, wire, *scene.wall, cycles, {&trace, 1});
        needed[static_cast<std::size_t>(k)] = trace.settled(0.1);
        return fmt::format("cycles needed, M = {}", k + 1);
    });
    return needed;
}

/// What Table 1 and Section 3 give of one cycle with M = 1, 2, 3 on an Intel Core i7-4500U at 1.8 GHz [s].
constexpr double published_surface[] = {0.200, 0.221, 0.229}, published_solution[] = {0.201, 0.394, 0.777};
constexpr double published_ratios[] = {1, 1.52, 2.67, 4.83};      // t_M/t_1 of Section 3.2
constexpr double published_query = 0.145, published_update = 10;  // [µs]

void claim_table(StudyResult& result, const std::vector<CycleCost>& mesh,
                 const std::vector<CycleCost>& printed, int segments, bool quick) {
    FigureClaims table(result, "Table 1",
                       "Times are processor times of one thread of the machine that ran this study; "
                       "published ones are of an Intel Core i7-4500U at 1.8 GHz. Work is counted.");
    const double n = segments;
    table.counted(quick, "solutions in one cycle, N(N+1)/2", 20.1e3, 0.5 * n * (n + 1), mesh[0].updates,
                  0.0025, "within a quarter of a per cent, by which the published number is rounded",
                  fmt::format("N = {}.", segments));
    const double interactions = mesh[0].queries + mesh[0].updates;
    table.counted(quick, "wall interactions in one cycle with M = 1, Σ b(N − b + 2)", 1.37e6,
                  n * (n + 1) * (n + 2) / 6 + n * (n + 1) / 2, interactions, 0.0075,
                  "within three quarters of a per cent, by which the published number is rounded",
                  fmt::format("The published number counts one more an update than the N − b + 1 joints that "
                              "move: {:.0f} for N = {}. So counted here.",
                              n * (n + 1) * (n + 2) / 6 + n * (n + 1) / 2, segments));
    for (int m = 1; m <= 3; ++m)
        table.add(ClaimKind::Machine, fmt::format("wall of one cycle with M = {} [s]", m),
                  published_surface[m - 1], mesh[m - 1].surface,
                  mesh[m - 1].surface <= published_surface[m - 1], "no longer than published");
    for (int m = 1; m <= 3; ++m)
        table.add(ClaimKind::Machine, fmt::format("solution of one cycle with M = {} [s]", m),
                  published_solution[m - 1], mesh[m - 1].solution(),
                  mesh[m - 1].solution() <= published_solution[m - 1], "no longer than published",
                  fmt::format("In 2M tangents; as printed, 4M × 4M, {:.3f}.", printed[m - 1].solution()));
    table.add(ClaimKind::Machine, "Section 3: one wall interaction [µs]", published_query,
              1e6 * mesh[0].surface / mesh[0].queries,
              1e6 * mesh[0].surface / mesh[0].queries <= published_query, "no longer than published");
    table.add(ClaimKind::Machine, "Section 3: equations of one segment [µs]", published_update,
              1e6 * mesh[0].solution() / mesh[0].updates,
              1e6 * mesh[0].solution() / mesh[0].updates <= published_update, "no longer than published");
    const auto over = [&](const std::vector<CycleCost>& costs) {
        return fmt::format("{:.2f}, {:.2f}, {:.2f}", costs[0].surface / costs[0].solution(),
                           costs[1].surface / costs[1].solution(), costs[2].surface / costs[2].solution());
    };
    table.add(ClaimKind::Machine, "solving becomes dominant as M grows: wall over solution with M = 1, 2, 3",
              "0.995, 0.561, 0.295", over(printed), printed[2].solution() > printed[2].surface,
              "below 1 with M = 3", fmt::format("4M × 4M, as printed; in 2M tangents {}.", over(mesh)));
    // Unknowns of the printed system times solutions: M segments of 4 each; the wall is asked as often for
    // any M.
    const auto counted = [&](int m) {
        return published_query * mesh[m - 1].queries / (published_update * m * mesh[m - 1].updates);
    };
    table.published(
        "solving becomes dominant as M grows, by counted work times published unit costs, 10 µs a varied "
        "segment: wall over solution with M = 1, 2, 3",
        "0.995, 0.561, 0.295", fmt::format("{:.3f}, {:.3f}, {:.3f}", counted(1), counted(2), counted(3)),
        counted(1) > counted(2) && counted(2) > counted(3) && std::abs(counted(2) / 0.561 - 1) < 0.25 &&
            std::abs(counted(3) / 0.295 - 1) < 0.25,
        "it falls, and those with M = 2 and 3 are within a quarter",
        "Published times of a solution grow a little faster than M.");
}

/// Cycles needed times what a cycle costs by `unit`, of M = 1 … as far as units go.
std::vector<double> products(const std::vector<double>& needed, std::span<const double> unit) {
    std::vector<double> list;
    for (std::size_t m = 0; m < unit.size(); ++m) list.push_back(needed[m] * unit[m]);
    return list;
}

std::string of_each(const std::vector<double>& values, const char* format) {
    std::string text;
    for (std::size_t m = 0; m < values.size(); ++m)
        text += fmt::format(
            "{}M = {}: {}", m > 0 ? ", " : "", m + 1,
            std::isfinite(values[m]) ? fmt::format(fmt::runtime(format), values[m]) : std::string("never"));
    return text;
}

void claim_ratios(StudyResult& result, const std::vector<CycleCost>& mesh,
                  const std::vector<CycleCost>& printed, const std::vector<CycleCost>& trusting,
                  const std::vector<double>& needed, int joint) {
    FigureClaims section(result, "Section 3.2",
                         fmt::format("Cycles needed are those after which |d_{}| stays within 0.1 mm: {}.",
                                     joint, of_each(needed, "{:.1f}")));
    for (int m = 2; m <= 4; ++m) {
        const double ratio = printed[m - 1].total / printed[0].total;
        section.add(
            ClaimKind::Machine, fmt::format("t_{}/t_1 of the first 10 cycles", m), published_ratios[m - 1],
            ratio, std::abs(ratio / published_ratios[m - 1] - 1) < 0.1, "within a tenth",
            fmt::format(
                "4M × 4M, as printed; in 2M tangents {:.2f}, where the wall is asked only near it {:.2f}.",
                mesh[m - 1].total / mesh[0].total, trusting[m - 1].total / trusting[0].total));
    }
    // Table 1 and Section 3.2 give t_M up to M = 4.
    const std::vector<double> cost = products(needed, published_ratios);
    const auto best = std::min_element(cost.begin(), cost.end()) - cost.begin() + 1;
    section.published(
        "the best outcomes in time are those of M = 2 and M = 3: cycles needed times the published t_M/t_1",
        "M = 2, 3", of_each(cost, "{:.1f}"), best == 2 || best == 3,
        "the least product is that of M = 2 or 3");
    section.published("performance does not improve with M > 3: cycles needed times the published t_M/t_1",
                      "does not improve", of_each(cost, "{:.1f}"),
                      cost[3] >= std::min({cost[0], cost[1], cost[2]}),
                      "the product of M = 4 is not the least");
    section.published("the number of cycles necessary to relax the wire decreases with M [cycles]",
                      "decreases", of_each({needed[0], needed[1], needed[2]}, "{:.1f}"),
                      needed[1] < needed[0] && needed[2] < needed[1], "from M = 1 to 2 and to 3",
                      "Two or three segments take about as many cycles on this tube.");
    std::vector<double> own;
    for (int m = 1; m <= most_turns; ++m) own.push_back(needed[m - 1] * mesh[m - 1].total);
    section.add(ClaimKind::Machine, "the same by the time of a cycle on this machine [s]", "M = 2, 3",
                of_each(own, "{:.2f}"), true, "");
}

/// `most`: the longest cycle, so that all panels have one scale [s].
io::Plot picture(const PaperScene& scene, const std::vector<WallChoice>& walls, double most) {
    const auto wall = [&](std::size_t k) -> TemplateValues { return {{"wall", walls[k].name}}; };
    const int count = static_cast<int>(walls.size()) + 1;
    return filled_plot("cost", 300 * count, 460,
                       {{"scene", scene.text()},
                        {"panels", count},
                        {"top", 1.25 * most},
                        {"wall1", published_surface[0]},
                        {"wall2", published_surface[1]},
                        {"wall3", published_surface[2]},
                        {"solution1", published_solution[0]},
                        {"solution2", published_solution[1]},
                        {"solution3", published_solution[2]},
                        {"walls", rows_of(walls.size(), wall)}});
}

io::Plot ratios_plot(const PaperScene& scene, const std::vector<WallChoice>& walls) {
    static constexpr const char* colours[] = {"#0072B2", "#CC79A7", "#009E73", "#E69F00"};
    const auto ratio = [](std::size_t m) -> TemplateValues {
        return {{"m", m + 1}, {"ratio", published_ratios[m]}};
    };
    const auto wall = [&](std::size_t k) -> TemplateValues {
        return {{"wall", walls[k].name}, {"point", 4 + k}, {"colour", colours[k % std::size(colours)]}};
    };
    return filled_plot("cost_ratios", 900, 460,
                       {{"scene", scene.text()},
                        {"published", rows_of(std::size(published_ratios), ratio)},
                        {"walls", rows_of(walls.size(), wall)}});
}

}  // namespace

StudyResult run_cost(const StudyOptions& options) {
    const PaperScene scene = paper_scene("sinuous", {options.quick ? 60 : 0, 0, 0});
    const int cycles = options.quick ? 2 : 10, joint = options.quick ? 16 : 51;
    const anatomy::Scene& tube = *anatomy::find_scene("sinuous");
    const anatomy::Anatomy anatomy =
        anatomy::tube_anatomy("sinuous", scene.wall->centreline(), tube.radius, 48, 0.2 * tube.radius);
    const physics::MeshWall mesh(anatomy.lumen, anatomy.branches, anatomy.openings(), scene.stiffness);
    const std::vector<WallChoice> walls = {
        {"triangles", "rays to a mesh, every joint asked", &mesh, false},
        {"triangles by 4M × 4M", "the same, solved as the paper prints it (Eqs. 27 and 33)", &mesh, false,
         true},
        {"closed form", "distance to the centreline, every joint asked", scene.wall.get(), false},
        {"closed form and trust", "the same, a joint away from the wall not asked again", scene.wall.get(),
         true}};
    Work work(options, most_turns + static_cast<int>(walls.size()) * most_turns);
    const std::vector<double> needed = cycles_needed(scene, joint, options.quick ? 20 : 100, work);
    std::vector<std::vector<CycleCost>> costs(walls.size(), std::vector<CycleCost>(most_turns));
    // One at a time, so that threads do not share a core's caches while they are timed.
    for (int k = 0; k < static_cast<int>(walls.size()) * most_turns; ++k)
        work.run(1, [&](int) {
            costs[k / most_turns][k % most_turns] =
                time_cycles(scene, walls[k / most_turns], k % most_turns + 1, cycles);
            return fmt::format("{}, M = {}", walls[k / most_turns].name, k % most_turns + 1);
        });

    StudyResult result;
    io::Table table{"cost",
                    {"wall", "varied_segments", "wall_cpu_s", "solution_cpu_s", "cycle_cpu_s", "over_one",
                     "wall_queries", "updates", "cycles_needed"}};
    for (std::size_t w = 0; w < walls.size(); ++w)
        for (int m = 1; m <= most_turns; ++m) {
            const CycleCost& c = costs[w][m - 1];
            table.add({walls[w].name, m, c.surface, c.solution(), c.total, c.total / costs[w][0].total,
                       c.queries, c.updates, needed[m - 1]});
        }
    claim_table(result, costs[0], costs[1], scene.segments(), options.quick);
    claim_ratios(result, costs[0], costs[1], costs.back(), needed, joint);
    double most = published_surface[2] + published_solution[2];
    for (const auto& of_wall : costs)
        for (const CycleCost& cost : of_wall) most = std::max(most, cost.surface + cost.solution());
    result.plots = {picture(scene, walls, most), ratios_plot(scene, walls)};
    result.page = filled_page("cost",
                              {{"scene", scene.text()},
                               {"cycles", cycles},
                               {"joint", joint},
                               {"name0", walls[0].name},
                               {"what0", walls[0].what},
                               {"triangles", anatomy.lumen.triangles.size()},
                               {"name1", walls[1].name},
                               {"what1", walls[1].what},
                               {"name2", walls[2].name},
                               {"what2", walls[2].what},
                               {"name3", walls[3].name},
                               {"what3", walls[3].what},
                               {"table", io::to_markdown(table, 3)}},
                              result, options);
    result.tables = {std::move(table)};
    return result;
}

}  // namespace studies
