#include "engine/studies/stability_cell.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/scenes.h"
#include "engine/io/cpu_clock.h"
#include "engine/studies/plain_wire.h"
#include "engine/studies/slow_flow.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using physics::TubeWall;

void disturb(Chain& wire, const Disturbance& disturbance) {
    for (int k = 0; k < disturbance.inserted; ++k) physics::move(wire, wire.grid.segment_length);
    if (disturbance.turn != 0) physics::rotate(wire, physics::every_device, disturbance.turn);
}

/// Bends the wire slightly, far less than a wire that needs it would yield.
void bow(Chain& wire) {
    Vec3 side, other;
    geometry::tangent_basis(wire.tangents[0], side, other);
    const int n = wire.segments();
    for (int i = 1; i <= n; ++i)
        wire.tangents[i] =
            (wire.tangents[i] + 1e-4 * std::sin(M_PI * i / n) * (side + 0.6 * other)).normalized();
    physics::rebuild_joints(wire);
}

bool finite(const Chain& wire) {
    return std::all_of(wire.joints.begin(), wire.joints.end(), [](const Vec3& x) { return x.allFinite(); });
}

/// Relaxes by this many updates; returns false as soon as a number is not finite.
bool work(physics::Relaxer& relaxer, Chain& wire, long long updates, StabilityCell& cell, bool& at_rest) {
    const physics::RelaxBudget budget{static_cast<int>(std::max(1LL, updates)), 0.0, 0};
    const double start = io::thread_cpu_seconds();
    const physics::RelaxReport report = relaxer.relax(wire, budget);
    cell.cpu += io::thread_cpu_seconds() - start;
    cell.updates += report.updates;
    at_rest = report.converged();
    return finite(wire);
}

constexpr double fixed_rigidity = 50,
                 fixed_stiffness = 0.84 * fixed_rigidity;  // of the paper's scenes, λ = 1 mm

PlainWire line(double segment_length = 1) {
    return PlainWire::uniform(fixed_rigidity, segment_length);
}

/// A wire along the centreline of a named scene.
BreakingCase in_scene(const char* scene_name, int segments, double segment_length, double radius_factor,
                      double stiffness_factor) {
    const anatomy::Scene& scene = *anatomy::find_scene(scene_name);
    const Polyline path = anatomy::draw(scene.path);
    // k per joint is proportional to λ, so that the wall is as stiff per length.
    const double stiffness = fixed_stiffness * segment_length * stiffness_factor;
    BreakingCase c;
    c.wall = std::make_shared<TubeWall>(path, radius_factor * scene.radius, stiffness);
    c.start = wire_along(line(segment_length), path, segments);
    return c;
}

BreakingCase named(BreakingCase c, std::string id, std::string what, std::string how) {
    c.id = std::move(id);
    c.what = std::move(what);
    c.how = std::move(how);
    return c;
}

BreakingCase stiff_wall(bool quick) {
    BreakingCase c = in_scene("sinuous", quick ? 60 : 200, 1, 1, 1000);
    c.cycles = quick ? 60 : 150;
    return named(c, "stiff_wall", "wall ×1000",
                 "The winding tube of radius 1 mm with a wall a thousand times stiffer than usual.");
}

BreakingCase head_on(bool quick, bool exact) {
    const int segments = quick ? 20 : 38;
    BreakingCase c;
    c.wall = std::make_shared<TubeWall>(Polyline{{0, 0, 0}, {segments + 2.0, 0, 0}}, 2.0, fixed_stiffness);
    c.start = wire_along(line(), {{0, 0, 0}, {segments + 1.0, 0, 0}}, segments);
    if (!exact) c.start.tangents[0] = Vec3(1, 1e-3, 0).normalized();
    c.disturbances.assign(6, {1, 0});
    c.cycles = quick ? 600 : 900;
    c.symmetry = exact ? Symmetry::RoundAboutX : Symmetry::MirrorZ;
    c.bowed_reference = true;
    if (exact)
        return named(c, "head_on_exact", "head-on exact",
                     "A wire on the axis of a straight tube of radius 2 mm, pushed six segments into its "
                     "round end, 4 mm ahead of the tip.");
    return named(c, "head_on", "head-on perturbed", "The same with the entry tilted by 1e-3 rad.");
}

