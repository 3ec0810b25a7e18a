#include "engine/scenario/model_choice.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <optional>

#include "engine/anatomy/lumen_wall.h"
#include "physics/wall/distance_field.h"

namespace scenario {
namespace {

using geometry::Vec3;

constexpr double shortest = 0.2, longest = 5;  // λ [mm]
constexpr double twist_that_shows = 2 * geometry::degree;

/// The point of a branch `way` before (< 0) or behind a sample along it; none past its ends.
std::optional<Vec3> place_along(const geometry::CentrelineBranch& branch, int sample, double way) {
    const int step = way < 0 ? -1 : 1, count = static_cast<int>(branch.points.size());
    double left = std::abs(way);
    for (int i = sample; i + step >= 0 && i + step < count; i += step) {
        const Vec3 piece = branch.points[i + step] - branch.points[i];
        const double length = piece.norm();
        if (length >= left) return branch.points[i] + left / length * piece;
        left -= length;
    }
    return std::nullopt;
}

/// Curvature of the circle through three points [1/mm].
double curvature(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double sides = (b - a).norm() * (c - b).norm() * (c - a).norm();
    return sides > 0 ? 2 * (b - a).cross(c - b).norm() / sides : 0.0;
}

void choose_segment_length(const Device& wire, double tolerance, ModelChoice& choice) {
    const LumenDemand& demand = choice.demand;
    const auto limit = [&](double length, std::string reason) {
        if (length >= choice.segment_length) return;
        choice.segment_length = length;
        choice.segment_reason = std::move(reason);
    };
    const auto bend = [&](double curvature, const std::string& what) {
        if (curvature <= 0) return;
        limit(std::sqrt(8 * tolerance / curvature),
              fmt::format("{} bends with a radius of {:.3g} mm, from which longer segments sag by more than "
                          "{:g} mm",
                          what, 1 / curvature, tolerance));
    };
    choice.segment_length = longest;
    choice.segment_reason = fmt::format("nothing asks for segments shorter than {:g} mm", longest);
    bend(demand.largest_curvature, fmt::format("'{}'", demand.sharpest));
    bend(largest_curvature(wire), "the wire's tip");
    limit(demand.smallest_radius,
          fmt::format("'{}' narrows to a radius of {:.3g} mm, and a segment is no longer than that",
                      demand.narrowest, demand.smallest_radius));
    double& length = choice.segment_length;
    length = std::max(shortest, std::floor(length / 0.05 * (1 + 1e-9)) * 0.05);
    if (const double shaped = physics::shaped_length(wire); shaped > 0)
        length = shaped / std::ceil(shaped / length * (1 - 1e-9));
}

void choose_wall(const anatomy::Anatomy& anatomy, double thickest, bool closed_form, ModelChoice& choice) {
    if (closed_form) {
        choice.wall = WallModel::Analytic;
        choice.wall_reason = "a tube of constant radius has a closed form";
        return;
    }
    choice.wall_reason = anatomy::obstacle_to_field(anatomy, thickest);
    if (!choice.wall_reason.empty()) return;
    physics::DistanceFieldOptions field;
    field.inner = physics::DistanceField::depth_for(thickest);
    const auto [spacing, bytes, bytes_while] = physics::DistanceField::estimate(anatomy.branches, field);
    choice.wall = WallModel::DistanceField;
    choice.wall_reason = fmt::format(
        "a grid of {:.2g} mm resolves the narrowest radius of {:.3g} mm ('{}') in about {:.0f} MB", spacing,
        choice.demand.smallest_radius, choice.demand.narrowest, std::ceil(bytes / 1e6));
}

/// Twist of the whole shaft by the sharpest bend of the vessels at most, and what 1 N·mm twists it by.
struct WindUp {
    double angle = 0;  // [rad]
    double give = 0;   // [1/(N·mm)]
};
WindUp wind_up(const Device& device, const LumenDemand& demand) {
    WindUp found;
    if (!device.twists()) return found;
    found.give = physics::torsional_give(device, physics::shaped_length(device), device.length);
    // A shape of curvature κ0 in a bend of κ: dU/dψ = EI κ0 κ per length at most.
    double turn = 0;
    for (const physics::RestArc& arc : device.shape) turn += std::abs(arc.angle);
    found.angle = physics::rigidity_at(device, 0) * turn * demand.largest_curvature * found.give;
    return found;
}

void choose_torsion(const Device& wire, ModelChoice& choice) {
    if (!wire.twists()) return;
    const auto [angle, give] = wind_up(wire, choice.demand);
    choice.winds_up = angle > twist_that_shows;
    choice.torsion_reason =
        fmt::format("the sharpest bend ('{}') can wind up {:.0f} mm of shaft by {:.3g} degrees",
                    choice.demand.sharpest, wire.length, angle / geometry::degree);
    if (wire.friction == 0 || !choice.winds_up) return;
    // A shaft that is straight without load leans on a bend where it begins and ends, by EIκ over the length
    // on which the clearance lets it straighten.
    const double bent = choice.demand.largest_curvature;
    const double clearance = std::max(choice.demand.sharpest_radius - 0.5 * wire.outer_diameter, 0.1);
    const double press = 2 * wire.shaft_rigidity() * bent / std::sqrt(8 * clearance / bent);
    const double held = wire.friction * 0.5 * wire.outer_diameter * press * give;
    choice.held_back = held > twist_that_shows;
    choice.held_reason =
        fmt::format(", and friction there can hold it back by {:.3g} degrees", held / geometry::degree);
}

}  // namespace

bool device_winds_up(const Device& device, const LumenDemand& demand) {
    return wind_up(device, demand).angle > twist_that_shows;
}

LumenDemand demand_of(const anatomy::Anatomy& anatomy) {
    LumenDemand demand;
    demand.smallest_radius = std::numeric_limits<double>::infinity();
    for (const geometry::CentrelineBranch& branch : anatomy.branches) {
        for (int i = 0; i < static_cast<int>(branch.points.size()); ++i) {
            const double radius = branch.radii[i];
            if (radius < demand.smallest_radius)
                demand.smallest_radius = radius, demand.narrowest = branch.name, demand.narrowest_sample = i;
            const auto before = place_along(branch, i, -radius), behind = place_along(branch, i, radius);
            if (!before || !behind) continue;
            const double bent = curvature(*before, branch.points[i], *behind);
            if (bent > std::max(demand.largest_curvature, 1e-9))
                demand.largest_curvature = bent, demand.sharpest = branch.name,
                demand.sharpest_radius = radius;
        }
    }
    return demand;
}

ModelChoice choose_model(const anatomy::Anatomy& anatomy, const Device& wire, double curve_tolerance,
                         bool closed_form, double thickest) {
    ModelChoice choice;
    choice.demand = demand_of(anatomy);
    choose_segment_length(wire, curve_tolerance, choice);
    choose_wall(anatomy, std::max(thickest, 0.5 * wire.outer_diameter), closed_form, choice);
    choose_torsion(wire, choice);
    return choice;
}

}  // namespace scenario
