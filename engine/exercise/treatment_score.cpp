#include "engine/exercise/treatment_score.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <limits>

#include "engine/anatomy/organs.h"
#include "engine/blood/pressure.h"
#include "engine/exercise/simulation.h"

namespace exercise {
namespace {

using geometry::Vec3;
using physics::OpenedPlace;

constexpr double beside_stent = 1;  // of a stent's wall: so near an origin lies under it [mm]
constexpr double no_flow = 1e-9;    // [ml/s]
constexpr double pressed = 1;       // a balloon is inflated from here on [atm]

/// Arcs along a branch of points that need not lie in it.
class SignedArcs {
public:
    SignedArcs(const anatomy::Anatomy& anatomy, int branch)
        : branch_arc_(anatomy, branch), origin_(branch_arc_.point(0)) {}

    double operator()(const Vec3& x) const {
        const auto [arc, away] = nearest(x);
        const auto& points = branch_arc_.branch.points;
        const bool root = branch_arc_.branch.parent < 0;
        if (arc >= branch_arc_.length)
            return branch_arc_.length +
                   std::max(
                       0.0,
                       (x - points.back()).dot((points.back() - points[points.size() - 2]).normalized()));
        const double first = branch_arc_.arcs.front();
        if (root && arc <= first)
            return first + std::min(0.0, (x - points[0]).dot((points[1] - points[0]).normalized()));
        if (arc <= first || !holds(arc, away)) return std::min(first, -(x - origin_).norm());
        return arc;
    }
    /// Whether the branch passes around the point.
    bool holds(const Vec3& x) const {
        const auto [arc, away] = nearest(x);
        return holds(arc, away);
    }

private:
    bool holds(double arc, double away) const {
        return away <= BranchStretch::uneven * branch_arc_.radius(arc) + beside_stent;
    }
    /// Arc of the nearest point of the centreline, and the distance to it.
    std::pair<double, double> nearest(const Vec3& x) const {
        const auto& points = branch_arc_.branch.points;
        double best = std::numeric_limits<double>::infinity(), arc = 0;
        for (std::size_t k = 0; k + 1 < points.size(); ++k) {
            const Vec3 step = points[k + 1] - points[k];
            const double square = step.squaredNorm();
            const double t = square > 0 ? std::clamp((x - points[k]).dot(step) / square, 0.0, 1.0) : 0.0;
            const double away = (x - points[k] - t * step).norm();
            if (away < best) {
                best = away;
                arc = branch_arc_.arcs[k] + t * (branch_arc_.arcs[k + 1] - branch_arc_.arcs[k]);
            }
        }
        return {arc, best};
    }
    BranchArc branch_arc_;
    Vec3 origin_;
};

/// A stent's wall lies at the lumen's where that is narrower.
double radius_of(const PlacedStent::Sample& sample) {
    return std::min(sample.place.stent, sample.place.radius);
}

/// Places within the lesion itself, without the samples past its ends.
bool is_in(const BranchStretch& stretch, std::size_t k) {
    return stretch.arc[k] >= stretch.from - 1e-9 && stretch.arc[k] <= stretch.to + 1e-9;
}

/// Of the lesions alone, with these radii.
std::vector<blood::Obstruction> obstructions_of(const Treatment& treatment, double OpenedPlace::*radius) {
    std::vector<blood::Obstruction> made;
    for (const Lesion& lesion : treatment.lesions()) {
        std::vector<double> radii;
        for (const OpenedPlace& place : lesion.places) radii.push_back(place.*radius);
        made.push_back(treatment.stretch_of(lesion).obstruction(lesion.branch, radii));
    }
    return made;
}

blood::Across cells_across(const blood::BloodFlow& flow, const Lesion& lesion, const BranchStretch& stretch) {
    return blood::across(flow, lesion.branch, stretch.axis.front(), stretch.axis[stretch.axis.size() / 2],
                         stretch.axis.back());
}

void add_pressures(LesionState& made, const blood::BloodFlow& unobstructed, const blood::BloodFlow& flow,
                   const blood::Across& cells, const blood::Obstruction& obstruction,
                   std::span<const double> resting) {
    if (!cells.known()) return;
    const double through = resting[static_cast<std::size_t>(cells.middle)];
    if (!(through > no_flow)) return;
    made.proximal = blood::mean_pressure_in(flow, cells.before);
    made.distal = blood::mean_pressure_in(flow, cells.behind);
    if (!(*made.proximal > 0)) return;
    made.ratio = *made.distal / *made.proximal;
    made.hyperaemic =
        blood::ratio_across(*made.proximal, through * *made.proximal / unobstructed.mean_pressure,
                            obstruction, blood::hyperaemia);
}

/// The lesion that a stent lies in, or the nearest one; -1 without one.
int lesion_of(const PlacedStent& stent, const Treatment& treatment) {
    int found = -1;
    double best = std::numeric_limits<double>::infinity();
    for (const PlacedStent::Sample& sample : stent.samples) {
        for (std::size_t n = 0; n < treatment.lesions().size(); ++n) {
            const BranchStretch& stretch = treatment.stretch_of(treatment.lesions()[n]);
            for (std::size_t k = 0; k < stretch.axis.size(); ++k) {
                if (!is_in(stretch, k)) continue;
                const double away = (sample.at - stretch.axis[k]).norm();
                if (away < best) best = away, found = static_cast<int>(n);
            }
        }
    }
    return found;
}

/// Whether a point lies beside a stent, no farther from its axis than its wall and a little more.
bool is_under(const Vec3& x, const PlacedStent& stent) {
    const auto& samples = stent.samples;
    for (std::size_t k = 0; k + 1 < samples.size(); ++k) {
        const Vec3 step = samples[k + 1].at - samples[k].at;
        const double square = step.squaredNorm(), t = square > 0 ? (x - samples[k].at).dot(step) / square : 0;
        // Beside a bend's joint no piece passes by: the joint does.
        const double low = k == 0 ? 0 : -1, high = k + 2 == samples.size() ? 1 : 2;
        if (t < low || t > high) continue;
        const Vec3 at = samples[k].at + std::clamp(t, 0.0, 1.0) * step;
        if ((x - at).norm() <= std::max(radius_of(samples[k]), radius_of(samples[k + 1])) + beside_stent)
            return true;
    }
    return false;
}

std::vector<std::string> jailed_by(std::span<const PlacedStent* const> stents,
                                   const anatomy::Anatomy& anatomy) {
    std::vector<std::string> found;
    for (std::size_t b = 0; b < anatomy.branches.size(); ++b) {
        if (anatomy.branches[b].parent < 0) continue;
        const Vec3 origin = BranchArc(anatomy, static_cast<int>(b)).point(0);
        const bool jailed = std::ranges::any_of(stents, [&](const PlacedStent* stent) {
            // A stent that goes into a branch keeps it open.
            return is_under(origin, *stent) &&
                   std::ranges::none_of(stent->samples, [&](const PlacedStent::Sample& sample) {
                       return anatomy::nearest_place(anatomy, sample.at).branch == static_cast<int>(b);
                   });
        });
        if (jailed) found.push_back(anatomy.branches[b].name);
    }
    return found;
}

std::vector<const PlacedStent*> stents_of(const Treatment& treatment, std::span<const int> counts_for,
                                          std::size_t lesion) {
    std::vector<const PlacedStent*> stents;
    for (std::size_t k = 0; k < treatment.stents().size(); ++k)
        if (counts_for[k] == static_cast<int>(lesion)) stents.push_back(&treatment.stents()[k]);
    return stents;
}

StentScore stent_score(const PlacedStent& stent, int lesion) {
    StentScore made{stent.device, stent.frame, 0, 0, lesion, stent.attached};
    for (std::size_t k = 0; k < stent.samples.size(); ++k) {
        if (k > 0) made.length += (stent.samples[k].at - stent.samples[k - 1].at).norm();
        made.diameter += 2 * radius_of(stent.samples[k]) / static_cast<double>(stent.samples.size());
    }
    return made;
}

}  // namespace

LesionState lumen_of(const BranchStretch& stretch, std::span<const OpenedPlace> places,
                     double OpenedPlace::*radius) {
    const OpenedPlace* narrowest = nullptr;
    for (std::size_t k = 0; k < places.size(); ++k)
        if (is_in(stretch, k) && (!narrowest || places[k].*radius * narrowest->reference <
                                                    narrowest->*radius * places[k].reference))
            narrowest = &places[k];
    LesionState made;
    if (!narrowest) return made;
    made.lumen = 2 * narrowest->*radius;
    made.reference = 2 * narrowest->reference;
    made.residual = 100 * (1 - made.lumen / made.reference);
    return made;
}

std::optional<StentedLesion> stents_against(const anatomy::Anatomy& anatomy, const LesionExtent& lesion,
                                            std::span<const PlacedStent* const> stents,
                                            const Ballooned& ballooned) {
    const SignedArcs arc_of(anatomy, lesion.branch);
    const bool has_parent = anatomy.branches[static_cast<std::size_t>(lesion.branch)].parent >= 0;
    StentedLesion made;
    double least = std::numeric_limits<double>::infinity(), most = -least;
    std::vector<std::pair<double, double>> intervals;
    int samples = 0, apposed = 0;
    for (const PlacedStent* stent : stents) {
        double before = 0;
        for (std::size_t k = 0; k < stent->samples.size(); ++k) {
            const PlacedStent::Sample& sample = stent->samples[k];
            const double arc = arc_of(sample.at);
            least = std::min(least, arc), most = std::max(most, arc);
            if (k > 0 && arc_of.holds(sample.at) && arc_of.holds(stent->samples[k - 1].at))
                intervals.emplace_back(std::min(arc, before), std::max(arc, before));
            before = arc;
            if (has_parent && arc < 0) continue;
            const double gap = std::max(0.0, sample.place.radius - sample.place.stent),
                         expansion = 100 * radius_of(sample) / sample.place.reference;
            ++samples;
            apposed += gap <= StentedLesion::apposed_within;
            made.gap = std::max(gap, made.gap.value_or(0));
            made.expansion = std::min(expansion, made.expansion.value_or(expansion));
        }
    }
    if (!(least <= most)) return {};
    if (samples > 0) made.apposed = 100.0 * apposed / samples;
    const double length = lesion.to - lesion.from;
    made.covered = 100 * part_covered(lesion.from, lesion.to, std::move(intervals));
    made.missed_proximal = std::clamp(least - lesion.from, 0.0, length);
    made.missed_distal = std::clamp(lesion.to - most, 0.0, length);
    made.proximal_end = least, made.distal_end = most;
    if (lesion.plan) {
        made.proximal_off = least - lesion.plan->first;
        made.distal_off = most - lesion.plan->second;
    }
    if (has_parent && most > 0) made.protrusion = std::max(0.0, -least);
    if (ballooned.any()) {
        made.beyond_proximal = std::max(0.0, least - ballooned.from);
        made.beyond_distal = std::max(0.0, ballooned.to - most);
    }
    made.jailed = jailed_by(stents, anatomy);
    return made;
}

double signed_arc(const anatomy::Anatomy& anatomy, int branch, const Vec3& x) {
    return SignedArcs(anatomy, branch)(x);
}

double part_covered(double from, double to, std::vector<std::pair<double, double>> intervals) {
    if (!(to > from)) return 0;
    std::ranges::sort(intervals);
    double covered = 0, reached = from;
    for (const auto& [begin, end] : intervals) {
        const double low = std::max(begin, reached), high = std::min(end, to);
        if (high <= low) continue;
        covered += high - low;
        reached = high;
    }
    return std::clamp(covered / (to - from), 0.0, 1.0);
}

bool is_torn(const Complication& complication, const Treatment& treatment) {
    return complication.kind == script::ComplicationKind::Dissection &&
           std::ranges::any_of(treatment.events(), [&](const TreatmentEvent& event) {
               return event.kind == TreatmentEvent::Kind::Dissection && event.branch == complication.branch &&
                      event.along == complication.at;
           });
}

void note_balloon(const Simulation& simulation, std::vector<Ballooned>& ballooned) {
    const Treatment& treatment = simulation.treatment();
    ballooned.resize(treatment.lesions().size());
    const Inflation* inflation = treatment.inflation();
    if (!inflation || !(inflation->pressure >= pressed)) return;
    const auto which = simulation.scenario().index_of(script::DeviceRole::Balloon);
    if (!which) return;
    const auto& balloon = simulation.devices()[static_cast<std::size_t>(*which)].device.balloon;
    const geometry::Polyline path = simulation.path_of(script::DeviceRole::Balloon);
    if (!balloon || path.size() < 2) return;
    std::vector<Vec3> points(static_cast<std::size_t>(std::ceil(balloon->length)) + 1, path.back());
    // From the tip towards the introducer.
    std::size_t i = path.size() - 1;
    Vec3 at = path.back();
    for (std::size_t k = 0; k < points.size(); ++k) {
        double left = k == 0 ? balloon->from_tip : balloon->length / static_cast<double>(points.size() - 1);
        while (i > 0) {
            const double there = (path[i - 1] - at).norm();
            if (there > left) {
                at += left / there * (path[i - 1] - at);
                break;
            }
            left -= there;
            at = path[--i];
        }
        points[k] = at;
    }
    for (std::size_t n = 0; n < ballooned.size(); ++n) {
        const Lesion& lesion = treatment.lesions()[n];
        const BranchStretch& stretch = treatment.stretch_of(lesion);
        const SignedArcs arc_of(simulation.anatomy(), lesion.branch);
        double least = std::numeric_limits<double>::infinity(), most = -least;
        bool reaches = false;
        for (const Vec3& point : points) {
            const double arc = arc_of(point);
            least = std::min(least, arc), most = std::max(most, arc);
            reaches = reaches || (arc >= stretch.from && arc <= stretch.to && arc_of.holds(point));
        }
        if (!reaches) continue;
        Ballooned& all = ballooned[n];
        all =
            all.any() ? Ballooned{std::min(all.from, least), std::max(all.to, most)} : Ballooned{least, most};
    }
}

TreatmentScore treatment_score(const Simulation& simulation, std::span<const Ballooned> ballooned) {
    const Treatment& treatment = simulation.treatment();
    TreatmentScore made;
    made.tally = treatment.tally();
    made.tally.without_break = 0;
    for (const TreatmentEvent& event : treatment.events()) {
        made.bursts += event.kind == TreatmentEvent::Kind::Burst;
        made.dissections += event.kind == TreatmentEvent::Kind::Dissection;
        made.ruptures += event.kind == TreatmentEvent::Kind::Rupture;
    }
    for (const Complication& complication : simulation.complications())
        made.dissections_left += complication.set() && is_torn(complication, treatment);
    std::vector<int> counts_for;
    for (const PlacedStent& stent : treatment.stents()) {
        counts_for.push_back(lesion_of(stent, treatment));
        made.stents.push_back(stent_score(stent, counts_for.back()));
    }
    if (treatment.lesions().empty()) return made;

    const blood::BloodFlow& unobstructed = simulation.contrast().unobstructed();
    const std::vector<double> resting = unobstructed.resting();
    const auto in_the_way_before = obstructions_of(treatment, &OpenedPlace::before),
               in_the_way_now = obstructions_of(treatment, &OpenedPlace::radius);
    const blood::BloodFlow before = unobstructed.obstructed(in_the_way_before),
                           now = unobstructed.obstructed(in_the_way_now);
    for (std::size_t n = 0; n < treatment.lesions().size(); ++n) {
        const Lesion& lesion = treatment.lesions()[n];
        const BranchStretch& stretch = treatment.stretch_of(lesion);
        LesionScore& score = made.lesions.emplace_back();
        score.branch = simulation.anatomy().branches[static_cast<std::size_t>(lesion.branch)].name;
        score.at = 0.5 * (stretch.from + stretch.to);
        score.length = stretch.to - stretch.from;
        const blood::Across cells = cells_across(unobstructed, lesion, stretch);
        score.before = lumen_of(stretch, lesion.places, &OpenedPlace::before);
        add_pressures(score.before, unobstructed, before, cells, in_the_way_before[n], resting);
        score.after = lumen_of(stretch, lesion.places, &OpenedPlace::radius);
        add_pressures(score.after, unobstructed, now, cells, in_the_way_now[n], resting);
        const auto& spec = simulation.scenario().lesions[static_cast<std::size_t>(lesion.spec)];
        score.stented = stents_against(
            simulation.anatomy(), {lesion.branch, stretch.from, stretch.to, spec.stent},
            stents_of(treatment, counts_for, n), n < ballooned.size() ? ballooned[n] : Ballooned());
    }
    return made;
}

std::optional<double> TreatmentScore::worst_residual() const {
    std::optional<double> worst;
    for (const LesionScore& lesion : lesions)
        worst = std::max(worst.value_or(lesion.after.residual), lesion.after.residual);
    return worst;
}

std::string name_of(const LesionScore& lesion) {
    return fmt::format("{}, {:.0f} mm from its origin", anatomy::clinical_name(lesion.branch), lesion.at);
}

std::vector<TreatmentFigure> figures_of(const LesionScore& lesion) {
    const auto text = [](const std::optional<double>& value, int digits, const char* unit) {
        return value ? fmt::format("{:.{}f}{}{}", *value, digits, *unit ? " " : "", unit) : std::string("-");
    };
    const auto signed_text = [](const std::optional<double>& value) {
        return value
                   ? fmt::format("{:.1f} mm {}", std::abs(*value), *value < 0 ? "too proximal" : "too distal")
                   : std::string("-");
    };
    const LesionState &before = lesion.before, &now = lesion.after;
    std::vector<TreatmentFigure> rows = {
        {"Narrowest lumen", text(before.lumen, 2, "mm"), text(now.lumen, 2, "mm"),
         "Diameter where the least of the vessel is left, with no device in it."},
        {"Vessel there without plaque", text(before.reference, 2, "mm"), text(now.reference, 2, "mm"),
         "The reference diameter."},
        {"Residual stenosis", text(before.residual, 0, "%"), text(now.residual, 0, "%"),
         "100 % less the lumen over the reference. Below 0 where the lumen is wider than the vessel was."},
        {"Mean pressure before it", text(before.proximal, 0, "mmHg"), text(now.proximal, 0, "mmHg"),
         "Pa, along the flow."},
        {"Mean pressure behind it", text(before.distal, 0, "mmHg"), text(now.distal, 0, "mmHg"), "Pd."},
        {"Gradient", text(before.gradient(), 0, "mmHg"), text(now.gradient(), 0, "mmHg"),
         "The first less the second."},
        {"Pd/Pa at rest", text(before.ratio, 2, ""), text(now.ratio, 2, ""),
         "Of mean pressures, by the flow of rest."},
        {"Pd/Pa in hyperaemia, estimated", text(before.hyperaemic, 2, ""), text(now.hyperaemic, 2, ""),
         "The same if the bed behind let three times as much blood through: an estimate from the bed's "
         "resistance, and no measured FFR."},
    };
    if (!lesion.stented) return rows;
    const StentedLesion& s = *lesion.stented;
    const auto add = [&](const char* name, std::string value, const char* meaning) {
        rows.push_back({name, "", std::move(value), meaning});
    };
    add("Covered by stents", text(s.covered, 0, "%"), "Of the lesion's length.");
    add("Missed at its proximal end", text(s.missed_proximal, 1, "mm"),
        "Length of the lesion that no stent reaches: a geographic miss.");
    add("Missed at its distal end", text(s.missed_distal, 1, "mm"), "Likewise.");
    add("Proximal end of the stent", signed_text(s.proximal_off), "Against the plan of the exercise.");
    add("Distal end of the stent", signed_text(s.distal_off), "Likewise.");
    add("In the vessel that it leaves", text(s.protrusion, 1, "mm"),
        "Length of the stent that stands out of the branch's origin.");
    add("Ballooned beyond the stent, proximal", text(s.beyond_proximal, 1, "mm"),
        "Length that balloons inflated in the lesion have reached past the stent's end.");
    add("Ballooned beyond the stent, distal", text(s.beyond_distal, 1, "mm"), "Likewise.");
    add("Largest gap to the wall", text(s.gap, 2, "mm"), "Between stent and wall, in the branch.");
    add("Apposed", text(s.apposed, 0, "%"), "Of the stent's length, with a gap up to 0.3 mm.");
    add("Expansion", text(s.expansion, 0, "%"), "Least diameter of the stent over the vessel's there.");
    std::vector<std::string> jailed;
    for (const std::string& branch : s.jailed) jailed.push_back(anatomy::clinical_name(branch));
    add("Branches under the stent", jailed.empty() ? "none" : fmt::format("{}", fmt::join(jailed, ", ")),
        "Their origin lies under it, and blood has to pass its struts.");
    return rows;
}

std::vector<TreatmentFigure> figures_of(const TreatmentScore& score) {
    const InflationTally& t = score.tally;
    const auto count = [](int value) { return fmt::format("{}", value); };
    const auto seconds = [](double value) { return fmt::format("{:.0f} s", value); };
    return {
        {"Inflations", "", count(t.inflations), "Times that the pressure rose above 1 atm."},
        {"Highest pressure", "", fmt::format("{:.1f} atm", t.highest), "In the balloon, on the dial."},
        {"Inflated", "", seconds(t.seconds), "Above 1 atm."},
        {"Beyond the rated pressure", "", seconds(t.beyond_rated), "Where balloons begin to burst."},
        {"Without blood behind the balloon", "",
         fmt::format("{:.0f} s, {:.0f} s without a break", t.occluded, t.longest),
         "While the balloon filled the vessel."},
        {"Balloon to artery", "", t.largest_ratio > 0 ? fmt::format("{:.2f}", t.largest_ratio) : "-",
         "The widest that a balloon at 1 atm or more opened a lesion or vessel that it pressed on, over the "
         "vessel's diameter without plaque."},
        {"Balloons burst", "", count(score.bursts), ""},
        {"Dissections by a balloon", "",
         score.dissections_left > 0
             ? fmt::format("{}, {} without a stent", score.dissections, score.dissections_left)
             : count(score.dissections),
         "Tears of the wall; a stent holds the flap."},
        {"Ruptures", "", count(score.ruptures), "Of the wall, by a balloon."},
    };
}

std::optional<double> narrowest_lumen(const Simulation& simulation) {
    const Treatment& treatment = simulation.treatment();
    if (treatment.lesions().empty()) return {};
    const Lesion& first = treatment.lesions().front();
    return lumen_of(treatment.stretch_of(first), first.places, &OpenedPlace::radius).lumen;
}

std::optional<double> iodine_in_lesion(const Simulation& simulation) {
    const Treatment& treatment = simulation.treatment();
    if (treatment.lesions().empty()) return {};
    const Lesion& first = treatment.lesions().front();
    const BranchStretch& stretch = treatment.stretch_of(first);
    const blood::ContrastFlow& contrast = simulation.contrast();
    double sum = 0;
    for (const std::size_t k : {std::size_t{0}, stretch.axis.size() / 2, stretch.axis.size() - 1})
        if (const int cell = contrast.blood().nearest_in(first.branch, stretch.axis[k]); cell >= 0)
            sum += contrast.iodine()[static_cast<std::size_t>(cell)] / 3;
    return sum + simulation.iodine();
}

std::optional<double> pressure_drop(const Simulation& simulation) {
    const Treatment& treatment = simulation.treatment();
    if (treatment.lesions().empty()) return {};
    const Lesion& first = treatment.lesions().front();
    const blood::BloodFlow& flow = simulation.contrast().blood();
    const blood::Across cells = cells_across(flow, first, treatment.stretch_of(first));
    if (!cells.known()) return {};
    return blood::mean_pressure_in(flow, cells.before) - blood::mean_pressure_in(flow, cells.behind);
}

}  // namespace exercise
