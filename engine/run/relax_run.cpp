#include "engine/run/relax_run.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <nlohmann/json.hpp>

#include "engine/anatomy/anatomy.h"
#include "engine/io/cpu_clock.h"
#include "engine/io/csv.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/run/relax_method.h"
#include "physics/geometry/polyline.h"
#include "physics/wall/tube_wall.h"

namespace run {
namespace {

using geometry::Polyline;
using geometry::Vec3;
using physics::Chain;

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
    throw io::InputError("{}: cannot be written: {}; expected a file in an existing folder", file.string(),
                         reason);
}

constexpr int most_segments = 20'000;
constexpr double spacing = 1e-4;  // largest relative difference of a segment's length from the others'
constexpr std::size_t most_wall_terms = 64;
constexpr double heaviest = 100;  // load [N/mm]

[[noreturn]] void refuse(const std::string& where, const std::string& found, const std::string& accepted) {
    throw io::InputError("{}: {}; {}", where, found, accepted);
}

void need_above_zero(const char* flag, double value, double most, const char* unit) {
    if (std::isfinite(value) && value > 0 && value <= most) return;
    refuse(flag, fmt::format("'{}' was found", io::number_text(value)),
           fmt::format("expected a number above 0 up to {:g} {}", most, unit));
}

void check_numbers(const RelaxRequest& r) {
    need_above_zero("--rigidity", r.rigidity, physics::DeviceLimits::rigidity, "N·mm²");
    need_above_zero("--wall-stiffness", r.wall_stiffness, 1e6, "N/mm");
    if (r.radius) need_above_zero("--radius", *r.radius, 100, "mm");
    if (r.segment_length)
        need_above_zero("--segment-length", *r.segment_length, physics::DeviceLimits::segment_length, "mm");
    if (r.tolerance) need_above_zero("--tolerance", *r.tolerance, 1, "(|gradient| over C)");
    if (!std::isfinite(r.wire_diameter) || r.wire_diameter < 0 ||
        r.wire_diameter > physics::DeviceLimits::diameter)
        refuse("--wire-diameter", fmt::format("'{}' was found", io::number_text(r.wire_diameter)),
               fmt::format("expected 0 to {:g} mm", physics::DeviceLimits::diameter));
    if (r.segments && (*r.segments < 2 || *r.segments > most_segments))
        refuse("--segments", fmt::format("'{}' was found", *r.segments),
               fmt::format("expected 2 to {} segments", most_segments));
    if (r.cycles && (*r.cycles < 1 || *r.cycles > 1'000'000))
        refuse("--cycles", fmt::format("'{}' was found", *r.cycles), "expected 1 to 1000000 cycles");
}

/// The numbers of "X,Y,Z", finite ones.
std::optional<Vec3> three_numbers(const std::string& text) {
    const std::vector<std::string_view> parts = io::split(text, ',');
    if (parts.size() != 3) return std::nullopt;
    Vec3 v;
    for (int k = 0; k < 3; ++k) v[k] = io::parse_number(parts[k]).value_or(std::nan(""));
    return v.allFinite() ? std::optional(v) : std::nullopt;
}

/// The terms of a file; a seed's are drawn.
std::optional<physics::WallVariation> variation_of(const RelaxRequest& r) {
    if (!r.wall_variation) {
        if (r.wall_variation_length)
            refuse("--wall-variation-length", "nothing varies", "it goes with --wall-variation");
        return std::nullopt;
    }
    const std::string& word = *r.wall_variation;
    physics::WallVariation variation;
    if (!word.empty() && word.find_first_not_of("0123456789") == std::string::npos) {
        std::uint64_t seed = 0;
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), seed);
        if (error != std::errc())
            refuse("--wall-variation", fmt::format("'{}' was found", word),
                   "expected a seed below 2^64, or a file of terms");
        variation = physics::drawn_variation(seed);
    } else {
        const std::string text = io::read_text(
            word, "--wall-variation",
            fmt::format("expected a seed, or a CSV file with the header '{}'", variation_header));
        double sum = 0;
        const auto rows = io::parse_csv(text, word, variation_header);
        if (rows.empty() || rows.size() > most_wall_terms)
            refuse(io::located({word, 2, 1}, fmt::format("{} terms were found", rows.size())), "Eq. 41",
                   fmt::format("expected 1 to {}", most_wall_terms));
        for (std::size_t i = 0; i < rows.size(); ++i) {
            const int line = static_cast<int>(i) + 2;
            sum += std::abs(rows[i][0]);
            if (sum >= 1)
                throw io::InputError(
                    io::located({word, line, 1}, fmt::format("the shares add up to {:.4g} here, so that the "
                                                             "stiffness could reach 0; expected less than 1",
                                                             sum)));
            variation.terms.push_back({rows[i][0], rows[i][1] * geometry::degree});
        }
    }
    if (r.wall_variation_length) {
        need_above_zero("--wall-variation-length", *r.wall_variation_length, 1e5, "mm");
        variation.length = *r.wall_variation_length;
    }
    return variation;
}

