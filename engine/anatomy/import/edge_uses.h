#pragma once
/// The edges of a mesh with the triangles that use them.

#include <algorithm>
#include <array>
#include <tuple>
#include <vector>

namespace anatomy {

/// The triangles on every edge, edges in order.
struct EdgeUses {
    struct Use {
        int low, high, triangle;
        bool forward;  // the triangle runs from low to high
    };
    std::vector<Use> uses;

    explicit EdgeUses(const std::vector<std::array<int, 3>>& triangles) {
        uses.reserve(3 * triangles.size());
        for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
            for (int k = 0; k < 3; ++k) {
                const int a = triangles[t][k], b = triangles[t][(k + 1) % 3];
                uses.push_back({std::min(a, b), std::max(a, b), t, a < b});
            }
        }
        std::sort(uses.begin(), uses.end(), [](const Use& p, const Use& q) {
            return std::tie(p.low, p.high, p.triangle) < std::tie(q.low, q.high, q.triangle);
        });
    }
    /// Calls visit(first, last) for the uses of every edge.
    template <class Visit>
    void each(Visit visit) const {
        for (std::size_t i = 0, j; i < uses.size(); i = j) {
            for (j = i + 1; j < uses.size() && uses[j].low == uses[i].low && uses[j].high == uses[i].high;)
                ++j;
            visit(uses.data() + i, uses.data() + j);
        }
    }
};

}  // namespace anatomy
