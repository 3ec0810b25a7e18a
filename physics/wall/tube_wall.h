#pragma once
/// The wall of a tube of constant radius around a polyline, in closed form: the reference that meshes are
/// tested against and the wall of the paper's scenes.

#include <array>
#include <span>
#include <vector>

#include "physics/wall/past_end.h"
#include "physics/wall/wall.h"
#include "physics/wall/wall_stiffness.h"

namespace physics {

/// The lumen is the set of points within `radius` of the polyline; the wire's radius is subtracted from it.
/// Past an end that is stated the vessel goes on as PastEnd says; the ends of a tube without any are the
/// balls of that set, which closed forms know.
class TubeWall final : public LumenWall {
public:
    /// stiffness: k per joint [N/mm]. Throws std::invalid_argument for fewer than two points, repeated or
    /// non-finite points, or a radius not larger than the wire's.
    TubeWall(Polyline centreline, double radius, WallStiffness stiffness, double wire_radius = 0.0,
             std::span<const OpenEnd> ends = {});

    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override;

    const Polyline& centreline() const { return centreline_; }
    double radius() const { return radius_; }

private:
    WallContact contact(const Vec3& joint, int hint, double thickness) const;
    void ask_tube(const Vec3& joint, double radius, WallContact&) const;
    std::span<const int> ends_at(int segment) const;
    static Mat3 curvature(const Vec3& along, const Vec3& normal, double distance, bool corner);
    int closest_segment(const Vec3& joint, int hint) const;

    /// Ball around a run of segments, so that a search without a hint skips most of them.
    struct Ball {
        Vec3 centre;
        double radius;
    };
    Polyline centreline_;
    std::vector<Ball> balls_;
    double radius_;
    WallStiffness stiffness_;
    double wire_radius_;
    std::vector<double> arc_lengths_;  // of the points, where the stiffness is not uniform [mm]
    std::vector<ContinuedEnd> ends_;
    /// Indices of the ends that a joint may lie past at no end, near the tube's start, its finish, or both.
    std::array<std::vector<int>, 4> near_;
    int until_ = -1, from_ = 0;  // the last segment near its start and the first near its finish
};

}  // namespace physics
