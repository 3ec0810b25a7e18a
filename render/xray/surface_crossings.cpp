#include "render/xray/surface_crossings.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace render {
namespace {

/// Finds crossings by rasterising the triangles on the grid of samples. Corners are snapped to 2⁻¹⁴ samples
/// and edges decided in integers, so that a sample on an edge or corner belongs to one of the triangles there
/// and the rays of a closed mesh enter as often as they leave.
class Raster {
public:
    Raster(const TriangleMesh& mesh, const CArm& arm, int samples)
        : mesh_(mesh), side_(arm.pixels * samples) {
        const ArmAxes a = axes(arm);
        const double scale = arm.sid / pixel_width(arm) * samples;
        corners_.reserve(mesh.vertices.size());
        for (const Vec3& vertex : mesh.vertices) {
            const Vec3 from = vertex - arm.isocentre;
            const double depth = arm.sod + a.beam.dot(from);
            Corner corner;
            if (depth > nearest_depth) {
                const double x = 0.5 * side_ + scale * a.right.dot(from) / depth;
                const double y = 0.5 * side_ - scale * a.up.dot(from) / depth;
                corner.drawn = std::abs(x) < farthest && std::abs(y) < farthest;
                if (corner.drawn) {
                    corner.x = std::llround(x * unit);
                    corner.y = std::llround(y * unit);
                    corner.inverse_depth = 1.0 / depth;
                }
            }
            corners_.push_back(corner);
        }
    }

    SurfaceCrossings crossings(double sod) {
        SurfaceCrossings found;
        found.side = side_;
        const std::size_t count = static_cast<std::size_t>(side_) * side_;
        std::vector<Hit> hits;
        hits.reserve(mesh_.triangles.size() * 4);
        found.starts.assign(count + 1, 0);
        for (const auto& triangle : mesh_.triangles) draw(triangle, sod, hits);
        for (const Hit& hit : hits) ++found.starts[hit.sample + 1];
        for (std::size_t i = 0; i < count; ++i) found.starts[i + 1] += found.starts[i];
        std::vector<std::uint32_t> next(found.starts.begin(), found.starts.end() - 1);
        found.list.resize(hits.size());
        for (const Hit& hit : hits) {
            // Rays have few hits, which are sorted as they come.
            std::uint32_t at = next[hit.sample]++;
            for (; at > found.starts[hit.sample] && hit.crossing.depth < found.list[at - 1].depth; --at)
                found.list[at] = found.list[at - 1];
            found.list[at] = hit.crossing;
        }
        return found;
    }

private:
    static constexpr double unit = 16384.0;       // of the snapped places
    static constexpr double farthest = 32768.0;   // distance off the image that keeps products in 64 bits
    static constexpr double nearest_depth = 1.0;  // surfaces nearer to the source are not drawn [mm]

    struct Corner {
        std::int64_t x = 0, y = 0;
        double inverse_depth = 0;
        bool drawn = false;
    };
    struct Hit {
        std::uint32_t sample;
        Crossing crossing;
    };

    void draw(const std::array<int, 3>& triangle, double sod, std::vector<Hit>& hits) const {
        const Corner *p = &corners_[triangle[0]], *q = &corners_[triangle[1]], *r = &corners_[triangle[2]];
        if (!p->drawn || !q->drawn || !r->drawn) return;
        std::int64_t area = (q->x - p->x) * (r->y - p->y) - (q->y - p->y) * (r->x - p->x);
        if (area == 0) return;
        // With y downward, faces toward the source are clockwise for a viewer in front of the detector.
        const bool entry = area > 0;
        if (!entry) {
            std::swap(q, r);
            area = -area;
        }
        const std::int64_t last = side_ - 1;
        const auto [x_low, x_high] = std::minmax({p->x, q->x, r->x});
        const auto [y_low, y_high] = std::minmax({p->y, q->y, r->y});
        const std::int64_t left = std::max<std::int64_t>(0, sample_from(x_low));
        const std::int64_t right = std::min(last, sample_from(x_high));
        const std::int64_t top = std::max<std::int64_t>(0, sample_from(y_low));
        const std::int64_t bottom = std::min(last, sample_from(y_high));
        if (left > right || top > bottom) return;
        const Edge opposite_p(*q, *r), opposite_q(*r, *p), opposite_r(*p, *q);
        for (std::int64_t j = top; j <= bottom; ++j) {
            const std::int64_t y = place(j);
            std::int64_t wp = opposite_p.at(place(left), y), wq = opposite_q.at(place(left), y),
                         wr = opposite_r.at(place(left), y);
            for (std::int64_t i = left; i <= right; ++i) {
                if (wp + opposite_p.owns >= 0 && wq + opposite_q.owns >= 0 && wr + opposite_r.owns >= 0) {
                    const double inverse = (static_cast<double>(wp) * p->inverse_depth +
                                            static_cast<double>(wq) * q->inverse_depth +
                                            static_cast<double>(wr) * r->inverse_depth) /
                                           static_cast<double>(area);
                    hits.push_back({static_cast<std::uint32_t>(j * side_ + i),
                                    {static_cast<float>(1.0 / inverse - sod), entry}});
                }
                wp += opposite_p.per_column, wq += opposite_q.per_column, wr += opposite_r.per_column;
            }
        }
    }

    /// Twice the signed area with the sample as third corner: positive inside. Samples on the edge belong to
    /// the triangle on one side of it, depending on the edge's direction.
    struct Edge {
        std::int64_t x, y, dx, dy, per_column;
        std::int64_t owns;  // 0 if the samples on it are the triangle's, else −1
        Edge(const Corner& from, const Corner& to)
            : x(from.x),
              y(from.y),
              dx(to.x - from.x),
              dy(to.y - from.y),
              per_column(-dy * static_cast<std::int64_t>(unit)),
              owns(dy < 0 || (dy == 0 && dx > 0) ? 0 : -1) {}
        std::int64_t at(std::int64_t px, std::int64_t py) const { return dx * (py - y) - dy * (px - x); }
    };

    static std::int64_t place(std::int64_t sample) {
        return sample * static_cast<std::int64_t>(unit) + static_cast<std::int64_t>(unit) / 2;
    }
    /// First sample at or after a snapped place.
    static std::int64_t sample_from(std::int64_t at) {
        return (at + static_cast<std::int64_t>(unit) / 2 - 1) >> 14;
    }

    const TriangleMesh& mesh_;
    std::vector<Corner> corners_;
    int side_;
};

}  // namespace

SurfaceCrossings surface_crossings(const TriangleMesh& mesh, const CArm& arm, int samples) {
    return Raster(mesh, arm, samples).crossings(arm.sod);
}

}  // namespace render
