#pragma once
/// Random scenarios under random hands: what must hold after every frame, whatever they do.

#include <cstdint>
#include <string>

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
/// Plays the case. What must hold: the wire is finite, its tangents have length 1 and its joints λ between
/// them; the energy is finite, and without friction no larger after a frame in which no hand moved; no joint
/// is beyond the wall by more than the vessel's radius; the state restored from the middle goes on to the
/// same end. Bad input is a refusal, every other exception passes through.
StateOutcome play(const StateCase&);

}  // namespace fuzz
