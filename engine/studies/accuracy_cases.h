#pragma once
/// Wires that are known exactly, each with chains of segments to compare with it.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace studies {

/// A quantity of the exact wire, and the error of a chain: for a length relative to the wire's length, for
/// all else relative to the exact value.
struct AgainstExact {
    std::string quantity;
    double exact = 0, measured = 0, error = 0;
};

/// A wall, and a wire in it that is not yet at rest.
struct ExactStart {
    std::unique_ptr<const physics::LumenWall> wall;
    physics::Chain start;
};

struct ExactCase {
    std::string id, title, text;
    std::string headline;       // the quantity in the picture
    std::string look;           // gnuplot's style of its lines
    double length = 0;          // [mm]
    std::vector<int> segments;  // the last also serves as the exact curve's guess
    bool has_ends = true;       // otherwise only places far from both ends are compared
    std::function<ExactStart(int segments, physics::EndCells)> set;
    std::function<std::vector<AgainstExact>(const physics::Chain&, const physics::LumenWall&)> measure;
    double exact_residual = 0, exact_step_error = 0;
};

/// A clamped wire on a wall, one through a bent tube, two under loads; a helix and an arc far from their
/// ends; pairs of nested rods, free in space; a wire ahead of a catheter's end, under a load.
std::vector<ExactCase> exact_cases();

/// Uses the global relaxer, to a gradient over C of 1e-11.
void bring_to_rest(physics::Chain&, const physics::LumenWall&);

/// Values common to all cases: EI of a wire alone [N·mm²]; the wall met by a tip alone, flat and of the bent
/// tube [N/mm]; the wall that helix and arc lie on, per mm of wire [N/mm²].
inline constexpr double exact_rigidity = 50, flat_stiffness = 1e4, bent_stiffness = 42, per_length = 42;

}  // namespace studies
