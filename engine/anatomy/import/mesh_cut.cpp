#include "engine/anatomy/import/mesh_cut.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <unordered_set>

#include "engine/anatomy/anatomy.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/mesh_query.h"

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

/// A triangle joins a patch when its normal is this near to the patch's, or, as scanned surfaces are rough,
/// when it is within the wider angle and its corners lie in the plane.
const double joins = geometry::cos(10 * geometry::degree),
             joins_in_plane = geometry::cos(40 * geometry::degree);
constexpr double in_plane = 0.03;  // of the root of the patch's area
/// The rim is sharp where the surface turns by more than this, on this fraction of its length.
const double sharp_rim = geometry::cos(35 * geometry::degree);
constexpr double least_sharp = 0.85;
constexpr std::size_t least_rim = 6;  // edges
/// Area over that of the circle about the centre that holds the rim, with corners in the rim and without.
constexpr double least_round = 0.45, least_oval = 0.15;
const double cosine_of_corner = geometry::cos(60 * geometry::degree);
constexpr double most_uneven = 0.04;  // of the radius, root mean square
/// The sections of the lumen this deep behind the cap, in radii, have rays of about the radius in the mean.
constexpr std::array depths = {0.2, 0.6};
constexpr double least_section = 0.5, largest_section = 1.4, long_ray = 2.5;
constexpr int section_rays = 32, most_long_rays = 6;

class CapSearch {
public:
    explicit CapSearch(const TriangleMesh& mesh)
        : mesh_(mesh), across_(mesh.triangles.size(), {-1, -1, -1}), taken_(mesh.triangles.size(), 0) {
        for (const auto& t : mesh.triangles) {
            const Vec3& a = mesh.vertices[t[0]];
            areas_.push_back((mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a) / 2);
        }
        EdgeUses(mesh.triangles).each([&](const auto* first, const auto* last) {
            if (last - first != 2) return;
            link(first[0], first[1].triangle);
            link(first[1], first[0].triangle);
        });
    }

    std::vector<FlatCap> run() {
        std::vector<int> order(mesh_.triangles.size());
        std::iota(order.begin(), order.end(), 0);
        std::ranges::stable_sort(
            order, [&](int a, int b) { return areas_[a].squaredNorm() > areas_[b].squaredNorm(); });
        std::vector<FlatCap> caps;
        for (const int seed : order) {
            if (taken_[seed] || areas_[seed].norm() == 0) continue;
            if (std::optional<FlatCap> cap = cap_of(grown(seed))) caps.push_back(std::move(*cap));
        }
        std::ranges::sort(caps, [](const auto& a, const auto& b) { return a.triangles[0] < b.triangles[0]; });
        return caps;
    }

private:
    struct Patch {
        std::vector<int> triangles;
        Vec3 area = Vec3::Zero();  // the sum of the triangles' area vectors [mm²]
    };

    void link(const EdgeUses::Use& use, int other) {
        const auto& t = mesh_.triangles[use.triangle];
        for (int k = 0; k < 3; ++k) {
            const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
            if (low == use.low && high == use.high) across_[use.triangle][k] = other;
        }
    }

    Patch grown(int seed) {
        Patch patch{{seed}, areas_[seed]};
        taken_[seed] = 1;
        Vec3 middle = mesh_.vertices[mesh_.triangles[seed][0]];
        for (std::size_t next = 0; next < patch.triangles.size(); ++next) {
            for (const int t : across_[patch.triangles[next]]) {
                if (t < 0 || taken_[t]) continue;
                const Vec3 normal = patch.area.normalized();
                const double angle = areas_[t].norm() > 0 ? areas_[t].normalized().dot(normal) : 1;
                if (angle < joins_in_plane) continue;
                if (angle < joins) {
                    const double reach = in_plane * std::sqrt(patch.area.norm());
                    const auto& corners = mesh_.triangles[t];
                    if (std::ranges::any_of(corners, [&](int v) {
                            return std::abs((mesh_.vertices[v] - middle).dot(normal)) > reach;
                        }))
                        continue;
                }
                taken_[t] = 1;
                patch.area += areas_[t];
                patch.triangles.push_back(t);
            }
        }
        return patch;
    }

