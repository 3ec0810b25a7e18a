#include "engine/anatomy/grow/surface_nets.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <limits>

#include "physics/geometry/parallel.h"
#include "physics/geometry/surface_net.h"

namespace anatomy {
namespace {

constexpr int n = ImplicitLumen::block_cells, w = n + 1;  // cells and nodes along a block
constexpr int nodes_of_block = n * n * n, nodes_of_window = w * w * w;
constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();
constexpr float sign_only = 1e9f;  // f where only its sign is known [mm]

constexpr int in_block(int x, int y, int z) {
    return (z * n + y) * n + x;
}
constexpr int in_window(int x, int y, int z) {
    return (z * w + y) * w + x;
}

/// Whether the bits of the mask, corners of a cube (x + 2y + 4z), are connected along its edges.
bool connected(int mask) {
    if (mask == 0) return true;
    int reached = mask & -mask;
    for (int step = 0; step < 8; ++step) {
        int grown = reached;
        for (int c = 0; c < 8; ++c) {
            if (!(reached >> c & 1)) continue;
            for (const int bit : {1, 2, 4}) grown |= 1 << (c ^ bit);
        }
        reached = grown & mask;
    }
    return reached == mask;
}

/// Cells whose surface is not one disc, or which share a face that is crossed twice with a neighbour.
std::array<bool, 256> make_ambiguous() {
    std::array<bool, 256> table{};
    for (int mask = 0; mask < 256; ++mask) {
        table[mask] = !connected(mask) || !connected(255 & ~mask);
        for (const int axis : {1, 2, 4}) {
            const int u = axis == 1 ? 2 : 1, v = axis == 4 ? 2 : 4;
            for (const int side : {0, axis}) {
                const bool a = mask >> side & 1, b = mask >> (side | u) & 1, c = mask >> (side | v) & 1,
                           d = mask >> (side | u | v) & 1;
                if (a == d && b == c && a != b) table[mask] = true;
            }
        }
    }
    return table;
}

class Nets {
public:
    Nets(const ImplicitLumen& lumen, int threads, const std::function<void(double)>& progress)
        : lumen_(lumen), values_(lumen.blocks().size()), exact_(values_.size()) {
        for (auto& neighbours : neighbours_) neighbours.resize(values_.size());
        for (std::size_t b = 0; b < values_.size(); ++b) {
            for (int k = 0; k < 27; ++k) {
                const ImplicitLumen::Block& at = lumen.blocks()[b];
                neighbours_[k][b] = lumen.find({at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1});
            }
        }
        const auto part = [&progress](double from, double to) -> std::function<void(double)> {
            if (!progress) return {};
            return [&progress, from, to](double fraction) { progress(from + fraction * (to - from)); };
        };
        geometry::parallel_for(
            values_.size(), threads, [&](std::size_t b) { find_sides(static_cast<int>(b)); }, part(0, 0.5));
        // Values that one block reads from the others must not change meanwhile.
        std::vector<std::vector<int>> crossed(values_.size());
        geometry::parallel_for(values_.size(), threads,
                               [&](std::size_t b) { crossed[b] = crossed_nodes(static_cast<int>(b)); });
        geometry::parallel_for(
            values_.size(), threads,
            [&](std::size_t b) {
                for (const int node : crossed[b]) make_exact(static_cast<int>(b), node);
            },
            part(0.5, 1));
    }

    /// Fills until no cell is ambiguous. It terminates because nodes only ever change to inside.
    void settle() {
        const std::array<bool, 256> ambiguous = make_ambiguous();
        std::vector<bool> stale(values_.size(), true);
        for (bool changed = true; changed;) {
            changed = false;
            for (std::size_t b = 0; b < values_.size(); ++b) {
                if (!stale[b]) continue;
                stale[b] = false;
                load(static_cast<int>(b));
                for (int cell = 0; cell < nodes_of_block; ++cell) {
                    const int x = cell % n, y = cell / n % n, z = cell / (n * n);
                    const int mask = mask_of(x, y, z);
                    if (mask <= 0 || mask == 255 || !ambiguous[mask]) continue;
                    fill(static_cast<int>(b), x, y, z, mask, stale);
                    changed = true;
                    load(static_cast<int>(b));
                }
            }
        }
    }

