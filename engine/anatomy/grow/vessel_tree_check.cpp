#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <set>

#include "engine/anatomy/grow/vessel_tree.h"
#include "engine/io/text.h"
#include "physics/geometry/maths.h"

namespace anatomy {
namespace {

constexpr double least_radius = 0.2, largest_radius = 30;  // of arteries that a wire enters [mm]
constexpr double largest_extent = 2000;                    // [mm]

std::string place_text(const SampledBranch& branch, int sample) {
    const Vec3& p = branch.points[sample];
    return fmt::format("{:.0f} mm along it, at ({:.1f}, {:.1f}, {:.1f})", sample * branch.step(), p.x(),
                       p.y(), p.z());
}

void check_bends(const SampledBranch& branch, std::vector<std::string>& found) {
    const int last = static_cast<int>(branch.points.size()) - 1;
    for (int i = 1; i < last; ++i) {
        const Vec3 a = (branch.points[i] - branch.points[i - 1]).normalized(),
                   b = (branch.points[i + 1] - branch.points[i]).normalized();
        const double turn = geometry::atan2(a.cross(b).norm(), a.dot(b));
        const double bend = turn > 1e-9 ? branch.step() / turn : std::numeric_limits<double>::infinity();
        const double taper = std::abs(branch.radii[i + 1] - branch.radii[i]) / branch.step();
        if (bend < 1.05 * branch.radii[i]) {
            found.push_back(
                fmt::format("branch '{}' bends with a radius of {:.2f} mm where its lumen has {:.2f} mm "
                            "({}); expected gentler bends",
                            branch.name, bend, branch.radii[i], place_text(branch, i)));
            return;
        }
        if (taper > steepest_taper && !branch.closed) {
            found.push_back(fmt::format(
                "the radius of branch '{}' changes by {:.2f} mm a millimetre ({}); expected at most {}",
                branch.name, taper, place_text(branch, i), steepest_taper));
            return;
        }
    }
}

/// Samples of a branch.
struct Samples {
    int first, last;
};

/// Checks whether these samples of two branches come too near each other; the first starts or ends on the
/// second when `related`. Within one branch, samples that are near along it do not count.
void check_apart(const VesselTree& tree, const SampledBranch& a, Samples of_a, const SampledBranch& b,
                 Samples of_b, bool related, std::vector<std::string>& found) {
    const double largest = *std::ranges::max_element(b.radii);
    for (int i = of_a.first; i <= of_a.last; ++i) {
        const double most = a.radii[i] + largest + least_gap(tree, std::max(a.radii[i], largest));
        for (int j = of_b.first; j <= of_b.last; ++j) {
            const double apart = (a.points[i] - b.points[j]).norm();
            if (apart >= most) {  // skips samples that must be too far away as well
                j += static_cast<int>((apart - most) / (1.1 * b.step()));
                continue;
            }
            const double gap = least_gap(tree, related ? a.radii[i] : std::max(a.radii[i], b.radii[j]));
            const double reach = a.radii[i] + b.radii[j] + gap;
            if (apart >= reach || (&a == &b && std::abs(i - j) * a.step() < 2 * reach)) continue;
            found.push_back(fmt::format(
                "branch '{}' runs into {} ({}): their walls are {:.2f} mm apart; expected {:.2f} mm or more",
                a.name, &a == &b ? "itself" : "branch '" + b.name + "'", place_text(a, i),
                apart - a.radii[i] - b.radii[j], gap));
            return;
        }
    }
}

template <class Modifier>
void check_place(const VesselTreeSpec& spec, const Modifier& what, std::string_view kind,
                 std::vector<std::string>& found) {
    std::vector<std::string_view> names;
    for (const BranchSpec& branch : spec.branches) names.push_back(branch.name);
    if (std::ranges::find(names, what.branch) != names.end()) return;
    found.push_back(fmt::format("{} names the branch '{}'{}; branches are: {}", kind, what.branch,
                                io::suggestion(what.branch, names), io::joined(names)));
}

void check_knots(const BranchSpec& branch, std::vector<std::string>& found) {
    if (branch.knots.size() < 2) {
        found.push_back(
            fmt::format("branch '{}' has {} points; expected two or more", branch.name, branch.knots.size()));
    }
    for (std::size_t i = 0; i < branch.knots.size(); ++i) {
        const auto& [place, radius] = branch.knots[i];
        if (!(radius >= least_radius && radius <= largest_radius)) {
            found.push_back(
                fmt::format("branch '{}', point {}: a radius of {} mm was found; expected {} to {} mm",
                            branch.name, i + 1, radius, least_radius, largest_radius));
            return;
        }
        if (!place.allFinite() || place.cwiseAbs().maxCoeff() > largest_extent) {
            found.push_back(fmt::format("branch '{}', point {}: expected coordinates within ±{} mm",
                                        branch.name, i + 1, largest_extent));
            return;
        }
        if (i > 0 && (place - branch.knots[i - 1].place).norm() < 0.1) {
            found.push_back(fmt::format(
                "branch '{}', points {} and {} are the same; expected points 0.1 mm or more apart",
                branch.name, i, i + 1));
            return;
        }
    }
}

/// A branch without a parent is accepted where a branch that joins another connects it to the first.
void check_connected(const VesselTreeSpec& spec, std::vector<std::string>& found) {
    std::map<std::string, std::string> trees;  // any name of a connected part for each branch
    for (const BranchSpec& branch : spec.branches) {
        trees[branch.name] = branch.parent.empty() ? branch.name : trees[branch.parent];
        if (branch.joins.empty()) continue;
        const std::string own = trees[branch.name], other = trees[branch.joins];
        for (auto& [name, tree] : trees)
            if (tree == own) tree = other;
    }
    for (const BranchSpec& branch : spec.branches) {
        if (!branch.parent.empty() || trees[branch.name] == trees[spec.branches[0].name]) continue;
        found.push_back(
            fmt::format("branch '{}' has no parent; expected one for all branches but the first and those "
                        "that a branch with joins = \"…\" connects to it",
                        branch.name));
    }
}

void check_start(const VesselTree& tree, const SampledBranch& child, std::vector<std::string>& found) {
    const SampledBranch& parent = tree.branches[child.parent];
    const double apart = (child.points[0] - parent.points[child.parent_sample]).norm();
    if (apart > parent.radii[child.parent_sample]) {
        found.push_back(
            fmt::format("branch '{}' starts {:.2f} mm from its place on '{}', whose radius there is {:.2f} "
                        "mm; expected points relative to that place, from 0, 0, 0 on",
                        child.name, apart, parent.name, parent.radii[child.parent_sample]));
        return;
    }
    if (child.separation + 1 >= static_cast<int>(child.points.size()) && !child.closed) {
        found.push_back(fmt::format(
            "branch '{}' never leaves '{}'; expected a branch that comes out of its parent's lumen",
            child.name, parent.name));
    }
    if (child.radii.front() > parent.radii[child.parent_sample]) {
        found.push_back(
            fmt::format("branch '{}' starts with a radius of {:.2f} mm in '{}', which has {:.2f} mm there; "
                        "expected at most that",
                        child.name, child.radii.front(), parent.name, parent.radii[child.parent_sample]));
    }
}

void check_joint(const VesselTree& tree, const SampledBranch& branch, std::vector<std::string>& found) {
    const SampledBranch& joined = tree.branches[branch.joined];
    const double room = joined.radii[branch.joined_sample];
    if (branch.approach <= (branch.parent < 0 ? 0 : branch.separation)) {
        found.push_back(
            fmt::format("branch '{}' is nowhere clear of '{}', which it joins; expected one that comes to it "
                        "from outside",
                        branch.name, joined.name));
    }
    if (branch.radii.back() > room) {
        found.push_back(
            fmt::format("branch '{}' ends with a radius of {:.2f} mm in '{}', which has {:.2f} mm there; "
                        "expected at most that",
                        branch.name, branch.radii.back(), joined.name, room));
    }
}

}  // namespace

std::vector<std::string> problems(const VesselTreeSpec& spec) {
    std::vector<std::string> found;
    if (spec.branches.empty()) found.push_back("there is no branch; expected one or more");
    std::set<std::string> names;
    for (const BranchSpec& branch : spec.branches) {
        if (branch.name.empty()) found.push_back("a branch has no name");
        if (!branch.parent.empty() && !names.contains(branch.parent)) {
            found.push_back(fmt::format("branch '{}': its parent '{}' is no branch listed before it",
                                        branch.name, branch.parent));
        }
        if (!branch.joins.empty() && !names.contains(branch.joins)) {
            found.push_back(fmt::format("branch '{}' joins '{}', which is no branch listed before it",
                                        branch.name, branch.joins));
        }
        if (!branch.joins.empty() && branch.closed) {
            found.push_back(fmt::format("branch '{}' is closed and joins '{}'; expected one of the two",
                                        branch.name, branch.joins));
        }
        if (!names.insert(branch.name).second)
            found.push_back(fmt::format("two branches are named '{}'", branch.name));
        check_knots(branch, found);
    }
    if (found.empty()) check_connected(spec, found);
    for (const NamedTarget& target : spec.targets)
        check_place(spec, target, "target '" + target.name + "'", found);
    for (const Tortuosity& t : spec.tortuosities) {
        if (!t.branch.empty()) check_place(spec, t, "a tortuosity", found);
        if (!(t.amplitude >= 0 && t.amplitude <= 50 && t.wavelength >= 2 && t.wavelength <= 500)) {
            found.push_back("a tortuosity needs an amplitude of 0 to 50 mm and a wavelength of 2 to 500 mm");
        }
    }
    for (const Stenosis& s : spec.stenoses) {
        check_place(spec, s, "a stenosis", found);
        if (!(s.length >= 1 && s.length <= 200 && s.percent >= 0 && s.percent <= 90))
            found.push_back("a stenosis needs a length of 1 to 200 mm and a loss of 0 to 90 percent");
        if (!(s.eccentricity >= 0 && s.eccentricity <= 1))
            found.push_back("the eccentricity of a stenosis must lie within 0 and 1");
    }
    for (const FusiformAneurysm& a : spec.fusiform) {
        check_place(spec, a, "a fusiform aneurysm", found);
        if (!(a.length >= 2 && a.length <= 400 && a.diameter >= 1 && a.diameter <= 2 * largest_radius))
            found.push_back("a fusiform aneurysm needs a length of 2 to 400 mm and a diameter of 1 to 60 mm");
    }
    for (const Occlusion& o : spec.occlusions) {
        check_place(spec, o, "an occlusion", found);
    }
    for (const Dissection& d : spec.dissections) {
        check_place(spec, d, "a dissection", found);
        if (!(d.length >= 10 && d.length <= 600 && d.true_fraction >= 0.2 && d.true_fraction <= 0.8 &&
              d.flap >= 0.5 && d.flap <= 6))
            found.push_back(
                "a dissection needs a length of 10 to 600 mm, a share of the true lumen of 0.2 to 0.8 and a "
                "flap of 0.5 to 6 mm");
    }
    for (const Aneurysm& a : spec.aneurysms) {
        check_place(spec, a, "an aneurysm", found);
        if (!(a.diameter >= 1 && a.diameter <= 60 && a.neck >= 2 * least_radius && a.neck <= a.diameter))
            found.push_back(
                "an aneurysm needs a diameter of 1 to 60 mm and a neck of 0.4 mm to its diameter");
    }
    return found;
}

std::vector<std::string> problems(const VesselTree& tree) {
    std::vector<std::string> found;
    if (tree.least_radius < least_radius / 2) {
        found.push_back(fmt::format("a stenosis leaves a radius of {:.2f} mm; expected {} mm or more",
                                    tree.least_radius, least_radius / 2));
    }
    const auto& branches = tree.branches;
    for (const SampledBranch& branch : branches) check_bends(branch, found);
    for (const SampledBranch& branch : branches) {
        if (branch.parent >= 0) check_start(tree, branch, found);
        if (branch.joined >= 0) check_joint(tree, branch, found);
    }
    if (!found.empty()) return found;
    std::vector<SampledBranch> whole;
    std::vector<Samples> all, apart;  // of each branch, and those that keep their distance from all others
    for (const SampledBranch& branch : branches) {
        int before = 0;
        whole.push_back(extended(branch, before));
        const int last = static_cast<int>(whole.back().points.size()) - 1;
        all.push_back({0, last});
        apart.push_back(
            {branch.parent < 0 ? 0 : branch.separation, branch.joined < 0 ? last : before + branch.approach});
    }
    for (std::size_t b = 0; b < branches.size(); ++b) {
        for (std::size_t a = 0; a <= b; ++a) {
            const int index = static_cast<int>(a);
            const bool related = branches[b].parent == index || branches[b].joined == index;
            if (related && branches[b].closed) continue;  // a sac stays next to its vessel
            check_apart(tree, whole[b], apart[b], whole[a], related ? all[a] : apart[a], related, found);
        }
    }
    return found;
}

}  // namespace anatomy
