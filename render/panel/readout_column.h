#pragma once
/// The readouts next to the image: C-arm, technique, dose, wire, contrast, messages.

#include "render/panel/canvas.h"
#include "render/panel/readout.h"

namespace render {

constexpr float readout_column_width = 256.0f;  // [units of the canvas]

void draw_readouts(Canvas&, const Box&, const Readout&);

}  // namespace render