physics::EndCells end_cells(const RelaxRequest& r) {
    if (r.clamp == "half") return physics::EndCells::Half;
    if (r.clamp == "paper") return physics::EndCells::Paper;
    refuse("--clamp", fmt::format("'{}' was found", r.clamp), "expected half or paper");
}

Vec3 load_of(const RelaxRequest& r) {
    if (!r.load) return Vec3::Zero();
    const std::optional<Vec3> load = three_numbers(*r.load);
    if (!load || load->norm() > heaviest)
        refuse("--load", fmt::format("'{}' was found", *r.load),
               fmt::format("expected three numbers X,Y,Z of a force up to {:g} N/mm", heaviest));
    return *load;
}

void check_combination(const RelaxRequest& r) {
    if (r.tube.has_value() == r.anatomy.has_value())
        refuse("--tube, --anatomy", r.tube ? "both were given" : "neither was given", "expected one of them");
    if (r.tube && !r.radius) refuse("--radius", "it is missing", "the radius of the tube is needed");
    if (r.anatomy && r.radius) refuse("--radius", "an anatomy has its own radii", "it goes with --tube");
    if (r.branch && !r.anatomy) refuse("--branch", "a tube has no branches", "it goes with --anatomy");
    if (r.wire && (r.segments || r.segment_length))
        refuse("--wire", "the file gives the segments and their length",
               "expected either --wire or --segments and --segment-length");
    if (!r.wire && !(r.segments && r.segment_length))
        refuse(r.segments ? "--segment-length" : "--segments", "it is missing",
               "expected either --wire or both --segments and --segment-length");
    if (r.push_from && r.wire)
        refuse("--push-from", "a wire from a file has all its segments",
               "it goes with --segments and --segment-length");
    if (r.push_from && (*r.push_from < 2 || *r.push_from >= *r.segments))
        refuse("--push-from", fmt::format("'{}' was found", *r.push_from),
               fmt::format("expected 2 to {} segments, fewer than --segments", *r.segments - 1));
}

/// Where the wire may start, and the wall that stops it.
struct Vessel {
    std::string name;  // for messages
    std::unique_ptr<const physics::LumenWall> wall;
    Polyline path;
    std::vector<geometry::OpenEnd> ends;
    physics::WallStiffness stiffness;
};

Vessel tube_vessel(const RelaxRequest& r, const std::optional<physics::WallVariation>& variation) {
    const std::string file = r.tube->string();
    Vessel vessel{file, nullptr, io::load_points(*r.tube), {}, r.wall_stiffness};
    const Polyline& points = vessel.path;
    if (points.size() < 2)
        refuse(io::located(
                   {file, static_cast<int>(points.size()) + 1, 1},
                   fmt::format("{} point{} found", points.size(), points.size() == 1 ? " was" : "s were")),
               "a centreline", "expected two points or more");
    for (std::size_t i = 1; i < points.size(); ++i) {
        if ((points[i] - points[i - 1]).norm() >= 1e-9) continue;
        throw io::InputError(
            io::located({file, static_cast<int>(i) + 2, 1},
                        "the point repeats the line before; expected points 1e-9 mm apart or more"));
    }
    if (!physics::enters(r.wire_diameter, *r.radius))
        refuse("--radius",
               fmt::format("a tube of radius {:g} mm does not take a wire of diameter {:g} mm", *r.radius,
                           r.wire_diameter),
               fmt::format("expected a radius above {:g} mm", 0.5 * r.wire_diameter));
    if (variation) vessel.stiffness = variation->of(r.wall_stiffness, geometry::length_of(points));
    vessel.wall =
        std::make_unique<physics::TubeWall>(points, *r.radius, vessel.stiffness, 0.5 * r.wire_diameter);
    return vessel;
}

