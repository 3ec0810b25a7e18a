#include "engine/plan/views.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>
#include <thread>

#include "engine/anatomy/vessel_paths.h"
#include "engine/exercise/branch_stretch.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/parallel.h"
#include "render/xray/c_arm.h"

namespace plan {
namespace {

using anatomy::Anatomy;
using exercise::BranchArc;
using geometry::CentrelineBranch;
using geometry::Vec2;
using geometry::Vec3;

constexpr double at_origin = 1;    // a stretch begins at an ostium that begins nearer to it [mm]
constexpr double last_part = 30;   // of the way, at most [mm]
constexpr double least_part = 10;  // and at least [mm]
constexpr double least_on_way = 5, most_on_way = 120;  // of a branch on the way [mm]
constexpr double piece = 0.5;                          // of a stretch [mm]
constexpr int least_pieces = 8;

const CentrelineBranch& branch_of(const Anatomy& anatomy, int branch) {
    return anatomy.branches[static_cast<std::size_t>(branch)];
}

render::ArmAxes axes_at(const ViewAngles& angles) {
    render::CArm arm;
    arm.lao = angles.lao, arm.cranial = angles.cranial;
    return render::axes(arm);
}

/// Throws InputError where the stretch is not one of the branch.
void check(const BranchArc& arc, const ViewStretch& stretch) {
    const std::string& name = arc.branch.name;
    // Positions are typed in tenths of a millimetre.
    constexpr double slack = 0.05;
    for (const double place : {stretch.from, stretch.to})
        if (!(place >= arc.arcs.front() - slack && place <= arc.length + slack))
            throw io::InputError("expected places of {:.1f} to {:.1f} mm from the origin of {}, found {} mm",
                                 arc.arcs.front(), arc.length, name, io::number_text(place));
    if (!(stretch.to - stretch.from >= least_stretch))
        throw io::InputError("expected a stretch of {} at least {:g} mm long, found one from {} to {} mm",
                             name, least_stretch, io::number_text(stretch.from), io::number_text(stretch.to));
}

int required_branch(const Anatomy& anatomy, std::string_view name) {
    const std::optional<int> branch = anatomy::branch_named(anatomy, name);
    if (!branch) throw io::InputError(exercise::unknown_branch(std::string(name), anatomy));
    return *branch;
}

ViewTarget target_of(const Anatomy& anatomy, const ViewStretch& stretch) {
    ViewTarget target;
    target.stretches = {stretch};
    target.name = fmt::format("{}, {:.0f} to {:.0f} mm from its origin",
                              branch_of(anatomy, stretch.branch).name, stretch.from, stretch.to);
    if (stretch.from <= at_origin) target.ostium = ostium_of(anatomy, stretch.branch);
    return target;
}

/// Where, in fractions of a capsule's axis, its balls touch that ball: |c − x(t)| < radius + r(t), both sides
/// squared. Empty where they do not.
std::optional<Span> touching(const Vec3& centre, double radius, const Vec3& a, double at_a, const Vec3& b,
                             double at_b) {
    const Vec3 from_a = centre - a, axis = b - a;
    const double reach = radius + at_a, wider = at_b - at_a;
    const double square = axis.squaredNorm() - wider * wider;
    if (square <= 1e-12) {  // the larger ball holds the smaller one
        const bool touches = from_a.norm() < reach || (centre - b).norm() < radius + at_b;
        return touches ? std::optional<Span>({0, 1}) : std::nullopt;
    }
    const double middle = (from_a.dot(axis) + reach * wider) / square,
                 root = middle * middle - (from_a.squaredNorm() - reach * reach) / square;
    if (root <= 0) return std::nullopt;
    const double from = std::max(0.0, middle - std::sqrt(root)), to = std::min(1.0, middle + std::sqrt(root));
    return from < to ? std::optional<Span>({from, to}) : std::nullopt;
}

double length_covered(std::vector<Span>& spans, double least, double most) {
    std::sort(spans.begin(), spans.end(), [](const Span& a, const Span& b) { return a.from < b.from; });
    double covered_until = least, length = 0;
    for (const Span& span : spans) {
        const double from = std::max(span.from, covered_until), to = std::min(span.to, most);
        if (to <= from) continue;
        length += to - from;
        covered_until = to;
    }
    return length;
}

}  // namespace

std::optional<Ostium> ostium_of(const Anatomy& anatomy, int b) {
    const CentrelineBranch& branch = branch_of(anatomy, b);
    if (branch.parent < 0) {
        for (const anatomy::VesselEnd& end : anatomy.ends)
            if (end.opening.goes_on == geometry::Continuation::Root &&
                (end.opening.centre - branch.points.front()).norm() < end.opening.radius)
                return Ostium{end.opening.centre, end.opening.outward_normal};
        return std::nullopt;
    }
    const CentrelineBranch& parent = branch_of(anatomy, branch.parent);
    if (geometry::goes_on_in(parent, branch) || parent.points.size() < 2) return std::nullopt;
    const Vec3 place = BranchArc(anatomy, b).point(0);
    Vec3 foot = Vec3::Zero(), along = Vec3::Zero();
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i + 1 < parent.points.size(); ++i) {
        const Vec3 &from = parent.points[i], &to = parent.points[i + 1];
        if (from == to) continue;
        const double t = geometry::closest_fraction(from, to, place);
        const Vec3 at = (1 - t) * from + t * to;
        if ((place - at).norm() >= nearest) continue;
        nearest = (place - at).norm(), foot = at, along = (to - from).normalized();
    }
    const Vec3 out = place - foot, normal = out - out.dot(along) * along;
    if (normal.norm() < 1e-6) return std::nullopt;
    return Ostium{place, normal.normalized()};
}

