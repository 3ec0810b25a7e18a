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
/// Plays the case. What must hold after every frame: the wire is finite, its tangents have length 1 and its
/// joints λ between them; energy and the hand's force are finite. Of the global relaxer at rest, without
/// friction and on a smooth wall, too: the energy has risen by no more than the hands have put in, and not at
/// all where no hand moved; the gradient is as small as the relaxer reports; no joint is beyond the wall by
/// more than the vessel's radius, nor farther outside the triangles of the lumen than its wall reports. The
/// state restored from the middle goes on to the same end. A scenario that is not accepted is a refusal;
/// every exception after that passes through.
StateOutcome play(const StateCase&);

}  // namespace fuzz
