#pragma once
/// The rivals' own wall: a tube of constant radius around straight runs, arcs and helices, in closed form. It
/// shares no code with physics/wall.

#include <Eigen/Geometry>
#include <vector>

namespace rivals {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// A piece of the centreline: the heading turns steadily by `angle` about `axis` over `length`.
struct Piece {
    double length = 0;          // [mm]
    double angle = 0;           // right-handed [rad]; 0 = straight
    Vec3 axis = Vec3::UnitZ();  // any length; not perpendicular to the heading makes a helix
};

/// What the wall answers a point.
struct Touch {
    double depth = 0;               // outside the lumen, > 0 where the wall pushes back [mm]
    Vec3 normal = Vec3::Zero();     // ∇ depth, out of the lumen
    Mat3 curvature = Mat3::Zero();  // ∇² depth [1/mm]
};

/// The lumen is the set of points within `radius` of the centreline, which leaves the origin along +x.
class Tube {
public:
    /// Throws std::invalid_argument where there is no piece, a length is not positive, a number is not
    /// finite, or the radius is not positive.
    Tube(const std::vector<Piece>& pieces, double radius);

    double radius() const { return radius_; }  // [mm]
    double length() const { return total_; }   // of the centreline [mm]
    Vec3 point(double way) const;              // of the centreline, 0 ≤ way ≤ length()

    /// The way along the centreline of its point nearest to x, of all points [mm].
    double nearest_way(const Vec3& x) const;
    /// Follows the nearest point from `way`, which must be near, and updates it. The curvature is computed
    /// only where it is asked for.
    Touch touch(const Vec3& x, double& way, bool with_curvature) const;

private:
    /// c(s) = start + along·s + (sin ωs/ω) across + ((1 − cos ωs)/ω) beside.
    struct Curve {
        double from = 0, length = 0, turn = 0;  // way of its start [mm], [mm], ω [rad/mm]
        Vec3 start, along, across, beside;      // parts of the heading along and across the axis
    };
    struct Place {
        Vec3 point, heading, bend;  // c, c', c''
    };
    static Place place(const Curve&, double s);
    const Curve& curve_at(double way) const;

    std::vector<Curve> curves_;
    double radius_, total_ = 0;
};

}  // namespace rivals
