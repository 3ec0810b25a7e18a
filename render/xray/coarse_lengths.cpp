#include "render/xray/coarse_lengths.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>

namespace render {

using geometry::Vec3;

int CoarseLengths::add(const geometry::TriangleMesh& mesh) {
    Mesh& kept = meshes_.emplace_back();
    kept.vertices.reserve(mesh.vertices.size());
    for (const Vec3& v : mesh.vertices)
        kept.vertices.push_back(
            {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())});
    kept.triangles.reserve(mesh.triangles.size());
    const auto count = static_cast<int>(mesh.vertices.size());
    for (const auto& t : mesh.triangles) {
        for (const int v : t)
            if (v < 0 || v >= count)
                throw std::invalid_argument("a triangle names vertex " + std::to_string(v) + " of " +
                                            std::to_string(count));
        kept.triangles.push_back({t[0], t[1], t[2]});
    }
    return static_cast<int>(meshes_.size()) - 1;
}

namespace {

/// A corner as the camera sees it: right, up, depth from the source [mm], and its place in the image.
struct Corner {
    Vec3 place;
    double x, y;  // [pixels]; meaningless unless the corner is before the source
};

/// Which side of the plane through source, a and b the ray points to. Two triangles that share the edge get
/// opposite answers, also for a ray through the edge itself, so that no ray slips between them.
bool is_left(const Vec3& ray, const Vec3& a, const Vec3& b) {
    const double side = ray.dot(a.cross(b));
    if (side != 0.0) return side > 0.0;
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

}  // namespace

void CoarseLengths::accumulate(int mesh, const CArm& arm, Field& sum) const {
    const int pixels = arm.pixels;
    assert(sum.width == pixels && sum.height == pixels);
    const Mesh& drawn = meshes_.at(static_cast<std::size_t>(mesh));
    const ArmAxes a = axes(arm);
    const double step = pixel_width(arm) / arm.sid, middle = 0.5 * pixels;
    constexpr double nearest = 1.0;  // depth at which a corner still has a place in the image [mm]
    std::vector<Corner> corners;
    corners.reserve(drawn.vertices.size());
    for (const auto& v : drawn.vertices) {
        const Vec3 from = Vec3(v[0], v[1], v[2]) - arm.isocentre;
        const Vec3 place(a.right.dot(from), a.up.dot(from), arm.sod + a.beam.dot(from));
        const double scale = 1.0 / (step * std::max(place.z(), nearest));
        corners.push_back({place, middle + scale * place.x(), middle - scale * place.y()});
    }

    std::vector<double> depths(sum.values.size(), 0.0);
    std::vector<int> balance(sum.values.size(), 0);
    // Pixel centres stand at halves. The slack covers rounding; which of them a triangle covers is decided
    // below.
    constexpr double slack = 1e-6;
    const auto first = [&](double low) {
        return static_cast<int>(std::clamp(std::ceil(low - 0.5 - slack), 0.0, double(pixels)));
    };
    const auto last = [&](double high) {
        return static_cast<int>(std::clamp(std::floor(high - 0.5 + slack), -1.0, pixels - 1.0));
    };
    for (const auto& triangle : drawn.triangles) {
        const Corner &p = corners[triangle[0]], &q = corners[triangle[1]], &r = corners[triangle[2]];
        int left = 0, right = pixels - 1, top = 0, bottom = pixels - 1;
        if (std::min({p.place.z(), q.place.z(), r.place.z()}) > nearest) {
            left = first(std::min({p.x, q.x, r.x})), right = last(std::max({p.x, q.x, r.x}));
            top = first(std::min({p.y, q.y, r.y})), bottom = last(std::max({p.y, q.y, r.y}));
        }
        if (left > right || top > bottom) continue;
        const Vec3 normal = (q.place - p.place).cross(r.place - p.place);
        const double level = normal.dot(p.place);
        for (int j = top; j <= bottom; ++j) {
            for (int i = left; i <= right; ++i) {
                const Vec3 ray((i + 0.5 - middle) * step, (middle - j - 0.5) * step, 1.0);
                const bool one = is_left(ray, p.place, q.place);
                if (one != is_left(ray, q.place, r.place) || one != is_left(ray, r.place, p.place)) continue;
                const double slope = normal.dot(ray);
                const double depth = slope != 0.0 ? level / slope : p.place.z();
                if (!(depth > 0.0)) continue;
                const std::size_t pixel = static_cast<std::size_t>(j) * pixels + i;
                // Outward normals point along the ray where it leaves.
                depths[pixel] += one ? depth : -depth;
                balance[pixel] += one ? 1 : -1;
            }
        }
    }
    for (int j = 0; j < pixels; ++j) {
        for (int i = 0; i < pixels; ++i) {
            const std::size_t pixel = static_cast<std::size_t>(j) * pixels + i;
            if (balance[pixel] != 0 || !(depths[pixel] > 0.0)) continue;
            const double x = (i + 0.5 - middle) * step, y = (middle - j - 0.5) * step;
            sum.values[pixel] += static_cast<float>(depths[pixel] * std::sqrt(1.0 + x * x + y * y));
        }
    }
}

}  // namespace render