BreakingCase fold(bool quick, bool exact) {
    const int half = quick ? 10 : 20;
    BreakingCase c;
    c.wall = std::make_shared<TubeWall>(Polyline{{-2.0, 0, 0}, {2.0 * half, 0, 0}}, 2.0, fixed_stiffness);
    const double angle = std::numbers::pi - (exact ? 0 : 0.01);
    std::vector<Vec3> tangents(half, Vec3::UnitX());
    // cos π = −1 exactly, but sin π is not 0 in doubles.
    tangents.insert(tangents.end(), half, exact ? Vec3(-1, 0, 0) : Vec3(std::cos(angle), std::sin(angle), 0));
    c.start = physics::uniform_wire(fixed_rigidity, 1, {0, 0, 0}, Vec3::UnitX(), tangents);
    c.cycles = quick ? 600 : 900;
    c.symmetry = exact ? Symmetry::RoundAboutX : Symmetry::MirrorZ;
    c.bowed_reference = true;
    if (exact)
        return named(c, "fold_exact", "180° fold exact",
                     "A wire folded back onto itself in a straight tube of radius 5 mm: at the fold Eq. 1 "
                     "has no moment.");
    return named(c, "fold", "180° fold perturbed", "The same with a fold of π − 0.01 rad.");
}

BreakingCase burst(bool quick, int inserted) {
    BreakingCase c = in_scene("sinuous", quick ? 40 : 90, 1, 1, 1);
    flow_to_rest(c.start, *c.wall);
    c.disturbances = {{inserted, 0}};
    c.cycles = quick ? 200 : 600;  // the trial passes of the global relaxer count as work
    return named(c, "burst_" + std::to_string(inserted), std::to_string(inserted) + " segments at once",
                 "A wire at rest in the winding tube of radius 1 mm; the segments stand out straight through "
                 "the wall when they are inserted.");
}

BreakingCase wide_tube(bool quick) {
    BreakingCase c = in_scene("spatial", quick ? 60 : 160, 1, 4, 1);
    c.cycles = quick ? 60 : 150;
    return named(c, "wide_tube", "flat energy in a wide tube",
                 "The spatial tube four times as wide (radius 8 mm): few contacts, an energy that is flat "
                 "about its minimum.");
}

BreakingCase tight_hairpin(bool quick) {
    BreakingCase c = in_scene("hairpin", quick ? 70 : 120, 1, 1, 1);
    c.cycles = quick ? 60 : 300;
    return named(c, "hairpin", "tight hairpin", "Bends of 8 and 6 mm by 3.0 and 2.4 rad, radius 1.5 mm.");
}

BreakingCase turning_tip(bool quick) {
    PlainWire spec = line();
    spec.shaft_rigidity = 250;
    spec.tip_rigidity = 6;
    spec.tip_length = 20;
    spec.transition_length = 30;
    spec.curved_length = 10;
    spec.curved_angle = std::numbers::pi / 3;
    const Polyline path = anatomy::draw(std::vector<anatomy::PenMove>{
        anatomy::Run{20}, anatomy::Arc{40, 1.0, Vec3::UnitZ()}, anatomy::Run{60}});
    BreakingCase c;
    c.wall = std::make_shared<TubeWall>(path, 2.0, fixed_stiffness);
    c.start = wire_along(spec, path, quick ? 50 : 80);
    flow_to_rest(c.start, *c.wall);
    c.disturbances.assign(36, {0, std::numbers::pi / 18});
    c.cycles = quick ? 150 : 600;
    return named(c, "turning_tip", "tip turned 360° at a wall",
                 "A floppy tip bent by 60° over 10 mm in a bent tube of radius 2 mm; the hub is turned by 36 "
                 "times 10°.");
}

