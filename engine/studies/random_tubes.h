#pragma once
/// Wires pushed segment by segment into tubes drawn at random.

#include <cstdint>
#include <string>
#include <vector>

#include "physics/geometry/vec.h"

namespace studies {

/// Something that should not have happened, and where to look for it.
struct Incident {
    std::string where;
    std::uint64_t seed = 0;
    int at = 0;  // push or frame, from 0
    std::string what;
};

struct RandomTube {
    double radius = 1;                         // [mm]
    double segment_length = 1;                 // λ [mm]
    double rigidity = 50, wall_stiffness = 1;  // EI [N·mm²], k [N/mm]
    int segments = 50;                         // N, when the whole wire is inside
    geometry::Polyline centreline;
};

/// How soft wires and how hard walls are drawn.
struct TubeRange {
    double least_rigidity = 5;     // EI [N·mm²]
    double most_stiffness = 1000;  // k [N/mm]
};
/// The range in which walls are far harder than a segment resolves.
constexpr TubeRange harsh_tubes = {0.5, 1e4};

/// Radius 1 to 6 mm, λ 0.5 to 3 mm, EI up to 2000 N·mm² and k from 1 N/mm, each uniform in its logarithm, N
/// 50 to 400, arcs about any axis with radii of 1.2 to 20 lumen radii. Seed and range determine all, on any
/// machine.
RandomTube random_tube(std::uint64_t seed, const TubeRange& = {});

constexpr int segments_at_start = 20;

/// A wire laid along the centreline and pushed in, from one rest to the next, until all of it is inside.
struct TubeCourse {
    std::uint64_t seed = 0;
    RandomTube tube;
    int pushes = 0, reached = 0;  // reached: segments inside at the end
    int unconverged = 0;          // ended without rest
    int restless = 0;             // |g|/C by the energy module above rest_limit
    int folds = 0;                // a joint bent by more than a right angle
    int deep = 0;                 // a joint farther outside the wall than the lumen is wide
    int refused = 0;              // the hub would not make the push; nothing follows
    int gave_way = 0;             // the same, where the next rest lies outside the lumen
    int flat = 0;                 // at rest, but not shown to be a strict minimum
    int over_work = 0;            // the energy rose by more than the hand's work
    double gradient = 0;          // the largest |g|/C
    double excess = 0;            // the largest rise of the energy above the hand's work, over the energy
    long long steps = 0;          // of Newton's method
    std::vector<double> times;    // processor time of each push [ms]
    std::vector<Incident> incidents;
};

constexpr double rest_limit = 2e-8;

TubeCourse push_through(std::uint64_t seed, int most_pushes, const TubeRange& = {});

}  // namespace studies
