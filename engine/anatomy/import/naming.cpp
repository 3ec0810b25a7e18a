#include "engine/anatomy/import/naming.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <set>

#include "engine/io/error.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

using geometry::Mat3;

constexpr std::size_t longest_name = 60;
constexpr double farthest_end = 3;  // from the place that names it [radii]
/// A line runs along a branch when so many of its samples have it within so many radii.
constexpr double least_fraction = 0.5, near_radii = 0.7;

bool may_stand_in_a_name(char c) {
    return static_cast<unsigned char>(c) >= 0x20 && c != '\x7f' && c != '"' && c != '\\';
}

double distance_to(const Polyline& line, const Vec3& x) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < line.size(); ++i) {
        const Vec3 along = line[i] - line[i - 1];
        const double t = std::clamp((x - line[i - 1]).dot(along) / along.squaredNorm(), 0.0, 1.0);
        least = std::min(least, (line[i - 1] + t * along - x).squaredNorm());
    }
    return std::sqrt(least);
}

/// Fraction of the branch's samples that the line passes, from that one on.
double fraction_along(const CentrelineBranch& branch, const Polyline& line, std::size_t first) {
    int near = 0;
    for (std::size_t i = first; i < branch.points.size(); ++i)
        near += distance_to(line, branch.points[i]) <= near_radii * branch.radii[i];
    return static_cast<double>(near) / static_cast<double>(branch.points.size() - first);
}

/// The name of the line that runs along the branch from that sample on; of several the one that ends nearest
/// to its end.
std::string name_along(const CentrelineBranch& branch, std::span<const GivenLine> lines, std::size_t first) {
    std::string best;
    double best_fraction = least_fraction, best_gap = std::numeric_limits<double>::infinity();
    for (const GivenLine& line : lines) {
        if (line.name.empty()) continue;
        const double fraction = fraction_along(branch, line.points, first);
        const double gap = std::min((line.points.front() - branch.points.back()).norm(),
                                    (line.points.back() - branch.points.back()).norm());
        const bool better =
            fraction > best_fraction + 0.05 || (fraction > best_fraction - 0.05 && gap < best_gap);
        if (fraction < least_fraction || !better) continue;
        best = line.name, best_fraction = std::max(fraction, best_fraction), best_gap = gap;
    }
    std::erase_if(best, [](char c) { return !may_stand_in_a_name(c); });
    return best.substr(0, longest_name);
}

std::string name_by_lines(const CentrelineBranch& branch, std::span<const GivenLine> lines) {
    // Its start lies in the parent's mouth. A stem may follow several lines: that of its last third names it.
    const std::size_t count = branch.points.size();
    const std::string along = name_along(branch, lines, count / 5);
    return along.empty() ? name_along(branch, lines, count - std::max<std::size_t>(count / 3, 1)) : along;
}

std::string without_side(const std::string& name) {
    for (const std::string_view side : {".in", ".out"})
        if (name.ends_with(side) && name.size() > side.size())
            return name.substr(0, name.size() - side.size());
    return name;
}

/// Numbers names that repeat; those the user chose come first.
void make_unique(std::vector<std::string>& names, const std::vector<bool>& chosen) {
    std::set<std::string> taken;
    for (const bool first : {true, false}) {
        for (std::size_t i = 0; i < names.size(); ++i) {
            if (chosen[i] != first) continue;
            const std::string wanted = names[i];
            for (int number = 2; !taken.insert(names[i]).second; ++number)
                names[i] = fmt::format("{}_{}", wanted, number);
        }
    }
}

/// The end that each place names.
std::vector<std::string> names_of_ends(const Anatomy& anatomy, std::span<const NamedPlace> places) {
    std::vector<std::string> names(anatomy.ends.size());
    for (const NamedPlace& place : places) {
        std::size_t nearest = 0;
        const auto distance = [&](std::size_t e) {
            return (anatomy.ends[e].opening.centre - place.at).norm();
        };
        for (std::size_t e = 1; e < names.size(); ++e)
            if (distance(e) < distance(nearest)) nearest = e;
        const geometry::OpenEnd& end = anatomy.ends[nearest].opening;
        if (distance(nearest) > farthest_end * end.radius) {
            std::vector<std::string> there;
            for (const VesselEnd& each : anatomy.ends) there.push_back(io::place_text(each.opening.centre));
            throw io::InputError(
                "--name {}: {} is {:.3g} mm from the nearest end; expected at most {:.3g} mm, ends are at {}",
                place.name, io::place_text(place.at), distance(nearest), farthest_end * end.radius,
                io::joined(there));
        }
        if (!names[nearest].empty())
            throw io::InputError("--name: '{}' and '{}' both name the end at {}; expected one name an end",
                                 names[nearest], place.name, io::place_text(end.centre));
        if (std::ranges::find(names, place.name) != names.end())
            throw io::InputError("--name: '{}' names two ends; expected names that differ", place.name);
        names[nearest] = place.name;
    }
    return names;
}

