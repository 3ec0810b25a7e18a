#pragma once
/// Synthetic vessels shared by tests, benchmarks, studies and demos: tubes drawn by a pen, and named scenes.

#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

struct Run {
    double length = 0;  // [mm]
};
/// The heading turns by `angle` about `axis` over a path of radius·|angle|; an axis that is not perpendicular
/// to the heading makes a helix.
struct Arc {
    double radius = 0;  // [mm]
    double angle = 0;   // right-handed [rad]
    geometry::Vec3 axis = geometry::Vec3::UnitZ();
};
using PenMove = std::variant<Run, Arc>;

double length(std::span<const PenMove>);  // [mm]

/// The pen's path from the origin, heading +x at first, with points at most `step` apart.
geometry::Polyline draw(std::span<const PenMove>, double step = 0.05);

/// The path as straight pieces between points of it, `piece` apart along it, the first `first` from its start
/// (0 < first ≤ piece) [mm]: an artery as the paper divides it.
geometry::Polyline in_pieces(const geometry::Polyline& path, double piece, double first);

/// A scene of the literature: a tube of constant radius and the uniform wire that goes into it.
struct Scene {
    std::string_view name;
    std::vector<PenMove> path;
    double radius = 1;           // of the lumen [mm]
    int segments = 200;          // N
    double segment_length = 1;   // λ [mm]
    double rigidity = 50;        // EI [N·mm²]
    double wall_stiffness = 42;  // per joint [N/mm]
};
const std::vector<Scene>& scenes();
const Scene* find_scene(std::string_view name);  // null when there is none

/// A tube as an anatomy: a lumen of `around` facets, open at the ends "start" and "end", one branch "tube"
/// and a target "end", 5 radii short of the far end. `step` is the length of a facet [mm].
Anatomy tube_anatomy(const std::string& name, const geometry::Polyline& centreline, double radius,
                     int around = 48, double step = 0.5);

}  // namespace anatomy
