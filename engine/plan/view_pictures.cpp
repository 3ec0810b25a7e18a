#include "engine/plan/view_pictures.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "engine/exercise/imaging.h"
#include "engine/exercise/monitor.h"
#include "engine/exercise/simulation.h"
#include "engine/io/csv.h"
#include "engine/io/plot.h"

namespace plan {
namespace {

double degrees(double angle) {
    return angle / geometry::degree;
}

/// As gnuplot takes it within double quotes.
std::string quoted(const std::string& text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        result += c == '\n' ? std::string("\\n") : std::string(1, c);
    }
    return result + "\"";
}

/// The names of whole steps of 30 degrees, such as "LAO 60".
std::string tics(double least, double most, const char* negative, const char* positive, const char* zero,
                 int step) {
    std::string text = "(";
    for (int angle = static_cast<int>(std::ceil(least / step - 1e-6)) * step; angle <= most + 1e-6;
         angle += step)
        text +=
            fmt::format("{}'{}' {}", text.size() > 1 ? ", " : "",
                        angle == 0 ? std::string(zero)
                                   : fmt::format("{} {}", angle < 0 ? negative : positive, std::abs(angle)),
                        angle);
    return text + ")";
}

}  // namespace

std::string to_csv(const ViewMap& map) {
    io::Table table{"views",
                    {"lao_deg", "cranial_deg", "foreshortening", "overlap", "ostium_deg", "cost", "stand"}};
    for (std::size_t node = 0; node < map.figures.size(); ++node) {
        const ViewAngles at = map.angles(node);
        const ViewFigures& figures = map.figures[node];
        const auto rounded = [](double value) { return std::round(value * 1e6) / 1e6; };
        table.add({rounded(degrees(at.lao)), rounded(degrees(at.cranial)), rounded(figures.foreshortening),
                   rounded(figures.overlap), rounded(degrees(figures.ostium)), rounded(figures.cost),
                   text_of(map.blocked[node])});
    }
    return io::to_csv(table);
}

std::string write_map_picture(const ViewMap& map, const std::vector<BestView>& best, const ViewTarget& target,
                              const std::filesystem::path& folder, const std::string& name) {
    io::Plot plot{name, {}, 1000, 1120};
    std::string& text = plot.commands;
    // Rows of one cranial angle, an empty line between them, as contours ask for. A blocked node is no number
    // there, and its place stays grey.
    text += "set datafile separator whitespace\n$map << end_of_data\n";
    for (std::size_t node = 0; node < map.figures.size(); ++node) {
        if (node > 0 && node % map.lao.size() == 0) text += "\n";
        const ViewAngles at = map.angles(node);
        const ViewFigures& figures = map.figures[node];
        const auto shown = [&](double value) {
            return map.blocked[node] == Blocked::Free ? fmt::format("{:.5f}", 100 * value) : "NaN";
        };
        text += fmt::format("{:.3f} {:.3f} {} {} {}\n", degrees(at.lao), degrees(at.cranial),
                            shown(figures.cost), shown(figures.foreshortening), shown(figures.overlap));
    }
    text += "end_of_data\n$best << end_of_data\n";
    for (std::size_t k = 0; k < best.size(); ++k)
        text += fmt::format("{:.3f} {:.3f} {}\n", degrees(best[k].angles.lao),
                            degrees(best[k].angles.cranial), k + 1);
    text += "end_of_data\n";
    const double step = map.lao.size() > 1 ? degrees(map.lao[1] - map.lao[0]) : 1, half = 0.5 * step;
    const double left = degrees(map.lao.front()), right = degrees(map.lao.back()),
                 low = degrees(map.cranial.front()), high = degrees(map.cranial.back());
    const bool blocked =
        std::any_of(map.blocked.begin(), map.blocked.end(), [](Blocked at) { return at != Blocked::Free; });
    std::string views;
    for (std::size_t k = 0; k < best.size(); ++k)
        views += fmt::format("{}{}: {}", k == 0 ? "" : "     ", k + 1, text_of(best[k].angles));
    text += fmt::format(
        "set xrange [{}:{}]\nset yrange [{}:{}]\nset xtics out {}\nset ytics out {}\nset cbrange [0:100]\n"
        "set palette defined (0 '#00441b', 10 '#1b7837', 25 '#7fbf7b', 50 '#f7f7f7', 75 '#c2a5cf', 100 "
        "'#40004b')\nset cblabel 'percent'\nset xlabel 'detector toward the patient''s right (RAO) or left "
        "(LAO) [degrees]'\nset ylabel 'toward feet (CAUD) or head (CRAN)'\n"
        "set object 1 rectangle from graph 0,0 to graph 1,1 fillcolor rgb '#999999' fillstyle solid behind\n",
        left - half, right + half, low - half, high + half, tics(left, right, "RAO", "LAO", "AP", 30),
        tics(low, high, "CAUD", "CRAN", "0", 15));
    const struct {
        int column;
        const char *what, *contours;
    } panels[] = {{3, "Cost: lost of the length that is seen whole and free", "cost"},
                  {4, "Foreshortening", "foreshortening"},
                  {5, "Overlap by other filled vessels", "overlap"}};
    for (const auto& panel : panels)
        text += fmt::format(
            "set contour base\nset cntrparam levels discrete 5,10,20,40,60,80\nunset surface\nset table "
            "$lines_{0}\nsplot $map using 1:2:{1} with lines\nunset table\nunset contour\nset surface\n",
            panel.contours, panel.column);
    text += fmt::format("set multiplot layout 3,1 title {} noenhanced\n",
                        quoted(target.name + (target.ostium ? ", and its ostium" : "") + "\n" + views +
                               (blocked ? "     grey: detector or tube would meet table or patient" : "")));
    for (const auto& panel : panels)
        text += fmt::format(
            "set title '{}'\nplot $map using 1:2:{} with image notitle, \\\n  $lines_{} using 1:2 with lines "
            "linecolor 'black' linewidth 0.8 notitle, \\\n  '' every 30::12 using 1:2:3 with labels font "
            "',7' "
            "textcolor 'black' notitle, \\\n  $best using 1:2 with points pointtype 7 pointsize "
            "3.4 linecolor 'white' notitle, \\\n  $best using 1:2 with points pointtype 6 pointsize 3.4 "
            "linewidth 2 linecolor '#d55e00' notitle, \\\n  $best using 1:2:3 with labels textcolor "
            "'#d55e00' notitle\n",
            panel.what, panel.column, panel.contours);
    text += "unset multiplot\n";
    return io::write_plot(plot, folder);
}

