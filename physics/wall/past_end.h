#pragma once
/// The vessel past an open end of the lumen, in closed form.

#include <array>
#include <span>
#include <vector>

#include "physics/geometry/centreline_tree.h"
#include "physics/wall/wall.h"

namespace physics {

/// A round cone along an end's axis, closed by a ball at its last place and, where it has a first one, there.
/// With ρ the distance from its own axis, t the way past the end's plane and g the way past first or last,
/// the signed distance is
///     φ(√(ρ² + g²)) − (radius − narrows·(t − starts)),
/// φ(q) = q from `core` on and the quartic within that keeps the axis, on which a wedged joint lies, twice
/// continuously differentiable: φ(0) = 3/8 core. Of a joint on the axis it is thus 3/8 core more.
struct RoundCone {
    Vec3 aside = Vec3::Zero();  // from the end's axis to its own [mm]
    double radius = 0;          // at the end's plane, where the cone goes on to there [mm]
    double narrows = 0;         // of the radius per length, from
    double starts = 0;          // this t on [mm]
    double last = 0;            // t from which the ball closes it [mm]
    double first = -1e9;        // t before which the other one does [mm]
    double core = 0.5;          // [mm]

    static constexpr double on_axis =
        0.375;  // fraction of the core by which a joint there is nearer to the wall
};

/// Where closed cusps lie on each other, in diastole: what goes through parts them.
///
/// Two membranes, pressed on each other by the pressure p, bear it by their tension T = p R, R the radius of
/// their curvature. A round rod of radius a between them lifts them on both sides over √(2 R a), along arcs
/// of that radius R. Against the pressure and the tension this takes, for each length of the rod,
///     F(a) = 8/3 √2 p √R a^(3/2)   [N],
/// half for the area that is lifted and half for the membranes that are drawn in. A tip that goes through is
/// held by F, and each side presses on the rod by F′/2.
struct Seam {
    double middle = 0;     // way past the end's plane to its middle [mm]
    double half = 0;       // half its height; 0 = there is none [mm]
    double reach = 0;      // from the end's axis [mm]
    double pressure = 0;   // p, across the closed valve [N/mm²]
    double curvature = 0;  // R [mm]

    double force(double joint) const;    // F, that holds a tip [N]
    double squeeze(double joint) const;  // F′, on each length of the device [N/mm]
};

/// What lies past an end: its round cones, the first from the end's plane on.
///
/// An artery narrows over `narrows_over` radii to where a radius of `goes_in` is left for a joint on its
/// axis, and is closed there. The aortic root has three sinuses of Valsalva, whose floors are the cusps of
/// the valve; where these meet, past their seam, a hole leads into the ventricle. A sheath is a tube of its
/// own bore and length out of the vessel's rounded end.
struct RoundCones {
    static constexpr int most = 6;
    std::array<RoundCone, most> cones;
    int count = 0;
    Seam seam;

    void add(const RoundCone& cone) { cones[count++] = cone; }
    std::span<const RoundCone> all() const { return std::span(cones).first(count); }
};
RoundCones cones_past(const OpenEnd&);

/// Way past the plane of a root to the cusps' lowest places [mm].
double floor_of_root(const OpenEnd&);

/// An end with what lies past it.
struct ContinuedEnd {
    OpenEnd end;
    RoundCones cones;
};
std::vector<ContinuedEnd> continued_ends(std::span<const OpenEnd>);

/// Radius of the vessel at a place past an end's plane: an artery narrows; in a sheath, which is no vessel,
/// 0. Infinity for a place before the plane, or farther from the end's axis than its radius [mm].
double radius_past(const OpenEnd&, const Vec3&);

/// Past the plane of an open end the wall passes, over one radius (in an aorta's root a third of that), from
/// the lumen's own section to that of cones_past(). Several cones are one vessel, d = −h ln Σ exp(−dᵢ/h). The
/// way past the plane and past the last place of a cone starts smoothly, so that energy and force have no
/// step. The slope of d is at most 1 + narrows, and less than 1 only in the core, where the forces of the
/// walls around oppose each other: a wedged joint holds k·pen·narrows along the axis, which is what
/// frictionless walls at that angle would.
class PastEnd {
public:
    /// Of an artery, in radii of its end: the middle of the tissue that it supplies, as the image draws it
    /// (estimate).
    static constexpr double narrows_over = 14;
    /// A wire of 0.35 mm (0.028 inch) radius goes no farther; those of 0.014 and 0.018 inch reach the closed
    /// tip [mm].
    static constexpr double goes_in = 0.3;
    static constexpr double rounding = 0.2;  // h, of what two cones leave between them [mm]

    /// `at`: indices of the ends that x may lie past; `spacing` of the field that knows the lumen's section,
    /// 0 for a wall that has none [mm].
    PastEnd(const Vec3& x, std::span<const ContinuedEnd> ends, std::span<const int> at, double spacing);

    bool inside() const { return past_ <= 0; }
    /// Whether the lumen's own section no longer counts.
    bool alone() const { return past_ >= passing_; }
    /// The place in the lumen's field whose wall counts for x.
    Vec3 seen_at(const Vec3& x) const { return x - (past_ - kept_) * end_->end.outward_normal; }
    /// Turns the contact of seen_at(x), for a joint of this radius, into that of x. `known`: depth of the
    /// joint inside the lumen to which that contact has a normal [mm].
    void apply(const Vec3& x, double joint, double known, WallContact&) const;
    /// Adds to the contact of x what it costs a joint that stands for this length of the chain to part closed
    /// cusps [mm]. The energies add up, and so do the forces by which wall and cusps press on the surface;
    /// penetration and stiffness are those of one spring with that energy and force.
    void part_cusps(const Vec3& x, double joint, double joint_length, WallContact&) const;
    /// Takes back, from the promise of a joint before the plane, what the vessel past it does not keep.
    void limit(const Vec3& x, double joint, WallContact&) const;

private:
    struct Depth {
        double value;
        Vec3 slope;
        Mat3 curve;
        double steepest;  // bound of the slope anywhere
    };
    Depth depth(const Vec3& x) const;
    void flatten(double known, WallContact&) const;

    const ContinuedEnd* end_ = nullptr;        // the one that x is farthest past, or nearest to
    double past_ = -1e9;                       // its plane [mm]
    double passing_ = 1;                       // way over which the lumen's section becomes round [mm]
    double kept_ = 0, slope_ = 1, curve_ = 0;  // of `past_` in the field, and its derivatives
};

}  // namespace physics
