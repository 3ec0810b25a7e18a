#pragma once
/// A vessel with a side branch that a straight wire goes past, for tests of plans.

#include <string>

#include "tests/engine/fixtures.h"

namespace test {

inline const anatomy::ModelCache plan_cache = {SELDINGER_SOURCE "/build/cache", {}};

/// Enters at the foot of a trunk of radius 4 and is to go 25 mm into a branch of radius 3, which leaves at
/// 45 degrees to the left.
inline std::string fork_toml(const std::string& wire = "glide035") {
    return R"(schema = 1
title = "Fork"
frame_rate_hz = 15
seed = 1
[anatomy]
[[anatomy.branch]]
name = "trunk"
points_mm = [[0, 0, 130, 4], [0, 0, 60, 4], [0, 0, 0, 4]]
[[anatomy.branch]]
name = "side"
parent = "trunk"
at_mm = 60
points_mm = [[0, 0, 0, 3], [20, 0, 20, 3], [40, 0, 40, 3]]
[[anatomy.target]]
name = "goal"
branch = "side"
at_mm = 25
[entry]
end = "trunk.out"
inserted_mm = 40
[guidewire]
device = ")" +
           wire + R"("
[wall]
stiffness_N_per_mm = 20.0
[target]
name = "goal"
radius_mm = 5.0
hold_s = 0.3
[c_arm]
isocentre_mm = [10, 0, 60]
[imaging]
patient = false
)";
}

inline scenario::Scenario fork(const std::string& wire = "glide035") {
    return scenario::parse_scenario(fork_toml(wire), "fork.toml", asset("devices"));
}

}  // namespace test
