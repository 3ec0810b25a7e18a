#include "engine/anatomy/anatomy_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/plot.h"
#include "physics/geometry/mesh_query.h"
#include "physics/geometry/parallel.h"

namespace anatomy {
namespace {

namespace fs = std::filesystem;

/// An orthographic view: a point's place on the page is (right·p, up·p).
struct View {
    const char *name, *across, *along;
    Vec3 right, up;
    Vec3 away() const { return up.cross(right); }  // from the eye
};
// As a physician sees a patient face to face: the left is on the right.
const std::array<View, 3> views = {{
    {"from the front", "left [mm]", "head [mm]", Vec3::UnitX(), Vec3::UnitZ()},
    {"from the left", "back [mm]", "head [mm]", Vec3::UnitY(), Vec3::UnitZ()},
    {"from the feet", "left [mm]", "front [mm]", Vec3::UnitX(), -Vec3::UnitY()},
}};

struct Box {
    double left = 1e300, right = -1e300, low = 1e300, high = -1e300;
    double width() const { return right - left; }
    double height() const { return high - low; }
};

Box box_of(const Anatomy& anatomy, const View& view) {
    Box box;
    for (const Vec3& v : anatomy.lumen.vertices) {
        const double x = view.right.dot(v), y = view.up.dot(v);
        box.left = std::min(box.left, x), box.right = std::max(box.right, x);
        box.low = std::min(box.low, y), box.high = std::max(box.high, y);
    }
    const double margin = 0.06 * std::max(box.width(), box.height()) + 2;
    return {box.left - margin, box.right + margin, box.low - margin, box.high + margin};
}

/// The lumen as tinted glass: one grey level per pixel, rows from below, darker where its walls are seen
/// obliquely.
std::string shade(const geometry::MeshQuery& mesh, const View& view, const Box& box, double scale,
                  double depth) {
    const int width = static_cast<int>(box.width() * scale), height = static_cast<int>(box.height() * scale);
    std::string pixels(static_cast<std::size_t>(width) * height, '\xff');
    geometry::for_each_index(height, 2, [&](int row) {
        for (int column = 0; column < width; ++column) {
            const Vec3 eye = view.right * (box.left + (column + 0.5) / scale) +
                             view.up * (box.low + (row + 0.5) / scale) - view.away() * depth;
            double clear = 1, start = 0;
            for (int wall = 0; wall < 16; ++wall) {
                const geometry::MeshQuery::Hit hit = mesh.hit(eye, view.away(), start);
                if (!std::isfinite(hit.distance)) break;
                const double slope = 1 - std::abs(hit.normal.dot(view.away()));
                clear *= 1 - 0.10 - 0.45 * slope * slope;
                start = hit.distance + mesh.nudge();
            }
            pixels[static_cast<std::size_t>(row) * width + column] =
                static_cast<char>(static_cast<std::uint8_t>(std::lround(90 + 165 * clear)));
        }
    });
    return pixels;
}

/// A line of a data file: x,y in each of the views.
std::string places(const Vec3& p) {
    std::string line;
    for (const View& view : views)
        line += fmt::format("{}{:.4f},{:.4f}", line.empty() ? "" : ",", view.right.dot(p), view.up.dot(p));
    return line;
}

/// A name, escaped so that gnuplot shows it literally.
std::string quoted(const std::string& name) {
    std::string text;
    for (const char c : name) text += c == '"' || c == '\\' || c == ',' ? ' ' : c;
    return text;
}

void write_data(const Anatomy& anatomy, const fs::path& folder) {
    std::string lines, names, ends, targets;
    for (std::size_t b = 0; b < anatomy.branches.size(); ++b) {
        const geometry::CentrelineBranch& branch = anatomy.branches[b];
        for (const Vec3& p : branch.points) lines += fmt::format("{},{}\n", places(p), b);
        lines += "\n";
        // Where the branch has left its parent.
        const std::size_t middle =
            branch.parent < 0 ? branch.points.size() / 2 : branch.points.size() * 6 / 10;
        names += fmt::format("{},{},{}\n", places(branch.points[middle]), quoted(branch.name), b);
    }
    for (const VesselEnd& end : anatomy.ends)
        ends += fmt::format("{},{}\n", places(end.opening.centre), end.role == EndRole::Inlet ? 1 : 0);
    for (const VesselTarget& target : anatomy.targets)
        targets += fmt::format("{},{}\n", places(target.centre), quoted(target.name));
    io::write_whole(folder / "lines.csv", lines);
    io::write_whole(folder / "names.csv", names);
    io::write_whole(folder / "ends.csv", ends);
    io::write_whole(folder / "targets.csv", targets);
}

constexpr const char* colours =
    "(int(column(7))%8==0?0x0072B2:int(column(7))%8==1?0xD55E00:int(column(7))%8==2?0x009E73:"
    "int(column(7))%8==3?0xCC79A7:int(column(7))%8==4?0x56B4E9:int(column(7))%8==5?0xE69F00:"
    "int(column(7))%8==6?0x7B3294:0x444444)";

/// One view at its place on the page (in fractions of the page).
std::string panel(std::size_t index, const Box& box, int columns, int rows, double x, double y, double width,
                  double height, std::span<const Trail> trails) {
    const View& view = views[index];
    const std::size_t c = 2 * index + 1;
    std::string text = fmt::format(
        "set lmargin at screen {}\nset rmargin at screen {}\nset bmargin at screen {}\nset tmargin at screen "
        "{}\n"
        "set xrange [{}:{}]\nset yrange [{}:{}]\nset title '{}'\nset xlabel '{}'\nset ylabel '{}'\n",
        x, x + width, y, y + height, box.left, box.right, box.low, box.high, view.name, view.across,
        view.along);
    text += fmt::format(
        "plot 'view{}.bin' binary array=({},{}) format='%uchar' dx={} dy={} origin=({},{}) using 1:1:1 with "
        "rgbimage notitle, \\\n",
        index, columns, rows, box.width() / columns, box.height() / rows, box.left, box.low);
    text += fmt::format(
        "  'lines.csv' using {}:{}:{} with lines linewidth 1.6 linecolor rgb variable notitle, \\\n", c,
        c + 1, colours);
    for (std::size_t k = 0; k < trails.size(); ++k)
        text += fmt::format(
            "  'trail{}.csv' using {}:{} with lines linewidth {} linecolor rgb '{}' title '{}', \\\n", k, c,
            c + 1, trails[k].width, trails[k].colour, trails[k].name);
    const auto points = [&](const char* file, const char* where, const char* style, const char* title) {
        text += fmt::format("  '{}' using ({} ? ${} : NaN):{} with points {} title '{}', \\\n", file, where,
                            c, c + 1, style, title);
    };
    points("ends.csv", "$7 == 0", "pointtype 6 pointsize 1.3 linewidth 1.5 linecolor 'black'", "end");
    points("ends.csv", "$7 == 1", "pointtype 4 pointsize 1.5 linewidth 1.8 linecolor 'black'", "inlet");
    points("targets.csv", "1", "pointtype 2 pointsize 1.2 linewidth 2 linecolor '#D00000'", "target");
    const auto labels = [&](const char* file, const char* style) {
        text +=
            fmt::format("  '{}' using {}:{}:7 with labels left noenhanced {} notitle", file, c, c + 1, style);
    };
    labels("targets.csv", "offset 0.8,-0.6 textcolor '#D00000'");
    if (index != 2) {  // in the view from the feet they are too many for the space
        text += ", \\\n";
        labels("names.csv", "offset 0.7,0.2 textcolor 'black'");
    }
    text += "\n";
    return text;
}

}  // namespace

void draw_anatomy(const Anatomy& anatomy, const fs::path& png, std::span<const Trail> trails) {
    if (png.extension() != ".png")
        throw io::InputError(png.string() + ": expected a file name that ends in .png");
    const io::ScratchFolder scratch;
    std::array<Box, 3> boxes;
    for (std::size_t i = 0; i < views.size(); ++i) boxes[i] = box_of(anatomy, views[i]);
    // Front and left stand side by side, the view from the feet below the front; all have the same scale.
    constexpr double margin = 75, gap = 95, head = 70;  // [pixels]
    const double tall = boxes[0].height() + boxes[2].height();
    const double scale =
        std::min(900.0 / tall, 1100.0 / (boxes[0].width() + boxes[1].width()));  // [pixels/mm]
    const double page_width = margin + scale * boxes[0].width() + gap + scale * boxes[1].width() + 90;
    const double page_height = head + scale * boxes[0].height() + gap + scale * boxes[2].height() + margin;

    const geometry::MeshQuery mesh(anatomy.lumen);
    double depth = 0;
    for (const Vec3& v : anatomy.lumen.vertices) depth = std::max(depth, v.norm() + 10);
    io::Plot plot{"anatomy", "", static_cast<int>(page_width), static_cast<int>(page_height)};
    plot.commands = fmt::format(
        "set multiplot title \"{}\" noenhanced\nset tics out nomirror\nset grid linecolor '#dddddd'\n",
        quoted(anatomy.name));
    for (std::size_t i = 0; i < views.size(); ++i) {
        constexpr double finer = 2;  // than the page
        const std::string pixels = shade(mesh, views[i], boxes[i], finer * scale, depth);
        const int columns = static_cast<int>(boxes[i].width() * finer * scale),
                  rows = static_cast<int>(boxes[i].height() * finer * scale);
        io::write_whole(scratch.path() / fmt::format("view{}.bin", i), pixels);
        const double x = i == 1 ? margin + scale * boxes[0].width() + gap : margin;
        const double y = i == 2 ? margin : page_height - head - scale * boxes[i].height();
        plot.commands += i == 2 ? fmt::format("set key at screen {}, {} right bottom\n", 1 - 30 / page_width,
                                              margin / page_height)
                                : "unset key\n";
        plot.commands +=
            panel(i, boxes[i], columns, rows, x / page_width, y / page_height,
                  boxes[i].width() * scale / page_width, boxes[i].height() * scale / page_height, trails);
    }
    plot.commands += "unset multiplot\n";
    write_data(anatomy, scratch.path());
    for (std::size_t k = 0; k < trails.size(); ++k) {
        std::string lines;
        for (const Vec3& p : trails[k].points) lines += places(p) + "\n";
        io::write_whole(scratch.path() / fmt::format("trail{}.csv", k), lines);
    }
    if (const std::string notice = io::write_plot(plot, scratch.path()); !notice.empty())
        throw io::InputError("no picture of " + anatomy.name + ": " + notice);
    io::write_whole(
        png, io::read_text(scratch.path() / "anatomy.png", "picture", "expected one that gnuplot drew"));
}

}  // namespace anatomy
