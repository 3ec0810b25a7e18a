#pragma once
/// Closest points of the triangles that a place in the vessels sees.

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "physics/lumen_surface.h"

namespace physics {

struct NearestTriangle {
    int triangle = -1;
    TrianglePoint at;
};

/// Which triangles count: those whose station is seen.
struct SeenStations {
    const std::vector<char>& seen;  // per station
    const std::vector<int>& station_of_triangle;
    bool operator()(int triangle) const { return seen[station_of_triangle[triangle]] != 0; }
};

class SeenSurface {
public:
    /// Keeps a reference to the surface.
    explicit SeenSurface(const LumenSurface&);
    ~SeenSurface();

    /// The triangle closest to x among those that are seen, -1 when none is. `seed`: a triangle that is
    /// likely to be near, -1 = none; it bounds the search.
    NearestTriangle nearest(const Vec3& x, int seed, const SeenStations&) const;

    /// The seen triangles closest to any point of a ball, for many questions near one place.
    class Patch {
    public:
        /// Of all points within `reach` of the centre [mm].
        void gather(const SeenSurface&, const Vec3& centre, double reach, int seed, const SeenStations&);
        /// Of a ball within that of the other patch, which is not empty.
        void gather(const Patch&, const Vec3& middle, double reach);
        bool empty() const { return count_ == 0; }
        /// What SeenSurface::nearest answers. Not empty.
        NearestTriangle nearest(const Vec3& x) const;

    private:
        friend class SeenSurface;
        /// Four triangles and the discs around them, from the centre; where there are none, far away.
        struct Four {
            using Column = Eigen::Array4f;
            Column x, y, z, normal_x, normal_y, normal_z, radius;
            std::array<int, 4> triangle;
            /// As that of a disc.
            Column square_distance(const Eigen::Vector3f& from) const {
                const Column dx = from.x() - x, dy = from.y() - y, dz = from.z() - z;
                const Column height = dx * normal_x + dy * normal_y + dz * normal_z;
                const Column height2 = height * height;
                const Column beside2 = (dx * dx + dy * dy + dz * dz - height2).max(0.0f);
                const Column beside = (beside2.sqrt() - radius).max(0.0f);
                return height2 + beside * beside;
            }
        };
        void add(int triangle);
        void add(const Four&, int which);

        const SeenSurface* surface_ = nullptr;
        Vec3 centre_ = Vec3::Zero();
        double far_ = 0;       // from the middle of the ball to the farthest disc that counts [mm]
        double rounding_ = 0;  // of square distances in single precision, and more [mm²]
        int count_ = 0;
        std::vector<Four> fours_;
        mutable std::vector<Four::Column> distances_;  // scratch
    };

private:
    struct Search;
    struct Gathering;
    struct Scene;

    /// A disc around the centroid that holds the triangle; a ball where the normal is zero, for the triangle
    /// is too thin to have one.
    struct Disc {
        Vec3 centre, normal;
        double radius;
        /// No more than the square distance to the triangle, save for rounding [mm²].
        double square_distance(const Vec3& x) const;
    };

    const LumenSurface& surface_;
    std::vector<Disc> discs_;
    std::unique_ptr<Scene> scene_;
};

}  // namespace physics
