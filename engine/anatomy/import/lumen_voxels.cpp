#include "engine/anatomy/import/lumen_voxels.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "physics/geometry/parallel.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

struct VoxelBox {
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    explicit VoxelBox(const TriangleMesh& mesh) {
        for (const Vec3& v : mesh.vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
    }
};

struct Crossing {
    std::uint32_t column;
    float at;  // along the column, in voxels from the first centre
    std::int8_t sign;
    friend bool operator<(const Crossing& p, const Crossing& q) {
        return std::tie(p.column, p.at, p.sign) < std::tie(q.column, q.at, q.sign);
    }
};

/// Twice the area between the edge a→b and the point; exactly the opposite for b→a.
double edge_area(double ax, double ay, double bx, double by, double x, double y) {
    if (std::tie(ax, ay) > std::tie(bx, by)) return -edge_area(bx, by, ax, ay, x, y);
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax);
}

}  // namespace

double LumenVoxels::box_count(const TriangleMesh& mesh, double size) {
    const VoxelBox box(mesh);
    return ((box.high - box.low) / size).array().ceil().prod();
}

LumenVoxels::LumenVoxels(const TriangleMesh& closed, double size) : size_(size) {
    const VoxelBox box(closed);
    // An offset that no coordinate of a regular mesh coincides with, so that columns miss corners and edges.
    origin_ = box.low + size * Vec3(0.3819, 0.4427, 0.4142);
    for (int k = 0; k < 3; ++k)
        dims_[k] = std::max(1, static_cast<int>(std::ceil((box.high[k] - box.low[k]) / size)));
    inside_ = sweep(closed, 0);
    {
        const std::vector<std::uint64_t> y = sweep(closed, 1), z = sweep(closed, 2);
        for (std::size_t i = 0; i < inside_.size(); ++i)
            inside_[i] = (inside_[i] & y[i]) | (inside_[i] & z[i]) | (y[i] & z[i]);
    }
    int count = 0;
    for (std::size_t i = 0; i < inside_.size(); ++i) {
        before_.push_back(count);
        count += std::popcount(inside_[i]);
    }
    place_.reserve(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < inside_.size(); ++i) {
        for (std::uint64_t left = inside_[i]; left != 0; left &= left - 1) {
            const std::size_t bit = 64 * i + static_cast<std::size_t>(std::countr_zero(left)),
                              row = bit / dims_[0];
            place_.push_back({static_cast<std::int16_t>(bit % dims_[0]),
                              static_cast<std::int16_t>(row % dims_[1]),
                              static_cast<std::int16_t>(row / dims_[1])});
        }
    }
}

std::vector<std::uint64_t> LumenVoxels::sweep(const TriangleMesh& mesh, int axis) const {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::vector<Crossing> crossings;
    for (const auto& t : mesh.triangles) {
        std::array<Vec3, 3> p;
        for (int k = 0; k < 3; ++k) p[k] = (mesh.vertices[t[k]] - origin_) / size_;
        const auto range = [&](int a) {
            const auto [low, high] = std::minmax({p[0][a], p[1][a], p[2][a]});
            return std::pair(std::max(0, static_cast<int>(std::ceil(low))),
                             std::min(dims_[a] - 1, static_cast<int>(std::floor(high))));
        };
        const auto [u0, u1] = range(u);
        const auto [v0, v1] = range(v);
        for (int j = v0; j <= v1; ++j) {
            for (int i = u0; i <= u1; ++i) {
                std::array<double, 3> w;
                for (int k = 0; k < 3; ++k) {
                    const Vec3 &a = p[(k + 1) % 3], &b = p[(k + 2) % 3];
                    w[k] = edge_area(a[u], a[v], b[u], b[v], i, j);
                }
                const bool positive = w[0] > 0 && w[1] > 0 && w[2] > 0;
                if (!positive && !(w[0] < 0 && w[1] < 0 && w[2] < 0)) continue;
                const double at =
                    (w[0] * p[0][axis] + w[1] * p[1][axis] + w[2] * p[2][axis]) / (w[0] + w[1] + w[2]);
                crossings.push_back({static_cast<std::uint32_t>(j * dims_[u] + i), static_cast<float>(at),
                                     static_cast<std::int8_t>(positive ? -1 : 1)});
            }
        }
    }
    std::sort(crossings.begin(), crossings.end());
    std::vector<std::uint64_t> bits((static_cast<std::size_t>(dims_[0]) * dims_[1] * dims_[2] + 63) / 64, 0);
    const std::array<std::size_t, 3> stride = {1, static_cast<std::size_t>(dims_[0]),
                                               static_cast<std::size_t>(dims_[0]) * dims_[1]};
    int depth = 0;
    for (std::size_t c = 0; c + 1 < crossings.size(); ++c) {
        const Crossing &here = crossings[c], &next = crossings[c + 1];
        if (c == 0 || crossings[c - 1].column != here.column) depth = 0;
        depth += here.sign;
        if (depth <= 0 || next.column != here.column) continue;
        const std::size_t first = here.column % dims_[u] * stride[u] + here.column / dims_[u] * stride[v];
        const int from = std::max(0, static_cast<int>(std::ceil(here.at))),
                  to = std::min(dims_[axis] - 1, static_cast<int>(std::floor(next.at)));
        for (int k = from; k <= to; ++k) {
            const std::size_t bit = first + static_cast<std::size_t>(k) * stride[axis];
            bits[bit / 64] |= std::uint64_t{1} << bit % 64;
        }
    }
    return bits;
}

