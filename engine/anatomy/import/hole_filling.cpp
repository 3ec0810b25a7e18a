#include "engine/anatomy/import/hole_filling.h"

#include <limits>

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

/// The time for the least area grows with the cube of the number of corners of the rim.
constexpr int longest_rim = 120;

/// Triangulation of least area of a polygon in space, by dynamic programming (Barequet and Sharir 1995).
class LeastArea {
public:
    LeastArea(const TriangleMesh& mesh, const EdgeSet& edges, const std::vector<int>& rim)
        : mesh_(mesh), edges_(edges), rim_(rim), count_(static_cast<int>(rim.size())) {
        area_.assign(static_cast<std::size_t>(count_) * count_, 0.0);
        apex_.assign(area_.size(), -1);
        for (int span = 2; span < count_; ++span)
            for (int i = 0; i + span < count_; ++i) solve(i, i + span);
    }
    bool found() const { return area_[at(0, count_ - 1)] < std::numeric_limits<double>::infinity(); }
    void append(TriangleMesh& mesh, EdgeSet& edges) const { append(mesh, edges, 0, count_ - 1); }

private:
    std::size_t at(int i, int j) const { return static_cast<std::size_t>(i) * count_ + j; }
    double area(int i, int k, int j) const {
        const Vec3& a = mesh_.vertices[rim_[i]];
        return (mesh_.vertices[rim_[k]] - a).cross(mesh_.vertices[rim_[j]] - a).norm();
    }
    void solve(int i, int j) {
        double& least = area_[at(i, j)];
        least = std::numeric_limits<double>::infinity();
        const bool outer = i == 0 && j == count_ - 1;
        if (!outer && edges_.holds(rim_[i], rim_[j])) return;
        for (int k = i + 1; k < j; ++k) {
            const double sum = area_[at(i, k)] + area_[at(k, j)] + area(i, k, j);
            if (sum < least) least = sum, apex_[at(i, j)] = k;
        }
    }
    void append(TriangleMesh& mesh, EdgeSet& edges, int i, int j) const {
        if (j - i < 2) return;
        const int k = apex_[at(i, j)];
        mesh.triangles.push_back({rim_[i], rim_[k], rim_[j]});
        edges.add(rim_[i], rim_[j]);
        append(mesh, edges, i, k);
        append(mesh, edges, k, j);
    }

    const TriangleMesh& mesh_;
    const EdgeSet& edges_;
    const std::vector<int>& rim_;
    int count_;
    std::vector<double> area_;  // twice the least area over the rim from i to j
    std::vector<int> apex_;
};

}  // namespace

EdgeSet::EdgeSet(const TriangleMesh& mesh) {
    edges_.reserve(2 * mesh.triangles.size());
    for (const auto& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) add(t[k], t[(k + 1) % 3]);
}

void fill_hole(TriangleMesh& mesh, EdgeSet& edges, const geometry::BoundaryLoop& hole) {
    const std::vector<int>& rim = hole.vertices;
    if (static_cast<int>(rim.size()) <= longest_rim) {
        const LeastArea patch(mesh, edges, rim);
        if (patch.found()) {
            patch.append(mesh, edges);
            return;
        }
    }
    const int centre = static_cast<int>(mesh.vertices.size());
    mesh.vertices.push_back(hole.centroid);
    for (std::size_t i = 0; i < rim.size(); ++i) {
        mesh.triangles.push_back({centre, rim[i], rim[(i + 1) % rim.size()]});
        edges.add(centre, rim[i]);
    }
}

}  // namespace anatomy
