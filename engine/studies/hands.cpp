#include <algorithm>
#include <fmt/format.h>

#include "engine/studies/claims.h"
#include "engine/studies/hands_behaviours.h"
#include "engine/studies/hands_published.h"
#include "engine/studies/hands_realistic.h"
#include "engine/studies/quantile.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"

namespace studies {
namespace {

constexpr double balanced = 0.01;
constexpr double negligible = 0.005;    // of a whole run; steps are made again from 1e-4 on [N·mm]
constexpr int frames_of_balance = 150;  // of an exercise
constexpr int enough_inside = 9;        // of the behaviours with a published size

io::TableCell number(double x) {
    return std::isfinite(x) ? io::TableCell(x) : io::TableCell(std::string());
}

std::string verdict(const BehaviourRun& run, const PublishedSize& published) {
    if (!run.appears) return "does not appear";
    if (!published.known()) return "appears; no published size";
    if (!published.same_kind) return "appears; no published size of this course";
    return published.holds(run.measured) ? "inside" : "outside";
}

io::Table behaviour_table(const std::vector<BehaviourRun>& runs) {
    io::Table table{"hands",
                    {"behaviour", "measured_as", "scenario", "device", "measured", "unit", "published_low",
                     "published_high", "verdict", "published_of", "source", "mark", "manipulation", "note"}};
    for (const BehaviourRun& run : runs) {
        const PublishedSize& p = published_size(run.behaviour);
        table.add({run.behaviour, std::string(p.measure), run.scenario, run.devices, number(run.measured),
                   std::string(p.unit), number(p.low), number(p.high), verdict(run, p), std::string(p.course),
                   std::string(p.source), std::string(name_of(p.mark)), run.manipulation, run.note});
    }
    return table;
}

io::Table balance_table(const char* name, const char* of) {
    return {name,
            {of, "steps", "work_N_mm", "stored_N_mm", "friction_N_mm", "jumps_N_mm",
             "parts_of_steps_that_jump", "to_and_fro_N_mm", "missing_N_mm", "error_percent"}};
}

void add(io::Table& table, const std::string& of, const HandBalance& b) {
    table.add({of, b.steps, b.work, b.stored, b.friction, b.jumps, b.jumping_steps, b.exchanged, b.missing(),
               100 * b.error()});
}

io::Table push_table(const std::vector<FeltPushes>& all, int hands) {
    io::Table table{"hands_pushes",
                    {"scenario", "hands", "frames", "frames_that_push", "push_p50_N", "push_p95_N",
                     "push_max_N", "largest_pull_N", "published_low_N", "published_high_N", "published_of",
                     "shaft_bowed", "refused", "not_at_rest", "on_the_way_to_rest"}};
    for (const FeltPushes& felt : all) {
        double low = std::nan(""), high = low;
        std::string of;
        for (const PublishedPush& p : published_pushes())
            if (p.scenario == felt.scenario)
                low = p.low, high = p.high, of = fmt::format("{}; {}", p.course, p.source);
        table.add({felt.scenario, fmt::format("seeds 1 to {}", hands), felt.frames, felt.pushing,
                   quantile(felt.pushes, 0.5), quantile(felt.pushes, 0.95), quantile(felt.pushes, 1),
                   felt.largest_pull, number(low), number(high), of, felt.buckled, felt.refused,
                   felt.not_at_rest, felt.settling});
    }
    return table;
}

void claim_all(StudyResult& result, const std::vector<BehaviourRun>& runs) {
    int inside = 0;
    double worst = 0;
    std::string where;
    for (const BehaviourRun& run : runs) {
        const PublishedSize& p = published_size(run.behaviour);
        inside += run.appears && p.holds(run.measured);
        if (run.balance.error() >= worst) worst = run.balance.error(), where = run.behaviour;
        const std::string range = p.known() ? fmt::format("{:g} to {:g}", p.low, p.high) : "none found";
        result.claim(fmt::format("{}: {} [{}]", p.behaviour, p.measure, p.unit), range, number(run.measured),
                     run.appears && p.holds(run.measured),
                     fmt::format("{}. {}; {}.", verdict(run, p), run.manipulation, run.note));
    }
    result.claim("behaviours that appear with a size inside a published range of their kind of course",
                 fmt::format("at least {} of 13", enough_inside), static_cast<double>(inside),
                 inside >= enough_inside, "");
    result.claim("energy: hands' work less what is stored and dissipated, of the larger, worst run [%]",
                 "at most 1", 100 * worst, worst <= balanced,
                 fmt::format("in {}; jumps from rest to rest count as dissipated", where));
}

void claim_balance(StudyResult& result, const std::vector<ExerciseBalance>& balances) {
    int within = 0;
    std::string others;
    for (const ExerciseBalance& e : balances) {
        const bool holds = e.balance.error() <= balanced || std::abs(e.balance.missing()) <= negligible;
        within += holds;
        if (!holds)
            others +=
                fmt::format("{}{} {:.1f} %", others.empty() ? "" : ", ", e.scenario, 100 * e.balance.error());
    }
    const int all = static_cast<int>(balances.size());
    result.claim("energy of a realistic hand: exercises in which it is balanced within 1 %, or 0.005 N mm",
                 fmt::format("all {}", all), within, within == all,
                 others.empty() ? std::string("Hand 1.") : "Hand 1. Not in " + others + ".");
}

io::Table columns(const io::Table& table, std::initializer_list<const char*> names) {
    io::Table some{"", {}};
    for (const char* name : names) some.columns.emplace_back(name);
    for (const auto& row : table.rows) {
        std::vector<io::TableCell> cells;
        for (const char* name : names) cells.push_back(row[table.column(name)]);
        some.add(std::move(cells));
    }
    return some;
}

}  // namespace

StudyResult run_hands(const StudyOptions& options) {
    const int frames = options.quick ? 200 : 20'000;
    const auto all = behaviours();
    Work work(options, static_cast<int>(all.size()) + frames);
    std::vector<BehaviourRun> runs(all.size());
    work.run(static_cast<int>(all.size()), [&](int k) {
        runs[static_cast<std::size_t>(k)] = all[static_cast<std::size_t>(k)].run(options);
        return runs[static_cast<std::size_t>(k)].behaviour;
    });
    const std::vector<FeltPushes> felt =
        feel_pushes(options, frames, [&](const std::string& what, int some) { work.tell(what, some); });
    const std::vector<ExerciseBalance> balances =
        balance_exercises(options, options.quick ? 15 : frames_of_balance,
                          [&](const std::string& what) { work.tell(what + ", balance", 0); });

    StudyResult result;
    io::Table behaviours = behaviour_table(runs),
              pushes = push_table(felt, options.quick ? 1 : realistic_hands),
              balance = balance_table("hands_balance", "behaviour"),
              slow = balance_table("hands_balance_exercises", "scenario");
    for (const BehaviourRun& run : runs) add(balance, run.behaviour, run.balance);
    for (const ExerciseBalance& e : balances) add(slow, e.scenario, e.balance);
    claim_all(result, runs);
    claim_balance(result, balances);
    result.plots = hand_plots(runs);
    result.page = filled_page(
        "hands",
        {{"behaviours",
          io::to_markdown(columns(behaviours, {"behaviour", "measured_as", "scenario", "device", "measured",
                                               "unit", "published_low", "published_high", "verdict"}),
                          3)},
         {"sources", io::to_markdown(columns(behaviours, {"behaviour", "published_of", "source", "mark"}))},
         {"frames", frames},
         {"pushes", io::to_markdown(columns(pushes, {"scenario", "frames_that_push", "push_p50_N",
                                                     "push_p95_N", "push_max_N", "published_low_N",
                                                     "published_high_N", "shaft_bowed", "not_at_rest"}),
                                    2)},
         {"balance", io::to_markdown(balance, 3)},
         {"slow", io::to_markdown(slow, 3) + "\n"}},
        result, options);
    result.tables = {std::move(behaviours), std::move(pushes), std::move(balance), std::move(slow),
                     curve_table(runs),     path_table(runs),  vessel_table(runs)};
    return result;
}

}  // namespace studies