std::vector<render::GrayImage> view_pictures(const scenario::Scenario& scenario, const ViewedTarget& target,
                                             const std::vector<bool>& filled,
                                             const std::vector<BestView>& views,
                                             const anatomy::ModelCache& cache) {
    constexpr double iodine = 60;                                        // as in `seldinger render` [mg/ml]
    constexpr double least_field = 120, most_field = 400, around = 2.5;  // at the detector [mm], [-]
    exercise::Simulation simulation(scenario, cache);
    simulation.step();
    const blood::ContrastFlow& contrast = simulation.contrast();
    exercise::ImagingChain imaging =
        exercise::make_imaging(simulation.scenario(), simulation.anatomy(), contrast, cache);
    exercise::Pulse pulse =
        exercise::pulse_of(simulation, {0, simulation.frames() - 1, simulation.time()}, imaging.organs);
    pulse.arm.isocentre = target.middle();
    pulse.arm.opening_width = pulse.arm.opening_height = render::widest_opening;
    pulse.arm.wedge = pulse.arm.lung_shutter = {};
    pulse.arm.detector_width = std::clamp(around * target.length() * pulse.arm.sid / pulse.arm.sod,
                                          least_field, std::max(least_field, most_field));
    exercise::set_mode(pulse, scenario, script::ImagingMode::Dsa);
    exercise::remove_contrast(pulse);
    std::vector<float> in_blood;
    for (const blood::FlowCell& cell : contrast.blood().cells)
        in_blood.push_back(filled[static_cast<std::size_t>(cell.branch)] ? static_cast<float>(iodine) : 0);
    exercise::Monitor monitor(std::move(imaging.fluoroscope));
    std::vector<render::GrayImage> pictures;
    for (const BestView& view : views) {
        pulse.arm.lao = view.angles.lao, pulse.arm.cranial = view.angles.cranial;
        exercise::Pulse mask = pulse, shown = pulse;
        mask.new_mask = true;
        shown.exposure.vessel_iodine = in_blood;
        ++shown.exposure.frame;  // for other noise
        monitor.take(mask);
        monitor.take(shown);
        pictures.push_back(*monitor.image());
    }
    return pictures;
}

}  // namespace plan
