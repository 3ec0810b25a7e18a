#include "engine/anatomy/grow/remesh.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "physics/geometry/vec.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

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

constexpr double shortest_edge = 0.75, longest_edge = 1.4;  // of the target length
constexpr double growth = 1.5;                              // of the longest merged edge from pass to pass
constexpr int finishing_passes = 4;

Vec3 normal_of(const Vec3& a, const Vec3& b, const Vec3& c) {
    return (b - a).cross(c - a);
}

/// Least of the three angles, as the square of its tangent: monotone and cheap.
double sharpness(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double area = normal_of(a, b, c).squaredNorm();
    const auto tangent = [area](const Vec3& u, const Vec3& v) {
        const double along = u.dot(v);
        return along <= 0 ? 1e9 : area / (along * along);
    };
    return std::min({tangent(b - a, c - a), tangent(c - b, a - b), tangent(a - c, b - c)});
}
constexpr double largest_deviation =
    0.045;  // of a triangle's centroid from f = 0 that no collapse may exceed [mm]
const double sharp = std::pow(std::tan(15 * M_PI / 180), 2);

class Remesher {
public:
    Remesher(const TriangleMesh& mesh, const ImplicitLumen& lumen) : mesh_(mesh), lumen_(lumen) {
        for (const Vec3& p : mesh_.points) {
            const ImplicitLumen::Value value = lumen.at(p);
            wanted_.push_back(wanted_length(value.radius));
            outward_.push_back(value.gradient.normalized());
        }
    }

    double largest_wanted() const { return *std::max_element(wanted_.begin(), wanted_.end()); }

    /// Merges edges shorter than both their share of the target length and `most`.
    void merge(double most) {
        for (int e = 0; e < mesh_.half_edges(); ++e) {
            if (!mesh_.alive(e)) continue;
            const int a = mesh_.from(e), b = mesh_.to(e);
            const double wanted = std::min(wanted_[a], wanted_[b]);
            if (length(a, b) < std::min(most, shortest_edge * wanted)) try_merge(e);
        }
    }
    void turn() {
        for (int pass = 0; pass < 3; ++pass) {
            bool turned = false;
            for (int e = 0; e < mesh_.half_edges(); ++e) {
                if (!mesh_.alive(e) || mesh_.opposite(e) < e || !should_turn(e)) continue;
                mesh_.flip(e);
                turned = true;
            }
            if (!turned) return;
        }
    }
    void even_out() {
        for (int corner = 0; corner < mesh_.corners(); ++corner) {
            if (mesh_.outgoing(corner) >= 0) move_to_middle(corner);
        }
    }
    TriangleMesh mesh() const { return mesh_.mesh(); }

private:
    const Vec3& point(int corner) const { return mesh_.points[corner]; }
    double length(int a, int b) const { return (point(a) - point(b)).norm(); }
    double wanted_length(double radius) const { return std::sqrt(8 * radius * edge_sagitta); }

