#include "engine/anatomy/mesh_quality.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <unordered_map>

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

double smallest_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto angle = [](const Vec3& u, const Vec3& v) { return std::atan2(u.cross(v).norm(), u.dot(v)); };
    return std::min({angle(b - a, c - a), angle(c - b, a - b), angle(a - c, b - c)});
}

/// Whether the segment from p to q crosses the triangle (Möller and Trumbore 1997).
bool crosses(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 along = q - p, u = b - a, v = c - a, normal = along.cross(v);
    const double determinant = u.dot(normal);
    if (std::abs(determinant) < 1e-14) return false;
    const Vec3 from = p - a, other = from.cross(u);
    const double s = from.dot(normal) / determinant, t = along.dot(other) / determinant,
                 at = v.dot(other) / determinant;
    return s >= 0 && t >= 0 && s + t <= 1 && at >= 0 && at <= 1;
}

class Boxes {
public:
    explicit Boxes(const TriangleMesh& mesh) : mesh_(mesh) {
        double sum = 0;
        for (const auto& t : mesh.triangles) sum += (corner(t, 1) - corner(t, 0)).norm();
        edge_ = 2 * sum / static_cast<double>(std::max<std::size_t>(1, mesh.triangles.size()));
        for (int i = 0; i < static_cast<int>(mesh.triangles.size()); ++i)
            for_boxes(i, [&](std::uint64_t box) { held_[box].push_back(i); });
    }
    std::vector<std::pair<int, int>> crossing_pairs() const {
        std::vector<std::pair<int, int>> pairs;
        std::vector<int> near;
        for (int i = 0; i < static_cast<int>(mesh_.triangles.size()); ++i) {
            near.clear();
            for_boxes(i, [&](std::uint64_t box) {
                for (const int j : held_.at(box))
                    if (j > i) near.push_back(j);
            });
            std::sort(near.begin(), near.end());
            near.erase(std::unique(near.begin(), near.end()), near.end());
            for (const int j : near)
                if (cross(mesh_.triangles[i], mesh_.triangles[j])) pairs.emplace_back(i, j);
        }
        return pairs;
    }

private:
    using Triangle = std::array<int, 3>;
    const Vec3& corner(const Triangle& t, int k) const { return mesh_.vertices[t[k]]; }
    template <class Visit>
    void for_boxes(int triangle, Visit visit) const {
        const Triangle& t = mesh_.triangles[triangle];
        const Vec3 low = corner(t, 0).cwiseMin(corner(t, 1)).cwiseMin(corner(t, 2)) / edge_,
                   high = corner(t, 0).cwiseMax(corner(t, 1)).cwiseMax(corner(t, 2)) / edge_;
        const auto cell = [](double x) { return static_cast<std::int64_t>(std::floor(x)); };
        for (auto z = cell(low.z()); z <= cell(high.z()); ++z)
            for (auto y = cell(low.y()); y <= cell(high.y()); ++y)
                for (auto x = cell(low.x()); x <= cell(high.x()); ++x)
                    visit(static_cast<std::uint64_t>((z & 0x1fffff) << 42 | (y & 0x1fffff) << 21 |
                                                     (x & 0x1fffff)));
    }
    bool cross(const Triangle& s, const Triangle& t) const {
        for (const int a : s)
            for (const int b : t)
                if (a == b) return false;
        for (int k = 0; k < 3; ++k) {
            if (crosses(corner(s, k), corner(s, (k + 1) % 3), corner(t, 0), corner(t, 1), corner(t, 2)) ||
                crosses(corner(t, k), corner(t, (k + 1) % 3), corner(s, 0), corner(s, 1), corner(s, 2)))
                return true;
        }
        return false;
    }

    const TriangleMesh& mesh_;
    double edge_ = 1;
    std::unordered_map<std::uint64_t, std::vector<int>> held_;
};

}  // namespace

TriangleAngles smallest_angles(const TriangleMesh& mesh) {
    std::vector<double> angles;
    for (const auto& t : mesh.triangles)
        angles.push_back(smallest_angle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]));
    if (angles.empty()) return {};
    std::sort(angles.begin(), angles.end());
    return {angles.front(), angles[angles.size() / 100]};
}

int euler_characteristic(const TriangleMesh& mesh) {
    std::set<int> corners;
    std::vector<std::uint64_t> edges;
    for (const auto& t : mesh.triangles) {
        for (int k = 0; k < 3; ++k) {
            const int a = t[k], b = t[(k + 1) % 3];
            corners.insert(a);
            edges.push_back(static_cast<std::uint64_t>(std::min(a, b)) << 32 |
                            static_cast<std::uint32_t>(std::max(a, b)));
        }
    }
    std::sort(edges.begin(), edges.end());
    const auto distinct = std::unique(edges.begin(), edges.end()) - edges.begin();
    return static_cast<int>(corners.size()) - static_cast<int>(distinct) +
           static_cast<int>(mesh.triangles.size());
}

std::vector<std::pair<int, int>> crossing_pairs(const TriangleMesh& mesh) {
    return Boxes(mesh).crossing_pairs();
}

int self_intersections(const TriangleMesh& mesh) {
    return static_cast<int>(crossing_pairs(mesh).size());
}

}  // namespace anatomy
