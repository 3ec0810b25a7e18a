#include "render/xray/texture_blobs.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace render {

double content(const TextureBlob& blob) {
    // Over the unit ball, 4π ∫ ρ² (1 − ρ²)^(3/2) dρ = π²/8.
    const double r = blob.radius;
    return blob.fraction * std::numbers::pi * std::numbers::pi / 8.0 * (r * r * r) * blob.elongation;
}

void add_lengths(std::span<const TextureBlob> texture_blobs, const CArm& arm, Field& sum, Field* before) {
    const int pixels = arm.pixels;
    assert(sum.width == pixels && sum.height == pixels);
    using Eigen::Vector3f;
    const ArmAxes axes = render::axes(arm);
    const Vector3f beam = axes.beam.cast<float>(), right = axes.right.cast<float>(),
                   up = axes.up.cast<float>();
    const geometry::Vec3 source = render::source(arm);
    const auto per_slope = static_cast<float>(arm.sid / pixel_width(arm));
    const float centre = 0.5f * static_cast<float>(pixels), width = static_cast<float>(pixels);
    constexpr float nearest = 1.0f;  // depth [mm]
    const auto isocentre = static_cast<float>(arm.sod);
    // The second moment of (1 − d²)² along an axis is an eighth of the squared half-axis, that of a
    // pixel 1/12: together they are those of an ellipse whose squared half-axes are larger by this [px²].
    constexpr float of_pixel = 2.0f / 3.0f;
    for (const TextureBlob& blob : texture_blobs) {
        const Vector3f from(static_cast<float>(blob.middle.x() - source.x()),
                            static_cast<float>(blob.middle.y() - source.y()),
                            static_cast<float>(blob.middle.z() - source.z()));
        const float depth = beam.dot(from);
        if (!(depth > nearest)) continue;
        const float slope_x = right.dot(from) / depth, slope_y = -up.dot(from) / depth;
        const float x = centre + per_slope * slope_x, y = centre + per_slope * slope_y;
        const float scale = per_slope / depth;  // [px/mm]
        const float most = scale * blob.radius * std::max(blob.elongation, 1.0f) + 1.0f;
        if (!(x + most > 0.0f && y + most > 0.0f && x - most < width && y - most < width)) continue;

        // Half-axes of the image, and half the chord through the middle: their product is that of the blob's.
        const float along_ray = blob.axis.dot(from) / from.norm();
        const float square = std::min(along_ray * along_ray, 1.0f);
        const float longer = std::sqrt(blob.elongation * blob.elongation * (1.0f - square) + square);
        const float half_chord = blob.radius * blob.elongation / longer;
        const float a = scale * blob.radius * longer, b = scale * blob.radius;
        float along_x = right.dot(blob.axis) - slope_x * beam.dot(blob.axis),
              along_y = -up.dot(blob.axis) - slope_y * beam.dot(blob.axis);
        const float seen = std::sqrt(along_x * along_x + along_y * along_y);
        along_x = seen > 1e-6f ? along_x / seen : 1.0f;
        along_y = seen > 1e-6f ? along_y / seen : 0.0f;
        const float aa = a * a + of_pixel, bb = b * b + of_pixel;
        const float peak =
            blob.fraction * half_chord * (0.375f * std::numbers::pi_v<float>)*(a * b) / std::sqrt(aa * bb);
        // d² = xx·u² + 2·xy·u·v + yy·v², with u and v from the middle [px].
        const float xx = along_x * along_x / aa + along_y * along_y / bb,
                    yy = along_y * along_y / aa + along_x * along_x / bb,
                    xy = along_x * along_y * (1.0f / aa - 1.0f / bb);
        const float reach_y = std::sqrt(along_y * along_y * aa + along_x * along_x * bb);
        // Rounding without library calls: what is cut off is not negative.
        const int top = static_cast<int>(std::max(0.0f, y - reach_y + 0.5f)),
                  bottom = static_cast<int>(std::min(width, y + reach_y + 0.5f)) - 1;
        for (int j = top; j <= bottom; ++j) {
            const float v = static_cast<float>(j) + 0.5f - y;
            // The part of the row in the ellipse.
            const float middle = -xy * v / xx, within = middle * middle + (1.0f - yy * v * v) / xx;
            if (!(within > 0.0f)) continue;
            const float half = std::sqrt(within);
            const float left = x + middle - half, end = x + middle + half;
            if (!(end > 0.0f)) continue;
            const int first = static_cast<int>(std::max(0.0f, left + 0.5f)),
                      last = static_cast<int>(std::min(width, end + 0.5f)) - 1;
            const float outer = 1.0f - yy * v * v, slope = 2.0f * xy * v;
            const auto add = [&](float* row) {
                for (int i = first; i <= last; ++i) {
                    const float u = static_cast<float>(i) + 0.5f - x;
                    const float q = outer - (slope + xx * u) * u;
                    row[i] += peak * q * q;
                }
            };
            const std::size_t start = static_cast<std::size_t>(j) * pixels;
            add(sum.values.data() + start);
            if (before && depth < isocentre) add(before->values.data() + start);
        }
    }
}

}  // namespace render
