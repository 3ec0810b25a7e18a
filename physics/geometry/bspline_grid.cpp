#include "physics/geometry/bspline_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "physics/geometry/parallel.h"

namespace geometry {
namespace {

constexpr int brick_side = SplineGrid::brick_side;
constexpr int farthest = 1 << 20;  // brick

/// A key that sorts as bricks do.
std::uint64_t key(const SplineGrid::Brick& b) {
    std::uint64_t all = 0;
    for (int k : b) all = all << 21 | static_cast<std::uint32_t>(k + farthest);
    return all;
}
std::size_t hash(const SplineGrid::Brick& b) {
    return key(b) * 0x9e3779b97f4a7c15u >> 20;
}

int local(int i, int j, int k) {
    return (i * brick_side + j) * brick_side + k;
}

/// Uniform cubic B-splines over a cell, at t in [0, 1), and their derivatives by t.
struct Weights {
    double value[4], slope[4], bend[4];

    explicit Weights(double t) {
        const double s = 1 - t;
        value[0] = s * s * s / 6;
        value[1] = (3 * t * t * t - 6 * t * t + 4) / 6;
        value[2] = (3 * s * s * s - 6 * s * s + 4) / 6;
        value[3] = t * t * t / 6;
        slope[0] = -s * s / 2;
        slope[1] = (3 * t - 4) * t / 2;
        slope[2] = -(3 * s - 4) * s / 2;
        slope[3] = t * t / 2;
        bend[0] = s;
        bend[1] = 3 * t - 2;
        bend[2] = 3 * s - 2;
        bend[3] = t;
    }
};

}  // namespace

SplineGrid::SplineGrid(double spacing, std::vector<Brick> bricks)
    : spacing_(spacing), nodes_(bricks.size()), bricks_(bricks.size()) {
    if (!std::isfinite(spacing) || spacing <= 0) throw std::invalid_argument("a grid's spacing must be > 0");
    table_.assign(std::bit_ceil(2 * bricks.size() + 2), -1);
    const std::size_t mask = table_.size() - 1;
    for (std::size_t b = 0; b < bricks.size(); ++b) {
        for (int k : bricks[b])
            if (k < -farthest + 2 || k > farthest - 2)
                throw std::invalid_argument("a grid's brick lies too far from the origin");
        bricks_[b].at = bricks[b];
        std::size_t slot = hash(bricks[b]) & mask;
        while (table_[slot] >= 0) slot = (slot + 1) & mask;
        table_[slot] = static_cast<std::int32_t>(b);
    }
    at_ = {nodes_, bricks_, table_};
    // In a sorted list the bricks above one come after the bricks above its predecessors.
    std::vector<std::uint64_t> keys;
    keys.reserve(bricks.size());
    for (const Brick& brick : bricks) keys.push_back(key(brick));
    const bool sorted = std::is_sorted(keys.begin(), keys.end());
    for (int n = 0; n < 8; ++n) {
        const Brick step{n >> 2, n >> 1 & 1, n & 1};
        std::size_t next = 0;
        for (Place& place : bricks_) {
            const Brick above{place.at[0] + step[0], place.at[1] + step[1], place.at[2] + step[2]};
            if (!sorted) {
                place.upper[n] = find(above);
                continue;
            }
            const std::uint64_t wanted = key(above);
            while (next < keys.size() && keys[next] < wanted) ++next;
            const bool there = next < keys.size() && keys[next] == wanted;
            place.upper[n] = there ? static_cast<std::int32_t>(next) : -1;
        }
    }
}

/// Counts of what is saved, before it. Nodes come first, for they are read by the line of a cache.
struct SplineGrid::SavedHead {
    std::uint64_t bricks = 0, slots = 0;
    std::uint64_t padding[6] = {};

