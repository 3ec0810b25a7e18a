#pragma once
/// What the study of anatomies holds against the truth: an imported anatomy against the one that its mesh was
/// made from, and the walls of a simulation: do they distinguish inside from outside, and which segments
/// cross them?

#include <cstdint>
#include <string_view>

#include "engine/anatomy/anatomy.h"
#include "engine/studies/study.h"

namespace studies {

/// One row per mesh (as generated, turned inside out, with 5 % of its triangles turned) and wall. The truth
/// is the sign of the implicit surface, at random places more than 0.1 mm from it. Crossings count random
/// segments of 1 and 2 mm with both ends inside that lie more than 0.1 mm outside in between.
io::Table sign_table();
void add_signs(io::Table&, std::string_view preset, const StudyOptions&);

/// Damages a mesh as scanners and programs do: of the triangles 1 % are missing, 5 % are turned and 1 % carry
/// a fin; corners are off by up to 0.01 mm along each axis.
geometry::TriangleMesh corrupted(const geometry::TriangleMesh&, std::uint32_t seed);

/// Closes every opening by a flat patch of two rings of triangles, as SimVascular and VMTK close a lumen.
geometry::TriangleMesh flat_capped(const geometry::TriangleMesh&);

/// Places of the true centrelines count as away from junctions when no other true branch is nearer, wall to
/// wall, than 0.8 of the smaller radius, the range in which the generator blends them. Places beyond an end's
/// plane, or within a radius of it, do not count.
struct ImportErrors {
    int branches = 0, true_branches = 0;  // found: branches that end where a true branch does
    int invented = 0;                     // branches that end where no true one does
    int ends = 0, true_ends = 0;          // found within half a radius of a true one
    double end_centre = 0;                // largest distance of a found end's centre from the true one [mm]
    double end_radius = 0;                // largest difference divided by the true radius
    double end_normal = 0;                // largest angle between the normals [rad]
    double centre_p50 = 0, centre_p95 = 0, centre_max = 0;  // of true places from the found lines [mm]
    double radius_p50 = 0, radius_p95 = 0;                  // of the difference divided by the true radius
};
ImportErrors import_errors(const anatomy::Anatomy& truth, const anatomy::Anatomy& found);

/// Distance of a point from the nearest of the centrelines, and the radius there [mm].
struct CentrelinePlace {
    double distance = 0, radius = 0;
};
CentrelinePlace nearest_on(const std::vector<geometry::CentrelineBranch>&, const geometry::Vec3&);

}  // namespace studies