    std::optional<FlatCap> cap_of(Patch patch) {
        FlatCap cap;
        cap.triangles = std::move(patch.triangles);
        std::ranges::sort(cap.triangles);
        const auto own = [&](int t) { return std::ranges::binary_search(cap.triangles, t); };
        struct RimEdge {
            Vec3 from, to;
        };
        std::map<int, int> next;  // corners of the rim
        std::vector<RimEdge> rim;
        double length = 0, sharp_length = 0;
        cap.normal = patch.area.normalized();
        for (const int t : cap.triangles) {
            for (int k = 0; k < 3; ++k) {
                const int other = across_[t][k];
                if (other >= 0 && own(other)) continue;
                const auto& corners = mesh_.triangles[t];
                rim.push_back({mesh_.vertices[corners[k]], mesh_.vertices[corners[(k + 1) % 3]]});
                next[corners[k]] = corners[(k + 1) % 3];
                const double edge = (rim.back().to - rim.back().from).norm();
                length += edge;
                if (other >= 0 && areas_[other].normalized().dot(cap.normal) < sharp_rim)
                    sharp_length += edge;
            }
        }
        if (rim.size() < least_rim || sharp_length < least_sharp * length) return {};
        for (const RimEdge& edge : rim)
            cap.centre += (edge.to - edge.from).norm() / length * (edge.from + edge.to) / 2;
        double farthest = 0, square = 0;
        for (const RimEdge& edge : rim) {
            const double part = (edge.to - edge.from).norm() / length;
            cap.radius += part * ((edge.from + edge.to) / 2 - cap.centre).norm();
            farthest = std::max(farthest, (edge.from - cap.centre).norm());
            const double off = (edge.from - cap.centre).dot(cap.normal);
            square += part * off * off;
        }
        const double roundness = patch.area.norm() / (std::numbers::pi * farthest * farthest);
        const bool round = roundness >= (has_corners(next) ? least_round : least_oval);
        if (!round || std::sqrt(square) > most_uneven * cap.radius || !closes_a_vessel(cap)) return {};
        return cap;
    }

    /// Whether a rim turns sharply somewhere, as that of a facet does, unlike the section of a flat vein.
    bool has_corners(const std::map<int, int>& next) const {
        return std::ranges::any_of(next, [&](const auto& step) {
            const auto after = next.find(step.second);
            if (after == next.end()) return true;
            const Vec3 &a = mesh_.vertices[step.first], &b = mesh_.vertices[step.second],
                       &c = mesh_.vertices[after->second];
            return (b - a).normalized().dot((c - b).normalized()) < cosine_of_corner;
        });
    }

    /// Whether the lumen behind the cap is as wide as the cap, neither a facet's side nor a pointed tip.
    bool closes_a_vessel(const FlatCap& cap) {
        if (!surface_) surface_.emplace(mesh_);
        const Vec3 u = cap.normal.unitOrthogonal(), v = cap.normal.cross(u);
        return std::ranges::all_of(depths, [&](double depth) {
            const Vec3 origin = cap.centre - depth * cap.radius * cap.normal;
            std::array<double, section_rays> lengths;
            double mean = 0;
            for (int k = 0; k < section_rays; ++k) {
                const double angle = 2 * std::numbers::pi * k / section_rays;
                lengths[k] = surface_->first_hit(origin, geometry::cos(angle) * u + geometry::sin(angle) * v);
                mean += std::min(lengths[k], long_ray * cap.radius) / section_rays;
            }
            std::ranges::sort(lengths);
            return mean >= least_section * cap.radius && mean <= largest_section * cap.radius &&
                   lengths[section_rays - 1 - most_long_rays] <= long_ray * cap.radius;
        });
    }

    const TriangleMesh& mesh_;
    std::vector<std::array<int, 3>> across_;  // the triangle beyond each edge, -1 at a boundary
    std::vector<Vec3> areas_;                 // of each triangle: along its normal, as long as its area
    std::vector<char> taken_;
    std::optional<geometry::MeshQuery> surface_;
};

}  // namespace

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
    std::ranges::stable_sort(all, [](const auto& a, const auto& b) { return a.radius > b.radius; });
    return all;
}

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
        if (std::ranges::any_of(corners, [&](int v) { return past(plane, v) > 0; }))
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
    return std::ranges::any_of(uses, [](const auto& edge) { return edge.second == 1; });
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
    const bool far = std::ranges::any_of(plane.moved, [&](const auto& corner) {
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

std::vector<FlatCap> flat_caps(const TriangleMesh& mesh) {
    return CapSearch(mesh).run();
}

}  // namespace anatomy
