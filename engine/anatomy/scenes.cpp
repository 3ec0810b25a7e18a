#include "engine/anatomy/scenes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

using geometry::Polyline;
using geometry::Vec3;

double length(const PenMove& move) {
    if (const Run* run = std::get_if<Run>(&move)) return run->length;
    const Arc& arc = std::get<Arc>(move);
    return arc.radius * std::abs(arc.angle);
}

std::vector<Scene> all_scenes() {
    const Vec3 y = Vec3::UnitY(), z = Vec3::UnitZ();
    const std::vector<PenMove> sinuous = {
        Run{20}, Arc{25, 1.2, z}, Run{10}, Arc{18, -1.6, z}, Run{8}, Arc{30, 1.0, z}, Arc{15, -1.4, z},
        Run{5},  Arc{20, 1.5, z}, Run{10}, Arc{12, -1.2, z}, Run{30}};
    const std::vector<PenMove> spatial = {Run{15},
                                          Arc{25, 1.0, z},
                                          Arc{20, -1.2, y},
                                          Run{10},
                                          Arc{15, 1.5, {.3, .5, 1}},
                                          Run{5},
                                          Arc{18, -1.3, {1, .2, .6}},
                                          Arc{22, 1.1, {0, 1, 1}},
                                          Run{30}};
    const std::vector<PenMove> hairpin = {Run{30}, Arc{8, 3.0, z}, Run{30}, Arc{6, -2.4, z}, Run{30}};
    // The paper's trace ratios imply k ≈ 0.84 EI/λ³.
    const double stiffness = 0.84 * 50;
    return {{"sinuous", sinuous, 1.0, 200, 1.0, 50.0, stiffness},
            {"spatial", spatial, 2.0, 170, 1.0, 50.0, stiffness},
            {"hairpin", hairpin, 1.5, 120, 1.0, 50.0, stiffness},
            {"stiffwall", sinuous, 1.0, 200, 1.0, 50.0, 1000 * stiffness}};
}

/// The rotation of one direction into another by the smallest angle. Eigen's own finds the axis of a half
/// turn by a singular value decomposition, which takes ten seconds to compile.
Eigen::Quaterniond shortest_turn(const Vec3& from, const Vec3& to) {
    const Vec3 u = from.normalized(), v = to.normalized();
    const double cosine = v.dot(u);
    Eigen::Quaterniond turn;
    if (cosine < -1 + 1e-12) {
        turn.w() = 0;
        turn.vec() = u.unitOrthogonal();
    } else {
        const double s = std::sqrt(2 * (1 + cosine));
        turn.w() = 0.5 * s;
        turn.vec() = u.cross(v) * (1 / s);
    }
    return turn;
}

/// Points about `step` apart along a polyline, including its first and last.
Polyline resampled_path(const Polyline& path, double step) {
    const double total = geometry::length_of(path);
    const int count = std::max(1, static_cast<int>(std::ceil(total / step - 1e-9)));
    Polyline points = {path.front()};
    double walked = 0;
    std::size_t at = 1;
    for (int k = 1; k < count; ++k) {
        const double goal = total * k / count;
        while (at + 1 < path.size() && walked + (path[at] - path[at - 1]).norm() < goal) {
            walked += (path[at] - path[at - 1]).norm();
            ++at;
        }
        points.push_back(path[at - 1] + (goal - walked) * (path[at] - path[at - 1]).normalized());
    }
    points.push_back(path.back());
    return points;
}

}  // namespace

double length(std::span<const PenMove> path) {
    double total = 0;
    for (const PenMove& move : path) total += length(move);
    return total;
}

Polyline draw(std::span<const PenMove> path, double step) {
    assert(step > 0);
    Polyline points = {Vec3::Zero()};
    Vec3 heading = Vec3::UnitX();
    for (const PenMove& move : path) {
        const int count = std::max(1, static_cast<int>(std::ceil(length(move) / step - 1e-9)));
        if (const Run* run = std::get_if<Run>(&move)) {
            const Vec3 start = points.back();
            for (int k = 1; k <= count; ++k) points.push_back(start + run->length * k / count * heading);
            continue;
        }
        const Arc& arc = std::get<Arc>(move);
        const Vec3 axis = arc.axis.normalized();
        // Steps of equal length along the heading at their middle, so that the polyline is as long as the
        // arc.
        const double each = length(move) / count;
        for (int k = 0; k < count; ++k) {
            const Eigen::AngleAxisd turn(arc.angle * (k + 0.5) / count, axis);
            points.push_back(points.back() + each * (turn * heading));
        }
        heading = Eigen::AngleAxisd(arc.angle, axis) * heading;
    }
    return points;
}

const std::vector<Scene>& scenes() {
    static const std::vector<Scene> table = all_scenes();
    return table;
}

const Scene* find_scene(std::string_view name) {
    for (const Scene& scene : scenes()) {
        if (scene.name == name) return &scene;
    }
    return nullptr;
}

Anatomy tube_anatomy(const std::string& name, const Polyline& centreline, double radius, int around,
                     double step) {
    assert(around >= 3 && step > 0 && radius > 0 && centreline.size() >= 2);
    const Polyline points = resampled_path(centreline, step);
    const int rings = static_cast<int>(points.size());
    const auto tangent = [&](int i) {
        return (points[std::min(i + 1, rings - 1)] - points[std::max(i - 1, 0)]).normalized().eval();
    };

    Anatomy anatomy;
    anatomy.name = name;
    Vec3 before = tangent(0);
    Vec3 a = before.unitOrthogonal();
    for (int i = 0; i < rings; ++i) {
        // Parallel transport: facets run along the tube without twist.
        const Vec3 u = tangent(i);
        a = shortest_turn(before, u) * a;
        a = (a - a.dot(u) * u).normalized();
        before = u;
        const Vec3 b = u.cross(a);
        for (int k = 0; k < around; ++k) {
            const double angle = 2 * std::numbers::pi * k / around;
            anatomy.lumen.vertices.push_back(points[i] +
                                             radius * (std::cos(angle) * a + std::sin(angle) * b));
        }
    }
    for (int i = 0; i + 1 < rings; ++i) {
        for (int k = 0; k < around; ++k) {
            const int p = i * around + k, q = i * around + (k + 1) % around;
            anatomy.lumen.triangles.push_back({p, q, q + around});
            anatomy.lumen.triangles.push_back({p, q + around, p + around});
        }
    }
    anatomy.branches.push_back({"tube", -1, -1, points, std::vector<double>(points.size(), radius)});
    anatomy.ends = {{{"start", points.front(), -tangent(0), radius}, EndRole::Inlet},
                    {{"end", points.back(), tangent(rings - 1), radius}, EndRole::Outlet}};
    int sample = rings - 1;
    for (double left = 5 * radius; sample > 0 && left > 0; --sample)
        left -= (points[sample] - points[sample - 1]).norm();
    anatomy.targets = {{"end", points[sample], 0, sample}};
    return anatomy;
}

}  // namespace anatomy
