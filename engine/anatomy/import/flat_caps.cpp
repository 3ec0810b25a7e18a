#include "engine/anatomy/import/flat_caps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "engine/anatomy/import/edge_uses.h"
#include "physics/geometry/mesh_query.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

/// A triangle joins a patch when its normal is this near to the patch's, or, as scanned surfaces are rough,
/// when it is within the wider angle and its corners lie in the plane.
const double joins = std::cos(10 * geometry::degree), joins_in_plane = std::cos(40 * geometry::degree);
constexpr double in_plane = 0.03;  // of the root of the patch's area
/// The rim is sharp where the surface turns by more than this, on this fraction of its length.
const double sharp_rim = std::cos(35 * geometry::degree);
constexpr double least_sharp = 0.85;
constexpr std::size_t least_rim = 6;  // edges
/// Area over that of the circle about the centre that holds the rim, with corners in the rim and without.
constexpr double least_round = 0.45, least_oval = 0.15;
const double corner = std::cos(60 * geometry::degree);
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
        std::stable_sort(order.begin(), order.end(),
                         [&](int a, int b) { return areas_[a].squaredNorm() > areas_[b].squaredNorm(); });
        std::vector<FlatCap> caps;
        for (const int seed : order) {
            if (taken_[seed] || areas_[seed].norm() == 0) continue;
            if (std::optional<FlatCap> cap = cap_of(grown(seed))) caps.push_back(std::move(*cap));
        }
        std::sort(caps.begin(), caps.end(),
                  [](const auto& a, const auto& b) { return a.triangles[0] < b.triangles[0]; });
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
                    if (std::any_of(corners.begin(), corners.end(), [&](int v) {
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
        std::sort(cap.triangles.begin(), cap.triangles.end());
        const auto own = [&](int t) {
            return std::binary_search(cap.triangles.begin(), cap.triangles.end(), t);
        };
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
        return std::any_of(next.begin(), next.end(), [&](const auto& step) {
            const auto after = next.find(step.second);
            if (after == next.end()) return true;
            const Vec3 &a = mesh_.vertices[step.first], &b = mesh_.vertices[step.second],
                       &c = mesh_.vertices[after->second];
            return (b - a).normalized().dot((c - b).normalized()) < corner;
        });
    }

    /// Whether the lumen behind the cap is as wide as the cap, neither a facet's side nor a pointed tip.
    bool closes_a_vessel(const FlatCap& cap) {
        if (!surface_) surface_.emplace(mesh_);
        const Vec3 u = cap.normal.unitOrthogonal(), v = cap.normal.cross(u);
        return std::all_of(depths.begin(), depths.end(), [&](double depth) {
            const Vec3 origin = cap.centre - depth * cap.radius * cap.normal;
            std::array<double, section_rays> lengths;
            double mean = 0;
            for (int k = 0; k < section_rays; ++k) {
                const double angle = 2 * std::numbers::pi * k / section_rays;
                lengths[k] = surface_->first_hit(origin, std::cos(angle) * u + std::sin(angle) * v);
                mean += std::min(lengths[k], long_ray * cap.radius) / section_rays;
            }
            std::sort(lengths.begin(), lengths.end());
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

std::vector<FlatCap> flat_caps(const TriangleMesh& mesh) {
    return CapSearch(mesh).run();
}

}  // namespace anatomy
