/// Times of the smooth wall: a query with its Hessian, making the field, and pushing a wire through it.

#include <benchmark/benchmark.h>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/scenes.h"
#include "engine/studies/plain_wire.h"
#include "physics/wall/distance_field.h"
#include "physics/wire/chain.h"
#include "render/patient/solids.h"
#include "tests/anatomies.h"
#include "tests/benchmarks/push_times.h"
#include "tests/benchmarks/wall_queries.h"

using namespace physics;

namespace {

/// Each triangle cut into four, `times` times over.
TriangleMesh subdivided(TriangleMesh mesh, long times) {
    for (; times > 0; --times) mesh = render::subdivided(mesh);
    return mesh;
}

void wall_query_by_field(benchmark::State& state) {
    static const DistanceField wall(test::iliac_renal().lumen, test::iliac_renal().branches,
                                    test::iliac_renal().openings(), 20.0, 0.44, {.threads = 2});
    time_wall_queries(state, wall);
    state.counters["MB"] = static_cast<double>(wall.bytes()) * 1e-6;
}
BENCHMARK(wall_query_by_field)->ArgName("motion_um")->Arg(300)->Arg(10);

void make_field(benchmark::State& state) {
    const TriangleMesh mesh = subdivided(test::iliac_renal().lumen, state.range(0));
    for (auto _ : state) {
        const DistanceField wall(mesh, test::iliac_renal().branches, test::iliac_renal().openings(), 20.0,
                                 0.44, {.threads = static_cast<int>(state.range(1))});
        benchmark::DoNotOptimize(wall.bytes());
    }
    state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
}
BENCHMARK(make_field)
    ->ArgNames({"subdivided", "threads"})
    ->Args({0, 1})
    ->Args({0, 2})
    ->Args({2, 2})
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// The paper's tubes as meshes of about so many thousand triangles: what global_push does in closed form.
void global_push_in_a_mesh(benchmark::State& state) {
    const anatomy::Scene& scene = *anatomy::find_scene(state.range(0) == 0 ? "sinuous" : "spatial");
    const Polyline path = anatomy::draw(scene.path);
    double length = 0;
    for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).norm();
    // Facets as wide as they are long.
    const double area = 2 * std::numbers::pi * scene.radius * length;
    const double step = std::sqrt(2 * area / (1e3 * static_cast<double>(state.range(1))));
    const int around = static_cast<int>(2 * std::numbers::pi * scene.radius / step);
    const anatomy::Anatomy tube =
        anatomy::tube_anatomy(std::string(scene.name), path, scene.radius, around, step);
    const DistanceField wall(tube.lumen, tube.branches, tube.openings(), scene.wall_stiffness, 0.0,
                             {.threads = 2});
    const auto spec = studies::PlainWire::uniform(scene.rigidity, scene.segment_length);
    push_through(state, wall, tube.branches[0].points, spec.device(), spec.grid(), scene.segments, 1);
    state.SetLabel(std::string(scene.name));
    state.counters["triangles"] = static_cast<double>(tube.lumen.triangles.size());
    state.counters["MB"] = static_cast<double>(wall.bytes()) * 1e-6;
}
BENCHMARK(global_push_in_a_mesh)
    ->ArgsProduct({{0, 1}, {50, 1000}})
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond);

/// From the left groin through the iliac arteries into the aorta: 165 segments of 2 mm.
void global_push_in_the_iliac_artery(benchmark::State& state) {
    const TriangleMesh mesh = subdivided(test::iliac_renal().lumen, state.range(0));
    const anatomy::EntryPath entry = anatomy::path_from(
        test::iliac_renal(), *anatomy::find_end(test::iliac_renal(), "aorta+LCIA+LEIA+LCFA.out"));
    const studies::PlainWire spec;
    const DistanceField wall(mesh, test::iliac_renal().branches, test::iliac_renal().openings(), 20.0,
                             0.5 * spec.diameter, {.threads = 2});
    push_through(state, wall, entry.points, spec.device(), spec.grid(), 165, 1);
    state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
    state.counters["MB"] = static_cast<double>(wall.bytes()) * 1e-6;
}
BENCHMARK(global_push_in_the_iliac_artery)->Arg(0)->Arg(2)->Iterations(3)->Unit(benchmark::kMillisecond);

}  // namespace
