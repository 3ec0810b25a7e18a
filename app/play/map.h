#pragma once
/// The way to the target: the vessels, the start, the way, the target.

#include "engine/room/way_map.h"
#include "render/panel/canvas.h"

struct ImDrawList;

namespace app {

/// Draws it into the area [pixels], as large as it fits. `unit` is that of the window.
void draw_map(ImDrawList&, const render::Box& area, float unit, const room::WayMap&);

}  // namespace app
