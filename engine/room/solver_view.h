#pragma once
/// The wire as the solver left it, for the view into the patient.

#include <vector>

#include "engine/exercise/simulation.h"

namespace room {

struct SolverView {
    std::vector<geometry::Vec3> joints;             // [mm]
    std::vector<physics::WallContact> contacts;     // of the joints
    geometry::Vec3 shift = geometry::Vec3::Zero();  // of vessels and wire in the patient [mm]
    physics::RelaxReport relax;
    exercise::Tuning tuning;             // the tuning it was moved with
    double error = 0;                    // largest distance of a joint from where it comes to rest [mm]
    double motion_ms = 0, image_ms = 0;  // taken by this frame
    double frame_ms = 0;                 // time available for a frame
};

/// The state after the simulation's last frame; its times are zero. `relax` is the report of that frame. To
/// measure `error`, the fast solver brings a copy of the wire to rest.
SolverView solver_view(const exercise::Simulation&, const physics::RelaxReport& relax);

}  // namespace room
