/// What the panel around a frame costs, readback included, and its PNG file.

#include <benchmark/benchmark.h>
#include <cstdint>

#include "render/panel/panel.h"
#include "render/picture/png.h"

namespace {

render::GrayImage noisy(int pixels, std::uint32_t seed) {
    render::GrayImage image{pixels, pixels, {}};
    for (int i = 0; i < pixels * pixels; ++i) {
        seed = seed * 1664525u + 1013904223u;
        image.pixels.push_back(static_cast<std::uint8_t>(96 + (seed >> 26)));
    }
    return image;
}

render::Readout readout() {
    render::Readout r;
    r.title = "Renal: left femoral access to the left renal artery";
    r.beam_on = true;
    r.lao = 0.3;
    r.sid = 1100.0;
    r.sod = 750.0;
    r.air_kerma = 41.7;
    r.fluoro_time = 258.0;
    r.devices = {{"wire", 420.0, 800.0, 0.7, 0.0, 0.0}};
    r.force_history.assign(150, 0.2);
    r.messages.assign(5, {"The wire stopped at the wall", render::Notice::Warning});
    return r;
}

void panel(benchmark::State& state) {
    render::Panel screen;
    const int pixels = static_cast<int>(state.range(0));
    const render::GrayImage frames[] = {noisy(pixels, 1), noisy(pixels, 2)}, stored = noisy(pixels, 3);
    auto r = readout();
    screen.draw(frames[1], &stored, r);
    for (auto _ : state) {
        ++r.frame;
        benchmark::DoNotOptimize(screen.draw(frames[r.frame % 2], &stored, r));
    }
}
// The rasteriser has threads of its own: their time counts too.
BENCHMARK(panel)->Arg(512)->Arg(1024)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

void panel_png(benchmark::State& state) {
    const auto stored = noisy(512, 3);
    const auto image = render::Panel().draw(noisy(512, 1), &stored, readout());
    std::size_t bytes = 0;
    for (auto _ : state) bytes = render::encode_png(image).size();
    state.counters["bytes"] = static_cast<double>(bytes);
}
BENCHMARK(panel_png)->Unit(benchmark::kMillisecond);

}  // namespace
