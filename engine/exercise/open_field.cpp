#include "engine/exercise/open_field.h"

namespace exercise {

bool in_open_field(const Simulation& simulation, const geometry::Vec3& place) {
    const render::CArm arm = simulation.console().arm();
    const render::Pixel at = render::project(arm, place + simulation.vessel_shift());
    const render::PixelBox open = render::opening_of(arm);
    return at.depth > 0 && at.x >= open.left && at.x <= open.right && at.y >= open.top && at.y <= open.bottom;
}

geometry::Vec3 table_to_show(const Simulation& simulation, const geometry::Vec3& place) {
    const Console& console = simulation.console();
    return console.arm().isocentre + console.table() - (place + simulation.vessel_shift());
}

}  // namespace exercise
