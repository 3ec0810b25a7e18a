#include "engine/studies/pareto_pictures.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>

namespace studies {
namespace {

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

}  // namespace

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

}  // namespace studies
