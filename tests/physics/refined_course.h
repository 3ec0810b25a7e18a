#pragma once
/// A random tube whose chain keeps a stated error of the tip from push to push.

#include "physics/relax/error_refinement.h"
#include "tests/physics/random_tube.h"

class RefinedCourse {
public:
    RefinedCourse(std::uint64_t seed, double tolerance) : tube(seed, {.tip_segments = 1, .pushed = false}) {
        keep(tolerance);
    }

    void keep(double tolerance) {
        refinement.emplace(*tube.wall, physics::ErrorRefinementOptions{.tolerance = tolerance});
    }

    /// Feeds `tube.hand` and refines.
    void push() {
        const double before = io::thread_cpu_seconds();
        tube.push_all(tube.hand);
        refine();
        seconds += io::thread_cpu_seconds() - before;
    }

    /// Rounds and rests until nothing changes, as an exercise's frame has them.
    void refine() {
        constexpr int most_rounds = 6, unlimited = 1'000'000'000;
        last = {};
        for (int round = 0; round < most_rounds && tube.at_rest; ++round) {
            last = refinement->round(tube.chain, physics::all_contacts(tube.chain, *tube.wall), round == 0);
            updates += last.updates;
            if (!last.changed()) return;
            split += last.split, merged += last.merged;
            const physics::RelaxReport rest = tube.hub->settle(tube.chain, unlimited).relax;
            updates += rest.updates;
            tube.at_rest = rest.strict_minimum();
        }
    }

    long long all_updates() const { return updates + tube.updates_of_pushes; }

    RandomTube tube;
    std::optional<physics::ErrorRefinement> refinement;
    physics::ErrorRefinementRound last;  // its estimate is of the chain as it is unless it has changed that
    int split = 0, merged = 0;
    long long updates = 0;  // of estimates, and of rests after changes
    double seconds = 0;     // of everything
};
