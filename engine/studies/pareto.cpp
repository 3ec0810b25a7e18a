#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "engine/io/plot.h"
#include "engine/io/table.h"
#include "engine/studies/claims.h"
#include "engine/studies/pareto_measure.h"
#include "engine/studies/pareto_methods.h"
#include "engine/studies/pareto_tables.h"
#include "engine/studies/runs.h"
#include "engine/studies/work.h"

namespace studies {
namespace {

constexpr double frame_ms = 1000.0 / 60;  // of a display of 60 frames a second

constexpr const char* log_axes =
    "set logscale xy\nset format x '10^{%L}'\nset format y '10^{%L}'\nset grid lc rgb '#dddddd'\n"
    "set datafile missing NaN\nset key off\n";

/// A method's rows of a table of vessel, method, …
std::string rows(const std::string& table, const std::string& vessel, const std::string& method,
                 const std::string& x, const std::string& y) {
    return fmt::format("'{}.csv' skip 1 using (strcol(1) eq '{}' && strcol(2) eq '{}' ? {} : NaN):({})",
                       table, vessel, method, x, y);
}

/// One panel for each vessel, the last for the key.
io::Plot panels(const std::string& name, const std::vector<ParetoVessel>& vessels,
                const std::vector<ParetoMethod>& methods, const std::string& axes,
                const std::function<std::string(const ParetoVessel&, const ParetoMethod&)>& curve) {
    const int count = static_cast<int>(vessels.size()) + 1, columns = std::min(count, count > 5 ? 4 : 3),
              deep = (count + columns - 1) / columns;
    io::Plot plot{name, "", 400 * columns, deep == 1 ? 560 : 420 * deep};
    plot.commands = fmt::format("set multiplot layout {},{}\n{}{}", deep, columns, log_axes, axes);
    for (const ParetoVessel& vessel : vessels) {
        plot.commands += fmt::format("set title '{}'\nplot ", vessel.name);
        for (const ParetoMethod& method : methods)
            plot.curve(fmt::format("{} with lines {}", curve(vessel, method), method.look));
        plot.commands += "\n";
    }
    plot.commands +=
        "unset logscale\nunset title\nunset xlabel\nunset ylabel\nunset tics\nunset border\nunset grid\n"
        "unset arrow\nunset label\n"
        "set yrange [0:1]\nset xrange [0:1]\nset key center center font ',11'\nplot ";
    for (const ParetoMethod& method : methods)
        plot.curve(fmt::format("-1 with lines {} title '{}'", method.look, method.name));
    plot.curve("-1 notitle\nunset multiplot\n");
    return plot;
}

struct Label {
    std::string text, colour;
    double x = 0, y = 0;  // end of the line: ms, mm
};

constexpr double column_ms = 1500;  // where names stand in a column

/// Names beside the ends of lines; where many lines end, in a column on the right with a thin leader.
std::string named(std::vector<Label> labels) {
    std::string text;
    std::sort(labels.begin(), labels.end(), [](const Label& a, const Label& b) { return a.y > b.y; });
    double least = 1e9;
    for (const Label& label : labels) {
        const std::string look = fmt::format("tc rgb '{}'", label.colour);
        if (label.x < 0.2 * frame_ms && label.y < 0.05) {
            text += fmt::format("set label '{}' at {},{} left offset 0.9,0 {}\n", label.text, label.x,
                                label.y, look);
            continue;
        }
        const double y = std::min(label.y, least);
        least = y * std::pow(10, -0.15);
        text += fmt::format("set label '{}' at {},{} left offset 0.4,0 {}\n", label.text, column_ms, y, look);
        text += fmt::format("set arrow from {},{} to {},{} nohead lc rgb '{}' lw 0.5 dt 3\n", 1.04 * label.x,
                            label.y, column_ms, y, label.colour);
    }
    return text;
}

/// The front page of the studies: time of a push against error at rest, all tubes together, from
/// pareto_curves.csv. `floors` [mm] are those of the rivals, NaN for others.
io::Plot speed_plot(const std::vector<ParetoMethod>& methods, const io::Table& curves,
                    const std::vector<double>& floors) {
    constexpr double top = 1.8, bottom = 4e-5;
    io::Plot plot{"pareto_speed", "", 1150, 720};
    plot.commands = fmt::format(
        "{}set xlabel 'processor time of a push, median [ms]' font ',14'\n"
        "set ylabel 'farthest joint from rest [mm]' font ',14'\nset tics font ',12'\n"
        "set xrange [0.02:60000]\nset yrange [{}:{}]\nset lmargin 11\nset rmargin 3\n"
        "set format x '%g'\nset xtics (0.1, 1, 10, 100, 1000)\n"
        "set arrow from {},graph 0 to {},graph 1 nohead lc rgb '#666666' dt 3 lw 1.5\n"
        "set label '16.7 ms: 60 frames/s' at {},graph 0.03 left offset 0.6,0 tc rgb '#666666'\n",
        log_axes, bottom, top, frame_ms, frame_ms, frame_ms);
    std::vector<Label> labels;
    std::string lines;
    for (std::size_t m = 0; m < methods.size(); ++m) {
        Label label{methods[m].name, methods[m].colour, 0, 0};
        for (std::size_t r = 0; r < curves.rows.size(); ++r) {
            if (curves.word(r, "vessel") != "all tubes" || curves.word(r, "method") != methods[m].name)
                continue;
            const double ms = curves.number(r, "push_cpu_ms"), mm = curves.number(r, "accuracy_mm");
            if (std::isfinite(ms) && mm > bottom) label.x = ms, label.y = mm;
        }
        if (label.x == 0) continue;
        if (std::isfinite(floors[m])) {
            label.text += fmt::format(" (floor {:.1g})", floors[m]);
        }
        labels.push_back(label);
        const auto part = [&](const std::string& condition, const std::string& look) {
            lines +=
                fmt::format("{}{} with {} {}", lines.empty() ? "plot " : ", \\\n     ",
                            rows("pareto_curves", "all tubes", methods[m].name,
                                 condition.empty() ? "$4" : fmt::format("({} ? $4 : NaN)", condition), "$3"),
                            condition.empty() ? "lines" : "points", look);
        };
        part("", methods[m].look);
        const std::string decade = "abs(log10($3)-floor(log10($3)+0.5)) < 0.01";
        const std::string colour = fmt::format("lc rgb '{}'", methods[m].colour);
        part(decade + " && $5 >= 1", "pt 7 ps 0.9 " + colour);
        part(decade + " && $5 < 1", "pt 6 ps 0.9 lw 1.5 " + colour);
    }
    plot.commands += named(labels);
    plot.commands += (lines.empty() ? "plot NaN" : lines) + "\n";
    return plot;
}

/// The same by tube.
io::Plot tubes_plot(const std::vector<ParetoVessel>& vessels, const std::vector<ParetoMethod>& methods) {
    const auto curve = [&](const ParetoVessel& vessel, const ParetoMethod& method) {
        return rows("pareto_curves", vessel.name, method.name, "$4", "$3");
    };
    io::Plot plot =
        panels("pareto_tubes", vessels, methods,
               fmt::format("set xlabel 'processor time of a push, median [ms]'\nset ylabel 'farthest joint "
                           "from rest [mm]'\nset xrange [0.02:3000]\nset yrange [1e-6:1.8]\nset arrow from "
                           "{0},graph 0 to {0},graph 1 nohead lc rgb '#666666' dt 3\n",
                           frame_ms),
               curve);
    plot.caption =
        "The same by tube: the median time after which the farthest joint stays within a distance of rest. "
        "Dotted: 16.7 ms, 60 frames a second. A line ends where less than half of the pushes get nearer.";
    for (const ParetoVessel& vessel : vessels) plot.caption += " " + vessel.text() + ".";
    return plot;
}

/// From the centreline, from pareto.csv.
io::Plot centreline_plot(const std::vector<ParetoVessel>& vessels, const std::vector<ParetoMethod>& methods) {
    const auto curve = [&](const ParetoVessel& vessel, const ParetoMethod& method) {
        return rows("pareto", vessel.name, method.name, "$4", "column(5) > 1e-7 ? column(5) : 1e-7");
    };
    io::Plot plot = panels("pareto", vessels, methods,
                           "set xlabel 'processor time [s]'\nset ylabel 'farthest joint from rest [mm]'\n"
                           "set yrange [1e-7:30]\n",
                           curve);
    plot.caption =
        "From the centreline to rest: the farthest joint's distance from rest [mm] against processor time "
        "[s]. Down and to the left is better. The rivals have no wall for meshes.";
    for (const ParetoVessel& vessel : vessels) plot.caption += " " + vessel.text() + ".";
    return plot;
}

constexpr double no_figure = std::numeric_limits<double>::quiet_NaN();

/// Sizes of the study. Work is a share of what each method may do at most.
struct Scale {
    int pushes, sweep_pushes;
    double push_work, sweep_work, cold_work, floor_work;
};
constexpr Scale full = {10, 3, 1, 0.5, 1, 0.25}, quick = {3, 1, 0.02, 0.02, 0.01, 0.01};

std::string cold_rows(const std::vector<ParetoVessel>& vessels, const std::vector<ParetoMethod>& methods,
                      const std::vector<ParetoCourse>& courses, io::Table& all, io::Table& front) {
    double farthest_basin = 0;
    for (std::size_t v = 0; v < vessels.size(); ++v) {
        std::vector<CostPoint> points;
        for (std::size_t m = 0; m < methods.size(); ++m) {
            const ParetoCourse& course = courses[v * methods.size() + m];
            points.insert(points.end(), course.points.begin(), course.points.end());
            farthest_basin = std::max(farthest_basin, course.basin);
            for (std::size_t k = 0; k < course.points.size(); ++k)
                all.add({vessels[v].name, methods[m].name, course.work[k].rounds, course.points[k].cpu,
                         course.points[k].deviation, course.work[k].wall_queries, course.work[k].solves,
                         course.energy, course.basin, course.end});
        }
        for (const int i : pareto_front(points))
            front.add({vessels[v].name, methods[points[i].series % methods.size()].name, points[i].cpu,
                       points[i].deviation});
    }
    return fmt::format("{:.2g}", farthest_basin);
}

/// Whether a method asks the wall more often than another, in the median of all pushes; one that does not get
/// there in half of them needs more than any that does.
bool needs_more(const ParetoSpeed& a, const ParetoSpeed& b) {
    if (!std::isfinite(b.work.wall_queries)) return false;
    return !std::isfinite(a.work.wall_queries) || a.work.wall_queries > b.work.wall_queries;
}

std::string needs(const ParetoSpeed& s) {
    const std::string share = fmt::format("{:.0f} % of the pushes", 100 * s.reached);
    return std::isfinite(s.work.wall_queries)
               ? fmt::format("{}, {:.0f} wall queries in the median", share, s.work.wall_queries)
               : share;
}

void claim_order(const std::vector<ParetoMethod>& methods, const std::vector<ParetoCourses>& courses,
                 StudyResult& result) {
    FigureClaims section(result, "Section 3.2",
                         "FEM and MSM, of which the paper gives no comparison, are implementations of our "
                         "own that share no code with the relaxers. Work is counted: how often the wall is "
                         "asked, the median of all pushes; table pareto_speed has linear solves and times.");
    const auto courses_of = [&](const char* name) {
        for (std::size_t m = 0; m < methods.size(); ++m)
            if (methods[m].name == name) return courses[m];
        return ParetoCourses{};
    };
    for (const auto& [name, word] : {std::pair{"beam FEM", "FEM"}, std::pair{"mass–spring", "MSM"}})
        for (const double accuracy : {0.1, 0.01}) {
            const ParetoSpeed theirs = speed_at(courses_of(name), accuracy),
                              two = speed_at(courses_of("M = 2"), accuracy);
            section.published(
                fmt::format("{} results in longer computation times, here than M = 2 until a push stays "
                            "within {:g} mm of rest",
                            word, accuracy),
                "longer", fmt::format("{}: {}; M = 2: {}", name, needs(theirs), needs(two)),
                needs_more(theirs, two), "it needs more counted work than M = 2",
                "Newton's method on a band of beam elements asks the wall a few times a push. Where no work "
                "is given, fewer than half of the pushes get there within the study's limits.");
        }
}

/// The least error that half of the pushes get to, and the median time until then.
struct Nearest {
    std::string method;
    double accuracy = no_figure, cpu_ms = no_figure;
};

Nearest nearest(const ParetoMethod& method, const ParetoCourses& courses) {
    Nearest found{method.name, no_figure, no_figure};
    for (const double accuracy : curve_accuracies())
        if (const double ms = speed_at(courses, accuracy).cpu_ms; std::isfinite(ms))
            found.accuracy = accuracy, found.cpu_ms = ms;
    return found;
}

/// What is plotted, what is seen, and what each cannot reach.
std::string front_text(const std::vector<ParetoMethod>& methods, const std::vector<ParetoCourses>& courses,
                       const std::vector<double>& floors, std::size_t tubes, std::size_t pushes) {
    std::string own, others, rivals;
    Nearest paper;
    for (std::size_t m = 0; m < methods.size(); ++m) {
        const Nearest here = nearest(methods[m], courses[m]);
        if (methods[m].family == Family::Global)
            own = fmt::format("The global relaxer is within 1e-4 mm after {} ms",
                              two_digits(speed_at(courses[m], 1e-4).cpu_ms));
        if (methods[m].family == Family::Paper && std::isfinite(here.accuracy) &&
            !(here.accuracy >= paper.accuracy))
            paper = here;
        if (methods[m].family != Family::Classical) continue;
        others += fmt::format("{}{} {}", others.empty() ? "" : "; ", methods[m].name,
                              std::isfinite(here.accuracy)
                                  ? fmt::format("{:.1g} mm in {} ms", here.accuracy, two_digits(here.cpu_ms))
                                  : std::string("not even 1 mm"));
        rivals += fmt::format("{}{:.1g}", rivals.empty() ? "" : ", ", floors[m]);
    }
    const std::string setting = fmt::format(
        "Speed against accuracy. One segment is inserted into a wire at rest; plotted is the processor time "
        "after which the farthest joint stays within a distance of the new rest, the median of {} pushes "
        "spread over {} tube{}: down and to the left is better, and left of the dotted line a push fits into "
        "a frame. Rest is what the global relaxer certifies to a gradient of 1e-8 of the bending stiffness, "
        "or the rest of that kind in whose basin a method ends. Points are filled where every push got "
        "there, hollow where some did not; a line ends where less than half do.",
        pushes, tubes, tubes == 1 ? "" : "s");
    return fmt::format(
        "{} {}; of the paper's methods {} comes nearest, within {:.1g} mm after {} ms, and none of them gets "
        "nearer in half of the pushes before it is stopped. The classical rods share no code with ours: that "
        "the beam elements come to rest beside it confirms the equilibrium; in half of the pushes they get "
        "to: {}. They bend by other formulas and rest a little aside: the floor of each, in that order {} mm "
        "at the full length of the wire (median of the tubes), is about as near as it can come.",
        setting, own, paper.method, paper.accuracy, two_digits(paper.cpu_ms), others, rivals);
}

std::string page(const StudyOptions& options, const StudyResult& result, const io::Table& speed,
                 const io::Table& floors, const io::Table& sweep, const io::Table& best,
                 const std::vector<ParetoMethod>& methods, const std::string& basin) {
    io::Table units{"", {"method", "round", "solve"}};
    for (const ParetoMethod& m : methods) units.add({m.name, m.round, m.solve});
    return fmt::format(
        R"(# Speed against accuracy

Generated by `seldinger study pareto{0}`; never edited by hand. Times are processor time of one thread and belong to the
machine; rounds, wall queries and solves do not.

![Time of a push against error at rest]({1}.svg)

{2}

{3}
Cells: median time; wall queries and solves up to then; in brackets the share of the pushes that get there where it is not
all. A time is that of the first look, 15 % of work apart, from which on the error stays within the accuracy.
Newton methods are looked at after each step, which stops the global relaxer each time and makes it slower than in one go.
Every method starts with the same joints, those of the rest before the push and one more segment at the tip. The paper's methods spend
three quarters of their updates in the 60 segments at the tip, as the product does. Errors are those of joints, not of the
curve: a wire that lies on the right curve and has yet to slide along it counts as not at rest.

## What a round and a solve are

{4}
## The rivals, and what each cannot reach

They stand in `engine/studies/rivals`, which includes nothing of `physics`: the tube in closed form, energies, contact and
solvers are their own. All have x_0 and the first direction clamped, half a segment at either end, and the wall's k at each
node.

- **XPBD**: segments that keep their length exactly, bending 2C sin²(θ/2) and wall as compliant constraints, Gauss–Seidel in
  substeps, velocities dropped. As published, multipliers start at zero in every substep; then one iteration does not
  balance the forces, and the rod rests where iterations and step put it, not at the minimum. *Warm-started*, they
  grow over the substeps, which removes this error and asks for more iterations.
- **Mass–spring**: axial springs EA/λ, bending springs ½Cθ², dynamic relaxation with masses by Gershgorin's bound (heavier
  along the wire than across) and critical damping by Rayleigh's quotient.
- **Beam FEM**: corotational Euler–Bernoulli elements, exact block-tridiagonal tangent, Newton with a diagonal shift where it
  is not positive definite and a line search on the energy; contacts are those of the last state.

EA is that of a round solid wire of 0.014 in: 16 EI/d² = {5:.0f} N for EI = 50 N·mm². The wire of the paper cannot be
compressed; one that can is shorter by the axial force over EA times its length, which the sweep below shows: with a tenth
of EA the rests lie farther apart, with a thousand times EA only the bending's discretisation is left.

The floor is the distance of each rival's end from ours, after long work from our rest of the whole wire. It is a
difference of models at this λ, not an error of either; that of XPBD as published is mostly what its iterations leave.

{6}
## Settings that were tried

Pushes on {7}, each with half the work.

{8}
## By tube

![By tube](pareto_tubes.svg)

## From the centreline

Every method starts with the wire on the centreline. The error is that from the rest to which the method's end leads by a
slow flow (gradient over C of 1e-9); `basin_mm` in pareto.csv is how far that rest lies from the global relaxer's, at most
{9} mm.

![Time against error](pareto.svg)

The least time of all methods, and of the paper's:

{10}
What nothing is both faster and nearer than stands in pareto_front.csv.
)",
        options.quick ? " --quick" : "", result.plots.front().name, result.plots.front().caption,
        io::to_markdown(speed, 3), io::to_markdown(units), round_wire_axial(50), io::to_markdown(floors, 2),
        "sinuous", io::to_markdown(sweep, 3), basin, io::to_markdown(best, 3));
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
    const Scale scale = options.quick ? quick : full;
    const std::vector<ParetoVessel> tubes = pareto_tubes(options.quick);
    const std::vector<ParetoVessel> meshes = pareto_meshes(options);
    const std::vector<ParetoMethod> methods = pareto_methods(options.quick),
                                    tried = rival_sweep(options.quick);
    std::vector<ParetoMethod> own;  // on meshes
    for (const ParetoMethod& m : methods)
        if (m.family != Family::Classical) own.push_back(m);
    const int columns = static_cast<int>(methods.size()), tests = static_cast<int>(tried.size());
    std::vector<std::vector<ParetoPush>> pushes;
    for (const ParetoVessel& tube : tubes) pushes.push_back(pareto_pushes(tube, scale.pushes));
    const std::vector<ParetoPush> few = pareto_pushes(tubes.front(), scale.sweep_pushes);

