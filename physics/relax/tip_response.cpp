#include "physics/relax/tip_response.h"

#include <algorithm>
#include <cmath>

#include "physics/relax/contact_set.h"
#include "physics/relax/newton_model.h"

namespace physics {

std::optional<Vec3> tip_response(const LumenWall& wall, const Chain& changed) {
    if (changed.segments() < 2) return {};
    Chain chain = changed;  // shafts that wind up turn in it
    ContactSet contacts(wall);
    contacts.reset(chain);
    NewtonModel model;
    if (chain.bent_segments() > 0) {
        model.directors.resize(chain.joints.size());
        model.directors[0] = chain.base_director;
    }
    double stiffest = 0;
    for (int j = 0; j < chain.segments(); ++j) stiffest = std::max(stiffest, chain.spring_constant(j));
    constexpr double pivot_fraction = 1e-6;
    model.least_pivot = pivot_fraction * stiffest;
    model.start(chain, contacts);
    if (model.linearise(chain, contacts, 1, 0).shifted > 0) return {};
    if (!std::isfinite(model.roll_out(chain))) return {};
    return model.trial_tip() - chain.tip();
}

}  // namespace physics