ViewTarget view_target(const Anatomy& anatomy, std::string_view name, double from, double to,
                       std::string_view side) {
    const ViewStretch stretch{required_branch(anatomy, name), from, to};
    check(BranchArc(anatomy, stretch.branch), stretch);
    ViewTarget target = target_of(anatomy, stretch);
    if (!side.empty()) {
        const int other = required_branch(anatomy, side);
        if (other == stretch.branch)
            throw io::InputError("expected another branch than {} at its bifurcation, found '{}'",
                                 branch_of(anatomy, other).name, side);
        const double most = BranchArc(anatomy, other).length;
        target.stretches.push_back({other, 0, std::min(side_stretch, most)});
        check(BranchArc(anatomy, other), target.stretches.back());
        target.name += fmt::format(", with {}", branch_of(anatomy, other).name);
    }
    return target;
}

ViewTarget view_target_at(const Anatomy& anatomy, const Vec3& place) {
    const anatomy::VesselPlace at = anatomy::nearest_place(anatomy, place);
    if (at.branch < 0 || at.distance > 0)
        throw io::InputError("expected a place in a vessel of {}, found {}", anatomy.name,
                             io::place_text(place));
    const BranchArc arc(anatomy, at.branch);
    const double to = std::clamp(arc.arcs[static_cast<std::size_t>(at.sample)],
                                 std::min(least_part, arc.length), arc.length);
    const ViewStretch stretch{at.branch, std::max(std::min(0.0, to), to - last_part), to};
    check(arc, stretch);
    return target_of(anatomy, stretch);
}

std::vector<ViewTarget> view_targets_on_way(const Anatomy& anatomy, const Vec3& from, const Vec3& to) {
    std::vector<ViewTarget> targets;
    const anatomy::VesselPaths paths(anatomy);
    for (const anatomy::VesselPaths::Piece& one :
         paths.route(anatomy::nearest_place(anatomy, from), anatomy::nearest_place(anatomy, to))) {
        const BranchArc arc(anatomy, one.branch);
        const double a = arc.arcs[static_cast<std::size_t>(std::min(one.from, one.to))],
                     b = arc.arcs[static_cast<std::size_t>(std::max(one.from, one.to))];
        const double begin = std::max(a, std::min(0.0, b)), length = b - begin;
        if (length < least_on_way) continue;
        const int parts = static_cast<int>(std::ceil(length / most_on_way));
        for (int k = 0; k < parts; ++k) {
            const int part = one.from <= one.to ? k : parts - 1 - k;
            targets.push_back(target_of(
                anatomy, {one.branch, begin + length * part / parts, begin + length * (part + 1) / parts}));
        }
    }
    return targets;
}

std::vector<bool> filled_from(const Anatomy& anatomy, int branch) {
    std::vector<bool> filled(anatomy.branches.size(), branch < 0);
    for (std::size_t b = 0; branch >= 0 && b < filled.size(); ++b) {
        int at = static_cast<int>(b);
        // A chain of parents is no longer than the list.
        for (std::size_t up = 0; up <= filled.size() && at >= 0 && at != branch; ++up)
            at = branch_of(anatomy, at).parent;
        filled[b] = at == branch;
    }
    return filled;
}

