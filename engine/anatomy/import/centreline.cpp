#include "engine/anatomy/import/centreline.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

using geometry::Polyline;
using geometry::Vec3;

constexpr int rays = 36;
constexpr double reach = 1.4;  // of a ray, in medians of the fan
constexpr int rounds = 6;

void smooth(std::vector<Vec3>& points, int passes) {
    for (int pass = 0; pass < passes; ++pass) {
        Vec3 before = points[0];
        for (std::size_t i = 1; i + 1 < points.size(); ++i) {
            const Vec3 here = points[i];
            points[i] = 0.25 * before + 0.5 * here + 0.25 * points[i + 1];
            before = here;
        }
    }
}

/// Offset from the point to the centroid of the cross-section through it; false where the lumen is open.
bool offset_to_centroid(const geometry::MeshQuery& wall, const Vec3& point, const Vec3& tangent,
                        Vec3& offset) {
    const Vec3 u = tangent.unitOrthogonal(), v = tangent.cross(u);
    std::array<double, rays> length, sorted;
    std::array<Vec3, rays> direction;
    for (int k = 0; k < rays; ++k) {
        const double angle = 2 * std::numbers::pi * k / rays;
        direction[k] = std::cos(angle) * u + std::sin(angle) * v;
        length[k] = wall.first_hit(point, direction[k]);
    }
    sorted = length;
    std::nth_element(sorted.begin(), sorted.begin() + rays / 2, sorted.end());
    const double median = sorted[rays / 2];
    if (!std::isfinite(median)) return false;
    // Rays that leave through an opening are missing; those into a side branch are only cut off.
    int missed = 0;
    for (double& l : length) {
        missed += !std::isfinite(l);
        l = std::min(l, reach * median);
    }
    if (missed > 0) return false;
    Vec3 moment = Vec3::Zero();
    double area = 0;
    for (int k = 0; k < rays; ++k) {
        const int n = (k + 1) % rays;
        const double own = length[k] * length[n];  // twice the triangle's area, but for a common factor
        moment += own * (length[k] * direction[k] + length[n] * direction[n]) / 3;
        area += own;
    }
    offset = moment / area;
    return true;
}

/// Fills in unknown offsets, linear between known ones; 0 beyond a fixed end, constant beyond a free one.
void bridge(std::vector<Vec3>& offsets, const std::vector<char>& known) {
    const int count = static_cast<int>(offsets.size());
    int last = -1;
    for (int i = 0; i <= count; ++i) {
        if (i < count && !known[i]) continue;
        for (int k = last + 1; k < i; ++k) {
            if (last < 0 && i == count) continue;
            const double part = last < 0 ? 1 : i == count ? 0 : static_cast<double>(k - last) / (i - last);
            offsets[k] = (1 - part) * (last < 0 ? Vec3(Vec3::Zero()) : offsets[last]) +
                         part * (i == count ? Vec3(Vec3::Zero()) : offsets[i]);
        }
        last = i;
    }
}

}  // namespace

std::vector<double> inscribed_radii(const Polyline& points, const geometry::MeshQuery& wall) {
    std::vector<double> radii;
    for (const Vec3& p : points) radii.push_back(wall.distance(p));
    return radii;
}

Centreline recentred(const Polyline& rough, const geometry::MeshQuery& wall, double step, bool fixed_start,
                     bool fixed_end) {
    Polyline points = geometry::resampled(rough, step);
    smooth(points, 10);
    for (int round = 0; round < rounds; ++round) {
        const int count = static_cast<int>(points.size());
        std::vector<Vec3> offsets(points.size(), Vec3::Zero());
        std::vector<char> known(points.size(), 0);
        for (int i = 0; i < count; ++i) {
            if ((i == 0 && fixed_start) || (i == count - 1 && fixed_end)) {
                known[i] = 1;
                continue;
            }
            const double radius = wall.distance(points[i]);
            const int span = std::max(2, static_cast<int>(std::lround(0.5 * radius / step)));
            const Vec3 along = points[std::min(count - 1, i + span)] - points[std::max(0, i - span)];
            if (along.norm() == 0) continue;
            known[i] = offset_to_centroid(wall, points[i], along.normalized(), offsets[i]);
        }
        bridge(offsets, known);
        for (int i = 0; i < count; ++i) points[i] += offsets[i];
        smooth(points, 2);
        points = geometry::resampled(points, step);
    }
    std::vector<double> radii = inscribed_radii(points, wall);
    return {std::move(points), std::move(radii)};
}

}  // namespace anatomy
