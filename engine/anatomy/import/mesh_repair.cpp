#include "engine/anatomy/import/mesh_repair.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <numeric>
#include <unordered_set>
#include <utility>
#include <vector>

#include "engine/anatomy/anatomy_check.h"
#include "engine/anatomy/import/mesh_cut.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/geometry/vec.h"

namespace anatomy {
namespace {

using Triangle = std::array<int, 3>;

/// The edges of a mesh, to keep patches from using one a third time.
class EdgeSet {
public:
    explicit EdgeSet(const geometry::TriangleMesh&);
    bool holds(int a, int b) const { return edges_.contains(key(a, b)); }
    void add(int a, int b) { edges_.insert(key(a, b)); }

private:
    static std::uint64_t key(int a, int b) {
        return static_cast<std::uint64_t>(a < b ? a : b) << 32 | static_cast<std::uint32_t>(a < b ? b : a);
    }
    std::unordered_set<std::uint64_t> edges_;
};

/// The time for the least area grows with the cube of the number of corners of the rim.
constexpr int longest_rim = 120;

/// Triangulation of least area of a polygon in space, by dynamic programming (Barequet and Sharir 1995).
class LeastArea {
public:
    LeastArea(const TriangleMesh& mesh, const EdgeSet& edges, const std::vector<int>& rim)
        : mesh_(mesh), edges_(edges), rim_(rim), count_(static_cast<int>(rim.size())) {
        area_.assign(static_cast<std::size_t>(count_) * count_, 0.0);
        apex_.assign(area_.size(), -1);
        for (int span = 2; span < count_; ++span)
            for (int i = 0; i + span < count_; ++i) solve(i, i + span);
    }
    bool found() const { return area_[at(0, count_ - 1)] < std::numeric_limits<double>::infinity(); }
    void append(TriangleMesh& mesh, EdgeSet& edges) const { append(mesh, edges, 0, count_ - 1); }

private:
    std::size_t at(int i, int j) const { return static_cast<std::size_t>(i) * count_ + j; }
    double area(int i, int k, int j) const {
        const Vec3& a = mesh_.vertices[rim_[i]];
        return (mesh_.vertices[rim_[k]] - a).cross(mesh_.vertices[rim_[j]] - a).norm();
    }
    void solve(int i, int j) {
        double& least = area_[at(i, j)];
        least = std::numeric_limits<double>::infinity();
        const bool outer = i == 0 && j == count_ - 1;
        if (!outer && edges_.holds(rim_[i], rim_[j])) return;
        for (int k = i + 1; k < j; ++k) {
            const double sum = area_[at(i, k)] + area_[at(k, j)] + area(i, k, j);
            if (sum < least) least = sum, apex_[at(i, j)] = k;
        }
    }
    void append(TriangleMesh& mesh, EdgeSet& edges, int i, int j) const {
        if (j - i < 2) return;
        const int k = apex_[at(i, j)];
        mesh.triangles.push_back({rim_[i], rim_[k], rim_[j]});
        edges.add(rim_[i], rim_[j]);
        append(mesh, edges, i, k);
        append(mesh, edges, k, j);
    }

