#include "engine/anatomy/grow/remesh.h"

#include <algorithm>
#include <cmath>

#include "engine/anatomy/grow/edge_mesh.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

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
const double sharp = std::pow(std::tan(15 * M_PI / 180), 2);

class Remesher {
public:
    Remesher(const TriangleMesh& mesh, const ImplicitLumen& lumen, const RemeshOptions& options)
        : mesh_(mesh), lumen_(lumen), options_(options) {
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
    double wanted_length(double radius) const { return std::sqrt(8 * radius * options_.sagitta); }

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
        return std::abs(lumen_.at((a + b + c) / 3).distance) < options_.deviation;
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
    RemeshOptions options_;
    std::vector<double> wanted_;  // edge length at each corner [mm]
    std::vector<Vec3> outward_;   // unit
    std::vector<std::pair<int, int>>
        made_;  // of the triangles that a merge makes: corners except the merged one
};

}  // namespace

TriangleMesh remeshed(const TriangleMesh& mesh, const ImplicitLumen& lumen, const RemeshOptions& options,
                      const std::function<void(double)>& progress) {
    Remesher remesher(mesh, lumen, options);
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
