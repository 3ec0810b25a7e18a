#include "engine/anatomy/grow/edge_mesh.h"

#include <cassert>
#include <cstdint>
#include <unordered_map>

namespace anatomy {

using geometry::TriangleMesh;

EdgeMesh::EdgeMesh(const TriangleMesh& mesh) : points(mesh.vertices), outgoing_(mesh.vertices.size(), -1) {
    for (const auto& t : mesh.triangles) from_.insert(from_.end(), t.begin(), t.end());
    opposite_.assign(from_.size(), -1);
    std::unordered_map<std::uint64_t, int> waiting;
    waiting.reserve(from_.size());
    for (int e = 0; e < half_edges(); ++e) {
        outgoing_[from(e)] = e;
        const auto key = [](int a, int b) {
            return static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint32_t>(b);
        };
        if (const auto mate = waiting.find(key(to(e), from(e))); mate != waiting.end()) {
            join(e, mate->second);
            waiting.erase(mate);
        } else {
            [[maybe_unused]] const bool fresh = waiting.emplace(key(from(e), to(e)), e).second;
            assert(fresh);
        }
    }
    assert(waiting.empty());
}

int EdgeMesh::degree(int corner) const {
    int count = 0;
    around(corner, [&](int) { ++count; });
    return count;
}

bool EdgeMesh::adjacent(int a, int b) const {
    bool found = false;
    around(a, [&](int e) { found = found || to(e) == b; });
    return found;
}

bool EdgeMesh::may_collapse(int e) const {
    const int a = from(e), b = to(e), left = across(e), right = across(opposite(e));
    if (left == right || degree(left) < 4 || degree(right) < 4) return false;
    bool only_two = true;
    around(a, [&](int out) {
        const int c = to(out);
        if (c != b && c != left && c != right && adjacent(c, b)) only_two = false;
    });
    return only_two;
}

void EdgeMesh::collapse(int e) {
    const int a = from(e), b = to(e), mate = opposite(e), left = across(e), right = across(mate);
    std::vector<int> leaving;
    around(a, [&](int out) { leaving.push_back(out); });
    for (const int out : leaving) from_[out] = b;
    const int left_keep = opposite(next(e)), left_join = opposite(previous(e));
    const int right_keep = opposite(next(mate)), right_join = opposite(previous(mate));
    join(left_keep, left_join);
    join(right_keep, right_join);
    // left_keep runs from left to b, left_join back; likewise on the right.
    outgoing_[left] = left_keep;
    outgoing_[right] = right_keep;
    outgoing_[b] = left_join;
    outgoing_[a] = -1;
    for (const int gone : {e, next(e), previous(e), mate, next(mate), previous(mate)}) from_[gone] = -1;
}

bool EdgeMesh::may_flip(int e) const {
    const int a = from(e), b = to(e), left = across(e), right = across(opposite(e));
    return left != right && degree(a) > 3 && degree(b) > 3 && !adjacent(left, right);
}

void EdgeMesh::flip(int e) {
    const int mate = opposite(e), a = from(e), b = to(e), left = across(e), right = across(mate);
    // Triangles (a, b, left) and (b, a, right) become (right, left, a) and (left, right, b).
    const int b_left = opposite(next(e)), left_a = opposite(previous(e));
    const int a_right = opposite(next(mate)), right_b = opposite(previous(mate));
    from_[e] = right, from_[next(e)] = left, from_[previous(e)] = a;
    from_[mate] = left, from_[next(mate)] = right, from_[previous(mate)] = b;
    join(next(e), left_a);
    join(previous(e), a_right);
    join(next(mate), right_b);
    join(previous(mate), b_left);
    outgoing_[a] = previous(e), outgoing_[b] = previous(mate);
    outgoing_[left] = mate, outgoing_[right] = e;
}

TriangleMesh EdgeMesh::mesh() const {
    TriangleMesh result;
    std::vector<int> renumbered(points.size(), -1);
    for (int corner = 0; corner < corners(); ++corner) {
        if (outgoing_[corner] < 0) continue;
        renumbered[corner] = static_cast<int>(result.vertices.size());
        result.vertices.push_back(points[corner]);
    }
    for (int e = 0; e < half_edges(); e += 3) {
        if (alive(e))
            result.triangles.push_back(
                {renumbered[from_[e]], renumbered[from_[e + 1]], renumbered[from_[e + 2]]});
    }
    return result;
}

}  // namespace anatomy
