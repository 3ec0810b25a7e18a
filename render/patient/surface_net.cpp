#include "physics/geometry/surface_net.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "render/patient/signed_distance.h"

namespace render::shape {

using Eigen::AlignedBox3d;
using geometry::Vec3;

namespace {

/// Values at the nodes of a grid, and what is near each block of them.
class Grid {
public:
    static constexpr int n = 8;  // nodes along a block

    Grid(const Compound& compound, double cell) : compound_(compound), cell_(cell) {
        const double margin = 2.0 * cell;
        low_ = compound.box().min() - Vec3::Constant(margin);
        for (int k = 0; k < 3; ++k) {
            blocks_[k] =
                static_cast<int>(std::ceil((compound.box().sizes()[k] + 2.0 * margin) / cell)) / n + 1;
            size_[k] = blocks_[k] * n;
        }
        const auto nodes = static_cast<std::size_t>(size_[0]) * size_[1] * size_[2];
        outer.assign(nodes, far);
        if (compound.thickest_shell() > 0.0) core.assign(nodes, far);
        near_.resize(static_cast<std::size_t>(blocks_[0]) * blocks_[1] * blocks_[2]);
        for (int z = 0; z < blocks_[2]; ++z)
            for (int y = 0; y < blocks_[1]; ++y)
                for (int x = 0; x < blocks_[0]; ++x) fill(x, y, z);
    }

    geometry::TriangleMesh net(const std::vector<float>& values, bool inner) const {
        geometry::TriangleMesh mesh;
        std::vector<int> vertex(values.size(), -1);
        std::vector<Placed> placed;
        const std::size_t step[3] = {1, static_cast<std::size_t>(size_[0]),
                                     static_cast<std::size_t>(size_[0]) * size_[1]};
        for (int z = 0; z + 1 < size_[2]; ++z) {
            for (int y = 0; y + 1 < size_[1]; ++y) {
                std::size_t node = index(0, y, z);
                for (int x = 0; x + 1 < size_[0]; ++x, ++node) {
                    int mask = 0;
                    for (int c = 0; c < 8; ++c)
                        mask |= (values[node + (c & 1) + (c >> 1 & 1) * step[1] + (c >> 2) * step[2]] < 0)
                                << c;
                    if (mask == 0 || mask == 255) continue;
                    vertex[node] = static_cast<int>(placed.size());
                    placed.push_back(place(values, node, step, {x, y, z}, inner));
                }
            }
        }
        const std::vector<int> kept = merged(placed, inner, mesh.vertices);
        for (int z = 1; z + 1 < size_[2]; ++z) {
            for (int y = 1; y + 1 < size_[1]; ++y) {
                for (int x = 1; x + 1 < size_[0]; ++x) {
                    const std::size_t node = index(x, y, z);
                    const bool here = values[node] < 0;
                    for (int axis = 0; axis < 3; ++axis) {
                        if (here == (values[node + step[axis]] < 0)) continue;
                        const std::size_t u = step[(axis + 1) % 3], v = step[(axis + 2) % 3];
                        geometry::add_quad(mesh,
                                           {kept[vertex[node - u - v]], kept[vertex[node - v]],
                                            kept[vertex[node]], kept[vertex[node - u]]},
                                           here);
                    }
                }
            }
        }
        return mesh;
    }

    std::vector<float> outer, core;

private:
    static constexpr float far = 1e6f;

    struct Placed {
        Vec3 at, normal;
        std::array<int, 3> cell;
    };

