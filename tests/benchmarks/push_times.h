#pragma once
/// A wire pushed segment by segment by a hub to full equilibrium, and the processor time that each push took.

#include <algorithm>
#include <benchmark/benchmark.h>
#include <vector>

#include "engine/io/cpu_clock.h"
#include "physics/relax/hub.h"

/// Pushes a wire from 20 to `segments` segments along `path`, `burst` at a time. The counters cover the
/// pushes of the second half.
inline void push_through(benchmark::State& state, const physics::LumenWall& wall,
                         const geometry::Polyline& path, const physics::DeviceSpec& device,
                         const physics::Grid& grid, int segments, int burst) {
    constexpr int unlimited = 1'000'000'000;
    std::vector<double> times;
    int unfinished = 0;
    for (auto _ : state) {
        physics::Hub hub({}, wall);
        physics::Chain wire = physics::wire_along(device, grid, path, 20);
        hub.settle(wire, unlimited);
        while (wire.segments() + burst <= segments) {
            const double before = io::thread_cpu_seconds();
            double left = burst * grid.segment_length;
            while (left > 1e-9) {
                const physics::HubReport report = hub.move(wire, {left, 0}, unlimited);
                if (report.outcome != physics::HubReport::Outcome::AtRest) break;
                left -= report.made.feed;
            }
            const double after = io::thread_cpu_seconds();
            if (wire.segments() > segments / 2) times.push_back(1e3 * (after - before));
            if (left > 1e-9) {
                ++unfinished;
                break;
            }
        }
    }
    std::sort(times.begin(), times.end());
    state.counters["median_ms"] = times[times.size() / 2];
    state.counters["p99_ms"] = times[times.size() * 99 / 100];
    state.counters["max_ms"] = times.back();
    state.counters["unfinished"] = unfinished;
}
