#include "engine/run/relax_run.h"

#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/anatomy/anatomy.h"
#include "engine/io/cpu_clock.h"
#include "engine/io/csv.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/outputs.h"
#include "engine/io/table.h"
#include "engine/run/relax_method.h"

namespace run {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json number(double value) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

/// Relaxes by whole cycles until the gradient is below the tolerance, the relaxer is at rest or the work is
/// done; the global relaxer, which comes to rest by itself, with the work of all cycles at once. Returns the
/// iterations and adds to the outcome.
int relax(const RelaxCase& given, physics::Chain& wire, physics::Relaxer& relaxer, RelaxOutcome& outcome,
          const std::function<void(double part, double gradient)>& progress) {
    int iterations = 0;
    const int at_once = given.method.kind == physics::RelaxerKind::Global ? given.cycles : 1;
    for (int cycle = 0; cycle < given.cycles; cycle += at_once) {
        const double start = io::thread_cpu_seconds();
        const physics::RelaxReport report =
            relaxer.relax(wire, physics::whole_cycles(wire.segments(), at_once));
        outcome.cpu += io::thread_cpu_seconds() - start;
        iterations += outcome.counts_newton_steps ? report.newton_steps : 1;
        outcome.updates += report.updates;
        outcome.wall_queries += report.wall_queries;
        outcome.strict_minimum = report.strict_minimum();
        outcome.push_force = report.push_force;
        outcome.base_torque = report.base_torque;
        const double gradient = physics::relative_gradient(wire, physics::all_contacts(wire, *given.wall));
        if (progress) progress((cycle + at_once) / static_cast<double>(given.cycles), gradient);
        if (report.converged() || (given.tolerance && gradient <= *given.tolerance)) break;
    }
    return iterations;
}

void check_writable(const fs::path& file) {
    const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
    std::error_code ignored;
    std::string reason;
    if (file.empty())
        reason = "a file without a name was asked for";
    else if (!file.has_filename() || fs::is_directory(file, ignored))
        reason = "a folder is in its place";
    else if (!fs::is_directory(folder, ignored))
        reason = fmt::format("there is no folder {}", folder.string());
    else
        return io::require_writable(file);
    throw io::InputError("{}: cannot be written: {}; a file in an existing folder is accepted", file.string(),
                         reason);
}

}  // namespace

RelaxOutcome run_relax(RelaxCase given, const std::function<void(const RelaxProgress&)>& progress) {
    RelaxOutcome outcome;
    outcome.method = method_text(given.method);
    outcome.stiffness = given.stiffness;
    outcome.counts_newton_steps = given.method.kind == physics::RelaxerKind::Global;
    physics::Chain& wire = given.wire;
    const auto relaxer = physics::make_relaxer(given.method, *given.wall);
    const int first = wire.segments(), relaxations = given.segments - first + 1;
    for (int k = 0; k < relaxations; ++k) {
        if (k > 0) physics::move(wire, wire.grid.segment_length);
        const double cpu = outcome.cpu;
        const int iterations = relax(given, wire, *relaxer, outcome, [&](double part, double gradient) {
            if (progress) progress({(k + part) / relaxations, gradient, wire.segments()});
        });
        outcome.iterations += iterations;
        if (k == 0 && relaxations > 1) continue;  // the wire with which pushing starts
        const auto contacts = physics::all_contacts(wire, *given.wall);
        outcome.energy = physics::total_energy(wire, contacts);
        outcome.gradient = physics::relative_gradient(wire, contacts);
        outcome.penetration = physics::largest_penetration(contacts);
        outcome.contacts = 0;
        for (std::size_t i = 1; i < contacts.size(); ++i) outcome.contacts += contacts[i].touches() ? 1 : 0;
        if (relaxations > 1) {
            outcome.pushes.push_back({wire.segments(), iterations, outcome.cpu - cpu, outcome.energy.total(),
                                      outcome.gradient, outcome.penetration});
        }
    }
    outcome.converged = outcome.gradient <= given.tolerance.value_or(usual_tolerance);
    outcome.wire = std::move(wire);
    return outcome;
}

