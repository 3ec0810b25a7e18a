#include "engine/anatomy/grow/open_ends.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

constexpr double snapped_part = 0.35;  // of a cut edge: nearer corners move into the plane

class Cutter {
public:
    Cutter(TriangleMesh& mesh, const ImplicitLumen& lumen, const EndCut& cut)
        : mesh_(mesh), lumen_(lumen), cut_(cut) {
        for (const Vec3& v : mesh.vertices) height_.push_back((v - cut.centre).dot(cut.outward));
    }

    void cut() {
        flood();
        snap();
        clip();
    }

private:
    /// Marks the corners beyond the plane that are connected to the tip.
    void flood() {
        const int count = static_cast<int>(mesh_.vertices.size());
        std::vector<std::vector<int>> neighbours(mesh_.vertices.size());
        for (const auto& t : mesh_.triangles) {
            for (int k = 0; k < 3; ++k) {
                if (height_[t[k]] > 0 && height_[t[(k + 1) % 3]] > 0) {
                    neighbours[t[k]].push_back(t[(k + 1) % 3]);
                    neighbours[t[(k + 1) % 3]].push_back(t[k]);
                }
            }
        }
        int tip = -1;
        double least = std::numeric_limits<double>::infinity();
        for (int v = 0; v < count; ++v) {
            const double distance = (mesh_.vertices[v] - cut_.beyond).norm();
            if (height_[v] > 0 && distance < least) least = distance, tip = v;
        }
        beyond_.assign(mesh_.vertices.size(), false);
        if (tip < 0) return;
        std::vector<int> waiting = {tip};
        beyond_[tip] = true;
        while (!waiting.empty()) {
            const int v = waiting.back();
            waiting.pop_back();
            for (const int other : neighbours[v]) {
                if (!beyond_[other]) beyond_[other] = true, waiting.push_back(other);
            }
        }
    }
    bool crossed(int a, int b) const {
        return (beyond_[a] && height_[a] > 0 && height_[b] < 0) ||
               (beyond_[b] && height_[b] > 0 && height_[a] < 0);
    }
    /// Moves a point onto both the plane and the surface.
    Vec3 on_rim(Vec3 x) const {
        for (int iteration = 0; iteration < 20; ++iteration) {
            x -= (x - cut_.centre).dot(cut_.outward) * cut_.outward;
            const ImplicitLumen::Value value = lumen_.at(x);
            const Vec3 slope = value.gradient - value.gradient.dot(cut_.outward) * cut_.outward;
            if (std::abs(value.distance) < 1e-9 || slope.squaredNorm() < 1e-4) break;
            x -= value.distance / slope.squaredNorm() * slope;
        }
        return x;
    }
    void snap() {
        std::map<int, double> part;  // distance of a corner from the plane, as part of its shortest cut edge
        for (const auto& t : mesh_.triangles) {
            for (int k = 0; k < 3; ++k) {
                const int a = t[k], b = t[(k + 1) % 3];
                if (!crossed(a, b)) continue;
                const double of_a = height_[a] / (height_[a] - height_[b]);
                part.try_emplace(a, 1).first->second = std::min(part.try_emplace(a, 1).first->second, of_a);
                part.try_emplace(b, 1).first->second =
                    std::min(part.try_emplace(b, 1).first->second, 1 - of_a);
            }
        }
        std::vector<std::pair<double, int>> order;
        for (const auto& [corner, share] : part)
            if (share < snapped_part) order.emplace_back(share, corner);
        std::sort(order.begin(), order.end());
        std::map<int, std::vector<int>> triangles_of;
        for (int i = 0; i < static_cast<int>(mesh_.triangles.size()); ++i) {
            for (const int corner : mesh_.triangles[i])
                if (part.contains(corner)) triangles_of[corner].push_back(i);
        }
        for (const auto& [share, corner] : order) {
            // Three corners in the plane would leave a triangle that closes the end.
            const bool flat =
                std::any_of(triangles_of[corner].begin(), triangles_of[corner].end(), [&, c = corner](int i) {
                    const auto& t = mesh_.triangles[i];
                    return std::all_of(t.begin(), t.end(), [&](int v) { return v == c || height_[v] == 0; });
                });
            if (flat) continue;
            mesh_.vertices[corner] = on_rim(mesh_.vertices[corner]);
            height_[corner] = 0;
        }
    }
    int rim_corner(int a, int b) {
        if (a > b) std::swap(a, b);
        const auto [at, fresh] = rim_.try_emplace({a, b}, static_cast<int>(mesh_.vertices.size()));
        if (fresh) {
            const double t = height_[a] / (height_[a] - height_[b]);
            mesh_.vertices.push_back(on_rim(mesh_.vertices[a] + t * (mesh_.vertices[b] - mesh_.vertices[a])));
        }
        return at->second;
    }
    void clip() {
        std::vector<std::array<int, 3>> kept;
        std::vector<int> polygon;
        for (const auto& t : mesh_.triangles) {
            const bool goes =
                std::any_of(t.begin(), t.end(), [&](int v) { return beyond_[v] && height_[v] > 0; });
            if (!goes && !all_in_plane(t)) {
                kept.push_back(t);
                continue;
            }
            polygon.clear();
            for (int k = 0; k < 3; ++k) {
                const int a = t[k], b = t[(k + 1) % 3];
                if (height_[a] <= 0) polygon.push_back(a);
                if (crossed(a, b)) polygon.push_back(rim_corner(a, b));
            }
            if (polygon.size() < 3 ||
                (polygon.size() == 3 && all_in_plane({polygon[0], polygon[1], polygon[2]})))
                continue;
            add(polygon, kept);
        }
        mesh_.triangles = std::move(kept);
        drop_unused();
    }
    bool all_in_plane(const std::array<int, 3>& t) const {
        return std::all_of(t.begin(), t.end(),
                           [&](int v) { return v < static_cast<int>(height_.size()) && height_[v] == 0; });
    }
    void add(const std::vector<int>& polygon, std::vector<std::array<int, 3>>& kept) const {
        if (polygon.size() == 3) {
            kept.push_back({polygon[0], polygon[1], polygon[2]});
            return;
        }
        const auto length = [&](int p, int q) {
            return (mesh_.vertices[polygon[p]] - mesh_.vertices[polygon[q]]).squaredNorm();
        };
        const int first = length(0, 2) <= length(1, 3) ? 0 : 1;
        const auto at = [&](int k) { return polygon[(first + k) % 4]; };
        kept.push_back({at(0), at(1), at(2)});
        kept.push_back({at(0), at(2), at(3)});
    }
    void drop_unused() {
        std::vector<int> renumbered(mesh_.vertices.size(), -1);
        for (const auto& t : mesh_.triangles)
            for (const int v : t) renumbered[v] = 0;
        std::vector<Vec3> used;
        for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
            if (renumbered[v] < 0) continue;
            renumbered[v] = static_cast<int>(used.size());
            used.push_back(mesh_.vertices[v]);
        }
        for (auto& t : mesh_.triangles)
            for (int& v : t) v = renumbered[v];
        mesh_.vertices = std::move(used);
    }

    TriangleMesh& mesh_;
    const ImplicitLumen& lumen_;
    const EndCut& cut_;
    std::vector<double> height_;  // above the plane; 0 once moved into it [mm]
    std::vector<bool> beyond_;
    std::map<std::pair<int, int>, int> rim_;
};

}  // namespace

TriangleMesh cut_open(const TriangleMesh& mesh, const ImplicitLumen& lumen, std::span<const EndCut> cuts) {
    TriangleMesh open = mesh;
    for (const EndCut& cut : cuts) Cutter(open, lumen, cut).cut();
    return open;
}

}  // namespace anatomy