    /// Of all, head included.
    std::size_t bytes() const {
        static_assert(sizeof(SavedHead) == alignment && sizeof(Nodes) % alignment == 0);
        const std::size_t rest = bricks * sizeof(Place) + slots * sizeof(std::int32_t);
        return sizeof *this + bricks * sizeof(Nodes) + (rest + alignment - 1) / alignment * alignment;
    }
};

std::size_t SplineGrid::saved_bytes(std::span<const std::byte> saved) {
    constexpr std::uint64_t most = std::uint64_t{1} << 31;
    SavedHead head;
    if (saved.size() >= sizeof head) std::memcpy(&head, saved.data(), sizeof head);
    const bool sound = head.slots > head.bricks && head.slots < most && std::has_single_bit(head.slots);
    return sound ? head.bytes() : std::numeric_limits<std::size_t>::max();
}

SplineGrid::Parts SplineGrid::parts_of(std::span<const std::byte> saved) {
    if (saved_bytes(saved) > saved.size()) throw std::invalid_argument("a saved grid is cut short");
    SavedHead head;
    std::memcpy(&head, saved.data(), sizeof head);
    const std::byte* at = saved.data() + sizeof head;
    const auto list = [&at]<class Item>(std::size_t count, std::span<const Item>& items) {
        items = {reinterpret_cast<const Item*>(at), count};
        at += items.size_bytes();
    };
    Parts parts;
    list(head.bricks, parts.nodes);
    list(head.bricks, parts.bricks);
    list(head.slots, parts.table);
    return parts;
}

SplineGrid::SplineGrid(double spacing, std::span<const std::byte> saved, std::shared_ptr<const void> held)
    : spacing_(spacing), held_(std::move(held)) {
    if (!std::isfinite(spacing) || spacing <= 0) throw std::invalid_argument("a grid's spacing must be > 0");
    at_ = parts_of(saved);
    if (held_ && reinterpret_cast<std::uintptr_t>(saved.data()) % alignment == 0) return;
    // Byte by byte: they need not lie where such objects can.
    const auto copied = [](const auto& from, auto& to) {
        to.resize(from.size());
        if (!from.empty()) std::memcpy(to.data(), static_cast<const void*>(from.data()), from.size_bytes());
    };
    copied(at_.nodes, nodes_);
    copied(at_.bricks, bricks_);
    copied(at_.table, table_);
    at_ = {nodes_, bricks_, table_};
    held_.reset();
}

void SplineGrid::save(std::string& bytes) const {
    SavedHead head;
    head.bricks = at_.bricks.size();
    head.slots = at_.table.size();
    const std::size_t end = bytes.size() + head.bytes();
    bytes.append(reinterpret_cast<const char*>(&head), sizeof head);
    const auto list = [&bytes](const auto& items) {
        bytes.append(reinterpret_cast<const char*>(items.data()), items.size_bytes());
    };
    list(at_.nodes);
    list(at_.bricks);
    list(at_.table);
    bytes.resize(end, '\0');
}

std::int32_t SplineGrid::find(const Brick& brick) const {
    const std::size_t mask = at_.table.size() - 1;
    for (std::size_t slot = hash(brick) & mask;; slot = (slot + 1) & mask) {
        const std::int32_t b = at_.table[slot];
        if (b < 0) return b;
        const Brick& at = at_.bricks[b].at;  // compared by hand: == on arrays is a call
        if (at[0] == brick[0] && at[1] == brick[1] && at[2] == brick[2]) return b;
    }
}

std::size_t SplineGrid::bytes() const {
    return at_.nodes.size_bytes() + at_.bricks.size_bytes() + at_.table.size_bytes();
}

SplineGrid::Bricks SplineGrid::around(const Brick& brick) const {
    Bricks all;
    for (int n = 0; n < 27; ++n)
        all[n] = find({brick[0] + n / 9 - 1, brick[1] + n / 3 % 3 - 1, brick[2] + n % 3 - 1});
    return all;
}

std::optional<float> SplineGrid::subdivided(const std::array<int, 3>& node, const Brick& brick,
                                            const Bricks& around) const {
    // A B-spline is a sum of five of half its width, with weights of (1, 4, 6, 4, 1) / 8.
    int first[3], count[3];
    for (int d = 0; d < 3; ++d) {
        const bool odd = node[d] & 1;
        first[d] = odd ? node[d] >> 1 : (node[d] >> 1) - 1;
        count[d] = odd ? 2 : 3;
    }
    auto weight = [&](int d, int i) { return count[d] == 2 ? 0.5 : i == 1 ? 0.75 : 0.125; };
    double sum = 0;
    for (int i = 0; i < count[0]; ++i)
        for (int j = 0; j < count[1]; ++j)
            for (int k = 0; k < count[2]; ++k) {
                const int p = first[0] + i, q = first[1] + j, r = first[2] + k;
                const std::int32_t b = around[9 * ((p >> 2) - brick[0] + 1) + 3 * ((q >> 2) - brick[1] + 1) +
                                              (r >> 2) - brick[2] + 1];
                if (b < 0) return std::nullopt;
                sum +=
                    weight(0, i) * weight(1, j) * weight(2, k) * at_.nodes[b].of[local(p & 3, q & 3, r & 3)];
            }
    return static_cast<float>(sum);
}

void SplineGrid::fit(int threads, const SplineGrid* coarse) {
    std::vector<Nodes> coefficients(nodes_.size());
    parallel_for(bricks_.size(), threads, [&](std::size_t b) {
        const Bricks beside = around(brick(b));
        const bool whole = std::ranges::all_of(beside, [](std::int32_t at) { return at >= 0; });
        const Brick within{brick(b)[0] >> 1, brick(b)[1] >> 1, brick(b)[2] >> 1};  // of the coarse grid
        Bricks coarse_beside{};
        if (coarse && !whole) coarse_beside = coarse->around(within);
        constexpr int n = brick_side + 2;  // with the layer of nodes around the brick
        double v[n][n][n];
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                for (int k = 0; k < n; ++k) {
                    const int node[3] = {i - 1, j - 1, k - 1};
                    const std::int32_t from = beside[9 * ((i + 3) / brick_side) + 3 * ((j + 3) / brick_side) +
                                                     (k + 3) / brick_side];
                    if (from >= 0) {
                        v[i][j][k] = nodes_[from].of[local(node[0] & 3, node[1] & 3, node[2] & 3)];
                        continue;
                    }
                    int edge[3], mirrored[3];
                    for (int d = 0; d < 3; ++d) {
                        edge[d] = std::clamp(node[d], 0, brick_side - 1);
                        mirrored[d] = 2 * edge[d] - node[d];
                    }
                    v[i][j][k] = 2 * nodes_[b].of[local(edge[0], edge[1], edge[2])] -
                                 nodes_[b].of[local(mirrored[0], mirrored[1], mirrored[2])];
                }
        // c = (1 − δ²/6) f along each axis, δ² the second difference.
        constexpr double side[3] = {-1.0 / 6, 8.0 / 6, -1.0 / 6};
        for (int i = 0; i < brick_side; ++i)
            for (int j = 0; j < brick_side; ++j)
                for (int k = 0; k < brick_side; ++k) {
                    float& coefficient = coefficients[b].of[local(i, j, k)];
                    if (coarse && !whole)
                        if (const auto taken = coarse->subdivided(
                                {brick_side * brick(b)[0] + i, brick_side * brick(b)[1] + j,
                                 brick_side * brick(b)[2] + k},
                                within, coarse_beside)) {
                            coefficient = *taken;
                            continue;
                        }
                    double c = 0;
                    for (int p = 0; p < 3; ++p)
                        for (int q = 0; q < 3; ++q)
                            for (int r = 0; r < 3; ++r)
                                c += side[p] * side[q] * side[r] * v[i + p][j + q][k + r];
                    coefficient = static_cast<float>(c);
                }
    });
    nodes_ = std::move(coefficients);
    at_.nodes = nodes_;
}

bool SplineGrid::evaluate(const Vec3& x, SplineValue& out) const {
    int first[3];
    double within[3];  // the cell, from 0 to 1
    Brick brick;
    for (int d = 0; d < 3; ++d) {
        const double at = x[d] / spacing_;
        if (!(std::abs(at) < brick_side * (farthest - 2.0))) return false;
        const double below = std::floor(at);
        const int node = static_cast<int>(below) - 1;
        within[d] = at - below;
        brick[d] = node >> 2;
        first[d] = node & 3;
    }
    const std::int32_t b = find(brick);
    if (b < 0) return false;
    const auto& upper = at_.bricks[b].upper;
    for (int n = 1; n < 8; ++n)
        if (upper[n] < 0) return false;

    // Rows of eight nodes along z, of which the cell's four start at first[2].
    const Nodes* const nodes = at_.nodes.data();
    float rows[4][4][8];
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
            const int p = first[0] + i, q = first[1] + j;
            const int pair = (p >> 2) * 4 + (q >> 2) * 2, offset = local(p & 3, q & 3, 0);
            std::memcpy(rows[j][i], &nodes[upper[pair]].of[offset], 16);
            std::memcpy(rows[j][i] + 4, &nodes[upper[pair + 1]].of[offset], 16);
        }