    /// Merges the vertices of cubes of four cells, or of two, where all normals agree; returns the number of
    /// each vertex among the kept ones.
    std::vector<int> merged(const std::vector<Placed>& placed, bool inner_surface,
                            std::vector<Vec3>& vertices) const {
        std::vector<int> kept(placed.size(), -1);
        // A rough surface has no use for the last degree.
        const bool rough = compound_.is_rough();
        for (const auto& [width, agreement] :
             {std::pair{4, rough ? 0.985 : 0.993}, {2, rough ? 0.965 : 0.985}}) {
            struct Cube {
                Vec3 place = Vec3::Zero(), normal = Vec3::Zero();
                int count = 0, vertex = -1;
                bool flat = true;
            };
            const int across = size_[0] / width + 1, along = size_[1] / width + 1;
            std::vector<int> cube_of(static_cast<std::size_t>(across) * along * (size_[2] / width + 1), -1);
            std::vector<Cube> cubes;
            const auto number = [&, width = width](const Placed& vertex) -> int& {
                const auto& c = vertex.cell;
                return cube_of[(static_cast<std::size_t>(c[2] / width) * along + c[1] / width) * across +
                               c[0] / width];
            };
            for (std::size_t i = 0; i < placed.size(); ++i) {
                if (kept[i] >= 0) continue;
                int& own = number(placed[i]);
                if (own < 0) {
                    own = static_cast<int>(cubes.size());
                    cubes.emplace_back();
                }
                Cube& cube = cubes[static_cast<std::size_t>(own)];
                cube.place += placed[i].at;
                cube.normal += placed[i].normal;
                ++cube.count;
            }
            for (Cube& cube : cubes) cube.flat = cube.normal.norm() > 0.5;
            for (std::size_t i = 0; i < placed.size(); ++i) {
                if (kept[i] >= 0) continue;
                Cube& cube = cubes[static_cast<std::size_t>(number(placed[i]))];
                cube.flat = cube.flat && placed[i].normal.dot(cube.normal) > agreement * cube.normal.norm();
            }
            for (std::size_t i = 0; i < placed.size(); ++i) {
                if (kept[i] >= 0) continue;
                Cube& cube = cubes[static_cast<std::size_t>(number(placed[i]))];
                if (!cube.flat || cube.count < 2) continue;
                if (cube.vertex < 0) {
                    cube.vertex = static_cast<int>(vertices.size());
                    const Vec3 mean = cube.place / cube.count;
                    vertices.push_back(
                        onto_surface(mean, cube.normal.normalized(), placed[i].cell, inner_surface));
                }
                kept[i] = cube.vertex;
            }
        }
        for (std::size_t i = 0; i < placed.size(); ++i) {
            if (kept[i] >= 0) continue;
            kept[i] = static_cast<int>(vertices.size());
            vertices.push_back(placed[i].at);
        }
        return kept;
    }

    const std::vector<std::uint16_t>& near_cell(const std::array<int, 3>& cell) const {
        return near_[(static_cast<std::size_t>(cell[2] / n) * blocks_[1] + cell[1] / n) * blocks_[0] +
                     cell[0] / n];
    }
    Vec3 onto_surface(const Vec3& p, const Vec3& normal, const std::array<int, 3>& cell,
                      bool inner_surface) const {
        const std::vector<std::uint16_t>& near = near_cell(cell);
        if (near.empty()) return p;
        const Compound::Value value = compound_.at(p, near);
        const double off = inner_surface ? inner(p, value) : value.distance;
        return p - std::clamp(off, -0.5 * cell_, 0.5 * cell_) * normal;
    }

    std::size_t index(int x, int y, int z) const {
        return (static_cast<std::size_t>(z) * size_[1] + y) * size_[0] + x;
    }
    Vec3 node(int x, int y, int z) const { return low_ + cell_ * Vec3(x, y, z); }

    void fill(int bx, int by, int bz) {
        const AlignedBox3d box(node(bx * n, by * n, bz * n),
                               node(bx * n + n - 1, by * n + n - 1, bz * n + n - 1));
        const double margin = compound_.widest_blend() + compound_.thickest_shell() + 2.0 * cell_;
        std::vector<std::uint16_t> near = compound_.parts_near(box, margin);
        if (near.empty()) return;
        constexpr int part = n / 2;
        bool used = false;
        for (int z = bz * n; z < (bz + 1) * n; z += part)
            for (int y = by * n; y < (by + 1) * n; y += part)
                for (int x = bx * n; x < (bx + 1) * n; x += part)
                    used = fill_part(x, y, z, part, near) || used;
        if (!used) return;
        near_[(static_cast<std::size_t>(bz) * blocks_[1] + by) * blocks_[0] + bx] = std::move(near);
    }

