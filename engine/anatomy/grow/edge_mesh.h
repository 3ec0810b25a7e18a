#pragma once
/// A closed triangle mesh that can be changed edge by edge.

#include <vector>

#include "physics/geometry/vec.h"

namespace anatomy {

/// Half-edge 3t + k runs along triangle t from its corner k to the next. Removed triangles have corners −1;
/// removed corners have no half-edge.
class EdgeMesh {
public:
    /// The mesh must be closed, oriented and manifold (asserted).
    explicit EdgeMesh(const geometry::TriangleMesh&);

    int half_edges() const { return static_cast<int>(from_.size()); }
    int corners() const { return static_cast<int>(points.size()); }
    bool alive(int half_edge) const { return from_[half_edge] >= 0; }
    int outgoing(int corner) const { return outgoing_[corner]; }  // −1 when the corner has been removed

    static int next(int e) { return e % 3 == 2 ? e - 2 : e + 1; }
    static int previous(int e) { return e % 3 == 0 ? e + 2 : e - 1; }
    int opposite(int e) const { return opposite_[e]; }
    int from(int e) const { return from_[e]; }
    int to(int e) const { return from_[next(e)]; }
    int across(int e) const { return from_[previous(e)]; }  // the triangle's corner off the edge

    /// Calls visit(e) for every half-edge that leaves the corner.
    template <class Visit>
    void around(int corner, Visit visit) const {
        const int first = outgoing_[corner];
        int e = first;
        do {
            visit(e);
            e = opposite_[previous(e)];
        } while (e != first);
    }
    int degree(int corner) const;
    bool adjacent(int a, int b) const;

    /// Whether merging the ends of the edge leaves a closed manifold.
    bool may_collapse(int e) const;
    /// Merges from(e) into to(e), which stays where it is.
    void collapse(int e);
    bool may_flip(int e) const;
    /// Replaces the edge by the other diagonal of the two triangles that share it.
    void flip(int e);

    geometry::TriangleMesh mesh() const;

    std::vector<geometry::Vec3> points;  // [mm]

private:
    void join(int a, int b) { opposite_[a] = b, opposite_[b] = a; }
    std::vector<int> from_, opposite_, outgoing_;
};

}  // namespace anatomy