    const TriangleMesh& mesh_;
    const EdgeSet& edges_;
    const std::vector<int>& rim_;
    int count_;
    std::vector<double> area_;  // twice the least area over the rim from i to j
    std::vector<int> apex_;
};

EdgeSet::EdgeSet(const TriangleMesh& mesh) {
    edges_.reserve(2 * mesh.triangles.size());
    for (const auto& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) add(t[k], t[(k + 1) % 3]);
}

/// Closes the hole by the triangulation of its rim with the least area, or by a fan from its centroid where
/// the rim is long or every triangulation would reuse an edge of the mesh.
void fill_hole(TriangleMesh& mesh, EdgeSet& edges, const geometry::BoundaryLoop& hole) {
    const std::vector<int>& rim = hole.vertices;
    if (static_cast<int>(rim.size()) <= longest_rim) {
        const LeastArea patch(mesh, edges, rim);
        if (patch.found()) {
            patch.append(mesh, edges);
            return;
        }
    }
    const int centre = static_cast<int>(mesh.vertices.size());
    mesh.vertices.push_back(hole.centroid);
    for (std::size_t i = 0; i < rim.size(); ++i) {
        mesh.triangles.push_back({centre, rim[i], rim[(i + 1) % rim.size()]});
        edges.add(centre, rim[i]);
    }
}

/// Whether most of the surface lies along the axes, as that of voxels does, and not along one of them only,
/// as that of a flat vessel may.
bool is_made_of_steps(const TriangleMesh& mesh) {
    constexpr double most_along_axes = 0.6, cosine = 0.97, most_along_one = 0.65;
    Vec3 along = Vec3::Zero();
    double whole = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3& a = mesh.vertices[t[0]];
        const Vec3 normal = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
        whole += normal.norm();
        int axis = 0;
        if (normal.cwiseAbs().maxCoeff(&axis) > cosine * normal.norm()) along[axis] += normal.norm();
    }
    return along.sum() > most_along_axes * whole && along.maxCoeff() < most_along_one * along.sum();
}

/// Smooths a surface without shrinking it, each corner towards its neighbours and back (Taubin 1995); a rim
/// stays where it is.
void smooth(TriangleMesh& mesh, int rounds = 8) {
    std::vector<char> rim(mesh.vertices.size(), 0);
    EdgeUses(mesh.triangles).each([&](const auto* first, const auto* last) {
        if (last - first == 1) rim[first->low] = rim[first->high] = 1;
    });
    std::vector<Vec3> sums(mesh.vertices.size());
    std::vector<int> counts(mesh.vertices.size());
    for (int pass = 0; pass < 2 * rounds; ++pass) {
        std::ranges::fill(sums, Vec3::Zero());
        std::ranges::fill(counts, 0);
        for (const Triangle& t : mesh.triangles) {
            for (int k = 0; k < 3; ++k) {
                sums[t[k]] += mesh.vertices[t[(k + 1) % 3]] + mesh.vertices[t[(k + 2) % 3]];
                counts[t[k]] += 2;
            }
        }
        const double step = pass % 2 == 0 ? 0.5 : -0.53;
        for (std::size_t v = 0; v < sums.size(); ++v) {
            if (counts[v] > 0 && !rim[v]) mesh.vertices[v] += step * (sums[v] / counts[v] - mesh.vertices[v]);
        }
    }
}

void remove(std::vector<Triangle>& triangles, const std::vector<char>& gone) {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < triangles.size(); ++t)
        if (!gone[t]) triangles[kept++] = triangles[t];
    triangles.resize(kept);
}

