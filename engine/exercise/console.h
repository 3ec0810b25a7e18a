#pragma once
/// The settings the operator has made at the X-ray stand: C-arm, table, collimator, filters, pedal, mode,
/// pulses.

#include <optional>
#include <vector>

#include "engine/script/command.h"
#include "render/xray/c_arm.h"

namespace exercise {

struct ConsoleEvents {
    bool pulse = false;                     // of the beam
    bool mask = false;                      // the pulse is a new mask of DSA
    bool reference = false;                 // the image goes to the reference screen
    std::vector<script::ShiftMask> shifts;  // of the mask, in order
};

class Console {
public:
    /// `frame_rate` of the simulation [1/s]. There is a pulse for every frame unless `pulse_rate` is given.
    Console(const render::CArm& start, double frame_rate, std::optional<double> pulse_rate = {});

    void apply(const script::MoveArm&);
    void apply(const script::Collimate&);
    void apply(const script::SetFilter&);
    void apply(const script::MoveTable&);
    void apply(const script::Beam&);
    void apply(const script::SetMode&);
    void apply(const script::SetPulseRate&);
    void apply(const script::NewMask&);
    void apply(const script::StoreReference&);
    void apply(const script::ShiftMask&);
    /// Ends the frame and returns what it asks of the X-ray chain.
    ConsoleEvents end_frame();

    /// The C-arm in the patient's coordinates, with the table's position accounted for.
    render::CArm arm() const;
    const geometry::Vec3& table() const { return table_; }  // displacement from its place at the start [mm]
    bool beam_on() const { return beam_on_; }
    script::ImagingMode mode() const { return mode_; }
    double pulse_rate() const { return pulse_rate_; }  // [1/s]
    void state(geometry::StateStream& s) {
        s(arm_, table_, beam_on_, mode_, pulse_rate_, beam_frames_, mask_asked_, reference_asked_,
          shifts_asked_);
    }

private:
    double frame_rate_;
    render::CArm arm_;
    geometry::Vec3 table_ = geometry::Vec3::Zero();
    bool beam_on_ = false;
    script::ImagingMode mode_ = script::ImagingMode::Live;
    double pulse_rate_;
    int beam_frames_ = 0;      // since the pedal was last pressed
    bool mask_asked_ = false;  // and not taken yet: it waits for a DSA pulse
    bool reference_asked_ = false;
    std::vector<script::ShiftMask> shifts_asked_;
};

}  // namespace exercise
