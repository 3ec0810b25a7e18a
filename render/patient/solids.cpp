#include "render/patient/solids.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "physics/geometry/mesh_topology.h"

namespace render {

TriangleMesh loft(const std::vector<Polyline>& rings) {
    assert(rings.size() >= 2 && rings.front().size() >= 3);
    TriangleMesh mesh;
    const int count = static_cast<int>(rings.size()), around = static_cast<int>(rings.front().size());
    for (const Polyline& ring : rings) mesh.vertices.insert(mesh.vertices.end(), ring.begin(), ring.end());
    for (int r = 0; r + 1 < count; ++r) {
        for (int k = 0; k < around; ++k) {
            const int a = r * around + k, b = r * around + (k + 1) % around;
            mesh.triangles.push_back({a, b, b + around});
            mesh.triangles.push_back({a, b + around, a + around});
        }
    }
    const int first = static_cast<int>(mesh.vertices.size()), last = first + 1;
    for (const Polyline* ring : {&rings.front(), &rings.back()}) {
        Vec3 sum = Vec3::Zero();
        for (const Vec3& p : *ring) sum += p;
        mesh.vertices.push_back(sum / around);
    }
    for (int k = 0; k < around; ++k) {
        const int next = (k + 1) % around, top = (count - 1) * around;
        mesh.triangles.push_back({first, next, k});
        mesh.triangles.push_back({last, top + k, top + next});
    }
    if (geometry::signed_volume(mesh) < 0.0) {
        for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    }
    return mesh;
}

TriangleMesh loft(const std::vector<Ring>& rings, int around) {
    std::vector<Polyline> points;
    for (const Ring& ring : rings) {
        points.emplace_back();
        for (int k = 0; k < around; ++k) {
            const double angle = 2.0 * std::numbers::pi * k / around, c = std::cos(angle),
                         s = std::sin(angle);
            const double power = 2.0 / ring.exponent;
            points.back().push_back(ring.centre +
                                    ring.a * std::copysign(std::pow(std::abs(c), power), c) * ring.u +
                                    ring.b * std::copysign(std::pow(std::abs(s), power), s) * ring.v);
        }
    }
    return loft(points);
}

TriangleMesh tube(const Polyline& path, const Vec3& u, const std::vector<double>& a,
                  const std::vector<double>& b, int around) {
    assert(path.size() >= 2 && a.size() == path.size() && b.size() == path.size());
    std::vector<Ring> rings;
    for (std::size_t i = 0; i < path.size(); ++i) {
        const Vec3 along = (path[std::min(i + 1, path.size() - 1)] - path[i == 0 ? 0 : i - 1]).normalized();
        const Vec3 across = (u - u.dot(along) * along).normalized();
        rings.push_back({path[i], across, along.cross(across), a[i], b[i], 2.0});
    }
    return loft(rings, around);
}

TriangleMesh star(const Vec3& centre, const std::function<double(const Vec3&)>& radius, int around) {
    std::vector<Polyline> rings;
    const int levels = around / 2;
    for (int i = 0; i <= levels; ++i) {
        // The outermost rings are small, not points: a point would make its triangles degenerate.
        const double polar = std::numbers::pi * (i + 0.02 * (levels - 2 * i) / levels) / levels;
        rings.emplace_back();
        for (int k = 0; k < around; ++k) {
            const double angle = 2.0 * std::numbers::pi * k / around;
            const Vec3 direction(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
                                 -std::cos(polar));
            rings.back().push_back(centre + radius(direction) * direction);
        }
    }
    return loft(rings);
}

TriangleMesh ellipsoid(const Vec3& centre, const Vec3& half_axes, int around) {
    std::vector<Ring> rings;
    const int levels = around / 2;
    for (int i = 0; i <= levels; ++i) {
        // The outermost rings are small, not points: a point would make its triangles degenerate.
        const double angle = std::numbers::pi * (i + 0.02 * (levels - 2 * i) / levels) / levels;
        Ring ring;
        ring.centre = centre - Vec3(0.0, 0.0, half_axes.z() * std::cos(angle));
        ring.a = half_axes.x() * std::sin(angle);
        ring.b = half_axes.y() * std::sin(angle);
        rings.push_back(ring);
    }
    return loft(rings, around);
}

void scatter(const TriangleMesh& mesh, double per_area, geometry::Random& random,
             const std::function<void(const Vec3&, const Vec3&)>& draw) {
    for (const auto& t : mesh.triangles) {
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        const Vec3 normal = (b - a).cross(c - a);
        const double twice = normal.norm();
        if (twice < 1e-9) continue;
        const int count = static_cast<int>(0.5 * twice * per_area + random());
        for (int k = 0; k < count; ++k) {
            const double u = std::sqrt(random()), v = random();
            draw((1.0 - u) * a + u * (1.0 - v) * b + u * v * c, -normal / twice);
        }
    }
}

void append(TriangleMesh& mesh, const TriangleMesh& other) {
    const int offset = static_cast<int>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
    for (const auto& t : other.triangles)
        mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
}

TriangleMesh subdivided(const TriangleMesh& mesh) {
    TriangleMesh finer;
    finer.vertices = mesh.vertices;
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
        const auto [at, added] =
            middles.try_emplace(std::minmax(a, b), static_cast<int>(finer.vertices.size()));
        if (added) finer.vertices.emplace_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
        return at->second;
    };
    for (const auto& [a, b, c] : mesh.triangles) {
        const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
        for (const auto& t : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
            finer.triangles.push_back(t);
    }
    return finer;
}

}  // namespace render