    const int count = static_cast<int>(tubes.size()) * columns,
              mesh_count = static_cast<int>(meshes.size() * own.size());
    Work work(options, 3 * count + mesh_count + tests);
    std::vector<std::vector<ParetoCourse>> pushed(static_cast<std::size_t>(count));
    work.run(count, [&](int k) {
        const int t = k / columns, m = k % columns;
        for (const ParetoPush& push : pushes[t])
            pushed[k].push_back(course_of(tubes[t], methods[m], push, k, scale.push_work));
        return fmt::format("{}, {}, pushes", tubes[t].name, methods[m].name);
    });
    std::vector<ParetoCourse> cold(static_cast<std::size_t>(count)),
        on_meshes(static_cast<std::size_t>(mesh_count));
    work.run(count, [&](int k) {
        cold[k] = from_centreline(tubes[k / columns], methods[k % columns], k, scale.cold_work);
        return fmt::format("{}, {}", tubes[k / columns].name, methods[k % columns].name);
    });
    const int own_columns = static_cast<int>(own.size());
    work.run(mesh_count, [&](int k) {
        on_meshes[k] = from_centreline(meshes[k / own_columns], own[k % own_columns], k, scale.cold_work);
        return fmt::format("{}, {}", meshes[k / own_columns].name, own[k % own_columns].name);
    });
    std::vector<ParetoFloor> floor(static_cast<std::size_t>(count));
    work.run(count, [&](int k) {
        if (methods[k % columns].family == Family::Classical)
            floor[k] = floor_of(tubes[k / columns], methods[k % columns], scale.floor_work);
        return fmt::format("{}, {}, floor", tubes[k / columns].name, methods[k % columns].name);
    });
    std::vector<std::vector<ParetoCourse>> swept(static_cast<std::size_t>(tests));
    work.run(tests, [&](int k) {
        for (const ParetoPush& push : few)
            swept[k].push_back(course_of(tubes.front(), tried[k], push, k, scale.sweep_work));
        return tried[k].name;
    });

