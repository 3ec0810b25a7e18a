#pragma once
/// How far a simulation's tip is off by what its models leave out or get wrong.

#include <optional>

#include "engine/exercise/simulation.h"
#include "physics/relax/response.h"

namespace exercise {

/// How far the foremost tip is, to first order, from where it would be without what a model leaves out or
/// gets wrong; empty where there is no such error, or no estimate of it [mm].
struct ModelErrors {
    std::optional<double> wall;      // by the wall's field, against the mesh of the lumen
    std::optional<double> wall_off;  // the most that this field is off where a joint touches
    std::optional<double> vessels;   // by vessels that stay, though they would make way
    /// By the twist that the torque now makes of shafts that are rigid; not by what friction holds back.
    std::optional<double> twist;
};

/// By the response of the tip with grips that slide, as they do on the way (docs/solver.md, section 14). Made
/// anew by each call, at the cost of a part of a push.
ModelErrors model_errors(const Simulation&);
/// The same of twist alone.
std::optional<double> twist_error(const Simulation&, const physics::Response&);

/// The response of the wire shown; empty unless it is a strict minimum. The simulation must outlive it.
std::optional<physics::Response> response_of(const Simulation&, physics::Grips);

}  // namespace exercise
