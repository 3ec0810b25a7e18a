#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "engine/io/csv.h"
#include "engine/io/plot.h"
#include "engine/studies/claims.h"
#include "engine/studies/pareto_measure.h"
#include "engine/studies/pareto_methods.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"

namespace studies {
namespace {

constexpr double frame_ms = 1000.0 / 60;  // of a display of 60 frames a second

/// NAME.gp with one panel for each vessel, the last for the key.
io::Plot panels(const std::string& name, const std::vector<ParetoVessel>& vessels,
                const std::vector<ParetoMethod>& methods, TemplateValues values = {}) {
    const int count = static_cast<int>(vessels.size()) + 1, columns = std::min(count, count > 5 ? 4 : 3),
              deep = (count + columns - 1) / columns;
    std::string texts;
    TemplateRows all, lines;
    for (const ParetoVessel& vessel : vessels) {
        texts += " " + vessel.text() + ".";
        all.push_back({{"vessel", vessel.name}});
    }
    for (const ParetoMethod& method : methods)
        lines.push_back({{"method", method.name}, {"look", method.look}});
    values.insert(
        values.end(),
        {{"deep", deep}, {"columns", columns}, {"vessels", texts}, {"panels", all}, {"methods", lines}});
    return filled_plot(name, 400 * columns, deep == 1 ? 560 : 420 * deep, values);
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
                    const std::vector<double>& floors, const std::string& caption) {
    constexpr double top = 1.8, bottom = 4e-5;
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
            lines += fmt::format(
                "{}'pareto_curves.csv' skip 1 using (strcol(1) eq 'all tubes' && strcol(2) eq '{}' ? {} : "
                "NaN):($3) with {} {}",
                lines.empty() ? "plot " : ", \\\n     ", methods[m].name,
                condition.empty() ? "$4" : fmt::format("({} ? $4 : NaN)", condition),
                condition.empty() ? "lines" : "points", look);
        };
        part("", methods[m].look);
        const std::string decade = "abs(log10($3)-floor(log10($3)+0.5)) < 0.01";
        const std::string colour = fmt::format("lc rgb '{}'", methods[m].colour);
        part(decade + " && $5 >= 1", "pt 7 ps 0.9 " + colour);
        part(decade + " && $5 < 1", "pt 6 ps 0.9 lw 1.5 " + colour);
    }
    return filled_plot("pareto_speed", 1150, 720,
                       {{"caption", caption},
                        {"bottom", bottom},
                        {"top", top},
                        {"frame_ms", frame_ms},
                        {"labels", named(labels)},
                        {"lines", lines.empty() ? "plot NaN" : lines}});
}

/// Sizes of the study. Work is a fraction of what each method may do at most.
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
    const std::string fraction = fmt::format("{:.0f} % of the pushes", 100 * s.reached);
    return std::isfinite(s.work.wall_queries)
               ? fmt::format("{}, {:.0f} wall queries in the median", fraction, s.work.wall_queries)
               : fraction;
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
    return filled_text("pareto_speed", {{"pushes", pushes},
                                        {"tubes", tubes},
                                        {"plural", tubes == 1 ? "" : "s"},
                                        {"own", own},
                                        {"nearest", paper.method},
                                        {"accuracy", paper.accuracy},
                                        {"ms", two_digits(paper.cpu_ms)},
                                        {"others", others},
                                        {"rivals", rivals}});
}

std::string page(const StudyOptions& options, const StudyResult& result, const io::Table& speed,
                 const io::Table& floors, const io::Table& sweep, const io::Table& best,
                 const std::vector<ParetoMethod>& methods, const std::string& basin) {
    io::Table units{"", {"method", "round", "solve"}};
    for (const ParetoMethod& m : methods) units.add({m.name, m.round, m.solve});
    return filled_text("pareto_page", {{"quick", options.quick ? " --quick" : ""},
                                       {"picture", result.plots.front().name},
                                       {"caption", result.plots.front().caption},
                                       {"speed", io::to_markdown(speed, 3)},
                                       {"units", io::to_markdown(units)},
                                       {"axial", round_wire_axial(50)},
                                       {"floors", io::to_markdown(floors, 2)},
                                       {"sweep", io::to_markdown(sweep, 3)},
                                       {"basin", basin},
                                       {"best", io::to_markdown(best, 3)}}) +
           "\n";
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
    const std::string caption =
        front_text(methods, all_tubes, floors, tubes.size(), all_tubes.front().size());
    result.plots = {speed_plot(methods, curves, floors, caption),
                    panels("pareto_tubes", tubes, methods, {{"frame_ms", frame_ms}}),
                    panels("pareto", vessels, methods)};
    io::Table speed = speed_table(methods, all_tubes, floors);
    result.page = page(options, result, speed, floor_table, sweep, best, methods, basin);
    result.tables = {std::move(speed), std::move(curves),      std::move(all),   std::move(front),
                     std::move(best),  std::move(floor_table), std::move(sweep), std::move(push_rows)};
    return result;
}

}  // namespace studies
