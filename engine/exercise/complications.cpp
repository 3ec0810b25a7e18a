#include "engine/exercise/complications.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "engine/anatomy/organs.h"
#include "engine/blood/pressure.h"
#include "engine/io/text.h"
#include "physics/geometry/polyline.h"

namespace exercise {
namespace {

using geometry::Vec3;
using script::ComplicationKind;

constexpr double spacing = physics::Narrowing::spacing;
constexpr std::size_t open_ends = 2;     // samples at either end where the tube is wider than any vessel
constexpr double past_ends = 4;          // samples go on past a complication's ends by this [mm]
constexpr double from_origin = 0.5;      // of the radius: nearer to its origin a branch is left open [-]
constexpr double shortest = 3;           // of what is left of one in its branch [mm]
constexpr double shoulder = 0.25;        // of its length, in which it opens to either side [-]
constexpr double untouched = 0.1;        // between the lumen and a tube that does nothing [mm]
constexpr double uneven = 1.5;           // a vessel's wall lies within so many of its radii [-]
constexpr double clot_shear = 1e-3;      // that a fresh clot bears: 1 kPa, an estimate [N/mm²]
constexpr double spasm_pressure = 1e-2;  // on what lies in it: 10 kPa, an estimate [N/mm²]
constexpr double full_pressure = 0.2;    // is reached where a device keeps the wall away by this [mm]

/// A branch by the way from its origin.
struct BranchArc {
    const geometry::CentrelineBranch& branch;
    std::vector<double> arcs;  // of its samples [mm]
    double length;             // [mm]

