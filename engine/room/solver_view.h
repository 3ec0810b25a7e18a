#pragma once
/// The wire as the solver left it, for whoever looks into the patient.

#include <vector>

#include "engine/exercise/simulation.h"

namespace room {

struct SolverView {
    std::vector<geometry::Vec3> joints;             // [mm]
    std::vector<physics::WallContact> contacts;     // of the joints
    geometry::Vec3 shift = geometry::Vec3::Zero();  // of vessels and wire in the patient [mm]
    physics::RelaxReport relax;
    exercise::Tuning tuning;             // by which it was moved
    double error = 0;                    // of a joint from where it comes to rest, the largest [mm]
    double motion_ms = 0, image_ms = 0;  // that this frame took
    double frame_ms = 0;                 // time that a frame has
};

/// What the simulation's last frame left; its times are zero. `relax` is the report of that frame. Brings a
/// copy of the wire to rest by the fast solver to measure `error`.
SolverView solver_view(const exercise::Simulation&, const physics::RelaxReport& relax);

}  // namespace room
