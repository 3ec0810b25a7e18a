#include "engine/anatomy/import/end_choice.h"

#include <algorithm>
#include <fmt/format.h>
#include <limits>

#include "engine/anatomy/anatomy_check.h"
#include "engine/anatomy/import/mesh_cut.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

/// A place given for an end may be this far from it, in its radii and in any case [mm].
constexpr double end_reach = 3, least_end_reach = 3;

double reach_of(double radius) {
    return std::max(least_end_reach, end_reach * radius);
}

void warned(std::vector<Finding>& findings, std::string text) {
    findings.push_back({Finding::Kind::Warned, std::move(text), Finding::Topic::Ends});
}
void noted(std::vector<Finding>& findings, std::string text) {
    findings.push_back({Finding::Kind::Noted, std::move(text)});
}

bool inlet_is_closed(const GivenEnds& given, const std::vector<MeshOpening>& ends) {
    return given.inlet && std::ranges::none_of(ends, [&](const MeshOpening& end) {
               return (end.loop.centroid - *given.inlet).norm() <= reach_of(end.radius);
           });
}

/// The tip nearest to a place given; none when it is farther than its branch is wide: at the facets of a
/// coarse tip a vessel seems thin.
const VesselTip* tip_near(const TracedLumen& traced, const Vec3& place) {
    const std::vector<VesselTip>& tips = traced.tips;
    const auto distance = [&place](const VesselTip& tip) {
        return std::min((tip.apex - place).norm(), (tip.centre - place).norm());
    };
    const auto nearest = std::ranges::min_element(tips, {}, distance);
    if (nearest == tips.end()) return nullptr;
    std::vector<double> radii = traced.branches[nearest->branch].radii;
    std::ranges::nth_element(radii, radii.begin() + std::ssize(radii) / 2);
    const double wide = 2 * radii[radii.size() / 2];
    if (distance(*nearest) > std::max(reach_of(nearest->radius), wide)) return nullptr;
    return &*nearest;
}

[[noreturn]] void refuse_far_inlet(const Vec3& inlet, const std::vector<MeshOpening>& ends,
                                   const std::vector<VesselTip>& tips) {
    std::vector<VesselTip> all;
    for (const MeshOpening& end : ends) {
        all.emplace_back();
        all.back().apex = all.back().centre = end.loop.centroid;
        all.back().radius = end.radius;
    }
    all.insert(all.end(), tips.begin(), tips.end());
    double least = std::numeric_limits<double>::infinity();
    for (const VesselTip& tip : all) least = std::min(least, (tip.apex - inlet).norm());
    throw io::InputError(
        "--inlet {}: the nearest end is {:.1f} mm away; expected a place at one of these [mm]: {}",
        io::place_text(inlet), least, places_text(all));
}

struct TipChoice {
    std::vector<VesselTip> open;
    std::vector<VesselTip> sacs;  // that would be opened if they were ends of tubes
};

TipChoice chosen_tips(const RepairedLumen& lumen, const TracedLumen& traced, const GivenEnds& given) {
    const std::vector<VesselTip>& tips = traced.tips;
    TipChoice choice;
    const auto same_as = [](const VesselTip& tip) {
        return [&tip](const VesselTip& other) { return other.apex == tip.apex; };
    };
    const auto want = [&](const VesselTip& tip) {
        if (std::ranges::none_of(choice.open, same_as(tip))) choice.open.push_back(tip);
    };
    for (const Vec3& place : given.tips) {
        const VesselTip* tip = tip_near(traced, place);
        if (!tip) {
            throw io::InputError(
                "--end {}: no blind tip is near; {}", io::place_text(place),
                tips.empty() ? "the surface has none" : "expected one of these: " + places_text(tips));
        }
        want(*tip);
    }
    if (inlet_is_closed(given, lumen.ends)) {
        const VesselTip* tip = tip_near(traced, *given.inlet);
        if (!tip) refuse_far_inlet(*given.inlet, lumen.ends, tips);
        want(*tip);
    }
    if (!given.tips.empty()) return choice;
    // Ends are missing where there are fewer than two, or where the widest vessel is closed.
    const bool few = given.tubes || lumen.ends.size() < 2;
    const auto missing = [&](double radius) { return few || radius > lumen.ends[0].radius; };
    std::vector<VesselTip> tubes;
    for (const VesselTip& tip : tips) {
        const bool asked = std::ranges::any_of(choice.open, same_as(tip));
        if (ends_a_tube(traced.branches, tip))
            tubes.push_back(tip);
        else if (missing(width_near(traced.branches, tip)) && !asked)
            choice.sacs.push_back(tip);
    }
    if (std::ranges::any_of(tubes, [&](const VesselTip& tip) { return missing(tip.radius); }))
        for (const VesselTip& tip : tubes) want(tip);
    return choice;
}

