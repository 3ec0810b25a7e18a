#include "engine/anatomy/grow/generator.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <span>
#include <unordered_map>
#include <vector>

#include "engine/anatomy/anatomy_check.h"
#include "engine/anatomy/grow/implicit_lumen.h"
#include "engine/anatomy/grow/surface_nets.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/vec.h"

namespace anatomy {
namespace {

/// Of an edge across the vessel; sets its length to √(8·r·sagitta) [mm].
constexpr double edge_sagitta = 0.025;

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
const double sharp = geometry::pow(geometry::tan(15 * M_PI / 180), 2);

class Remesher {
public:
    Remesher(const TriangleMesh& mesh, const ImplicitLumen& lumen) : mesh_(mesh), lumen_(lumen) {
        for (const Vec3& p : mesh_.points) {
            const ImplicitLumen::Value value = lumen.at(p);
            wanted_.push_back(wanted_length(value.radius));
            outward_.push_back(value.gradient.normalized());
        }
    }

    double largest_wanted() const { return *std::ranges::max_element(wanted_); }

    /// Merges edges shorter than both their fraction of the target length and `most`.
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

/// Merges edges up to the target length, flips them until they are Delaunay, and evens out the corners along
/// the surface, repeatedly. Takes and returns a closed manifold.
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

struct EndCut {
    geometry::Vec3 centre, outward;  // of the plane; outward is a unit vector
    geometry::Vec3 beyond;           // a point on the axis inside the part to be cut off [mm]
};

constexpr double snapped_part = 0.35;  // of a cut edge: nearer corners move into the plane

class Cutter {
public:
    Cutter(TriangleMesh& mesh, const ImplicitLumen& lumen, const EndCut& cut)
        : mesh_(mesh), lumen_(lumen), cut_(cut) {
        for (const Vec3& v : mesh.vertices) height_.push_back((v - cut.centre).dot(cut.outward));
    }

