#include "engine/studies/wild_hands.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>
#include <random>

#include "engine/anatomy/anatomy_writer.h"
#include "engine/anatomy/import/lumen_import.h"
#include "engine/anatomy/scenes.h"
#include "engine/io/cpu_clock.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/studies/plain_wire.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/relax/hub.h"
#include "physics/wall/even_rims.h"
#include "physics/wall/past_end.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

constexpr double largest_push = 30;                    // a frame [mm]
constexpr double largest_turn = 2 * std::numbers::pi;  // a frame [rad]
constexpr int frames_of_a_trend = 40, frames_of_a_grip = 10;
constexpr double planes_rest_limit = 2e-3;  // |g|/C on a wall of planes, whose forces jump
/// The smooth wall rounds off creases of the mesh, and facets lie inside round vessels [mm].
constexpr double smoothing = 0.2;

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

constexpr int unlimited = 1'000'000'000;  // updates
constexpr double straight_at_start = 22;  // λ
constexpr double straight_at_end = 30;    // [mm]
constexpr double sharpest_arc = 1.2;      // radius relative to the lumen's
constexpr double largest_excess = 0.05;   // of the energy, beyond the hand's work
constexpr double excess_floor = 1e-3;     // [N·mm]

/// Random numbers that are the same on every machine, unlike the standard's distributions.
class Draw {
public:
    explicit Draw(std::uint64_t seed) : random_(seed) {}
    double unit() { return std::ldexp(static_cast<double>(random_() >> 11), -53); }  // [0, 1)
    double between(double from, double to) { return from + (to - from) * unit(); }
    double by_logarithm(double from, double to) { return from * std::pow(to / from, unit()); }

private:
    std::mt19937_64 random_;
};

/// Pushes, with the outcome of each by its own figures and by the energy module.
class Course {
public:
    Course(std::uint64_t seed, int most_pushes, const TubeRange& range)
        : most_(most_pushes),
          tube_(random_tube(seed, range)),
          wall_(tube_.centreline, tube_.radius, tube_.wall_stiffness),
          hub_({}, wall_),
          wire_(wire_along(PlainWire::uniform(tube_.rigidity, tube_.segment_length), tube_.centreline,
                           segments_at_start)) {
        course_.seed = seed;
        last_ = hub_.settle(wire_, unlimited).relax;
        energy_ = energy_of(wire_, wall_);
    }

    TubeCourse run() {
        const double whole = tube_.segments * tube_.segment_length;
        while (course_.pushes < most_ && wire_.inserted_length() < whole - 1e-6)
            if (!push()) break;
        course_.reached = wire_.segments();
        course_.tube = std::move(tube_);
        return std::move(course_);
    }

private:
    /// Returns false where nothing can follow.
    bool push() {
        const double lambda = tube_.segment_length;
        double left = lambda, work = 0, time = 0;
        int steps = 0;
        bool refused = false;
        while (left > 1e-9 * lambda && !refused) {
            const double before = hand_force();
            const double start = io::thread_cpu_seconds();
            const physics::HubReport made = hub_.move(wire_, {left, 0}, unlimited);
            time += io::thread_cpu_seconds() - start;
            last_ = made.relax;
            steps += last_.newton_steps;
            refused = made.outcome != physics::HubReport::Outcome::AtRest;
            left -= made.made.feed;
            work += made.made.feed * std::max({before, hand_force(), 0.0});
            if (!last_.converged()) break;
        }
        course_.times.push_back(1e3 * time);
        course_.steps += steps;
        ++course_.pushes;
        return judge(refused, work);
    }

    /// Rise of the energy at rest per length let in [N]. At rest nothing else changes the energy, so the
    /// wire's directions are kept as they are. The force along the wire at its introducer equals this except
    /// for the length of the segments, whose joints are not quite where the curve touches the wall.
    double hand_force() const {
        const double little = 1e-5 * tube_.segment_length;
        physics::Chain longer = wire_;
        physics::feed(longer, physics::every_device, little);
        if (longer.segments() != wire_.segments()) return 0;  // the segment grew beyond what it may be
        const auto contacts = physics::all_contacts(longer, wall_);
        return (physics::total_energy(longer, contacts).total() - energy_of(wire_, wall_)) / little;
    }

    /// Depth to which the wire would go if the hub let it [mm].
    double depth_of_next_rest() const {
        double deepest = 0;
        for (const double part : {1.0 / 32, 1.0 / 4}) {
            physics::Chain wire = wire_;
            physics::feed(wire, physics::every_device, part * tube_.segment_length);
            physics::make_relaxer({}, wall_)->relax(wire, {unlimited, 0, 0});
            deepest = std::max(deepest, physics::largest_penetration(physics::all_contacts(wire, wall_)));
        }
        return deepest;
    }

