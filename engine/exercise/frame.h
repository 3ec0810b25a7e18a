#pragma once
/// One frame of an exercise as a value: its time, what happened in it, and the exercise it belongs to.

#include <span>
#include <vector>

#include "engine/exercise/simulation.h"
#include "engine/script/command.h"
#include "physics/geometry/state.h"

namespace exercise {

/// What came of a command to shift the mask.
struct MaskShift {
    enum class Outcome {
        Shifted,
        NoMask,  // no subtraction is shown
        NoMatch  // the mask has nothing in common with the image
    };
    Outcome outcome = Outcome::Shifted;
    bool automatic = false, limited = false;  // to a quarter of the image
    double x = 0, y = 0;                      // of the mask then, to the right and down [pixels]
};

class Monitor;
struct Dose;

/// The one clock.
struct FrameTime {
    int index = -1;      // of the run, the first is 0
    int attempt = -1;    // since the start or the last reset, the first is 0
    double seconds = 0;  // of the attempt, at the frame's end

    void state(geometry::StateStream& s) { s(index, attempt, seconds); }
};

/// The input of scorer, readout, recording, truth and notices. The references hold until the next frame.
struct Frame {
    FrameTime time;
    std::span<const script::Command> commands;
    StepReport motion;
    const Simulation& simulation;
    const Monitor* monitor;      // null without images
    const Dose* dose = nullptr;  // before this frame's pulse, null where it is not measured
    std::vector<MaskShift> mask_shifts =
        {};  // what came of each command to shift the mask; none without images
};

}  // namespace exercise
