#pragma once
/// Hands that may break the wire: one that pushes segment by segment into tubes drawn at random, and one that
/// pushes, pulls and turns far more than any physician, in the vessels of a scenario, frame by frame. Every
/// frame is judged by means that the simulation does not use: the exact gradient and the raw mesh.

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "engine/exercise/simulation.h"
#include "engine/scenario/scenario.h"
#include "engine/studies/study.h"
#include "physics/geometry/mesh_query.h"
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

/// Pushes or pulls of up to 30 mm and turns of up to 360° per frame; every 40 frames the hand chooses anew
/// whether it goes in or out, and every 10, where there are several devices, which of them it holds, or all.
/// The seed determines all, on any machine.
class WildHand {
public:
    explicit WildHand(std::uint32_t seed) : random_(seed) {}
    /// Performs the hand's next frame.
    void act(exercise::Simulation&);

private:
    double unit() { return static_cast<double>(random_()) / 4294967296.0; }
    std::mt19937 random_;
    int frame_ = 0;
    double trend_ = 1;
    script::DeviceRole held_ = script::DeviceRole::Wire;
};

/// The mesh of a lumen as it is, and the vessels that go on past its ends.
class RawLumen {
public:
    explicit RawLumen(const anatomy::Anatomy&);
    /// How far outside the lumen and all vessels past its ends a point is, < 0 inside; in the lumen the
    /// search goes no farther than `within` [mm].
    double outside_by(const geometry::Vec3&, double within) const;

private:
    /// An end; rims of real meshes are uneven, so the vessel past it begins as far inside as the rim reaches.
    struct End {
        geometry::OpenEnd opening;
        double inside = 0;  // [mm]
    };
    /// Whether most of five rays cross the mesh, closed by planes at its ends, an odd number of times.
    bool encloses(const geometry::Vec3&) const;
    double outside_mesh_by(const geometry::Vec3&, double within) const;
    double outside_by(const geometry::Vec3&, const End&, double within) const;

    anatomy::Anatomy vessels_;  // their rims led on to planes, as every wall has them
    geometry::MeshQuery closed_, wall_;
    std::vector<End> ends_;
};

/// The outcome of a number of frames.
struct WildTally {
    int frames = 0, segments = 0;  // segments: the most there were
    int restless = 0;              // |g|/C above the limit for rest
    double gradient = 0;           // the largest |g|/C
    int folds = 0;                 // frames with a joint bent by more than 90°
    int beyond_force = 0;  // joints deeper in the raw mesh, or the vessels past it, than their force explains
    double beyond_force_by = 0;                               // at most [mm]
    int reported_crossings = 0;                               // frames whose report has a crossing
    double deepest_crossing = 0;                              // of these [mm]
    int left = 0;                                             // frames with the tip past an end
    int refused = 0, buckled = 0, settling = 0, lagging = 0;  // refused: but those that buckled the shaft
    double largest_lag = 0;                                   // [mm]
    double deepest = 0, largest_force = 0;                    // of contacts [mm], [N]
    std::vector<double> times;                                // processor time of each frame [ms]
    std::vector<Incident> incidents;

    void add(const WildTally&);
};

/// Judges the frames of one simulation.
class WildJudge {
public:
    explicit WildJudge(const exercise::Simulation&);
    void judge(const exercise::Simulation&, const exercise::StepReport&, std::uint64_t seed, int frame,
               WildTally&) const;

private:
    std::string name_;
    RawLumen lumen_;
    double rest_ = rest_limit;
};

/// Plays this many frames of the hand with this seed, from the scenario's start.
WildTally play_wildly(exercise::Simulation&, const WildJudge&, std::uint32_t seed, int frames);

/// Scenarios to try: those of options.scenarios and three from options.real_meshes, imported into the cache
/// with a scenario file beside each. The quick study has s_bend and renal.
std::vector<scenario::Scenario> wild_scenarios(const StudyOptions&);

}  // namespace studies
