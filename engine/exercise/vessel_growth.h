#pragma once
/// Grows trees of vessels into tissue, for the image.

#include <cstdint>
#include <string>
#include <vector>

#include "physics/geometry/random.h"
#include "physics/geometry/vec.h"
#include "render/xray/distal_vessels.h"

namespace exercise {

/// Radius of an end from which on it is that of a trunk, which goes on [mm].
inline constexpr double trunk_radius = 5;

geometry::Vec3 in_unit_ball(geometry::Random&);
std::uint64_t seed_of(const std::string& name);

/// Where a tree begins and how its vessels run.
struct Root {
    geometry::Vec3 place, direction;  // of the trunk there, unit [mm]
    double radius = 1;                // [mm]
    double smallest = 0.15;           // radius of its last vessels [mm]
    double winding = 0;               // 1: as a cerebral artery's; 0: none [-]
    std::uint64_t seed = 0;
    /// Of a fork's tissue, what its smaller branch gets: less where a trunk gives off side branches [-].
    double least_part = 0.2, largest_part = 0.5;
};

/// Nodes of a tree's pieces: from `first` at its root to `first` + `count` − 1 at its farthest vessels, by
/// the time that blood takes, or the other way round where blood comes from there.
struct NodeRange {
    std::uint32_t first = 0, count = 1;
    bool to_root = false;
};

/// Ends a piece at the plane halfway to the heading of the next, and returns its normal.
geometry::Vec3 joined(render::VesselPiece&, const geometry::Vec3& ahead);

/// Divides the points of a tissue among the branches of a tree, which end at them. Radii follow Murray's law
/// (1926) with the exponent that leads from the root to the smallest vessels; a branch keeps its direction
/// and the width of the trunk where it leaves that. The same arguments give the same pieces.
void grow_into(std::vector<geometry::Vec3> tissue, const Root&, const NodeRange&,
               std::vector<render::VesselPiece>&);

}  // namespace exercise
