#include <algorithm>
#include <fmt/format.h>
#include <functional>

#include "engine/studies/claims.h"
#include "engine/studies/quantile.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/wild_hands.h"
#include "engine/studies/work.h"
#include "physics/geometry/parallel.h"

namespace studies {
namespace {

constexpr std::size_t most_incidents = 1000;  // in the table

/// Pushes wires into the tubes from seed 0 on, until there are enough pushes. Pushes left over by a tube that
/// ends early go to further tubes, so that the result does not depend on the number of threads.
std::vector<TubeCourse> push_all(const StudyOptions& options, int pushes, Work& work) {
    std::vector<TubeCourse> courses;
    for (int left = pushes; left > 0;) {
        std::vector<int> fractions;  // of the tubes to come
        const std::size_t first = courses.size();
        for (int planned = 0; planned < left; planned += fractions.back()) {
            const int whole = random_tube(first + fractions.size()).segments - segments_at_start;
            fractions.push_back(std::min(whole, left - planned));
        }
        courses.resize(first + fractions.size());
        geometry::for_each_index(static_cast<int>(fractions.size()), options.threads, [&](int k) {
            TubeCourse& course = courses[first + static_cast<std::size_t>(k)];
            course =
                push_through(first + static_cast<std::size_t>(k), fractions[static_cast<std::size_t>(k)]);
            work.tell(fmt::format("random tube, seed {}", course.seed), course.pushes);
        });
        for (std::size_t k = first; k < courses.size(); ++k) left -= courses[k].pushes;
    }
    return courses;
}

struct WildRun {
    std::string scenario;
    WildTally tally;
};

int hand_count(const StudyOptions& options) {  // hands that play each scenario
    return options.quick ? 1 : 3;
}

/// Plays all frames, divided evenly among scenarios and hands.
std::vector<WildRun> play_all(const StudyOptions& options, int frames, Work& work) {
    const std::vector<scenario::Scenario> scenarios = wild_scenarios(options);
    const int count = static_cast<int>(scenarios.size()), of = hand_count(options);
    std::vector<WildRun> runs(scenarios.size());
    geometry::for_each_index(count, options.threads, [&](int k) {
        const auto fraction = [&](int piece) {
            return static_cast<int>(1LL * frames * piece / (count * of));
        };
        exercise::Simulation simulation(scenarios[k], options.cache);
        const WildJudge judge(simulation);
        runs[k].scenario = scenarios[k].name;
        for (int hand = 1; hand <= of; ++hand) {
            const int piece = k * of + hand, some = fraction(piece) - fraction(piece - 1);
            runs[k].tally.add(play_wildly(simulation, judge, static_cast<std::uint32_t>(hand), some));
            work.tell(fmt::format("{}, hand {}", runs[k].scenario, hand), some);
        }
    });
    return runs;
}

/// A column of a table: its name, and what it has in a row.
template <class Row>
struct Column {
    const char* name;
    std::function<io::TableCell(const Row&)> of;
};
template <class Row>
io::Table table_of(const char* name, const std::vector<Column<Row>>& columns, const std::vector<Row>& rows) {
    io::Table table{name, {}};
    for (const Column<Row>& column : columns) table.columns.emplace_back(column.name);
    for (const Row& row : rows) {
        std::vector<io::TableCell> cells;
        for (const Column<Row>& column : columns) cells.push_back(column.of(row));
        table.add(std::move(cells));
    }
    return table;
}

struct TubeRow {
    io::TableCell seed;
    TubeCourse course;
};

io::Table tube_table(const std::vector<TubeCourse>& courses) {
    const double none = std::nan("");
    TubeCourse sum;
    sum.tube = {none, none, none, none, 0, {}};
    std::vector<TubeRow> rows;
    for (const TubeCourse& c : courses) {
        rows.push_back({c.seed, c});
        sum.tube.segments += c.tube.segments, sum.reached += c.reached;
        sum.pushes += c.pushes, sum.unconverged += c.unconverged, sum.restless += c.restless;
        sum.folds += c.folds, sum.deep += c.deep, sum.refused += c.refused, sum.flat += c.flat;
        sum.over_work += c.over_work, sum.gave_way += c.gave_way, sum.steps += c.steps;
        sum.gradient = std::max(sum.gradient, c.gradient), sum.excess = std::max(sum.excess, c.excess);
        sum.times.insert(sum.times.end(), c.times.begin(), c.times.end());
    }
    rows.push_back({fmt::format("all {}", courses.size()), sum});
    const auto of = [](auto member) { return [member](const TubeRow& r) { return r.course.*member; }; };
    const auto in = [](auto member) { return [member](const TubeRow& r) { return r.course.tube.*member; }; };
    const auto time = [](double fraction) {
        return [fraction](const TubeRow& r) { return quantile(r.course.times, fraction); };
    };
    return table_of<TubeRow>("robustness_tubes",
                             {{"seed", &TubeRow::seed},
                              {"radius_mm", in(&RandomTube::radius)},
                              {"segment_length_mm", in(&RandomTube::segment_length)},
                              {"EI_N_mm2", in(&RandomTube::rigidity)},
                              {"k_N_per_mm", in(&RandomTube::wall_stiffness)},
                              {"segments", in(&RandomTube::segments)},
                              {"reached", of(&TubeCourse::reached)},
                              {"pushes", of(&TubeCourse::pushes)},
                              {"unconverged", of(&TubeCourse::unconverged)},
                              {"gradient_above_limit", of(&TubeCourse::restless)},
                              {"folds", of(&TubeCourse::folds)},
                              {"deep", of(&TubeCourse::deep)},
                              {"refused", of(&TubeCourse::refused)},
                              {"not_strict_minimum", of(&TubeCourse::flat)},
                              {"over_work", of(&TubeCourse::over_work)},
                              {"wall_gave_way", of(&TubeCourse::gave_way)},
                              {"largest_gradient", of(&TubeCourse::gradient)},
                              {"largest_excess", of(&TubeCourse::excess)},
                              {"steps", of(&TubeCourse::steps)},
                              {"median_ms", time(0.5)},
                              {"p99_ms", time(0.99)},
                              {"p99_9_ms", time(0.999)},
                              {"max_ms", time(1)}},
                             rows);
}

io::Table wild_table(std::vector<WildRun> runs, int hands) {
    WildRun all{"all", {}};
    for (const WildRun& run : runs) all.tally.add(run.tally);
    runs.push_back(std::move(all));
    const auto of = [](auto member) { return [member](const WildRun& r) { return r.tally.*member; }; };
    const auto time = [](double fraction) {
        return [fraction](const WildRun& r) { return quantile(r.tally.times, fraction); };
    };
    return table_of<WildRun>(
        "robustness_hands",
        {{"scenario", &WildRun::scenario},
         {"hands", [hands](const WildRun&) { return fmt::format("1 to {}", hands); }},
         {"frames", of(&WildTally::frames)},
         {"most_segments", of(&WildTally::segments)},
         {"not_at_rest", of(&WildTally::restless)},
         {"largest_gradient", of(&WildTally::gradient)},
         {"folds", of(&WildTally::folds)},
         {"frames_reported_to_cross", of(&WildTally::reported_crossings)},
         {"deepest_crossing_mm", of(&WildTally::deepest_crossing)},
         {"beyond_force", of(&WildTally::beyond_force)},
         {"beyond_force_mm", of(&WildTally::beyond_force_by)},
         {"frames_out_of_an_end", of(&WildTally::left)},
         {"refused", of(&WildTally::refused)},
         {"buckled", of(&WildTally::buckled)},
         {"settling", of(&WildTally::settling)},
         {"settling_percent", [](const WildRun& r) { return 100.0 * r.tally.settling / r.tally.frames; }},
         {"lagging", of(&WildTally::lagging)},
         {"largest_lag_mm", of(&WildTally::largest_lag)},
         {"deepest_mm", of(&WildTally::deepest)},
         {"largest_force_N", of(&WildTally::largest_force)},
         {"median_ms", time(0.5)},
         {"p99_ms", time(0.99)},
         {"max_ms", time(1)}},
        runs);
}

io::Table incident_table(const std::vector<TubeCourse>& courses, const std::vector<WildRun>& runs) {
    io::Table table{"robustness_incidents", {"where", "seed", "push_or_frame", "what"}};
    const auto add = [&](const Incident& i) {
        if (table.rows.size() < most_incidents) table.add({i.where, i.seed, i.at, i.what});
    };
    for (const TubeCourse& c : courses) std::for_each(c.incidents.begin(), c.incidents.end(), add);
    for (const WildRun& r : runs) std::for_each(r.tally.incidents.begin(), r.tally.incidents.end(), add);
    return table;
}

/// The last row as a table of two columns.
io::Table totals(const io::Table& tubes) {
    io::Table table{"", {"all tubes", ""}};
    for (std::size_t k = 6; k < tubes.columns.size(); ++k)
        table.add({tubes.columns[k], tubes.rows.back()[k]});
    return table;
}

/// The scenarios as columns.
io::Table transposed(const io::Table& hands) {
    io::Table table{"", {"wild hands"}};
    for (const auto& row : hands.rows) table.columns.push_back(std::get<std::string>(row.front()));
    for (std::size_t k = 1; k < hands.columns.size(); ++k) {
        std::vector<io::TableCell> cells = {hands.columns[k]};
        for (const auto& row : hands.rows) cells.push_back(row[k]);
        table.add(std::move(cells));
    }
    return table;
}

io::Table first_rows(io::Table table, std::size_t most) {
    table.rows.resize(std::min(table.rows.size(), most));
    return table;
}

std::vector<Claim> claims_of(const io::Table& tubes, const io::Table& hands,
                             const std::vector<TubeCourse>& courses) {
    std::vector<Claim> claims;
    const auto none = [&](const io::Table& table, const char* column, const std::string& text,
                          const std::string& note) {
        const double found = table.number(table.rows.size() - 1, column);
        claims.push_back({text, 0.0, found, found == 0, note});
    };
    const std::string pushes =
        fmt::format("{} tubes, {} pushes", courses.size(), tubes.number(tubes.rows.size() - 1, "pushes"));
    none(tubes, "unconverged", "random tubes: pushes that do not end at rest", pushes);
    none(tubes, "gradient_above_limit", fmt::format("random tubes: |g|/C above {:g}", rest_limit),
         "by the energy module's exact gradient");
    none(tubes, "folds", "random tubes: folds", "a joint bent by more than 90°");
    none(tubes, "deep", "random tubes: joints farther outside than the lumen's radius", "");
    none(tubes, "refused", "random tubes: refused pushes",
         "but where the next rest lies outside the lumen, by more than its radius");
    none(tubes, "over_work", "random tubes: rises of the energy beyond the hand's work",
         "the larger of dE/dL before and after each part, times its length; by more than 5 %");
    if (hands.rows.size() == 1) return claims;
    none(hands, "not_at_rest", "wild hands: frames not at rest",
         fmt::format("{} frames in {} scenarios", hands.number(hands.rows.size() - 1, "frames"),
                     hands.rows.size() - 1));
    none(hands, "folds", "wild hands: frames with a fold", "a joint bent by more than 90°");
    none(hands, "beyond_force", "wild hands: joints deeper than their force explains",
         "of all joints, distance to the raw mesh and the vessels past its ends against force over "
         "stiffness; by more than 0.2 mm");
    none(hands, "refused", "wild hands: frames in which a motion was refused",
         "the hub found no rest for it, however small its parts; pushes that bow the shaft do not count");
    const std::size_t all = hands.rows.size() - 1;
    for (const auto& [column, most] : {std::pair{"p99_ms", 33.0}, {"max_ms", 66.0}}) {
        const double found = hands.number(all, column);
        claims.push_back({fmt::format("wild hands: processor time of a frame, {}", column), most, found,
                          found <= most, "At most.", ClaimKind::Machine});
    }
    for (std::size_t r = 0; r < all; ++r) {
        const double fraction = hands.number(r, "settling_percent");
        claims.push_back({fmt::format("wild hands in {}: frames that show an earlier rest [%]",
                                      std::get<std::string>(hands.rows[r].front())),
                          5.0, fraction, fraction <= 5, "At most: the wire shown is on its way to rest."});
    }
    return claims;
}

}  // namespace

StudyResult run_robustness(const StudyOptions& options) {
    const int pushes = options.quick ? 300 : 20'000, frames = options.quick ? 150 : 20'000;
    Work work(options, pushes + frames);
    const std::vector<TubeCourse> courses = push_all(options, pushes, work);
    const std::vector<WildRun> runs = play_all(options, frames, work);

    StudyResult result;
    io::Table tubes = tube_table(courses), hands = wild_table(runs, hand_count(options)),
              incidents = incident_table(courses, runs);
    result.claims = claims_of(tubes, hands, courses);
    const std::string of_hands = runs.empty() ? "" : filled_plot("robustness_hands", 0, 0, {}).commands;
    result.plots = {filled_plot("robustness", 1250, 560, {{"hands", of_hands}})};
    result.page =
        filled_page("robustness",
                    {{"last", courses.size() - 1},
                     {"pushes", pushes},
                     {"start", segments_at_start},
                     {"hands", hand_count(options)},
                     {"frames", frames},
                     {"of_tubes", io::to_markdown(totals(tubes), 3)},
                     {"of_hands", io::to_markdown(transposed(hands), 3)},
                     {"incidents", incidents.rows.empty() ? std::string("There was no incident.\n")
                                                          : io::to_markdown(first_rows(incidents, 40))}},
                    result, options);
    result.tables = {std::move(tubes), std::move(hands), std::move(incidents)};
    return result;
}

}  // namespace studies
