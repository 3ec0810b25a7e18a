#include "engine/scenario/reach.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <queue>

namespace scenario {
namespace {

using geometry::Vec3;

/// The point of a branch `direction` before (< 0) or behind a sample along it; none past its ends.
std::optional<Vec3> place_along(const geometry::CentrelineBranch& branch, int sample, double length) {
    const int step = length < 0 ? -1 : 1, count = static_cast<int>(branch.points.size());
    double left = std::abs(length);
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
    const auto come = [&](double length, int s) {
        if (length < 0 || length <= left[s] || stations[s].radius < least_radius) return;
        left[s] = length;
        open.emplace(length, s);
    };
    for (const auto& [length, s] : seeds) come(length, s);
    while (!open.empty()) {
        const auto [length, s] = open.top();
        open.pop();
        if (length < left[s]) continue;
        for (const int next : tree_.neighbours(s))
            come(length - (stations[next].centre - stations[s].centre).norm(), next);
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
    std::vector<double> lengths(stations.size(), -1.0);
    using Open = std::pair<double, int>;
    std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
    const int first = tree_.locate(entry.centre, -1);
    open.emplace(lengths[first] = 0, first);
    while (!open.empty()) {
        const auto [length, s] = open.top();
        open.pop();
        if (length > lengths[s]) continue;
        for (const int next : tree_.neighbours(s)) {
            const double there = length + (stations[next].centre - stations[s].centre).norm();
            if (lengths[next] >= 0 && lengths[next] <= there) continue;
            before[next] = s;
            open.emplace(lengths[next] = there, next);
        }
    }
    return {before, lengths};
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

}  // namespace scenario
