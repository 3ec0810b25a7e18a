#pragma once
/// Drawings in SVG for the pages.

#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/debrief/story.h"

namespace debrief {

/// The colours of a page, told apart by colour-blind eyes as well (Okabe and Ito).
struct ink {
    static constexpr const char* devices[] = {"#0072b2", "#d55e00", "#56b4e9", "#cc79a7", "#8a5a00"};
    static constexpr const char *wire = devices[0], *error = "#b4003c", *good = "#009e73",
                                *comment = "#6a3d9a", *vessel = "#f0dcd4", *edge = "#d9b8ab",
                                *grid = "#e3e3e3";
};

/// What the hands and the beam did over time. Marks are numbered as in score.handling_errors; each is a link
/// to
/// "#e" and its number. The group with the id "cursor" is moved by the page's script.
std::string time_line(const Story&);

/// Pressure of the balloon and the narrowest place of the first lesion over time; empty without both.
std::string treatment_chart(const Story&);

/// The tip's way over the vessels, from the front and from the left, on the same scale; dots with the class
/// "here" and circles of marks as in the time line.
std::string tip_over_vessels(const Story&);

/// Vessels from the front and from the left, on the same scale, with ways in them.
struct VesselPicture {
    std::span<const geometry::CentrelineBranch> branches;
    geometry::Vec3 target = geometry::Vec3::Zero();
    double target_radius = 0;                                           // [mm]
    std::vector<std::pair<geometry::Polyline, const char*>> ways = {};  // with their colours
};
/// A side from which vessels are drawn.
struct Side {
    const char* name;
    geometry::Vec3 right;                               // unit
    double middle = 0, half = 0, high = 0, per_mm = 1;  // across, of the top [mm]; [px/mm]

    std::pair<double, double> at(const geometry::Vec3& p) const {
        return {(right.dot(p) - middle + half) * per_mm, (high - p.z()) * per_mm};
    }
    double pixels() const { return 2 * half * per_mm; }
};
/// `more` is drawn above the ways on each side.
std::string ways_over_vessels(const VesselPicture&, const std::function<std::string(const Side&)>& more = {});

/// Lines over a common axis; texts with their units. A line's name is in its legend.
struct Line {
    std::string name;
    const char* colour;
    std::vector<std::pair<double, double>> points;
};
std::string line_chart(const std::string& across, const std::string& up, const std::vector<Line>&);

/// Values of attempts in order, with a line at the mean of the skilled; a value that is not finite is a gap.
struct Curve {
    std::string name, unit;
    std::vector<double> values;
    std::optional<double> skilled;
};
std::string learning_curve(const Curve&);

}  // namespace debrief
