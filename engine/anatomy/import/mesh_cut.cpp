#include "engine/anatomy/import/mesh_cut.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <unordered_set>

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

/// Whether directed edges form one chain that visits no corner twice.
bool is_one_loop(const std::map<int, int>& next) {
    if (next.size() < 3) return false;
    int at = next.begin()->first;
    for (std::size_t k = 1; k <= next.size(); ++k) {
        const auto step = next.find(at);
        if (step == next.end()) return false;
        at = step->second;
        if (at == next.begin()->first) return k == next.size();
    }
    return false;
}

}  // namespace

MeshCut::MeshCut(TriangleMesh mesh)
    : mesh_(std::move(mesh)), at_corner_(mesh_.vertices.size()), gone_(mesh_.triangles.size(), 0) {
    for (int t = 0; t < static_cast<int>(mesh_.triangles.size()); ++t)
        for (const int v : mesh_.triangles[t]) at_corner_[v].push_back(t);
}

double MeshCut::past(const Plane& plane, int vertex) const {
    if (plane.moved.contains(vertex)) return 0;
    return (mesh_.vertices[vertex] - plane.centre).dot(plane.outward);
}

/// Triangles beyond the plane, reached through corners beyond it; none when they extend beyond reach.
std::vector<int> MeshCut::piece(const Plane& plane, const Vec3& apex, double reach) const {
    int first = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int t = 0; t < static_cast<int>(mesh_.triangles.size()); ++t) {
        if (gone_[t]) continue;
        const Triangle& corners = mesh_.triangles[t];
        const Vec3 middle =
            (mesh_.vertices[corners[0]] + mesh_.vertices[corners[1]] + mesh_.vertices[corners[2]]) / 3;
        const double distance = (middle - apex).norm();
        if (distance >= least) continue;
        if (std::any_of(corners.begin(), corners.end(), [&](int v) { return past(plane, v) > 0; }))
            least = distance, first = t;
    }
    if (first < 0) return {};
    std::vector<int> reached = {first};
    std::unordered_set<int> seen = {first};
    for (std::size_t next = 0; next < reached.size(); ++next) {
        for (const int v : mesh_.triangles[reached[next]]) {
            if (past(plane, v) <= 0) continue;
            if ((mesh_.vertices[v] - plane.centre).norm() > reach) return {};
            for (const int t : at_corner_[v])
                if (!gone_[t] && seen.insert(t).second) reached.push_back(t);
        }
    }
    return reached;
}

/// Whether the piece is open beyond the plane.
bool MeshCut::has_an_opening(const Plane& plane, const std::vector<int>& piece) const {
    std::map<std::pair<int, int>, int> uses;  // of edges with an end beyond, whose triangles are all here
    for (const int t : piece) {
        for (int k = 0; k < 3; ++k) {
            const int a = mesh_.triangles[t][k], b = mesh_.triangles[t][(k + 1) % 3];
            if (past(plane, a) > 0 || past(plane, b) > 0) ++uses[std::minmax(a, b)];
        }
    }
    return std::any_of(uses.begin(), uses.end(), [](const auto& edge) { return edge.second == 1; });
}

/// Cuts this close to a corner would leave slivers.
void MeshCut::move_near_corners(Plane& plane, const std::vector<int>& triangles) {
    for (const int t : triangles) {
        const Triangle& corners = mesh_.triangles[t];
        for (int k = 0; k < 3; ++k) {
            const int v = corners[k];
            const double edge = (mesh_.vertices[corners[(k + 1) % 3]] - mesh_.vertices[v]).norm(),
                         off = past(plane, v);
            if (std::abs(off) > 0.05 * edge || plane.moved.contains(v)) continue;
            plane.moved.emplace(v, mesh_.vertices[v]);
            mesh_.vertices[v] -= off * plane.outward;
        }
    }
}

