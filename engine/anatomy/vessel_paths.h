#pragma once
/// Ways along the centrelines of an anatomy, from any place to any other.

#include <cstddef>
#include <optional>
#include <vector>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

/// Finds once where branches start and end on others, so that a way may be asked for in every frame.
class VesselPaths {
public:
    explicit VesselPaths(const Anatomy&);

    /// A stretch of a branch, from one of its samples to another.
    struct Piece {
        int branch, from, to;
    };

    /// Length of the shortest way from one place to the other; empty for trees that do not meet [mm].
    std::optional<double> between(const VesselPlace&, const VesselPlace&) const;
    /// That way itself; empty for trees that do not meet.
    std::vector<Piece> route(const VesselPlace&, const VesselPlace&) const;

private:
    struct Branch {
        int parent, parent_sample;
        std::vector<double> steps;  // from each sample to the next [mm]
    };
    /// A stretch between two of the places where branches meet.
    struct Stretch {
        std::size_t from, to;
        double length;  // [mm]
    };
    double arc_between(int branch, int from, int to) const;
    std::vector<Piece> up_the_tree(const VesselPlace&, const VesselPlace&) const;
    std::vector<Piece> by_loops(const VesselPlace&, const VesselPlace&) const;

    std::vector<Branch> branches_;
    std::vector<VesselPlace> meetings_;  // every two are one place; empty for trees without loops
    std::vector<Stretch> stretches_;     // between meetings
};

/// Length of the shortest way along centrelines between the places nearest to two points; of the straight
/// line for trees that do not meet [mm].
double centreline_distance(const Anatomy&, const geometry::Vec3& from, const geometry::Vec3& to);

/// Points on a route, the first `spacing` from its start and each as far from the one before; where it ends
/// before, its last point is repeated.
void points_on(const Anatomy&, const std::vector<VesselPaths::Piece>& route, double spacing,
               std::vector<geometry::Vec3>& points);

}  // namespace anatomy
