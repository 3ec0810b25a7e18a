#include "engine/anatomy/mesh_topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <fmt/format.h>
#include <map>
#include <unordered_map>

namespace engine {
namespace {

using physics::TriangleMesh;
using physics::Vec3;

struct BitwiseHash {
    std::size_t operator()(const std::array<std::uint64_t, 3>& key) const {
        std::uint64_t hash = 14695981039346656037ull;
        for (const std::uint64_t word : key) hash = (hash ^ word) * 1099511628211ull, hash ^= hash >> 29;
        return hash;
    }
};

std::array<std::uint64_t, 3> bits(const Vec3& p) {
    // + 0.0 makes −0 and 0 the same corner.
    return {std::bit_cast<std::uint64_t>(p.x() + 0.0), std::bit_cast<std::uint64_t>(p.y() + 0.0),
            std::bit_cast<std::uint64_t>(p.z() + 0.0)};
}

struct EdgeUse {
    int forward = 0, backward = 0;  // by triangles that run from the lower index to the higher, and back
};

}  // namespace

Vec3 rim_centre(const TriangleMesh& mesh, const BoundaryLoop& loop) {
    Vec3 moment = Vec3::Zero();
    double length = 0;
    for (std::size_t i = 0; i < loop.vertices.size(); ++i) {
        const Vec3 &a = mesh.vertices[loop.vertices[i]],
                   &b = mesh.vertices[loop.vertices[(i + 1) % loop.vertices.size()]];
        moment += (b - a).norm() * (a + b) / 2;
        length += (b - a).norm();
    }
    return length > 0 ? Vec3(moment / length) : loop.centroid;
}

Topology topology(const TriangleMesh& mesh) {
    Topology found;
    std::unordered_map<std::uint64_t, EdgeUse> edges;
    edges.reserve(mesh.triangles.size() * 2);
    const auto key = [](int a, int b) {
        return static_cast<std::uint64_t>(std::min(a, b)) << 32 | static_cast<std::uint32_t>(std::max(a, b));
    };
    for (const auto& t : mesh.triangles) {
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) ++found.degenerate_triangles;
        for (int k = 0; k < 3; ++k) {
            const int a = t[k], b = t[(k + 1) % 3];
            ++(a < b ? edges[key(a, b)].forward : edges[key(a, b)].backward);
        }
    }
    std::map<int, int> next;  // a boundary edge a→b of the mesh is b→a of its cap
    for (const auto& t : mesh.triangles) {
        for (int k = 0; k < 3; ++k) {
            const int a = t[k], b = t[(k + 1) % 3];
            const EdgeUse use = edges[key(a, b)];
            if (use.forward + use.backward != 1) continue;
            ++found.boundary_edges;
            next[b] = a;
        }
    }
    for (const auto& [_, use] : edges) {
        if (use.forward + use.backward > 2 || use.forward == 2 || use.backward == 2)
            ++found.non_manifold_edges;
    }
    while (!next.empty()) {
        BoundaryLoop loop;
        for (auto at = next.begin(); at != next.end();) {
            loop.vertices.push_back(at->first);
            loop.centroid += mesh.vertices[at->first];
            const int following = at->second;
            next.erase(at);
            at = next.find(following);
        }
        loop.centroid /= static_cast<double>(loop.vertices.size());
        found.loops.push_back(std::move(loop));
    }
    return found;
}

TriangleMesh welded(const TriangleMesh& mesh) {
    TriangleMesh result;
    std::unordered_map<std::array<std::uint64_t, 3>, int, BitwiseHash> index_of;
    std::vector<int> renumbered(mesh.vertices.size());
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const auto [at, fresh] =
            index_of.try_emplace(bits(mesh.vertices[i]), static_cast<int>(result.vertices.size()));
        if (fresh) result.vertices.push_back(mesh.vertices[i]);
        renumbered[i] = at->second;
    }
    result.triangles.reserve(mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
        const std::array<int, 3> w = {renumbered[t[0]], renumbered[t[1]], renumbered[t[2]]};
        if (w[0] != w[1] && w[1] != w[2] && w[2] != w[0]) result.triangles.push_back(w);
    }
    return result;
}

TriangleMesh capped(const TriangleMesh& mesh, const std::vector<BoundaryLoop>& loops) {
    TriangleMesh closed = mesh;
    for (const BoundaryLoop& loop : loops) {
        const int centre = static_cast<int>(closed.vertices.size());
        closed.vertices.push_back(loop.centroid);
        for (std::size_t i = 0; i < loop.vertices.size(); ++i) {
            closed.triangles.push_back(
                {centre, loop.vertices[i], loop.vertices[(i + 1) % loop.vertices.size()]});
        }
    }
    return closed;
}

double signed_volume(const TriangleMesh& mesh) {
    double six_volumes = 0;
    for (const auto& t : mesh.triangles) {
        six_volumes += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
    }
    return six_volumes / 6.0;
}

std::string place_text(const Vec3& p) {
    return fmt::format("({:.2f}, {:.2f}, {:.2f})", p.x(), p.y(), p.z());
}

}  // namespace engine