/// The open end at which a branch ends.
int end_of_branch(const anatomy::Anatomy& anatomy, const geometry::CentrelineBranch& branch) {
    int best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < anatomy.ends.size(); ++i) {
        const double distance = (anatomy.ends[i].opening.centre - branch.points.back()).norm();
        if (distance < least) least = distance, best = static_cast<int>(i);
    }
    return best;
}

Vessel anatomy_vessel(const RelaxRequest& r, const std::optional<physics::WallVariation>& variation) {
    const anatomy::Anatomy anatomy = anatomy::load_anatomy(*r.anatomy);
    const geometry::CentrelineBranch* branch = r.branch ? nullptr : &anatomy.branches.front();
    std::vector<std::string> names;
    for (const geometry::CentrelineBranch& known : anatomy.branches) {
        if (r.branch && known.name == *r.branch) branch = &known;
        names.push_back(known.name);
    }
    if (!branch)
        refuse("--branch", fmt::format("'{}' is no branch of {}", *r.branch, r.anatomy->string()),
               fmt::format("branches are: {}", io::joined(names)));
    const anatomy::EntryPath path = anatomy::path_from(anatomy, end_of_branch(anatomy, *branch));
    const double narrowest = *std::ranges::min_element(branch->radii);
    if (!physics::enters(r.wire_diameter, narrowest))
        refuse("--wire-diameter",
               fmt::format("branch '{}' is {:.3g} mm wide at its narrowest and does not take a wire of "
                           "diameter {:g} mm",
                           branch->name, 2 * narrowest, r.wire_diameter),
               "expected a thinner wire");
    const auto kind = r.wall == "mesh" ? anatomy::SurfaceWall::Mesh : anatomy::SurfaceWall::DistanceField;
    const physics::WallStiffness stiffness = anatomy::stiffness_of(anatomy, r.wall_stiffness, variation);
    return {fmt::format("{}, branch '{}'", r.anatomy->string(), branch->name),
            anatomy::surface_wall(anatomy, kind, stiffness, 0.5 * r.wire_diameter, r.cache), path.points,
            anatomy.openings(), stiffness};
}

/// The wire through these joints, which must be equally spaced.
Chain wire_through(const Polyline& joints, const std::string& file, double rigidity, physics::EndCells ends) {
    if (joints.size() < 3)
        throw io::InputError(
            io::located({file, static_cast<int>(joints.size()) + 1, 1},
                        fmt::format("{} joints were found; expected 3 or more", joints.size())));
    if (joints.size() > most_segments + 1)
        throw io::InputError(io::located(
            {file, most_segments + 3, 1},
            fmt::format("{} joints were found; expected at most {}", joints.size(), most_segments + 1)));
    std::vector<double> lengths;
    std::vector<Vec3> tangents;
    for (std::size_t i = 1; i < joints.size(); ++i) {
        tangents.push_back(joints[i] - joints[i - 1]);
        lengths.push_back(tangents.back().norm());
    }
    std::vector<double> sorted = lengths;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                     sorted.end());
    const double usual = sorted[sorted.size() / 2];
    for (std::size_t i = 0; i < lengths.size(); ++i) {
        if (usual > 0 && std::abs(lengths[i] - usual) <= spacing * usual) continue;
        throw io::InputError(io::located(
            {file, static_cast<int>(i) + 3, 1},
            fmt::format("joints {} and {} are {:.6g} mm apart, others {:.6g} mm; expected equal distances", i,
                        i + 1, lengths[i], usual)));
    }
    if (!(usual <= physics::DeviceLimits::segment_length))
        throw io::InputError("{}: joints are {:.6g} mm apart; expected at most {:g} mm", file, usual,
                             physics::DeviceLimits::segment_length);
    return physics::uniform_wire(rigidity, usual, joints.front(), tangents.front(), tangents, ends);
}

