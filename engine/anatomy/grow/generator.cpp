#include "engine/anatomy/grow/generator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/anatomy/grow/open_ends.h"
#include "engine/anatomy/grow/surface_nets.h"
#include "engine/anatomy/mesh_quality.h"
#include "engine/io/error.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

using geometry::Vec3;

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
                                      1.1 * std::sqrt(8 * radius * options.remesh.sagitta),
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
    geometry::TriangleMesh mesh = remeshed(
        nets, lumen, options.remesh, part(sampled_part, remeshed_part, "vessels, making better triangles"));
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
