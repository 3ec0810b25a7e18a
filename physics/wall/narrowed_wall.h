#pragma once
/// A vessel wall with narrower tubes in its lumen, as an artery in spasm or a flap of a dissected wall leaves
/// them. The tubes may change between two rests; while one is sought they stand.

#include <memory>
#include <span>
#include <vector>

#include "physics/wall/wall.h"

namespace physics {

/// A tube in the lumen of one vessel. Its axis and all that is known at its samples are means of the samples
/// around a place, weighted by Gaussians of the distance from the vessel's axis, so that the depth of a joint
/// in the tube's wall is twice continuously differentiable, also where the axis bends.
struct Narrowing {
    static constexpr double spacing = 1;  // of the samples, and σ of their weights [mm]
    struct Sample {
        Vec3 at = Vec3::Zero();     // on the vessel's axis, by which places are weighted [mm]
        Vec3 aside = Vec3::Zero();  // from there to the tube's axis [mm]
        double radius = 0;          // of the tube [mm]
        /// From there to the vessel's wall: past it the tube ends, so that side branches stay open [mm].
        double lumen = 0;
        double shear = 0;     // that what fills the tube bears before it slips on a device [N/mm²]
        double pressure = 0;  // of a tube that would be narrower than the device in it [N/mm²]
        double gives = 0;     // by which a device may widen the tube's radius where it comes to it [mm]
        double wider = 0;  // than the vessel's, by which the lumen is in the image; devices do not know [mm]

        bool operator==(const Sample&) const = default;
        void state(StateStream& s) { s(at, aside, radius, lumen, shear, pressure, gives, wider); }
    };
    std::vector<Sample> samples;  // `spacing` apart along the vessel, with open ones past both ends

    /// Depth of a joint of that radius in the tube, with its derivatives; false where the tube is not.
    /// `free`: at least so far from where it is [mm].
    struct Depth {
        double value = 0;
        Vec3 gradient = Vec3::Zero();
        Mat3 hessian = Mat3::Zero();
        double radius = 0, free = 0;
    };
    bool depth(const Vec3& x, double joint, Depth&) const;
    /// How far a place on the vessel's wall lies outside the tube, and the way in; outward where it is wider
    /// [mm].
    Vec3 inward(const Vec3& x) const;
    /// Shear and pressure there [N/mm²].
    std::pair<double, double> holds_with(const Vec3& x) const;
};

class NarrowedWall final : public LumenWall {
public:
    /// `wire_radius`: the one that the wall takes off its lumen [mm].
    NarrowedWall(std::shared_ptr<const LumenWall>, double wire_radius);

    const std::shared_ptr<const LumenWall>& vessels() const { return vessels_; }
    double wire_radius() const { return wire_radius_; }
    /// What is asked from now on is asked of vessels with these tubes.
    void narrow(std::vector<Narrowing>);
    std::span<const Narrowing> narrowings() const { return narrowings_; }
    /// The farthest way into a tube of a place on the wall; 0 where none stands in its way [mm].
    Vec3 inward(const Vec3&) const;
    /// Radius of the narrowest tube around a place, with what it gives; infinity where there is none [mm].
    double narrowest(const Vec3&) const;

    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override;
    bool same_vessel(int a, int b) const override { return vessels_->same_vessel(a, b); }
    bool smooth() const override { return vessels_->smooth(); }
    void apply_stiffness(const Vec3& x, WallContact& c) const override { vessels_->apply_stiffness(x, c); }
    double holds(const Vec3& x, double radius, double friction) const override;

private:
    struct Ball {
        Vec3 centre = Vec3::Zero();
        double radius = 0;  // [mm]
    };
    void stand_in(const Narrowing&, const Vec3&, WallContact&) const;

    std::shared_ptr<const LumenWall> vessels_;
    double wire_radius_;
    std::vector<Narrowing> narrowings_;
    std::vector<Ball> balls_;  // around each
};

}  // namespace physics