double distance_to(const Polyline& path, const Vec3& x) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < path.size(); ++i) {
        const Vec3 &a = path[i - 1], &b = path[i];
        least = std::min(least, (a + geometry::closest_fraction(a, b, x) * (b - a) - x).norm());
    }
    return least;
}

/// Joints on the path; rejects wires longer than it, as wire_along continues straight and would leave the
/// vessel.
Chain wire_on(const Vessel& vessel, int segments, double segment_length, double rigidity,
              physics::EndCells ends) {
    const double limit = 1e-6 * segment_length;
    physics::DeviceSpec spec;
    spec.sections = {{0, rigidity, rigidity}};
    Chain wire = physics::wire_along(spec, {segment_length, ends}, vessel.path, segments);
    if (distance_to(vessel.path, wire.tip()) <= limit) return wire;
    int fits = segments;
    while (fits > 0 && distance_to(vessel.path, wire.joints[fits]) > limit) --fits;
    refuse("--segments",
           fmt::format("{} segments of {:g} mm leave the end of {}", segments, segment_length, vessel.name),
           fmt::format("expected at most {}", fits));
}

Vec3 direction(const std::string& text) {
    const Vec3 u = three_numbers(text).value_or(Vec3::Zero());
    if (u.isZero(0))
        refuse("--entry-direction", fmt::format("'{}' was found", text),
               "expected three numbers X,Y,Z that are not all zero");
    return u.stableNormalized();
}

/// Every joint must start inside, or no deeper in the wall than that of a wire at rest may be.
void check_inside(const Vessel& vessel, const Chain& wire, const std::string& name) {
    std::vector<physics::WallContact> contacts(wire.joints.size());
    vessel.wall->contacts(wire.joints, contacts);
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        for (const geometry::OpenEnd& end : vessel.ends) {
            const Vec3 d = wire.joints[i] - end.centre;
            const double out = d.dot(end.outward_normal);
            if (out > 1e-6 && out < 4 * end.radius && d.norm() < 4 * end.radius)
                refuse(name, fmt::format("joint {} is {:.3g} mm beyond the open end '{}'", i, out, end.name),
                       "expected a wire that starts inside the lumen");
        }
        const double most = pressed_in * contacts[i].clearance;
        if (contacts[i].penetration <= most) continue;
        refuse(name,
               fmt::format("joint {} starts {:.5g} mm outside the lumen of {}", i, contacts[i].penetration,
                           vessel.name),
               fmt::format("expected inside, or up to {:.5g} mm in the wall", most));
    }
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

RelaxCase make_relax_case(const RelaxRequest& r) {
    RelaxCase result;
    result.method = parse_method(r.method);
    check_numbers(r);
    check_combination(r);
    const physics::EndCells ends = end_cells(r);
    const Vec3 load = load_of(r);
    // A push that the global relaxer has come to rest after costs no more, whatever it may cost.
    const bool few = r.push_from && result.method.kind != physics::RelaxerKind::Global;
    result.cycles = r.cycles.value_or(few ? usual_cycles_per_push : usual_cycles);
    result.tolerance = r.tolerance;
    if (r.tolerance) result.method.tolerance = *r.tolerance;

    const auto variation = variation_of(r);
    Vessel vessel = r.tube ? tube_vessel(r, variation) : anatomy_vessel(r, variation);
    result.stiffness = vessel.stiffness;
    if (r.wire) {
        result.wire = wire_through(io::load_points(*r.wire), r.wire->string(), r.rigidity, ends);
        result.segments = result.wire.segments();
    } else {
        result.segments = *r.segments;
        result.wire = wire_on(vessel, result.segments, *r.segment_length, r.rigidity, ends);
        if (r.push_from) result.wire = wire_on(vessel, *r.push_from, *r.segment_length, r.rigidity, ends);
    }
    result.wire.devices[0].spec.outer_diameter = r.wire_diameter;
    result.wire.load = load;
    if (r.entry_direction) {
        result.wire.tangents[0] = direction(*r.entry_direction);
        Vec3 other;
        geometry::tangent_basis(result.wire.tangents[0], result.wire.base_director, other);
    }
    check_inside(vessel, result.wire, r.wire ? r.wire->string() : "--segments");
    result.wall = std::move(vessel.wall);
    return result;
}

}  // namespace run
