#include "physics/wall/even_rims.h"

#include <algorithm>
#include <cmath>

#include "physics/geometry/mesh_topology.h"

namespace physics {
namespace {

constexpr double uneven_by = 0.02;    // of a rim, from its plane [mm]
constexpr double past_the_plane = 1;  // to where a rim is led [mm]
constexpr double belongs = 0.5;       // of the end's radius: from its centre to that of its rim

double past(const OpenEnd& end, const Vec3& x) {
    return (x - end.centre).dot(end.outward_normal);
}

/// A rim's corners moved past the plane; a corner that is there already stays.
void lead_on(TriangleMesh& mesh, const BoundaryLoop& rim, const OpenEnd& end) {
    std::vector<int> led;
    for (const int v : rim.vertices) {
        const Vec3 corner = mesh.vertices[v];
        const double missing = past_the_plane - past(end, corner);
        led.push_back(missing > 0 ? static_cast<int>(mesh.vertices.size()) : v);
        if (missing > 0) mesh.vertices.push_back(corner + missing * end.outward_normal);
    }
    for (std::size_t i = 0; i < led.size(); ++i) {
        const std::size_t next = (i + 1) % led.size();
        const int a = rim.vertices[i], b = rim.vertices[next];
        if (led[next] != b) mesh.triangles.push_back({a, b, led[next]});
        if (led[i] != a) mesh.triangles.push_back({a, led[next], led[i]});
    }
}

}  // namespace

TriangleMesh with_even_rims(const TriangleMesh& lumen, std::span<const OpenEnd> ends) {
    TriangleMesh mesh = lumen;
    for (const BoundaryLoop& rim : topology(lumen).loops) {
        const Vec3 centre = rim_centre(lumen, rim);
        const auto of_rim = std::ranges::find_if(
            ends, [&](const OpenEnd& end) { return (end.centre - centre).norm() < belongs * end.radius; });
        if (of_rim == ends.end()) continue;
        if (std::ranges::any_of(
                rim.vertices, [&](int v) { return std::abs(past(*of_rim, lumen.vertices[v])) > uneven_by; }))
            lead_on(mesh, rim, *of_rim);
    }
    return mesh;
}

}  // namespace physics