BreakingCase long_wire(bool quick) {
    BreakingCase c = quick ? in_scene("sinuous", 300, 0.2, 1, 1) : in_scene("sinuous", 2000, 0.1, 1, 1);
    c.cycles = quick ? 4 : 1;
    return named(c, "long_wire", quick ? "N = 300" : "N = 2000",
                 fmt::format("The winding tube with segments of {} mm.", c.start.grid.segment_length));
}

BreakingCase long_segments(bool quick) {
    BreakingCase c = in_scene("sinuous", quick ? 24 : 66, 3, 1, 1);
    c.cycles = quick ? 100 : 600;
    return named(c, "long_segments", "λ three times the radius",
                 "The winding tube of radius 1 mm with segments of 3 mm.");
}

BreakingCase carina(const StudyOptions& options) {
    const anatomy::Anatomy anatomy =
        anatomy::generated_anatomy(anatomy::vessel_preset("iliac-renal"), options.cache);
    const int inlet = *anatomy::find_end(anatomy, "aorta+LCIA+LEIA+LCFA.in");
    const anatomy::EntryPath entry = anatomy::path_from(anatomy, inlet);
    std::size_t at = 0;  // 60 mm above the bifurcation, heading for it
    while (at + 1 < entry.points.size() && entry.points[at].z() > 65) ++at;
    const Vec3 from = entry.points[at], ridge(-0.8, -1.2, -7.2);
    PlainWire spec;
    spec.curved_length = spec.curved_angle = 0;
    BreakingCase c;
    c.wall = anatomy::cached_distance_field(anatomy, 2.0, 0.5 * spec.diameter, options.cache);
    c.start = straight_wire(spec, from, ridge - from, 25);
    flow_to_rest(c.start, *c.wall);
    c.disturbances.assign(options.quick ? 20 : 30, {1, 0});
    c.cycles = options.quick ? 300 : 1200;
    return named(c, "carina", "carina hit",
                 fmt::format("A wire with a straight floppy tip, aimed from the aorta half a millimetre "
                             "beside the ridge between the iliac arteries and pushed {} segments of {} mm; a "
                             "smooth wall made from {} triangles.",
                             c.disturbances.size(), spec.segment_length, anatomy.lumen.triangles.size()));
}

}  // namespace

std::string_view outcome_text(Outcome outcome) {
    constexpr std::array<std::string_view, outcomes> words = {
        "converged", "still moving", "oscillates", "wrong basin", "left the lumen", "NaN", "stuck"};
    return words[static_cast<std::size_t>(outcome)];
}

Outcome judge(const CellMeasure& m, const StabilityRules& rules) {
    if (!m.finite) return Outcome::NotANumber;
    if (m.penetration >
        std::max(rules.outside * m.clearance, rules.times_reference * m.reference_penetration))
        return Outcome::LeftTheLumen;
    if (m.gradient <= rules.gradient) {
        if (m.basin_deviation > rules.basin) return Outcome::WrongBasin;
        return m.deviation <= rules.basin ? Outcome::Converged : Outcome::StillMoving;
    }
    const std::size_t last_quarter = m.energies.size() - m.energies.size() / 4;
    for (std::size_t i = std::max<std::size_t>(1, last_quarter); i < m.energies.size(); ++i) {
        if (m.energies[i] > m.energies[i - 1] * (1 + rules.rise)) return Outcome::Oscillates;
    }
    return m.moved <= rules.stuck ? Outcome::Stuck : Outcome::StillMoving;
}