    /// Nodes of a cube; returns whether a surface may be near.
    bool fill_part(int x0, int y0, int z0, int part, const std::vector<std::uint16_t>& near) {
        const Vec3 middle = 0.5 * (node(x0, y0, z0) + node(x0 + part - 1, y0 + part - 1, z0 + part - 1));
        // Estimates of distance may be too long by a half.
        const double safe =
            1.5 * (0.5 * std::sqrt(3.0) * (part - 1) * cell_) + 0.5 * cell_ + compound_.widest_contour();
        const double distance = compound_.at(middle, near).distance;
        if (distance > safe) return false;
        const bool within = distance < -safe - compound_.thickest_shell();
        for (int z = z0; z < z0 + part; ++z) {
            for (int y = y0; y < y0 + part; ++y) {
                for (int x = x0; x < x0 + part; ++x) {
                    if (x <= 1 || y <= 1 || z <= 1 || x + 1 >= size_[0] || y + 1 >= size_[1] ||
                        z + 1 >= size_[2])
                        continue;  // closed at the border of the grid
                    const std::size_t at = index(x, y, z);
                    if (within) {
                        outer[at] = -far;
                        if (!core.empty()) core[at] = -far;
                        continue;
                    }
                    const Vec3 p = node(x, y, z);
                    const Compound::Value value = compound_.at(p, near);
                    outer[at] = static_cast<float>(value.distance);
                    if (!core.empty()) core[at] = static_cast<float>(inner(p, value));
                }
            }
        }
        return !within;
    }

    /// The distance from the surface under the shell.
    double inner(const Vec3& p, const Compound::Value& value) const {
        return value.distance +
               (value.distance < cell_ ? compound_.uneven_shell(p, value.shell) : value.shell);
    }

    /// The mean of the places where the surface crosses the cell's edges, then a step onto the surface.
    Placed place(const std::vector<float>& values, std::size_t first, const std::size_t* step,
                 const std::array<int, 3>& cell, bool core_surface) const {
        const auto value = [&](int c) {
            return values[first + (c & 1) + (c >> 1 & 1) * step[1] + (c >> 2) * step[2]];
        };
        Vec3 slope = Vec3::Zero();
        bool known = true;
        for (int c = 0; c < 8; ++c) {
            known = known && std::abs(value(c)) < far;
            for (int axis = 0; axis < 3; ++axis)
                if (!(c >> axis & 1)) slope[axis] += value(c | 1 << axis) - value(c);
        }
        const geometry::Crossings crossings = geometry::crossings_of(value);
        const Vec3 p = node(cell[0], cell[1], cell[2]) + cell_ / crossings.count * crossings.sum;
        const double steepness = slope.norm() / (4.0 * cell_);
        const Vec3 normal = known && steepness > 0.1 ? Vec3(slope.normalized()) : Vec3(Vec3::Zero());
        if (normal.isZero()) return {p, normal, cell};
        return {onto_surface(p, normal / steepness, cell, core_surface), normal, cell};
    }

    const Compound& compound_;
    double cell_;
    Vec3 low_;
    std::array<int, 3> size_{}, blocks_{};
    std::vector<std::vector<std::uint16_t>> near_;
};

}  // namespace

Surfaces polygonised(const Compound& compound, double cell) {
    Surfaces surfaces;
    if (compound.empty()) return surfaces;
    const Grid grid(compound, cell);
    surfaces.outer = grid.net(grid.outer, false);
    if (!grid.core.empty()) surfaces.core = grid.net(grid.core, true);
    return surfaces;
}

}  // namespace render::shape
