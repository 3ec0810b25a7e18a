#pragma once
/// From detector signal to grey levels on the monitor.

#include <array>
#include <cstdint>

#include "render/picture/image.h"
#include "render/xray/c_arm.h"

namespace render {

struct DisplaySpec {
    double compression = 0.55;  // least fraction of slow changes of brightness to be removed [-]
    double range = 1.2;         // what may be left of these, as between lung and heart [e-folds of signal]
    double compression_reach = 0.06;  // what counts as slow: standard deviation, in image widths [-]
    double contrast = 2.6;            // steepness of the grey curve per e-fold of signal [-]
    double brightness = 0.60;         // grey of the average signal, 0 black to 1 white [-]
    double shutter_margin = 0.018;    // of the rounded collimator, in image widths [-]
    double shutter_radius = 0.060;    // of its corners, in image widths [-]
    double shutter_softness = 0.005;  // of its edge, in image widths [-]
};

/// The grey curves of a room: fluoroscopy, and cine, whose pulses have more quanta and whose images show lung
/// and spine at once, at a third of fluoroscopy's gain.
enum class GreyCurve : std::uint8_t { Fluoroscopy, Cine };
inline constexpr DisplaySpec cine_display = {
    .compression = 0.70, .range = 1.2, .contrast = 1.15, .brightness = 0.62};

/// Logarithm, compression of dynamic range, window, shutters. Where few quanta are expected the gain of the
/// logarithm falls, so that noise never exceeds a quarter of what it acts on: otherwise it would be white
/// salt in the darkest parts. Adjusted to one pose of the C-arm by the signal expected there without wire and
/// contrast, so that the grey of the background does not follow the wire.
class Display {
public:
    /// `expected`: detector signal without noise [quanta]; `flat`: the same with nothing in the beam,
    /// relative to its middle [-]; `weight`: of each pixel in the average that is shown at `brightness` [-];
    /// `open`: transmission of the collimator [-]. All have the same size.
    Display(const DisplaySpec&, const Field& expected, const Field& flat, const Field& weight, Field open);

    /// The result has the shape of `expected`.
    GrayImage show(const Field& signal) const;

private:
    std::array<std::uint8_t, 1024> grey_{};  // over ln(signal) minus the reference, in equal steps
    Field reference_;                        // ln of the signal that is shown at `brightness`
    Field lift_;                             // of the signal before its logarithm, where quanta are few
    Field open_;                             // transmission of the shutters, 0 to 1 [-]
};

/// Transmission of the rounded collimator, 0 to 1 [-].
Field shutters(const DisplaySpec&, const CArm&);

constexpr float shutter_grey = 5.0f;  // of the closed collimator on the monitor

}  // namespace render