double largest_deviation(std::span<const Vec3> a, std::span<const Vec3> b, Symmetry symmetry) {
    if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
    const auto turned = [&](double angle, double mirror) {
        double farthest = 0;
        const double c = std::cos(angle), s = std::sin(angle);
        for (std::size_t i = 0; i < a.size(); ++i) {
            const double y = a[i].y(), z = mirror * a[i].z();
            const Vec3 moved(a[i].x(), c * y - s * z, s * y + c * z);
            farthest = std::max(farthest, (moved - b[i]).norm());
        }
        return farthest;
    };
    if (symmetry == Symmetry::None) return turned(0, 1);
    if (symmetry == Symmetry::MirrorZ) return std::min(turned(0, 1), turned(0, -1));
    double least = std::numeric_limits<double>::infinity();
    for (const double mirror : {1.0, -1.0}) {
        // The rotation that brings the joints nearest in the sum of squares.
        double along = 0, across = 0;
        for (std::size_t i = 0; i < a.size(); ++i) {
            const double y = a[i].y(), z = mirror * a[i].z();
            along += y * b[i].y() + z * b[i].z();
            across += y * b[i].z() - z * b[i].y();
        }
        least = std::min(least, turned(std::atan2(across, along), mirror));
    }
    return least;
}

StabilityReference find_reference(const BreakingCase& c) {
    Chain wire = c.start;
    SlowFlowReport report;
    const auto flow = [&] {
        if (c.bowed_reference) bow(wire);
        report = flow_to_rest(wire, *c.wall);
    };
    if (c.disturbances.empty()) flow();
    for (const Disturbance& disturbance : c.disturbances) {
        disturb(wire, disturbance);
        flow();
    }
    return {wire.joints, report.energy, report.gradient,
            physics::largest_penetration(physics::all_contacts(wire, *c.wall))};
}

StabilityCell run_cell(const BreakingCase& c, const StabilityReference& reference,
                       const physics::RelaxerConfig& config, const StabilityRules& rules) {
    StabilityCell cell;
    Chain wire = c.start;
    const auto relaxer = physics::make_relaxer(config, *c.wall);
    int segments = wire.segments();
    for (const Disturbance& d : c.disturbances) segments += d.inserted;
    const long long all = static_cast<long long>(c.cycles) * segments * (segments + 1) / 2;
    const auto steps = static_cast<long long>(c.disturbances.size());
    // Half of the work comes after the last disturbance, the other half in equal parts before it.
    const long long last = steps > 1 ? all / 2 : all;

    CellMeasure& m = cell.measure;
    m.reference_penetration = reference.penetration;
    bool at_rest = false;
    for (long long k = 0; k < steps && m.finite; ++k) {
        disturb(wire, c.disturbances[static_cast<std::size_t>(k)]);
        if (k + 1 < steps) m.finite = work(*relaxer, wire, (all - last) / (steps - 1), cell, at_rest);
    }
    at_rest = false;
    std::vector<Vec3> before_last_quarter;
    for (int k = 0; k < rules.samples && m.finite; ++k) {
        if (k == rules.samples - rules.samples / 4) before_last_quarter = wire.joints;
        if (!at_rest) m.finite = work(*relaxer, wire, last / rules.samples, cell, at_rest);
        m.energies.push_back(physics::total_energy(wire, physics::all_contacts(wire, *c.wall)).total());
    }
    if (m.finite) {
        const auto contacts = physics::all_contacts(wire, *c.wall);
        cell.energy = m.energies.back();
        m.finite = std::isfinite(cell.energy);
        m.gradient = physics::relative_gradient(wire, contacts);
        m.penetration = physics::largest_penetration(contacts);
        for (std::size_t i = 1; i < contacts.size(); ++i)
            if (contacts[i].penetration == m.penetration) m.clearance = contacts[i].clearance;
        m.moved = largest_deviation(wire.joints, before_last_quarter, Symmetry::None);
        m.deviation = largest_deviation(wire.joints, reference.joints, c.symmetry);
        flow_to_rest(wire, *c.wall);
        m.basin_deviation = largest_deviation(wire.joints, reference.joints, c.symmetry);
    }
    cell.outcome = judge(m, rules);
    return cell;
}

std::vector<BreakingCase> breaking_cases(const StudyOptions& options) {
    const bool quick = options.quick;
    return {stiff_wall(quick),    head_on(quick, true), head_on(quick, false), fold(quick, true),
            fold(quick, false),   burst(quick, 20),     burst(quick, 50),      wide_tube(quick),
            tight_hairpin(quick), turning_tip(quick),   long_wire(quick),      long_segments(quick),
            carina(options)};
}

}  // namespace studies