    void cut() {
        flood();
        snap();
        clip();
    }

private:
    /// Marks the corners beyond the plane that are connected to the tip.
    void flood() {
        const int count = static_cast<int>(mesh_.vertices.size());
        std::vector<std::vector<int>> neighbours(mesh_.vertices.size());
        for (const auto& t : mesh_.triangles) {
            for (int k = 0; k < 3; ++k) {
                if (height_[t[k]] > 0 && height_[t[(k + 1) % 3]] > 0) {
                    neighbours[t[k]].push_back(t[(k + 1) % 3]);
                    neighbours[t[(k + 1) % 3]].push_back(t[k]);
                }
            }
        }
        int tip = -1;
        double least = std::numeric_limits<double>::infinity();
        for (int v = 0; v < count; ++v) {
            const double distance = (mesh_.vertices[v] - cut_.beyond).norm();
            if (height_[v] > 0 && distance < least) least = distance, tip = v;
        }
        beyond_.assign(mesh_.vertices.size(), false);
        if (tip < 0) return;
        std::vector<int> waiting = {tip};
        beyond_[tip] = true;
        while (!waiting.empty()) {
            const int v = waiting.back();
            waiting.pop_back();
            for (const int other : neighbours[v]) {
                if (!beyond_[other]) beyond_[other] = true, waiting.push_back(other);
            }
        }
    }
    bool crossed(int a, int b) const {
        return (beyond_[a] && height_[a] > 0 && height_[b] < 0) ||
               (beyond_[b] && height_[b] > 0 && height_[a] < 0);
    }
    /// Moves a point onto both the plane and the surface.
    Vec3 on_rim(Vec3 x) const {
        for (int iteration = 0; iteration < 20; ++iteration) {
            x -= (x - cut_.centre).dot(cut_.outward) * cut_.outward;
            const ImplicitLumen::Value value = lumen_.at(x);
            const Vec3 slope = value.gradient - value.gradient.dot(cut_.outward) * cut_.outward;
            if (std::abs(value.distance) < 1e-9 || slope.squaredNorm() < 1e-4) break;
            x -= value.distance / slope.squaredNorm() * slope;
        }
        return x;
    }
    void snap() {
        std::map<int, double> part;  // distance of a corner from the plane, as part of its shortest cut edge
        for (const auto& t : mesh_.triangles) {
            for (int k = 0; k < 3; ++k) {
                const int a = t[k], b = t[(k + 1) % 3];
                if (!crossed(a, b)) continue;
                const double of_a = height_[a] / (height_[a] - height_[b]);
                part.try_emplace(a, 1).first->second = std::min(part.try_emplace(a, 1).first->second, of_a);
                part.try_emplace(b, 1).first->second =
                    std::min(part.try_emplace(b, 1).first->second, 1 - of_a);
            }
        }
        std::vector<std::pair<double, int>> order;
        for (const auto& [corner, fraction] : part)
            if (fraction < snapped_part) order.emplace_back(fraction, corner);
        std::ranges::sort(order);
        std::map<int, std::vector<int>> triangles_of;
        for (int i = 0; i < static_cast<int>(mesh_.triangles.size()); ++i) {
            for (const int corner : mesh_.triangles[i])
                if (part.contains(corner)) triangles_of[corner].push_back(i);
        }
        for (const auto& [fraction, corner] : order) {
            // Three corners in the plane would leave a triangle that closes the end.
            const bool flat = std::ranges::any_of(triangles_of[corner], [&, c = corner](int i) {
                const auto& t = mesh_.triangles[i];
                return std::ranges::all_of(t, [&](int v) { return v == c || height_[v] == 0; });
            });
            if (flat) continue;
            mesh_.vertices[corner] = on_rim(mesh_.vertices[corner]);
            height_[corner] = 0;
        }
    }
    int rim_corner(int a, int b) {
        if (a > b) std::swap(a, b);
        const auto [at, fresh] = rim_.try_emplace({a, b}, static_cast<int>(mesh_.vertices.size()));
        if (fresh) {
            const double t = height_[a] / (height_[a] - height_[b]);
            mesh_.vertices.push_back(on_rim(mesh_.vertices[a] + t * (mesh_.vertices[b] - mesh_.vertices[a])));
        }
        return at->second;
    }
    void clip() {
        std::vector<std::array<int, 3>> kept;
        std::vector<int> polygon;
        for (const auto& t : mesh_.triangles) {
            const bool goes = std::ranges::any_of(t, [&](int v) { return beyond_[v] && height_[v] > 0; });
            if (!goes && !all_in_plane(t)) {
                kept.push_back(t);
                continue;
            }
            polygon.clear();
            for (int k = 0; k < 3; ++k) {
                const int a = t[k], b = t[(k + 1) % 3];
                if (height_[a] <= 0) polygon.push_back(a);
                if (crossed(a, b)) polygon.push_back(rim_corner(a, b));
            }
            if (polygon.size() < 3 ||
                (polygon.size() == 3 && all_in_plane({polygon[0], polygon[1], polygon[2]})))
                continue;
            add(polygon, kept);
        }
        mesh_.triangles = std::move(kept);
        drop_unused();
    }
    bool all_in_plane(const std::array<int, 3>& t) const {
        return std::ranges::all_of(
            t, [&](int v) { return v < static_cast<int>(height_.size()) && height_[v] == 0; });
    }
    void add(const std::vector<int>& polygon, std::vector<std::array<int, 3>>& kept) const {
        if (polygon.size() == 3) {
            kept.push_back({polygon[0], polygon[1], polygon[2]});
            return;
        }
        const auto length = [&](int p, int q) {
            return (mesh_.vertices[polygon[p]] - mesh_.vertices[polygon[q]]).squaredNorm();
        };
        const int first = length(0, 2) <= length(1, 3) ? 0 : 1;
        const auto at = [&](int k) { return polygon[(first + k) % 4]; };
        kept.push_back({at(0), at(1), at(2)});
        kept.push_back({at(0), at(2), at(3)});
    }
    void drop_unused() {
        std::vector<int> renumbered(mesh_.vertices.size(), -1);
        for (const auto& t : mesh_.triangles)
            for (const int v : t) renumbered[v] = 0;
        std::vector<Vec3> used;
        for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
            if (renumbered[v] < 0) continue;
            renumbered[v] = static_cast<int>(used.size());
            used.push_back(mesh_.vertices[v]);
        }
        for (auto& t : mesh_.triangles)
            for (int& v : t) v = renumbered[v];
        mesh_.vertices = std::move(used);
    }

