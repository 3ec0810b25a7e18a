/// Times of the physics on shared scenes: a relaxation cycle, a wall query.

#include <algorithm>
#include <benchmark/benchmark.h>
#include <chrono>

#include "engine/anatomy/anatomy.h"
#include "engine/scenes.h"
#include "physics/energy.h"
#include "physics/mesh_wall.h"
#include "physics/newton_terms.h"
#include "physics/relaxer.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

/// One whole cycle, ½N(N+1) updates, at N = 200 on sinuous: the start of the way from the centreline.
void one_cycle(benchmark::State& state) {
    const int varied = static_cast<int>(state.range(0));
    auto [wall, start] = scene_setup("sinuous");
    RelaxerConfig config;
    config.kind = RelaxerKind::Segment;
    config.varied_segments = varied;
    config.safeguard = state.range(1) != 0;
    long long queries = 0, updates = 0;
    for (auto _ : state) {
        Guidewire wire = start;
        const RelaxReport report = make_relaxer(config)->relax(wire, wall, whole_cycles(200, 1));
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

/// Joints close to the wall of the iliac anatomy (51 899 triangles), each asked with its own station as the
/// hint.
void wall_query_by_ray(benchmark::State& state) {
    static const engine::Anatomy anatomy =
        engine::load_anatomy(SELDINGER_SOURCE "/assets/anatomy/iliac.anatomy.json");
    const MeshWall wall(anatomy.lumen, anatomy.branches, anatomy.openings(), 20.0, 0.44);
    std::vector<Vec3> joints;
    for (const auto& branch : anatomy.branches)
        for (std::size_t i = 4; i + 4 < branch.points.size(); i += 2) {
            Vec3 a, b;
            tangent_basis((branch.points[i + 1] - branch.points[i]).normalized(), a, b);
            joints.push_back(branch.points[i] + (branch.radii[i] - 0.44 + 0.02) * (i % 4 ? a : b));
        }
    std::vector<WallContact> contacts(joints.size());
    wall.contacts(joints, contacts);
    const auto motion = static_cast<double>(state.range(0)) * 1e-3;
    double sign = 1;
    for (auto _ : state) {
        for (Vec3& x : joints) x.x() += sign * motion;
        sign = -sign;
        wall.contacts(joints, contacts);
        benchmark::DoNotOptimize(contacts.data());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<long long>(joints.size()));
    state.counters["ns_per_query"] = benchmark::Counter(
        static_cast<double>(state.iterations()) * static_cast<double>(joints.size()) * 1e-9,
        benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
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

RelaxerConfig global_config() {
    RelaxerConfig config;
    config.kind = RelaxerKind::Global;
    return config;
}
constexpr RelaxBudget unlimited{1'000'000'000, 0, 0};
constexpr const char* tubes[] = {"sinuous", "spatial", "hairpin", "stiffwall"};

/// From the centreline to |g|/C ≤ 1e-8 with the certificate.
void global_cold_start(benchmark::State& state) {
    auto [wall, start] = scene_setup(tubes[state.range(0)]);
    const auto relaxer = make_relaxer(global_config());
    RelaxReport report;
    for (auto _ : state) {
        Guidewire wire = start;
        report = relaxer->relax(wire, wall, unlimited);
    }
    state.SetLabel(tubes[state.range(0)]);
    state.counters["steps"] = report.newton_steps;
    state.counters["converged"] = report.converged;
}
BENCHMARK(global_cold_start)->DenseRange(0, 3)->Unit(benchmark::kMillisecond);

/// One segment (or a burst of them) pushed in, each push to full equilibrium, over the second half of the
/// tube.
void global_push(benchmark::State& state) {
    auto [wall, start] = scene_setup(tubes[state.range(0)]);
    const int burst = static_cast<int>(state.range(1));
    const auto relaxer = make_relaxer(global_config());
    std::vector<double> times;
    int unconverged = 0;
    for (auto _ : state) {
        Guidewire wire = wire_along(start.spec, wall.centreline(), 20);
        relaxer->relax(wire, wall, unlimited);
        while (wire.segments() + burst <= start.segments()) {
            const auto before = std::chrono::steady_clock::now();
            bool converged = true;
            for (int k = 0; k < burst; ++k) {
                insert_segment(wire);
                converged = relaxer->relax(wire, wall, unlimited).converged;
            }
            const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - before;
            if (wire.segments() > start.segments() / 2) times.push_back(time.count());
            unconverged += !converged;
        }
    }
    std::sort(times.begin(), times.end());
    state.SetLabel(tubes[state.range(0)]);
    state.counters["median_ms"] = times[times.size() / 2];
    state.counters["max_ms"] = times.back();
    state.counters["unconverged"] = unconverged;
}
BENCHMARK(global_push)->ArgsProduct({{0, 1, 2, 3}, {1, 20}})->Unit(benchmark::kMillisecond);

void riccati_backward_pass(benchmark::State& state) {
    auto [wall, wire] = scene_setup("sinuous");
    NewtonTerms terms;
    assemble(wire, all_contacts(wire, wall), {}, 1, terms);
    std::vector<RiccatiGain> gains(terms.stages.size());
    for (auto _ : state)
        benchmark::DoNotOptimize(riccati_backward(terms.stages, 1e-3, 1e-9, state.range(0) != 0, gains));
    state.counters["ns_per_segment"] =
        benchmark::Counter(static_cast<double>(state.iterations()) * 200 * 1e-9,
                           benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(riccati_backward_pass)->ArgName("twist")->Arg(0)->Arg(1);

}  // namespace
