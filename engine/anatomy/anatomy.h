#pragma once
/// A vessel tree: the lumen's surface, its centrelines with inscribed radii, its open ends and named targets.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "physics/geometry/centreline_tree.h"
#include "physics/geometry/landmark.h"

namespace anatomy {

enum class EndRole { Inlet, Outlet };

struct VesselEnd {
    geometry::OpenEnd opening;
    EndRole role = EndRole::Outlet;
};

/// A named place on a centreline that a wire is to reach.
struct VesselTarget {
    std::string name;
    geometry::Vec3 centre = geometry::Vec3::Zero();  // [mm]
    int branch = 0, sample = 0;
};

struct Anatomy {
    std::string name;
    geometry::TriangleMesh lumen;  // welded, normals out of the lumen, open at the ends [mm]
    std::vector<geometry::CentrelineBranch> branches;
    std::vector<VesselEnd> ends;
    std::vector<VesselTarget> targets;
    std::optional<geometry::BodyPlace> body;  // where in the body the vessels are, when that is known

    std::vector<geometry::OpenEnd> openings() const;
};

/// NAME.anatomy.json and the mesh it names, checked: units, finite numbers, indices, a mesh that is welded,
/// oriented outward and open exactly at the declared ends. Throws InputError.
Anatomy load_anatomy(const std::filesystem::path&);

/// Everything that makes the anatomy unusable, a sentence each; empty when it is fine.
std::vector<std::string> problems(const Anatomy&);

/// The lumen with a planar cap on every open end. Throws InputError when that does not close it.
geometry::TriangleMesh closed_lumen(const Anatomy&);

/// Where a point is along the vessels.
struct VesselPlace {
    int branch = -1, sample = -1;
    double distance = 0;  // to the sample, less its inscribed radius: ≤ 0 inside [mm]
};
VesselPlace nearest_place(const Anatomy&, const geometry::Vec3&);
bool inside(const Anatomy&, const geometry::Vec3&);

/// Index of a named end, empty when there is none.
std::optional<int> find_end(const Anatomy&, const std::string& name);

/// Centreline from an end into the lumen: along its branch and, from the start of that, up its parents.
/// First point on the end's plane. Radii follow the points.
struct EntryPath {
    geometry::Polyline points;  // [mm]
    std::vector<double> radii;  // [mm]
};
EntryPath path_from(const Anatomy&, int end);

/// Shortest way along centrelines between the places nearest to two points [mm].
double centreline_distance(const Anatomy&, const geometry::Vec3& from, const geometry::Vec3& to);

}  // namespace anatomy