double between(const ViewAngles& a, const ViewAngles& b) {
    const Vec3 one = axes_at(a).beam, other = axes_at(b).beam;
    return std::atan2(one.cross(other).norm(), std::abs(one.dot(other)));
}

std::string text_of(const ViewAngles& angles) {
    const auto degrees = [](double angle) { return std::lround(std::abs(angle) / geometry::degree); };
    const long lao = degrees(angles.lao), cranial = degrees(angles.cranial);
    const std::string across = lao == 0 ? "AP" : fmt::format("{} {}", angles.lao > 0 ? "LAO" : "RAO", lao);
    if (cranial == 0) return across;
    return across + fmt::format(" {} {}", angles.cranial > 0 ? "CRAN" : "CAUD", cranial);
}

std::optional<Span> covered(const Vec2& p, const Vec2& across, const Vec2& a, double at_a, const Vec2& b,
                            double at_b) {
    // The disc at t of the way from a to b has its middle d from the line, m along it, and the radius r, all
    // linear in t; it covers m ± √Q with Q = r² − d². The ends of the whole are at t = 0 or 1, at a root of
    // Q, or where m ± √Q has no slope: (2 A t + B)² = 4 m₁² Q.
    const Vec2 aside(-across.y(), across.x());
    const double d0 = aside.dot(a - p), d1 = aside.dot(b - a), m0 = across.dot(a - p), m1 = across.dot(b - a),
                 r0 = at_a, r1 = at_b - at_a;
    const double A = r1 * r1 - d1 * d1, B = 2 * (r0 * r1 - d0 * d1), C = r0 * r0 - d0 * d0;
    std::optional<Span> span;
    const auto look = [&](double t) {
        if (!(t >= 0 && t <= 1)) return;
        const double Q = C + t * (B + t * A);
        if (Q < -1e-9 * (r0 * r0 + at_b * at_b)) return;
        const double half = std::sqrt(std::max(0.0, Q)), m = m0 + t * m1;
        if (!span) span = {m - half, m + half};
        span->from = std::min(span->from, m - half), span->to = std::max(span->to, m + half);
    };
    const auto look_at_roots = [&](double a2, double a1, double a0) {
        const double root = a1 * a1 - 4 * a2 * a0;
        if (root < 0) return;
        const double q = -0.5 * (a1 + std::copysign(std::sqrt(root), a1));
        if (a2 != 0) look(q / a2);
        if (q != 0) look(a0 / q);
    };
    look(0);
    look(1);
    look_at_roots(A, B, C);
    const double bent = A - m1 * m1;
    look_at_roots(A * bent, B * bent, 0.25 * B * B - m1 * m1 * C);
    return span;
}

void ViewedTarget::add_capsules(const CentrelineBranch& branch, const std::vector<double>& arcs, double from,
                                double to) {
    constexpr double most_off = 0.05, longest = 8;  // of a capsule from the samples it stands for [mm]
    std::size_t first = 0;
    while (first + 1 < arcs.size() && arcs[first] < from) ++first;
    std::size_t last = first;
    while (last + 1 < arcs.size() && arcs[last + 1] <= to) ++last;
    for (std::size_t i = first; i < last;) {
        std::size_t j = i + 1;
        const auto fits = [&](std::size_t end) {
            if (arcs[end] - arcs[i] > longest) return false;
            for (std::size_t k = i + 1; k < end; ++k) {
                const double t = (arcs[k] - arcs[i]) / (arcs[end] - arcs[i]);
                if ((branch.points[k] - (1 - t) * branch.points[i] - t * branch.points[end]).norm() >
                        most_off ||
                    std::abs(branch.radii[k] - (1 - t) * branch.radii[i] - t * branch.radii[end]) > most_off)
                    return false;
            }
            return true;
        };
        while (j + 1 <= last && fits(j + 1)) ++j;
        capsules_.push_back({branch.points[i], branch.points[j], branch.radii[i], branch.radii[j]});
        i = j;
    }
}

