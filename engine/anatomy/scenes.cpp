#include "engine/anatomy/scenes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/geometry/maths.h"
#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

double length(const PenMove& move) {
    if (const Run* run = std::get_if<Run>(&move)) return run->length;
    const Arc& arc = std::get<Arc>(move);
    return arc.radius * std::abs(arc.angle);
}

/// A bend and the straight run after it.
struct ZigzagBend {
    double radius, angle, run;  // [mm], [rad], [mm]
};

/// A plane tube: a run, then bends to the left and to the right by turns.
std::vector<PenMove> zigzag(double run, const std::vector<ZigzagBend>& bends) {
    std::vector<PenMove> path = {Run{run}};
    double side = 1;
    for (const ZigzagBend& bend : bends) {
        path.push_back(Arc{bend.radius, side * bend.angle, Vec3::UnitZ()});
        path.push_back(Run{bend.run});
        side = -side;
    }
    return path;
}

// Tubes as sharply bent as a coronary artery. The first two are the best of a search among 150 for a wire of
// 175 mm with the statistics of the paper's Fig. 13; the third was not searched for.
const std::vector<ZigzagBend> coronary_bends = {
    {4.017, 1.369, 10.353}, {4.064, 1.443, 4.993},  {3.958, 1.647, 6.785},  {4.077, 1.832, 6.300},
    {4.008, 1.642, 4.695},  {4.010, 0.849, 9.197},  {3.948, 0.983, 4.077},  {4.117, 1.399, 5.068},
    {3.724, 1.805, 12.956}, {4.362, 1.845, 8.972},  {4.051, 1.160, 8.980},  {4.192, 0.840, 3.798},
    {4.179, 1.592, 5.869},  {4.154, 1.477, 8.013},  {4.020, 0.865, 7.477},  {4.230, 1.268, 10.300},
    {4.126, 1.616, 6.256},  {4.171, 0.976, 9.711},  {4.110, 1.518, 9.615},  {3.930, 1.185, 9.739},
    {4.241, 1.291, 7.141},  {4.148, 1.191, 10.637}, {4.053, 0.829, 11.064}, {4.250, 1.091, 4.830}};
const std::vector<ZigzagBend> tight_bends = {
    {3.587, 1.411, 9.767},  {3.629, 1.488, 4.710},  {3.534, 1.698, 6.401},  {3.640, 1.889, 5.943},
    {3.579, 1.693, 4.429},  {3.580, 0.875, 8.676},  {3.525, 1.013, 3.846},  {3.676, 1.442, 4.781},
    {3.325, 1.861, 12.223}, {3.895, 1.902, 8.464},  {3.617, 1.196, 8.472},  {3.743, 0.866, 3.583},
    {3.731, 1.641, 5.537},  {3.709, 1.523, 7.559},  {3.589, 0.892, 7.054},  {3.777, 1.307, 9.717},
    {3.684, 1.666, 5.902},  {3.724, 1.006, 9.161},  {3.670, 1.565, 9.071},  {3.509, 1.222, 9.188},
    {3.787, 1.331, 6.737},  {3.704, 1.228, 10.035}, {3.619, 0.855, 10.438}, {3.795, 1.125, 4.557}};
const std::vector<ZigzagBend> sharp_bends = {{3, 1.2, 14}, {3, 1.6, 12}, {3, 1, 10},
                                             {3, 1.4, 12}, {3, 1.5, 15}, {3, 1.2, 12},
                                             {3, 1.4, 12}, {3, 1.3, 12}, {3, 1.2, 60}};

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
            {"stiffwall", sinuous, 1.0, 200, 1.0, 50.0, 1000 * stiffness},
            {"coronary", zigzag(12.844, coronary_bends), 1.0, 175, 1.0, 50.0, stiffness},
            {"coronary-tight", zigzag(12.844, tight_bends), 1.0, 175, 1.0, 50.0, stiffness},
            {"sharp", zigzag(20, sharp_bends), 1.0, 200, 1.0, 50.0, stiffness}};
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
            const geometry::Mat3 turn = geometry::rotation(arc.angle * (k + 0.5) / count, axis);
            points.push_back(points.back() + each * (turn * heading));
        }
        heading = geometry::rotation(arc.angle, axis) * heading;
    }
    return points;
}

Polyline in_pieces(const Polyline& path, double piece, double first) {
    assert(piece > 0 && first > 0 && first <= piece && path.size() >= 2);
    Polyline points = {path.front()};
    double walked = 0, next = first;
    for (std::size_t k = 1; k < path.size(); ++k) {
        const Vec3 step = path[k] - path[k - 1];
        const double length = step.norm();
        for (; next < walked + length; next += piece)
            points.push_back(path[k - 1] + (next - walked) / length * step);
        walked += length;
    }
    if ((path.back() - points.back()).norm() > 1e-6 * piece) points.push_back(path.back());
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
                                             radius * (geometry::cos(angle) * a + geometry::sin(angle) * b));
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
