#pragma once
/// Where a wire at rest goes to first order when its hub is moved.

#include "physics/relax/iterate.h"
#include "physics/relax/relaxer.h"

namespace physics {

/// What a prediction has done.
struct Prediction {
    bool made = false;  // the wire has moved, by its answer or by sliding on; else it is as it was
    int updates = 0;    // charged
    int changed = 0;    // distal segments that move the most; 0 = not known
};

/// Moves a wire that is at rest at the iterate, with these contacts, by its whole first-order answer to the
/// motion, wall and twist included: this is far nearer its new rest than where it would merely slide on.
/// Where the answer goes farther than the model is good for, less of the motion is made; `motion` becomes
/// what was made. `push_force` is that of the rest [N]. The iterate then has foreseen the contacts' forces.
Prediction predict(Iterate&, ContactSet&, Chain&, HubMotion& motion, double push_force, int most_updates,
                   const GlobalOptions&);

}  // namespace physics
