#pragma once
/// A scenario in its anatomy: its open choices, where the devices come in, its target, its wall.

#include <memory>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/model_cache.h"
#include "engine/scenario/model_choice.h"
#include "engine/scenario/scenario.h"
#include "physics/wall/foundation.h"
#include "physics/wall/wall.h"

namespace scenario {

/// Fills in what the scenario leaves open and does not change in an attempt: the segment length, the wall's
/// model; the wall keeps its stiffness per length of wire. Returns what was found,
/// asked for or not.
ModelChoice choose(Scenario&, const anatomy::Anatomy&, const Reach&);

/// The way in from the entry's end. Throws InputError for an end that does not exist, a device that does not
/// enter there, and too much of a device or too little wire inside.
anatomy::EntryPath entry_of(const Scenario&, const anatomy::Anatomy&);

/// The middle of the target [mm]. Throws InputError for a target that does not exist or lies outside.
geometry::Vec3 target_of(const Scenario&, const anatomy::Anatomy&);

/// What a scenario's vessels lie in, one a branch; empty where they stay where they are. Throws InputError
/// for a vessel that the anatomy does not have.
std::vector<physics::Tissue> tissues_of(const Scenario&, const anatomy::Anatomy&);
/// The same of vessels that stay only because the scenario says so.
std::vector<physics::Tissue> tissues_that_could_move(const Scenario&, const anatomy::Anatomy&);
/// Whether devices can push the vessels aside: as [tissue] says; without one, as could_move(). When they do,
/// where [tissue] says nothing, is decided as the devices go.
bool vessels_move(const Scenario&);
/// Vessels of an anatomy with a smooth wall could, by the global relaxer, which alone knows how.
bool could_move(const Scenario&);

/// The wall of a scenario with nothing left to choose: the one that others in this process have, where there
/// is one, for nobody changes it.
std::shared_ptr<const physics::LumenWall> wall_of(const Scenario&, const anatomy::Anatomy&,
                                                  const anatomy::ModelCache& = {});

}  // namespace scenario
