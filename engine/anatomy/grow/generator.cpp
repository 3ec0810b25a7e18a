#include "engine/anatomy/grow/generator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <span>

#include "engine/anatomy/grow/implicit_lumen.h"
#include "engine/anatomy/grow/surface_nets.h"
#include "engine/anatomy/mesh_quality.h"
#include "engine/io/error.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

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
        for (const auto& [corner, share] : part)
            if (share < snapped_part) order.emplace_back(share, corner);
        std::sort(order.begin(), order.end());
        std::map<int, std::vector<int>> triangles_of;
        for (int i = 0; i < static_cast<int>(mesh_.triangles.size()); ++i) {
            for (const int corner : mesh_.triangles[i])
                if (part.contains(corner)) triangles_of[corner].push_back(i);
        }
        for (const auto& [share, corner] : order) {
            // Three corners in the plane would leave a triangle that closes the end.
            const bool flat =
                std::any_of(triangles_of[corner].begin(), triangles_of[corner].end(), [&, c = corner](int i) {
                    const auto& t = mesh_.triangles[i];
                    return std::all_of(t.begin(), t.end(), [&](int v) { return v == c || height_[v] == 0; });
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
            const bool goes =
                std::any_of(t.begin(), t.end(), [&](int v) { return beyond_[v] && height_[v] > 0; });
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
        return std::all_of(t.begin(), t.end(),
                           [&](int v) { return v < static_cast<int>(height_.size()) && height_[v] == 0; });
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

/// Share of the work that is done after each step, as measured.
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
            "other beside a junction; vessels that part more widely are accepted");
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