void ViewedTarget::add_pieces(const Anatomy& anatomy, const ViewStretch& stretch) {
    const BranchArc arc(anatomy, stretch.branch);
    const double from = std::max(stretch.from, arc.arcs.front()), to = std::min(stretch.to, arc.length);
    const int count = std::max(least_pieces, static_cast<int>(std::ceil((to - from) / piece)));
    for (int k = 0; k < count; ++k) {
        const double begin = from + (to - from) * k / count, end = from + (to - from) * (k + 1) / count;
        const Vec3 a = arc.point(begin), b = arc.point(end);
        const double length = (b - a).norm();
        if (length <= 0) continue;
        pieces_.push_back({0.5 * (a + b), (b - a) / length, arc.radius(0.5 * (begin + end)), length, {}});
        length_ += length;
        middle_ += length * pieces_.back().centre;
    }
}

ViewedTarget::ViewedTarget(const Anatomy& anatomy, ViewTarget target, const std::vector<bool>& filled)
    : target_(std::move(target)) {
    std::vector<std::size_t> pieces_until, capsules_from, capsules_until;
    for (const ViewStretch& stretch : target_.stretches) {
        add_pieces(anatomy, stretch);
        pieces_until.push_back(pieces_.size());
    }
    middle_ /= length_;
    // All filled branches from their origins on; of a stretch's own branch what lies before and behind it,
    // and the stretch itself, which covers others of the target alone.
    for (std::size_t b = 0; b < anatomy.branches.size(); ++b) {
        const CentrelineBranch& branch = anatomy.branches[b];
        const std::vector<double> arcs =
            geometry::arc_lengths(branch.points, -anatomy::origin_of(anatomy, static_cast<int>(b)));
        const auto own =
            std::find_if(target_.stretches.begin(), target_.stretches.end(),
                         [&](const ViewStretch& stretch) { return stretch.branch == static_cast<int>(b); });
        if (own == target_.stretches.end()) {
            if (filled[b]) add_capsules(branch, arcs, 0, arcs.back());
            continue;
        }
        if (!filled[b]) continue;
        add_capsules(branch, arcs, 0, own->from);
        add_capsules(branch, arcs, own->to, arcs.back());
    }
    const std::size_t shared = capsules_.size();
    for (const ViewStretch& stretch : target_.stretches) {
        capsules_from.push_back(capsules_.size());
        const CentrelineBranch& branch = branch_of(anatomy, stretch.branch);
        if (target_.stretches.size() > 1)
            add_capsules(branch,
                         geometry::arc_lengths(branch.points, -anatomy::origin_of(anatomy, stretch.branch)),
                         stretch.from, stretch.to);
        capsules_until.push_back(capsules_.size());
    }
    for (std::size_t s = 0, k = 0; s < pieces_until.size(); ++s)
        for (; k < pieces_until[s]; ++k)
            for (std::size_t c = 0; c < capsules_.size(); ++c) {
                if (c >= shared && c >= capsules_from[s] && c < capsules_until[s]) continue;
                const Capsule& other = capsules_[c];
                Piece& part = pieces_[k];
                const auto touched =
                    touching(part.centre, part.radius, other.a, other.at_a, other.b, other.at_b);
                const double from = touched ? touched->from : 1, to = touched ? touched->to : 1;
                if (from > 0) part.others.push_back({static_cast<int>(c), 0, from});
                if (to < 1) part.others.push_back({static_cast<int>(c), to, 1});
            }
}

