/// What a frame costs: exposure at a cached pose, change of pose, and the PNG file.

#include <algorithm>
#include <benchmark/benchmark.h>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <string>
#include <unistd.h>

#include "engine/run/picture_file.h"
#include "render/patient/organ_motion.h"
#include "render/patient/patient.h"
#include "render/patient/solids.h"
#include "render/xray/exposure_meter.h"
#include "render/xray/fluoroscope.h"
#include "render/xray/struts.h"

namespace {

using geometry::Polyline;
using geometry::Vec3;

/// 200 joints 1 mm apart, gently curved in all directions.
Polyline wire() {
    Polyline joints{Vec3(20, 0, -80)};
    for (int i = 1; i < 200; ++i) {
        const double a = 0.5 * std::sin(i / 25.0), b = 0.4 * std::cos(i / 40.0);
        joints.push_back(joints.back() +
                         Vec3(std::sin(a) * std::cos(b), std::sin(b), std::cos(a) * std::cos(b)));
    }
    return joints;
}

render::Fluoroscope make_fluoroscope() {
    auto layers = render::make_patient({});
    Polyline axis;
    for (int i = 0; i <= 60; ++i) axis.emplace_back(0.0, 0.0, -190.0 + 5.0 * i);
    layers.push_back(
        {"lumen", render::Material::Blood, render::Material::SoftTissue,
         render::tube(axis, Vec3::UnitX(), std::vector<double>(61, 9.0), std::vector<double>(61, 9.0), 400),
         true});
    return render::Fluoroscope({}, std::move(layers));
}

render::CArm arm_of(int pixels) {
    return render::CArm{.pixels = pixels};
}

/// Pixels along a side.
void exposure_at_a_cached_pose(benchmark::State& state) {
    auto scope = make_fluoroscope();
    const auto arm = arm_of(static_cast<int>(state.range(0)));
    const Polyline joints = wire();
    render::Exposure exposure;
    scope.expose(arm, joints, exposure);
    for (auto _ : state) {
        ++exposure.frame;
        benchmark::DoNotOptimize(scope.expose(arm, joints, exposure));
    }
}
BENCHMARK(exposure_at_a_cached_pose)->Arg(512)->Arg(1024)->UseRealTime()->Unit(benchmark::kMillisecond);

/// A patient whose organs move.
render::Fluoroscope make_breathing() {
    render::PatientSpec spec;
    spec.lower = Vec3(-60, -60, -100);
    spec.upper = Vec3(60, 60, 260);
    auto layers = render::make_patient(spec);
    const Vec3 heart = spec.origin + Vec3(20, -20, 230);
    render::move_organs(layers, spec.origin, 14, [heart](const Vec3& x) {
        return Vec3(-0.1 * std::exp(-(x - heart).squaredNorm() / (60 * 60)) * (x - heart));
    });
    return render::Fluoroscope({}, std::move(layers));
}

/// Over the diaphragm, or the kidneys.
render::CArm arm_over(bool diaphragm, int pixels) {
    render::CArm arm = arm_of(pixels);
    arm.isocentre = Vec3(0, 0, diaphragm ? 190 : 40);
    return arm;
}

/// Pixels along a side, over the diaphragm or not, moving or not; all phases were drawn before.
void exposure_at_a_cached_pose_of_moving_organs(benchmark::State& state) {
    auto scope = make_breathing();
    const auto arm = arm_over(state.range(1) != 0, static_cast<int>(state.range(0)));
    const Polyline joints = wire();
    render::Exposure exposure;
    for (int k = 0; k <= 12; ++k) {
        exposure.breath = exposure.beat = k / 12.0;
        scope.expose(arm, joints, exposure);
    }
    for (auto _ : state) {
        ++exposure.frame;
        // Between two phases of either.
        const double at = state.range(2) != 0 ? static_cast<double>(exposure.frame % 97 + 1) / 98.7 : 0;
        exposure.breath = exposure.beat = at;
        benchmark::DoNotOptimize(scope.expose(arm, joints, exposure));
    }
}
BENCHMARK(exposure_at_a_cached_pose_of_moving_organs)
    ->ArgsProduct({{512, 1024}, {0, 1}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

/// A pose and what its first frame needs of phases: none, or two of breath and two of heartbeat.
void exposure_at_a_new_pose_of_moving_organs(benchmark::State& state) {
    auto scope = make_breathing();
    auto arm = arm_over(true, static_cast<int>(state.range(0)));
    render::Exposure exposure;
    exposure.breath = exposure.beat = state.range(1) != 0 ? 0.4 : 0.0;
    const Polyline joints = wire();
    scope.expose(arm, joints, exposure);
    for (auto _ : state) {
        arm.lao = arm.lao > 0.5 ? 0.0 : arm.lao + 0.01;
        benchmark::DoNotOptimize(scope.expose(arm, joints, exposure));
    }
}
BENCHMARK(exposure_at_a_new_pose_of_moving_organs)
    ->ArgsProduct({{512}, {0, 1}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// What is drawn ahead after a new pose, in all, and its longest and mean part.
void parts_drawn_ahead(benchmark::State& state) {
    auto scope = make_breathing();
    auto arm = arm_over(true, 512);
    const Polyline joints = wire();
    const render::Exposure exposure;
    double longest = 0, sum = 0, parts = 0;
    for (auto _ : state) {
        state.PauseTiming();
        arm.lao = arm.lao > 0.5 ? 0.0 : arm.lao + 0.01;
        scope.expose(arm, joints, exposure);
        state.ResumeTiming();
        for (bool more = true; more; ++parts) {
            const auto start = std::chrono::steady_clock::now();
            more = scope.draw_ahead(arm, exposure);
            const double took =
                std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
            longest = std::max(longest, took);
            sum += took;
        }
    }
    state.counters["longest_ms"] = longest;
    state.counters["mean_ms"] = sum / parts;
}
BENCHMARK(parts_drawn_ahead)->UseRealTime()->Unit(benchmark::kMillisecond);

/// What a new pose costs where only the dose is wanted.
void dose_at_a_new_pose(benchmark::State& state) {
    render::ExposureMeter meter({}, render::make_patient({}));
    auto arm = arm_of(512);
    for (auto _ : state) {
        arm.lao = arm.lao > 0.5 ? 0.0 : arm.lao + 0.01;
        benchmark::DoNotOptimize(meter.technique(arm, {}));
    }
}
BENCHMARK(dose_at_a_new_pose)->Unit(benchmark::kMillisecond);

void exposure_while_contrast_flows(benchmark::State& state) {
    auto scope = make_fluoroscope();
    const auto arm = arm_of(static_cast<int>(state.range(0)));
    const Polyline joints = wire();
    render::Exposure exposure;
    scope.expose(arm, joints, exposure);
    for (auto _ : state) {
        ++exposure.frame;
        exposure.iodine = static_cast<double>(exposure.frame % 150 + 1);
        benchmark::DoNotOptimize(scope.expose(arm, joints, exposure));
    }
}
BENCHMARK(exposure_while_contrast_flows)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);

void exposure_at_a_new_pose(benchmark::State& state) {
    auto scope = make_fluoroscope();
    auto arm = arm_of(static_cast<int>(state.range(0)));
    const Polyline joints = wire();
    scope.expose(arm, joints, {});
    for (auto _ : state) {
        arm.lao = arm.lao > 0.5 ? 0.0 : arm.lao + 0.01;
        benchmark::DoNotOptimize(scope.expose(arm, joints, {}));
    }
}
// The rasteriser has threads of its own: their time counts too. The least is the size of a preview.
BENCHMARK(exposure_at_a_new_pose)
    ->Arg(256)
    ->Arg(512)
    ->Arg(1024)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

void wire_alone(benchmark::State& state) {
    render::WireImage image;
    const auto arm = arm_of(static_cast<int>(state.range(0)));
    const Polyline joints = wire();
    const render::WireLook look;
    const auto bins = render::fit_bins(render::detected_spectrum(74.0));
    const auto mu = render::wire_attenuation(look, bins, {});
    for (auto _ : state) benchmark::DoNotOptimize(image.cast(arm, joints, look, mu));
}
BENCHMARK(wire_alone)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);

/// Straight stents: an iliac one of 8 × 38 mm, and a coronary one of 3 × 18 mm.
void stent_alone(benchmark::State& state) {
    const bool iliac = state.range(1) != 0;
    const double length = iliac ? 38 : 18;
    Polyline axis;
    for (int i = 0; i <= static_cast<int>(length); ++i) axis.emplace_back(i - 0.5 * length, 0, 0);
    const std::vector<double> radii(axis.size(), iliac ? 4.0 : 1.5);
    render::WireLook look;
    look.diameter = iliac ? 0.2 : 0.08;
    look.marker_length = 0;
    const auto bins = render::fit_bins(render::detected_spectrum(74.0));
    const auto arm = arm_of(static_cast<int>(state.range(0)));
    render::WireImage image;
    for (auto _ : state) {
        const Polyline line = render::struts(axis, radii, iliac ? 8 : 9, iliac ? 2 : 1);
        const render::WireShadow shadow{line,    look, render::wire_attenuation(look, bins, {}),
                                        nullptr, {},   true};
        benchmark::DoNotOptimize(image.cast(arm, {&shadow, 1}));
    }
}
BENCHMARK(stent_alone)->ArgsProduct({{512, 1024}, {0, 1}})->Unit(benchmark::kMillisecond);

void read_out_alone(benchmark::State& state) {
    const int pixels = static_cast<int>(state.range(0));
    const render::Field expected(pixels, pixels, 60.0f * 512 * 512 / pixels / pixels * 4.0f);
    for (auto _ : state) benchmark::DoNotOptimize(render::read_out(expected, 300.0 / pixels, {}, 1, 1));
}
BENCHMARK(read_out_alone)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);

void png_file(benchmark::State& state) {
    auto scope = make_fluoroscope();
    const auto image = scope.expose(arm_of(static_cast<int>(state.range(0))), wire(), {});
    const auto path = std::filesystem::temp_directory_path() /
                      ("seldinger_benchmark_" + std::to_string(::getpid()) + ".png");
    for (auto _ : state) run::write_picture(path, image);
    state.counters["bytes"] = static_cast<double>(std::filesystem::file_size(path));
    std::filesystem::remove(path);
}
BENCHMARK(png_file)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);

}  // namespace
