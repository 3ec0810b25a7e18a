#include "engine/exercise/branch_stretch.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/anatomy/organs.h"
#include "engine/blood/pressure.h"
#include "engine/io/text.h"

namespace exercise {
namespace {

using geometry::Vec3;

constexpr std::size_t open_ends = 2;  // samples at either end where the tube is wider than any vessel
constexpr double past_ends = 4;       // samples go on past the stretch's ends by this [mm]
constexpr double shortest = 3;        // of what is left of a stretch in its branch [mm]
constexpr double shoulder = 0.25;     // of its length, in which it opens to either side [-]
constexpr double untouched = 0.1;     // between the lumen and a tube that does nothing [mm]

/// Where a stretch begins and ends, from the branch's origin.
std::pair<double, double> extent(const BranchArc& branch_arc, double at, double over) {
    return {std::max(at - 0.5 * over, branch_arc.begin()), std::min(at + 0.5 * over, branch_arc.length)};
}

double smooth(double t) {
    t = std::clamp(t, 0.0, 1.0);
    return t * t * t * (t * (6 * t - 15) + 10);
}

}  // namespace

std::string unknown_branch(const std::string& name, const anatomy::Anatomy& anatomy) {
    std::vector<std::string> names;
    for (const auto& branch : anatomy.branches) names.push_back(branch.name);
    for (const std::string& whole : names)
        if (("+" + whole + "+").find("+" + name + "+") != std::string::npos)
            return fmt::format(
                "'{}' is a later part of '{}', and where it begins is kept in no file: expected "
                "the whole name, with a place from its origin",
                name, whole);
    const std::vector<std::string_view> known(names.begin(), names.end());
    return fmt::format("expected a branch of {}, found '{}'{}; branches are {}", anatomy.name, name,
                       io::suggestion(name, known), io::joined(names));
}

std::string stretch_problem(const anatomy::Anatomy& anatomy, const std::string& name, double at, double over,
                            std::string_view what) {
    const std::optional<int> branch = anatomy::branch_named(anatomy, name);
    if (!branch) return unknown_branch(name, anatomy);
    const BranchArc branch_arc(anatomy, *branch);
    if (at > branch_arc.length)
        return fmt::format("expected a place of 0 to {:.1f} mm from the origin of {}, found {} mm",
                           branch_arc.length, name, io::number_text(at));
    if (const auto [from, to] = extent(branch_arc, at, over); to - from < shortest)
        return fmt::format(
            "expected a {} of at least {} mm in {}, found {:.1f} mm: what would be in its "
            "parent's lumen, or nearer to that than half its radius, is left out",
            what, shortest, name, std::max(0.0, to - from));
    return {};
}

double arc_on_branch(const anatomy::Anatomy& anatomy, int b, const Vec3& x) {
    const BranchArc branch_arc(anatomy, b);
    const auto& points = branch_arc.branch.points;
    std::size_t nearest = 0;
    for (std::size_t k = 1; k < points.size(); ++k)
        if ((points[k] - x).squaredNorm() < (points[nearest] - x).squaredNorm()) nearest = k;
    return branch_arc.arcs[nearest];
}

BranchStretch stretch_of(const anatomy::Anatomy& anatomy, int branch, double at, double over) {
    BranchStretch place;
    const BranchArc branch_arc(anatomy, branch);
    const auto [from, to] = extent(branch_arc, at, over);
    place.from = from, place.to = to;
    const double first = std::max(from - past_ends, branch_arc.arcs.front()),
                 last = std::min(to + past_ends, branch_arc.length), slope = shoulder * (to - from);
    const int count = static_cast<int>(std::floor((last - first) / physics::Narrowing::spacing)) + 1;
    for (int k = 0; k < count; ++k) {
        const double s = first + k * physics::Narrowing::spacing;
        place.axis.push_back(branch_arc.point(s));
        place.arc.push_back(s);
        place.lumen.push_back(branch_arc.radius(s));
        place.shape.push_back(smooth((s - from) / slope) * smooth((to - s) / slope));
        const auto [i, t] = branch_arc.at(s);
        // In an image from the front a flap is seen in profile.
        place.along.push_back((branch_arc.branch.points[i + 1] - branch_arc.branch.points[i]).normalized());
        const Vec3 aside = place.along.back().cross(Vec3::UnitY());
        place.side.push_back(aside.norm() > 1e-6 ? Vec3(aside.normalized()) : Vec3(Vec3::UnitX()));
    }
    std::vector<double> wall = place.lumen;  // how far it is from the axis [mm]
    double reach = 0;
    const Vec3& middle = place.axis[place.axis.size() / 2];
    for (std::size_t k = 0; k < wall.size(); ++k)
        reach = std::max(reach, (place.axis[k] - middle).norm() + BranchStretch::uneven * place.lumen[k]);
    for (const Vec3& v : anatomy.lumen.vertices) {
        if ((v - middle).squaredNorm() > reach * reach) continue;
        std::size_t nearest = 0;
        for (std::size_t k = 1; k < wall.size(); ++k)
            if ((v - place.axis[k]).squaredNorm() < (v - place.axis[nearest]).squaredNorm()) nearest = k;
        const double away = (v - place.axis[nearest]).norm();
        if (away < BranchStretch::uneven * place.lumen[nearest])
            wall[nearest] = std::max(wall[nearest], away);
    }
    for (std::size_t k = 0; k < wall.size(); ++k) {
        const std::size_t before = k < 2 ? 0 : k - 2, after = std::min(k + 3, wall.size());
        place.open.push_back(untouched +
                             *std::max_element(wall.begin() + static_cast<std::ptrdiff_t>(before),
                                               wall.begin() + static_cast<std::ptrdiff_t>(after)));
    }
    return place;
}

/// Its ends are open: past the last sample all that is known stays, and the tube would end in a cap.
physics::Narrowing::Sample BranchStretch::sample(std::size_t k, double narrow, double closed) const {
    physics::Narrowing::Sample sample;
    sample.at = axis[k];
    sample.lumen = lumen[k];
    sample.radius = open[k] + closed * (narrow - open[k]);
    if (k < open_ends || k + open_ends >= axis.size()) sample.radius += 2 * sample.lumen;
    return sample;
}

blood::Obstruction BranchStretch::obstruction(int branch, std::span<const double> radii) const {
    blood::Obstruction made;
    made.branch = branch;
    const auto begin = std::ranges::find_if(shape, [](double s) { return s > 0; });
    made.from = axis[static_cast<std::size_t>(begin - shape.begin())];
    made.middle = axis[axis.size() / 2];
    for (std::size_t k = 0; k < radii.size(); ++k) {
        const double left = std::min(lumen[k], radii[k]);
        made.laminar += blood::laminar_loss(physics::Narrowing::spacing, left, lumen[k]);
        made.turbulent = std::max(made.turbulent, blood::expansion_loss(left, lumen[k]));
    }
    return made;
}

}  // namespace exercise
