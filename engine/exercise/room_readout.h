#pragma once
/// What the panel tells of an exercise.

#include <deque>

#include "engine/exercise/exercise.h"
#include "render/panel/readout.h"

namespace exercise {

/// Follows an exercise frame by frame.
class RoomReadout {
public:
    /// After each frame, once.
    void observe(const Exercise&, const StepReport&);
    render::Readout read(const Exercise&) const;

private:
    void tell(int frame, std::string text, render::Notice);

    struct Told {
        int frame;
        render::Message message;
    };
    std::deque<Told> told_;
    std::deque<double> wall_forces_;  // largest of each frame [N]
    double hub_ = 0;                  // turned so far [rad]
    double push_force_ = 0;           // [N]
    double base_torque_ = 0;          // [N·mm]
    double pulse_rate_ = 0;           // at the last pulse [1/s]
    bool was_complete_ = false;
    int resets_ = 0;
};

}  // namespace exercise
