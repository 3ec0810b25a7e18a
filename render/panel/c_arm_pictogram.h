#pragma once
/// A small drawing of the C-arm about the patient.

#include "render/panel/canvas.h"

namespace render {

enum class CArmView {
    FromFeet,  // rotation: LAO turns the detector to the right of the sheet
    FromRight  // angulation, head to the left: cranial turns the detector to the left
};

/// `angle` of rotation or angulation, LAO and cranial positive [rad]; with one that is not finite there is a
/// patient but no arm. `lift`: distance of the detector from the isocentre where that of the source is 1;
/// held within what can be drawn.
void draw_c_arm(Canvas&, const Box&, CArmView, double angle, double lift, bool beam_on);

}  // namespace render
