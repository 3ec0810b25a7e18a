#pragma once
/// One wire in one vessel, to be relaxed from given numbers: checks the request of `seldinger relax` and
/// turns it into a wall, a wire and a method.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "engine/anatomy/lumen_wall.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/wall.h"
#include "physics/wall/wall_stiffness.h"
#include "physics/wire/chain.h"

namespace run {

/// The arguments as given. Either a tube or an anatomy; either a wire or segments and their length.
struct RelaxRequest {
    std::optional<std::filesystem::path> tube;  // CSV of the centreline
    std::optional<double> radius;               // of the tube [mm]
    std::optional<std::filesystem::path> anatomy;
    std::optional<std::string> branch;  // of the anatomy; the wire enters by its open end; empty = the first
    std::string wall = "distance-field";  // of the anatomy; or "mesh", by ray and plane as in the paper
    anatomy::ModelCache cache;

    std::optional<std::filesystem::path> wire;   // CSV of the joints, from joint 0
    std::optional<int> segments;                 // N
    std::optional<double> segment_length;        // λ [mm]
    double wire_diameter = 0;                    // subtracted from the lumen's; 0 = the paper's line [mm]
    std::optional<std::string> entry_direction;  // "X,Y,Z"; empty = along the wire's first segment

    double rigidity = 0;              // EI, the same all along, straight when unloaded [N·mm²]
    std::string clamp = "half";       // what the first and the last joint stand for: half a segment, or
                                      // a whole one ("paper")
    std::optional<std::string> load;  // "X,Y,Z", force on the wire per length [N/mm]; empty = none
    double wall_stiffness = 0;        // k per joint [N/mm]
    std::optional<std::string> wall_variation;    // a seed, or a CSV of terms; see variation_header
    std::optional<double> wall_variation_length;  // L [mm]
    std::string method;                           // see parse_method

    std::optional<int> cycles;        // maximum work, in relaxation cycles (per push)
    std::optional<double> tolerance;  // stop at |g|/C [-]
    std::optional<int> push_from;     // N₀: insert one segment at a time from here to N
};

/// A case that is ready to relax.
struct RelaxCase {
    std::unique_ptr<const physics::LumenWall> wall;
    physics::Chain wire;                   // of push_from segments when pushing
    physics::WallStiffness stiffness = 1;  // of the wall
    int segments = 0;                      // N at the end
    physics::RelaxerConfig method;
    int cycles = 0;                   // maximum work of a relaxation
    std::optional<double> tolerance;  // [-]
};

/// Cycles when none are requested: of a relaxation, and of each push by another method than the global one.
inline constexpr int usual_cycles = 300, usual_cycles_per_push = 10;

/// A joint may start inside the wall by this part of the lumen's radius, as a wire at rest under load does.
inline constexpr double pressed_in = 0.1;

/// Header of a file of terms of Eq. 41, a row each from g = 1 on: k_g/k and φ_g.
inline constexpr std::string_view variation_header = "amplitude_share,phase_deg";

/// Throws InputError stating the argument or file:line:column, what was found and what is accepted.
RelaxCase make_relax_case(const RelaxRequest&);

}  // namespace run