std::string report_json(const RelaxOutcome& o) {
    Json json;
    json["schema"] = 1;
    json["method"] = o.method;
    json["segments"] = o.wire.segments();
    json["segment_length_mm"] = o.wire.grid.segment_length;
    json["clamp"] = o.wire.grid.end_cells == physics::EndCells::Half ? "half" : "paper";
    json["load_N_per_mm"] = {o.wire.load.x(), o.wire.load.y(), o.wire.load.z()};
    json["wall_stiffness_N_per_mm"] = o.stiffness.mean();
    Json variation;  // null where the wall is as stiff everywhere
    if (!o.stiffness.uniform()) {
        variation["length_mm"] = o.stiffness.length();
        variation["terms"] = Json::array();
        for (const physics::WallStiffness::Term& term : o.stiffness.terms())
            variation["terms"].push_back({{"amplitude_share", term.amplitude / o.stiffness.mean()},
                                          {"phase_deg", term.phase / geometry::degree}});
    }
    json["wall_variation"] = variation;
    json["energy"] = {{"bending_N_mm", number(o.energy.bending)},
                      {"wall_N_mm", number(o.energy.wall)},
                      {"load_N_mm", number(o.energy.load)},
                      {"total_N_mm", number(o.energy.total())}};
    json["gradient"] = number(o.gradient);
    json["contacts"] = o.contacts;
    json["max_penetration_mm"] = number(o.penetration);
    json[o.counts_newton_steps ? "iterations" : "cycles"] = o.iterations;
    json["updates"] = o.updates;
    json["wall_queries"] = o.wall_queries;
    json["cpu_s"] = o.cpu;
    json["converged"] = o.converged;
    // The other methods use neither the curvature of the whole wire's energy nor the force at its base.
    const auto of_global = [&](const Json& value) { return o.counts_newton_steps ? value : Json(nullptr); };
    json["strict_minimum"] = of_global(o.strict_minimum);
    json["push_force_N"] = of_global(number(o.push_force));
    json["base_torque_N_mm"] = of_global(number(o.base_torque));
    return json.dump(2) + "\n";
}

std::string push_csv(const RelaxOutcome& outcome) {
    io::Table table{"push",
                    {"segments", "iterations", "cpu_us", "energy_N_mm", "gradient", "max_penetration_mm"}};
    for (const PushRow& row : outcome.pushes)
        table.add({row.segments, row.iterations, fmt::format("{:.1f}", 1e6 * row.cpu), row.energy,
                   row.gradient, row.penetration});
    return io::to_csv(table);
}

void check_files(const RelaxFiles& files, const RelaxRequest& request) {
    std::vector<io::Output> outputs = {{"--out", files.joints}, {"--report", files.report}};
    if (request.push_from) outputs.push_back({"--push-from", files.push()});
    for (const io::Output& output : outputs) check_writable(output.file);
    std::vector<fs::path> inputs;
    const std::optional<fs::path> terms = request.wall_variation;
    for (const auto& input : {request.tube, request.wire, request.anatomy, terms})
        if (input) inputs.push_back(*input);
    if (request.anatomy)
        if (const auto mesh = anatomy::mesh_named_by(*request.anatomy)) inputs.push_back(*mesh);
    io::require_distinct(outputs, inputs);
}

void write_files(const RelaxFiles& files, const RelaxOutcome& outcome) {
    const std::string joints = io::points_csv(outcome.wire.joints), pushes = push_csv(outcome),
                      report = report_json(outcome);
    std::vector<std::pair<fs::path, std::string_view>> texts = {{files.joints, joints},
                                                                {files.report, report}};
    if (!outcome.pushes.empty()) texts.emplace_back(files.push(), pushes);
    io::write_whole(texts);
}

}  // namespace run
