#pragma once
/// What lies in the lumen behind its open ends.

#include "engine/anatomy/anatomy.h"
#include "physics/geometry/mesh_query.h"

namespace anatomy {

/// Radius of the largest of the balls in the lumen at depths of 0.25 to 2 radii behind an opening [mm].
double ball_behind(const geometry::MeshQuery& wall, const geometry::Vec3& centre,
                   const geometry::Vec3& outward, double radius);

/// The first place on the branch nearest to an end that is at least this way [mm] along it from there; the
/// last one of a shorter branch. Expects branches of two samples or more.
VesselPlace place_behind(const Anatomy&, const geometry::OpenEnd&, double way);

}  // namespace anatomy
