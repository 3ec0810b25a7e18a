#pragma once
/// The screens: they take pulses and show images.

#include <deque>
#include <optional>
#include <vector>

#include "engine/exercise/dose.h"
#include "engine/exercise/frame.h"
#include "engine/script/command.h"
#include "render/xray/fluoroscope.h"
#include "render/xray/subtraction.h"

namespace exercise {

/// What stands beside devices, introducer and flush catheters, or belongs to one.
struct PulsedTube {
    geometry::Polyline joints;  // [mm]
    render::WireLook look;
    render::DeviceIodine iodine = {};
    std::vector<double> radii = {};  // as in render::SeenDevice [mm]

    render::SeenDevice seen() const { return {joints, radii, &look, &iodine}; }
    bool operator==(const PulsedTube&) const = default;
    void state(geometry::StateStream& s) {
        s(joints, look, iodine);
        s.unless_empty(radii);
    }
};
/// A device in the beam.
struct PulsedDevice {
    script::DeviceRole role = script::DeviceRole::Wire;
    geometry::Polyline joints;  // empty where it is out [mm]
    render::WireLook look;
    render::DeviceIodine iodine = {};
    std::vector<PulsedTube> filling = {};  // contrast in its balloon; none or one

    render::SeenDevice seen() const { return {joints, {}, &look, &iodine}; }
    void state(geometry::StateStream& s) {
        s(role, joints, look, iodine);
        s.unless_empty(filling);
    }
};
/// The metal of a stent: a line of its struts' thickness.
struct PulsedStent {
    geometry::Polyline struts;  // [mm]
    render::WireLook look;

    render::SeenDevice seen() const { return {struts, {}, &look, nullptr, true}; }
    bool operator==(const PulsedStent&) const = default;
    void state(geometry::StateStream& s) { s(struts, look); }
};

struct Pulse {
    render::CArm arm;
    std::vector<PulsedDevice> devices;  // innermost first
    std::vector<PulsedTube> tubes;
    std::vector<PulsedStent> stents = {};
    int tip_of_device = 0;  // the exercise's tip
    render::Exposure exposure;
    script::ImagingMode mode = script::ImagingMode::Live;
    bool new_mask = false;  // of DSA
    FrameTime time;

    const geometry::Polyline& tip_of() const { return devices[tip_of_device].joints; }
    render::SeenDevices seen() const {
        render::SeenDevices seen;
        for (const PulsedDevice& device : devices) {
            seen.all.push_back(device.seen());
            for (const PulsedTube& filling : device.filling) seen.all.push_back(filling.seen());
        }
        for (const PulsedTube& tube : tubes) seen.all.push_back(tube.seen());
        for (const PulsedStent& stent : stents) seen.all.push_back(stent.seen());
        return seen;
    }
    void state(geometry::StateStream& s) {
        s(arm, devices, tubes, tip_of_device, exposure, mode, new_mask, time);
        s.unless_empty(stents);
    }
};

/// Pixels that a device of the pulse shadows, with what fills its balloon; ascending.
std::vector<std::uint32_t> device_pixels(render::Fluoroscope&, const Pulse&, const PulsedDevice&);
/// The same of all its stents.
std::vector<std::uint32_t> stent_pixels(render::Fluoroscope&, const Pulse&);

/// Live images mix each pulse with those before it (the lag of detector and noise filter), cine by the
/// detector's lag alone; DSA subtracts the first pulse taken in that mode; a roadmap lays the vessels that
/// DSA has shown under the live wire. Any change of C-arm, table or field clears all of this. While C-arm or
/// table move, and for a moment after, images that subtract nothing show a coarser patient. The screens
/// depend on the pulses taken, not on which were displayed.
class Monitor {
public:
    explicit Monitor(render::Fluoroscope);

    void take(Pulse);
    /// Sends the image to the reference screen.
    void store_reference();
    /// Moves the mask of the subtraction that is shown; under a roadmap the map goes with it. A new mask has
    /// no shift.
    MaskShift shift(const script::ShiftMask&);
    /// Of the mask of the subtraction that is shown; 0 without [pixels].
    render::Subtraction::Shift mask_shift() const;
    /// Returns to the state before the first pulse.
    void clear();

    /// Image of the last pulse, which is held while no new one comes. Null before the first.
    const render::GrayImage* image();
    /// Null when none was stored.
    const render::GrayImage* reference() const { return reference_ ? &*reference_ : nullptr; }
    const Dose& dose() const { return dose_; }
    /// Null before the first.
    const Pulse* last_pulse() const { return recent_.empty() ? nullptr : &recent_.back().pulse; }
    /// The detector's signal of the last pulse, per nGy. There must have been a pulse.
    const render::Field& last_signal() { return signal(recent_.back()); }
    /// What the tube gave the detector then [nGy].
    double last_dose() const { return recent_.back().dose; }
    /// Whether a roadmap was asked for without a map; live images are then shown instead.
    bool map_is_missing() const;
    /// Draws a part of what later pulses at this pose will need; false when there is nothing to draw. For the
    /// time between frames: the images are the same with and without.
    bool draw_ahead() {
        return !recent_.empty() &&
               fluoroscope_.draw_ahead(recent_.back().pulse.arm, recent_.back().pulse.exposure);
    }
    render::Fluoroscope& fluoroscope() { return fluoroscope_; }
    /// The state, without what the fluoroscope can make again from the pulses.
    void state(geometry::StateStream& s) {
        s(recent_, moved_, subtraction_, reference_, dose_);
        if (s.restores()) image_.reset();
    }

private:
    struct Recent {
        Pulse pulse;
        double dose;                          // at the detector [nGy]
        std::optional<render::Field> signal;  // per nGy; read when needed
        void state(geometry::StateStream& s) {
            s(pulse, dose);
            if (s.restores()) signal.reset();
        }
    };
    const render::Field& signal(Recent&);
    /// Whether the last pulse is shown as the difference from a mask.
    bool shows_difference() const;
    /// The mixture of recent signals, scaled as if from one pulse of `dose` [nGy].
    const render::Field& with_lag(float dose);

    render::Fluoroscope fluoroscope_;
    std::deque<Recent> recent_;    // all of the same pose and mode
    std::optional<double> moved_;  // time of the last pulse at another place of C-arm and table [s]
    std::optional<render::Subtraction> subtraction_;
    render::Field mixed_;  // scratch of with_lag
    std::optional<render::GrayImage> image_, reference_;
    Dose dose_;
};

}  // namespace exercise