    const Weights wx(within[0]), wy(within[1]), wz(within[2]);
    // Contract x, then y, then z, four rows of z at a time; a letter of a name is a derivative taken.
    using Row = Eigen::Array4d;
    Row g = Row::Zero(), gx = g, gy = g, gxx = g, gxy = g, gyy = g;
    for (int j = 0; j < 4; ++j) {
        Row f = Row::Zero(), fx = f, fxx = f;
        for (int i = 0; i < 4; ++i) {
            const Row c = Eigen::Map<const Eigen::Array4f>(rows[j][i] + first[2]).cast<double>();
            f += wx.value[i] * c;
            fx += wx.slope[i] * c;
            fxx += wx.bend[i] * c;
        }
        g += wy.value[j] * f;
        gy += wy.slope[j] * f;
        gyy += wy.bend[j] * f;
        gx += wy.value[j] * fx;
        gxy += wy.slope[j] * fx;
        gxx += wy.value[j] * fxx;
    }
    double v = 0, vx = 0, vy = 0, vz = 0, vxx = 0, vxy = 0, vxz = 0, vyy = 0, vyz = 0, vzz = 0;
    for (int k = 0; k < 4; ++k) {
        v += wz.value[k] * g[k];
        vx += wz.value[k] * gx[k];
        vy += wz.value[k] * gy[k];
        vz += wz.slope[k] * g[k];
        vxx += wz.value[k] * gxx[k];
        vxy += wz.value[k] * gxy[k];
        vyy += wz.value[k] * gyy[k];
        vxz += wz.slope[k] * gx[k];
        vyz += wz.slope[k] * gy[k];
        vzz += wz.bend[k] * g[k];
    }
    const double h = 1 / spacing_, h2 = h * h;
    out.value = v;
    out.gradient = Vec3(h * vx, h * vy, h * vz);
    out.hessian << h2 * vxx, h2 * vxy, h2 * vxz, h2 * vxy, h2 * vyy, h2 * vyz, h2 * vxz, h2 * vyz, h2 * vzz;
    return true;
}

}  // namespace geometry
