#include "engine/studies/pareto.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>

#include "engine/cpu_clock.h"
#include "engine/parallel.h"
#include "engine/relax_method.h"
#include "engine/scenes.h"
#include "engine/studies/slow_flow.h"
#include "engine/studies/stability_cell.h"
#include "physics/energy.h"
#include "physics/tube_wall.h"

namespace engine {
namespace {

constexpr std::array<double, 4> kAccuracies = {1, 0.1, 0.01, 0.001};  // [mm]

struct Method {
    std::string name;
    physics::RelaxerConfig config;
    std::string look;  // of its line in the picture
};

std::vector<Method> methods(bool quick) {
    const auto named = [](const std::string& word, const std::string& look) {
        return Method{word, parse_method(word), look};
    };
    // Okabe and Ito's colours; fixed separations are dashed in the colour of their M.
    std::vector<Method> list = {
        named("first-order", "lc rgb '#999999'"), named("segment:1", "lc rgb '#E69F00'"),
        named("segment:2", "lc rgb '#0072B2'"), named("segment:3", "lc rgb '#009E73'"),
        named("global", "lc rgb '#D55E00' lw 2")};
    if (quick) return list;
    list.push_back(named("segment:4", "lc rgb '#CC79A7'"));
    list.push_back(named("segment:5", "lc rgb '#56B4E9'"));
    for (const int delta : {5, 15, 25}) {
        list.push_back(named(fmt::format("segment:2:{}", delta), "lc rgb '#0072B2' dt 3"));
        list.push_back(named(fmt::format("segment:3:{}", delta), "lc rgb '#009E73' dt 3"));
    }
    Method plain = named("segment:2", "lc rgb '#0072B2' dt 5"),
           uniform = named("segment:2", "lc rgb '#0072B2' dt 4");
    plain.name += " plain";
    plain.config.safeguard = false;
    uniform.name += " uniform order";
    uniform.config.order = physics::CycleOrder::Uniform;
    list.push_back(plain);
    list.push_back(uniform);
    return list;
}

struct Tube {
    std::string name;
    std::shared_ptr<const physics::TubeWall> wall;
    physics::Guidewire start;
};

std::vector<Tube> tubes(bool quick) {
    std::vector<Tube> list;
    for (const char* name : {"sinuous", "spatial", "hairpin"}) {
        const Scene& scene = *find_scene(name);
        const physics::Polyline path = draw(scene.path);
        physics::GuidewireSpec spec;
        spec.segment_length = scene.segment_length;
        spec.shaft_rigidity = spec.tip_rigidity = scene.rigidity;
        spec.curved_length = spec.curved_angle = 0;
        list.push_back({name, std::make_shared<physics::TubeWall>(path, scene.radius, scene.wall_stiffness),
                        physics::wire_along(spec, path, quick ? 60 : scene.segments)});
        // The first search for every joint's station belongs to no method.
        physics::Guidewire& wire = list.back().start;
        const auto contacts = physics::all_contacts(wire, *list.back().wall);
        for (std::size_t i = 0; i < contacts.size(); ++i) wire.stations[i] = contacts[i].station;
        if (quick) break;
    }
    return list;
}

/// One method on one tube, looked at after 1, 2, 4, … sweeps' worth of updates.
struct Course {
    std::vector<CostPoint> points;
    std::vector<long long> updates;
    double energy = 0;  // where its end comes to rest [N·mm]
};

Course follow(const Tube& tube, const Method& method, int series, int cycles) {
    Course course;
    physics::Guidewire wire = tube.start;
    const auto relaxer = physics::make_relaxer(method.config);
    const int n = wire.segments();
    const long long all = static_cast<long long>(cycles) * n * (n + 1) / 2;
    std::vector<std::vector<physics::Vec3>> seen;
    double cpu = 0;
    long long done = 0;
    bool at_rest = false;
    for (long long goal = n; goal <= all && !at_rest; goal *= 2) {
        const double start = thread_cpu_seconds();
        const auto report = relaxer->relax(wire, *tube.wall, {static_cast<int>(goal - done), 0.0, 0});
        cpu += thread_cpu_seconds() - start;
        done += report.updates;
        at_rest = report.converged;
        course.points.push_back({series, cpu, 0});
        course.updates.push_back(done);
        seen.push_back(wire.joints);
        done = at_rest ? done : goal;
    }
    course.energy = flow_to_rest(wire, *tube.wall).energy;
    for (std::size_t k = 0; k < seen.size(); ++k)
        course.points[k].deviation = largest_deviation(seen[k], wire.joints, Symmetry::None);
    return course;
}

/// For each tube and accuracy the method that is there, to stay, in the least time.
Table best_table(const std::vector<Tube>& vessels, const std::vector<Method>& list,
                 const std::vector<Course>& courses) {
    Table table{
        "pareto_best", {"tube", "accuracy_mm", "method", "updates", "cpu_ms", "first_order_cpu_ms"}, {}};
    const double none = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t t = 0; t < vessels.size(); ++t) {
        for (const double accuracy : kAccuracies) {
            int best = -1, at = -1;
            double first_order = none;
            for (std::size_t m = 0; m < list.size(); ++m) {
                const auto& points = courses[t * list.size() + m].points;
                const int settled = settled_at(points, accuracy);
                if (settled < 0) continue;
                if (m == 0) first_order = 1e3 * points[settled].cpu;
                if (best < 0 || points[settled].cpu < courses[t * list.size() + best].points[at].cpu)
                    best = static_cast<int>(m), at = settled;
            }
            if (best < 0) {
                table.add({vessels[t].name, accuracy, std::string("none"), none, none, none});
                continue;
            }
            const Course& course = courses[t * list.size() + best];
            table.add({vessels[t].name, accuracy, list[best].name, static_cast<double>(course.updates[at]),
                       1e3 * course.points[at].cpu, first_order});
        }
    }
    return table;
}

Plot front_plot(const std::vector<Tube>& vessels, const std::vector<Method>& list) {
    const std::size_t panels = vessels.size() + 1;  // the last holds the key
    Plot plot{"pareto", "", 400 * static_cast<int>(panels), 560};
    std::string& text = plot.commands;
    text = fmt::format(
        "set multiplot layout 1,{}\nset logscale xy\nset format x '10^{{%L}}'\nset format y '10^{{%L}}'\n"
        "set xlabel 'processor time [s]'\nset grid lc rgb '#bbbbbb'\nset yrange [1e-7:30]\nunset key\n",
        panels);
    for (std::size_t t = 0; t < vessels.size(); ++t) {
        text += fmt::format("set title '{}'\n", vessels[t].name);
        text += t == 0 ? "set ylabel 'farthest joint from rest [mm]'\n" : "unset ylabel\n";
        text += "plot ";
        for (const Method& method : list)
            text += fmt::format(
                "'pareto.csv' skip 1 using (strcol(1) eq '{}' && strcol(2) eq '{}' ? $4 : 1/0):5 with lines "
                "{}, \\\n     ",
                vessels[t].name, method.name, method.look);
        text += fmt::format(
            "'pareto_front.csv' skip 1 using (strcol(1) eq '{}' ? $3 : 1/0):4 with points pt 7 ps 0.6 lc rgb "
            "'black'\n",
            vessels[t].name);
    }
    text +=
        "unset logscale\nunset title\nunset xlabel\nunset ylabel\nunset tics\nunset border\nunset grid\n"
        "set yrange [0:1]\nset xrange [0:1]\nset key center center font ',11'\nplot ";
    for (const Method& method : list)
        text += fmt::format("-1 with lines {} title '{}', \\\n     ", method.look, method.name);
    text +=
        "-1 with points pt 7 ps 0.6 lc rgb 'black' title 'nothing is faster and nearer'\nunset multiplot\n";
    return plot;
}

}  // namespace

