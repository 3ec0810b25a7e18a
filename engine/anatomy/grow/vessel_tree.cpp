#include "engine/anatomy/grow/vessel_tree.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>

#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/polyline.h"

namespace anatomy {

std::string name_of_grown(const std::string& source, std::uint64_t seed) {
    return seed == 0 ? source : fmt::format("{}-{}", source, seed);
}

namespace {

/// A centreline through knots: a Catmull-Rom spline with centripetal parameters, which neither overshoots nor
/// loops between knots. Radii follow a monotone cubic (Fritsch and Carlson 1980), so that none exceeds those
/// of its knots.
class KnotSpline {
public:
    explicit KnotSpline(const std::vector<VesselKnot>& knots) : knots_(knots) {
        const int n = static_cast<int>(knots.size());
        at_.resize(knots.size(), 0.0);
        for (int i = 1; i < n; ++i)
            at_[i] = at_[i - 1] + std::sqrt((knots[i].place - knots[i - 1].place).norm());
        for (int i = 0; i < n; ++i) slopes_.push_back(place_slope(i, n));
        for (int i = 0; i < n; ++i) radius_slopes_.push_back(radius_slope(i, n));
        if (n > 2) {
            slopes_.front() = 1.5 * secant(0) - 0.5 * slopes_[1];
            slopes_.back() = 1.5 * secant(n - 2) - 0.5 * slopes_[n - 2];
        }
    }

    int spans() const { return static_cast<int>(knots_.size()) - 1; }
    VesselKnot at(int span, double t) const {
        const double width = at_[span + 1] - at_[span], t2 = t * t, t3 = t2 * t;
        const double a = 2 * t3 - 3 * t2 + 1, b = (t3 - 2 * t2 + t) * width, c = 3 * t2 - 2 * t3,
                     d = (t3 - t2) * width;
        const VesselKnot &from = knots_[span], &to = knots_[span + 1];
        return {a * from.place + b * slopes_[span] + c * to.place + d * slopes_[span + 1],
                a * from.radius + b * radius_slopes_[span] + c * to.radius + d * radius_slopes_[span + 1]};
    }

private:
    double width(int i) const { return at_[i + 1] - at_[i]; }
    Vec3 secant(int i) const { return (knots_[i + 1].place - knots_[i].place) / width(i); }
    double rise(int i) const { return (knots_[i + 1].radius - knots_[i].radius) / width(i); }
    Vec3 place_slope(int i, int n) const {
        if (i == 0) return secant(0);
        if (i == n - 1) return secant(n - 2);
        return secant(i - 1) + secant(i) -
               (knots_[i + 1].place - knots_[i - 1].place) / (at_[i + 1] - at_[i - 1]);
    }
    double radius_slope(int i, int n) const {
        if (i == 0 || i == n - 1 || rise(i - 1) * rise(i) <= 0) return 0;
        const double before = 2 * width(i) + width(i - 1), after = width(i) + 2 * width(i - 1);
        return (before + after) / (before / rise(i - 1) + after / rise(i));
    }

