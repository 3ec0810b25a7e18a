#include "engine/anatomy/import/mesh_cut.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

namespace anatomy {

using geometry::TriangleMesh;
using geometry::Vec3;

TriangleMesh cut_beyond(const TriangleMesh& given, const Vec3& centre, const Vec3& outward,
                        const Vec3& apex) {
    TriangleMesh mesh = given;
    std::vector<double> past(mesh.vertices.size());  // the plane [mm]
    for (std::size_t v = 0; v < past.size(); ++v) past[v] = (mesh.vertices[v] - centre).dot(outward);

    std::vector<std::vector<int>> at_corner(mesh.vertices.size());
    int first = 0;
    double least = std::numeric_limits<double>::infinity();
    for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
        Vec3 middle = Vec3::Zero();
        double farthest = -1;
        for (const int v : mesh.triangles[t]) {
            at_corner[v].push_back(t);
            middle += mesh.vertices[v] / 3;
            farthest = std::max(farthest, past[v]);
        }
        const double distance = (middle - apex).norm();
        if (farthest > 0 && distance < least) least = distance, first = t;
    }
    // Triangles beyond the plane, reached through corners beyond it.
    std::vector<char> reached(mesh.triangles.size(), 0);
    std::vector<int> open = {first};
    reached[first] = 1;
    for (std::size_t next = 0; next < open.size(); ++next) {
        for (const int v : mesh.triangles[open[next]]) {
            if (past[v] <= 0) continue;
            for (const int t : at_corner[v])
                if (!reached[t]) reached[t] = 1, open.push_back(t);
        }
    }
    // Cuts this close to a corner would leave slivers.
    for (const int t : open) {
        const auto& corners = mesh.triangles[t];
        for (int k = 0; k < 3; ++k) {
            const int v = corners[k];
            const double edge = (mesh.vertices[corners[(k + 1) % 3]] - mesh.vertices[v]).norm();
            if (std::abs(past[v]) > 0.05 * edge) continue;
            mesh.vertices[v] -= past[v] * outward;
            past[v] = 0;
        }
    }
    std::map<std::pair<int, int>, int> cuts;
    const auto cut = [&](int a, int b) {
        const auto key = std::minmax(a, b);
        if (const auto known = cuts.find(key); known != cuts.end()) return known->second;
        const auto [low, high] = key;
        const double part = past[low] / (past[low] - past[high]);
        const Vec3 p = mesh.vertices[low] + part * (mesh.vertices[high] - mesh.vertices[low]);
        mesh.vertices.push_back(p.cast<float>().cast<double>());
        return cuts[key] = static_cast<int>(mesh.vertices.size()) - 1;
    };
    TriangleMesh result;
    std::vector<std::array<int, 3>> triangles;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!reached[t]) {
            triangles.push_back(mesh.triangles[t]);
            continue;
        }
        std::vector<int> kept;  // the polygon on the near side of the plane
        for (int k = 0; k < 3; ++k) {
            const int a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
            if (past[a] <= 0) kept.push_back(a);
            if ((past[a] < 0 && past[b] > 0) || (past[a] > 0 && past[b] < 0)) kept.push_back(cut(a, b));
        }
        for (std::size_t k = 2; k < kept.size(); ++k) {
            const bool flat =
                past.size() > static_cast<std::size_t>(std::max({kept[0], kept[k - 1], kept[k]})) &&
                past[kept[0]] == 0 && past[kept[k - 1]] == 0 && past[kept[k]] == 0;
            if (!flat) triangles.push_back({kept[0], kept[k - 1], kept[k]});
        }
    }
    std::vector<int> index(mesh.vertices.size(), -1);
    for (const auto& t : triangles) {
        std::array<int, 3> renumbered;
        for (int k = 0; k < 3; ++k) {
            int& at = index[t[k]];
            if (at < 0) {
                at = static_cast<int>(result.vertices.size());
                result.vertices.push_back(mesh.vertices[t[k]].cast<float>().cast<double>());
            }
            renumbered[k] = at;
        }
        result.triangles.push_back(renumbered);
    }
    return result;
}

}  // namespace anatomy
