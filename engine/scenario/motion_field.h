#pragma once
/// Where heartbeat and breath carry each place of the vessels, and the heart's wall with them.

#include <optional>

#include "engine/blood/blood_flow.h"
#include "engine/scenario/breathing.h"
#include "physics/geometry/vec.h"

namespace scenario {

/// Of the vessels as they lie at the end of diastole and of expiration, in which the wire's equilibrium is
/// found; only images see the displacement. Vessels without a heart move as one.
///
/// Heart: its base goes by VesselMotion::heart_reach toward the apex, which stays behind, while the ventricle
/// narrows and twists; what is next to the heart follows it less and less. So a coronary artery goes with the
/// wall that it lies on, and the tip of a catheter that the arch holds bobs in a mouth that moves.
/// Breath: the heart lies on the diaphragm and goes by VesselMotion::breathing_reach; the aorta away from it,
/// which spine and neck hold, goes by a third.
class MotionField {
public:
    /// The heart lies where the blood's outlets in the heart are.
    MotionField(const VesselMotion&, const blood::BloodFlow&);

    /// [mm]; `beat`: contraction() [-], `breath`: fraction of a quiet inspiration [-].
    geometry::Vec3 at(const geometry::Vec3&, double beat, double breath) const;
    /// At the end of systole [mm].
    geometry::Vec3 systole_at(const geometry::Vec3&) const;
    /// Whether it is the same everywhere.
    bool rigid() const {
        return !heart_ || (motion_.heart_reach.isZero() && motion_.breathing_reach.isZero());
    }

private:
    struct Heart {
        geometry::Vec3 base, middle;  // of the coronary arteries' origin and of all of them [mm]
    };
    double following(const geometry::Vec3&) const;
    VesselMotion motion_;
    std::optional<Heart> heart_;
};

}  // namespace scenario
