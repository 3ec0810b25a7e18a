#pragma once
/// A vessel tree: the lumen's surface, its centrelines with inscribed radii, its open ends and named targets.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "physics/geometry/centreline_tree.h"
#include "physics/geometry/landmark.h"
#include "physics/geometry/mesh_query.h"

namespace anatomy {

using geometry::CentrelineBranch;
using geometry::Polyline;
using geometry::TriangleMesh;
using geometry::Vec3;

enum class EndRole { Inlet, Outlet };

struct VesselEnd {
    geometry::OpenEnd opening;
    EndRole role = EndRole::Outlet;
};

/// A named place on a centreline for a wire to reach.
struct VesselTarget {
    std::string name;
    geometry::Vec3 centre = geometry::Vec3::Zero();  // [mm]
    int branch = 0, sample = 0;
};

/// Calcium in the wall, which only the image shows: balls along a line beside the lumen.
struct CalciumDeposit {
    geometry::Polyline points;  // [mm]
    std::vector<double> radii;  // [mm]
};

struct Anatomy {
    std::string name;
    geometry::TriangleMesh lumen;  // welded, normals out of the lumen, open at the ends [mm]
    std::vector<geometry::CentrelineBranch> branches;
    std::vector<VesselEnd> ends;
    std::vector<VesselTarget> targets;
    std::vector<CalciumDeposit> calcium;
    std::optional<geometry::BodyPlace> body;  // where in the body the vessels are, when that is known

    /// The ends; past that at which the aortic valve is lies the root.
    std::vector<geometry::OpenEnd> openings() const;
};

/// Loads NAME.anatomy.json and the mesh it names, and checks them: units, finite numbers, indices, a mesh
/// that is welded, oriented outward and open exactly at the declared ends. Throws InputError.
Anatomy load_anatomy(const std::filesystem::path&);

/// The same from the texts of both, the mesh as a binary STL; `name` stands for the files in messages.
Anatomy parse_anatomy(const std::string& json, const std::string& stl, const std::string& name);

/// The mesh that the file names. Empty where it cannot be told, which load_anatomy then refuses.
std::optional<std::filesystem::path> mesh_named_by(const std::filesystem::path&);

/// Of lumen, centrelines, ends and targets.
std::uint64_t hash_of(const Anatomy&);

/// An end past which the vessel cannot go on as an artery would: that one would run into a branch.
struct BlockedEnd {
    int end = -1, branch = -1;
    double free = 0;  // way past the end's plane at which it does not yet [mm]
};
/// The ends past which an artery would go on, by PastEnd's cone, into a branch or past its end.
std::vector<BlockedEnd> blocked_ends(const Anatomy&);
/// Closes the vessels past these ends before they meet the branch.
void close_blocked_ends(Anatomy&, const std::vector<BlockedEnd>&);
/// What is done with it, a sentence.
std::string text_of(const Anatomy&, const BlockedEnd&);

/// Every defect that makes the anatomy unusable, a sentence each; empty when there is none.
std::vector<std::string> problems(const Anatomy&);

/// The lumen with a planar cap on every open end. Throws InputError when the caps do not close it.
geometry::TriangleMesh closed_lumen(const Anatomy&);

/// Where a point is along the vessels.
struct VesselPlace {
    int branch = -1, sample = -1;
    double distance = 0;  // to the sample minus its inscribed radius: ≤ 0 inside [mm]
};
VesselPlace nearest_place(const Anatomy&, const geometry::Vec3&);
/// From the branch's start along its centreline to the sample [mm].
double along(const Anatomy&, const VesselPlace&);
bool inside(const Anatomy&, const geometry::Vec3&);
/// Way along a branch's centreline to its origin, where it has left its parent's lumen; 0 for a root [mm].
double origin_of(const Anatomy&, int branch);
/// The branch of that name, or the one that runs on from a vessel of that name: "aorta" for "aorta+LCIA".
std::optional<int> branch_named(const Anatomy&, std::string_view name);
/// Where a branch that has no open end of its own ends inside another one, as a communicating artery does;
/// empty for all others.
std::optional<VesselPlace> joint_of(const Anatomy&, int branch);

/// Index of an end by its name, or by that name's last part where it is unique: "LCFA.out" for
/// "aorta+LCIA+LEIA+LCFA.out". Empty when there is none.
std::optional<int> find_end(const Anatomy&, const std::string& name);

/// Centreline from an end into the lumen: along its branch and, from that branch's start, up through its
/// parents. The first point lies on the end's plane. Radii correspond to the points.
struct EntryPath {
    geometry::Polyline points;  // [mm]
    std::vector<double> radii;  // [mm]
};
EntryPath path_from(const Anatomy&, int end);

/// Radius of the largest of the balls in the lumen at depths of 0.25 to 2 radii behind an opening [mm].
double ball_behind(const geometry::MeshQuery& wall, const geometry::Vec3& centre,
                   const geometry::Vec3& outward, double radius);

/// The first place on the branch nearest to an end that is at least this way [mm] along it from there; the
/// last one of a shorter branch. Expects branches of two samples or more.
VesselPlace place_behind(const Anatomy&, const geometry::OpenEnd&, double distance);

}  // namespace anatomy