    io::Table curves = curves_table();
    std::vector<ParetoCourses> all_tubes(methods.size());
    for (std::size_t t = 0; t < tubes.size(); ++t) {
        std::vector<ParetoCourses> here(methods.size());
        for (int m = 0; m < columns; ++m)
            for (const ParetoCourse& course : pushed[t * methods.size() + m]) {
                here[m].push_back(&course);
                all_tubes[m].push_back(&course);
            }
        add_curves(curves, tubes[t].name, methods, here);
    }
    add_curves(curves, "all tubes", methods, all_tubes);

    io::Table floor_table{"pareto_floors", {"tube", "method", "distance_mm", "end"}};
    std::vector<double> floors;
    for (int m = 0; m < columns; ++m) {
        std::vector<double> distances;
        for (std::size_t t = 0; t < tubes.size() && methods[m].family == Family::Classical; ++t) {
            const ParetoFloor& f = floor[t * methods.size() + m];
            distances.push_back(f.distance);
            floor_table.add({tubes[t].name, methods[m].name, f.distance, f.end});
        }
        floors.push_back(median(distances));
    }

    io::Table push_rows{"pareto_pushes",
                        {"tube", "method", "segments", "end", "left_mm", "cpu_ms", "rounds", "wall_queries",
                         "solves", "basin_mm", "rest_gradient"}};
    for (int k = 0; k < count; ++k)
        for (std::size_t p = 0; p < pushed[k].size(); ++p) {
            const ParetoCourse& c = pushed[k][p];
            push_rows.add({tubes[k / columns].name, methods[k % columns].name,
                           pushes[k / columns][p].pushed.segments(), c.end, c.points.back().deviation,
                           1e3 * c.points.back().cpu, c.work.back().rounds, c.work.back().wall_queries,
                           c.work.back().solves, c.basin, c.gradient});
        }

