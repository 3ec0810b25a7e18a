#include "engine/scenario/model_choice.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <queue>

#include "engine/anatomy/lumen_wall.h"
#include "engine/io/text.h"
#include "physics/geometry/maths.h"
#include "physics/wall/distance_field.h"

namespace scenario {
namespace {

using geometry::Vec3;

/// The point of a branch `direction` before (< 0) or behind a sample along it; none past its ends.
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
double circle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double sides = (b - a).norm() * (c - b).norm() * (c - a).norm();
    return sides > 0 ? 2 * (b - a).cross(c - b).norm() / sides : 0.0;
}

/// At a sample of a branch, 0 next to its ends [1/mm].
double curvature_at(const geometry::CentrelineBranch& branch, int sample) {
    const double radius = branch.radii[sample];
    const auto before = place_along(branch, sample, -radius), behind = place_along(branch, sample, radius);
    return before && behind ? circle(*before, branch.points[sample], *behind) : 0.0;
}

constexpr double shortest = 0.2, longest = 5;  // λ [mm]

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

/// The wall is all vessels', whatever a device can reach.
void choose_wall(const anatomy::Anatomy& anatomy, const LumenDemand& all, double thickest, bool closed_form,
                 ModelChoice& choice) {
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
        all.smallest_radius, all.narrowest, std::ceil(bytes / 1e6));
}

/// With which a shaft that is straight without load leans on a bend that forces a curvature on it where it
/// begins and where it ends: EIκ over the length on which the clearance lets it straighten, twice [N].
double lean(double rigidity, double curvature, double clearance) {
    if (curvature <= 0) return 0;
    return 2 * rigidity * curvature / std::sqrt(8 * std::max(clearance, 0.1) / curvature);
}

/// How far the distal end lies from the axis of the shaft, unloaded [mm].
double arm_of(const Device& device) {
    Vec3 place = Vec3::Zero();
    geometry::Mat3 turned = geometry::Mat3::Identity();
    for (auto arc = device.shape.rbegin(); arc != device.shape.rend(); ++arc) {
        const Vec3 aside(geometry::cos(arc->plane), geometry::sin(arc->plane), 0);
        const double bent =
            std::abs(arc->angle) < 1e-9 ? 0 : arc->length * (1 - geometry::cos(arc->angle)) / arc->angle;
        const double on =
            std::abs(arc->angle) < 1e-9 ? arc->length : arc->length * geometry::sin(arc->angle) / arc->angle;
        place += turned * (on * Vec3::UnitZ() + bent * aside);
        turned = turned * geometry::rotation(arc->angle, Vec3::UnitZ().cross(aside));
    }
    return place.head<2>().norm();
}

double turn_of_shape(const Device& device) {
    double turn = 0;
    for (const physics::RestArc& arc : device.shape) turn += std::abs(arc.angle);
    return turn;
}

}  // namespace

Reach::Reach(const anatomy::Anatomy& anatomy) : tree_(anatomy.branches, anatomy.openings()) {
    for (const geometry::CentrelineBranch& branch : anatomy.branches) names_.push_back(branch.name);
    for (const geometry::Station& station : tree_.stations())
        curvature_.push_back(curvature_at(anatomy.branches[station.branch], station.sample));
}

double Reach::forced_curvature(int station, double device_radius) const {
    static const double cut = 1 / (1 - std::sqrt(0.5));
    const double clearance = std::max(0.0, tree_.stations()[station].radius - device_radius);
    return curvature_[station] / (1 + curvature_[station] * cut * clearance);
}

LumenDemand Reach::of(std::span<const int> stations, double device_radius) const {
    LumenDemand demand;
    demand.smallest_radius = std::numeric_limits<double>::infinity();
    for (const int s : stations) {
        const geometry::Station& station = tree_.stations()[s];
        if (station.radius < demand.smallest_radius) {
            demand.smallest_radius = station.radius;
            demand.narrowest = names_[station.branch];
            demand.narrowest_sample = station.sample;
        }
        demand.largest_radius = std::max(demand.largest_radius, station.radius);
        if (const double forced = forced_curvature(s, device_radius);
            forced > std::max(demand.forced_curvature, 1e-9)) {
            demand.forced_curvature = forced;
            demand.bends = names_[station.branch];
            demand.bends_radius = station.radius;
        }
        if (curvature_[s] <= std::max(demand.largest_curvature, 1e-9)) continue;
        demand.largest_curvature = curvature_[s];
        demand.sharpest = names_[station.branch];
        demand.sharpest_radius = station.radius;
    }
    return demand;
}

