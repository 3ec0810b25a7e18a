#pragma once
/// A small drawing of the C-arm about the patient.

#include "render/panel/canvas.h"

namespace render {

enum class CArmView {
    FromFeet,  // rotation: LAO turns the detector to the right of the sheet
    FromRight  // angulation, head to the left: cranial turns the detector to the left
};

/// `angle` of rotation or angulation, LAO and cranial positive [rad]; with one that is not finite the patient
/// is drawn without an arm. `lift`: distance of the detector from the isocentre, relative to that of the
/// source; clamped to what can be drawn.
void draw_c_arm(Canvas&, const Box&, CArmView, double angle, double lift, bool beam_on);

}  // namespace render