    BranchArc(const anatomy::Anatomy& anatomy, int b)
        : branch(anatomy.branches[static_cast<std::size_t>(b)]),
          arcs(geometry::arc_lengths(branch.points, -anatomy::origin_of(anatomy, b))),
          length(arcs.back()) {}
    /// The sample before and the fraction of the step to the next.
    std::pair<std::size_t, double> at(double s) const {
        const auto after = std::upper_bound(arcs.begin() + 1, arcs.end() - 1, s);
        const auto i = static_cast<std::size_t>(after - arcs.begin()) - 1;
        const double step = arcs[i + 1] - arcs[i];
        return {i, step > 0 ? std::clamp((s - arcs[i]) / step, 0.0, 1.0) : 0.0};
    }
    Vec3 point(double s) const {
        const auto [i, t] = at(s);
        return (1 - t) * branch.points[i] + t * branch.points[i + 1];
    }
    double radius(double s) const {
        const auto [i, t] = at(s);
        return (1 - t) * branch.radii[i] + t * branch.radii[i + 1];
    }
};

/// Where a complication begins and ends, from the branch's origin: not in the mouth of its parent.
std::pair<double, double> extent(const BranchArc& branch_arc, double at, double over) {
    const double first =
        branch_arc.branch.parent < 0 ? branch_arc.arcs.front() : from_origin * branch_arc.radius(0);
    return {std::max(at - 0.5 * over, first), std::min(at + 0.5 * over, branch_arc.length)};
}

double smooth(double t) {
    t = std::clamp(t, 0.0, 1.0);
    return t * t * t * (t * (6 * t - 15) + 10);
}

std::string unknown_branch(const std::string& name, const anatomy::Anatomy& anatomy) {
    std::vector<std::string> names;
    for (const auto& branch : anatomy.branches) names.push_back(branch.name);
    for (const std::string& whole : names)
        if (("+" + whole + "+").find("+" + name + "+") != std::string::npos)
            return fmt::format(
                "'{}' is a later part of '{}', and where it begins is kept in no file: expected "
                "the whole name, with a place from its origin",
                name, whole);
    const std::vector<std::string_view> known(names.begin(), names.end());
    return fmt::format("expected a branch of {}, found '{}'{}; branches are {}", anatomy.name, name,
                       io::suggestion(name, known), io::joined(names));
}

bool narrows(ComplicationKind kind) {
    return kind == ComplicationKind::Spasm || kind == ComplicationKind::Dissection;
}

/// Part of the lumen's radius that is to be left [-].
double left_of(const Complication& c) {
    return 1 - c.percent / 100;
}

}  // namespace

std::string name_of(const Complication& c, const anatomy::Anatomy& anatomy) {
    if (c.kind == ComplicationKind::Breath)
        return c.breath == script::BreathManner::Cough ? "cough" : "deep breathing";
    return fmt::format("{} {} the {}", script::name_of(c.kind), script::preposition(c.kind),
                       anatomy::clinical_name(anatomy.branches[static_cast<std::size_t>(c.branch)].name));
}

std::string Complications::problem(const script::Complicate& c, const anatomy::Anatomy& anatomy) {
    if (c.kind == ComplicationKind::Breath) return {};
    const std::optional<int> branch = anatomy::branch_named(anatomy, c.branch);
    if (!branch) return unknown_branch(c.branch, anatomy);
    const BranchArc branch_arc(anatomy, *branch);
    if (c.at > branch_arc.length)
        return fmt::format("expected a place of 0 to {:.1f} mm from the origin of {}, found {} mm",
                           branch_arc.length, c.branch, io::number_text(c.at));
    if (const auto [from, to] = extent(branch_arc, c.at, c.over); to - from < shortest)
        return fmt::format(
            "expected a {} of at least {} mm in {}, found {:.1f} mm: what would be in its "
            "parent's lumen, or nearer to that than half its radius, is left out",
            script::name_of(c.kind), shortest, c.branch, std::max(0.0, to - from));
    return {};
}

std::string Complications::problem(const script::Relieve& r, const anatomy::Anatomy& anatomy) {
    return !r.kind || anatomy::branch_named(anatomy, r.branch) ? "" : unknown_branch(r.branch, anatomy);
}

void Complications::set(const script::Complicate& c, const anatomy::Anatomy& anatomy, int frame) {
    assert(problem(c, anatomy).empty());
    Complication made{c.kind, -1, c.at, c.over, c.percent, c.breath, frame};
    if (c.kind == ComplicationKind::Breath) {
        for (Complication& other : all_)
            if (other.kind == c.kind && other.set()) other.relieved = frame;
        if (c.breath == script::BreathManner::Free) return;
        if (c.breath == script::BreathManner::Cough) made.relieved = frame;
    } else {
        made.branch = *anatomy::branch_named(anatomy, c.branch);
        relieve({c.kind, c.branch}, anatomy, frame);
    }
    all_.push_back(made);
    places_.push_back(place_of(made, anatomy));
    if (narrows(made.kind)) all_.back().closed.assign(places_.back().axis.size(), 0.0);
}

void Complications::relieve(const script::Relieve& r, const anatomy::Anatomy& anatomy, int frame) {
    const int branch = r.kind ? *anatomy::branch_named(anatomy, r.branch) : -1;
    for (Complication& c : all_)
        if (c.set() && (!r.kind || (c.kind == *r.kind && c.branch == branch))) c.relieved = frame;
}

bool Complications::in_vessels() const {
    return std::ranges::any_of(all_, [](const Complication& c) { return c.branch >= 0 && !c.gone(); });
}

void Complications::find_places(const anatomy::Anatomy& anatomy) {
    places_.clear();
    for (const Complication& c : all_) places_.push_back(c.gone() ? Place() : place_of(c, anatomy));
}

Complications::Place Complications::place_of(const Complication& c, const anatomy::Anatomy& anatomy) {
    Place place;
    if (c.branch < 0) return place;
    const BranchArc branch_arc(anatomy, c.branch);
    const auto [from, to] = extent(branch_arc, c.at, c.over);
    const double first = std::max(from - past_ends, branch_arc.arcs.front()),
                 last = std::min(to + past_ends, branch_arc.length), slope = shoulder * (to - from);
    const int count = static_cast<int>(std::floor((last - first) / spacing)) + 1;
    for (int k = 0; k < count; ++k) {
        const double s = first + k * spacing;
        place.axis.push_back(branch_arc.point(s));
        place.lumen.push_back(branch_arc.radius(s));
        place.shape.push_back(smooth((s - from) / slope) * smooth((to - s) / slope));
        const auto [i, t] = branch_arc.at(s);
        // In an image from the front a flap is seen in profile.
        const Vec3 aside =
            (branch_arc.branch.points[i + 1] - branch_arc.branch.points[i]).cross(Vec3::UnitY());
        place.side.push_back(aside.norm() > 1e-6 ? Vec3(aside.normalized()) : Vec3(Vec3::UnitX()));
    }
    std::vector<double> wall = place.lumen;  // how far it is from the axis [mm]
    double reach = 0;
    const Vec3& middle = place.axis[place.axis.size() / 2];
    for (std::size_t k = 0; k < wall.size(); ++k)
        reach = std::max(reach, (place.axis[k] - middle).norm() + uneven * place.lumen[k]);
    for (const Vec3& v : anatomy.lumen.vertices) {
        if ((v - middle).squaredNorm() > reach * reach) continue;
        std::size_t nearest = 0;
        for (std::size_t k = 1; k < wall.size(); ++k)
            if ((v - place.axis[k]).squaredNorm() < (v - place.axis[nearest]).squaredNorm()) nearest = k;
        const double away = (v - place.axis[nearest]).norm();
        if (away < uneven * place.lumen[nearest]) wall[nearest] = std::max(wall[nearest], away);
    }
    for (std::size_t k = 0; k < wall.size(); ++k) {
        const std::size_t before = k < 2 ? 0 : k - 2, after = std::min(k + 3, wall.size());
        place.open.push_back(untouched +
                             *std::max_element(wall.begin() + static_cast<std::ptrdiff_t>(before),
                                               wall.begin() + static_cast<std::ptrdiff_t>(after)));
    }
    return place;
}

/// How far each sample may be closed for the devices that lie in it [-].
std::vector<double> Complications::room_for(const physics::Chain& chain, const Complication& c,
                                            const Place& place) {
    constexpr std::size_t beside = 3;  // samples on either side that a joint's device reaches
    std::vector<double> most(place.axis.size(), 1.0);
    for (std::size_t j = 0; j < chain.joints.size(); ++j) {
        std::size_t nearest = 0;
        for (std::size_t k = 1; k < place.axis.size(); ++k)
            if ((chain.joints[j] - place.axis[k]).squaredNorm() <
                (chain.joints[j] - place.axis[nearest]).squaredNorm())
                nearest = k;
        if ((chain.joints[j] - place.axis[nearest]).norm() > uneven * place.lumen[nearest] + spacing)
            continue;
        const double needed = chain.inner_radius() + chain.thickness[j] + room_left;
        for (std::size_t k = nearest < beside ? 0 : nearest - beside;
             k < std::min(nearest + beside + 1, most.size()); ++k) {
            const double closes = place.open[k] - left_of(c) * place.lumen[k];
            most[k] = std::min(most[k], std::clamp((place.open[k] - needed) / closes, 0.0, 1.0));
        }
    }
    return most;
}

bool Complications::move(Complication& c, const Place& place, const physics::Chain& chain, double seconds) {
    double farthest = 0;  // way of the wall [mm]
    for (std::size_t k = 0; narrows(c.kind) && k < place.axis.size(); ++k)
        farthest = std::max(farthest, place.open[k] - left_of(c) * place.lumen[k]);
    const double part = std::min(seconds / time_to_come, farthest > 0 ? largest_move / farthest : 1.0);
    const double came = c.come;
    c.come = c.set() ? std::min(1.0, c.come + part) : std::max(0.0, c.come - part);
    bool changed = c.come != came;
    if (c.gone()) {
        c.closed.clear();
        return changed;
    }
    if (!narrows(c.kind)) return changed;
    std::vector<double> most;
    for (std::size_t k = 0; k < c.closed.size(); ++k) {
        const double wanted = c.come * place.shape[k], before = c.closed[k];
        if (wanted > before) {
            if (most.empty()) most = room_for(chain, c, place);
            c.closed[k] = std::min({wanted, before + part, std::max(before, most[k])});
            c.held_off = c.held_off || wanted > most[k];
        } else {
            c.closed[k] = wanted;
        }
        changed = changed || c.closed[k] != before;
    }
    return changed;
}

bool Complications::step(double seconds, const physics::Chain& chain) {
    assert(places_.size() == all_.size());
    bool changed = false;
    for (std::size_t k = 0; k < all_.size(); ++k) {
        if (all_[k].branch < 0 || all_[k].gone()) continue;
        changed = move(all_[k], places_[k], chain, seconds) || changed;
        if (all_[k].gone()) places_[k] = {};
    }
    return changed;
}

Complications Complications::as_seen() const {
    constexpr double steps = 4;
    Complications seen = *this;
    for (Complication& c : seen.all_) {
        if (c.come == 0 || c.come == 1) continue;
        const double shown = std::floor(c.come * steps) / steps;
        for (double& closed : c.closed) closed *= shown / c.come;
        c.come = shown;
    }
    return seen;
}

std::vector<physics::Narrowing> Complications::narrowings() const {
    std::vector<physics::Narrowing> made;
    for (std::size_t n = 0; n < all_.size(); ++n) {
        const Complication& c = all_[n];
        const Place& place = places_[n];
        if (c.branch < 0 || c.gone()) continue;
        physics::Narrowing& narrowing = made.emplace_back();
        for (std::size_t k = 0; k < place.axis.size(); ++k) {
            physics::Narrowing::Sample sample;
            sample.at = place.axis[k];
            sample.radius = place.open[k];
            sample.lumen = place.lumen[k];
            if (c.kind == ComplicationKind::Thrombus) {
                sample.shear = clot_shear * c.come * place.shape[k];
            } else {
                const double narrow = left_of(c) * place.lumen[k];
                sample.radius += c.closed[k] * (narrow - place.open[k]);
                if (c.kind == ComplicationKind::Dissection) {
                    // The vessel's wall is as much farther from the tube's axis on the flap's side.
                    const double aside = c.closed[k] * (place.lumen[k] - narrow);
                    sample.aside = aside * place.side[k];
                    sample.lumen += aside;
                } else {
                    sample.pressure =
                        spasm_pressure * std::min(1.0, (c.come * place.shape[k] - c.closed[k]) *
                                                           (place.open[k] - narrow) / full_pressure);
                }
            }
            // Its ends are open: past the last sample all that is known stays, and the tube would end in a
            // cap.
            if (k < open_ends || k + open_ends >= place.axis.size()) sample.radius += 2 * sample.lumen;
            narrowing.samples.push_back(sample);
        }
    }
    return made;
}

/// Of the flow through a circular lumen: Poiseuille's law along it, and what the jet behind its narrowest
/// place loses, 1.52 ρ/2 (A₀/A₁ − 1)² v² (Young and Tsai 1973).
std::vector<blood::Obstruction> Complications::obstructions() const {
    std::vector<blood::Obstruction> made;
    for (std::size_t n = 0; n < all_.size(); ++n) {
        const Complication& c = all_[n];
        const Place& place = places_[n];
        if (c.branch < 0 || c.gone()) continue;
        blood::Obstruction& in_the_way = made.emplace_back();
        in_the_way.branch = c.branch;
        const auto begin = std::ranges::find_if(place.shape, [](double shape) { return shape > 0; });
        in_the_way.from = place.axis[static_cast<std::size_t>(begin - place.shape.begin())];
        in_the_way.middle = place.axis[place.axis.size() / 2];
        if (c.kind == ComplicationKind::Thrombus) {
            in_the_way.passes = 1 - c.come;
            continue;
        }
        for (std::size_t k = 0; k < place.axis.size(); ++k) {
            const double lumen = place.lumen[k],
                         left = std::min(lumen,
                                         place.open[k] + c.closed[k] * (left_of(c) * lumen - place.open[k]));
            in_the_way.laminar += blood::laminar_loss(spacing, left, lumen);
            in_the_way.turbulent = std::max(in_the_way.turbulent, blood::expansion_loss(left, lumen));
        }
    }
    return made;
}

}  // namespace exercise
