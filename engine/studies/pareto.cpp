#include "engine/studies/pareto.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <memory>
#include <numeric>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/lumen_wall.h"
#include "engine/anatomy/scenes.h"
#include "engine/io/cpu_clock.h"
#include "engine/run/relax_method.h"
#include "engine/studies/slow_flow.h"
#include "engine/studies/work.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using geometry::Vec3;
using physics::Guidewire;

constexpr std::array<double, 4> accuracies = {1, 0.1, 0.01, 0.001};  // [mm]

struct Method {
    std::string name;
    physics::RelaxerConfig config;
    std::string look;   // of its line in the picture
    double length = 1;  // of its segments, in λ of the vessel: ½, 1 or 2
};

Method named(const std::string& word, const std::string& look) {
    return {word, run::parse_method(word), look};
}

/// Okabe and Ito's colours: one for each M; dashes show other variations.
constexpr const char* first_order_style = "lc rgb '#999999'";
constexpr const char* segment_styles[] = {
    "", "lc rgb '#E69F00'", "lc rgb '#0072B2'", "lc rgb '#009E73'", "lc rgb '#CC79A7'", "lc rgb '#56B4E9'"};
constexpr const char* global_style = "lc rgb '#D55E00' lw 2";

std::vector<Method> methods(bool quick) {
    std::vector<Method> list = {named("first-order", first_order_style)};
    for (int m = 1; m <= (quick ? 3 : 5); ++m)
        list.push_back(named(fmt::format("segment:{}", m), segment_styles[m]));
    list.push_back(named("global", global_style));
    const auto vary = [&](const char* word, const std::string& what, const std::string& look, double length) {
        list.push_back(named(word, look));
        list.back().name += " " + what;
        list.back().length = length;
        return &list.back().config;
    };
    vary("global", "λ × 2", "lc rgb '#D55E00' dt 3", 2);
    if (quick) return list;
    vary("global", "λ / 2", "lc rgb '#D55E00' dt 5", 0.5);
    vary("segment:2", "λ × 2", "lc rgb '#0072B2' dt 2", 2);
    for (const int delta : {5, 15, 25}) {
        list.push_back(named(fmt::format("segment:2:{}", delta), "lc rgb '#0072B2' dt 3"));
        list.push_back(named(fmt::format("segment:3:{}", delta), "lc rgb '#009E73' dt 3"));
    }
    vary("segment:2", "plain", "lc rgb '#0072B2' dt 5", 1)->safeguard = false;
    vary("segment:2", "uniform order", "lc rgb '#0072B2' dt 4", 1)->order = physics::CycleOrder::Uniform;
    return list;
}

struct Vessel {
    std::string name;
    std::shared_ptr<const physics::LumenWall> wall;
    geometry::Polyline path;
    physics::GuidewireSpec spec;
    int segments = 0;
    double stiffness = 0;  // k of a joint [N/mm]

    std::string text() const {
        return fmt::format("{}: N = {}, λ = {:g} mm, EI = {:g} N·mm² (tip {:g}), k = {:g} N/mm", name,
                           segments, spec.segment_length, spec.shaft_rigidity, spec.tip_rigidity, stiffness);
    }
    /// A wire on the centreline. The first search for every joint's station is not charged to any method.
    Guidewire wire(int n) const {
        Guidewire wire = physics::wire_along(spec, path, n);
        const auto contacts = physics::all_contacts(wire, *wall);
        for (std::size_t i = 0; i < contacts.size(); ++i) wire.stations[i] = contacts[i].station;
        return wire;
    }
};

Vessel scene_vessel(const char* name, bool quick) {
    const anatomy::Scene& scene = *anatomy::find_scene(name);
    Vessel v;
    v.name = name;
    v.path = anatomy::draw(scene.path);
    v.spec.end_cells = physics::EndCells::Paper;
    v.spec.segment_length = scene.segment_length;
    v.spec.shaft_rigidity = v.spec.tip_rigidity = scene.rigidity;
    v.spec.curved_length = v.spec.curved_angle = 0;
    v.segments = quick ? 60 : scene.segments;
    v.stiffness = scene.wall_stiffness;
    v.wall = std::make_shared<physics::TubeWall>(v.path, scene.radius, v.stiffness);
    return v;
}

