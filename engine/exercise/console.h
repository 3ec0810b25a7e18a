#pragma once
/// What the operator of the X-ray stand has set: C-arm, table, collimator, pedal, mode, pulses.

#include <cstdint>
#include <optional>

#include "engine/script/command.h"
#include "render/xray/c_arm.h"

namespace exercise {

class Console {
public:
    /// `frame_rate` of the simulation [1/s]. Pulses come as often as frames unless `pulse_rate` is given.
    Console(const render::CArm& start, double frame_rate, std::optional<double> pulse_rate = {});

    /// What is not the console's is left alone.
    void apply(const script::Command&);
    /// The frame is over: whether it had a pulse.
    bool end_frame();

    /// In the patient's coordinates, the table's place taken in.
    render::CArm arm() const;
    const geometry::Vec3& table() const { return table_; }  // from where it was at the start [mm]
    bool beam_on() const { return beam_on_; }
    script::ImagingMode mode() const { return mode_; }
    double pulse_rate() const { return pulse_rate_; }  // [1/s]
    /// How often a new mask was asked for.
    int masks() const { return masks_; }
    /// How often the image was asked to the reference screen.
    int references() const { return references_; }

private:
    double frame_rate_;
    render::CArm arm_;
    geometry::Vec3 table_ = geometry::Vec3::Zero();
    bool beam_on_ = false;
    script::ImagingMode mode_ = script::ImagingMode::live;
    double pulse_rate_;
    int beam_frames_ = 0;  // since the pedal was last pressed
    int masks_ = 0, references_ = 0;
};

}  // namespace exercise
