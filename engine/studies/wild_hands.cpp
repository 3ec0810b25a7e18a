#include "engine/studies/wild_hands.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "engine/anatomy/anatomy_writer.h"
#include "engine/anatomy/import/lumen_import.h"
#include "engine/io/cpu_clock.h"
#include "engine/io/files.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using geometry::Vec3;

constexpr double largest_push = 30;                    // a frame [mm]
constexpr double largest_turn = 2 * std::numbers::pi;  // a frame [rad]
constexpr int frames_of_a_trend = 40, frames_of_a_grip = 10;
constexpr double planes_rest_limit = 2e-3;  // |g|/C on a wall of planes, whose forces jump
constexpr double reach_limit = 1.5;         // of an open end's disc, radii
/// The smooth wall rounds off creases of the mesh, and facets lie inside round vessels [mm].
constexpr double smoothing = 0.15;

const std::array<Vec3, 5> rays = {Vec3(0.31, 0.47, 0.83).normalized(), Vec3(-0.71, 0.23, 0.4).normalized(),
                                  Vec3(0.2, -0.9, 0.31).normalized(), Vec3(-0.4, -0.3, -0.86).normalized(),
                                  Vec3(0.9, -0.1, -0.42).normalized()};

/// A mesh from elsewhere and a suitable wire.
struct Import {
    const char *mesh, *wire;
    double inserted;  // [mm]
};
constexpr Import imports[] = {{"carotid_stenosis_lumen.stl", "floppy014", 20},
                              {"sofa_carotids.stl", "floppy014", 20},
                              {"sofa_phantom.obj", "glide035", 40}};

/// Writes the anatomy and a scenario of it to the cache, so that readers can play it.
scenario::Scenario imported(const Import& import, const std::filesystem::path& mesh,
                            const StudyOptions& options) {
    anatomy::ImportOptions how;
    how.unit = "mm";
    how.threads = 1;
    const anatomy::Anatomy anatomy = anatomy::import_lumen(mesh, how).anatomy;
    const std::filesystem::path folder = options.cache.folder / "imported";
    const std::filesystem::path file =
        anatomy::write_anatomy(anatomy, folder, {{"mesh", mesh.filename().string()}});
    const std::string text = fmt::format(
        "schema = 1\ntitle = \"{0}\"\nanatomy = \"{1}\"\n\n[entry]\nend = \"{2}\"\ninserted_mm = {3:.1f}\n\n"
        "[guidewire]\ndevice = \"{4}\"\n\n[wall]\nstiffness_N_per_mm = 20.0\n\n[target]\nname = \"{5}\"\n",
        import.mesh, file.filename().string(), anatomy.ends.front().opening.name, import.inserted,
        import.wire, anatomy.targets.front().name);
    const std::filesystem::path scenario = folder / (mesh.stem().string() + ".toml");
    io::write_whole(scenario, text);
    return scenario::load_scenario(scenario, options.devices);
}

}  // namespace

void WildHand::act(exercise::Simulation& simulation) {
    if (frame_ % frames_of_a_trend == 0) trend_ = 2 * unit() - 0.6;
    const auto devices = simulation.devices();
    if (frame_++ % frames_of_a_grip == 0 && devices.size() > 1) {
        const std::size_t k = random_() % (devices.size() + 1);
        held_ = k < devices.size() ? devices[k].role : script::Held::All;
    }
    const double what = unit();
    if (what < 0.7) {
        const double a = unit(), b = unit(), length = largest_push * a * b;
        if (unit() < 0.5 + 0.5 * trend_)
            simulation.apply(script::Advance{length, held_});
        else
            simulation.apply(script::Withdraw{length, held_});
    }
    if (what > 0.4) {
        const double a = unit(), b = unit();
        simulation.apply(script::Rotate{largest_turn * (2 * a - 1) * b, held_});
    }
}

Exits::Exits(const anatomy::Anatomy& anatomy) {
    for (const anatomy::VesselEnd& end : anatomy.ends)
        discs_.push_back(
            {end.opening.centre, end.opening.outward_normal, reach_limit * end.opening.radius, 0});
    for (const geometry::BoundaryLoop& rim : geometry::topology(anatomy.lumen).loops) {
        const auto distance = [&](const Disc& disc) { return (disc.centre - rim.centroid).norm(); };
        Disc& disc = *std::min_element(discs_.begin(), discs_.end(), [&](const Disc& a, const Disc& b) {
            return distance(a) < distance(b);
        });
        for (const int v : rim.vertices)
            disc.inside = std::max(disc.inside, (disc.centre - anatomy.lumen.vertices[v]).dot(disc.outward));
    }
}

std::vector<bool> Exits::beyond(const physics::Chain& wire) const {
    std::vector<int> out(wire.joints.size(), 0);
    for (const Disc& disc : discs_) {
        const double inside = disc.inside + wire.inner_radius();
        const auto beyond_disc = [&](const Vec3& x) { return (x - disc.centre).dot(disc.outward) + inside; };
        // The introducer lies in the plane of its end: the wire begins inside.
        double before = std::min(beyond_disc(wire.joints[0]), -1e-9);
        int crossed = 0;
        for (int i = 1; i <= wire.segments(); ++i) {
            const double beyond = beyond_disc(wire.joints[i]);
            if ((beyond > 0) != (before > 0)) {
                const double part = before / (before - beyond);
                const Vec3 at = wire.joints[i - 1] + part * (wire.joints[i] - wire.joints[i - 1]);
                if ((at - disc.centre).norm() < disc.radius) crossed += beyond > 0 ? 1 : -1;
            }
            out[i] += std::max(crossed, 0);
            before = beyond;
        }
    }
    return {out.begin(), out.end()};
}