    TriangleMesh mesh() {
        TriangleMesh result;
        corner_.assign(values_.size(), {});
        for (std::size_t b = 0; b < values_.size(); ++b) {
            corner_[b].fill(-1);
            load(static_cast<int>(b));
            for (int cell = 0; cell < nodes_of_block; ++cell) {
                const int x = cell % n, y = cell / n % n, z = cell / (n * n);
                const int mask = mask_of(x, y, z);
                if (mask <= 0 || mask == 255) continue;
                corner_[b][cell] = static_cast<int>(result.vertices.size());
                result.vertices.push_back(
                    lumen_.projected(lumen_.node(lumen_.blocks()[b], x, y, z) + crossing(x, y, z)));
            }
        }
        for (std::size_t b = 0; b < values_.size(); ++b) {
            load(static_cast<int>(b));
            for (int node = 0; node < nodes_of_block; ++node) add_quads(static_cast<int>(b), node, result);
        }
        return result;
    }

private:
    /// Finds on which side of the surface each node of a block is. Most nodes are so far from it that a node
    /// nearby decides: their value is then only a sign.
    void find_sides(int b) {
        values_[b].fill(nowhere);
        for (const int step : {4, 2, 1}) {
            for (int first = 0; first < nodes_of_block; ++first) {
                const int x = first % n, y = first / n % n, z = first / (n * n);
                if (x % step != 0 || y % step != 0 || z % step != 0) continue;
                if (!std::isnan(values_[b][first])) continue;
                make_exact(b, first);
                tell_around(b, x, y, z);
            }
        }
    }
    /// Nodes of the block that lie on the other side of the surface from a neighbour one edge away.
    std::vector<int> crossed_nodes(int b) const {
        std::vector<int> nodes;
        for (int node = 0; node < nodes_of_block; ++node) {
            const int x = node % n, y = node / n % n, z = node / (n * n);
            const bool inner = values_[b][node] < 0;
            const auto crossed = [&](int dx, int dy, int dz) {
                const float other = value_at(b, x + dx, y + dy, z + dz);
                return !std::isnan(other) && (other < 0) != inner;
            };
            if (!exact_[b][node] && (crossed(1, 0, 0) || crossed(-1, 0, 0) || crossed(0, 1, 0) ||
                                     crossed(0, -1, 0) || crossed(0, 0, 1) || crossed(0, 0, -1)))
                nodes.push_back(node);
        }
        return nodes;
    }
    void make_exact(int b, int node) {
        if (exact_[b][node]) return;
        exact_[b][node] = true;
        const int x = node % n, y = node / n % n, z = node / (n * n);
        values_[b][node] =
            static_cast<float>(lumen_.at(lumen_.node(lumen_.blocks()[b], x, y, z), b).distance);
    }
    /// Sets the nodes of the block that are so near this one that they must be on its side.
    void tell_around(int b, int x, int y, int z) {
        const float distance = values_[b][in_block(x, y, z)];
        const double reach = std::abs(distance) / (ImplicitLumen::steepest * lumen_.cell()) - 1e-3;  // cells
        if (reach < 1) return;
        const float side = distance < 0 ? -sign_only : sign_only;
        const int most = static_cast<int>(std::min<double>(n, reach));
        for (int k = std::max(0, z - most); k <= std::min(n - 1, z + most); ++k)
            for (int j = std::max(0, y - most); j <= std::min(n - 1, y + most); ++j)
                for (int i = std::max(0, x - most); i <= std::min(n - 1, x + most); ++i) {
                    const int square = (i - x) * (i - x) + (j - y) * (j - y) + (k - z) * (k - z);
                    float& other = values_[b][in_block(i, j, k)];
                    if (square <= reach * reach && std::isnan(other)) other = side;
                }
    }
    /// The value of a node that may be one beyond the block.
    float value_at(int b, int x, int y, int z) const {
        const auto shift = [](int i) { return i < 0 ? -1 : i / n; };
        const int block = neighbour(b, shift(x), shift(y), shift(z));
        return block < 0 ? nowhere : values_[block][in_block((x + n) % n, (y + n) % n, (z + n) % n)];
    }
    void make_exact_at(int b, int x, int y, int z) {
        const auto shift = [](int i) { return i < 0 ? -1 : i / n; };
        const int block = neighbour(b, shift(x), shift(y), shift(z));
        if (block >= 0) make_exact(block, in_block((x + n) % n, (y + n) % n, (z + n) % n));
    }
    void make_exact_beside(int b, int x, int y, int z, int axis, int side) {
        make_exact_at(b, x + (axis == 0 ? side : 0), y + (axis == 1 ? side : 0), z + (axis == 2 ? side : 0));
    }
    /// Loads the block's nodes and the first ones of its neighbours.
    void load(int b) {
        for (int z = 0; z < w; ++z)
            for (int y = 0; y < w; ++y)
                for (int x = 0; x < w; ++x) {
                    const int block = neighbour(b, x / n, y / n, z / n);
                    window_[in_window(x, y, z)] =
                        block < 0 ? nowhere : values_[block][in_block(x % n, y % n, z % n)];
                }
    }
    int neighbour(int b, int x, int y, int z) const { return neighbours_[13 + x + 3 * y + 9 * z][b]; }
    float value(int x, int y, int z, int corner) const {
        return window_[in_window(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2))];
    }
    /// The corners that are inside, as a mask; −1 where one is unknown because no surface is near.
    int mask_of(int x, int y, int z) const {
        int mask = 0;
        for (int c = 0; c < 8; ++c) {
            const float v = value(x, y, z, c);
            if (std::isnan(v)) return -1;
            mask |= (v < 0) << c;
        }
        return mask;
    }
    /// Turns the outer corner nearest to the surface into an inner one.
    void fill(int b, int x, int y, int z, int mask, std::vector<bool>& stale) {
        for (int c = 0; c < 8; ++c) make_exact_at(b, x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
        load(b);
        int chosen = -1;
        for (int c = 0; c < 8; ++c) {
            if (mask >> c & 1) continue;
            if (chosen < 0 || value(x, y, z, c) < value(x, y, z, chosen)) chosen = c;
        }
        const int i = x + (chosen & 1), j = y + (chosen >> 1 & 1), k = z + (chosen >> 2);
        const int block = neighbour(b, i / n, j / n, k / n);
        // The surface crosses it from now on.
        for (int axis = 0; axis < 3; ++axis)
            for (const int side : {-1, 1}) make_exact_beside(block, i % n, j % n, k % n, axis, side);
        values_[block][in_block(i % n, j % n, k % n)] = -1e-3f * static_cast<float>(lumen_.cell());
        for (int at = 0; at < 27; ++at) {
            if (neighbours_[at][block] >= 0) stale[neighbours_[at][block]] = true;
        }
    }
    /// Mean of the places where the surface crosses the cell's edges, from the cell's first node [mm].
    Vec3 crossing(int x, int y, int z) const {
        const geometry::Crossings found =
            geometry::crossings_of([&](int c) { return static_cast<double>(value(x, y, z, c)); });
        return lumen_.cell() * found.sum / found.count;
    }
    /// The corner in a cell that is up to one block away.
    int corner_at(int b, int x, int y, int z) const {
        const auto shift = [](int i) { return i < 0 ? -1 : 0; };
        const int block = neighbour(b, shift(x), shift(y), shift(z));
        return corner_[block][in_block((x + n) % n, (y + n) % n, (z + n) % n)];
    }
    /// Adds two triangles around each edge from the node onward that the surface crosses.
    void add_quads(int b, int node, TriangleMesh& mesh) const {
        const int x = node % n, y = node / n % n, z = node / (n * n);
        const float here = window_[in_window(x, y, z)];
        for (int axis = 0; axis < 3; ++axis) {
            const float there = window_[in_window(x + (axis == 0), y + (axis == 1), z + (axis == 2))];
            if (std::isnan(there) || (here < 0) == (there < 0)) continue;
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            std::array<int, 4> quad{};
            constexpr int around[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};
            for (int k = 0; k < 4; ++k) {
                std::array<int, 3> cell = {x, y, z};
                cell[u] += around[k][0];
                cell[v] += around[k][1];
                quad[k] = corner_at(b, cell[0], cell[1], cell[2]);
            }
            geometry::add_quad(mesh, quad, here < 0);
        }
    }

    const ImplicitLumen& lumen_;
    std::vector<std::array<float, nodes_of_block>> values_;  // ±sign_only where only the sign is known
    std::vector<std::bitset<nodes_of_block>> exact_;         // the values that are f
    std::array<std::vector<int>, 27> neighbours_;
    std::array<float, nodes_of_window> window_{};
    std::vector<std::array<int, nodes_of_block>> corner_;
};

}  // namespace

TriangleMesh surface_nets(const ImplicitLumen& lumen, int threads,
                          const std::function<void(double)>& progress) {
    Nets nets(lumen, threads, progress);
    nets.settle();
    return nets.mesh();
}

}  // namespace anatomy
