#pragma once
/// One wire in one vessel, relaxed from given numbers: checks the request of `seldinger relax`, turns it into
/// a wall, a wire and a method, relaxes it and reports the result.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/anatomy/lumen_wall.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/wall.h"
#include "physics/wall/wall_stiffness.h"
#include "physics/wire/chain.h"
#include "physics/wire/energy.h"

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

/// One segment inserted and the wire relaxed again.
struct PushRow {
    int segments = 0;        // after the push
    int iterations = 0;      // Newton steps of the global method, else relaxation cycles
    double cpu = 0;          // of the relaxation [s]
    double energy = 0;       // [N·mm]
    double gradient = 0;     // |g|/C [-]
    double penetration = 0;  // the largest [mm]
};

struct RelaxOutcome {
    std::string method;
    physics::Chain wire;
    physics::Energy energy;
    double gradient = 0;         // largest |dU/du| over C [-]
    int contacts = 0;            // joints that touch the wall
    double penetration = 0;      // the largest, ≥ 0 [mm]
    long long iterations = 0;    // Newton steps of the global method, else relaxation cycles, all pushes
    long long updates = 0;       // of segments
    long long wall_queries = 0;  // contacts requested
    double cpu = 0;              // of the relaxations alone [s]
    bool converged = false;      // gradient ≤ the tolerance
    bool counts_newton_steps = false, strict_minimum = false;
    double push_force = 0;   // that holds the wire at the introducer, by the global method [N]
    double base_torque = 0;  // that holds its hub, by the global method [N·mm]
    physics::WallStiffness stiffness = 1;
    std::vector<PushRow> pushes;  // empty unless pushing
};

/// |g|/C that counts as converged when no tolerance is given [-].
inline constexpr double usual_tolerance = 1e-6;

struct RelaxProgress {
    double part = 0;      // fraction of the maximum work, 0 to 1
    double gradient = 0;  // |g|/C now [-]
    int segments = 0;
};

RelaxOutcome run_relax(RelaxCase, const std::function<void(const RelaxProgress&)>& progress = {});

std::string report_json(const RelaxOutcome&);
std::string push_csv(const RelaxOutcome&);

/// Where the command writes its files.
struct RelaxFiles {
    std::filesystem::path joints, report;
    std::filesystem::path push() const { return joints.parent_path() / "push.csv"; }
};

/// Throws InputError when a file cannot be written, or would overwrite an input or another output.
void check_files(const RelaxFiles&, const RelaxRequest&);
/// Writes all files or none: when one cannot be written, those already written are removed. Throws
/// InputError.
void write_files(const RelaxFiles&, const RelaxOutcome&);

}  // namespace run
