#include <algorithm>
#include <fmt/format.h>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/plot.h"
#include "engine/scenario/device.h"

namespace scenario {
namespace {

using geometry::Vec3;

std::string quoted(const std::string& text) {
    std::string result;
    for (const char c : text)
        result += c == '"' || c == '\\' || static_cast<unsigned char>(c) < ' ' ? '\'' : c;
    return result;
}

}  // namespace

void draw_device(const Device& d, const std::filesystem::path& png) {
    if (png.extension() != ".png")
        throw io::InputError(png.string() + ": expected a file name that ends in .png");
    const io::ScratchFolder scratch;
    std::string shape, stiffness;
    for (const Vec3& p : free_shape(d, std::max(15.0, 0.4 * physics::shaped_length(d))))
        shape += fmt::format("{},{},{}\n", p.x(), p.y(), p.z());
    const double shown = std::min(d.length, 2 * physics::varying_length(d) + 50);
    for (int k = 0; k <= 400; ++k) {
        const double s = shown * k / 400;
        stiffness += fmt::format("{},{}\n", s, physics::rigidity_at(d, s));
    }
    io::write_whole(scratch.path() / "shape.csv", shape);
    io::write_whole(scratch.path() / "stiffness.csv", stiffness);
    const bool solid =
        std::ranges::none_of(d.shape, [](const physics::RestArc& arc) { return arc.plane != 0; });
    // In the right column from the top: EI, the balloon where there is one, the cross-section.
    const double height = d.balloon ? 0.31 : 0.46, lowest = 0.01;
    std::string balloon;
    if (d.balloon) {
        std::string curve, rows;
        for (int k = 0; k <= 200; ++k) {
            const double pressure = d.balloon->rated * k / 200;
            curve += fmt::format("{},{}\n", pressure, d.balloon->law.diameter(pressure));
        }
        for (const physics::BalloonLaw::Row& row : d.balloon->law.table)
            if (row.pressure <= d.balloon->rated) rows += fmt::format("{},{}\n", row.pressure, row.diameter);
        io::write_whole(scratch.path() / "balloon.csv", curve);
        io::write_whole(scratch.path() / "rows.csv", rows);
        balloon = fmt::format(
            "set size 0.38,{}\nset origin 0.61,{}\nset xlabel 'up to its rated pressure [atm]'\nset ylabel "
            "'diameter [mm]'\nset title 'balloon in air'\nset arrow 1 from {},graph 0 to {},graph 1 nohead "
            "lc rgb "
            "'#777777' dt 2\nplot [0:*][0:*] 'balloon.csv' using 1:2 with lines lw 2 lc rgb '#009E73' "
            "notitle, "
            "'rows.csv' using 1:2 with points pt 7 lc rgb '#009E73' notitle\nunset arrow 1\n",
            height, lowest + height - 0.01, d.balloon->nominal, d.balloon->nominal);
    }
    io::Plot plot{"device", "", 1000, 760};
    plot.commands = fmt::format(
        "set datafile separator ','\nset multiplot title \"{} – {}\" noenhanced\nset grid lc rgb '#dddddd'\n"
        "set size 0.62,0.9\nset origin 0.0,0.02\nset size ratio -1\nset offsets 6,6,6,6\nset xlabel "
        "'mm'\nset ylabel 'mm'\nset title 'free shape{}'\n"
        "plot 'shape.csv' using 1:2 with lines lw {} lc rgb '#0072B2' notitle{}\n"
        "set size noratio\nset offsets 0,0,0,0\nset size 0.38,{}\nset origin 0.61,{}\nset logscale "
        "y\nset xlabel 'from the distal end [mm]'\nset ylabel 'EI [N mm^2]'\nset title 'EI along it'\n"
        "plot [][*:*] 'stiffness.csv' using 1:2 with lines lw 2 lc rgb '#D55E00' notitle\n"
        "unset logscale\n{}set size 0.38,{}\nset origin 0.61,{}\nset size ratio -1\nset xlabel 'mm'\nset "
        "ylabel ''\nset title 'cross-section of the shaft'\nset parametric\nset trange [0:2*pi]\nset xrange "
        "[{}:{}]\nset yrange [{}:{}]\n"
        "set object 1 circle at 0,0 size {} fillcolor rgb '#9db8cc' fillstyle solid border rgb '#0072B2'\n{}"
        "plot 0,0 with points pt 0 notitle\nunset multiplot\n",
        quoted(d.name), quoted(d.title), solid ? "" : ", seen across its first plane (dashed: from the side)",
        std::clamp(2 * d.outer_diameter, 1.5, 5.0),
        solid ? "" : ", 'shape.csv' using 1:3 with lines lw 1 dt 2 lc rgb '#777777' notitle", height,
        0.92 - height, balloon, height, lowest, -d.outer_diameter, d.outer_diameter, -0.7 * d.outer_diameter,
        0.7 * d.outer_diameter, 0.5 * d.outer_diameter,
        d.inner_diameter > 0
            ? fmt::format("set object 2 circle at 0,0 size {} fillcolor rgb '#ffffff' fillstyle solid border "
                          "rgb '#0072B2' front\n",
                          0.5 * d.inner_diameter)
            : std::string());
    if (const std::string notice = io::write_plot(plot, scratch.path()); !notice.empty())
        throw io::InputError("no picture of " + d.name + ": " + notice);
    io::write_whole(
        png, io::read_text(scratch.path() / "device.png", "picture", "expected one that gnuplot drew"));
}

}  // namespace scenario
