#pragma once
/// How fine a wire, which wall and which shafts the vessels need, why, and what is left out.

#include <string>

#include "engine/anatomy/anatomy.h"
#include "engine/scenario/reach.h"
#include "engine/scenario/scenario.h"
#include "physics/wire/torsion.h"

namespace scenario {

/// What is chosen once, before a device moves.
struct ModelChoice {
    double segment_length = 0;         // λ [mm]
    std::string segment_reason;        // one sentence
    WallModel wall = WallModel::Auto;  // that is left where no smooth wall is possible
    std::string wall_reason;           // one sentence
    LumenDemand demand;                // of the vessels that devices can reach
};

/// λ is the longest segment that sags by no more than the tolerance [mm] from the sharpest bend of the
/// vessels and of the wire's unloaded tip, and is no longer than the smallest radius; it is within 0.2 to 5
/// mm, and the curved tip is a whole number of segments. Vessels are those of `within`. The wall is
/// in closed form where `closed_form` says there is one, else a distance field where its grid resolves the
/// narrowest vessel and fits in memory; `thickest` is the radius of the thickest device [mm], 0 = the wire.
ModelChoice choose_model(const anatomy::Anatomy&, const Reach&, const LumenDemand& within, const Device& wire,
                         double curve_tolerance, bool closed_form, double thickest = 0);
/// The same for all vessels.
ModelChoice choose_model(const anatomy::Anatomy&, const Device& wire, double curve_tolerance,
                         bool closed_form, double thickest = 0);

/// What the shaft of a device could do where it is and where it comes to next: the errors of the models that
/// leave it out.
struct TorsionNeed {
    double shaft = 0;      // that twists: what is inside, and what is between introducer and hand [mm]
    double winds_up = 0;   // by the vessels, at most; left out by a rigid shaft [rad]
    double held_back = 0;  // by friction, at most; left out by all but one of segments [rad]
    double arm = 0;        // of the distal end from the shaft's axis, unloaded, within the lumen [mm]
    LumenDemand within;

    /// That the model leaves out [rad].
    double left_out(physics::Torsion) const;
    /// How far the distal end is off for it, unless it snaps [mm].
    double at_tip(double angle) const;
};

/// What a chain knows of a shaft at rest.
struct ShaftState {
    double inserted = 0, outside = 0;  // [mm]
    double torque = 0;                 // against which its hub is held [N·mm]
    double held_back = 0;              // by the grips that there are: physics::held_back() [rad]
    double wound_up = 0;               // turn of its hub that has not reached the distal end [rad]
    physics::Torsion now = physics::Torsion::Rigid;
};

/// A shaft winds up by the torque that it has now, or by that of the sharpest bend within reach on its
/// curved tip, whichever is more. It is held back by what holds it now and by friction in that bend, on the
/// part of it that can be there next.
TorsionNeed torsion_need(const Device&, const ShaftState&, const LumenDemand& within);

/// The least model that leaves out no more than torsion_shows, or than shows at the tip. What is in use is
/// left for a lesser one only where that leaves out, and now is wound up by, less than half of it: so that
/// shafts do not change back and forth.
physics::Torsion least_torsion(const TorsionNeed&, const ShaftState&);
constexpr double torsion_shows = 2 * geometry::degree, torsion_shows_at_tip = 0.1;  // [rad], [mm]

/// "turns with its hub at once: …, which leaves out up to …".
std::string torsion_sentence(const TorsionNeed&, physics::Torsion);

}  // namespace scenario
