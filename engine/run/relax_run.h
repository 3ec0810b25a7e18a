#pragma once
/// Relaxes a case and reports the result.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "engine/run/relax_case.h"
#include "physics/wire/energy.h"

namespace run {

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
    double part = 0;      // share of the maximum work, 0 to 1
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