    bool judge(bool refused, double work) {
        const auto contacts = physics::all_contacts(wire_, wall_);
        const double gradient = physics::relative_gradient(wire_, contacts), now = energy_of(wire_, wall_),
                     depth = physics::largest_penetration(contacts), excess = now - energy_ - work;
        energy_ = now;
        const double bend = last_.largest_bend / geometry::degree;
        const bool fold = bend > 90, deep = depth > tube_.radius;
        const double next = refused ? depth_of_next_rest() : 0;
        const bool gave_way = next > tube_.radius;
        count(refused && !gave_way, course_.refused, fmt::format("refused: {:.3g} mm deep", depth));
        count(
            gave_way, course_.gave_way,
            fmt::format("refused: the next rest is {:.3g} mm outside a lumen of {:.3g}", next, tube_.radius));
        if (!refused) {
            course_.gradient = std::max(course_.gradient, gradient);
            course_.excess = std::max(course_.excess, excess / std::max(now, excess_floor));
            course_.flat += last_.at_rest() && !last_.converged();
            count(!last_.at_rest(), course_.unconverged,
                  fmt::format("not at rest: |g|/C {:.1e}", last_.gradient));
            count(!(gradient <= rest_limit), course_.restless, fmt::format("|g|/C {:.1e}", gradient));
            count(fold, course_.folds, fmt::format("a joint bent by {:.0f}°", bend));
            count(deep, course_.deep, fmt::format("{:.3g} mm outside", depth));
            count(excess > largest_excess * now + excess_floor, course_.over_work,
                  fmt::format("energy {:.3g} N·mm, of which {:.2g} are not the hand's", now, excess));
        }
        return !refused && !fold && !deep;
    }

    void count(bool found, int& counter, const std::string& what) {
        if (!found) return;
        ++counter;
        course_.incidents.push_back({"random tube", course_.seed, course_.pushes - 1, what});
    }

    int most_;
    RandomTube tube_;
    physics::TubeWall wall_;
    physics::Hub hub_;
    physics::Chain wire_;
    physics::RelaxReport last_;
    double energy_ = 0;  // [N·mm]
    TubeCourse course_;
};

}  // namespace

