#pragma once
/// The tree of centrelines, which tracing builds branch by branch from rough paths through the lumen.

#include <vector>

#include "engine/anatomy/import/lumen_tracing.h"
#include "physics/geometry/mesh_query.h"

namespace anatomy {

/// The middle of a vessel near a rough path through it.
struct Centreline {
    geometry::Polyline points;  // equally far apart [mm]
    std::vector<double> radii;  // of the inscribed ball [mm]
};

std::vector<double> inscribed_radii(const geometry::Polyline&, const geometry::MeshQuery& wall);

/// Moves the points of a path inside the lumen to the centroids of its cross-sections. A cross-section is
/// what a fan of rays in the normal plane reaches, none counted farther than 1.4 times their median, so that
/// side branches do not draw the path in. A fixed end stays where it is.
Centreline recentred(const geometry::Polyline& rough, const geometry::MeshQuery& wall, double step,
                     bool fixed_start, bool fixed_end);

/// A path from the root to an opening, or to a blind end (-1).
struct RootedPath {
    int opening;
    geometry::Polyline points;
};

/// Sorts by length times width, the measure of which vessel is the stem of others.
void sort_stems_first(std::vector<RootedPath>&, const geometry::MeshQuery& wall);

/// A sample of a branch; none when `branch` is negative.
struct BranchSample {
    int branch = -1, sample = -1;
};

/// The branches so far, and the places where new ones leave them.
class BranchTree {
public:
    /// The part of a path from the root to a tip that lies outside every branch, and the sample that it
    /// leaves.
    struct Own {
        BranchSample parent;
        geometry::Polyline path;  // from the first point outside
    };

    /// `step` is the distance between samples [mm]; a reference to the wall is kept.
    BranchTree(const geometry::MeshQuery& wall, double step) : wall_(wall), step_(step) {}

    std::vector<geometry::CentrelineBranch> branches;  // parents first

    void add_root(const geometry::Polyline& path, bool fixed_start, bool fixed_end);
    /// Adds a branch along the own part; `landing` is the branch that its end runs into, or none.
    void add(const Own&, bool fixed_end, BranchSample landing = {});

    Own own_part(const geometry::Polyline& path) const;
    /// Width of the largest ball along the own part [mm].
    double width(const Own&) const;
    /// Whether it is a bulge, not a branch: shorter than the diameter of the vessel that it leaves, or than
    /// 1.5 times its own width(), unlike a sac on a neck. Where the vessel is narrowed, its width nearby
    /// counts.
    bool is_spur(const Own&) const;

private:
    BranchSample contact(const geometry::Vec3&) const;
    void clear(geometry::Polyline& path, double total) const;
    int junction(const BranchSample&, const Centreline&) const;
    void connect(Centreline&, const geometry::Vec3& place) const;
    void append(int parent, int parent_sample, Centreline);

    const geometry::MeshQuery& wall_;
    double step_;
};

/// Cuts a path that ends at a blind wall back to where it can still follow the middle of the vessel.
void trim_tip(geometry::Polyline& path, const geometry::MeshQuery& wall);

/// The tip at the end of a branch, or at its start.
VesselTip tip_of(const std::vector<geometry::CentrelineBranch>&, int branch, const geometry::Vec3& apex,
                 bool start);

}  // namespace anatomy