/// Every station that can be come to from one of the seeds, in ascending order.
std::vector<int> Reach::flood(std::vector<Seed> seeds, double least_radius) const {
    const auto stations = tree_.stations();
    std::vector<double> left(stations.size(), -1.0);
    std::priority_queue<Seed> open;
    const auto come = [&](double way, int s) {
        if (way < 0 || way <= left[s] || stations[s].radius < least_radius) return;
        left[s] = way;
        open.emplace(way, s);
    };
    for (const auto& [way, s] : seeds) come(way, s);
    while (!open.empty()) {
        const auto [way, s] = open.top();
        open.pop();
        if (way < left[s]) continue;
        for (const int next : tree_.neighbours(s))
            come(way - (stations[next].centre - stations[s].centre).norm(), next);
    }
    std::vector<int> found;
    for (std::size_t s = 0; s < left.size(); ++s)
        if (left[s] >= 0) found.push_back(static_cast<int>(s));
    return found;
}

LumenDemand Reach::all() const {
    std::vector<int> stations(tree_.stations().size());
    std::iota(stations.begin(), stations.end(), 0);
    return of(stations, 0);
}

std::vector<int> Reach::stations_within(const geometry::OpenEnd& entry, double length,
                                        double diameter) const {
    const double least = std::max(0.0, 0.5 * diameter - geometry::centreline_error);
    return flood({{length, tree_.locate(entry.centre, -1)}}, least);
}

LumenDemand Reach::within(const geometry::OpenEnd& entry, double length, double diameter) const {
    return of(stations_within(entry, length, diameter), 0.5 * diameter);
}

int Reach::station_of(const physics::Chain& chain, double inserted) const {
    const int count = static_cast<int>(tree_.stations().size());
    int joint = 0;
    for (double place = 0; joint < chain.segments() && place + 1e-9 < inserted;)
        place += chain.lengths[++joint];
    const int station = chain.stations[joint];
    return station >= 0 && station < count ? station : tree_.locate(chain.joints[joint], -1);
}

std::pair<std::vector<int>, std::vector<double>> Reach::paths_from(const geometry::OpenEnd& entry) const {
    const auto stations = tree_.stations();
    std::vector<int> before(stations.size(), -1);
    std::vector<double> ways(stations.size(), -1.0);
    using Open = std::pair<double, int>;
    std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
    const int first = tree_.locate(entry.centre, -1);
    open.emplace(ways[first] = 0, first);
    while (!open.empty()) {
        const auto [way, s] = open.top();
        open.pop();
        if (way > ways[s]) continue;
        for (const int next : tree_.neighbours(s)) {
            const double there = way + (stations[next].centre - stations[s].centre).norm();
            if (ways[next] >= 0 && ways[next] <= there) continue;
            before[next] = s;
            open.emplace(ways[next] = there, next);
        }
    }
    return {before, ways};
}

LumenDemand Reach::around(const physics::Chain& chain, int which, double ahead) const {
    const int count = static_cast<int>(tree_.stations().size());
    const double inserted = chain.devices[which].inserted;
    std::vector<int> stations;
    double place = 0;
    for (int j = 0; j <= chain.segments() && (j == 0 || place < inserted); ++j) {
        if (j > 0) place += chain.lengths[j];
        int station = chain.stations[j];
        if (station < 0 || station >= count)
            station = tree_.locate(chain.joints[j], stations.empty() ? -1 : stations.back());
        // What lies between two joints of a branch belongs to it.
        if (!stations.empty() && tree_.same_branch(stations.back(), station)) {
            const int before = stations.back(), step = station < before ? -1 : 1;
            for (int s = before; s != station; s += step) stations.push_back(s);
        }
        stations.push_back(station);
    }
    const std::vector<int> next = flood({{ahead, stations.back()}}, 0);
    stations.insert(stations.end(), next.begin(), next.end());
    return of(stations, 0.5 * chain.devices[which].spec.outer_diameter);
}

