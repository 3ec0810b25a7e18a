#pragma once
/// Random scenarios under random hands: what must hold after every frame, whatever they do.

#include <cstdint>
#include <functional>
#include <string>

#include "engine/anatomy/model_cache.h"
#include "engine/exercise/simulation.h"

namespace fuzz {

/// A random scenario and a script for it, as files would have them: `seldinger run` plays them too.
struct StateCase {
    std::uint32_t seed = 0;
    std::string scenario, script;
    int frames = 0;
};
StateCase random_case(std::uint32_t seed, int frames);

struct StateOutcome {
    std::string refused;  // why scenario or script is not accepted
    int frames = 0;       // played, those played again included
    std::string broken;   // what did not hold, and where; empty = all held
};
/// Plays the case. What must hold after every frame: the wire is finite, its tangents have length 1 and its
/// joints λ between them; energy and the hand's force are finite. Of the global relaxer at rest, without
/// friction and on a smooth wall, too: the energy has risen by no more than the hands have put in, and not at
/// all where no hand moved; the gradient is as small as the relaxer reports; no joint is beyond the wall by
/// more than the vessel's radius, nor farther outside the triangles of the lumen than its wall reports. The
/// state restored from the middle goes on to the same end. A scenario that is not accepted is a refusal;
/// every exception after that passes through. Without a cache, vessels are kept for this process.
StateOutcome play(const StateCase&, const anatomy::ModelCache* = nullptr);

/// A hand at the speeds of the room's keys in a scenario that ships: it lets in what it likes at one of 15
/// speeds, from a phase between two segments on, with or without a turn, by itself or along the push; then it
/// pulls for 60 frames. The seed determines all.
struct HandOutcome {
    double pulled = 0, brought_back = 0;  // asked for by the 60 frames, and had by them [mm]
    int longest_settling = 0;             // consecutive frames that show an earlier rest
    int most_updates = 0;                 // of a frame
    double most_push = 0;                 // over what the device's shaft passes on
    std::string broken;                   // what did not hold of it; empty = all held
};
/// Plays a course from the state that the simulation is in. What must hold: the pull brings back at least 90
/// % of what it asks for, or all there is; no more than 15 frames on end show an earlier rest; no device at
/// rest is pushed by more than its shaft passes on; no frame takes more updates than its budget.
HandOutcome play_hand(exercise::Simulation, std::uint64_t seed);

/// Plays `courses` courses, divided among the scenarios that ship, seeds from `first` on. Returns how many
/// broke, and tells each.
int play_hands(
    int courses, std::uint64_t first,
    const std::function<void(const std::string& scenario, int played, const std::string& broken)>&);

}  // namespace fuzz
