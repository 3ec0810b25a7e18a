#pragma once
/// The way to the target: the vessels as the scenario's view shows them, the start, the way, the target.

#include "engine/anatomy/anatomy.h"
#include "engine/scenario/scenario.h"
#include "render/panel/canvas.h"
#include "render/xray/c_arm.h"

struct ImDrawList;

namespace app {

struct MapMarks {
    geometry::Vec3 start = geometry::Vec3::Zero(), target = geometry::Vec3::Zero();  // [mm]
    double radius = 0;                                                               // of the target [mm]
};

/// Where the target lies [mm]; (0, 0, 0) where neither the vessels nor the scenario say.
geometry::Vec3 target_of(const scenario::Target&, const anatomy::Anatomy&);
/// Draws it into the area [pixels], as large as the way from the start to the target allows. `unit` is that
/// of the window.
void draw_map(ImDrawList&, const render::Box& area, float unit, const anatomy::Anatomy&, const render::CArm&,
              const MapMarks&);

}  // namespace app
