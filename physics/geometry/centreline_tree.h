#pragma once
/// The centrelines of a lumen as a tree of stations: balls inscribed along every branch, linked along it and
/// across junctions. It states which branch holds a joint and where the lumen is open.

#include <limits>
#include <span>
#include <string>

#include "physics/geometry/polyline.h"

namespace geometry {

/// Approximate error of a mesh's centrelines and radii [mm]; it is taken off every promise of clearance.
constexpr double centreline_error = 0.1;

/// A vessel branch: points with inscribed radii. A child starts on its parent's centreline; one that closes a
/// loop ends inside another branch.
struct CentrelineBranch {
    std::string name;
    int parent = -1;            // index into the list of branches, -1 for a root
    int parent_sample = -1;     // sample of the parent nearest to points[0]
    Polyline points;            // [mm]
    std::vector<double> radii;  // [mm]
};

/// What is past an open end: an artery that narrows, the aortic root and the left ventricle, or the sheath by
/// which devices come in.
enum class Continuation { Artery, Root, Sheath };

/// An open end of a lumen: beyond its plane there is no mesh.
struct OpenEnd {
    std::string name;
    Vec3 centre = Vec3::Zero();           // [mm]
    Vec3 outward_normal = Vec3::UnitZ();  // unit
    double radius = 0;                    // [mm]
    Continuation goes_on = Continuation::Artery;
    double bore = 0;  // radius of a sheath [mm]
    /// Of a root: from its axis to the mouth of a coronary artery, which one of the sinuses faces; unit,
    /// across the axis. Zero: the root may be turned in any way.
    Vec3 faces = Vec3::Zero();
    /// Past the plane: a sheath's, or after which an artery is closed that would go on longer [mm].
    double length = std::numeric_limits<double>::infinity();

    /// How far the point lies beyond the plane; 0 before the plane, and 0 farther from the axis than twice
    /// the radius plus a margin [mm].
    double beyond(const Vec3& x, double margin = 0) const;
};

/// Whether the child begins where its parent's centreline ends: the vessel goes on by another name.
inline bool goes_on_in(const CentrelineBranch& parent, const CentrelineBranch& child) {
    return child.parent_sample + 1 == static_cast<int>(parent.points.size()) &&
           child.points.front() == parent.points.back();
}

/// The branch that this one ends in, where it has no open end of its own: the one that holds its last point
/// deepest; −1 when none does, and where it goes on in a child. Its parent counts where it has left that
/// between.
int joined_branch(std::span<const CentrelineBranch>, std::span<const OpenEnd>, int branch);

/// The ball inscribed in the lumen at a sample of a branch.
struct Station {
    Vec3 centre;         // [mm]
    double radius;       // [mm]
    int branch, sample;  // where on the centrelines

    /// Signed square distance to the ball: least for the ball that holds the point deepest [mm²].
    double power(const Vec3& x) const { return (x - centre).squaredNorm() - radius * radius; }
};

class CentrelineTree {
public:
    /// Throws std::invalid_argument for no branch, one of fewer than two samples, a parent that does not
    /// exist, points that are not finite or radii that are not positive.
    CentrelineTree(std::span<const CentrelineBranch>, std::vector<OpenEnd>);

    std::span<const Station> stations() const { return stations_; }
    std::span<const OpenEnd> ends() const { return ends_; }
    /// Stations next to this one: along its branch and, near a junction, across it.
    std::span<const int> neighbours(int station) const { return neighbours_[station]; }

    /// The station that holds x deepest. The hint -1 searches all stations; any other hint searches downhill
    /// from it, so that a joint stays in its vessel where others come close.
    int locate(const Vec3& x, int hint) const;
    /// The same, but past the border to stations of another group only where the way into them is a quarter
    /// of the radius there. group_of: of each station.
    int locate_within(const Vec3& x, int hint, std::span<const int> group_of) const;
    /// Whether both stations exist and lie on one branch.
    bool same_branch(int station, int other) const;
    /// Ends that a joint at this station may lie past: those of its branch that are at most two of their
    /// radii away.
    std::span<const int> ends_at(int station) const { return ends_at_[station]; }
    bool beyond_an_end(const Vec3& x) const;
    /// Closest point to x of the centreline on both sides of a station.
    Vec3 closest_point(int station, const Vec3& x) const;
    /// Distance of x along the vessels from the start of the station's root branch; a child starts at the
    /// distance of its parent at parent_sample.
    CentrelineCoordinate coordinate(int station, const Vec3& x) const;
    double longest_arc() const;  // of any station [mm]

private:
    template <class Allowed>
    int downhill(const Vec3& x, int from, const Allowed&) const;

    std::vector<Station> stations_;
    std::vector<std::vector<int>> neighbours_;
    std::vector<OpenEnd> ends_;
    std::vector<std::vector<int>> ends_at_;  // of each station
    std::vector<Vec3> centres_;              // of the stations
    std::vector<double> arc_lengths_;        // of the stations [mm]
    std::vector<int> first_of_branch_;       // station, and past the last branch the number of stations
};

}  // namespace geometry
