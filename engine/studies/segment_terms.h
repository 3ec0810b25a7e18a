#pragma once
/// b, A, s and R of every segment of a wire in its tube (Eqs. 4 and 12), for studies of what one update sees.

#include <vector>

#include "engine/studies/paper_scene.h"

namespace studies {

/// [i] is that of segment i; [0] is not used.
struct SegmentTerms {
    std::vector<geometry::Vec3> pull;           // q = b − s₍i,N₎ [N·mm]
    std::vector<geometry::Mat3> bending, wall;  // A_i and R₍i,N₎ [N·mm]
    std::vector<int> touching;                  // joints in touch, ascending

    int last_touching() const { return touching.empty() ? -1 : touching.back(); }
    /// Number of joints in touch from i to j − 1.
    int touching_between(int i, int j) const;
};

SegmentTerms segment_terms(const PaperScene&, const physics::Chain&);

}  // namespace studies