/// The tube as about 50 000 triangles, whose distance field is the wall.
Vessel mesh_of(const char* name, const anatomy::ModelCache& cache) {
    Vessel v = scene_vessel(name, false);
    const anatomy::Scene& scene = *anatomy::find_scene(name);
    const anatomy::Anatomy tube = anatomy::tube_anatomy(v.name, v.path, scene.radius, 64, 0.1 * scene.radius);
    v.wall = anatomy::cached_distance_field(tube, scene.wall_stiffness, 0.0, cache);
    v.name += " mesh";
    return v;
}

/// From the left groin into the aorta, with a floppy-tipped wire that is straight when unloaded.
Vessel iliac(const StudyOptions& options) {
    const anatomy::Anatomy anatomy =
        anatomy::generated_anatomy(anatomy::vessel_preset("iliac-renal"), options.cache);
    Vessel v;
    v.name = "iliac mesh";
    v.path = anatomy::path_from(anatomy, *anatomy::find_end(anatomy, "aorta+LCIA+LEIA+LCFA.out")).points;
    v.spec.curved_length = v.spec.curved_angle = 0;
    v.segments = 165;
    v.stiffness = 5;
    v.wall = anatomy::cached_distance_field(anatomy, v.stiffness, 0.5 * v.spec.diameter, options.cache);
    return v;
}

std::vector<Vessel> all_vessels(const StudyOptions& options) {
    if (options.quick) return {scene_vessel("sinuous", true)};
    std::vector<Vessel> list;
    for (const char* name : {"sinuous", "spatial", "hairpin", "stiffwall"})
        list.push_back(scene_vessel(name, false));
    list.push_back(mesh_of("spatial", options.cache));
    list.push_back(iliac(options));
    return list;
}

/// The same wire with other segments; the wall is as stiff per length as before.
Guidewire with_segments(Guidewire wire, double length) {
    if (length > 1)
        for (int i = 1; i < wire.segments(); ++i) physics::merge_segments(wire, i);
    if (length < 1)
        for (int i = wire.segments(); i >= 1; --i) physics::split_segment(wire, i);
    return wire;
}

/// Largest distance of a joint that both wires have, by its place along the wire [mm].
double deviation(const Guidewire& a, const Guidewire& b) {
    double farthest = 0, along_a = 0, along_b = 0;
    const double same = 1e-6 * a.spec.segment_length;
    for (int i = 0, j = 0; i < a.segments() && j < b.segments();) {
        if (along_a < along_b + same)
            along_a += a.lengths[++i];
        else
            along_b += b.lengths[++j];
        if (std::abs(along_a - along_b) < same)
            farthest = std::max(farthest, (a.joints[i] - b.joints[j]).norm());
    }
    return farthest;
}

/// One method on one vessel, measured after 1, 2, 4, … sweeps' worth of updates.
struct Course {
    std::vector<CostPoint> points;
    std::vector<long long> updates;
    double energy = 0;  // where its end comes to rest [N·mm]
};

