#pragma once
/// Closest points of the triangles that a place in the vessels sees.

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "physics/geometry/lumen_surface.h"

namespace geometry {

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

    /// The triangle closest to x among those that are seen, -1 when none is. `seed` is a triangle likely to
    /// be near, -1 = none; it bounds the search.
    NearestTriangle nearest(const Vec3& x, int seed, const SeenStations&) const;

    /// The seen triangles closest to any point of a ball, for many questions near one place.
    class Patch {
    public:
        /// Gathers them for all points within `reach` of the centre [mm].
        void gather(const SeenSurface&, const Vec3& centre, double reach, int seed, const SeenStations&);
        /// Gathers them for a ball inside that of the other patch, which must not be empty.
        void gather(const Patch&, const Vec3& middle, double reach);
        bool empty() const { return lanes_.empty(); }
        /// Gives the answer of SeenSurface::nearest. The patch must not be empty.
        NearestTriangle nearest(const Vec3& x) const { return nearest(x, 0); }

    private:
        friend class SeenSurface;
        /// Some triangles and their discs, relative to the centre; lanes without a triangle are far away.
        static constexpr int lane_count = 4;
        struct Lanes {
            using Column = Eigen::Array<float, lane_count, 1>;
            Column x, y, z, normal_x, normal_y, normal_z, radius;
            std::array<int, lane_count> triangle;
            /// Square distances to the discs.
            Column square_distances(const Eigen::Vector3f& from) const {
                const Column dx = from.x() - x, dy = from.y() - y, dz = from.z() - z;
                const Column height = dx * normal_x + dy * normal_y + dz * normal_z;
                const Column height2 = height * height;
                const Column beside2 = (dx * dx + dy * dy + dz * dz - height2).max(0.0f);
                const Column beside = (beside2.sqrt() - radius).max(0.0f);
                return height2 + beside * beside;
            }
        };
        struct Candidate {
            float square;  // of the distance from the middle of the ball to the disc
            int which;
        };
        /// Takes the candidates, those with discs nearer to the middle first: put(which, lanes, lane).
        template <class Put>
        void take(const Vec3& middle, const NearestTriangle&, const Put& put);
        /// Leaves in `distances_` the bounds of all triangles that may lie within the nearest distance plus
        /// `more` [mm] of x.
        NearestTriangle nearest(const Vec3& x, double more) const;

        const SeenSurface* surface_ = nullptr;
        Vec3 centre_ = Vec3::Zero();
        Vec3 middle_ = Vec3::Zero();  // of the ball
        int middle_triangle_ = -1;    // nearest to it
        double far_ = 0;              // from the middle of the ball to the farthest disc that counts [mm]
        double rounding_ = 0;         // of square distances in single precision, and more [mm²]
        std::vector<Lanes> lanes_;
        std::vector<float> square_;  // of each: no disc is nearer to the middle, nor are those that follow
        std::vector<Candidate> candidates_;             // scratch
        mutable std::vector<Lanes::Column> distances_;  // square, of the first lanes
    };

private:
    struct Search;
    struct Scene;

    /// A disc around the centroid that holds the triangle; a ball where the triangle is too thin to have a
    /// normal, which is then zero.
    struct Disc {
        Vec3 centre, normal;
        double radius;
        /// A lower bound of the square distance to the triangle, save for rounding [mm²].
        double square_distance(const Vec3& x) const;
    };

    const LumenSurface& surface_;
    std::vector<Disc> discs_;
    std::unique_ptr<Scene> scene_;
};

}  // namespace geometry
