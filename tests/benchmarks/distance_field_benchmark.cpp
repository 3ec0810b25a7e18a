/// Times of the smooth wall: a query with its Hessian, and making the field.

#include <benchmark/benchmark.h>

#include "engine/anatomy/anatomy.h"
#include "physics/distance_field.h"
#include "physics/guidewire.h"

using namespace physics;

namespace {

const engine::Anatomy& iliac() {
    static const engine::Anatomy anatomy =
        engine::load_anatomy(SELDINGER_SOURCE "/assets/anatomy/iliac.anatomy.json");
    return anatomy;
}

/// Each triangle cut into four, `times` times over, at the middles of its edges: the same surface.
TriangleMesh subdivided(TriangleMesh mesh, int times) {
    for (; times > 0; --times) {
        TriangleMesh fine;
        for (const auto& t : mesh.triangles) {
            const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
            const int n = static_cast<int>(fine.vertices.size());
            // Sums of two numbers are the same either way round: the field welds what meets.
            fine.vertices.insert(fine.vertices.end(), {a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)});
            for (const auto& corner : {std::array{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}})
                fine.triangles.push_back({n + corner[0], n + corner[1], n + corner[2]});
        }
        mesh = std::move(fine);
    }
    return mesh;
}

/// Joints close to the wall of the iliac anatomy, each asked with its own station as the hint.
void wall_query_by_field(benchmark::State& state) {
    static const DistanceField wall(iliac().lumen, iliac().branches, iliac().openings(), 20.0, 0.44,
                                    {.threads = 2});
    std::vector<Vec3> joints;
    for (const auto& branch : iliac().branches)
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
    state.counters["ns_per_query"] =
        benchmark::Counter(static_cast<double>(joints.size()) * 1e-9,
                           benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
    state.counters["MB"] = static_cast<double>(wall.bytes()) * 1e-6;
}
BENCHMARK(wall_query_by_field)->ArgName("motion_um")->Arg(300)->Arg(10);

void make_field(benchmark::State& state) {
    const TriangleMesh mesh = subdivided(iliac().lumen, static_cast<int>(state.range(0)));
    for (auto _ : state) {
        const DistanceField wall(mesh, iliac().branches, iliac().openings(), 20.0, 0.44,
                                 {.threads = static_cast<int>(state.range(1))});
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

}  // namespace
