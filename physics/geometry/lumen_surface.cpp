#include "physics/geometry/lumen_surface.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include "physics/geometry/maths.h"
#include "physics/geometry/mesh_topology.h"

namespace geometry {
namespace {

/// Welded, without triangles that have no area.
TriangleMesh prepared(const TriangleMesh& mesh) {
    for (const Vec3& v : mesh.vertices)
        if (!v.allFinite()) throw std::invalid_argument("the lumen mesh has a vertex that is not finite");
    for (const auto& t : mesh.triangles)
        for (int v : t)
            if (v < 0 || v >= static_cast<int>(mesh.vertices.size()))
                throw std::invalid_argument("the lumen mesh has a triangle with an index out of range");
    TriangleMesh out = welded(mesh);
    std::erase_if(out.triangles, [&](const auto& t) {
        const Vec3 &a = out.vertices[t[0]], &b = out.vertices[t[1]], &c = out.vertices[t[2]];
        return !((b - a).cross(c - a).squaredNorm() > 0);
    });
    if (out.triangles.empty()) throw std::invalid_argument("the lumen mesh has no triangles");
    return out;
}

/// Triangle over each edge; -1 where one or more than two triangles meet.
std::vector<std::array<int, 3>> neighbours_of(const TriangleMesh& mesh) {
    struct Side {
        int low, high, triangle, k;
    };
    std::vector<Side> sides;
    for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t)
        for (int k = 0; k < 3; ++k) {
            const int a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
            sides.push_back({std::min(a, b), std::max(a, b), t, k});
        }
    std::sort(sides.begin(), sides.end(), [](const Side& p, const Side& q) {
        return std::tie(p.low, p.high, p.triangle) < std::tie(q.low, q.high, q.triangle);
    });
    std::vector<std::array<int, 3>> across(mesh.triangles.size(), {-1, -1, -1});
    for (std::size_t i = 0, j; i < sides.size(); i = j) {
        for (j = i + 1; j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high;)
            ++j;
        if (j - i != 2) continue;
        across[sides[i].triangle][sides[i].k] = sides[i + 1].triangle;
        across[sides[i + 1].triangle][sides[i + 1].k] = sides[i].triangle;
    }
    return across;
}

}  // namespace

LumenSurface::LumenSurface(const TriangleMesh& mesh) : mesh_(prepared(mesh)), across_(neighbours_of(mesh_)) {
    part_.assign(count(), -1);
    std::vector<int> open;
    for (int seed = 0; seed < count(); ++seed) {
        if (part_[seed] >= 0) continue;
        part_[seed] = parts_;
        open.push_back(seed);
        while (!open.empty()) {
            const int t = open.back();
            open.pop_back();
            for (int k = 0; k < 3; ++k) {
                const int u = across_[t][k];
                if (u < 0 || part_[u] >= 0) continue;
                part_[u] = parts_;
                open.push_back(u);
                // Two triangles face the same side when they run along their edge in opposite directions.
                auto& v = mesh_.triangles[u];
                const int from = mesh_.triangles[t][k], to = mesh_.triangles[t][(k + 1) % 3];
                for (int m = 0; m < 3; ++m)
                    if (v[m] == from && v[(m + 1) % 3] == to) {
                        std::swap(v[1], v[2]);
                        std::swap(across_[u][0], across_[u][2]);
                        break;
                    }
            }
        }
        ++parts_;
    }
}

void LumenSurface::face_out(const std::vector<double>& vote) {
    corner_normals_.assign(mesh_.vertices.size(), Vec3::Zero());
    for (int t = 0; t < count(); ++t) {
        auto& v = mesh_.triangles[t];
        if (vote[part_[t]] < 0) {
            std::swap(v[1], v[2]);
            std::swap(across_[t][0], across_[t][2]);
        }
        // The same corner first, whichever way the triangle came: the same bits from any input order.
        while (v[0] > v[1] || v[0] > v[2]) {
            std::rotate(v.begin(), v.begin() + 1, v.end());
            std::rotate(across_[t].begin(), across_[t].begin() + 1, across_[t].end());
        }
        double reach = 0;
        for (int k = 0; k < 3; ++k) reach = std::max(reach, (corner(t, k) - centroid(t)).norm());
        spheres_.push_back({centroid(t), reach * (1 + 1e-12)});
        normals_.push_back(area_normal(t).normalized());
        for (int k = 0; k < 3; ++k) {
            const Vec3 p = corner(t, (k + 1) % 3) - corner(t, k), q = corner(t, (k + 2) % 3) - corner(t, k);
            corner_normals_[v[k]] += geometry::atan2(p.cross(q).norm(), p.dot(q)) * normals_[t];
        }
    }
}

double LumenSurface::flatness(int t) const {
    double least = 1;
    for (const int over : across_[t])
        if (over >= 0) least = std::min(least, normals_[t].dot(normals_[over]));
    return least;
}

Vec3 LumenSurface::pseudo_normal(int t, int feature) const {
    if (feature < 3) return corner_normals_[mesh_.triangles[t][feature]];
    if (feature < 6 && across_[t][feature - 3] >= 0) return normals_[t] + normals_[across_[t][feature - 3]];
    return normals_[t];
}

/// The regions of the plane around a triangle, each with its closest feature (Ericson 2005, Section 5.1.5).
TrianglePoint closest_point(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x) {
    auto at = [&](const Vec3& p, int feature) { return TrianglePoint{p, (x - p).squaredNorm(), feature}; };
    const Vec3 ab = b - a, ac = c - a, ax = x - a, bx = x - b, cx = x - c;
    const double d1 = ab.dot(ax), d2 = ac.dot(ax);
    if (d1 <= 0 && d2 <= 0) return at(a, 0);
    const double d3 = ab.dot(bx), d4 = ac.dot(bx);
    if (d3 >= 0 && d4 <= d3) return at(b, 1);
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return at(a + d1 / (d1 - d3) * ab, 3);
    const double d5 = ab.dot(cx), d6 = ac.dot(cx);
    if (d6 >= 0 && d5 <= d6) return at(c, 2);
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return at(a + d2 / (d2 - d6) * ac, 5);
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
        return at(b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b), 4);
    const double sum = va + vb + vc;
    return at(a + vb / sum * ab + vc / sum * ac, 6);
}

}  // namespace geometry