/// The branch that ends in an outlet, or starts at an inlet.
int branch_at(const Anatomy& anatomy, const VesselEnd& end) {
    int nearest = 0;
    const auto distance = [&](int b) {
        const Polyline& points = anatomy.branches[b].points;
        const Vec3& tip = end.role == EndRole::Inlet ? points.front() : points.back();
        return (tip - end.opening.centre).norm();
    };
    for (int b = 1; b < static_cast<int>(anatomy.branches.size()); ++b)
        if (distance(b) < distance(nearest)) nearest = b;
    return nearest;
}

Mat3 rotation(const std::string& text) {
    constexpr double none = 1e9;
    const double degrees = text.size() > 2 && text[1] == ':'
                               ? io::parse_number(std::string_view(text).substr(2)).value_or(none)
                               : none;
    const auto axis = std::string_view("xyz").find(text.empty() ? ' ' : text[0]);
    if (axis == std::string_view::npos || !(std::abs(degrees) <= 360))
        throw io::InputError(
            "--rotate: '{}' was found; expected AXIS:DEG such as z:90, x, y or z and -360 to 360",
            text.substr(0, 40));
    // Quarter turns are exact.
    const double quarters = degrees / 90;
    Mat3 turn =
        Eigen::AngleAxisd(degrees * geometry::degree, Vec3::Unit(static_cast<int>(axis))).toRotationMatrix();
    if (quarters == std::round(quarters)) turn = turn.array().round().matrix();
    return turn;
}

}  // namespace

NamedPlace parse_named_place(const std::string& text) {
    const std::size_t sign = text.find('=');
    NamedPlace place{text.substr(0, sign), Vec3::Zero()};
    const bool fine = !place.name.empty() && place.name.size() <= longest_name &&
                      std::ranges::all_of(place.name, may_stand_in_a_name);
    if (!fine)
        throw io::InputError(
            "--name {}: expected a name of 1 to {} bytes without control characters, quotes and backslashes "
            "before '='",
            sign == 0 ? "=" : "", longest_name);
    std::string_view rest = std::string_view(text).substr(sign == std::string::npos ? text.size() : sign + 1);
    for (int k = 0; k < 3; ++k) {
        const std::size_t comma = k < 2 ? rest.find(',') : rest.size();
        const auto value =
            comma == std::string_view::npos ? std::nullopt : io::parse_number(rest.substr(0, comma));
        if (!value || !std::isfinite(*value))
            throw io::InputError("--name {}: '{}' was found; expected NAME=X,Y,Z in mm", place.name,
                                 text.substr(0, 80));
        place.at[k] = *value;
        rest.remove_prefix(std::min(comma + 1, rest.size()));
    }
    return place;
}

void give_names(Anatomy& anatomy, std::span<const GivenLine> lines, std::span<const NamedPlace> places) {
    const std::size_t branches = anatomy.branches.size(), ends = anatomy.ends.size();
    const std::vector<std::string> chosen = names_of_ends(anatomy, places);
    std::vector<std::string> names(branches), targets(branches), end_names(ends);
    std::vector<bool> by_user(branches, false), end_by_user(ends, false);
    std::vector<bool> by_line(branches, false);
    for (std::size_t b = 0; b < branches; ++b) {
        const std::string along = name_by_lines(anatomy.branches[b], lines);
        by_line[b] = !along.empty();
        names[b] = targets[b] = by_line[b] ? along : anatomy.branches[b].name;
    }
    // Outlets first: what lies behind one decides its branch's name.
    for (const EndRole role : {EndRole::Outlet, EndRole::Inlet}) {
        for (std::size_t e = 0; e < ends; ++e) {
            if (anatomy.ends[e].role != role || chosen[e].empty()) continue;
            const auto b = static_cast<std::size_t>(branch_at(anatomy, anatomy.ends[e]));
            const std::string stem = without_side(chosen[e]);
            if (!by_user[b])
                names[b] = targets[b] = stem;
            else if (stem != names[b])
                names[b] = stem + "+" + names[b];
            by_user[b] = true;
        }
    }
    make_unique(names, by_user);
    make_unique(targets, by_user);
    for (std::size_t e = 0; e < ends; ++e) {
        const auto b = static_cast<std::size_t>(branch_at(anatomy, anatomy.ends[e]));
        end_by_user[e] = !chosen[e].empty();
        end_names[e] = end_by_user[e] ? chosen[e]
                       : by_line[b]   ? names[b] + (anatomy.ends[e].role == EndRole::Inlet ? ".in" : ".out")
                                      : anatomy.ends[e].opening.name;
    }
    make_unique(end_names, end_by_user);
    for (VesselTarget& target : anatomy.targets)
        target.name = targets[static_cast<std::size_t>(target.branch)];
    for (std::size_t b = 0; b < branches; ++b) anatomy.branches[b].name = names[b];
    for (std::size_t e = 0; e < ends; ++e) anatomy.ends[e].opening.name = end_names[e];
}