    const std::vector<VesselKnot>& knots_;
    std::vector<double> at_, radius_slopes_;
    std::vector<Vec3> slopes_;
};

/// Calls `visit` with points of the spline, 20 or more for each `spacing` of it, and the span each lies on.
template <class Visit>
void walk_spline(const std::vector<VesselKnot>& knots, double spacing, const Visit& visit) {
    const KnotSpline spline(knots);
    for (int span = 0; span < spline.spans(); ++span) {
        const double chord = (knots[span + 1].place - knots[span].place).norm();
        const int pieces = std::max(16, static_cast<int>(std::ceil(20 * chord / spacing)));
        for (int k = span == 0 ? 0 : 1; k <= pieces; ++k)
            visit(spline.at(span, static_cast<double>(k) / pieces), span);
    }
}

/// The curve resampled at equal arc lengths, about `spacing` apart.
void resample(SampledBranch& branch, double spacing) {
    const Polyline dense = std::move(branch.points);
    const std::vector<double> radii = std::move(branch.radii);
    const std::vector<double> arc = geometry::arc_lengths(dense);
    const int steps = std::max(4, static_cast<int>(std::lround(arc.back() / spacing)));
    branch.points.clear();
    branch.radii.clear();
    std::size_t at = 0;
    for (int k = 0; k <= steps; ++k) {
        const double wanted = arc.back() * k / steps;
        while (at + 2 < dense.size() && arc[at + 1] < wanted) ++at;
        const double t = std::clamp((wanted - arc[at]) / (arc[at + 1] - arc[at]), 0.0, 1.0);
        branch.points.push_back(dense[at] + t * (dense[at + 1] - dense[at]));
        branch.radii.push_back(radii[at] + t * (radii[at + 1] - radii[at]));
    }
}

SampledBranch sampled(const BranchSpec& spec, const Vec3& origin, double spacing) {
    SampledBranch branch;
    branch.name = spec.name;
    branch.closed = spec.closed;
    walk_spline(spec.knots, spacing, [&](const VesselKnot& knot, int) {
        branch.points.push_back(origin + knot.place);
        branch.radii.push_back(knot.radius);
    });
    resample(branch, spacing);
    if (!spec.parts.empty()) {
        const std::vector<double> arcs = knot_arcs(spec.knots);
        for (const BranchPart& part : spec.parts)
            branch.part_starts.push_back(arcs[part.knot] / arcs.back() * branch.length());
    }
    return branch;
}

/// Waves of a stretch of the branch.
void wave(SampledBranch& branch, const Tortuosity& tortuosity, double spacing, double from, double to) {
    const std::vector<Vec3> across = branch.across();
    const double step = branch.step(), length = to - from;
    const Polyline straight = branch.points;
    for (int i = 0; i < static_cast<int>(straight.size()); ++i) {
        const double arc = i * step - from;
        if (arc < 0 || arc > length) continue;
        const double end = std::min(arc, length - arc) / std::min(tortuosity.wavelength, length / 2);
        const double fade = end >= 1 ? 1.0 : end * end * (3 - 2 * end);
        const double phase = 2 * std::numbers::pi * arc / tortuosity.wavelength;
        const Vec3 other = branch.tangent(i).cross(across[i]);
        // The second direction has another frequency, to keep the waves from lying in a plane.
        branch.points[i] =
            straight[i] + tortuosity.amplitude * fade *
                              (geometry::sin(phase) * across[i] + 0.5 * geometry::sin(0.6 * phase) * other);
    }
    const std::vector<double> arcs = geometry::arc_lengths(branch.points);
    for (double& start : branch.part_starts) {
        const double at = start / step;
        const auto i = std::min(static_cast<std::size_t>(at), arcs.size() - 2);
        start = arcs[i] + (at - static_cast<double>(i)) * (arcs[i + 1] - arcs[i]);
    }
    resample(branch, spacing);
}

/// Least distance from a lumen to a centreline point of another branch, over samples from `first` on.
double clearance(const SampledBranch& branch, int first, const Vec3& point) {
    double least = std::numeric_limits<double>::infinity();
    for (int i = first; i < static_cast<int>(branch.points.size()); ++i)
        least = std::min(least, (branch.points[i] - point).norm() - branch.radii[i]);
    return least;
}

/// Whether the sample's lumen is well clear of the other branch. 1.5 times the least gap: one that only just
/// suffices may close once more.
bool well_clear(const VesselTree& tree, const SampledBranch& branch, int sample, const SampledBranch& other) {
    const double gap = 1.5 * least_gap(tree, branch.radii[sample]);
    return clearance(other, 0, branch.points[sample]) >= branch.radii[sample] + gap;
}

/// Tells whether places lie in a branch: clearance() < 0.
class Insides {
public:
    explicit Insides(const SampledBranch& branch)
        : branch_(branch), widest_(*std::ranges::max_element(branch.radii)) {
        for (std::size_t i = 1; i < branch.points.size(); ++i)
            stride_ = std::max(stride_, (branch.points[i] - branch.points[i - 1]).norm());
    }
    bool hold(const Vec3& point) const {
        constexpr double sure = 0.999;  // of a way, for rounding
        for (std::size_t i = 0; i < branch_.points.size();) {
            const double away = (branch_.points[i] - point).norm();
            if (away - branch_.radii[i] < 0) return true;
            // The next samples are nearer by no more than the way to them.
            const double free = sure * (away - widest_);
            i += free > stride_ ? static_cast<std::size_t>(free / stride_) : 1;
        }
        return false;
    }

private:
    const SampledBranch& branch_;
    double widest_, stride_ = 0;  // radius, and between samples [mm]
};

void find_separation(const VesselTree& tree, SampledBranch& child) {
    const SampledBranch& parent = tree.branches[child.parent];
    const Insides of_parent(parent);
    const int last = static_cast<int>(child.points.size()) - 1;
    child.exit = child.separation = last;
    for (int i = last; i >= 0; --i) {
        // One that comes back, as a communicating artery may, has left before.
        if (child.joined >= 0 && i > last / 2) continue;
        if (!of_parent.hold(child.points[i])) child.exit = i;
    }
    for (int i = child.exit; i <= last && child.separation == last; ++i)
        if (well_clear(tree, child, i, parent)) child.separation = i;
}

void find_approach(const VesselTree& tree, SampledBranch& branch) {
    const SampledBranch& joined = tree.branches[branch.joined];
    const Insides of_joined(joined);
    const int last = static_cast<int>(branch.points.size()) - 1;
    branch.entry = branch.approach = 0;
    for (int i = last / 2; i <= last; ++i)
        if (!of_joined.hold(branch.points[i])) branch.entry = i;
    for (int i = branch.entry; i >= 0 && branch.approach == 0; --i)
        if (well_clear(tree, branch, i, joined)) branch.approach = i;
}

/// Returns the sample at a place; rejects a place that is not on the branch.
int place_on(const SampledBranch& branch, double at, const std::string& what) {
    const double length = branch.step() * static_cast<double>(branch.points.size() - 1);
    if (at >= 0 && at <= length) return branch.sample_at(at);
    throw io::InputError("{} is {:.4g} mm along '{}'; expected 0 to {:.1f} mm", what, at, branch.name,
                         length);
}

SampledBranch& named(VesselTree& tree, const std::string& name) {
    return *std::ranges::find(tree.branches, name, &SampledBranch::name);
}

void add_straight(VesselTree& tree, const BranchSpec& spec) {
    Vec3 origin = Vec3::Zero();
    int parent = -1, sample = 0;
    if (!spec.parent.empty()) {
        SampledBranch& from = named(tree, spec.parent);
        parent = static_cast<int>(&from - tree.branches.data());
        sample = place_on(from, spec.at, "the start of branch '" + spec.name + "'");
        origin = from.points[sample];
    }
    if (spec.joins.empty()) {
        tree.branches.push_back(sampled(spec, origin, tree.spacing));
    } else {
        const SampledBranch& to = named(tree, spec.joins);
        const int end = place_on(to, spec.joins_at, "the end of branch '" + spec.name + "'");
        BranchSpec moved = spec;
        const std::vector<double> arcs = knot_arcs(spec.knots);
        const Vec3 missing = to.points[end] - origin - spec.knots.back().place;
        for (std::size_t i = 0; i < arcs.size(); ++i) moved.knots[i].place += arcs[i] / arcs.back() * missing;
        SampledBranch branch = sampled(moved, origin, tree.spacing);
        branch.joined = static_cast<int>(&to - tree.branches.data());
        branch.joined_sample = end;
        tree.branches.push_back(std::move(branch));
    }
    tree.branches.back().parent = parent;
    tree.branches.back().parent_sample = sample;
}

/// Refuses branches that leave the stretch of a branch; `what` lies there.
void refuse_branches_on(const VesselTree& tree, int branch, double from, double to, const char* what) {
    const SampledBranch& on = tree.branches[branch];
    for (const SampledBranch& other : tree.branches) {
        for (const auto& [parent, sample] :
             {std::pair(other.parent, other.parent_sample), std::pair(other.joined, other.joined_sample)}) {
            const double at = sample * on.step();
            if (parent != branch || at < from || at > to) continue;
            throw io::InputError(
                "branch '{}' leaves '{}' at {:.1f} mm, where {} lies ({:.1f} to {:.1f} mm); expected a "
                "stretch without branches",
                other.name, on.name, at, what, from, to);
        }
    }
}

/// Drops every branch that left its parent beyond the parent's last sample, or joined another there.
void drop_orphans(VesselTree& tree) {
    std::vector<int> place(tree.branches.size(), -1);
    std::vector<SampledBranch> left;
    const auto lost = [&](int branch, int sample) {
        return branch >= 0 &&
               (place[branch] < 0 || sample >= static_cast<int>(left[place[branch]].points.size()));
    };
    for (std::size_t b = 0; b < tree.branches.size(); ++b) {
        SampledBranch& branch = tree.branches[b];
        if (lost(branch.parent, branch.parent_sample) || lost(branch.joined, branch.joined_sample)) continue;
        if (branch.parent >= 0) branch.parent = place[branch.parent];
        if (branch.joined >= 0) branch.joined = place[branch.joined];
        place[b] = static_cast<int>(left.size());
        left.push_back(std::move(branch));
    }
    tree.branches = std::move(left);
}

/// The most that the radius changes along it [-].
double taper_of(const SampledBranch& branch) {
    double most = 0;
    for (std::size_t i = 0; i + 1 < branch.radii.size(); ++i)
        most = std::max(most, std::abs(branch.radii[i + 1] - branch.radii[i]) / branch.step());
    return most;
}

[[noreturn]] void refuse_steep(const SampledBranch& before, const Stenosis& stenosis) {
    constexpr double longest = 200;  // [mm]
    Stenosis gentle = stenosis;
    for (gentle.length = std::ceil(stenosis.length); gentle.length < longest; ++gentle.length) {
        SampledBranch branch = before;
        narrow(branch, gentle);
        if (taper_of(branch) <= steepest_taper) break;
    }
    throw io::InputError(io::located(
        stenosis.asked,
        fmt::format(
            "the stenosis of '{}' is too steep: for {:g} percent at {:g} mm expected a length of {:g} mm "
            "or more, found {:g} mm",
            stenosis.branch, stenosis.percent, stenosis.at, gentle.length, stenosis.length)));
}

void add_diseases(VesselTree& tree, const VesselTreeSpec& spec) {
    for (const Aneurysm& aneurysm : spec.aneurysms) {
        place_on(named(tree, aneurysm.branch), aneurysm.at, "the aneurysm");
        add_straight(tree, sac(aneurysm, named(tree, aneurysm.branch)));
    }
    for (const FusiformAneurysm& aneurysm : spec.fusiform) {
        place_on(named(tree, aneurysm.branch), aneurysm.at, "the fusiform aneurysm");
        widen(named(tree, aneurysm.branch), aneurysm);
    }
    for (const Dissection& dissection : spec.dissections) {
        SampledBranch& branch = named(tree, dissection.branch);
        place_on(branch, dissection.at, "the dissection");
        place_on(branch, dissection.at + dissection.length, "the end of the dissection");
        refuse_branches_on(tree, static_cast<int>(&branch - tree.branches.data()), dissection.at,
                           dissection.at + dissection.length, "the dissection");
        const BranchSpec false_lumen = dissect(branch, dissection);
        add_straight(tree, false_lumen);
    }
    for (const Stenosis& stenosis : spec.stenoses) {
        SampledBranch& branch = named(tree, stenosis.branch);
        place_on(branch, stenosis.at, "the stenosis");
        if (stenosis.calcified) {
            const std::vector<CalciumDeposit> deposits = calcium_in(branch, stenosis);
            tree.calcium.insert(tree.calcium.end(), deposits.begin(), deposits.end());
        }
        const SampledBranch before = branch;
        narrow(branch, stenosis);
        if (!branch.closed && taper_of(branch) > steepest_taper && taper_of(before) <= steepest_taper)
            refuse_steep(before, stenosis);
    }
    for (const Occlusion& occlusion : spec.occlusions) {
        const auto branch = std::ranges::find(tree.branches, occlusion.branch, &SampledBranch::name);
        if (branch == tree.branches.end()) continue;  // beyond another occlusion
        place_on(*branch, occlusion.at, "the occlusion");
        occlude(*branch, occlusion);
        drop_orphans(tree);
    }
}

void refuse_if_any(const VesselTreeSpec& spec, std::vector<std::string> found) {
    if (found.empty()) return;
    for (std::string& problem : found) problem.insert(0, spec.name + ": ");
    throw io::InputError(io::joined(found, "\n"));
}

}  // namespace

std::vector<double> knot_arcs(const std::vector<VesselKnot>& knots) {
    std::vector<double> arcs(knots.size(), 0.0);
    Vec3 before = knots.empty() ? Vec3(Vec3::Zero()) : knots[0].place;
    double passed = 0;
    walk_spline(knots, 5, [&](const VesselKnot& knot, int span) {
        passed += (knot.place - before).norm();
        before = knot.place;
        arcs[static_cast<std::size_t>(span) + 1] = passed;
    });
    return arcs;
}

Bend tightest_bend(const std::vector<VesselKnot>& knots) {
    SampledBranch line;
    double whole = 0;
    walk_spline(knots, 5, [&](const VesselKnot& knot, int) {
        if (!line.points.empty()) whole += (knot.place - line.points.back()).norm();
        line.points.push_back(knot.place);
        line.radii.push_back(knot.radius);
    });
    // As far apart as the samples of a small vessel.
    resample(line, std::min(0.5, whole / 40));
    Bend tightest{std::numeric_limits<double>::infinity(), 1};
    for (std::size_t i = 1; i + 1 < line.points.size(); ++i) {
        const Vec3 a = (line.points[i] - line.points[i - 1]).normalized(),
                   b = (line.points[i + 1] - line.points[i]).normalized();
        const double turn = geometry::atan2(a.cross(b).norm(), a.dot(b));
        const double ratio = line.step() / std::max(turn, 1e-9) / line.radii[i];
        if (ratio >= tightest.ratio) continue;
        tightest.ratio = ratio;
        const auto nearer = [&](const VesselKnot& p, const VesselKnot& q) {
            return (p.place - line.points[i]).norm() < (q.place - line.points[i]).norm();
        };
        const auto nearest = std::ranges::min_element(knots, nearer) - knots.begin();
        tightest.knot = static_cast<std::size_t>(
            std::clamp<std::ptrdiff_t>(nearest, 1, static_cast<std::ptrdiff_t>(knots.size()) - 2));
    }
    return tightest;
}

int VesselTree::loops() const {
    int joins = 0, roots = 0;
    for (const SampledBranch& branch : branches) {
        joins += branch.joined >= 0;
        roots += branch.parent < 0;
    }
    return joins - (roots - 1);  // all trees are connected
}

std::vector<Vec3> SampledBranch::across() const {
    std::vector<Vec3> result;
    Vec3 d = tangent(0).unitOrthogonal();
    for (int i = 0; i < static_cast<int>(points.size()); ++i) {
        const Vec3 t = tangent(i);
        d = (d - d.dot(t) * t).normalized();
        result.push_back(d);
    }
    return result;
}

Vec3 SampledBranch::convex_side(int sample) const {
    const int last = static_cast<int>(points.size()) - 1, reach = std::max(1, last / 20);
    const int a = std::max(0, sample - reach), b = std::min(last, sample + reach);
    const Vec3 t = tangent(sample);
    Vec3 out = points[sample] - 0.5 * (points[a] + points[b]);
    out -= out.dot(t) * t;
    return out.norm() > 1e-3 ? out.normalized() : t.unitOrthogonal();
}

int SampledBranch::sample_at(double arc) const {
    return std::clamp(static_cast<int>(std::lround(arc / step())), 0, static_cast<int>(points.size()) - 1);
}

Vec3 SampledBranch::tangent(int sample) const {
    const int last = static_cast<int>(points.size()) - 1;
    return (points[std::min(last, sample + 1)] - points[std::max(0, sample - 1)]).normalized();
}

double least_gap(const VesselTree& tree, double radius) {
    return std::max(0.7 * tree.least_radius, 0.3 * radius);
}

SampledBranch extended(const SampledBranch& branch, int& before) {
    SampledBranch longer = branch;
    const int last = static_cast<int>(branch.points.size()) - 1;
    const auto samples = [&](int end) {
        return static_cast<int>(std::ceil(2 * branch.radii[end] / branch.step()));
    };
    const int after = branch.closed || branch.joined >= 0 ? 0 : samples(last);
    for (int i = 1; i <= after; ++i)
        longer.points.push_back(branch.points[last] + i * branch.step() * branch.tangent(last));
    longer.radii.insert(longer.radii.end(), after, branch.radii[last]);
    before = branch.parent < 0 ? samples(0) : 0;
    Polyline front;
    for (int i = before; i > 0; --i)
        front.push_back(branch.points[0] - i * branch.step() * branch.tangent(0));
    longer.points.insert(longer.points.begin(), front.begin(), front.end());
    longer.radii.insert(longer.radii.begin(), before, branch.radii[0]);
    return longer;
}

VesselTree seedling(const VesselTreeSpec& spec) {
    VesselTree tree;
    tree.name = spec.name;
    tree.least_radius = std::numeric_limits<double>::infinity();
    for (const BranchSpec& branch : spec.branches) {
        for (const VesselKnot& knot : branch.knots)
            tree.least_radius = std::min(tree.least_radius, knot.radius);
    }
    // A third of the radius resolves the shape; a millimetre is enough for wires.
    tree.spacing = std::clamp(tree.least_radius / 3, 0.3, 1.0);
    return tree;
}

void add_branch(VesselTree& tree, const BranchSpec& spec, const std::vector<Tortuosity>& waves) {
    add_straight(tree, spec);
    SampledBranch& branch = tree.branches.back();
    for (const Tortuosity& t : waves) {
        if (!t.branch.empty() && t.branch != spec.name) continue;
        const auto [from, to] =
            t.part.empty() ? std::pair(0.0, branch.length()) : *extent_of(t.part, spec, branch);
        wave(branch, t, tree.spacing, from, to);
    }
}

VesselTree grow(const VesselTreeSpec& spec) {
    refuse_if_any(spec, problems(spec));
    VesselTree tree = seedling(spec);
    for (const BranchSpec& branch : spec.branches) add_branch(tree, branch, spec.tortuosities);
    std::vector<std::string> beyond;  // what a disease cuts off is left out, and no error
    for (const NamedTarget& target : spec.targets)
        for (const SampledBranch& branch : tree.branches)
            if (branch.name == target.branch && target.at > branch.length() + 1)
                beyond.push_back(
                    fmt::format("the target '{}' is {:.4g} mm along '{}'; expected 0 to {:.1f} mm",
                                target.name, target.at, branch.name, branch.length()));
    add_diseases(tree, spec);
    for (SampledBranch& branch : tree.branches) {
        for (const double radius : branch.radii) tree.least_radius = std::min(tree.least_radius, radius);
    }
    for (SampledBranch& branch : tree.branches) {
        branch.entry = branch.approach = static_cast<int>(branch.points.size()) - 1;
        if (branch.parent >= 0) find_separation(tree, branch);
        if (branch.joined >= 0) find_approach(tree, branch);
    }
    refuse_if_any(spec, problems(tree));
    refuse_if_any(spec, beyond);
    return tree;
}

}  // namespace anatomy
