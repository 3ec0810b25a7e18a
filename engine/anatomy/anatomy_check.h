#pragma once
/// The criteria an anatomy is checked by, with the figures found, and the quality of a mesh: its
/// angles, its Euler characteristic, whether it intersects itself.

#include <string>
#include <utility>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "physics/geometry/vec.h"

namespace anatomy {

struct TriangleAngles {
    double least = 0;       // of all angles [rad]
    double percentile = 0;  // 1 % of the triangles have a smaller least angle [rad]
};
TriangleAngles smallest_angles(const geometry::TriangleMesh&);

/// Corners − edges + triangles: 2 for a closed surface without handles.
int euler_characteristic(const geometry::TriangleMesh&);

/// Pairs of triangles that share no corner and cross each other, in order.
std::vector<std::pair<int, int>> crossing_pairs(const geometry::TriangleMesh&);
int self_intersections(const geometry::TriangleMesh&);

struct Check {
    enum class Verdict { Pass, Warning, Fail };
    std::string what, found, accepted;
    Verdict verdict = Verdict::Pass;
};
/// "pass  what: found; expected: …", with "note" for a warning and "FAIL".
std::string text_of(const Check&);

/// A lumen's surface as seen by rays cast from its triangles.
struct SurfaceFigures {
    double surrounded = 0;  // fraction of the triangles from which nearly every ray outward meets the surface
    double median_radius = 0;  // half the width of the lumen; half of the triangles have less [mm]
    double thin_radius = 0;    // the same; 2 % have less [mm]
    double edge_ratio = 0;     // median ratio of an edge to the radius at its triangle
};
/// Expects a closed mesh whose normals point outward.
SurfaceFigures surface_figures(const geometry::TriangleMesh& closed);

/// Checks that the surface is that of a lumen in millimetres: rays, radius, edges. `unit` is the unit that
/// the file's numbers were taken to be in, "mm" for an anatomy's own.
std::vector<Check> surface_checks(const SurfaceFigures&, const std::string& unit = "mm");

/// Radius of the thinnest wire, of 0.014 in [mm]; a lumen too narrow for it is rejected.
inline constexpr double thinnest_wire_radius = 0.178;

/// Every check of an anatomy that load_anatomy accepts; takes a second or two for a large one.
std::vector<Check> anatomy_checks(const Anatomy&);

}  // namespace anatomy
