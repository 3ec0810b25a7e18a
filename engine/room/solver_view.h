#pragma once
/// The devices in the vessels, and what the solver did for them: for who looks into the patient.

#include <optional>
#include <vector>

#include "engine/exercise/simulation.h"

namespace room {

/// The devices as the solver left them, for the view into the patient.
struct SolverView {
    std::vector<geometry::Vec3> joints;             // [mm]
    std::vector<float> radii;                       // of what lies outermost there [mm]
    std::vector<physics::WallContact> contacts;     // of the joints
    geometry::Vec3 shift = geometry::Vec3::Zero();  // of vessels and wire in the patient [mm]
    std::vector<Eigen::Vector3f> lumen_moves;       // of its vertices, pushed aside; empty = none [mm]
    physics::RelaxReport relax;
    exercise::Tuning tuning;             // the tuning it was moved with
    std::optional<double> error;         // largest distance of a joint from where it comes to rest [mm]
    double motion_ms = 0, image_ms = 0;  // taken by this frame
    double frame_ms = 0;                 // time available for a frame
};

/// The state after the simulation's last frame; its times are zero. `relax` is the report of that frame. For
/// the `error`, if it is wanted, the fast solver brings a copy of the wire to rest.
SolverView solver_view(const exercise::Simulation&, const physics::RelaxReport& relax, bool error = true);

}  // namespace room
