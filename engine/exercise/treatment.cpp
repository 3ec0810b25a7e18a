#include "engine/exercise/treatment.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>

#include "engine/exercise/device_rules.h"
#include "engine/exercise/treatment_along.h"
#include "engine/io/text.h"

namespace exercise {
namespace {

using geometry::Vec3;
using physics::OpenedPlace;

constexpr double spacing = physics::Narrowing::spacing;
constexpr double same_place = 0.75;  // a place of a lesion and one of a device as near along the chain [mm]
constexpr double seals = 0.97;       // of the lumen's radius, from which a balloon lets no blood by [-]
constexpr double apart = 15;         // of two tears of a vessel [mm]
constexpr double passes = 1;         // pressure by which a device may squeeze plaque aside [atm]
constexpr double drawn = 1;          // an inflation is one from here on [atm]

OpenedPlace healthy(double radius) {
    OpenedPlace place;
    place.reference = place.before = place.radius = place.largest = radius;
    return place;
}

physics::PlaqueLaw plaque_of(const scenario::LesionSpec& spec) {
    return physics::law_of(spec.plaque);
}

double crimped_length(const scenario::Stent& stent) {
    return stent.length / (1 - stent.foreshortening);
}

/// Part of the whole expansion [-].
double expanded(const PlacedStent& stent, double crimped_radius) {
    double sum = 0;
    for (const PlacedStent::Sample& sample : stent.samples) sum += sample.place.stent;
    const double mean = sum / static_cast<double>(std::max<std::size_t>(1, stent.samples.size()));
    return std::clamp((mean - crimped_radius) / std::max(1e-9, 0.5 * stent.spec.diameter - crimped_radius),
                      0.0, 1.0);
}

}  // namespace

std::vector<std::string> Treatment::problems(const scenario::Scenario& scenario,
                                             const anatomy::Anatomy& anatomy) {
    std::vector<std::string> found;
    for (const scenario::PlacedDevice& placed : scenario.devices)
        for (const std::string& name : placed.tray) {
            try {
                static_cast<void>(device_of_catalogue(placed.role, name, scenario));
            } catch (const io::InputError& error) {
                found.push_back(io::located(scenario.place(placed.section + ".tray"), error.what()));
            }
        }
    for (std::size_t n = 0; n < scenario.lesions.size(); ++n) {
        const scenario::LesionSpec& spec = scenario.lesions[n];
        if (const std::string wrong = stretch_problem(anatomy, spec.branch, spec.at, spec.length, "lesion");
            !wrong.empty())
            found.push_back(io::located(scenario.place(fmt::format("lesion {}.at_mm", n + 1)), wrong));
    }
    return found;
}

void Treatment::start(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy) {
    *this = {};
    for (std::size_t n = 0; n < scenario.lesions.size(); ++n)
        lesions_.push_back(
            {static_cast<int>(n), *anatomy::branch_named(anatomy, scenario.lesions[n].branch), {}});
    find_places(scenario, anatomy);
    for (std::size_t n = 0; n < lesions_.size(); ++n) {
        const BranchStretch& stretch = stretches_[n];
        for (std::size_t k = 0; k < stretch.axis.size(); ++k) {
            OpenedPlace place = healthy(stretch.lumen[k]);
            place.before = place.radius = place.largest =
                stretch.lumen[k] * (1 - specs_[n].percent / 100 * stretch.shape[k]);
            lesions_[n].places.push_back(place);
        }
    }
    if (const auto balloon = scenario.index_of(script::DeviceRole::Balloon))
        take(scenario.devices[static_cast<std::size_t>(*balloon)].device.name);
}

void Treatment::take(const std::string& device) {
    inflation_.assign(1, Inflation());
    inflation_.front().device = device;
}

void Treatment::find_places(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy) {
    stretches_.clear();
    specs_.clear();
    for (const Lesion& lesion : lesions_) {
        const scenario::LesionSpec& spec = scenario.lesions[static_cast<std::size_t>(lesion.spec)];
        specs_.push_back(spec);
        stretches_.push_back(exercise::stretch_of(anatomy, lesion.branch, spec.at, spec.length));
    }
}

std::string Treatment::problem_with_inflation(double pressure, const physics::Chain& chain, int which,
                                              const scenario::Device& device) const {
    if (!device.balloon) return fmt::format("the {} has no balloon", device.title);
    if (pressure == 0) return {};
    if (inflation_.front().burst) return "the balloon has burst; exchange it for another";
    const Along along(chain, which, &device);
    const scenario::Balloon& balloon = *device.balloon;
    if (along.tip() < balloon.from_tip + balloon.length + balloon.cone)
        return fmt::format("{:.0f} mm of the balloon are not inside yet",
                           balloon.from_tip + balloon.length + balloon.cone - along.tip());
    if (const double in = along.covered_of(balloon.from_tip - balloon.cone,
                                           balloon.from_tip + balloon.length + balloon.cone);
        in > 0)
        return fmt::format("{:.0f} mm of the balloon are still in the device around it", std::max(1.0, in));
    return {};
}

std::string Treatment::problem_with_sheath(const physics::Chain& chain, int which,
                                           const scenario::Device& device) const {
    if (!device.stent || !device.stent->law.self_expanding)
        return fmt::format("the {} has no stent in a sheath", device.title);
    if (inflation_.front().uncovered >= crimped_length(*device.stent)) return "the stent has left its sheath";
    const Along along(chain, which, &device);
    const scenario::Stent& stent = *device.stent;
    const double end = stent.from_tip + crimped_length(stent);
    if (along.tip() < end) return fmt::format("{:.0f} mm of the stent are not inside yet", end - along.tip());
    if (const double in = along.covered_of(stent.from_tip, end); in > 0)
        return fmt::format("{:.0f} mm of the stent are still in the device around it", std::max(1.0, in));
    return {};
}

std::string Treatment::problem_with_motion() const {
    if (inflation_.empty()) return {};
    const Inflation& inflation = inflation_.front();
    const bool touches = std::ranges::any_of(lesions_, [](const Lesion& l) {
        return std::ranges::any_of(l.places, [](const OpenedPlace& p) { return p.contact > 0; });
    });
    if (inflation.inflated() && (touches || inflation.plugs >= 0))
        return "the inflated balloon fills its vessel; deflate it first";
    for (const PlacedStent& stent : stents_)
        if (stent.attached && stent.spec.law.self_expanding)
            return "the stent is half out of its sheath and holds the wall; retrieve the rest of the sheath "
                   "first";
    return {};
}

std::optional<std::pair<int, int>> Treatment::lesion_at(const Along&, double arc) const {
    std::optional<std::pair<int, int>> found;
    double best = same_place;
    for (std::size_t n = 0; n < arcs_.size(); ++n)
        for (std::size_t k = 0; k < arcs_[n].size(); ++k)
            if (const double away = std::abs(arcs_[n][k] - arc); away < best)
                best = away, found = {static_cast<int>(n), static_cast<int>(k)};
    return found;
}

const physics::StentLaw* Treatment::stent_in(int lesion, int place) const {
    if (lesions_[static_cast<std::size_t>(lesion)].places[static_cast<std::size_t>(place)].stent <= 0)
        return nullptr;
    const physics::StentLaw* found = nullptr;
    for (const PlacedStent& stent : stents_)
        for (const PlacedStent::Sample& sample : stent.samples)
            if (sample.lesion == lesion && std::abs(sample.lesion_place - place) <= 1)
                found = &stent.spec.law;
    return found;
}

void Treatment::change_pressure(double seconds, const Along& along, int frame) {
    const scenario::Device& device = along.device();
    Inflation& now = inflation_.front();
    if (!device.balloon || now.burst) {
        now.wanted = now.pressure = 0;
    } else if (now.wanted > now.pressure) {
        if (now.pressure < drawn && std::min(now.wanted, now.pressure + inflation_rate * seconds) >= drawn)
            ++tally_.inflations;
        now.pressure = std::min(now.wanted, now.pressure + inflation_rate * seconds);
    } else if (now.wanted < now.pressure) {
        const double rate = device.balloon->nominal / std::max(0.1, device.balloon->deflation);
        now.pressure = std::max(now.wanted, now.pressure - rate * seconds);
    }
    tally_.highest = std::max(tally_.highest, now.pressure);
    if (device.balloon && !now.burst && now.pressure > bursts_at * device.balloon->rated) {
        TreatmentEvent event;
        event.kind = TreatmentEvent::Kind::Burst;
        event.frame = frame;
        event.pressure = now.pressure;
        event.place =
            along.point(std::max(0.0, along.tip() - device.balloon->from_tip - 0.5 * device.balloon->length));
        constexpr double cubic_mm_per_ml = 1000;
        for (const double r : now.radii)
            event.volume += std::numbers::pi * r * r * physics::Bulge::spacing / cubic_mm_per_ml;
        events_.push_back(event);
        now.burst = true;
        now.wanted = now.pressure = 0;
    }
    if (device.stent && device.stent->law.self_expanding)
        now.uncovered =
            std::min({now.to_uncover, now.uncovered + sheath_speed * seconds, crimped_length(*device.stent)});
}

bool Treatment::move_lesions(const Along& along, double most) {
    bool changed = false;
    arcs_.assign(lesions_.size(), {});
    for (std::size_t n = 0; n < lesions_.size(); ++n) {
        const physics::PlaqueLaw plaque = plaque_of(specs_[n]);
        for (std::size_t k = 0; k < lesions_[n].places.size(); ++k) {
            OpenedPlace& place = lesions_[n].places[k];
            const double arc = along.arc_of(stretches_[n].axis[k], BranchStretch::uneven * place.reference);
            arcs_[n].push_back(arc);
            physics::Loads loads;
            if (!std::isnan(arc) && arc < along.length()) loads = along.loads(arc, inflation());
            loads.stent = stent_in(static_cast<int>(n), static_cast<int>(k));
            const OpenedPlace before = place;
            physics::open_place(place, plaque, {}, loads, most);
            changed = changed || place != before;
        }
    }
    return changed;
}

bool Treatment::move_stents(const Along& along, double most) {
    bool changed = false;
    for (PlacedStent& stent : stents_)
        for (PlacedStent::Sample& sample : stent.samples) {
            const OpenedPlace before = sample.place;
            if (sample.lesion >= 0) {
                sample.place = lesions_[static_cast<std::size_t>(sample.lesion)]
                                   .places[static_cast<std::size_t>(sample.lesion_place)];
            } else {
                const double arc = along.arc_of(sample.at, BranchStretch::uneven * sample.place.reference);
                physics::Loads loads;
                if (!std::isnan(arc) && arc < along.length()) loads = along.loads(arc, inflation());
                loads.stent = &stent.spec.law;
                physics::open_place(sample.place, {}, {}, loads, most);
            }
            changed = changed || sample.place != before;
        }
    return changed;
}

void Treatment::add_sample(PlacedStent& stent, const Along& along, double arc, double radius,
                           const blood::BloodFlow& blood) {
    PlacedStent::Sample sample;
    sample.at = along.point(arc);
    if (const auto place = lesion_at(along, arc)) {
        sample.lesion = place->first, sample.lesion_place = place->second;
        OpenedPlace& opened =
            lesions_[static_cast<std::size_t>(place->first)].places[static_cast<std::size_t>(place->second)];
        opened.stent = std::max(opened.stent, std::min(radius, opened.radius));
        sample.place = opened;
    } else {
        sample.place = healthy(blood.cells[static_cast<std::size_t>(blood.nearest(sample.at))].radius);
        sample.place.stent = std::min(radius, sample.place.radius);
    }
    stent.samples.push_back(sample);
}

/// A stent that leaves its balloon keeps its middle, one that leaves its sheath its distal end.
void Treatment::place_stent(const Along& along, const blood::BloodFlow& blood, int frame) {
    Inflation& now = inflation_.front();
    const scenario::Device& device = along.device();
    if (!device.stent) return;
    const scenario::Stent& spec = *device.stent;
    const double length = crimped_length(spec), crimped = folded_radius(device);
    const bool begins = spec.law.self_expanding ? now.uncovered > 0 : now.pressure >= spec.law.opens_at;
    if (!now.deployed && begins) {
        now.deployed = true;
        stents_.push_back({device.name, spec, frame, true, {}});
        TreatmentEvent event;
        event.kind = TreatmentEvent::Kind::Deployed;
        event.frame = frame;
        event.pressure = now.pressure;
        event.place = along.point(along.tip() - spec.from_tip - 0.5 * length);
        events_.push_back(event);
    }
    if (stents_.empty() || !stents_.back().attached) return;
    PlacedStent& stent = stents_.back();
    if (spec.law.self_expanding) {
        const double first =
            stent.samples.empty() ? along.tip() - spec.from_tip : along.arc_of(stent.samples.front().at, 50);
        while (!std::isnan(first) &&
               static_cast<double>(stent.samples.size()) * spacing <= now.uncovered + 1e-9) {
            const double apart = spacing * (1 - spec.foreshortening);
            const double arc = first - apart * static_cast<double>(stent.samples.size());
            if (arc <= 0) break;
            add_sample(stent, along, arc, spec.law.free_radius, blood);
        }
        if (now.uncovered >= length) stent.attached = false;
        return;
    }
    if (now.pressure <= 0) {
        stent.attached = false;
        return;
    }
    // It is as long as its mean expansion leaves it; what has opened stays as wide as it is.
    const double shorter = length * (1 - spec.foreshortening * expanded(stent, crimped)),
                 middle = along.tip() - spec.from_tip - 0.5 * length;
    const int count = static_cast<int>(std::floor(length / spacing)) + 1;
    std::vector<double> radii;
    for (const PlacedStent::Sample& sample : stent.samples) radii.push_back(sample.place.stent);
    std::vector<OpenedPlace> places;
    for (const PlacedStent::Sample& sample : stent.samples) places.push_back(sample.place);
    stent.samples.clear();
    for (int k = 0; k < count; ++k) {
        const double arc = middle + shorter * (0.5 - static_cast<double>(k) / (count - 1));
        const auto n = static_cast<std::size_t>(k);
        add_sample(stent, along, std::clamp(arc, 1e-6, along.length()), n < radii.size() ? radii[n] : crimped,
                   blood);
        PlacedStent::Sample& sample = stent.samples.back();
        if (sample.lesion < 0 && n < places.size()) {
            sample.place.stent = radii[n];
            sample.place.radius = std::max(sample.place.reference, places[n].radius);
            sample.place.largest = places[n].largest;
        }
    }
}

void Treatment::tear(const TreatmentEvent& at, double dissects) {
    const auto add = [&](TreatmentEvent::Kind kind) {
        for (const TreatmentEvent& other : events_)
            if (other.kind == kind && other.branch == at.branch && std::abs(other.along - at.along) < apart)
                return;
        events_.push_back(at);
        events_.back().kind = kind;
    };
    if (at.ratio >= dissects) add(TreatmentEvent::Kind::Dissection);
    if (at.ratio >= ruptures_at) add(TreatmentEvent::Kind::Rupture);
}

/// The balloon is as wide as it would be in air, or as what is around it.
bool Treatment::fill_balloon(const Along& along, const blood::BloodFlow& blood,
                             const anatomy::Anatomy& anatomy, int frame) {
    Inflation& now = inflation_.front();
    if (!along.balloon()) return false;
    const scenario::Balloon& balloon = *along.balloon();
    const std::vector<double> before = now.radii;
    const int count =
        static_cast<int>(std::ceil((balloon.length + 2 * balloon.cone) / physics::Bulge::spacing)) + 1;
    const double folded = folded_radius(along.device());
    now.radii.resize(static_cast<std::size_t>(count), folded);
    now.plugs = -1;
    for (int k = 0; k < count; ++k) {
        double& radius = now.radii[static_cast<std::size_t>(k)];
        const double from_tip = balloon.from_tip - balloon.cone + k * physics::Bulge::spacing;
        const double arc = along.tip() - from_tip;
        double wanted = folded;
        if (arc > 0 && arc < along.length() + 1e-6 && now.inflated()) {
            physics::Loads loads = along.loads(arc, &now);
            const Vec3 at = along.point(arc);
            const auto lesion = lesion_at(along, arc);
            const blood::FlowCell& cell = blood.cells[static_cast<std::size_t>(blood.nearest(at))];
            OpenedPlace place = healthy(cell.radius);
            TreatmentEvent tears;
            tears.frame = frame, tears.pressure = now.pressure, tears.branch = cell.branch, tears.place = at;
            double dissects = dissects_at;
            if (lesion) {
                const auto n = static_cast<std::size_t>(lesion->first),
                           p = static_cast<std::size_t>(lesion->second);
                place = lesions_[n].places[p];
                if (specs_[n].plaque == physics::Plaque::Calcified) dissects = dissects_calcified_at;
                tears.branch = lesions_[n].branch, tears.along = stretches_[n].arc[p];
                tears.outward = stretches_[n].side[p];
            } else {
                place.radius = physics::balanced_radius(place, {}, {}, loads);
                const Vec3 aside = along.tangent(arc).cross(Vec3::UnitY());
                tears.outward = aside.norm() > 1e-6 ? Vec3(aside.normalized()) : Vec3(Vec3::UnitX());
                tears.along = arc_on_branch(anatomy, cell.branch, at);
            }
            const double blown =
                loads.balloon ? 0.5 * loads.fraction * balloon.law.diameter(now.pressure) : 0.0;
            wanted = std::max(folded, std::min(blown, place.radius));
            const bool touches = physics::contact_pressure(loads, place.radius) > 0;
            if (touches) {
                tears.ratio = place.radius / place.reference;
                if (now.pressure >= drawn) tally_.largest_ratio = std::max(tally_.largest_ratio, tears.ratio);
                tear(tears, dissects);
            }
            if (radius >= seals * place.radius && now.plugs < 0) now.plugs = tears.branch, now.plug = at;
        }
        radius = std::clamp(wanted, radius - largest_move, radius + largest_move);
    }
    const double middle = along.tip() - balloon.from_tip - 0.5 * balloon.length;
    const bool inside = middle > 0 && middle < along.length();
    const int branch =
        inside ? blood.cells[static_cast<std::size_t>(blood.nearest(along.point(middle)))].branch : -1;
    return lay_sleeve(along, anatomy, branch) || now.radii != before;
}

void Treatment::count(double seconds, const scenario::Device& device) {
    const Inflation& now = inflation_.front();
    if (now.pressure >= drawn) tally_.seconds += seconds;
    if (device.balloon && now.pressure > device.balloon->rated) tally_.beyond_rated += seconds;
    if (now.plugs >= 0) {
        tally_.occluded += seconds;
        tally_.without_break += seconds;
        tally_.longest = std::max(tally_.longest, tally_.without_break);
    } else {
        tally_.without_break = 0;
    }
}

bool Treatment::step(double seconds, int frame, const physics::Chain& chain, int balloon,
                     const scenario::Device* device, const blood::BloodFlow& blood,
                     const anatomy::Anatomy& anatomy) {
    if (!given()) return false;
    const double most = std::min(fastest * seconds, largest_move);
    const bool has = balloon >= 0 && device && !inflation_.empty();
    const Along along(chain, has ? balloon : -1, has ? device : nullptr);
    if (has) change_pressure(seconds, along, frame);
    bool changed = move_lesions(along, most);
    if (has) place_stent(along, blood, frame);
    changed = move_stents(along, most) || changed;
    if (has) changed = fill_balloon(along, blood, anatomy, frame) || changed;
    if (has) count(seconds, *device);
    return changed;
}

std::vector<physics::Bulge> Treatment::bulge(const scenario::Device& device) const {
    if (inflation_.empty() || !device.balloon) return {};
    const Inflation& now = inflation_.front();
    const scenario::Balloon& balloon = *device.balloon;
    physics::Bulge bulge;
    bulge.from_tip = balloon.from_tip - balloon.cone;
    bulge.radii = now.radii;
    bulge.folded = folded_radius(device);
    if (bulge.radii.empty())
        bulge.radii.assign(static_cast<std::size_t>(
                               std::ceil((balloon.length + 2 * balloon.cone) / physics::Bulge::spacing)) +
                               1,
                           folded_radius(device));
    bulge.rigidity = balloon.rigidity * std::clamp(now.pressure / balloon.nominal, 0.0, 1.0);
    return {bulge};
}

std::vector<physics::Narrowing> Treatment::narrowings() const {
    std::vector<physics::Narrowing> made;
    for (std::size_t n = 0; n < lesions_.size(); ++n) {
        const BranchStretch& stretch = stretches_[n];
        const scenario::LesionSpec& spec = specs_[n];
        const physics::PlaqueLaw plaque = plaque_of(spec);
        physics::Narrowing narrowing;
        bool narrow = false;
        for (std::size_t k = 0; k < stretch.axis.size(); ++k) {
            const OpenedPlace& place = lesions_[n].places[k];
            const double lost = place.reference - place.before, closed = place.reference - place.radius;
            const double part = lost > 1e-6 ? std::clamp(closed / lost, 0.0, 1.0) : 0.0;
            physics::Narrowing::Sample sample = stretch.sample(k, place.before, part);
            if (part > 0) {
                sample.aside = aside_of(spec, stretch, k, closed);
                sample.lumen += spec.eccentricity * closed;
                // A device that squeezes it aside is held; what a stent holds presses on no device.
                if (place.contact == 0 && place.radius <= place.device + 1e-6)
                    sample.pressure = physics::atmosphere * plaque.pressure(place, place.radius);
                sample.gives = place.reference * std::min(passes, plaque.yield) / plaque.stiffness;
            }
            sample.wider = std::max(0.0, -closed);
            narrow = narrow || part > 0 || sample.wider > 0;
            narrowing.samples.push_back(sample);
        }
        if (narrow) made.push_back(std::move(narrowing));
    }
    if (inflation() && !inflation()->sleeve.empty()) made.push_back({inflation()->sleeve});
    return made;
}

std::vector<blood::Obstruction> Treatment::obstructions() const {
    std::vector<blood::Obstruction> made;
    for (std::size_t n = 0; n < lesions_.size(); ++n) {
        std::vector<double> radii;
        for (const OpenedPlace& place : lesions_[n].places) {
            // What lies in it leaves as much less of its section.
            constexpr double least = 0.05;  // [mm]
            radii.push_back(std::sqrt(
                std::max(least * least, place.radius * place.radius - place.device * place.device)));
        }
        made.push_back(stretches_[n].obstruction(lesions_[n].branch, radii));
    }
    if (occluded()) {
        blood::Obstruction plug;
        plug.branch = inflation()->plugs;
        plug.from = plug.middle = inflation()->plug;
        plug.passes = 0;
        made.push_back(plug);
    }
    return made;
}

bool Treatment::has_opened(double residual) const {
    if (inflation() && inflation()->inflated()) return false;
    return std::ranges::all_of(lesions_, [residual](const Lesion& lesion) {
        return std::ranges::all_of(lesion.places, [residual](const OpenedPlace& place) {
            return place.radius >= (1 - residual / 100) * place.reference;
        });
    });
}

Treatment Treatment::as_seen() const {
    Treatment seen = *this;
    for (Inflation& inflation : seen.inflation_) inflation.sleeve.clear();
    for (Lesion& lesion : seen.lesions_)
        for (OpenedPlace& place : lesion.places) {
            place.radius = place.before + seen_step * std::round((place.radius - place.before) / seen_step);
            place.contact = place.device = place.stent = 0;
            place.largest = place.radius;
        }
    return seen;
}

void Treatment::state(geometry::StateStream& s) {
    s.unless_empty(lesions_);
    s.unless_empty(stents_);
    s.unless_empty(inflation_);
    s.unless_empty(events_);
    if (given()) s(tally_);
}

}  // namespace exercise
