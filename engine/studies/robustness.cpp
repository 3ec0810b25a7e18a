#include "engine/studies/robustness.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <mutex>

#include "engine/studies/claims.h"
#include "engine/studies/random_tubes.h"
#include "engine/studies/wild_hands.h"
#include "physics/geometry/parallel.h"

namespace studies {
namespace {

constexpr std::size_t most_incidents = 1000;  // in the table

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
    const auto at =
        std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())));
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
    return values[at];
}

/// Shows how many of all pushes and frames are done.
class Tally {
public:
    Tally(const StudyOptions& options, int of) : options_(options), of_(of) {}
    void add(int some, const std::string& what) {
        const std::lock_guard lock(telling_);
        done_ += some;
        if (options_.progress) options_.progress({done_, of_, what});
    }

private:
    const StudyOptions& options_;
    std::mutex telling_;
    int done_ = 0, of_;
};

/// Pushes wires into the tubes from seed 0 on, until there are enough pushes. Pushes left over by a tube that
/// ends early go to further tubes, so that the result does not depend on the number of threads.
std::vector<TubeCourse> push_all(const StudyOptions& options, int pushes, Tally& tally) {
    std::vector<TubeCourse> courses;
    for (int left = pushes; left > 0;) {
        std::vector<int> shares;  // of the tubes to come
        const std::size_t first = courses.size();
        for (int planned = 0; planned < left; planned += shares.back()) {
            const int whole = random_tube(first + shares.size()).segments - segments_at_start;
            shares.push_back(std::min(whole, left - planned));
        }
        courses.resize(first + shares.size());
        geometry::for_each_index(static_cast<int>(shares.size()), options.threads, [&](int k) {
            TubeCourse& course = courses[first + static_cast<std::size_t>(k)];
            course = push_through(first + static_cast<std::size_t>(k), shares[static_cast<std::size_t>(k)]);
            tally.add(course.pushes, fmt::format("random tube, seed {}", course.seed));
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
std::vector<WildRun> play_all(const StudyOptions& options, int frames, Tally& tally) {
    const std::vector<scenario::Scenario> scenarios = wild_scenarios(options);
    const int count = static_cast<int>(scenarios.size()), of = hand_count(options);
    std::vector<WildRun> runs(scenarios.size());
    geometry::for_each_index(count, options.threads, [&](int k) {
        const auto share = [&](int piece) { return static_cast<int>(1LL * frames * piece / (count * of)); };
        exercise::Simulation simulation(scenarios[k], options.cache);
        const WildJudge judge(simulation);
        runs[k].scenario = scenarios[k].name;
        for (int hand = 1; hand <= of; ++hand) {
            const int piece = k * of + hand, some = share(piece) - share(piece - 1);
            runs[k].tally.add(play_wildly(simulation, judge, static_cast<std::uint32_t>(hand), some));
            tally.add(some, fmt::format("{}, hand {}", runs[k].scenario, hand));
        }
    });
    return runs;
}

io::Table tube_table(const std::vector<TubeCourse>& courses) {
    io::Table table{"robustness_tubes",
                    {"seed",
                     "radius_mm",
                     "segment_length_mm",
                     "EI_N_mm2",
                     "k_N_per_mm",
                     "segments",
                     "reached",
                     "pushes",
                     "unconverged",
                     "gradient_above_limit",
                     "folds",
                     "deep",
                     "refused",
                     "not_strict_minimum",
                     "over_work",
                     "wall_gave_way",
                     "largest_gradient",
                     "largest_excess",
                     "steps",
                     "median_ms",
                     "p99_ms",
                     "p99_9_ms",
                     "max_ms"},
                    {}};
    TubeCourse sum;
    int tubes = 0, segments = 0, reached = 0;
    const auto row = [&](io::TableCell seed, const TubeCourse& c, double n, bool one) {
        const double none = std::numeric_limits<double>::quiet_NaN();
        const RandomTube& t = c.tube;
        table.add({std::move(seed),
                   one ? t.radius : none,
                   one ? t.segment_length : none,
                   one ? t.rigidity : none,
                   one ? t.wall_stiffness : none,
                   n,
                   static_cast<double>(c.reached),
                   static_cast<double>(c.pushes),
                   static_cast<double>(c.unconverged),
                   static_cast<double>(c.restless),
                   static_cast<double>(c.folds),
                   static_cast<double>(c.deep),
                   static_cast<double>(c.refused),
                   static_cast<double>(c.flat),
                   static_cast<double>(c.over_work),
                   static_cast<double>(c.gave_way),
                   c.gradient,
                   c.excess,
                   static_cast<double>(c.steps),
                   quantile(c.times, 0.5),
                   quantile(c.times, 0.99),
                   quantile(c.times, 0.999),
                   quantile(c.times, 1)});
    };
    for (const TubeCourse& c : courses) {
        row(static_cast<double>(c.seed), c, c.tube.segments, true);
        ++tubes;
        segments += c.tube.segments, reached += c.reached;
        sum.pushes += c.pushes, sum.unconverged += c.unconverged, sum.restless += c.restless;
        sum.folds += c.folds, sum.deep += c.deep, sum.refused += c.refused, sum.flat += c.flat;
        sum.over_work += c.over_work, sum.gave_way += c.gave_way, sum.steps += c.steps;
        sum.gradient = std::max(sum.gradient, c.gradient), sum.excess = std::max(sum.excess, c.excess);
        sum.times.insert(sum.times.end(), c.times.begin(), c.times.end());
    }
    sum.reached = reached;
    row(fmt::format("all {}", tubes), sum, segments, false);
    return table;
}

io::Table wild_table(const std::vector<WildRun>& runs, int hands) {
    io::Table table{"robustness_hands",
                    {"scenario",
                     "hands",
                     "frames",
                     "most_segments",
                     "not_at_rest",
                     "largest_gradient",
                     "folds",
                     "joints_outside",
                     "frames_with_joints_outside",
                     "frames_reported_to_cross",
                     "beyond_force",
                     "beyond_force_mm",
                     "frames_out_of_an_end",
                     "refused",
                     "settling",
                     "settling_percent",
                     "lagging",
                     "largest_lag_mm",
                     "deepest_mm",
                     "largest_force_N",
                     "median_ms",
                     "p99_ms",
                     "max_ms"},
                    {}};
    const auto row = [&](const std::string& name, const WildTally& t) {
        const auto n = [](int count) { return static_cast<double>(count); };
        table.add({name,
                   fmt::format("1 to {}", hands),
                   n(t.frames),
                   n(t.segments),
                   n(t.restless),
                   t.gradient,
                   n(t.folds),
                   n(t.outside),
                   n(t.outside_frames),
                   n(t.reported_crossings),
                   n(t.beyond_force),
                   t.beyond_force_by,
                   n(t.left),
                   n(t.refused),
                   n(t.settling),
                   100.0 * t.settling / t.frames,
                   n(t.lagging),
                   t.largest_lag,
                   t.deepest,
                   t.largest_force,
                   quantile(t.times, 0.5),
                   quantile(t.times, 0.99),
                   quantile(t.times, 1)});
    };
    WildTally all;
    for (const WildRun& run : runs) {
        row(run.scenario, run.tally);
        all.add(run.tally);
    }
    row("all", all);
    return table;
}

io::Table incident_table(const std::vector<TubeCourse>& courses, const std::vector<WildRun>& runs) {
    io::Table table{"robustness_incidents", {"where", "seed", "push_or_frame", "what"}, {}};
    const auto add = [&](const Incident& i) {
        if (table.rows.size() < most_incidents)
            table.add({i.where, static_cast<double>(i.seed), static_cast<double>(i.at), i.what});
    };
    for (const TubeCourse& c : courses) std::for_each(c.incidents.begin(), c.incidents.end(), add);
    for (const WildRun& r : runs) std::for_each(r.tally.incidents.begin(), r.tally.incidents.end(), add);
    return table;
}

/// The last row as a table of two columns.
io::Table totals(const io::Table& tubes) {
    io::Table table{"", {"all tubes", ""}, {}};
    for (std::size_t k = 6; k < tubes.columns.size(); ++k)
        table.add({tubes.columns[k], tubes.rows.back()[k]});
    return table;
}

/// The scenarios as columns.
io::Table transposed(const io::Table& hands) {
    io::Table table{"", {"wild hands"}, {}};
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
    none(hands, "frames_with_joints_outside", "wild hands: frames with joints outside the raw mesh",
         "by five rays; frames that report a crossing and what is beyond an open end do not count");
    none(hands, "beyond_force", "wild hands: joints deeper than their force explains",
         "distance to the raw mesh against force over stiffness; by more than 0.15 mm");
    none(hands, "refused", "wild hands: frames in which a motion was refused",
         "the hub found no rest for it, however small its parts");
    const std::size_t all = hands.rows.size() - 1;
    for (const auto& [column, most] : {std::pair{"p99_ms", 33.0}, {"max_ms", 66.0}}) {
        const double found = hands.number(all, column);
        claims.push_back({fmt::format("wild hands: processor time of a frame, {}", column), most, found,
                          found <= most, "At most.", ClaimKind::Machine});
    }
    for (std::size_t r = 0; r < all; ++r) {
        const double share = hands.number(r, "settling_percent");
        claims.push_back({fmt::format("wild hands in {}: frames that show an earlier rest [%]",
                                      std::get<std::string>(hands.rows[r].front())),
                          5.0, share, share <= 5, "At most: the wire shown is on its way to rest."});
    }
    return claims;
}

io::Plot picture(bool hands) {
    io::Plot plot{"robustness", "", 1250, 560};
    plot.commands =
        "set multiplot layout 1,2\nset bmargin 9\nset grid lc rgb '#dddddd'\nset logscale xyz\nset logscale "
        "cb\n"
        "set title 'Random tubes: slowest push'\nset xlabel 'EI [N·mm²]'\nset ylabel 'k [N/mm]'\n"
        "set cblabel 'processor time [ms]'\nset xrange [4:2500]\nset yrange [0.8:1250]\n"
        "set palette defined (0 '#0072B2', 1 '#56B4E9', 2 '#F0E442', 3 '#E69F00', 4 '#D55E00')\n"
        "set key below\n"
        "plot 'robustness_tubes.csv' skip 1 using 4:5:(0.4+$2/3):22 with points pt 7 ps variable lc palette "
        "title 'a tube; the larger, the wider', \\\n"
        "     '' skip 1 using ($9+$10+$11+$12+$13+$15 > 0 ? $4 : 1/0):5 with points pt 2 ps 2 lw 2 lc rgb "
        "'black' title 'with an incident'\n";
    if (hands)
        plot.commands +=
            "unset logscale\nset logscale y\nset title 'Wild hands: time of a frame'\nunset colorbox\n"
            "set xlabel ''\nset ylabel 'processor time [ms]'\nset offsets 0.6,0.6,0,0\nset autoscale x\nset "
            "bmargin 9\nset yrange [0.05:*]\n"
            "set xtics rotate by -60 noenhanced font ',9'\n"
            "plot 'robustness_hands.csv' skip 1 using 0:23:xtic(1) with points pt 9 ps 1.4 lc rgb '#D55E00' "
            "title 'longest', \\\n"
            "     '' skip 1 using 0:22 with points pt 7 ps 1.4 lc rgb '#E69F00' title '99 %', \\\n"
            "     '' skip 1 using 0:21 with points pt 5 ps 1.4 lc rgb '#0072B2' title 'median'\n";
    plot.commands += "unset multiplot\n";
    plot.caption =
        "Left: each random tube by the wire's EI and the wall's stiffness, its colour the slowest push, a "
        "cross where anything came about that should not. Right: processor time of a frame under a wild "
        "hand.";
    return plot;
}

}  // namespace

StudyResult run_robustness(const StudyOptions& options) {
    const int pushes = options.quick ? 300 : 20'000, frames = options.quick ? 150 : 20'000;
    Tally tally(options, pushes + frames);
    const std::vector<TubeCourse> courses = push_all(options, pushes, tally);
    const std::vector<WildRun> runs = play_all(options, frames, tally);

    StudyResult result;
    io::Table tubes = tube_table(courses), hands = wild_table(runs, hand_count(options)),
              incidents = incident_table(courses, runs);
    result.claims = claims_of(tubes, hands, courses);
    result.plots = {picture(!runs.empty())};
    const std::string introduction = fmt::format(
        "**Random tubes.** Seeds 0 to {}, {} pushes: radius 1 to 6 mm, λ 0.5 to 3 mm, EI 5 to 2000 N·mm² and "
        "k 1 to 1000 N/mm of equal odds by their logarithm, N 50 to 400, arcs about any axis with radii from "
        "1.2 times the lumen's. A wire without a curved tip is laid along the first {} segments and pushed "
        "by one segment at a time, from rest to rest, without a budget, until all of it is in.\n\n**Wild "
        "hands.** Hands 1 to {} play {} frames in all scenarios that ship and in three meshes from elsewhere "
        "where these are to be had (the folder SELDINGER_REAL_MESHES): pushes and pulls of up to 30 mm and "
        "turns of up to 360° in one frame, under the budget of a frame. Every frame shown is judged by the "
        "exact gradient, by rays against the raw mesh, and by the distance from it. Where there are several "
        "devices the hand chooses every ten frames which it holds, or all. A frame lags where motion waits "
        "for the next.\n\nEach incident with its seed is in robustness_incidents.csv. Processor times depend "
        "on the machine; nothing is judged by them.\n\n"
        "{}\n{}\n{}",
        courses.size() - 1, pushes, segments_at_start, hand_count(options), frames,
        io::to_markdown(totals(tubes), 3), io::to_markdown(transposed(hands), 3),
        incidents.rows.empty() ? std::string("There was no incident.\n")
                               : io::to_markdown(first_rows(incidents, 40)));
    result.tables = {std::move(tubes), std::move(hands), std::move(incidents)};
    result.page = claims_page("robustness", "Does anything a hand may do break the wire?", introduction,
                              result, options);
    return result;
}

}  // namespace studies
