#include "physics/geometry/polyline.h"

#include <algorithm>
#include <cmath>

namespace geometry {

std::vector<double> arc_lengths(std::span<const Vec3> points, double start) {
    std::vector<double> arcs = {start};
    for (std::size_t i = 1; i < points.size(); ++i)
        arcs.push_back(arcs.back() + (points[i] - points[i - 1]).norm());
    return arcs;
}

double length_of(std::span<const Vec3> points) {
    double length = 0;
    for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
    return length;
}

Polyline resampled(const Polyline& points, double step) {
    const double whole = length_of(points);
    const int pieces = std::max(1, static_cast<int>(std::lround(whole / step)));
    Polyline result = {points.front()};
    double passed = 0;
    std::size_t i = 1;
    for (int k = 1; k < pieces; ++k) {
        const double wanted = whole * k / pieces;
        double edge = (points[i] - points[i - 1]).norm();
        while (i + 1 < points.size() && passed + edge < wanted) {
            passed += edge;
            ++i;
            edge = (points[i] - points[i - 1]).norm();
        }
        const double part = edge > 0 ? std::clamp((wanted - passed) / edge, 0.0, 1.0) : 0;
        result.push_back(points[i - 1] + part * (points[i] - points[i - 1]));
    }
    result.push_back(points.back());
    return result;
}

CentrelineCoordinate centreline_coordinate(std::span<const Vec3> points, std::span<const double> arcs,
                                           int near, const Vec3& x) {
    const int last = static_cast<int>(points.size()) - 1;
    const auto normal = [&](int i) {
        Vec3 sum = Vec3::Zero();
        if (i > 0) sum += (points[i] - points[i - 1]).normalized();
        if (i < last) sum += (points[i + 1] - points[i]).normalized();
        return sum.normalized();
    };
    const auto past = [&](int i) { return (x - points[i]).dot(normal(i)); };
    int i = std::min(near, last - 1);
    while (i > 0 && past(i) < 0) --i;
    while (i + 1 < last && past(i + 1) > 0) ++i;
    const Vec3 from = normal(i), to = normal(i + 1);
    const double done = (x - points[i]).dot(from), left = (points[i + 1] - x).dot(to), both = done + left;
    if ((i == 0 && done <= 0) || both <= 0) return {arcs[i], Vec3::Zero()};
    if (i + 1 == last && left <= 0) return {arcs[last], Vec3::Zero()};
    const double step = arcs[i + 1] - arcs[i];
    return {arcs[i] + step * done / both, step / (both * both) * (left * from + done * to)};
}

}  // namespace geometry