Mat3 to_patient(const FileFrame& frame) {
    if (!(frame.scale >= 1e-6 && frame.scale <= 1e6))
        throw io::InputError("--scale: {} was found; expected 1e-6 to 1e6", frame.scale);
    if (frame.axes != "lps" && frame.axes != "ras")
        throw io::InputError("--axes: '{}' was found; expected lps or ras", frame.axes.substr(0, 40));
    Mat3 matrix = frame.scale * Mat3::Identity();
    if (frame.axes == "ras") matrix = (Vec3(-1, -1, 1).asDiagonal() * matrix).eval();
    for (const std::string& text : frame.rotations) matrix = (rotation(text) * matrix).eval();
    return matrix;
}

void transform(const Mat3& matrix, std::vector<Vec3>& points) {
    if (matrix == Mat3::Identity()) return;
    for (Vec3& p : points) p = (matrix * p).eval();
}

namespace {

using geometry::Landmark;

struct Assumed {
    Vec3 at;
    const char* why;
};

/// In pelvis and abdomen the widest branch is an iliac artery.
Assumed bifurcation(const Anatomy& anatomy, const Eigen::AlignedBox3d& box) {
    const geometry::CentrelineBranch* widest = nullptr;
    const auto width = [](const geometry::CentrelineBranch& b) { return b.radii[b.radii.size() / 3]; };
    for (const geometry::CentrelineBranch& branch : anatomy.branches)
        if (branch.parent >= 0 && (!widest || width(branch) > width(*widest))) widest = &branch;
    if (widest) return {widest->points.front(), "where the widest branch leaves"};
    return {box.center(), "the middle of the vessels, which have no branch"};
}

/// Of the wide ends that of the ascending aorta lies in front.
Assumed valve(const Anatomy& anatomy) {
    const VesselEnd* best = nullptr;
    double widest = 0;
    for (const VesselEnd& end : anatomy.ends) widest = std::max(widest, end.opening.radius);
    for (const VesselEnd& end : anatomy.ends) {
        if (end.opening.radius < 0.7 * widest) continue;
        if (!best || end.opening.centre.y() < best->opening.centre.y()) best = &end;
    }
    return {best->opening.centre, "the foremost of the wide ends"};
}

/// The carotids pass beside the sella some way below the highest vessels.
Assumed sella(const Eigen::AlignedBox3d& box) {
    constexpr double below_top = 60, skull = 120;  // [mm]
    Vec3 at = box.center();
    if (box.sizes().z() <= skull) return {at, "the middle of the vessels"};
    at.z() = box.max().z() - below_top;
    return {at, "60 mm below the highest vessels, in their middle"};
}

}  // namespace

Landmark landmark_of_part(const std::string& part) {
    if (part == "pelvis" || part == "abdomen") return Landmark::AorticBifurcation;
    if (part == "chest") return Landmark::AorticValve;
    if (part == "head") return Landmark::Sella;
    throw io::InputError("--body: '{}' was found; expected pelvis, abdomen, chest or head",
                         part.substr(0, 40));
}

std::string place_in_part(Anatomy& anatomy, const std::string& part, const std::optional<Vec3>& landmark) {
    const Landmark hung_on = landmark_of_part(part);
    Eigen::AlignedBox3d box;
    for (const Vec3& v : anatomy.lumen.vertices) box.extend(v);
    const Assumed assumed = landmark                           ? Assumed{*landmark, "as given"}
                            : hung_on == Landmark::AorticValve ? valve(anatomy)
                            : hung_on == Landmark::Sella       ? sella(box)
                                                               : bifurcation(anatomy, box);
    anatomy.body = geometry::BodyPlace{hung_on, assumed.at};
    return fmt::format("in the body ({}) the {} lies at {}, {}{}", part, geometry::name_of(hung_on),
                       io::place_text(assumed.at), assumed.why,
                       landmark ? "" : "; --landmark X,Y,Z puts it elsewhere [mm]");
}

}  // namespace anatomy
