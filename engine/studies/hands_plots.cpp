#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/studies/hands_behaviours.h"
#include "engine/studies/hands_published.h"
#include "engine/studies/templates.h"

namespace studies {
namespace {

using geometry::degree;

constexpr std::size_t most_rows = 1500;  // of a behaviour

/// What the picture of a behaviour shows beside the drawing; columns of curve_table().
struct Curve {
    const char *behaviour, *x, *y;
    const char *x_label, *y_label;
    int first_chapter = 0;
    /// Where the published range stands: in y itself, below the curve's highest point, or above its first.
    enum class Band { None, Itself, BelowTop, AboveStart } band = Band::None;
    const char* view = "x:z";  // of the drawing
    int last_chapter = 99;
};

const Curve curves[] = {
    {"whip", "turned_deg", "tip_direction_deg", "hub turned [deg]",
     "direction of the tip against the first [deg]", 1, Curve::Band::None, "x:z", 1},
    {"wind-up", "turned_deg", "tip_roll_deg", "hub turned [deg]", "tip turned about its axis [deg]", 1},
    {"stick-slip", "inserted0_mm", "push0_N", "wire inside [mm]", "push at the hub [N]", 1},
    {"prolapse", "inserted0_mm", "tip_way_mm", "wire inside [mm]", "way of the tip [mm]", 0},
    {"buckling", "inserted0_mm", "push0_N", "wire inside [mm]", "push at the hub [N]", 0,
     Curve::Band::Itself},
    {"kick-back", "inserted0_mm", "tip_way_mm", "wire inside [mm]",
     "way of the tip of the microcatheter [mm]", 1, Curve::Band::BelowTop},
    {"deep seating", "inserted1_mm", "push1_N", "catheter past the ostium [mm]", "push at its hub [N]", 1},
    {"drag", "inserted1_mm", "inserted0_mm", "catheter inside [mm]", "wire inside [mm]", 1},
    {"release", "inserted0_mm", "push0_N", "wire inside [mm]", "push at the hub [N]", 0},
    {"Simmons", "inserted1_mm", "push1_N", "catheter inside [mm]", "push at its hub [N]", 1},
    {"root loop", "inserted0_mm", "push0_N", "wire inside [mm]", "push at the hub [N]", 0},
    {"straightening", "inserted0_mm", "vessel_moved_mm", "wire inside [mm]",
     "farthest that a vessel has moved [mm]", 0, Curve::Band::Itself},
    {"wedge", "inserted0_mm", "push0_N", "wire inside [mm]", "push at the hub [N]", 0},
};

const Curve& curve_of(const std::string& behaviour) {
    return *std::find_if(std::begin(curves), std::end(curves),
                         [&](const Curve& c) { return behaviour == c.behaviour; });
}

const std::vector<std::string>& curve_columns() {
    static const std::vector<std::string> columns = {"behaviour",         "step",         "part",
                                                     "inserted0_mm",      "inserted1_mm", "inserted2_mm",
                                                     "push0_N",           "push1_N",      "push2_N",
                                                     "turned_deg",        "torque_N_mm",  "tip_roll_deg",
                                                     "tip_direction_deg", "tip_way_mm",   "vessel_moved_mm",
                                                     "contact_N",         "work_N_mm",    "stored_N_mm",
                                                     "friction_N_mm",     "jumps_N_mm"};
    return columns;
}

int column(const char* name) {
    const auto& all = curve_columns();
    return 1 + static_cast<int>(std::find(all.begin(), all.end(), name) - all.begin());
}

/// With a space before it; nothing for a plain number.
std::string unit_of(const PublishedSize& p) {
    return p.unit == "1" ? std::string() : fmt::format(" {}", p.unit);
}

/// One word, for file names.
std::string slug(std::string text) {
    std::replace(text.begin(), text.end(), ' ', '-');
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

/// Values of y in the part that is shown.
std::vector<double> shown(const io::Table& table, const Curve& c) {
    std::vector<double> values;
    for (std::size_t r = 0; r < table.rows.size(); ++r)
        if (table.word(r, "behaviour") == c.behaviour && table.number(r, "part") >= c.first_chapter)
            values.push_back(table.number(r, c.y));
    return values;
}

std::string band(const Curve& c, const PublishedSize& p, const io::Table& table) {
    const std::vector<double> values = shown(table, c);
    if (c.band == Curve::Band::None || !p.known() || values.empty()) return "";
    double low = p.low, high = p.high;
    if (c.band == Curve::Band::BelowTop) {
        const double top = *std::max_element(values.begin(), values.end());
        low = top - p.high, high = top - p.low;
    }
    return fmt::format(
        "set object 1 rectangle from graph 0, first {:g} to graph 1, first {:g} fc rgb '#009E73' fs "
        "transparent solid 0.15 noborder behind\nset label 1 'published {:g} to {:g}' at graph 0.02, first "
        "{:g} offset 0,0.8 tc rgb '#00704f'\n",
        low, high, p.low, p.high, c.band == Curve::Band::BelowTop ? high : low,
        c.band == Curve::Band::BelowTop ? -0.8 : 0.8);
}

/// Between tics of a narrow axis: 1, 2 or 5 times a power of ten, at most five times in the range.
double tic_step(double range) {
    const double least = range / 5, power = std::pow(10, std::floor(std::log10(least)));
    for (const double times : {1.0, 2.0, 5.0})
        if (times * power >= least) return times * power;
    return 10 * power;
}

/// What the devices cover and a margin, neither side less than 0.6 of the other, so that axes can be read.
std::string range_of_drawing(const BehaviourRun& run, int across, int up) {
    constexpr double margin = 12, least_fraction = 0.6;
    Vec3 low = Vec3::Constant(1e9), high = -low;
    for (const DrawnPath& path : run.paths)
        for (const Vec3& x : path.points) low = low.cwiseMin(x), high = high.cwiseMax(x);
    for (const auto& [narrow, wide] : {std::pair{across, up}, {up, across}})
        if (const double lacks = least_fraction * (high[wide] - low[wide]) - (high[narrow] - low[narrow]);
            lacks > 0)
            low[narrow] -= 0.5 * lacks, high[narrow] += 0.5 * lacks;
    return fmt::format("set xrange [{:.0f}:{:.0f}]\nset yrange [{:.0f}:{:.0f}]\nset xtics {}\n",
                       low[across] - margin, high[across] + margin, low[up] - margin, high[up] + margin,
                       tic_step(high[across] - low[across] + 2 * margin));
}

io::Plot picture(const BehaviourRun& run, const io::Table& table) {
    const Curve& c = curve_of(run.behaviour);
    const PublishedSize& p = published_size(run.behaviour);
    const std::string range = p.known() && p.same_kind ? fmt::format("published {:g} to {:g}", p.low, p.high)
                              : p.known() ? fmt::format("of another course {:g} to {:g}", p.low, p.high)
                                          : "no published size";
    const std::string mine = fmt::format("strcol(1) eq '{}'", run.behaviour);
    const int across = c.view[0] - 'x', up = c.view[2] - 'x';  // coordinates
    const char* colours[] = {"#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"};
    const auto path = [&](std::size_t k) -> TemplateValues {
        const DrawnPath& drawn = run.paths[k];
        return {{"moment", drawn.moment},
                {"device", drawn.device},
                {"width", drawn.device == "wire" ? 2.0 : 3.5},
                {"colour", colours[k % std::size(colours)]}};
    };
    io::Plot plot = filled_plot("hands_behaviour", 1250, 520,
                                {{"behaviour", run.behaviour},
                                 {"measure", p.measure},
                                 {"manipulation", run.manipulation},
                                 {"note", run.note},
                                 {"measured", run.measured},
                                 {"unit", unit_of(p)},
                                 {"range", range},
                                 {"x_label", c.x_label},
                                 {"y_label", c.y_label},
                                 {"band", band(c, p, table)},
                                 {"mine", mine},
                                 {"part", column("part")},
                                 {"first", c.first_chapter},
                                 {"last", c.last_chapter},
                                 {"x", column(c.x)},
                                 {"y", column(c.y)},
                                 {"across", c.view[0]},
                                 {"up", c.view[2]},
                                 {"scenario", run.scenario},
                                 {"devices", run.devices},
                                 {"drawing_range", range_of_drawing(run, across, up)},
                                 {"vessel_x", 2 + across},
                                 {"vessel_y", 2 + up},
                                 {"path_x", 4 + across},
                                 {"path_y", 4 + up},
                                 {"paths", rows_of(run.paths.size(), path)}});
    plot.name = "hands_" + slug(run.behaviour);
    return plot;
}

/// Each size over its published range: inside between the lines at 0 and 1.
io::Plot overview(std::span<const BehaviourRun> runs) {
    std::string rows, tics;
    int y = static_cast<int>(runs.size());
    for (const BehaviourRun& run : runs) {
        const PublishedSize& p = published_size(run.behaviour);
        std::string text = fmt::format("{}: {:.3g}{}", run.behaviour, run.measured, unit_of(p));
        if (!run.appears) text += ", does not appear";
        text += !p.known()     ? " (no published size)"
                : !p.same_kind ? fmt::format(" ({:g} to {:g} of another course)", p.low, p.high)
                               : fmt::format(" ({:g} to {:g})", p.low, p.high);
        tics += fmt::format("{}'{}' {}", tics.empty() ? "" : ", ", text, y);
        const double at = p.known() && std::isfinite(run.measured) ? (run.measured - p.low) / (p.high - p.low)
                                                                   : std::nan("");
        const int kind = !p.known() || !run.appears ? 2 : p.same_kind ? 0 : 1;
        if (std::isfinite(at)) rows += fmt::format("{:.4g} {} {}\n", std::clamp(at, -0.6, 1.6), y, kind);
        --y;
    }
    return filled_plot("hands", 1000, 600, {{"sizes", rows}, {"top", runs.size() + 0.7}, {"tics", tics}});
}

}  // namespace

io::Table curve_table(std::span<const BehaviourRun> runs) {
    io::Table table{"hands_curves", curve_columns()};
    for (const BehaviourRun& run : runs) {
        const std::size_t every = 1 + run.samples.size() / most_rows;
        double travel = 0;
        Vec3 first = Vec3::Zero();
        int chapter = -1;
        for (std::size_t k = 0; k < run.samples.size(); ++k) {
            const HandSample& s = run.samples[k];
            const HandReading& r = s.devices[run.device];
            if (k > 0) {
                const HandReading& before = run.samples[k - 1].devices[run.device];
                travel += (r.tip - before.tip).dot(before.along);
            }
            if (s.chapter != chapter) chapter = s.chapter, first = r.along;
            const bool jumps = s.jumped || (k + 1 < run.samples.size() && run.samples[k + 1].jumped);
            if (k % every != 0 && !jumps && k + 1 != run.samples.size()) continue;
            const auto of = [&](std::size_t d, auto member) {
                return io::TableCell(d < s.devices.size() ? s.devices[d].*member : 0.0);
            };
            table.add({run.behaviour,
                       k,
                       s.chapter,
                       of(0, &HandReading::inserted),
                       of(1, &HandReading::inserted),
                       of(2, &HandReading::inserted),
                       of(0, &HandReading::push),
                       of(1, &HandReading::push),
                       of(2, &HandReading::push),
                       r.turned / degree,
                       r.torque,
                       r.tip_roll / degree,
                       std::acos(std::clamp(r.along.dot(first), -1.0, 1.0)) / degree,
                       travel,
                       s.vessel_moved,
                       s.contact_force,
                       s.work,
                       s.stored,
                       s.friction,
                       s.jumps});
        }
    }
    return table;
}

io::Table path_table(std::span<const BehaviourRun> runs) {
    io::Table table{"hands_paths", {"behaviour", "moment", "device", "x_mm", "y_mm", "z_mm"}};
    for (const BehaviourRun& run : runs)
        for (const DrawnPath& path : run.paths) {
            for (const Vec3& x : path.points)
                table.add({run.behaviour, path.moment, path.device, x.x(), x.y(), x.z()});
        }
    return table;
}

io::Table vessel_table(std::span<const BehaviourRun> runs) {
    io::Table table{"hands_vessels", {"behaviour", "x_mm", "y_mm", "z_mm", "radius_mm"}};
    for (const BehaviourRun& run : runs)
        for (const geometry::CentrelineBranch& branch : run.vessels) {
            double since = 1e9;
            for (std::size_t k = 0; k < branch.points.size(); ++k) {
                if (k > 0) since += (branch.points[k] - branch.points[k - 1]).norm();
                if (since < 0.3 * branch.radii[k]) continue;
                const Vec3& x = branch.points[k];
                table.add({run.behaviour, x.x(), x.y(), x.z(), branch.radii[k]});
                since = 0;
            }
        }
    return table;
}

std::vector<io::Plot> hand_plots(std::span<const BehaviourRun> runs) {
    std::vector<io::Plot> plots = {overview(runs)};
    const io::Table table = curve_table(runs);
    for (const BehaviourRun& run : runs) plots.push_back(picture(run, table));
    return plots;
}

}  // namespace studies
