#pragma once
/// Wires that are known exactly, each as chains of segments to be held to it.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "physics/wall/wall.h"
#include "physics/wire/guidewire.h"

namespace studies {

/// A number of the exact wire, and how far a chain is off: a length over that of the wire, all else over the
/// exact number.
struct AgainstExact {
    std::string quantity;
    double exact = 0, measured = 0, error = 0;
};

/// A wall, and a wire that has yet to come to rest in it.
struct ExactStart {
    std::unique_ptr<const physics::LumenWall> wall;
    physics::Guidewire start;
};

struct ExactCase {
    std::string id, title, text;
    std::string headline;       // the quantity in the picture
    std::string look;           // gnuplot's, of its lines
    double length = 0;          // [mm]
    std::vector<int> segments;  // the last for the exact curve's guess too
    bool has_ends = true;       // else only what is far from both ends is compared
    std::function<ExactStart(int segments, physics::EndCells)> set;
    std::function<std::vector<AgainstExact>(const physics::Guidewire&, const physics::LumenWall&)> measure;
    double exact_residual = 0, exact_step_error = 0;
};

/// A clamped wire on a wall, one through a bent tube, two under loads; a helix and an arc far from their
/// ends.
std::vector<ExactCase> exact_cases();

/// By the global relaxer, to a gradient over C of 1e-11.
void bring_to_rest(physics::Guidewire&, const physics::LumenWall&);

/// What all of them have: EI [N·mm²]; the wall that a tip alone meets, flat and of the bent tube [N/mm]; the
/// wall that helix and arc lie on, for each mm of wire [N/mm²].
inline constexpr double exact_rigidity = 50, flat_stiffness = 1e4, bent_stiffness = 42, per_length = 42;

}  // namespace studies
