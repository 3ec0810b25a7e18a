#pragma once
/// The inside of a lumen as voxels, and the paths through them that keep to the middle.

#include <cstdint>
#include <span>
#include <vector>

#include "physics/geometry/mesh_query.h"

namespace anatomy {

class LumenVoxels {
public:
    /// Voxels of this size [mm] whose centres lie inside, determined by the signed crossings of a closed mesh
    /// along columns: a centre that is inside along two of the three axes is inside.
    LumenVoxels(const geometry::TriangleMesh& closed, double size);

    /// The number of voxels of this size in the box around the mesh.
    static double box_count(const geometry::TriangleMesh&, double size);

    double size() const { return size_; }                          // [mm]
    int count() const { return static_cast<int>(place_.size()); }  // of the inside voxels
    geometry::Vec3 centre(int voxel) const;                        // [mm]
    int nearest(const geometry::Vec3&) const;                      // -1 when there is none
    /// Calls visit(voxel, steps) for the inside neighbours, which differ along steps = 1, 2 or 3 axes.
    template <class Visit>
    void neighbours(int voxel, Visit visit) const {
        const Place p = place_[voxel];
        for (int dz = -1; dz <= 1; ++dz)
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) {
                    const int steps = dx * dx + dy * dy + dz * dz;
                    const int other = steps == 0 ? -1 : index(p[0] + dx, p[1] + dy, p[2] + dz);
                    if (other >= 0) visit(other, steps);
                }
    }
    /// Calls visit(voxel) for every voxel whose centre lies inside a ball.
    template <class Visit>
    void ball(const geometry::Vec3& centre, double radius, Visit visit) const {
        std::array<int, 3> low, high;
        for (int k = 0; k < 3; ++k) {
            low[k] = static_cast<int>(std::ceil((centre[k] - radius - origin_[k]) / size_));
            high[k] = static_cast<int>(std::floor((centre[k] + radius - origin_[k]) / size_));
        }
        for (int z = low[2]; z <= high[2]; ++z)
            for (int y = low[1]; y <= high[1]; ++y)
                for (int x = low[0]; x <= high[0]; ++x)
                    if (const int i = index(x, y, z);
                        i >= 0 && (this->centre(i) - centre).squaredNorm() <= radius * radius)
                        visit(i);
    }

    /// Distance of every voxel to the wall [mm], accurate to about a tenth of itself: measured along rows in
    /// steps that grow with it, linear in between.
    std::vector<float> distances(const geometry::MeshQuery& wall, int threads) const;

private:
    using Place = std::array<std::int16_t, 3>;
    /// Index of a voxel, −1 outside.
    int index(int x, int y, int z) const {
        if (x < 0 || y < 0 || z < 0 || x >= dims_[0] || y >= dims_[1] || z >= dims_[2]) return -1;
        const std::size_t bit = (static_cast<std::size_t>(z) * dims_[1] + y) * dims_[0] + x;
        const std::uint64_t word = inside_[bit / 64], mask = std::uint64_t{1} << bit % 64;
        if (!(word & mask)) return -1;
        return before_[bit / 64] + __builtin_popcountll(word & (mask - 1));
    }
    std::vector<std::uint64_t> sweep(const geometry::TriangleMesh&, int axis) const;

    geometry::Vec3 origin_;
    double size_;
    std::array<int, 3> dims_;
    std::vector<std::uint64_t> inside_;  // a bit for each voxel of the box
    std::vector<int> before_;            // inside voxels before each word
    std::vector<Place> place_;           // of the inside voxels, in order
};

/// Cheapest paths from a root to every voxel, where a step costs its length divided by the squared distance
/// to the wall.
struct VoxelPaths {
    std::vector<int> from;      // the previous voxel, -1 at the root and where there is no path
    std::vector<float> length;  // from the root, infinite where there is no path [mm]

    bool reached(int voxel) const { return length[voxel] < 1e30f; }
    /// The path from `voxel` back to the root.
    std::vector<int> path(int voxel) const;
};
VoxelPaths cheapest_paths(const LumenVoxels&, std::span<const float> distances, int root);

/// A voxel that takes the most steps to reach from this one.
int most_steps_from(const LumenVoxels&, int root);

}  // namespace anatomy