    std::vector<ParetoCourses> tried_courses(tried.size());
    for (int k = 0; k < tests; ++k)
        for (const ParetoCourse& course : swept[k]) tried_courses[k].push_back(&course);
    io::Table sweep = speed_table(tried, tried_courses, std::vector<double>(tried.size(), no_figure));
    sweep.name = "pareto_sweep";

    io::Table all{"pareto",
                  {"vessel", "method", "rounds", "cpu_s", "deviation_mm", "wall_queries", "solves",
                   "rest_energy_N_mm", "basin_mm", "end"}};
    io::Table front{"pareto_front", {"vessel", "method", "cpu_s", "deviation_mm"}};
    io::Table best = best_table(tubes, methods, cold);
    std::string basin = cold_rows(tubes, methods, cold, all, front);
    if (!meshes.empty()) {
        cold_rows(meshes, own, on_meshes, all, front);
        for (auto& row : best_table(meshes, own, on_meshes).rows) best.rows.push_back(std::move(row));
    }
    std::vector<ParetoVessel> vessels = tubes;
    vessels.insert(vessels.end(), meshes.begin(), meshes.end());

    StudyResult result;
    claim_order(methods, all_tubes, result);
    result.plots = {speed_plot(methods, curves, floors), tubes_plot(tubes, methods),
                    centreline_plot(vessels, methods)};
    result.plots.front().caption =
        front_text(methods, all_tubes, floors, tubes.size(), all_tubes.front().size());
    io::Table speed = speed_table(methods, all_tubes, floors);
    result.page = page(options, result, speed, floor_table, sweep, best, methods, basin);
    result.tables = {std::move(speed), std::move(curves),      std::move(all),   std::move(front),
                     std::move(best),  std::move(floor_table), std::move(sweep), std::move(push_rows)};
    return result;
}

}  // namespace studies
