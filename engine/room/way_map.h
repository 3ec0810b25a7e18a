#pragma once
/// The way to the target, flat as a C-arm sees it from far away: what the window and the page draw as a map.

#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/scenario/scenario.h"
#include "render/xray/c_arm.h"

namespace room {

struct WayMap {
    struct Point {
        double x = 0, y = 0;  // to the right and down [mm]
    };
    struct Branch {
        std::vector<Point> points;  // of its centreline
        std::vector<double> radii;  // at each of them [mm]
    };
    std::vector<Branch> vessels;
    std::vector<Point> way;  // from the start to the target; empty where nothing joins them
    Point start, target;
    double radius = 0;                  // of the target [mm]
    Point low = {0, 0}, high = {0, 0};  // what is to be seen: the way with some of the vessels around it
    static constexpr double dash = 7, gap = 5;  // of the way's line, in units of the window
};

/// Where the target lies [mm]; (0, 0, 0) where neither the vessels nor the scenario say.
geometry::Vec3 target_of(const scenario::Target&, const anatomy::Anatomy&);
WayMap way_map(const scenario::Scenario&, const anatomy::Anatomy&, const render::CArm&);

}  // namespace room
