#pragma once
/// An exercise under a wild hand, and the same again from a snapshot.

#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "engine/exercise/exercise.h"
#include "physics/wire/energy.h"

namespace test {

/// `hand` makes a frame's commands of the generator. Every frame that is not on its way ends at rest, the
/// wire is whole, and 20 frames more have the same states when they are played again.
template <class Hand>
void play_wildly_and_again(exercise::Exercise& exercise, unsigned seed, const Hand& hand) {
    std::mt19937 random(seed);
    for (int frame = 0; frame < 60; ++frame) {
        SCOPED_TRACE("seed " + std::to_string(seed) + ", frame " + std::to_string(frame));
        const exercise::Frame made = exercise.next_frame(hand(random));
        const physics::Chain& wire = made.simulation.wire();
        ASSERT_TRUE(physics::validate(wire).empty());
        ASSERT_EQ(wire.grips.size(), wire.joints.size());
        if (!made.motion.settling) {
            ASSERT_LT(physics::relative_gradient(wire, made.simulation.contacts()), 1e-6);
        }
    }
    const exercise::Exercise::Snapshot snapshot = exercise.snapshot();
    std::vector<std::uint64_t> hashes;
    for (const bool again : {false, true}) {
        if (again) exercise.restore(snapshot);
        std::mt19937 more(100 + seed);
        for (int frame = 0; frame < 20; ++frame) {
            exercise.next_frame(hand(more));
            if (!again)
                hashes.push_back(exercise.simulation().state_hash());
            else
                ASSERT_EQ(exercise.simulation().state_hash(), hashes[frame])
                    << "seed " << seed << ", frame " << frame;
        }
    }
}

}  // namespace test