/// Expects the piece to be marked as gone; `kept` is what is left of its triangles.
bool MeshCut::leaves_one_opening(const Plane& plane, const std::vector<int>& piece,
                                 const std::vector<Triangle>& kept) const {
    struct Uses {
        int count = 0, from = 0, to = 0;
    };
    std::map<std::pair<int, int>, Uses> edges;  // in the plane
    const auto use = [&](const Triangle& t) {
        for (int k = 0; k < 3; ++k) {
            const int a = t[k], b = t[(k + 1) % 3];
            if (past(plane, a) != 0 || past(plane, b) != 0) continue;
            Uses& uses = edges[std::minmax(a, b)];
            ++uses.count, uses.from = a, uses.to = b;
        }
    };
    for (const Triangle& t : kept) use(t);
    std::set<int> beside;  // triangles that were not cut but may share an edge in the plane
    for (const int t : piece)
        for (const int v : mesh_.triangles[t])
            if (past(plane, v) == 0)
                for (const int other : at_corner_[v])
                    if (!gone_[other]) beside.insert(other);
    for (const int t : beside) use(mesh_.triangles[t]);
    std::map<int, int> next;
    std::size_t open = 0;
    for (const auto& [edge, uses] : edges) {
        if (uses.count > 2) return false;
        if (uses.count == 1) next[uses.from] = uses.to, ++open;
    }
    return next.size() == open && is_one_loop(next);
}

bool MeshCut::beyond(const Vec3& centre, const Vec3& outward, const Vec3& apex, double reach,
                     double rim_reach) {
    Plane plane{centre, outward, {}};
    const std::vector<int> reached = piece(plane, apex, reach);
    if (reached.empty() || has_an_opening(plane, reached)) return false;
    const std::size_t vertices = mesh_.vertices.size();
    move_near_corners(plane, reached);
    std::map<std::pair<int, int>, int> cuts;
    const auto cut = [&](int a, int b) {
        const auto [low, high] = std::minmax(a, b);
        const auto [at, fresh] =
            cuts.try_emplace(std::pair(low, high), static_cast<int>(mesh_.vertices.size()));
        if (fresh) {
            const double part = past(plane, low) / (past(plane, low) - past(plane, high));
            const Vec3 p = mesh_.vertices[low] + part * (mesh_.vertices[high] - mesh_.vertices[low]);
            mesh_.vertices.push_back(p.cast<float>().cast<double>());
            plane.moved.emplace(at->second, mesh_.vertices.back());
        }
        return at->second;
    };
    std::vector<Triangle> kept_triangles;
    for (const int t : reached) {
        std::vector<int> kept;  // the polygon on the near side of the plane
        bool near = false;
        for (int k = 0; k < 3; ++k) {
            const int a = mesh_.triangles[t][k], b = mesh_.triangles[t][(k + 1) % 3];
            const double from = past(plane, a), to = past(plane, b);
            near = near || from < 0;
            if (from <= 0) kept.push_back(a);
            if ((from < 0 && to > 0) || (from > 0 && to < 0)) kept.push_back(cut(a, b));
        }
        for (std::size_t k = 2; near && k < kept.size(); ++k)
            kept_triangles.push_back({kept[0], kept[k - 1], kept[k]});
    }
    for (const int t : reached) gone_[t] = 1;
    const bool far = std::any_of(plane.moved.begin(), plane.moved.end(), [&](const auto& corner) {
        return (mesh_.vertices[corner.first] - centre).norm() > rim_reach;
    });
    if (far || !leaves_one_opening(plane, reached, kept_triangles)) {
        for (const int t : reached) gone_[t] = 0;
        for (const auto& [v, place] : plane.moved)
            if (v < static_cast<int>(vertices)) mesh_.vertices[v] = place;
        mesh_.vertices.resize(vertices);
        return false;
    }
    at_corner_.resize(mesh_.vertices.size());
    for (const Triangle& t : kept_triangles) {
        for (const int v : t) at_corner_[v].push_back(static_cast<int>(mesh_.triangles.size()));
        mesh_.triangles.push_back(t);
        gone_.push_back(0);
    }
    return true;
}

TriangleMesh MeshCut::result() const {
    TriangleMesh result;
    std::vector<int> index(mesh_.vertices.size(), -1);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
        if (gone_[t]) continue;
        Triangle renumbered;
        for (int k = 0; k < 3; ++k) {
            int& at = index[mesh_.triangles[t][k]];
            if (at < 0) {
                at = static_cast<int>(result.vertices.size());
                result.vertices.push_back(mesh_.vertices[mesh_.triangles[t][k]].cast<float>().cast<double>());
            }
            renumbered[k] = at;
        }
        result.triangles.push_back(renumbered);
    }
    return result;
}

}  // namespace anatomy
