/// What a treatment costs: the step of balloon, lesions and stents, the tubes and obstructions that it
/// leaves, and whole frames of exercises without images.

#include <benchmark/benchmark.h>
#include <string>
#include <vector>

#include "engine/exercise/exercise.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace {

const std::string assets = std::string(SELDINGER_SOURCE) + "/assets/";

/// An exercise and its solution, played to a frame.
struct Played {
    scenario::Scenario scenario;
    script::CommandScript script;
    exercise::Exercise exercise;
    int frame = 0;

    Played(const std::string& name, int to)
        : scenario(scenario::load_scenario(assets + "scenarios/" + name + ".toml", assets + "devices", {})),
          script(script::load_commands(assets + "scripts/" + name + ".gw")),
          exercise(scenario, exercise::Pictures::None, {}) {
        while (frame < to) step();
    }
    void step() {
        std::vector<script::Command> commands;
        for (const script::TimedCommand& timed : script.at(frame)) commands.push_back(timed.command);
        benchmark::DoNotOptimize(exercise.next_frame(commands).motion.relax.updates);
        ++frame;
    }
};

/// In the middle of the stent's inflation.
Played& stent() {
    static Played made("lad_stent", 600);
    return made;
}

void treatment_step(benchmark::State& state) {
    const exercise::Simulation& simulation = stent().exercise.simulation();
    const auto balloon = simulation.scenario().index_of(script::DeviceRole::Balloon);
    for (auto _ : state) {
        exercise::Treatment treatment = simulation.treatment();
        benchmark::DoNotOptimize(treatment.step(
            1.0 / 15, simulation.frames(), simulation.wire(), static_cast<int>(*balloon),
            &simulation.devices()[*balloon].device, simulation.contrast().blood(), simulation.anatomy()));
    }
}
BENCHMARK(treatment_step)->Unit(benchmark::kMillisecond);

/// Tubes of the wall and obstructions of the flow that a step leaves.
void treatment_narrowings(benchmark::State& state) {
    const exercise::Treatment& treatment = stent().exercise.simulation().treatment();
    for (auto _ : state) {
        benchmark::DoNotOptimize(treatment.narrowings());
        benchmark::DoNotOptimize(treatment.obstructions());
    }
}
BENCHMARK(treatment_narrowings)->Unit(benchmark::kMillisecond);

/// Frames of an inflation, physics, flow and score, all together.
void frames_of_an_inflation(benchmark::State& state) {
    const bool renal = state.range(0) == 1;
    state.SetLabel(renal ? "renal_stent" : "lad_stent");
    for (auto _ : state) {
        state.PauseTiming();
        Played played(renal ? "renal_stent" : "lad_stent", renal ? 182 : 510);
        const int first = played.frame, last = renal ? 400 : 690;
        state.ResumeTiming();
        while (played.frame < last) played.step();
        state.counters["frames"] = last - first;
    }
}
BENCHMARK(frames_of_an_inflation)->Arg(0)->Arg(1)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
