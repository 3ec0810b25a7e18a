#include "engine/anatomy/import/mesh_opening.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/import/edge_uses.h"
#include "physics/geometry/mesh_query.h"

namespace anatomy {

std::vector<geometry::BoundaryLoop> simple_loops(const TriangleMesh& mesh) {
    std::multimap<int, int> next;  // oriented as a cap's edges
    EdgeUses(mesh.triangles).each([&](const auto* first, const auto* last) {
        if (last - first != 1) return;
        if (first->forward)
            next.emplace(first->high, first->low);
        else
            next.emplace(first->low, first->high);
    });
    std::vector<geometry::BoundaryLoop> loops;
    std::map<int, std::size_t> where;  // of a corner on the current path
    std::vector<int> path;
    while (!next.empty()) {
        if (path.empty()) {
            path.push_back(next.begin()->first);
            where[path[0]] = 0;
        }
        const auto step = next.find(path.back());
        const int to = step->second;
        next.erase(step);
        if (const auto seen = where.find(to); seen != where.end()) {
            const auto start = path.begin() + static_cast<std::ptrdiff_t>(seen->second);
            loops.push_back({{start, path.end()}, Vec3::Zero()});
            for (auto v = start; v != path.end(); ++v) where.erase(*v);
            path.erase(start, path.end());
            if (path.empty() && !next.contains(to)) continue;
        }
        if (path.empty() || path.back() != to) where[to] = path.size(), path.push_back(to);
    }
    for (geometry::BoundaryLoop& loop : loops) {
        for (const int v : loop.vertices) loop.centroid += mesh.vertices[v];
        loop.centroid /= static_cast<double>(loop.vertices.size());
    }
    return loops;
}

std::vector<MeshOpening> openings_at(const TriangleMesh& mesh,
                                     const std::vector<geometry::BoundaryLoop>& loops) {
    const geometry::MeshQuery wall(mesh);
    std::vector<MeshOpening> result;
    for (const geometry::BoundaryLoop& loop : loops) {
        MeshOpening opening{loop, Vec3::Zero(), 0, 0, 0};
        const std::size_t count = loop.vertices.size();
        const auto rim = [&](std::size_t i) -> const Vec3& {
            return mesh.vertices[loop.vertices[i % count]];
        };
        double length = 0, square = 0;
        const Vec3 centre = geometry::rim_centre(mesh, loop);
        for (std::size_t i = 0; i < count; ++i) {
            opening.normal += (rim(i) - centre).cross(rim(i + 1) - centre);
            const double edge = (rim(i + 1) - rim(i)).norm();
            const double from = (rim(i) - centre).norm(), to = (rim(i + 1) - centre).norm(),
                         between = ((rim(i) + rim(i + 1)) / 2 - centre).norm();
            opening.radius += edge * (from + 4 * between + to) / 6;
            length += edge;
        }
        opening.loop.centroid = centre;
        opening.normal.normalize();
        opening.radius /= length;
        for (std::size_t i = 0; i < count; ++i) {
            const double off = (rim(i) - centre).dot(opening.normal);
            square += off * off;
        }
        opening.uneven = std::sqrt(square / static_cast<double>(count));
        opening.inscribed = ball_behind(wall, centre, opening.normal, opening.radius);
        result.push_back(std::move(opening));
    }
    return result;
}

std::vector<MeshOpening> openings_of(const TriangleMesh& mesh) {
    std::vector<MeshOpening> all = openings_at(mesh, geometry::topology(mesh).loops);
    std::stable_sort(all.begin(), all.end(),
                     [](const auto& a, const auto& b) { return a.radius > b.radius; });
    return all;
}

}  // namespace anatomy
