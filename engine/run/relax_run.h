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
    physics::Guidewire wire;
    physics::Energy energy;
    double gradient = 0;         // largest |dU/du| over C [-]
    int contacts = 0;            // joints that touch the wall
    double penetration = 0;      // the largest, ≥ 0 [mm]
    long long iterations = 0;    // Newton steps of the global method, else relaxation cycles, all pushes
    long long updates = 0;       // of segments
    long long wall_queries = 0;  // contacts asked for
    double cpu = 0;              // of the relaxations alone [s]
    bool converged = false;      // gradient ≤ the tolerance
    bool counts_newton_steps = false, strict_minimum = false;
    double push_force = 0;        // that holds the wire at the introducer, of the global method [N]
    double base_torque = 0;       // that holds its hub, of the global method [N·mm]
    std::vector<PushRow> pushes;  // empty unless pushing
};

/// |g|/C that counts as converged where no tolerance is asked for [-].
inline constexpr double usual_tolerance = 1e-6;

struct RelaxProgress {
    double part = 0;      // of the most work that was allowed, 0 to 1
    double gradient = 0;  // |g|/C now [-]
    int segments = 0;
};

RelaxOutcome run_relax(RelaxCase, const std::function<void(const RelaxProgress&)>& progress = {});

std::string report_json(const RelaxOutcome&);
std::string push_csv(const RelaxOutcome&);

/// Where the command leaves its files.
struct RelaxFiles {
    std::filesystem::path joints, report;
    std::filesystem::path push() const { return joints.parent_path() / "push.csv"; }
};

/// Throws InputError when a file could not be written, or would take the place of an input or of another.
void check_files(const RelaxFiles&, const RelaxRequest&);
/// All of them or none: when one cannot be written, those already there go. Throws InputError.
void write_files(const RelaxFiles&, const RelaxOutcome&);

}  // namespace run
