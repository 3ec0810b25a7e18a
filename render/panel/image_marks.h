#pragma once
/// The marks drawn on the image itself, as on the monitors of the room.

#include "render/panel/canvas.h"
#include "render/panel/readout.h"

namespace render {

/// Draws scenario, mode, LIVE or LIH, directions of the patient, angles and time along the edges of the area.
void draw_image_marks(Canvas&, const Box& area, const Readout&);

}  // namespace render