    /// Merges the edge's ends at its middle on the surface unless the new triangles would be long, sharp,
    /// inverted or off the surface.
    void try_merge(int e) {
        if (!mesh_.may_collapse(e)) return;
        const int a = mesh_.from(e), b = mesh_.to(e);
        const auto [middle, there] = lumen_.foot(0.5 * (point(a) + point(b)));
        if (std::abs(there.distance) > 1e-4) return;
        const double wanted = wanted_length(there.radius);
        const Vec3 outward = there.gradient.normalized();
        // The cheap checks come first.
        bool fine = true;
        made_.clear();
        for (const int corner : {a, b}) {
            mesh_.around(corner, [&, to = middle](int out) {
                const int c = mesh_.to(out), d = mesh_.across(out);
                if (!fine || c == a || c == b) return;
                if ((point(c) - to).norm() > longest_edge * std::min(wanted, wanted_[c])) fine = false;
                if (d == a || d == b) return;
                fine = fine && acceptable(to, point(c), point(d), outward);
                if (!fine) return;
                const double after = sharpness(to, point(c), point(d));
                fine = after > sharp || after > sharpness(point(corner), point(c), point(d));
                made_.push_back({c, d});
            });
        }
        for (const auto& [c, d] : made_) fine = fine && near_surface(middle, point(c), point(d));
        if (!fine) return;
        mesh_.collapse(e);
        mesh_.points[b] = middle;
        wanted_[b] = wanted;
        outward_[b] = outward;
    }
    bool acceptable(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& outward) const {
        const Vec3 normal = normal_of(a, b, c);
        return normal.dot(outward) > 0.6 * normal.norm();
    }
    bool near_surface(const Vec3& a, const Vec3& b, const Vec3& c) const {
        return std::abs(lumen_.at((a + b + c) / 3).distance) < largest_deviation;
    }
    /// Delaunay criterion, as far as the surface allows.
    bool should_turn(int e) const {
        const int mate = mesh_.opposite(e);
        const int a = mesh_.from(e), b = mesh_.to(e), c = mesh_.across(e), d = mesh_.across(mate);
        const auto cotangent = [&](int apex) {
            const Vec3 u = point(a) - point(apex), v = point(b) - point(apex);
            return u.dot(v) / std::max(1e-12, u.cross(v).norm());
        };
        if (cotangent(c) + cotangent(d) >= -1e-9 || !mesh_.may_flip(e)) return false;
        const Vec3 outward = outward_[a] + outward_[b] + outward_[c] + outward_[d];
        const Vec3 unit = outward.normalized();
        return acceptable(point(d), point(c), point(a), unit) &&
               acceptable(point(c), point(d), point(b), unit) && near_surface(point(c), point(d), point(a)) &&
               near_surface(point(c), point(d), point(b));
    }
    /// Moves the corner along the surface towards the mean of its neighbours, weighted by the areas between.
    void move_to_middle(int corner) {
        Vec3 sum = Vec3::Zero();
        double weights = 0, sharpest = 1e9;
        const Vec3 here = point(corner);
        mesh_.around(corner, [&](int out) {
            const Vec3 &b = point(mesh_.to(out)), &c = point(mesh_.across(out));
            const double area = normal_of(here, b, c).norm();
            const double density = 1 / (wanted_[mesh_.to(out)] * wanted_[mesh_.to(out)]);
            sum += area * density * (here + b + c) / 3;
            weights += area * density;
            sharpest = std::min(sharpest, sharpness(here, b, c));
        });
        Vec3 move = sum / weights - here;
        move -= move.dot(outward_[corner]) * outward_[corner];
        const auto foot = lumen_.foot(here + 0.8 * move);
        const Vec3& moved = foot.point;
        const auto& there = foot.value;
        if (std::abs(there.distance) > 1e-4) return;
        const Vec3 outward = there.gradient.normalized();
        bool fine = true;
        mesh_.around(corner, [&](int out) {
            const Vec3 &b = point(mesh_.to(out)), &c = point(mesh_.across(out));
            const double after = sharpness(moved, b, c);
            fine = fine && acceptable(moved, b, c, outward) && (after > sharp || after > sharpest);
        });
        if (!fine) return;
        mesh_.points[corner] = moved;
        outward_[corner] = outward;
        wanted_[corner] = wanted_length(there.radius);
    }

    EdgeMesh mesh_;
    const ImplicitLumen& lumen_;
    std::vector<double> wanted_;  // edge length at each corner [mm]
    std::vector<Vec3> outward_;   // unit
    std::vector<std::pair<int, int>>
        made_;  // of the triangles that a merge makes: corners except the merged one
};

}  // namespace

TriangleMesh remeshed(const TriangleMesh& mesh, const ImplicitLumen& lumen,
                      const std::function<void(double)>& progress) {
    Remesher remesher(mesh, lumen);
    const double largest = remesher.largest_wanted();
    std::vector<double> passes;
    for (double most = lumen.cell(); most < largest; most *= growth) passes.push_back(most);
    passes.insert(passes.end(), finishing_passes, largest);
    const auto report = [&](std::size_t pass, double part) {
        if (progress) progress((static_cast<double>(pass) + part) / static_cast<double>(passes.size()));
    };
    for (std::size_t k = 0; k < passes.size(); ++k) {
        remesher.merge(passes[k]);
        report(k, 0.5);
        remesher.turn();
        report(k, 0.6);
        remesher.even_out();
        report(k, 1);
    }
    remesher.turn();
    return remesher.mesh();
}

}  // namespace anatomy
