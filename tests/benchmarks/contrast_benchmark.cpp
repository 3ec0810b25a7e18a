/// What contrast costs: the matrix of a new pose, a frame's multiplication, a frame's flow.

#include <benchmark/benchmark.h>

#include "engine/blood/contrast_flow.h"
#include "render/patient/solids.h"
#include "render/xray/contrast.h"
#include "tests/anatomies.h"

namespace {

using geometry::Vec3;

blood::ContrastFlow& flow() {
    static blood::ContrastFlow made(test::iliac_renal());
    return made;
}

render::LumenContrast contrast_of(const geometry::TriangleMesh& mesh) {
    return {
        mesh, {flow().nodes().begin(), flow().nodes().end()}, {flow().radii().begin(), flow().radii().end()}};
}

const render::LumenContrast& iliac_renal_contrast() {
    static const render::LumenContrast made = contrast_of(anatomy::closed_lumen(test::iliac_renal()));
    return made;
}

/// As of the renal scenario.
render::CArm arm_of(int pixels) {
    return {.isocentre = Vec3(0, 0, -10), .detector_width = 400, .pixels = pixels};
}

void contrast_matrix(benchmark::State& state) {
    const auto& contrast = iliac_renal_contrast();
    auto arm = arm_of(static_cast<int>(state.range(0)));
    std::size_t entries = 0, pixels = 0;
    for (auto _ : state) {
        arm.lao = arm.lao > 0.5 ? 0.0 : arm.lao + 0.01;
        const auto matrix = contrast.at(arm);
        entries = matrix.nodes.size();
        pixels = matrix.pixels.size();
    }
    state.counters["entries"] = static_cast<double>(entries);
    state.counters["pixels"] = static_cast<double>(pixels);
}
BENCHMARK(contrast_matrix)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);

/// Arg: how often every triangle of the iliac–renal lumen is cut into four.
void contrast_matrix_of_finer_meshes(benchmark::State& state) {
    auto mesh = anatomy::closed_lumen(test::iliac_renal());
    for (int cut = 0; cut < state.range(0); ++cut) mesh = render::subdivided(mesh);
    const auto contrast = contrast_of(mesh);
    for (auto _ : state) benchmark::DoNotOptimize(contrast.at(arm_of(512)));
    state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
}
BENCHMARK(contrast_matrix_of_finer_meshes)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

void contrast_grid(benchmark::State& state) {
    const auto mesh = anatomy::closed_lumen(test::iliac_renal());
    for (auto _ : state) benchmark::DoNotOptimize(contrast_of(mesh));
}
BENCHMARK(contrast_grid)->Unit(benchmark::kMillisecond);

void iodine_of_a_frame(benchmark::State& state) {
    const auto matrix = iliac_renal_contrast().at(arm_of(static_cast<int>(state.range(0))));
    const std::vector<float> iodine(static_cast<std::size_t>(matrix.node_count), 80.0f);
    const std::vector<render::PixelShift> shifts(iodine.size(), {0.4f, 2.3f});
    render::Field out;
    for (auto _ : state) {
        if (state.range(1)) {
            render::iodine_thickness(matrix, iodine, shifts, out);
        } else {
            render::iodine_thickness(matrix, iodine, out);
        }
        benchmark::DoNotOptimize(out.values.data());
    }
}
BENCHMARK(iodine_of_a_frame)
    ->ArgNames({"pixels", "moved"})
    ->Args({512, 0})
    ->Args({512, 1})
    ->Args({1024, 0})
    ->Args({1024, 1})
    ->Unit(benchmark::kMicrosecond);

/// A frame at 15 per second while contrast is everywhere.
void contrast_flow_of_a_frame(benchmark::State& state) {
    blood::ContrastFlow& at = flow();
    at.reset();
    int frames = 0;
    for (auto _ : state) {
        if (frames++ % 150 == 0) {
            at.reset();
            at.inject({at.nodes()[0], 20, 250, 350});
        }
        at.step(1.0 / 15);
    }
    state.counters["cells"] = static_cast<double>(at.nodes().size());
}
BENCHMARK(contrast_flow_of_a_frame)->Unit(benchmark::kMicrosecond);

}  // namespace