Course follow(const Vessel& vessel, const Method& method, int series, int cycles) {
    Course course;
    Guidewire wire = with_segments(vessel.wire(vessel.segments), method.length);
    const auto relaxer = physics::make_relaxer(method.config, *vessel.wall);
    const int n = wire.segments();
    const long long all = static_cast<long long>(cycles) * n * (n + 1) / 2;
    std::vector<Guidewire> seen;
    double cpu = 0;
    long long done = 0;
    bool at_rest = false;
    for (long long goal = n; goal <= all && !at_rest; goal *= 2) {
        const double start = io::thread_cpu_seconds();
        const auto report = relaxer->relax(wire, {static_cast<int>(goal - done), 0.0, 0});
        cpu += io::thread_cpu_seconds() - start;
        done += report.updates;
        at_rest = report.converged;
        course.points.push_back({series, cpu, 0});
        course.updates.push_back(done);
        seen.push_back(wire);
        done = at_rest ? done : goal;
    }
    // Another λ is compared with the rest of the vessel's own λ.
    Guidewire rest = method.length == 1 ? wire : vessel.wire(vessel.segments);
    if (method.length != 1) physics::make_relaxer({}, *vessel.wall)->relax(rest, {1'000'000'000, 0, 0});
    course.energy = flow_to_rest(rest, *vessel.wall).energy;
    for (std::size_t k = 0; k < seen.size(); ++k) course.points[k].deviation = deviation(seen[k], rest);
    return course;
}

/// One method under one budget, a wire pushed segment by segment.
struct PushCost {
    double cpu = 0;                  // median of a push [s]
    double usual = 0, farthest = 0;  // deviation from rest after a push: median and largest [mm]
};

PushCost push(const Vessel& vessel, const Method& method, int updates_per_segment, int pushes) {
    Guidewire wire = vessel.wire(vessel.segments - pushes);
    const auto polish = [&](Guidewire& w) {
        physics::make_relaxer({}, *vessel.wall)->relax(w, {1'000'000'000, 0, 0});
    };
    polish(wire);
    const auto relaxer = physics::make_relaxer(method.config, *vessel.wall);
    std::vector<double> times, deviations;
    for (int k = 0; k < pushes; ++k) {
        physics::insert_segment(wire);
        const double start = io::thread_cpu_seconds();
        relaxer->relax(wire, {updates_per_segment * wire.segments(), 0.75, 60});
        times.push_back(io::thread_cpu_seconds() - start);
        Guidewire rest = wire;
        polish(rest);
        deviations.push_back(deviation(wire, rest));
    }
    std::sort(times.begin(), times.end());
    std::sort(deviations.begin(), deviations.end());
    return {times[times.size() / 2], deviations[deviations.size() / 2], deviations.back()};
}

/// For each vessel and accuracy the method that reaches it, to stay, in the least time.
io::Table best_table(const std::vector<Vessel>& vessels, const std::vector<Method>& list,
                     const std::vector<Course>& courses) {
    io::Table table{
        "pareto_best", {"vessel", "accuracy_mm", "method", "updates", "cpu_ms", "first_order_cpu_ms"}, {}};
    const double none = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t t = 0; t < vessels.size(); ++t) {
        for (const double accuracy : accuracies) {
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

/// One panel for each vessel, the last for the key.
io::Plot panels(const std::string& name, const std::vector<Vessel>& vessels, const std::vector<Method>& list,
                const std::string& x_label, const std::string& y_label,
                const std::function<std::string(const Vessel&)>& curves, const std::string& last_key) {
    const int count = static_cast<int>(vessels.size()) + 1, columns = std::min(count, 4),
              rows = (count + columns - 1) / columns;
    io::Plot plot{name, "", 400 * columns, rows == 1 ? 560 : 420 * rows};
    std::string& text = plot.commands;
    text = fmt::format(
        "set multiplot layout {},{}\nset logscale xy\nset format x '10^{{%L}}'\nset format y '10^{{%L}}'\n"
        "set xlabel '{}'\nset ylabel '{}'\nset grid lc rgb '#bbbbbb'\nset yrange [1e-7:30]\nunset key\n",
        rows, columns, x_label, y_label);
    for (const Vessel& vessel : vessels)
        text += fmt::format("set title '{}'\nplot {}\n", vessel.name, curves(vessel));
    text +=
        "unset logscale\nunset title\nunset xlabel\nunset ylabel\nunset tics\nunset border\nunset grid\n"
        "set yrange [0:1]\nset xrange [0:1]\nset key center center font ',11'\nplot ";
    for (const Method& method : list)
        text += fmt::format("-1 with lines {} title '{}', \\\n     ", method.look, method.name);
    text += last_key + "\nunset multiplot\n";
    plot.caption = fmt::format("{}, {}. Down and to the left is better.", y_label, x_label);
    for (const Vessel& vessel : vessels) plot.caption += " " + vessel.text() + ".";
    return plot;
}

io::Plot front_plot(const std::vector<Vessel>& vessels, const std::vector<Method>& list) {
    const auto curves = [&](const Vessel& vessel) {
        std::string text;
        for (const Method& method : list)
            text += fmt::format(
                "'pareto.csv' skip 1 using (strcol(1) eq '{}' && strcol(2) eq '{}' ? $4 : 1/0):(column(5) > "
                "1e-7 ? column(5) : 1e-7) with lines "
                "{}, \\\n     ",
                vessel.name, method.name, method.look);
        return text + fmt::format(
                          "'pareto_front.csv' skip 1 using (strcol(1) eq '{}' ? $3 : 1/0):(column(4) > 1e-7 "
                          "? column(4) : 1e-7) with points "
                          "pt 7 ps 0.6 lc rgb 'black'",
                          vessel.name);
    };
    return panels("pareto", vessels, list, "processor time [s]", "farthest joint from rest [mm]", curves,
                  "-1 with points pt 7 ps 0.6 lc rgb 'black' title 'nothing is faster and nearer'");
}

io::Plot push_plot(const std::vector<Vessel>& vessels, const std::vector<Method>& list) {
    const auto curves = [&](const Vessel& vessel) {
        std::string text;
        for (const Method& method : list)
            text += fmt::format(
                "{}'pareto_push.csv' skip 1 using (strcol(1) eq '{}' && strcol(2) eq '{}' ? $4 : "
                "1/0):(column(6) > 1e-7 ? column(6) : 1e-7) with linespoints pt 7 ps 0.5 {}",
                text.empty() ? "" : ", \\\n     ", vessel.name, method.name, method.look);
        return text;
    };
    return panels("pareto_push", vessels, list, "median processor time of a push [s]",
                  "farthest joint from rest after any push [mm]", curves, "-1 notitle");
}

io::Table push_table(const std::vector<Vessel>& vessels, const std::vector<Method>& list,
                     const std::vector<int>& budgets, int pushes, Work& work) {
    const int columns = static_cast<int>(list.size()), depth = static_cast<int>(budgets.size());
    const int count = static_cast<int>(vessels.size()) * columns * depth;
    std::vector<PushCost> costs(static_cast<std::size_t>(count));
    work.run(count, [&](int k) {
        const Vessel& vessel = vessels[k / (columns * depth)];
        const Method& method = list[k / depth % columns];
        costs[k] = push(vessel, method, budgets[k % depth], pushes);
        return fmt::format("{}, {}, pushes", vessel.name, method.name);
    });
    io::Table table{"pareto_push",
                    {"vessel", "method", "updates_per_segment", "push_cpu_s", "median_deviation_mm",
                     "largest_deviation_mm"},
                    {}};
    for (int k = 0; k < count; ++k)
        table.add({vessels[k / (columns * depth)].name, list[k / depth % columns].name,
                   static_cast<double>(budgets[k % depth]), costs[k].cpu, costs[k].usual, costs[k].farthest});
    return table;
}

/// For each vessel and accuracy the method and budget with the cheapest pushes that all end within it.
io::Table best_push_table(const io::Table& pushes, const std::vector<Vessel>& vessels) {
    io::Table table{
        "pareto_push_best", {"vessel", "accuracy_mm", "method", "updates_per_segment", "push_cpu_ms"}, {}};
    for (const Vessel& vessel : vessels) {
        for (const double accuracy : accuracies) {
            const std::vector<io::TableCell>* best = nullptr;
            for (const auto& row : pushes.rows) {
                if (std::get<std::string>(row[0]) != vessel.name || std::get<double>(row[5]) > accuracy)
                    continue;
                if (!best || std::get<double>(row[3]) < std::get<double>((*best)[3])) best = &row;
            }
            const double none = std::numeric_limits<double>::quiet_NaN();
            if (best)
                table.add(
                    {vessel.name, accuracy, (*best)[1], (*best)[2], 1e3 * std::get<double>((*best)[3])});
            else
                table.add({vessel.name, accuracy, std::string("none"), none, none});
        }
    }
    return table;
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
    const std::vector<Vessel> vessels = all_vessels(options);
    const std::vector<Method> list = methods(options.quick);
    std::vector<Method> pushers = {named("first-order", first_order_style),
                                   named("segment:1", segment_styles[1]),
                                   named("segment:2", segment_styles[2]),
                                   named("segment:3", segment_styles[3]), named("global", global_style)};
    const std::vector<int> budgets =
        options.quick ? std::vector<int>{4, 32} : std::vector<int>{1, 2, 4, 8, 16, 32, 64, 128};
    const int columns = static_cast<int>(list.size()), count = columns * static_cast<int>(vessels.size());
    const int cycles = options.quick ? 20 : 164;  // 200·2^14 updates at N = 200
    const int pushes = options.quick ? 10 : 40;
    Work work(options, count + static_cast<int>(vessels.size() * pushers.size() * budgets.size()));
    std::vector<Course> courses(static_cast<std::size_t>(count));
    work.run(count, [&](int k) {
        courses[k] = follow(vessels[k / columns], list[k % columns], k, cycles);
        return vessels[k / columns].name + ", " + list[k % columns].name;
    });

    io::Table all{"pareto", {"vessel", "method", "updates", "cpu_s", "deviation_mm", "rest_energy_N_mm"}, {}};
    io::Table front{"pareto_front", {"vessel", "method", "cpu_s", "deviation_mm"}, {}};
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
    const io::Table best = best_table(vessels, list, courses);
    io::Table push_costs = push_table(vessels, pushers, budgets, pushes, work);
    const io::Table push_best = best_push_table(push_costs, vessels);

    StudyResult result;
    result.page = fmt::format(
        "# What accuracy costs\n\nGenerated by `seldinger study pareto{}`; never edited by hand. Times are "
        "processor time of one thread. The meshes' walls are distance fields.\n\n"
        "## From the centreline\n\nEvery method starts with the wire on the centreline and is looked at "
        "after "
        "1, 2, 4, … sweeps' worth of segment updates (a step of the global one counts N). The deviation is "
        "that of the farthest joint from where the method's own end comes to rest (slow flow to a gradient "
        "over "
        "C of 1e-9), so that another basin is no error. With other segments (λ × 2, λ / 2) it is that from "
        "the "
        "rest of the vessel's own λ, at the joints that both have: there the line ends at what λ makes of "
        "the "
        "curve.\n\n![Time against deviation](pareto.svg)\n\n### Which method for which accuracy\n\nThe "
        "least time after which the deviation stays within the accuracy; – where first order never does.\n\n"
        "{}\n"
        "## Pushed, under a budget\n\nThe last {} segments inserted one by one, each relaxed within a budget "
        "of so many updates a segment ({}), three quarters of them in the 60 segments at the tip where the "
        "method can choose. The deviation is that of the farthest joint from the rest that the state after "
        "the "
        "push leads to; the picture shows the largest of all pushes, drawn at 1e-7 where it is "
        "less.\n\n![Time "
        "of a push against deviation](pareto_push.svg)\n\n### Which method for which accuracy\n\n{}\n"
        "## The front of the first picture\n\nNo method is both faster and nearer than these.\n\n{}",
        options.quick ? " --quick" : "", io::to_markdown(best, 3), pushes, fmt::join(budgets, ", "),
        io::to_markdown(push_best, 3), io::to_markdown(front, 3));
    result.tables = {std::move(all), std::move(front), best, std::move(push_costs), push_best};
    result.plots = {front_plot(vessels, list), push_plot(vessels, pushers)};
    return result;
}

}  // namespace studies
