#pragma once
/// A wire by the few numbers that studies and tests vary: a soft tip, a transition, a shaft, one arc.

#include "physics/wall/wall.h"
#include "physics/wire/chain.h"
#include "physics/wire/energy.h"

namespace studies {

struct PlainWire {
    double segment_length = 2.0;  // λ [mm]
    physics::EndCells end_cells = physics::EndCells::Half;
    double diameter = 0.889;           // [mm]; 0.035 in
    double shaft_rigidity = 250.0;     // EI of the shaft [N·mm²]
    double tip_rigidity = 6.0;         // EI of the floppy tip [N·mm²]
    double tip_length = 30.0;          // floppy [mm]
    double transition_length = 150.0;  // EI rises geometrically from tip to shaft over this length [mm]
    double curved_length = 12.0;       // pre-curved at the distal end [mm]
    double curved_angle = 0.785398163397448;  // total turn of the unloaded tip [rad]
    double friction = 0;                      // μ on the wall [-]
    double buckling_force = 0;                // 0 = not stated [N]
    double torsional_rigidity = 0;            // GJ of the shaft, elsewhere as EI [N·mm²]

    /// Straight, as stiff everywhere.
    static PlainWire uniform(double rigidity, double segment_length,
                             physics::EndCells ends = physics::EndCells::Half) {
        PlainWire wire;
        wire.segment_length = segment_length;
        wire.end_cells = ends;
        wire.shaft_rigidity = wire.tip_rigidity = rigidity;
        wire.curved_length = wire.curved_angle = 0;
        return wire;
    }
    physics::Grid grid() const { return {segment_length, end_cells}; }
    physics::DeviceSpec device() const {
        physics::DeviceSpec spec;
        spec.outer_diameter = diameter;
        const bool soft = tip_rigidity != shaft_rigidity;
        spec.sections = physics::soft_tip(tip_rigidity, soft ? tip_length : 0, soft ? transition_length : 0,
                                          shaft_rigidity, torsional_rigidity);
        spec.friction = friction;
        spec.buckling_force = buckling_force;
        spec.length = 1e4;
        if (curved_length > 0 && curved_angle != 0) spec.shape = {{curved_length, curved_angle, 0}};
        return spec;
    }
    int curved_segments() const {
        return curved_angle == 0 ? 0 : static_cast<int>(std::lround(curved_length / segment_length));
    }
    std::vector<std::string> problems() const {
        physics::Device one;
        one.spec = device();
        return physics::problems({one}, grid());
    }
};

inline physics::Chain straight_wire(const PlainWire& wire, const physics::Vec3& entry,
                                    const physics::Vec3& direction, int segments) {
    return physics::straight_wire(wire.device(), wire.grid(), entry, direction, segments);
}
inline physics::Chain wire_along(const PlainWire& wire, const physics::Polyline& path, int segments) {
    return physics::wire_along(wire.device(), wire.grid(), path, segments);
}
/// With `length` [mm] inside.
inline physics::Chain wire_of_length(const PlainWire& wire, const physics::Polyline& path, double length) {
    physics::Device device;
    device.spec = wire.device();
    device.inserted = length;
    return physics::chain_along({device}, wire.grid(), path);
}

inline double energy_of(const physics::Chain& wire, const physics::LumenWall& wall) {  // [N·mm]
    return physics::total_energy(wire, physics::all_contacts(wire, wall)).total();
}

}  // namespace studies