    TriangleMesh& mesh_;
    const ImplicitLumen& lumen_;
    const EndCut& cut_;
    std::vector<double> height_;  // above the plane; 0 once moved into it [mm]
    std::vector<bool> beyond_;
    std::map<std::pair<int, int>, int> rim_;
};

/// The mesh without the parts beyond each plane, bounded by loops in the planes. Corners near a plane are
/// moved into it along the surface, to avoid sharp triangles. Throws InputError when the part beyond a plane
/// cannot be distinguished from the rest.
TriangleMesh cut_open(const TriangleMesh& mesh, const ImplicitLumen& lumen, std::span<const EndCut> cuts) {
    TriangleMesh open = mesh;
    for (const EndCut& cut : cuts) Cutter(open, lumen, cut).cut();
    return open;
}

/// Fraction of the work that is done after each step, as measured.
constexpr double sampled_part = 0.3, remeshed_part = 0.95;

VesselEnd end_of(const SampledBranch& branch, bool start) {
    const int last = static_cast<int>(branch.points.size()) - 1, sample = start ? 1 : last - 1;
    VesselEnd end;
    end.opening.name = branch.name + (start ? ".in" : ".out");
    end.opening.centre = branch.points[sample];
    end.opening.outward_normal = start ? Vec3(-branch.tangent(sample)) : branch.tangent(sample);
    end.opening.radius = branch.radii[sample];
    end.role = start ? EndRole::Inlet : EndRole::Outlet;
    return end;
}

}  // namespace

double grid_cell(const VesselTree& tree, const GeneratorOptions& options) {
    double area = 0;  // of the walls [mm²]
    for (const SampledBranch& branch : tree.branches)
        for (std::size_t i = 1; i < branch.points.size(); ++i)
            area += 2 * std::numbers::pi * branch.radii[i] * (branch.points[i] - branch.points[i - 1]).norm();
    // The surface passes through one and a half cells for each face of a cell that it covers. A grid much
    // finer than the edges of the smallest vessel's triangles only costs time.
    const double radius = tree.least_radius, finest = radius / options.most_cells_per_radius;
    return std::max(finest, std::min({radius / options.fewest_cells_per_radius,
                                      1.1 * std::sqrt(8 * radius * edge_sagitta),
                                      std::sqrt(1.5 * area / options.many_cells)}));
}

ClosedLumen closed_surface(const VesselTree& tree, const GeneratorOptions& options) {
    const auto part = [&](double from, double to, const char* what) -> std::function<void(double)> {
        if (!options.progress) return {};
        return [&options, from, to, what](double p) { options.progress(from + p * (to - from), what); };
    };
    ImplicitLumen lumen(tree, grid_cell(tree, options));
    const geometry::TriangleMesh nets =
        surface_nets(lumen, options.threads, part(0, sampled_part, "vessels, finding the surface"));
    geometry::TriangleMesh mesh =
        remeshed(nets, lumen, part(sampled_part, remeshed_part, "vessels, making better triangles"));
    return {std::move(lumen), std::move(mesh)};
}

Anatomy generate(const VesselTreeSpec& spec, const GeneratorOptions& options) {
    const VesselTree tree = grow(spec);
    return cut_open(spec, tree, closed_surface(tree, options));
}

Anatomy cut_open(const VesselTreeSpec& spec, const VesselTree& tree, const ClosedLumen& closed) {
    if (euler_characteristic(closed.mesh) != 2 - 2 * tree.loops()) {
        throw io::InputError(
            spec.name +
            ": the lumen has loops or hollows that its branches do not make, for vessels come too near each "
            "other beside a junction; expected vessels that part more widely");
    }

    Anatomy anatomy;
    anatomy.name = spec.name;
    anatomy.body = spec.body;
    anatomy.calcium = tree.calcium;
    std::vector<EndCut> cuts;
    for (int b = 0; b < static_cast<int>(tree.branches.size()); ++b) {
        const SampledBranch& branch = tree.branches[b];
        for (const bool start : {true, false}) {
            if (start ? branch.parent >= 0 : branch.closed || branch.joined >= 0) continue;
            anatomy.ends.push_back(end_of(branch, start));
            const geometry::OpenEnd& opening = anatomy.ends.back().opening;
            cuts.push_back({opening.centre, opening.outward_normal, closed.implicit.beyond_end(b, start)});
        }
        anatomy.branches.push_back({branch.name, branch.parent, branch.parent < 0 ? -1 : branch.parent_sample,
                                    branch.points, branch.radii});
    }
    place_targets(anatomy, spec, tree);
    anatomy.lumen = cut_open(closed.mesh, closed.implicit, cuts);
    const std::vector<std::string> wrong = problems(anatomy);
    if (!wrong.empty()) throw io::InputError(spec.name + ": " + io::joined(wrong, "\n"));
    return anatomy;
}

void place_targets(Anatomy& anatomy, const VesselTreeSpec& spec, const VesselTree& tree) {
    anatomy.targets.clear();
    for (const NamedTarget& target : spec.targets) {
        for (int b = 0; b < static_cast<int>(tree.branches.size()); ++b) {
            if (tree.branches[b].name != target.branch) continue;
            if (target.at > tree.branches[b].length() + 1) continue;  // beyond an occlusion
            const int sample = tree.branches[b].sample_at(target.at);
            anatomy.targets.push_back({target.name, anatomy.branches[b].points[sample], b, sample});
        }
    }
}

}  // namespace anatomy
