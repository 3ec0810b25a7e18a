#include "engine/studies/pareto_measure.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <map>

#include "engine/io/cpu_clock.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/slow_flow.h"
#include "physics/relax/relaxer.h"

namespace studies {
namespace {

/// The wire through these joints; a rival's segments may be a little longer or shorter than λ.
Chain through(Chain wire, const std::vector<Vec3>& joints) {
    for (int i = 1; i <= wire.segments(); ++i) wire.tangents[i] = (joints[i] - joints[i - 1]).normalized();
    physics::rebuild_joints(wire);
    return wire;
}

struct End {
    std::vector<std::vector<Vec3>> seen;
    ParetoCourse course;
};

/// Looks whenever 15 % more work is done. A Newton method is looked at after `newton` times as many steps, or
/// after each where that is 1: in a dead end the global relaxer needs more than a step's budget to get out.
End watch(ParetoRunner& runner, const Chain& start, const ParetoMethod& method, int most, int series,
          double newton) {
    End end;
    runner.start(start);
    double cpu = 0;
    int done = 0;
    bool over = false;
    for (double goal = method.first; done < most && !over;
         goal = std::max(goal + 1, (method.newton ? newton : 1.15) * goal)) {
        const int rounds = std::min(static_cast<int>(goal), most) - done;
        if (rounds < 1) continue;
        const double begin = io::thread_cpu_seconds();
        over = runner.advance(rounds);
        cpu += io::thread_cpu_seconds() - begin;
        done += rounds;
        end.course.points.push_back({series, cpu, 0});
        end.course.work.push_back(runner.work());
        end.seen.push_back(runner.joints());
    }
    end.course.end = runner.end();
    return end;
}

/// Finds the rest that the course's end leads to, and how far from it every look was.
ParetoCourse measured(End end, const ParetoVessel& vessel, const Chain& start, const Chain& rest) {
    ParetoCourse& course = end.course;
    Chain own = through(start, end.seen.back());
    const SlowFlowReport flow = flow_to_rest(own, *vessel.wall);
    course.energy = flow.energy;
    course.gradient = flow.gradient;
    course.basin = farthest_joint(own, rest);
    for (std::size_t k = 0; k < end.seen.size(); ++k)
        course.points[k].deviation = farthest_joint(end.seen[k], own.joints);
    return course;
}

int part(const ParetoMethod& method, int most, double fraction) {
    return method.newton ? most : std::max(1, static_cast<int>(most * fraction));
}

}  // namespace

ParetoCourse from_centreline(const ParetoVessel& vessel, const ParetoMethod& method, int series,
                             double fraction) {
    const Chain start = vessel.wire(vessel.segments);
    const Chain rest = global_rest(*vessel.wall, start).wire;
    const auto runner = method.make(vessel, false);
    return measured(watch(*runner, start, method, part(method, method.most_cold, fraction), series, 2),
                    vessel, start, rest);
}

std::vector<ParetoPush> pareto_pushes(const ParetoVessel& vessel, int count) {
    const auto relaxer = physics::make_relaxer({}, *vessel.wall);
    const int first = std::max(2, static_cast<int>(0.4 * vessel.segments));
    Chain wire = vessel.wire(first);
    relaxer->relax(wire, {1'000'000'000, 0, 0});
    std::vector<ParetoPush> list;
    while (wire.segments() < vessel.segments) {
        ParetoPush push{wire, {}, {}};
        physics::move(wire, wire.grid.segment_length);
        push.pushed = wire;
        relaxer->relax(wire, {1'000'000'000, 0, 0});
        push.rest = wire;
        const int made = static_cast<int>(list.size());
        if (wire.segments() - first >= static_cast<int>((made + 1.0) * (vessel.segments - first) / count))
            list.push_back(std::move(push));
    }
    return list;
}

ParetoCourse course_of(const ParetoVessel& vessel, const ParetoMethod& method, const ParetoPush& push,
                       int series, double fraction) {
    const auto runner = method.make(vessel, true);
    runner->remember(push.before);
    return measured(watch(*runner, push.pushed, method, part(method, method.most_push, fraction), series, 1),
                    vessel, push.pushed, push.rest);
}

ParetoFloor floor_of(const ParetoVessel& vessel, const ParetoMethod& method, double fraction) {
    const Chain rest = global_rest(*vessel.wall, vessel.wire(vessel.segments)).wire;
    const auto runner = method.make(vessel, false);
    const ParetoCourse course = measured(
        watch(*runner, rest, method, part(method, 2 * method.most_cold, fraction), 0, 2), vessel, rest, rest);
    return {course.points.back().deviation, course.end};
}

namespace {

/// 3.21e-3 as "3·10⁻³", 0.0123 as "0.012".
std::string millimetres(double mm) {
    if (mm >= 9.5e-4) return fmt::format("{:.2g}", mm);
    return fmt::format("{:.0e}", mm);
}

std::string cell(const ParetoSpeed& s) {
    if (!std::isfinite(s.cpu_ms)) return s.reached > 0 ? fmt::format("– ({:.0f} %)", 100 * s.reached) : "–";
    return fmt::format("{} ms; {} queries, {} solves{}", two_digits(s.cpu_ms),
                       two_digits(s.work.wall_queries), two_digits(s.work.solves),
                       s.reached < 1 ? fmt::format(" ({:.0f} %)", 100 * s.reached) : "");
}

}  // namespace

double median(std::vector<double> values) {
    if (values.empty()) return no_figure;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

std::string two_digits(double x) {
    if (!(std::abs(x) >= 100) || std::abs(x) >= 1e5) return fmt::format("{:.2g}", x);
    const double unit = std::pow(10, std::floor(std::log10(std::abs(x))) - 1);
    return fmt::format("{:.0f}", unit * std::round(x / unit));
}

std::vector<double> curve_accuracies() {
    std::vector<double> list;
    for (int k = 0; k <= 24; ++k) list.push_back(std::pow(10, -0.25 * k));
    return list;
}

ParetoSpeed speed_at(const ParetoCourses& courses, double accuracy) {
    constexpr double never = std::numeric_limits<double>::infinity();
    std::vector<double> cpu, queries, solves, rounds;
    ParetoSpeed speed;
    for (const ParetoCourse* course : courses) {
        const int at = settled_at(course->points, accuracy);
        cpu.push_back(at < 0 ? never : 1e3 * course->points[at].cpu);
        queries.push_back(at < 0 ? never : course->work[at].wall_queries);
        solves.push_back(at < 0 ? never : course->work[at].solves);
        rounds.push_back(at < 0 ? never : course->work[at].rounds);
        speed.reached += at >= 0;
    }
    speed.reached /= static_cast<double>(courses.size());
    const auto finite = [](double x) { return std::isfinite(x) ? x : no_figure; };
    speed.cpu_ms = finite(median(cpu));
    speed.work = {finite(median(rounds)), finite(median(queries)), finite(median(solves))};
    return speed;
}

std::string cannot_reach(const ParetoMethod& method, const ParetoCourses& courses, double floor) {
    double best = no_figure;
    for (const double accuracy : table_accuracies)
        if (std::isfinite(speed_at(courses, accuracy).cpu_ms)) best = accuracy;
    if (best == table_accuracies[std::size(table_accuracies) - 1]) return "";
    std::vector<double> left, spent, rounds;
    std::map<std::string, int> ends;
    for (const ParetoCourse* course : courses) {
        left.push_back(course->points.back().deviation);
        spent.push_back(1e3 * course->points.back().cpu);
        rounds.push_back(course->work.back().rounds);
        ++ends[course->end];
    }
    std::string text =
        std::isfinite(best) ? fmt::format("under {:g} mm: ", best) : std::string("any of these: ");
    const int all = static_cast<int>(courses.size());
    if (ends["diverged"] > 0) text += fmt::format("diverges in {} of {} pushes; ", ends["diverged"], all);
    if (2 * ends["at rest"] > all)
        text += fmt::format("is at rest {} mm away, at a rest of its own", millimetres(median(left)));
    else
        text += fmt::format("{} mm are left after {:.0f} rounds, each {} ({:.0f} ms)",
                            millimetres(median(left)), median(rounds), method.round, median(spent));
    if (std::isfinite(floor)) text += fmt::format("; measured floor {} mm", millimetres(floor));
    return text;
}

io::Table speed_table(const std::vector<ParetoMethod>& methods, const std::vector<ParetoCourses>& courses,
                      const std::vector<double>& floors) {
    io::Table table{"pareto_speed", {"method"}};
    for (const double accuracy : table_accuracies)
        table.columns.push_back(fmt::format("within {:g} mm", accuracy));
    table.columns.insert(table.columns.end(), {"floor_mm", "cannot reach"});
    for (std::size_t m = 0; m < methods.size(); ++m) {
        std::vector<io::TableCell> row = {methods[m].name};
        for (const double accuracy : table_accuracies) row.emplace_back(cell(speed_at(courses[m], accuracy)));
        row.emplace_back(floors[m]);
        row.emplace_back(cannot_reach(methods[m], courses[m], floors[m]));
        table.add(std::move(row));
    }
    return table;
}

io::Table curves_table() {
    return {
        "pareto_curves",
        {"vessel", "method", "accuracy_mm", "push_cpu_ms", "reached", "rounds", "wall_queries", "solves"}};
}

void add_curves(io::Table& table, const std::string& vessel, const std::vector<ParetoMethod>& methods,
                const std::vector<ParetoCourses>& courses) {
    for (std::size_t m = 0; m < methods.size(); ++m)
        for (const double accuracy : curve_accuracies()) {
            const ParetoSpeed s = speed_at(courses[m], accuracy);
            table.add({vessel, methods[m].name, accuracy, s.cpu_ms, s.reached, s.work.rounds,
                       s.work.wall_queries, s.work.solves});
        }
}

io::Table best_table(const std::vector<ParetoVessel>& vessels, const std::vector<ParetoMethod>& methods,
                     const std::vector<ParetoCourse>& courses) {
    io::Table table{"pareto_best",
                    {"vessel", "accuracy_mm", "method", "rounds", "cpu_ms", "paper_method", "paper_cpu_ms"}};
    for (std::size_t v = 0; v < vessels.size(); ++v) {
        for (const double accuracy : table_accuracies) {
            // The best of all, and the best of the paper's.
            int best[2] = {-1, -1}, at[2] = {-1, -1};
            for (std::size_t m = 0; m < methods.size(); ++m) {
                const auto& points = courses[v * methods.size() + m].points;
                const int settled = settled_at(points, accuracy);
                if (settled < 0) continue;
                for (int k = 0; k < (methods[m].family == Family::Paper ? 2 : 1); ++k)
                    if (best[k] < 0 ||
                        points[settled].cpu < courses[v * methods.size() + best[k]].points[at[k]].cpu)
                        best[k] = static_cast<int>(m), at[k] = settled;
            }
            const auto name = [&](int k) {
                return best[k] < 0 ? std::string("none") : methods[best[k]].name;
            };
            const auto cpu = [&](int k) {
                return best[k] < 0 ? no_figure
                                   : 1e3 * courses[v * methods.size() + best[k]].points[at[k]].cpu;
            };
            const double rounds =
                best[0] < 0 ? no_figure : courses[v * methods.size() + best[0]].work[at[0]].rounds;
            table.add({vessels[v].name, accuracy, name(0), rounds, cpu(0), name(1), cpu(1)});
        }
    }
    return table;
}

}  // namespace studies