void WildHand::act(exercise::Simulation& simulation) {
    if (frame_ % frames_of_a_trend == 0) trend_ = 2 * unit() - 0.6;
    const auto devices = simulation.devices();
    if (frame_++ % frames_of_a_grip == 0 && devices.size() > 1) {
        const std::size_t k = random_() % (devices.size() + 1);
        held_ = k < devices.size() ? devices[k].role : script::DeviceRole::All;
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

namespace {

/// With the rims that lie in no plane led on to one, as every wall has them.
anatomy::Anatomy with_even_rims(anatomy::Anatomy anatomy) {
    anatomy.lumen = physics::with_even_rims(anatomy.lumen, anatomy.openings());
    return anatomy;
}

}  // namespace

RawLumen::RawLumen(const anatomy::Anatomy& anatomy)
    : vessels_(with_even_rims(anatomy)), closed_(anatomy::closed_lumen(vessels_)), wall_(vessels_.lumen) {
    for (const geometry::OpenEnd& opening : vessels_.openings()) ends_.push_back({opening, 0});
    for (const geometry::BoundaryLoop& rim : geometry::topology(vessels_.lumen).loops) {
        const auto distance = [&](const End& end) { return (end.opening.centre - rim.centroid).norm(); };
        End& end = *std::min_element(ends_.begin(), ends_.end(),
                                     [&](const End& a, const End& b) { return distance(a) < distance(b); });
        for (const int v : rim.vertices)
            end.inside =
                std::max(end.inside,
                         (end.opening.centre - vessels_.lumen.vertices[v]).dot(end.opening.outward_normal));
    }
}

bool RawLumen::encloses(const Vec3& x) const {
    int votes = 0;
    for (const Vec3& ray : rays) votes += closed_.crossings(x, ray, 64) % 2;
    return 2 * votes > static_cast<int>(rays.size());
}

double RawLumen::outside_mesh_by(const Vec3& x, double within) const {
    return encloses(x) ? -wall_.nearest(x, within).distance : wall_.distance(x);
}

/// The lumen's section, gone on straight for a radius, and what the vessel is from there on, each without
/// the smoothing that the wall gives them.
double RawLumen::outside_by(const Vec3& x, const End& end, double within) const {
    constexpr double in_mesh = 0.05;  // behind the rim, where rays tell inside from outside [mm]
    const geometry::OpenEnd& e = end.opening;
    const double past = (x - e.centre).dot(e.outward_normal);
    double out = std::numeric_limits<double>::infinity();
    if (past < -end.inside - in_mesh || (x - e.centre - past * e.outward_normal).norm() > 2 * e.radius)
        return out;
    // From the plane and from behind all of the rim, which on real meshes is uneven.
    if (past < e.radius)
        for (const double behind : {0.0, end.inside})
            out = std::min(
                out, outside_mesh_by(x - std::max(0.0, past + behind + in_mesh) * e.outward_normal, within));
    if (past < 0) return out;
    const physics::RoundCones cones = physics::cones_past(e);
    for (const physics::RoundCone& cone : cones.all()) {
        // The wall's own ways start smoothly, over 1 mm and a quarter of the radius.
        const double closing = std::max({0.0, past - cone.last - 0.5, cone.first - past - 0.5}),
                     narrowing = cone.narrows * std::max(0.0, past - cone.starts - 0.125 * e.radius),
                     aside = (x - e.centre - past * e.outward_normal - cone.aside).norm();
        out = std::min(out, std::hypot(aside, closing) - cone.radius + narrowing);
    }
    return out;
}

double RawLumen::outside_by(const Vec3& x, double within) const {
    double out = outside_mesh_by(x, within);
    for (const End& end : ends_)
        if (out > 0) out = std::min(out, outside_by(x, end, within));
    return out;
}

void WildTally::add(const WildTally& other) {
    using Tally = WildTally;
    for (const auto count :
         {&Tally::frames, &Tally::restless, &Tally::folds, &Tally::reported_crossings, &Tally::beyond_force,
          &Tally::left, &Tally::refused, &Tally::buckled, &Tally::settling, &Tally::lagging})
        this->*count += other.*count;
    for (const auto most : {&Tally::gradient, &Tally::beyond_force_by, &Tally::deepest_crossing,
                            &Tally::largest_lag, &Tally::deepest, &Tally::largest_force})
        this->*most = std::max(this->*most, other.*most);
    segments = std::max(segments, other.segments);
    times.insert(times.end(), other.times.begin(), other.times.end());
    incidents.insert(incidents.end(), other.incidents.begin(), other.incidents.end());
}

WildJudge::WildJudge(const exercise::Simulation& simulation)
    : name_(simulation.scenario().name),
      lumen_(simulation.anatomy()),
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
    tally.reported_crossings += report.deepest_crossing > 0;
    tally.deepest_crossing = std::max(tally.deepest_crossing, report.deepest_crossing);
    tally.left += report.past_vessel_end;
    int worst = 0;
    double excess = 0;
    for (int i = 1; i <= wire.segments(); ++i) {
        const physics::WallContact& c = contacts[i];
        tally.deepest = std::max(tally.deepest, c.pressed_in());
        tally.largest_force = std::max(tally.largest_force, c.force());
        const double radius = wire.inner_radius() + wire.thickness[i];
        // In the vessel as it has made way.
        const double more =
            lumen_.outside_by(wire.joints[i] - c.given, radius) + radius - std::max(c.pressed_in(), 0.0);
        if (more > smoothing) {
            ++tally.beyond_force;
            if (more > excess) excess = more, worst = i;
        }
    }
    tally.beyond_force_by = std::max(tally.beyond_force_by, excess);
    if (excess > 0)
        add_incident(fmt::format("joint {} of {} at {} is {:.2f} mm deeper than its force explains", worst,
                                 wire.segments(), io::place_text(wire.joints[worst]), excess));
    tally.buckled += report.buckled;
    const bool refused = report.refused && !report.buckled;
    tally.refused += refused;
    if (refused) add_incident("a motion was refused");
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

RandomTube random_tube(std::uint64_t seed, const TubeRange& range) {
    Draw draw(seed);
    RandomTube tube;
    tube.radius = draw.between(1, 6);
    tube.segment_length = draw.between(0.5, 3);
    tube.rigidity = draw.by_logarithm(range.least_rigidity, 2000);
    tube.wall_stiffness = draw.by_logarithm(1, range.most_stiffness);
    tube.segments = 50 + static_cast<int>(351 * draw.unit());
    std::vector<anatomy::PenMove> path = {
        anatomy::Run{std::max(10.0, straight_at_start * tube.segment_length)}};
    const double length_needed = tube.segment_length * (tube.segments + 5);
    while (anatomy::length(path) < length_needed) {
        const double x = draw.between(-1, 1), y = draw.between(-1, 1), z = draw.between(-1, 1);
        const double radius = tube.radius * draw.by_logarithm(sharpest_arc, 20),
                     angle = draw.between(0.2, 2.6);
        path.push_back(anatomy::Arc{radius, (draw.unit() < 0.5 ? -1 : 1) * angle, Vec3(x, y, z)});
        path.push_back(anatomy::Run{draw.between(0, 4 * tube.radius)});
    }
    path.push_back(anatomy::Run{straight_at_end});
    tube.centreline = anatomy::draw(path);
    return tube;
}

TubeCourse push_through(std::uint64_t seed, int most_pushes, const TubeRange& range) {
    return Course(seed, most_pushes, range).run();
}

}  // namespace studies