bool RawLumen::encloses(const Vec3& x) const {
    int votes = 0;
    for (const Vec3& ray : rays) votes += closed_.crossings(x, ray, 64) % 2;
    return 2 * votes > static_cast<int>(rays.size());
}

double RawLumen::outside_by(const Vec3& x, double within) const {
    return encloses(x) ? -wall_.nearest(x, within).distance : wall_.distance(x);
}

void WildTally::add(const WildTally& other) {
    frames += other.frames;
    segments = std::max(segments, other.segments);
    restless += other.restless;
    gradient = std::max(gradient, other.gradient);
    folds += other.folds;
    outside += other.outside;
    outside_frames += other.outside_frames;
    reported_crossings += other.reported_crossings;
    beyond_force += other.beyond_force;
    beyond_force_by = std::max(beyond_force_by, other.beyond_force_by);
    left += other.left;
    refused += other.refused;
    settling += other.settling;
    lagging += other.lagging;
    largest_lag = std::max(largest_lag, other.largest_lag);
    deepest = std::max(deepest, other.deepest);
    largest_force = std::max(largest_force, other.largest_force);
    times.insert(times.end(), other.times.begin(), other.times.end());
    incidents.insert(incidents.end(), other.incidents.begin(), other.incidents.end());
}

WildJudge::WildJudge(const exercise::Simulation& simulation)
    : name_(simulation.scenario().name),
      lumen_(simulation.anatomy()),
      exits_(simulation.anatomy()),
      rest_(simulation.wall().smooth() ? rest_limit : planes_rest_limit) {}

void WildJudge::judge(const exercise::Simulation& simulation, const exercise::StepReport& report,
                      std::uint64_t seed, int frame, WildTally& tally) const {
    const physics::Chain& wire = simulation.wire();
    const auto contacts = physics::all_contacts(wire, simulation.wall());
    const auto add_incident = [&](const std::string& what) {
        tally.incidents.push_back({name_, seed, frame, what});
    };
    ++tally.frames;
    tally.segments = std::max(tally.segments, wire.segments());
    const double gradient = physics::relative_gradient(wire, contacts);
    tally.gradient = std::max(tally.gradient, gradient);
    if (!(gradient <= rest_)) {
        ++tally.restless;
        add_incident(fmt::format("not at rest: |g|/C {:.1e}", gradient));
    }
    int sharpest = 0;
    for (int i = 0; i < wire.segments(); ++i)
        if (wire.tangents[i].dot(wire.tangents[i + 1]) <
            wire.tangents[sharpest].dot(wire.tangents[sharpest + 1]))
            sharpest = i;
    if (wire.tangents[sharpest].dot(wire.tangents[sharpest + 1]) < 0) {
        ++tally.folds;
        add_incident(fmt::format("joint {} of {} is folded", sharpest, wire.segments()));
    }
    const bool reported = report.deepest_crossing > 0;
    tally.reported_crossings += reported;
    const std::vector<bool> left = exits_.beyond(wire);
    tally.left += std::find(left.begin(), left.end(), true) != left.end();
    int outside = 0, worst = 0;
    double excess = 0;
    for (int i = 1; i <= wire.segments(); ++i) {
        const physics::WallContact& c = contacts[i];
        if (left[i]) continue;
        tally.deepest = std::max(tally.deepest, c.penetration);
        tally.largest_force = std::max(tally.largest_force, c.force());
        const double radius = wire.inner_radius() + wire.thickness[i];
        const double outside_by = lumen_.outside_by(wire.joints[i], radius);
        outside += outside_by > 0;
        const double more = outside_by + radius - std::max(c.penetration, 0.0);
        if (more > smoothing) {
            ++tally.beyond_force;
            if (more > excess) excess = more, worst = i;
        }
    }
    tally.beyond_force_by = std::max(tally.beyond_force_by, excess);
    if (excess > 0)
        add_incident(fmt::format("joint {} of {} is {:.2f} mm deeper than its force explains", worst,
                                 wire.segments(), excess));
    if (outside > 0 && !reported) {
        tally.outside += outside;
        ++tally.outside_frames;
        add_incident(fmt::format("{} joints outside the mesh", outside));
    }
    tally.refused += report.refused;
    if (report.refused) add_incident("a motion was refused");
    tally.settling += report.settling;
    const double lag = std::abs(report.waiting_insertion);
    tally.lagging += lag > 1e-9 || std::abs(report.waiting_rotation) > 1e-9;
    tally.largest_lag = std::max(tally.largest_lag, lag);
}

WildTally play_wildly(exercise::Simulation& simulation, const WildJudge& judge, std::uint32_t seed,
                      int frames) {
    simulation.reset();
    WildHand hand(seed);
    WildTally tally;
    for (int frame = 0; frame < frames; ++frame) {
        hand.act(simulation);
        const double start = io::thread_cpu_seconds();
        const exercise::StepReport report = simulation.step();
        tally.times.push_back(1e3 * (io::thread_cpu_seconds() - start));
        judge.judge(simulation, report, seed, frame, tally);
    }
    return tally;
}

std::vector<scenario::Scenario> wild_scenarios(const StudyOptions& options) {
    std::vector<scenario::Scenario> list;
    if (std::filesystem::is_directory(options.scenarios))
        for (const std::filesystem::path& file : scenario::shipped_scenarios(options.scenarios))
            if (!options.quick || file.stem() == "s_bend" || file.stem() == "renal")
                list.push_back(scenario::load_scenario(file, options.devices));
    if (options.quick) return list;
    for (const Import& import : imports)
        if (const std::filesystem::path mesh = options.real_meshes / import.mesh;
            std::filesystem::exists(mesh))
            list.push_back(imported(import, mesh, options));
    return list;
}

}  // namespace studies
