#include "engine/patient/mesh_coverage.h"

#include <algorithm>
#include <cmath>

namespace patient {

using geometry::Vec3;

MeshCoverage::MeshCoverage(const geometry::TriangleMesh& mesh, const render::VolumeGrid& grid, int lines)
    : size_(grid.size), lines_(lines) {
    const geometry::Mat3 to_index = grid.axes().inverse();
    // A grid that mirrors turns triangles inside out.
    const bool mirrored = grid.axes().determinant() < 0;
    int last = -1;
    first_ = size_[2];
    Vec3 lowest = Vec3::Constant(1e9), highest = -lowest;
    const auto layers_of = [&](const std::array<Vec3, 3>& t) {
        const auto [low, high] = std::minmax({t[0].z(), t[1].z(), t[2].z()});
        const auto within = [&](double k) {
            return static_cast<int>(std::clamp(std::floor(k + 0.5), -1.0, static_cast<double>(size_[2])));
        };
        return std::pair(within(low), within(high));
    };
    for (const auto& corners : mesh.triangles) {
        std::array<Vec3, 3> t;
        for (int c = 0; c < 3; ++c) t[c] = to_index * (mesh.vertices[corners[c]] - grid.origin);
        if (mirrored) std::swap(t[1], t[2]);
        const auto [low, high] = layers_of(t);
        if (high < 0 || low >= size_[2]) continue;
        first_ = std::min(first_, std::max(low, 0));
        last = std::max(last, std::min(high, size_[2] - 1));
        triangles_.push_back(t);
        for (const Vec3& corner : t) {
            lowest = lowest.cwiseMin(corner);
            highest = highest.cwiseMax(corner);
        }
    }
    if (last < 0) {
        first_ = 0;
        return;
    }
    const auto clamped = [&](double place, int axis) {
        return static_cast<int>(std::clamp(std::floor(place + 0.5), 0.0, static_cast<double>(size_[axis])));
    };
    // One voxel more, for what a line's rounding spreads.
    window_ = {clamped(lowest.x() - 1, 0), std::min(clamped(highest.x() + 2, 0), size_[0]),
               clamped(lowest.y() - 1, 1), std::min(clamped(highest.y() + 2, 1), size_[1])};
    touching_.resize(static_cast<std::size_t>(last - first_) + 1);
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        const auto [low, high] = layers_of(triangles_[i]);
        for (int k = std::max(low, first_); k <= std::min(high, last); ++k)
            touching_[static_cast<std::size_t>(k - first_)].push_back(static_cast<int>(i));
    }
}

namespace {

/// Where the edge meets the height z, which lies between its ends: the same bits from either side.
Vec3 cut(const Vec3& a, const Vec3& b, double z) {
    const bool ordered = std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
    const Vec3 &from = ordered ? a : b, &to = ordered ? b : a;
    return from + (z - from.z()) / (to.z() - from.z()) * (to - from);
}

}  // namespace

void MeshCoverage::layer(int k, std::vector<float>& fractions) const {
    const int nx = size_[0], ny = size_[1];
    fractions.assign(static_cast<std::size_t>(nx) * ny, 0.0f);
    if (k < first_ || k >= end_layer()) return;
    const float weight = 1.0f / static_cast<float>(lines_ * lines_);
    // Each crossing of a line changes all voxels behind it: changes first, their sums after.
    for (const int index : touching_[static_cast<std::size_t>(k - first_)]) {
        const auto& t = triangles_[static_cast<std::size_t>(index)];
        for (int line = 0; line < lines_; ++line) {
            const double z = k + (line + 0.5) / lines_ - 0.5;
            const bool above[3] = {t[0].z() >= z, t[1].z() >= z, t[2].z() >= z};
            if (above[0] == above[1] && above[1] == above[2]) continue;
            Vec3 up = Vec3::Zero(), down = Vec3::Zero();
            for (int c = 0; c < 3; ++c) {
                const int next = (c + 1) % 3;
                if (above[c] != above[next]) (above[next] ? up : down) = cut(t[c], t[next], z);
            }
            if (up.y() == down.y()) continue;
            // Seen from outside, an edge leads up on the one side and down on the other: the ray along the
            // first axis enters where `down` has the larger second coordinate.
            const float sign = down.y() > up.y() ? weight : -weight;
            const double low = std::min(up.y(), down.y()), high = std::max(up.y(), down.y());
            const double per_y = (down.x() - up.x()) / (down.y() - up.y());
            // Line m is at y = (m + ½)/lines − ½; those with low ≤ y < high.
            const auto line_from = [&](double y) {
                return static_cast<int>(
                    std::clamp(std::ceil((y + 0.5) * lines_ - 0.5), 0.0, static_cast<double>(ny) * lines_));
            };
            for (int m = line_from(low); m < line_from(high); ++m) {
                const double y = (m + 0.5) / lines_ - 0.5;
                const double x = up.x() + (y - up.y()) * per_y;
                float* row = fractions.data() + static_cast<std::size_t>(m / lines_) * nx;
                if (x <= -0.5) {
                    row[0] += sign;
                    continue;
                }
                if (!(x < nx - 0.5)) continue;
                const int voxel = static_cast<int>(x + 0.5);
                const auto rest = static_cast<float>(voxel + 0.5 - x);
                row[voxel] += sign * rest;
                if (voxel + 1 < nx) row[voxel + 1] += sign * (1.0f - rest);
            }
        }
    }
    for (int j = window_.first_row; j < window_.end_row; ++j) {
        float* row = fractions.data() + static_cast<std::size_t>(j) * nx;
        for (int i = window_.first_column + 1; i < window_.end_column; ++i) row[i] += row[i - 1];
        // Behind the mesh only rounding is left.
        std::fill(row + window_.end_column, row + nx, 0.0f);
    }
}

}  // namespace patient