/// A wire's radius and a little more, so that a vessel cut across still holds the wire.
constexpr double wire_margin = 1.05;
/// A blind vessel is cut where it has this part of its width near the tip.
constexpr double full_width = 0.8;
/// The end of a tube keeps this part of its width over this way from the tip, in radii; a sac has a neck.
constexpr double tube_width = 0.6, tube_length = 3;
/// A surface that cannot be cut at one place is tried again this much farther from the tip, in radii.
constexpr int tries = 5;
constexpr double retreat = 0.3;
/// A rim that reaches farther than this from the centreline, in radii, is that of an oblique cut.
constexpr double widest_rim = 2;

/// The way along a branch from its tip.
class TipPath {
public:
    TipPath(const CentrelineBranch& branch, const VesselTip& tip)
        : branch_(branch), last_(static_cast<int>(branch.points.size()) - 1), from_start_(tip.at_start) {}

    int count() const { return last_ + 1; }
    int sample(int i) const { return from_start_ ? i : last_ - i; }
    double radius(int i) const { return branch_.radii[sample(i)]; }
    const geometry::Vec3& point(int i) const { return branch_.points[sample(i)]; }
    /// A place as far behind as the vessel is wide, or the last.
    int behind(int i) const {
        int at = i;
        for (double passed = 0; at + 1 < count() && (passed < 2 * radius(i) || at < i + 3);)
            passed += step(++at);
        return at;
    }
    double step(int i) const { return (point(i) - point(i - 1)).norm(); }

private:
    const CentrelineBranch& branch_;
    int last_;
    bool from_start_;
};

double widest_near(const TipPath& path) {
    double widest = path.radius(0), passed = 0;
    for (int i = 1; i < path.count() && passed < 2 * widest; ++i) {
        passed += path.step(i);
        widest = std::max(widest, path.radius(i));
    }
    return widest;
}

/// The first place with nearly the width near the tip that the thinnest wire passes; the count if none does.
int first_wide(const TipPath& path) {
    const double wanted = std::max(wire_margin * thinnest_wire_radius, full_width * widest_near(path));
    int i = 0;
    while (i < path.count() && path.radius(i) < wanted) ++i;
    return i;
}

}  // namespace

std::string places_text(const std::vector<VesselTip>& tips) {
    std::string list;
    for (std::size_t k = 0; k < tips.size() && k < 20; ++k)
        list += fmt::format("{}{} r {:.2f}", k > 0 ? ", " : "", io::place_text(tips[k].apex), tips[k].radius);
    return tips.size() > 20 ? list + fmt::format(" and {} more", tips.size() - 20) : list;
}

bool open_missing_ends(RepairedLumen& lumen, const TracedLumen& traced, const GivenEnds& given,
                       std::vector<Finding>& findings) {
    const bool from_end = !lumen.ends.empty();
    const TipChoice choice = chosen_tips(lumen, traced, given);
    if (!choice.sacs.empty()) {
        const bool one = choice.sacs.size() == 1;
        warned(findings,
               fmt::format("{} blind tip{}, not the end of a tube, and stay{} closed; --end X,Y,Z cuts one "
                           "open [mm]: {}",
                           choice.sacs.size(), one ? " is a sac" : "s are sacs", one ? "s" : "",
                           places_text(choice.sacs)));
    }
    const TipOpening opening = open_tips(lumen.mesh, traced.branches, choice.open);
    if (!opening.thin.empty())
        warned(findings, fmt::format("{} tips too thin for any wire stay closed [mm]: {}",
                                     opening.thin.size(), places_text(opening.thin)));
    if (!opening.refused.empty())
        warned(findings, fmt::format("{} blind tips could not be cut open and stay closed [mm]: {}",
                                     opening.refused.size(), places_text(opening.refused)));
    if (!opening.opened.empty()) {
        lumen.ends = openings_of(lumen.mesh);
        warned(findings,
               fmt::format("{}: {} blind tip{} cut open and taken for ends [mm]: {}",
                           from_end ? "ends are missing" : "the lumen is closed", opening.opened.size(),
                           opening.opened.size() == 1 ? " was" : "s were", places_text(opening.opened)));
    }
    if (lumen.ends.size() >= 2) return !opening.opened.empty();
    throw io::InputError(
        "{} open end{} found{}; expected two or more: an inlet and an outlet, cut open across the vessel",
        lumen.ends.size(), lumen.ends.size() == 1 ? " was" : "s were",
        lumen.ends.empty() ? "" : " at " + io::place_text(lumen.ends[0].loop.centroid));
}