Vec3 centroid(const TriangleMesh& mesh, const Triangle& t) {
    return (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
}
double area(const TriangleMesh& mesh, const Triangle& t) {
    const Vec3& a = mesh.vertices[t[0]];
    return 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
}

class Repair {
public:
    explicit Repair(const TriangleMesh& given) : mesh_(given) {
        for (Vec3& v : mesh_.vertices) v = v.cast<float>().cast<double>();  // as the result is stored
        mesh_ = geometry::welded(mesh_);
    }

    RepairedLumen done() {
        weld_near();
        drop_doubles();
        remember_rims();
        drop_fins();
        drop_islands();
        if (mesh_.triangles.size() < 4) {
            throw io::InputError("{} triangle{} found; expected the closed or tubular surface of a lumen",
                                 mesh_.triangles.size(), mesh_.triangles.size() == 1 ? " was" : "s were");
        }
        orient();
        fill_holes();
        if (is_made_of_steps(mesh_)) {
            // Each step is flat and has a sharp rim, but is no cap.
            smooth(mesh_);
            mended("the surface is made of the steps of voxels and was smoothed", Finding::Topic::Smoothed);
        } else {
            open_caps();
        }
        RepairedLumen result;
        result.mesh = compact();
        result.ends = openings_of(result.mesh);
        result.findings = std::move(findings_);
        return result;
    }

private:
    using Topic = Finding::Topic;
    void note(Finding::Kind kind, std::string text, Topic topic = Topic::Other) {
        findings_.push_back({kind, std::move(text), topic});
    }
    void mended(std::string text, Topic topic = Topic::Other) {
        note(Finding::Kind::Mended, std::move(text), topic);
    }

    void weld_near() {
        Vec3 low = Vec3::Constant(1e300), high = -low;
        for (const Vec3& v : mesh_.vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
        const double reach = 1e-6 * (high - low).norm();
        if (!(reach > 0)) return;
        using Cell = std::array<std::int64_t, 3>;
        const auto cell_of = [&](const Vec3& v) {
            Cell cell;
            for (int k = 0; k < 3; ++k)
                cell[k] = static_cast<std::int64_t>(std::floor((v[k] - low[k]) / reach));
            return cell;
        };
        const auto key = [](const Cell& c) {
            return static_cast<std::uint64_t>(c[0]) << 42 ^ static_cast<std::uint64_t>(c[1]) << 21 ^
                   static_cast<std::uint64_t>(c[2]);
        };
        std::unordered_multimap<std::uint64_t, int> held;
        held.reserve(mesh_.vertices.size());
        std::vector<int> same(mesh_.vertices.size());
        int count = 0;
        for (int v = 0; v < static_cast<int>(same.size()); ++v) {
            same[v] = v;
            const Cell at = cell_of(mesh_.vertices[v]);
            for (int n = 0; n < 27 && same[v] == v; ++n) {
                const auto [from, to] =
                    held.equal_range(key({at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1}));
                for (auto i = from; i != to; ++i) {
                    if ((mesh_.vertices[i->second] - mesh_.vertices[v]).norm() <= reach)
                        same[v] = std::min(same[v], i->second);
                }
            }
            if (same[v] == v)
                held.emplace(key(at), v);
            else
                ++count;
        }
        const std::size_t before = mesh_.triangles.size();
        std::vector<char> gone(before, 0);
        for (std::size_t t = 0; t < before; ++t) {
            auto& [a, b, c] = mesh_.triangles[t];
            a = same[a], b = same[b], c = same[c];
            gone[t] = a == b || b == c || c == a;
        }
        remove(mesh_.triangles, gone);
        if (count > 0)
            mended(fmt::format("{} corners within {:.2g} mm of another were welded to it", count, reach));
        if (const auto lost = before - mesh_.triangles.size(); lost > 0)
            mended(fmt::format("{} triangles without area were dropped", lost));
    }

    void drop_doubles() {
        std::vector<std::pair<Triangle, int>> sorted;
        for (int t = 0; t < static_cast<int>(mesh_.triangles.size()); ++t) {
            Triangle key = mesh_.triangles[t];
            std::ranges::sort(key);
            sorted.emplace_back(key, t);
        }
        std::ranges::sort(sorted);
        std::vector<char> gone(mesh_.triangles.size(), 0);
        int count = 0;
        for (std::size_t i = 1; i < sorted.size(); ++i)
            if (sorted[i].first == sorted[i - 1].first) gone[sorted[i].second] = 1, ++count;
        remove(mesh_.triangles, gone);
        if (count > 0) mended(fmt::format("{} double triangles were dropped", count));
    }

    void remember_rims() {
        EdgeUses(mesh_.triangles).each([&](const auto* first, const auto* last) {
            if (last - first == 1) rims_.add(first->low, first->high);
        });
    }
    /// Whether most of a rim was open before triangles were dropped.
    bool was_open(const geometry::BoundaryLoop& loop) const {
        const std::size_t count = loop.vertices.size();
        std::size_t open = 0;
        for (std::size_t i = 0; i < count; ++i)
            open += rims_.holds(loop.vertices[i], loop.vertices[(i + 1) % count]);
        return 2 * open >= count;
    }

    /// Of three or more triangles on an edge, those that lead nowhere are dropped first.
    void drop_fins() {
        int edges = 0, count = 0;
        Vec3 place = Vec3::Zero();
        for (bool peeling = true; peeling;) {
            const EdgeUses sides(mesh_.triangles);
            std::vector<int> free_edges(mesh_.triangles.size(), 0);
            sides.each([&](const auto* first, const auto* last) {
                if (last - first == 1) ++free_edges[first->triangle];
            });
            std::vector<char> gone(mesh_.triangles.size(), 0);
            int peeled = 0, crowded = 0;
            const auto at_crowded = [&](auto visit) {
                sides.each([&](const auto* first, const auto* last) {
                    if (last - first > 2) visit(first, last);
                });
            };
            at_crowded([&](const auto* first, const auto* last) {
                if (++crowded == 1) place = (mesh_.vertices[first->low] + mesh_.vertices[first->high]) / 2;
                auto left = std::count_if(first, last, [&](const auto& use) { return !gone[use.triangle]; });
                for (const int wanted : {2, 1}) {
                    for (const auto* use = first; use != last && left > 2; ++use) {
                        if (gone[use->triangle] || free_edges[use->triangle] < wanted) continue;
                        gone[use->triangle] = 1, ++peeled, --left;
                    }
                }
            });
            if (edges == 0) edges = crowded;
            if (peeled == 0 && crowded > 0) {  // surfaces that share an edge: both are opened there
                at_crowded([&](const auto* first, const auto* last) {
                    for (const auto* use = first; use != last; ++use)
                        peeled += !std::exchange(gone[use->triangle], 1);
                });
            }
            remove(mesh_.triangles, gone);
            count += peeled;
            peeling = peeled > 0;
        }
        if (edges > 0) {
            note(Finding::Kind::Warned,
                 fmt::format(
                     "{} edges of three or more triangles, such as at {}: {} triangles there were dropped",
                     edges, io::place_text(place), count),
                 Topic::Removed);
        }
    }

    void drop_islands() {
        const int total = static_cast<int>(mesh_.triangles.size());
        std::vector<int> root(total);
        std::iota(root.begin(), root.end(), 0);
        const auto find = [&root](int t) {
            while (root[t] != t) t = root[t] = root[root[t]];
            return t;
        };
        EdgeUses(mesh_.triangles).each([&](const auto* first, const auto* last) {
            for (const auto* use = first + 1; use < last; ++use) {
                const int a = find(first->triangle), b = find(use->triangle);
                root[std::max(a, b)] = std::min(a, b);
            }
        });
        std::map<int, double> areas;
        double whole = 0;
        for (int t = 0; t < total; ++t) {
            const double own = area(mesh_, mesh_.triangles[t]);
            areas[find(t)] += own, whole += own;
        }
        if (areas.size() < 2) return;
        const auto larger = [](const auto& a, const auto& b) { return a.second < b.second; };
        const int main = std::ranges::max_element(areas, larger)->first;
        const double kept = areas[main];
        areas.erase(main);
        const int next = std::ranges::max_element(areas, larger)->first;
        std::vector<char> gone(total, 0);
        int count = 0;
        for (int t = 0; t < total; ++t) count += gone[t] = find(t) != main;
        const double fraction = 100 * (1 - kept / whole);
        const std::string where = io::place_text(centroid(mesh_, mesh_.triangles[next]));
        if (areas.at(next) > 0.25 * whole) {
            throw io::InputError(
                "the surface is in pieces apart, one of them {:.2g} % of it, at {}: two vessels, or the "
                "inside and the outside of a wall; expected one lumen, with specks of up to 25 % beside it",
                100 * areas.at(next) / whole, where);
        }
        note(fraction > 5 ? Finding::Kind::Warned : Finding::Kind::Mended,
             fmt::format(
                 "{} pieces apart from the vessel were dropped: {} triangles, {:.2g} % of the surface, "
                 "the largest at {}",
                 areas.size(), count, fraction, where),
             Topic::Removed);
        remove(mesh_.triangles, gone);
    }

    void orient() {
        const int total = static_cast<int>(mesh_.triangles.size());
        std::vector<std::vector<std::pair<int, bool>>> across(total);  // triangle, and whether it agrees
        EdgeUses(mesh_.triangles).each([&](const auto* first, const auto* last) {
            if (last - first != 2) return;
            const bool agree = first[0].forward != first[1].forward;
            across[first[0].triangle].emplace_back(first[1].triangle, agree);
            across[first[1].triangle].emplace_back(first[0].triangle, agree);
        });
        std::vector<int> turned(total, -1), open = {0};
        turned[0] = 0;
        for (std::size_t next = 0; next < open.size(); ++next) {
            const int t = open[next];
            for (const auto& [u, agree] : across[t]) {
                const int wanted = agree ? turned[t] : 1 - turned[t];
                if (turned[u] < 0) turned[u] = wanted, open.push_back(u);
                if (turned[u] == wanted) continue;
                throw io::InputError(
                    "the surface has no inside: at {} it meets its own back, as a Möbius band does; expected "
                    "a surface with two sides",
                    io::place_text(centroid(mesh_, mesh_.triangles[t])));
            }
        }
        for (int t = 0; t < total; ++t)
            if (turned[t] == 1) std::swap(mesh_.triangles[t][1], mesh_.triangles[t][2]);
        if (geometry::signed_volume(geometry::capped(mesh_, simple_loops(mesh_))) < 0) {
            for (Triangle& t : mesh_.triangles) std::swap(t[1], t[2]);
            for (int& t : turned) t = 1 - t;
        }
        const auto count = std::ranges::count(turned, 1);
        if (count == total)
            mended("all triangles faced into the lumen and were turned outward");
        else if (count > 0)
            mended(
                fmt::format("{} of {} triangles faced into the lumen and were turned outward", count, total));
    }

    void fill_holes() {
        given_triangles_ = static_cast<int>(mesh_.triangles.size());
        int count = 0;
        std::string list;
        EdgeSet edges(mesh_);
        for (const MeshOpening& opening : openings_at(mesh_, simple_loops(mesh_))) {
            if (opening.is_end() && opening.inscribed >= thinnest_wire_radius && was_open(opening.loop))
                continue;
            fill_hole(mesh_, edges, opening.loop);
            if (++count <= 10)
                list += fmt::format("{} {} r {:.2f}", count > 1 ? "," : "",
                                    io::place_text(opening.loop.centroid), opening.radius);
        }
        if (count > 10) list += fmt::format(" and {} more", count - 10);
        if (count > 0) mended(fmt::format("{} holes were filled [mm]:{}", count, list));
        const geometry::Topology left = geometry::topology(mesh_);
        if (left.non_manifold_edges > 0)
            throw io::InputError(
                "{} edges are still shared by three triangles after mending; expected a surface without "
                "them: repair the mesh in a mesh editor",
                left.non_manifold_edges);
    }

    /// Takes off the flat caps that close vessels. What was filled as a hole is no cap.
    void open_caps() {
        std::vector<FlatCap> caps = flat_caps(mesh_);
        std::erase_if(caps, [this](const FlatCap& cap) {
            const auto own = std::ranges::lower_bound(cap.triangles, given_triangles_);
            return 2 * (own - cap.triangles.begin()) < static_cast<std::ptrdiff_t>(cap.triangles.size());
        });
        if (caps.empty()) return;
        const auto without = [this, &caps] {
            TriangleMesh mesh = mesh_;
            std::vector<char> gone(mesh.triangles.size(), 0);
            for (const FlatCap& cap : caps)
                for (const int t : cap.triangles) gone[t] = 1;
            remove(mesh.triangles, gone);
            return mesh;
        };
        const TriangleMesh opened = without();
        const std::vector<MeshOpening> ends = openings_of(opened);
        std::erase_if(caps, [&ends](const FlatCap& cap) {
            return std::ranges::none_of(ends, [&cap](const MeshOpening& end) {
                return end.is_end() && (end.loop.centroid - cap.centre).norm() < 0.1 * cap.radius;
            });
        });
        if (caps.empty()) return;
        mesh_ = without();
        std::string list;
        for (std::size_t k = 0; k < caps.size() && k < 10; ++k)
            list += fmt::format("{} {} r {:.2f}", k > 0 ? "," : "", io::place_text(caps[k].centre),
                                caps[k].radius);
        if (caps.size() > 10) list += fmt::format(" and {} more", caps.size() - 10);
        mended(fmt::format("{} flat cap{} taken off: {} [mm]:{}", caps.size(),
                           caps.size() == 1 ? " was" : "s were",
                           caps.size() == 1 ? "the vessel ends there" : "the vessels end there", list),
               Topic::Ends);
    }

    TriangleMesh compact() const {
        TriangleMesh result;
        std::vector<int> index(mesh_.vertices.size(), -1);
        for (const Triangle& t : mesh_.triangles) {
            Triangle renumbered;
            for (int k = 0; k < 3; ++k) {
                int& at = index[t[k]];
                if (at < 0) {
                    at = static_cast<int>(result.vertices.size());
                    result.vertices.push_back(mesh_.vertices[t[k]].cast<float>().cast<double>());
                }
                renumbered[k] = at;
            }
            result.triangles.push_back(renumbered);
        }
        return result;
    }

    TriangleMesh mesh_;
    EdgeSet rims_{TriangleMesh{}};  // edges of one triangle in the surface as given
    int given_triangles_ = 0;       // those after them fill holes
    std::vector<Finding> findings_;
};

}  // namespace

std::string text_of(const Finding& finding) {
    const char* kind = finding.kind == Finding::Kind::Mended   ? "mended: "
                       : finding.kind == Finding::Kind::Warned ? "note: "
                                                               : "found: ";
    return kind + finding.text;
}

std::string summary_of(const std::vector<Finding>& findings) {
    using Topic = Finding::Topic;
    std::string text = "What was taken and changed:";
    for (const auto& [topic, name, none] :
         {std::tuple(Topic::Axes, "axes", "LPS"), std::tuple(Topic::Removed, "removed", "nothing"),
          std::tuple(Topic::Smoothed, "smoothed", "nothing"),
          std::tuple(Topic::Ends, "ends cut", "none, all were open"),
          std::tuple(Topic::Names, "names not used", "none")}) {
        std::string list;
        for (const Finding& finding : findings)
            if (finding.topic == topic) list += (list.empty() ? "" : "; ") + finding.text;
        text += fmt::format(" {}: {}.", name, list.empty() ? none : list);
    }
    return text;
}

RepairedLumen repaired(const TriangleMesh& mesh) {
    return Repair(mesh).done();
}

}  // namespace anatomy
