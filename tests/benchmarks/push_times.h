#pragma once
/// A wire pushed segment by segment to full equilibrium, and the processor time that each push took.

#include <algorithm>
#include <benchmark/benchmark.h>
#include <vector>

#include "engine/cpu_clock.h"
#include "physics/relaxer.h"

/// Pushes a wire from 20 to `segments` segments along `path`, `burst` at a time. The counters are of the
/// pushes of the second half.
inline void push_through(benchmark::State& state, const physics::LumenWall& wall,
                         const physics::Polyline& path, const physics::GuidewireSpec& spec, int segments,
                         int burst) {
    constexpr physics::RelaxBudget unlimited{1'000'000'000, 0, 0};
    std::vector<double> times;
    int unconverged = 0;
    for (auto _ : state) {
        const auto relaxer = physics::make_relaxer({.kind = physics::RelaxerKind::Global});
        physics::Guidewire wire = physics::wire_along(spec, path, 20);
        relaxer->relax(wire, wall, unlimited);
        while (wire.segments() + burst <= segments) {
            const double before = engine::thread_cpu_seconds();
            bool converged = true;
            for (int k = 0; k < burst; ++k) {
                physics::insert_segment(wire);
                converged = relaxer->relax(wire, wall, unlimited).converged;
            }
            const double after = engine::thread_cpu_seconds();
            if (wire.segments() > segments / 2) times.push_back(1e3 * (after - before));
            unconverged += !converged;
        }
    }
    std::sort(times.begin(), times.end());
    state.counters["median_ms"] = times[times.size() / 2];
    state.counters["p99_ms"] = times[times.size() * 99 / 100];
    state.counters["max_ms"] = times.back();
    state.counters["unconverged"] = unconverged;
}
