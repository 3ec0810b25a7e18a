#include "engine/anatomy/grow/preset_builders.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "physics/geometry/maths.h"

namespace anatomy {
namespace {

constexpr std::uint64_t attempts_of_shape = 6;  // before dimensions are drawn anew
constexpr double pair_fraction = 0.5;           // of the variance that both sides have in common
constexpr double displacement = 0.3;            // of inner knots, in radii
constexpr double bends_yearly = 0.015, fewest_bends = 0.5, most_bends = 1.5;
constexpr double tilted_part = 0.5;    // of a branch, in which its tilt fades
constexpr double least_bend = 1.15;    // radius of a bend over that of the lumen
constexpr double widest_mouth = 0.93;  // radius of a branch where it leaves another, over that one's
constexpr std::size_t narrowed_knots = 3;

std::string both_sides(const std::string& vessel) {
    const bool sided = vessel.size() > 2 && (vessel[0] == 'L' || vessel[0] == 'R');
    return sided ? vessel.substr(1) : vessel;
}

std::vector<VesselKnot> knots_of(const std::vector<Stretch>& stretches) {
    std::vector<VesselKnot> knots;
    for (const Stretch& stretch : stretches)
        knots.insert(knots.end(), stretch.knots.begin(), stretch.knots.end());
    return knots;
}

/// The span that holds a place, and the part of it before that.
std::pair<std::size_t, double> span_of(const std::vector<double>& arcs, double at) {
    const auto after = std::upper_bound(arcs.begin() + 1, arcs.end() - 1, at);
    const auto i = static_cast<std::size_t>(after - arcs.begin()) - 1;
    return {i, (at - arcs[i]) / (arcs[i + 1] - arcs[i])};
}

/// Narrows the mouth of a branch to what its parent has room for, less from knot to knot.
template <class Knots>
void narrow_mouth(Knots from_mouth, std::size_t count, double room) {
    const double narrower = widest_mouth * room / from_mouth->radius;
    if (!(narrower < 1)) return;
    for (std::size_t i = 0; i < std::min(narrowed_knots, count); ++i, ++from_mouth)
        from_mouth->radius *=
            1 - (1 - narrower) * (1 - static_cast<double>(i) / static_cast<double>(narrowed_knots));
}

}  // namespace

void smooth_bends(std::vector<VesselKnot>& knots) {
    constexpr int most_rounds = 40;
    constexpr double fraction = 0.12;  // of the way to the middle of the neighbours
    std::vector<VesselKnot> moved = knots;
    double gentlest = 0;
    for (int round = 0; round < most_rounds && knots.size() > 2; ++round) {
        const Bend bend = tightest_bend(moved);
        if (bend.ratio > gentlest) gentlest = bend.ratio, knots = moved;
        if (bend.ratio >= least_bend) return;
        const std::vector<VesselKnot> before = moved;
        const std::size_t first = std::max<std::size_t>(1, bend.knot - 1),
                          last = std::min(moved.size() - 2, bend.knot + 1);
        for (std::size_t i = first; i <= last; ++i)
            moved[i].place +=
                fraction * (0.5 * (before[i - 1].place + before[i + 1].place) - before[i].place);
    }
}

bool Variation::is_mean() const {
    const Patient mean;
    return !draws_.varied() && !patient_.sex && patient_.age == mean.age && patient_.height == mean.height &&
           std::abs(patient_.weight - mean.weight) < 0.01;
}

double Variation::normal(const std::string& quantity, bool shape) const {
    return draws_.normal(quantity, shape ? attempt_ : attempt_ / attempts_of_shape);
}

double Variation::paired(const std::string& quantity) const {
    const std::string both = both_sides(quantity);
    if (both == quantity) return normal(quantity);
    return std::sqrt(pair_fraction) * normal("both " + both) +
           std::sqrt(1 - pair_fraction) * normal(quantity);
}

double Variation::figure(const std::string& quantity, double mean, double deviation) const {
    return mean + deviation * normal(quantity);
}

double Variation::figure(const std::string& quantity, double mean, double deviation, double least,
                         double most) const {
    return std::clamp(figure(quantity, mean, deviation), least, most);
}

double Variation::diameter(const std::string& vessel, double mean, double deviation,
                           const Trend& trend) const {
    const double relative = deviation / mean, explained = explained_deviation(trend);
    // What sex, age and size do not explain is the vessel's own; half of the variance at least.
    const double own =
        std::sqrt(std::max(0.5 * relative * relative, relative * relative - explained * explained));
    return mean * diameter_factor(trend, patient_) * std::max(0.4, 1 + own * paired(vessel + " diameter"));
}

double Variation::length(const std::string& vessel, double relative_deviation, double by_height,
                         double yearly) const {
    const double aged = std::max(0.5, 1 + yearly * (patient_.age - Patient().age));
    return length_factor(by_height, patient_) * aged *
           std::max(0.5, 1 + relative_deviation * paired(vessel + " length"));
}

std::vector<VesselKnot> Variation::varied(const std::vector<Stretch>& stretches, const Origin& origin,
                                          const std::string& name) const {
    const std::vector<VesselKnot> mean = knots_of(stretches);
    double whole = 0, way = 0;
    for (std::size_t i = 1; i < mean.size(); ++i) whole += (mean[i].place - mean[i - 1].place).norm();
    const Vec3 ahead = (mean[1].place - mean[0].place).normalized(), side = ahead.unitOrthogonal();
    const Vec3 tilt = origin.tilt * (normal(name + " tilt", true) * side +
                                     normal(name + " turn", true) * ahead.cross(side));
    const double bends =
        std::clamp(1 + bends_yearly * (patient_.age - Patient().age), fewest_bends, most_bends);
    std::vector<VesselKnot> knots;
    for (const Stretch& stretch : stretches) {
        const Traits& traits = stretch.traits;
        const double wider = diameter(stretch.name, 1, traits.diameter_deviation, traits.trend),
                     longer = length(stretch.name, traits.length_deviation, traits.by_height);
        const double taper = std::clamp(traits.taper_deviation * paired(stretch.name + " taper"), -0.5, 0.5);
        for (std::size_t k = 0; k < stretch.knots.size(); ++k) {
            const VesselKnot& knot = stretch.knots[k];
            const std::size_t i = knots.size();
            const double part = static_cast<double>(k + 1) / static_cast<double>(stretch.knots.size());
            const double radius = wider * (1 + part * taper) * knot.radius;
            if (i == 0) {
                knots.push_back({knot.place, radius});
                continue;
            }
            const Vec3 step = knot.place - mean[i - 1].place;
            way += step.norm();
            const double t = std::max(0.0, 1 - (way - 0.5 * step.norm()) / (tilted_part * whole));
            const Vec3 turn = t * t * (3 - 2 * t) * tilt;
            const double angle = turn.norm();
            const Vec3 turned = angle > 0 ? Vec3(geometry::rotation(angle, turn / angle) * step) : step;
            knots.push_back({knots[i - 1].place + longer * turned, radius});
        }
    }
    for (std::size_t i = 1; i + 1 < knots.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            knots[i].place[axis] += bends * displacement * knots[i].radius *
                                    normal(fmt::format("{} bend {} {}", name, i, axis), true);
    return knots;
}

BranchSpec Variation::branch(const std::vector<Stretch>& stretches, const Origin& origin,
                             std::size_t anchor) {
    BranchSpec spec;
    std::size_t knot = 0;
    for (const Stretch& stretch : stretches) {
        spec.name += (spec.name.empty() ? "" : "+") + stretch.name;
        if (stretches.size() > 1) spec.parts.push_back({stretch.name, knot});
        knot += stretch.knots.size();
    }
    spec.parent = origin.parent;
    spec.at = place(origin.parent, origin.at) + origin.deviation * normal(spec.name + " origin");
    const std::vector<VesselKnot> mean = knots_of(stretches);
    spec.knots = varied(stretches, origin, spec.name);
    if (is_mean()) {  // without the rounding of steps
        for (std::size_t i = 0; i < mean.size(); ++i) spec.knots[i].place = mean[i].place;
    } else {
        narrow_mouth(spec.knots.begin(), spec.knots.size(), radius_at(origin.parent, spec.at));
        smooth_bends(spec.knots);
        const Vec3 shift = mean[anchor].place - spec.knots[anchor].place;
        for (VesselKnot& knot : spec.knots) knot.place += shift;
    }
    Made& made = made_[spec.name] = {knot_arcs(mean), knot_arcs(spec.knots), {}};
    for (const VesselKnot& knot : spec.knots) made.radii.push_back(knot.radius);
    return spec;
}

void Variation::join(BranchSpec& spec, const std::string& branch, double at) const {
    spec.joins = branch;
    spec.joins_at = place(branch, at);
    narrow_mouth(spec.knots.rbegin(), spec.knots.size(), radius_at(branch, spec.joins_at));
}

double Variation::place(const std::string& branch, double at) const {
    const auto found = made_.find(branch);
    if (found == made_.end() || found->second.mean == found->second.own) return at;
    const auto [i, part] = span_of(found->second.mean, at);
    const std::vector<double>& own = found->second.own;
    return own[i] + part * (own[i + 1] - own[i]);
}

double Variation::radius_at(const std::string& branch, double at) const {
    const auto found = made_.find(branch);
    if (found == made_.end()) return std::numeric_limits<double>::infinity();
    const auto [i, part] = span_of(found->second.own, at);
    const std::vector<double>& radii = found->second.radii;
    return radii[i] + part * (radii[i + 1] - radii[i]);
}

}  // namespace anatomy