Vec3 LumenVoxels::centre(int voxel) const {
    const Place& p = place_[voxel];
    return origin_ + size_ * Vec3(p[0], p[1], p[2]);
}

int LumenVoxels::nearest(const Vec3& x) const {
    int best = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < count(); ++i)
        if (const double square = (centre(i) - x).squaredNorm(); square < least) least = square, best = i;
    return best;
}

std::vector<float> LumenVoxels::distances(const geometry::MeshQuery& wall, int threads) const {
    std::vector<float> result(place_.size());
    constexpr int pieces = 256;
    // A run of voxels along x has consecutive indices; a piece begins and ends with a run.
    const auto goes_on = [&](int i) {
        return i > 0 && i < count() && place_[i][0] == place_[i - 1][0] + 1 &&
               place_[i][1] == place_[i - 1][1] && place_[i][2] == place_[i - 1][2];
    };
    const auto piece_start = [&](int piece) {
        int i = static_cast<int>(static_cast<std::int64_t>(count()) * piece / pieces);
        while (goes_on(i)) --i;
        return i;
    };
    const auto measure = [&](int i) { result[i] = static_cast<float>(wall.distance(centre(i))); };
    geometry::for_each_index(pieces, threads, [&](int piece) {
        const int end = piece_start(piece + 1);
        for (int i = piece_start(piece); i < end;) {
            int last = i;  // of the run
            while (goes_on(last + 1)) ++last;
            measure(i);
            for (int next; i < last; i = next) {
                next = std::min(last, i + std::max(1, static_cast<int>(result[i] / (3 * size_))));
                measure(next);
                for (int k = i + 1; k < next; ++k) {
                    const float part = static_cast<float>(k - i) / static_cast<float>(next - i);
                    result[k] = (1 - part) * result[i] + part * result[next];
                }
            }
            i = last + 1;
        }
    });
    return result;
}

std::vector<int> VoxelPaths::path(int voxel) const {
    std::vector<int> result;
    for (; voxel >= 0; voxel = from[voxel]) result.push_back(voxel);
    return result;
}

VoxelPaths cheapest_paths(const LumenVoxels& voxels, std::span<const float> distances, int root) {
    const int count = voxels.count();
    VoxelPaths paths{std::vector<int>(count, -1),
                     std::vector<float>(count, std::numeric_limits<float>::infinity())};
    std::vector<float> cost(count, std::numeric_limits<float>::infinity()), per_mm(count);
    const double least = 0.1 * voxels.size();
    for (int i = 0; i < count; ++i) {
        const double d = std::max<double>(least, distances[i]);
        per_mm[i] = static_cast<float>(0.5 / (d * d));
    }
    // Costs are not negative, so that their bits order as they do: cost and voxel make one number.
    using Entry = std::uint64_t;
    const auto entry = [](float at, int voxel) {
        return static_cast<Entry>(std::bit_cast<std::uint32_t>(at)) << 32 | static_cast<std::uint32_t>(voxel);
    };
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    cost[root] = 0, paths.length[root] = 0;
    open.push(entry(0, root));
    const auto size = static_cast<float>(voxels.size());
    const std::array<float, 4> step = {0, size, size * std::sqrt(2.0f), size * std::sqrt(3.0f)};
    while (!open.empty()) {
        const float at = std::bit_cast<float>(static_cast<std::uint32_t>(open.top() >> 32));
        const int i = static_cast<int>(open.top() & 0xffffffff);
        open.pop();
        if (at > cost[i]) continue;
        voxels.neighbours(i, [&](int j, int steps) {
            const float next = at + step[steps] * (per_mm[i] + per_mm[j]);
            if (next >= cost[j]) return;
            cost[j] = next;
            paths.from[j] = i;
            paths.length[j] = paths.length[i] + step[steps];
            open.push(entry(next, j));
        });
    }
    return paths;
}

int most_steps_from(const LumenVoxels& voxels, int root) {
    std::vector<char> seen(voxels.count(), 0);
    std::vector<int> reached = {root};
    seen[root] = 1;
    for (std::size_t next = 0; next < reached.size(); ++next) {
        voxels.neighbours(reached[next], [&](int j, int) {
            if (!std::exchange(seen[j], 1)) reached.push_back(j);
        });
    }
    return reached.back();
}

}  // namespace anatomy