ViewFigures ViewedTarget::figures(const ViewAngles& angles) const {
    const render::ArmAxes axes = axes_at(angles);
    const auto in_image = [&](const Vec3& x) { return Vec2(axes.right.dot(x), axes.up.dot(x)); };
    struct Projected {
        Vec2 a, b;
        double at_a, at_b, most;
    };
    std::vector<Projected> projected;
    projected.reserve(capsules_.size());
    for (const Capsule& one : capsules_)
        projected.push_back(
            {in_image(one.a), in_image(one.b), one.at_a, one.at_b, std::max(one.at_a, one.at_b)});
    double seen = 0, area = 0, hidden = 0;
    std::vector<Span> spans;
    for (const Piece& part : pieces_) {
        const Vec2 p = in_image(part.centre), shown = in_image(part.along);
        const double fraction = shown.norm();
        seen += fraction * part.length;
        const Vec2 along = fraction > 1e-9 ? Vec2(shown / fraction) : Vec2(Vec2::UnitY());
        const Vec2 across(-along.y(), along.x());
        spans.clear();
        for (const Part& covers : part.others) {
            const Projected& whole = projected[static_cast<std::size_t>(covers.capsule)];
            // Most lie elsewhere.
            const double at_a = along.dot(whole.a - p), at_b = along.dot(whole.b - p);
            if (std::min(at_a, at_b) > whole.most || std::max(at_a, at_b) < -whole.most) continue;
            const double aside_a = across.dot(whole.a - p), aside_b = across.dot(whole.b - p),
                         reach = whole.most + part.radius;
            if (std::min(aside_a, aside_b) > reach || std::max(aside_a, aside_b) < -reach) continue;
            const auto mixed = []<class Value>(const Value& a, const Value& b, double t) {
                return Value((1 - t) * a + t * b);
            };
            if (const auto span = plan::covered(p, across, mixed(whole.a, whole.b, covers.from),
                                                mixed(whole.at_a, whole.at_b, covers.from),
                                                mixed(whole.a, whole.b, covers.to),
                                                mixed(whole.at_a, whole.at_b, covers.to)))
                spans.push_back(*span);
        }
        const double projected_length = fraction * part.length;
        area += projected_length * 2 * part.radius;
        if (!spans.empty()) hidden += projected_length * length_covered(spans, -part.radius, part.radius);
    }
    ViewFigures figures;
    figures.foreshortening = std::clamp(1 - seen / length_, 0.0, 1.0);
    figures.overlap = area > 0 ? std::clamp(hidden / area, 0.0, 1.0) : 0;
    double profile = 1;
    if (target_.ostium) {
        const double slant = std::min(1.0, std::abs(axes.beam.dot(target_.ostium->normal)));
        figures.ostium = std::asin(slant);
        profile = std::sqrt(1 - slant * slant);
    }
    figures.cost = 1 - (1 - figures.foreshortening) * (1 - figures.overlap) * profile;
    return figures;
}

ViewMap view_map(const ViewedTarget& target, const Stand& stand, double step) {
    if (!(step >= 1 && step <= 30))
        throw io::InputError("expected a step of 1 to 30 degrees between angles, found {}",
                             io::number_text(step));
    // Whole steps from 0 to either side, so that AP is a node.
    const auto angles = [&](const render::ArmLimits::Range& range) {
        std::vector<double> result;
        for (int k = static_cast<int>(std::ceil(range.least / step - 1e-9)); k * step <= range.most + 1e-9;
             ++k)
            result.push_back(k * step * geometry::degree);
        return result;
    };
    ViewMap map;
    map.lao = angles(stand.lao), map.cranial = angles(stand.cranial);
    const std::size_t nodes = map.lao.size() * map.cranial.size();
    map.figures.resize(nodes), map.blocked.resize(nodes);
    const int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    geometry::parallel_for(nodes, threads, [&](std::size_t node) {
        const ViewAngles at = map.angles(node);
        map.figures[node] = target.figures(at);
        map.blocked[node] = stand.at(at.lao, at.cranial, target.middle());
    });
    return map;
}

ViewMap view_map(const Anatomy& anatomy, const ViewTarget& target, const Stand& stand, double step) {
    return view_map(ViewedTarget(anatomy, target, filled_from(anatomy, -1)), stand, step);
}

std::vector<BestView> best_views(const ViewMap& map, int count, double apart, double alike) {
    // Cosine of the beam's angle from that of AP.
    const auto upright = [&](std::size_t node) {
        return std::cos(map.angles(node).lao) * std::cos(map.angles(node).cranial);
    };
    std::vector<std::size_t> left;
    for (std::size_t node = 0; node < map.figures.size(); ++node)
        if (map.blocked[node] == Blocked::Free) left.push_back(node);
    std::vector<BestView> best;
    while (static_cast<int>(best.size()) < count && !left.empty()) {
        const auto cost = [&](std::size_t node) { return map.figures[node].cost; };
        const std::size_t lowest = *std::min_element(
            left.begin(), left.end(), [&](std::size_t a, std::size_t b) { return cost(a) < cost(b); });
        std::size_t chosen = lowest;
        for (const std::size_t node : left) {
            if (cost(node) > cost(lowest) + alike) continue;
            const double more = upright(node) - upright(chosen);
            if (more > 1e-9 || (more > -1e-9 && cost(node) < cost(chosen))) chosen = node;
        }
        best.push_back({map.angles(chosen), map.figures[chosen], map.angles(lowest), map.figures[lowest]});
        std::erase_if(left, [&](std::size_t node) {
            return between(map.angles(node), map.angles(chosen)) < apart - 1e-9;
        });
    }
    return best;
}

}  // namespace plan
