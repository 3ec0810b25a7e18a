/// Times of the physics on shared scenes: a relaxation cycle, a wall query.

#include <algorithm>
#include <benchmark/benchmark.h>
#include <ctime>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/lumen_wall.h"
#include "engine/anatomy/scenes.h"
#include "engine/studies/plain_wire.h"
#include "physics/relax/discretisation_error.h"
#include "physics/relax/newton_terms.h"
#include "physics/relax/relaxer.h"
#include "physics/relax/response.h"
#include "physics/wall/mesh_wall.h"
#include "physics/wire/crossings.h"
#include "physics/wire/energy.h"
#include "tests/anatomies.h"
#include "tests/benchmarks/push_times.h"
#include "tests/benchmarks/wall_queries.h"
#include "tests/physics/ask_always.h"
#include "tests/physics/refined_course.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

/// The path of `spatial` over and over, longer than this [mm].
Polyline long_way(double length) {
    std::vector<anatomy::PenMove> path;
    while (anatomy::length(path) < length) {
        const auto& piece = anatomy::find_scene("spatial")->path;
        path.insert(path.end(), piece.begin(), piece.end());
    }
    return anatomy::draw(path);
}

/// One whole cycle, ½N(N+1) updates, at N = 200 on sinuous: the start of the way from the centreline.
void one_cycle(benchmark::State& state) {
    const int varied = static_cast<int>(state.range(0));
    auto [wall, start] = scene_setup("sinuous");
    const RelaxerConfig config = segment_config(varied, state.range(1) != 0);
    long long queries = 0, updates = 0;
    for (auto _ : state) {
        Chain wire = start;
        const RelaxReport report = make_relaxer(config, wall)->relax(wire, whole_cycles(200, 1));
        queries += report.wall_queries;
        updates += report.updates;
        benchmark::DoNotOptimize(wire.joints.data());
    }
    const auto cycles = static_cast<double>(state.iterations());
    state.counters["wall_queries"] = static_cast<double>(queries) / cycles;
    state.counters["updates_per_s"] =
        benchmark::Counter(static_cast<double>(updates), benchmark::Counter::kIsRate);
}
BENCHMARK(one_cycle)
    ->ArgNames({"M", "safeguard"})
    ->ArgsProduct({{1, 2, 3}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

/// 20 100 updates of M = 2, a cycle at N = 200, of a wire of N segments of 1 mm in the mesh of the spatial
/// scene's tube over and over. Form 0: every joint asked at every update; 1: those that may touch; 2: stored
/// planes, once a sweep.
void forms_of_the_segment_method(benchmark::State& state) {
    const int segments = static_cast<int>(state.range(0));
    const Polyline line = long_way(segments + 10);
    const anatomy::Anatomy tube = anatomy::tube_anatomy("tube", line, 2.0);
    const MeshWall mesh(tube.lumen, tube.branches, tube.openings(), 42.0);
    const test::AskAlways always(mesh);
    const Chain scene = scene_setup("spatial").wire;
    const Chain start = physics::wire_along(scene.devices[0].spec, scene.grid, line, segments);
    RelaxerConfig config = segment_config(2, false);
    config.stored_planes = state.range(1) == 2;
    const LumenWall& wall = state.range(1) == 0 ? static_cast<const LumenWall&>(always) : mesh;
    RelaxReport report;
    double energy = 0;
    for (auto _ : state) {
        Chain wire = start;
        report = make_relaxer(config, wall)->relax(wire, {20'100, 0, 0});
        energy = total_energy(wire, all_contacts(wire, mesh)).total();
    }
    state.counters["queries"] = static_cast<double>(report.wall_queries);
    state.counters["energy_N_mm"] = energy;
}
BENCHMARK(forms_of_the_segment_method)
    ->ArgNames({"N", "form"})
    ->ArgsProduct({{200, 400, 800}, {0, 1, 2}})
    ->Unit(benchmark::kMillisecond);

void wall_query_by_ray(benchmark::State& state) {
    static const anatomy::Anatomy anatomy = test::iliac_renal();
    time_wall_queries(state, MeshWall(anatomy.lumen, anatomy.branches, anatomy.openings(), 20.0, 0.44));
}
BENCHMARK(wall_query_by_ray)->ArgName("motion_um")->Arg(10)->Arg(300);

void wall_query_of_a_tube(benchmark::State& state) {
    auto [wall, wire] = scene_setup("sinuous");
    auto contacts = all_contacts(wire, wall);
    for (auto _ : state) {
        wall.contacts(wire.joints, contacts);
        benchmark::DoNotOptimize(contacts.data());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<long long>(contacts.size()));
}
BENCHMARK(wall_query_of_a_tube);

constexpr const char* tubes[] = {"sinuous", "spatial", "hairpin", "stiffwall"};

/// From the centreline to |g|/C ≤ 1e-8 with the certificate.
void global_cold_start(benchmark::State& state) {
    auto [wall, start] = scene_setup(tubes[state.range(0)]);
    const auto relaxer = global_relaxer(wall);
    RelaxReport report;
    for (auto _ : state) {
        Chain wire = start;
        report = relaxer->relax(wire, unlimited);
    }
    state.SetLabel(tubes[state.range(0)]);
    state.counters["steps"] = report.newton_steps;
    state.counters["converged"] = report.converged();
}
BENCHMARK(global_cold_start)->DenseRange(0, 3)->Unit(benchmark::kMillisecond);

/// One segment (or a burst of them) pushed in by a hub, each push to full equilibrium, over the second half
/// of the tube.
void global_push(benchmark::State& state) {
    const auto [wall, start] = scene_setup(tubes[state.range(0)]);
    push_through(state, wall, wall.centreline(), start.devices[0].spec, start.grid, start.segments(),
                 static_cast<int>(state.range(1)));
    state.SetLabel(tubes[state.range(0)]);
}
BENCHMARK(global_push)->ArgsProduct({{0, 1, 2, 3}, {1, 20}})->Unit(benchmark::kMillisecond);

/// A course of pushes into a random tube by segments that keep an error of the tip [µm], with estimates and
/// the rests after changes; 0: uniform ones of λ/8, which keep 0.03 mm in five of six rests.
void global_course_within(benchmark::State& state) {
    const double tolerance = 1e-3 * static_cast<double>(state.range(1));
    const auto seed = static_cast<std::uint64_t>(state.range(0));
    double segments = 0, pushes = 0;
    for (auto _ : state) {
        if (tolerance > 0) {
            RefinedCourse course(seed, tolerance);
            for (int hand = 0; hand < course.tube.hands; ++hand) course.push();
            segments = course.tube.chain.segments(), pushes = course.tube.hands;
        } else {
            RandomTube tube(seed, {.finer = 8, .pushed = false});
            for (int hand = 0; hand < tube.hands; ++hand) tube.push_all(tube.hand);
            segments = tube.chain.segments(), pushes = tube.hands;
        }
    }
    state.counters["segments"] = segments;
    state.counters["pushes"] = pushes;
}
BENCHMARK(global_course_within)->ArgsProduct({{0, 1, 2, 3}, {10, 30, 0}})->Unit(benchmark::kMillisecond);

/// The estimate of the tip's error at the end of such a tube, to compare with a push of it.
void global_tip_error(benchmark::State& state) {
    auto [wall, wire] = scene_setup(tubes[state.range(0)]);
    const auto relaxer = global_relaxer(wall);
    relaxer->relax(wire, unlimited);
    const auto contacts = physics::all_contacts(wire, wall);
    physics::ErrorEstimator estimator(wall);
    std::optional<physics::DiscretisationError> error;
    for (auto _ : state) benchmark::DoNotOptimize(error = estimator.of(wire, contacts));
    state.counters["mm"] = error ? error->tip : -1;
    state.SetLabel(tubes[state.range(0)]);
}
BENCHMARK(global_tip_error)->DenseRange(0, 3)->Unit(benchmark::kMicrosecond);

/// The same of its response, with one answer and with five.
void global_tip_response(benchmark::State& state) {
    auto [wall, wire] = scene_setup(tubes[state.range(0)]);
    global_relaxer(wall)->relax(wire, unlimited);
    double mm = 0;
    for (auto _ : state) {
        const physics::Response response(wall, wire);
        for (int k = 0; k < state.range(1); ++k) mm = response.to_rigidity(0, 0.05)->tip().norm();
        benchmark::DoNotOptimize(mm);
    }
    state.counters["mm"] = mm;
    state.SetLabel(tubes[state.range(0)]);
}
BENCHMARK(global_tip_response)->ArgsProduct({{0, 1, 2, 3}, {1, 5}})->Unit(benchmark::kMicrosecond);

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

/// The vessel of `spatial` over and over, its wall as stiff per length for every λ.
SceneSetup long_wire(int segments, double segment_length) {
    const auto spec = studies::PlainWire::uniform(50, segment_length);
    const Polyline line = long_way(segment_length * (segments + 100));
    return {TubeWall(line, 2.0, 42 * segment_length), wire_along(spec, line, segments)};
}

/// Times of a wire [ms]: from the centreline, and of each of 20 mm of pushes after that. A relaxer that
/// `remembers` works in distal windows; a new one for every push, on the whole wire.
struct LongTimes {
    double cold = 0, push = 0, longest_push = 0, idle = 0, window = 0, full_steps = 0;
};
LongTimes time_long_wire(int segments, double segment_length, bool remembers) {
    auto scene = long_wire(segments, segment_length);
    const LumenWall& wall = scene.wall;
    Chain& wire = scene.wire;
    auto relaxer = global_relaxer(wall);
    RelaxReport report;
    auto time = [&] {
        const auto before = std::clock();
        report = relaxer->relax(wire, unlimited);
        return 1e3 * static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
    };
    LongTimes times;
    times.cold = time();
    std::vector<double> pushes, windows, steps;
    for (double pushed = 0; pushed < 20; pushed += segment_length) {
        move(wire, wire.grid.segment_length);
        if (!remembers) relaxer = global_relaxer(wall);
        pushes.push_back(time());
        windows.push_back(report.window);
        steps.push_back(static_cast<double>(report.updates) / wire.segments());
    }
    times.push = median(pushes);
    times.longest_push = *std::max_element(pushes.begin(), pushes.end());
    times.window = median(windows);
    times.full_steps = median(steps);
    times.idle = time();
    return times;
}

void global_long_wire(benchmark::State& state) {
    LongTimes times;
    for (auto _ : state) times = time_long_wire(static_cast<int>(state.range(0)), 1.0, state.range(1) != 0);
    state.counters["cold_ms"] = times.cold;
    state.counters["push_median_ms"] = times.push;
    state.counters["push_max_ms"] = times.longest_push;
    state.counters["window"] = times.window;
    state.counters["full_steps"] = times.full_steps;
    state.counters["idle_ms"] = times.idle;
}
BENCHMARK(global_long_wire)
    ->ArgNames({"N", "windows"})
    ->ArgsProduct({{200, 500, 1000, 2000}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

/// How the time grows with N at a fixed length of 200 mm.
void global_refinement(benchmark::State& state) {
    std::vector<double> cold, push;
    for (auto _ : state) {
        const LongTimes coarse = time_long_wire(200, 1.0, true), fine = time_long_wire(2000, 0.1, true);
        cold.push_back(fine.cold / coarse.cold);
        push.push_back(fine.push / coarse.push);
    }
    state.counters["cold_t2000_over_t200"] = median(cold);
    state.counters["push_t2000_over_t200"] = median(push);
}
BENCHMARK(global_refinement)->Iterations(5)->Unit(benchmark::kMillisecond);

void riccati_backward_pass(benchmark::State& state) {
    auto [wall, wire] = scene_setup("sinuous");
    NewtonTerms terms;
    newton_terms(wire, all_contacts(wire, wall), {}, 1, terms);
    std::vector<RiccatiGain> gains(terms.stages.size());
    const int frames = static_cast<int>(state.range(0));
    const std::vector<FrameStage> frame_stages(frames * gains.size());
    std::vector<FrameGain> frame_gains(frame_stages.size());
    for (auto _ : state)
        benchmark::DoNotOptimize(
            riccati_backward(terms.stages, 1e-3, 1e-9, gains, {frames, frame_stages, {}, frame_gains}));
    state.counters["ns_per_segment"] =
        benchmark::Counter(static_cast<double>(state.iterations()) * 200 * 1e-9,
                           benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(riccati_backward_pass)->ArgName("frames")->DenseRange(0, most_devices);

/// Segments tested for crossings: 300 joints of λ = 1 mm from the left groin up the iliac arteries, along the
/// wall or (where = 0) along the centreline, on a distance field or (mesh = 1) on the mesh by rays.
void crossings_of_300_joints(benchmark::State& state) {
    static const anatomy::Anatomy& anatomy = test::iliac_renal();
    const double stiffness = 20, wire_radius = 0.44;
    std::unique_ptr<LumenWall> wall;
    if (state.range(1) != 0)
        wall = std::make_unique<MeshWall>(anatomy.lumen, anatomy.branches, anatomy.openings(), stiffness,
                                          wire_radius);
    else
        wall = anatomy::cached_distance_field(anatomy, stiffness, wire_radius, test::cache());
    const auto entry = anatomy::path_from(anatomy, *anatomy::find_end(anatomy, "aorta+LCIA+LEIA+LCFA.out"));
    Polyline path;
    for (std::size_t i = 1; i + 1 < entry.points.size(); ++i) {
        Vec3 a, b;
        tangent_basis((entry.points[i + 1] - entry.points[i]).normalized(), a, b);
        path.push_back(entry.points[i] + (state.range(0) != 0 ? entry.radii[i] - wire_radius : 0.0) * a);
    }
    studies::PlainWire spec;
    spec.segment_length = 1;
    spec.curved_length = spec.curved_angle = 0;
    const Chain wire = wire_along(spec, path, 300);
    const auto contacts = all_contacts(wire, *wall);
    std::size_t found = 0;
    for (auto _ : state) {
        found = crossings(wire, contacts, *wall).size();
        benchmark::DoNotOptimize(found);
    }
    state.counters["touching"] = static_cast<double>(std::count_if(
        contacts.begin(), contacts.end(), [](const WallContact& c) { return c.penetration > -0.1; }));
    state.counters["crossings"] = static_cast<double>(found);
}
BENCHMARK(crossings_of_300_joints)
    ->ArgNames({"where", "mesh"})
    ->ArgsProduct({{0, 1}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
