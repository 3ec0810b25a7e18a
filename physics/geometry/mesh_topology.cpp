#include "physics/geometry/mesh_topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <map>

#include "physics/geometry/hash.h"

namespace geometry {
namespace {

std::array<std::uint64_t, 3> bits(const Vec3& p) {
    // + 0.0 makes −0 and 0 the same corner.
    return {std::bit_cast<std::uint64_t>(p.x() + 0.0), std::bit_cast<std::uint64_t>(p.y() + 0.0),
            std::bit_cast<std::uint64_t>(p.z() + 0.0)};
}

struct EdgeUse {
    int high = 0;                   // index
    int forward = 0, backward = 0;  // by triangles that run from the lower index to the higher, and back
};

/// The edges of a mesh by their lower index, which few edges share.
class SortedEdges {
public:
    explicit SortedEdges(const TriangleMesh& mesh) {
        std::size_t vertices = 0;
        for (const auto& t : mesh.triangles)
            for (const int v : t) vertices = std::max(vertices, static_cast<std::size_t>(v) + 1);
        starts_.assign(vertices + 1, 0);
        for (const auto& t : mesh.triangles)
            for (int k = 0; k < 3; ++k) ++starts_[std::min(t[k], t[(k + 1) % 3]) + 1];
        for (std::size_t i = 0; i < vertices; ++i) starts_[i + 1] += starts_[i];
        uses_.resize(starts_.back());
        ends_.assign(starts_.begin(), starts_.end() - 1);
        for (const auto& t : mesh.triangles) {
            for (int k = 0; k < 3; ++k) {
                const int a = t[k], b = t[(k + 1) % 3];
                uses_[ends_[std::min(a, b)]++] = {std::max(a, b), a < b ? 1 : 0, a < b ? 0 : 1};
            }
        }
        for (std::size_t low = 0; low < vertices; ++low) {
            const auto first = uses_.begin() + static_cast<std::ptrdiff_t>(starts_[low]);
            const auto last = uses_.begin() + static_cast<std::ptrdiff_t>(ends_[low]);
            std::sort(first, last, [](const EdgeUse& a, const EdgeUse& b) { return a.high < b.high; });
            auto kept = first;
            for (auto use = first; use != last; ++use) {
                if (use != first && use->high == kept->high) {
                    kept->forward += use->forward;
                    kept->backward += use->backward;
                } else {
                    if (use != first) ++kept;
                    *kept = *use;
                }
            }
            if (first != last) ends_[low] = static_cast<std::size_t>(kept - uses_.begin()) + 1;
        }
    }
    /// The use of an edge that exists.
    const EdgeUse& of(int a, int b) const {
        const auto low = static_cast<std::size_t>(std::min(a, b));
        return *std::lower_bound(uses_.begin() + static_cast<std::ptrdiff_t>(starts_[low]),
                                 uses_.begin() + static_cast<std::ptrdiff_t>(ends_[low]), std::max(a, b),
                                 [](const EdgeUse& use, int high) { return use.high < high; });
    }
    template <class Use>
    void each(const Use& use) const {
        for (std::size_t low = 0; low < ends_.size(); ++low)
            for (std::size_t at = starts_[low]; at < ends_[low]; ++at) use(static_cast<int>(low), uses_[at]);
    }

private:
    std::vector<std::size_t> starts_, ends_;  // of each lower index's edges
    std::vector<EdgeUse> uses_;
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
    const SortedEdges edges(mesh);
    for (const auto& t : mesh.triangles)
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) ++found.degenerate_triangles;
    std::vector<bool> at_rim;
    edges.each([&](int low, const EdgeUse& use) {
        if (use.forward + use.backward != 1) return;
        at_rim.resize(std::max(at_rim.size(), static_cast<std::size_t>(use.high) + 1));
        at_rim[low] = at_rim[use.high] = true;
    });
    const auto is_at_rim = [&](int v) { return static_cast<std::size_t>(v) < at_rim.size() && at_rim[v]; };
    std::map<int, int> next;  // a boundary edge a→b of the mesh is b→a of its cap
    for (const auto& t : mesh.triangles) {
        for (int k = 0; k < 3; ++k) {
            const int a = t[k], b = t[(k + 1) % 3];
            if (!is_at_rim(a) || !is_at_rim(b)) continue;
            const EdgeUse& use = edges.of(a, b);
            if (use.forward + use.backward != 1) continue;
            ++found.boundary_edges;
            next[b] = a;
        }
    }
    edges.each([&](int, const EdgeUse& use) {
        if (use.forward + use.backward > 2 || use.forward == 2 || use.backward == 2)
            ++found.non_manifold_edges;
    });
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

std::vector<int> first_at_place(std::span<const Vec3> vertices) {
    // An open-addressed hash table of the vertices that were the first at their place, -1 = free.
    std::vector<int> table(std::bit_ceil(2 * vertices.size() + 1), -1);
    std::vector<int> first(vertices.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        const auto key = bits(vertices[i]);
        std::size_t slot = PlaceHash{}(vertices[i]) & (table.size() - 1);
        while (table[slot] >= 0 && bits(vertices[table[slot]]) != key) slot = (slot + 1) & (table.size() - 1);
        if (table[slot] < 0) table[slot] = static_cast<int>(i);
        first[i] = table[slot];
    }
    return first;
}

TriangleMesh welded(const TriangleMesh& mesh) {
    TriangleMesh result;
    std::vector<int> renumbered = first_at_place(mesh.vertices);
    for (std::size_t i = 0; i < renumbered.size(); ++i) {
        if (renumbered[i] == static_cast<int>(i)) {
            renumbered[i] = static_cast<int>(result.vertices.size());
            result.vertices.push_back(mesh.vertices[i]);
        } else {
            renumbered[i] = renumbered[renumbered[i]];  // the first comes before: it has its number already
        }
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

}  // namespace geometry
