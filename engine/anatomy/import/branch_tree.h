#pragma once
/// The tree of centrelines that tracing builds, branch by branch, from rough ways through the lumen.

#include <vector>

#include "engine/anatomy/import/centreline.h"
#include "engine/anatomy/import/lumen_tracing.h"

namespace anatomy {

/// A way from the root to an opening, or to a blind end (-1).
struct RootedWay {
    int opening;
    geometry::Polyline points;
};

/// By length times width: what makes one vessel the stem of others.
void sort_stems_first(std::vector<RootedWay>&, const geometry::MeshQuery& wall);

/// A sample of a branch; none when `branch` is negative.
struct BranchSample {
    int branch = -1, sample = -1;
};

/// Branches so far, and where a new one leaves them.
class BranchTree {
public:
    /// The part of a way from the root to a tip that lies outside every branch, and which it leaves.
    struct Own {
        BranchSample parent;
        geometry::Polyline way;  // from the first place outside
    };

    /// `step` between samples [mm]; the wall is kept by reference.
    BranchTree(const geometry::MeshQuery& wall, double step) : wall_(wall), step_(step) {}

    std::vector<geometry::CentrelineBranch> branches;  // parents first

    void add_root(const geometry::Polyline& way, bool fixed_start, bool fixed_end);
    /// A branch along the own part; `landing`: the branch that its end runs into, or none.
    void add(const Own&, bool fixed_end, BranchSample landing = {});

    Own own_part(const geometry::Polyline& way) const;
    /// The widest ball along the own part [mm].
    double width(const Own&) const;
    /// A bulge, not a branch: shorter than the diameter of the vessel that it leaves, or than it is wide and
    /// half as much, as a sac on a neck is not. Where the vessel is narrowed, its width nearby counts.
    bool is_spur(const Own&) const;

private:
    BranchSample contact(const geometry::Vec3&) const;
    void clear(geometry::Polyline& way, double total) const;
    int junction(const BranchSample&, const Centreline&) const;
    void connect(Centreline&, const geometry::Vec3& place) const;
    void append(int parent, int parent_sample, Centreline);

    const geometry::MeshQuery& wall_;
    double step_;
};

/// Ends a way where it still has the middle of the vessel to follow: its end is at a blind wall.
void trim_tip(geometry::Polyline& way, const geometry::MeshQuery& wall);

/// At the end of a branch, or at its start.
VesselTip tip_of(const geometry::CentrelineBranch&, const geometry::Vec3& apex, bool start);

}  // namespace anatomy