std::vector<int> pareto_front(std::span<const CostPoint> points) {
    std::vector<int> order(points.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int a, int b) {
        return std::pair(points[a].cpu, points[a].deviation) < std::pair(points[b].cpu, points[b].deviation);
    });
    std::vector<int> front;
    double least = std::numeric_limits<double>::infinity();
    for (const int i : order) {
        if (points[i].deviation < least) least = points[i].deviation, front.push_back(i);
    }
    return front;
}

int settled_at(std::span<const CostPoint> points, double accuracy) {
    int first = -1;
    for (int i = static_cast<int>(points.size()) - 1; i >= 0 && points[i].deviation <= accuracy; --i)
        first = i;
    return first;
}

StudyResult run_pareto(const StudyOptions& options) {
    const std::vector<Tube> vessels = tubes(options.quick);
    const std::vector<Method> list = methods(options.quick);
    const int columns = static_cast<int>(list.size()), count = columns * static_cast<int>(vessels.size());
    const int cycles = options.quick ? 20 : 164;  // 200·2^14 updates at N = 200
    std::vector<Course> courses(static_cast<std::size_t>(count));
    std::mutex telling;
    int done = 0;
    for_each_index(count, options.threads, [&](int k) {
        courses[k] = follow(vessels[k / columns], list[k % columns], k, cycles);
        const std::lock_guard lock(telling);
        ++done;
        if (options.progress)
            options.progress({done, count, vessels[k / columns].name + ", " + list[k % columns].name});
    });

    Table all{"pareto", {"tube", "method", "updates", "cpu_s", "deviation_mm", "rest_energy_N_mm"}, {}};
    Table front{"pareto_front", {"tube", "method", "cpu_s", "deviation_mm"}, {}};
    for (std::size_t t = 0; t < vessels.size(); ++t) {
        std::vector<CostPoint> points;
        for (int m = 0; m < columns; ++m) {
            const Course& course = courses[t * list.size() + m];
            points.insert(points.end(), course.points.begin(), course.points.end());
            for (std::size_t k = 0; k < course.points.size(); ++k)
                all.add({vessels[t].name, list[m].name, static_cast<double>(course.updates[k]),
                         course.points[k].cpu, course.points[k].deviation, course.energy});
        }
        for (const int i : pareto_front(points))
            front.add(
                {vessels[t].name, list[points[i].series % columns].name, points[i].cpu, points[i].deviation});
    }
    StudyResult result;
    const Table best = best_table(vessels, list, courses);
    result.page =
        "# What accuracy costs\n\nGenerated by `seldinger study pareto" +
        std::string(options.quick ? " --quick" : "") +
        "`; never edited by hand. Every method starts with the wire on the tube's centreline and is looked "
        "at after 1, 2, "
        "4, … sweeps' worth of segment updates. The deviation is that of the farthest joint from where the "
        "method's own end comes to rest (slow flow to a gradient over C of 1e-9), so that another basin is "
        "no error; "
        "times are processor time of one thread.\n\n![Time against deviation](pareto.svg)\n\n## Which method "
        "for "
        "which accuracy\n\nThe least time after which the deviation stays within the accuracy; – where first "
        "order never does.\n\n" +
        to_markdown(best, 3) + "\n## The front\n\nNo method is both faster and nearer than these.\n\n" +
        to_markdown(front, 3);
    result.tables = {std::move(all), std::move(front), best};
    result.plots = {front_plot(vessels, list)};
    return result;
}

}  // namespace engine