int chosen_inlet(const std::vector<MeshOpening>& ends, const GivenEnds& given,
                 std::vector<Finding>& findings) {
    if (!given.inlet) {
        std::string others;
        for (std::size_t e = 1; e < ends.size(); ++e)
            others += fmt::format("{} {} r {:.2f}", e > 1 ? "," : "", io::place_text(ends[e].loop.centroid),
                                  ends[e].radius);
        noted(findings,
              fmt::format("the inlet is the largest end, {} r {:.2f}; --inlet X,Y,Z takes another [mm]:{}",
                          io::place_text(ends[0].loop.centroid), ends[0].radius, others));
        return 0;
    }
    if (inlet_is_closed(given, ends)) refuse_far_inlet(*given.inlet, ends, {});
    int best = 0;
    const auto distance = [&](int e) { return (ends[e].loop.centroid - *given.inlet).norm(); };
    for (int e = 1; e < static_cast<int>(ends.size()); ++e)
        if (distance(e) < distance(best)) best = e;
    noted(findings, fmt::format("the inlet is the end at {}, {:.2f} mm from the place given",
                                io::place_text(ends[best].loop.centroid), distance(best)));
    return best;
}

bool ends_a_tube(const std::vector<CentrelineBranch>& branches, const VesselTip& tip) {
    const CentrelineBranch* branch = &branches[tip.branch];
    const TipPath path(*branch, tip);
    const double width = widest_near(path), narrow = tube_width * width, wanted = tube_length * width;
    double passed = 0;
    bool in_dome = true;  // which is narrow too
    for (int i = 0; i < path.count() && passed < wanted; ++i) {
        if (i > 0) passed += path.step(i);
        in_dome = in_dome && path.radius(i) < narrow;
        if (!in_dome && path.radius(i) < narrow) return false;
    }
    if (branch->parent < 0) return true;
    const double room = branches[branch->parent].radii[branch->parent_sample],
                 depth = (tip.apex - path.point(0)).norm() + geometry::length_of(branch->points) - room;
    if (depth < wanted && width > room) return false;
    while (passed < wanted && branch->parent >= 0) {
        const CentrelineBranch& parent = branches[branch->parent];
        for (int i = branch->parent_sample; i >= 0 && passed < wanted; --i) {
            if (parent.radii[i] < narrow) return false;
            if (i > 0) passed += (parent.points[i] - parent.points[i - 1]).norm();
        }
        branch = &parent;
    }
    return true;
}

double width_near(const std::vector<CentrelineBranch>& branches, const VesselTip& tip) {
    return widest_near(TipPath(branches[tip.branch], tip));
}

TipOpening open_tips(geometry::TriangleMesh& mesh, const std::vector<CentrelineBranch>& branches,
                     const std::vector<VesselTip>& tips) {
    TipOpening result;
    MeshCut cut(mesh);
    for (const VesselTip& given : tips) {
        const TipPath path(branches[given.branch], given);
        VesselTip tip = given;
        int at = first_wide(path);
        if (at + 3 >= path.count()) {
            result.thin.push_back(given);
            continue;
        }
        bool done = false;
        for (int k = 0; k < tries && !done && at + 3 < path.count(); ++k) {
            tip.centre = path.point(at);
            tip.radius = path.radius(at);
            tip.outward = (path.point(at) - path.point(path.behind(at))).normalized();
            const double reach = 2 * (tip.apex - tip.centre).norm() + 3 * tip.radius;
            done = cut.beyond(tip.centre, tip.outward, tip.apex, reach, widest_rim * tip.radius);
            for (double passed = 0; passed < retreat * tip.radius && ++at < path.count();)
                passed += path.step(at);
        }
        (done ? result.opened : result.refused).push_back(done ? tip : given);
    }
    if (!result.opened.empty()) mesh = cut.result();
    return result;
}

}  // namespace anatomy