TorsionNeed torsion_need(const Device& device, const ShaftState& at, const LumenDemand& within) {
    TorsionNeed need;
    need.within = within;
    need.shaft = at.inserted + at.outside;
    need.arm = std::min(arm_of(device), within.largest_radius);
    const double turn = turn_of_shape(device);
    if (!device.twists() || turn == 0) return need;
    const double shaped = physics::shaped_length(device);
    const double give = physics::torsional_give(device, shaped, std::max(shaped, need.shaft));
    // A shape of curvature κ0 in a bend of κ: dU/dψ = EI κ0 κ per length at most.
    const double by_bend = physics::rigidity_at(device, 0) * turn * within.forced_curvature;
    need.give = give;
    need.winds_up_now = std::abs(at.torque) * give;
    need.winds_up = std::max(by_bend * give, need.winds_up_now);
    if (device.holding_friction() == 0) return need;
    const double radius = 0.5 * device.outer_diameter;
    const double press = lean(physics::rigidity_at(device, reach_ahead), within.forced_curvature,
                              within.bends_radius - radius);
    need.held_back = at.held_back + device.friction * radius * press * give;
    return need;
}

double TorsionNeed::left_out(physics::Torsion model) const {
    return (model == physics::Torsion::Rigid ? winds_up : 0) +
           (model == physics::Torsion::Segments ? 0 : held_back);
}

double TorsionNeed::at_tip(double angle) const {
    return 2 * arm * geometry::sin(0.5 * std::min(angle, std::numbers::pi));
}

physics::Torsion least_torsion(const TorsionNeed& need, const ShaftState& at) {
    using physics::Torsion;
    const auto shows = [&](double angle, Torsion model) {
        const double least = at.now >= model ? 0.5 : 1;
        return angle > least * torsion_shows && need.at_tip(angle) > least * torsion_shows_at_tip;
    };
    if (shows(need.held_back, Torsion::Segments)) return Torsion::Segments;
    if (shows(need.winds_up, Torsion::Whole) || std::abs(at.wound_up) > 0.5 * torsion_shows)
        return Torsion::Whole;
    return Torsion::Rigid;
}

std::string torsion_sentence(const TorsionNeed& need, physics::Torsion model) {
    using physics::Torsion;
    const std::string how = model == Torsion::Rigid   ? "turns with its hub at once"
                            : model == Torsion::Whole ? "winds up as a whole"
                                                      : "twists segment by segment";
    if (need.arm == 0) return how + ": its tip is straight, so that no turn of it shows";
    const std::string bend =
        need.within.bends.empty() ? "no bend" : fmt::format("the bend of '{}'", need.within.bends);
    std::string said = fmt::format(
        "{}: within reach {} can wind up {:.0f} mm of it by {} degrees, and friction hold it back by {}", how,
        bend, need.shaft, io::rounded_text(need.winds_up / geometry::degree, 2),
        io::rounded_text(need.held_back / geometry::degree, 2));
    const double left = need.left_out(model);
    if (left > 0)
        said +=
            fmt::format("; up to {} degrees are left out, {} mm at its tip",
                        io::rounded_text(left / geometry::degree, 2), io::rounded_text(need.at_tip(left), 2));
    return said;
}

ModelChoice choose_model(const anatomy::Anatomy& anatomy, const Reach& reach, const LumenDemand& within,
                         const Device& wire, double curve_tolerance, bool closed_form, double thickest) {
    ModelChoice choice;
    choice.demand = within;
    choose_segment_length(wire, curve_tolerance, choice);
    choose_wall(anatomy, reach.all(), std::max(thickest, 0.5 * wire.outer_diameter), closed_form, choice);
    return choice;
}

ModelChoice choose_model(const anatomy::Anatomy& anatomy, const Device& wire, double curve_tolerance,
                         bool closed_form, double thickest) {
    const Reach reach(anatomy);
    return choose_model(anatomy, reach, reach.all(), wire, curve_tolerance, closed_form, thickest);
}

}  // namespace scenario
