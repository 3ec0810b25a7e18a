#pragma once
/// The cost of a query near a wall, in the iliac and renal arteries.

#include <benchmark/benchmark.h>
#include <vector>

#include "physics/wall/wall.h"
#include "physics/wire/chain.h"
#include "tests/anatomies.h"

/// Joints close to the wall, each asked with its own station as the hint, moved to and fro by range(0) µm.
inline void time_wall_queries(benchmark::State& state, const physics::LumenWall& wall) {
    std::vector<geometry::Vec3> joints;
    for (const auto& branch : test::iliac_renal().branches)
        for (std::size_t i = 4; i + 4 < branch.points.size(); i += 2) {
            geometry::Vec3 a, b;
            geometry::tangent_basis((branch.points[i + 1] - branch.points[i]).normalized(), a, b);
            joints.push_back(branch.points[i] + (branch.radii[i] - 0.44 + 0.02) * (i % 4 ? a : b));
        }
    std::vector<physics::WallContact> contacts(joints.size());
    wall.contacts(joints, contacts);
    const auto motion = static_cast<double>(state.range(0)) * 1e-3;
    double sign = 1;
    for (auto _ : state) {
        for (geometry::Vec3& x : joints) x.x() += sign * motion;
        sign = -sign;
        wall.contacts(joints, contacts);
        benchmark::DoNotOptimize(contacts.data());
    }
    state.counters["ns_per_query"] =
        benchmark::Counter(static_cast<double>(joints.size()) * 1e-9,
                           benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
