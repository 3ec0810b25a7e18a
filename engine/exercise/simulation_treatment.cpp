/// What a simulation does with balloons and stents.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>

#include "engine/anatomy/organs.h"
#include "engine/exercise/simulation.h"
#include "physics/wall/foundation.h"

namespace exercise {

using geometry::Vec3;

namespace {

constexpr double tear_length = 12, tear_percent = 50;  // of a flap (estimates) [mm]
constexpr double rupture_width = 2;                    // of the hole that a rupture is (estimate) [mm]
constexpr double burst_rate = 20;                      // at which a burst balloon empties (estimate) [ml/s]
constexpr double covers = 1.5;  // radii from a stent in which it holds a flap to the wall [-]

}  // namespace

int Simulation::balloon() const {
    return scenario_.index_of(script::DeviceRole::Balloon).value_or(-1);
}

void Simulation::inflate(double pressure) {
    const int which = balloon();
    if (const std::string why =
            treatment_.problem_with_inflation(pressure, chain(), which, devices_[which].device);
        !why.empty()) {
        denied_ = "Nothing was inflated: " + why;
        return;
    }
    treatment_.inflate(pressure);
}

void Simulation::deploy() {
    const scenario::Device& device = devices_[balloon()].device;
    if (!device.stent)
        denied_ = fmt::format("Nothing was deployed: the {} has no stent", device.title);
    else if (device.stent->law.self_expanding)
        retrieve_sheath(device.stent->length / (1 - device.stent->foreshortening));
    else if (treatment_.inflation()->deployed)
        denied_ = "Nothing was deployed: the stent has left its balloon";
    else
        inflate(device.balloon->nominal);
}

void Simulation::retrieve_sheath(double length) {
    const int which = balloon();
    if (const std::string why = treatment_.problem_with_sheath(chain(), which, devices_[which].device);
        !why.empty()) {
        denied_ = "The sheath was not retrieved: " + why;
        return;
    }
    treatment_.retrieve(length);
}

/// Folded, or as the treatment has it.
void Simulation::prepare_balloon(physics::Chain& chain) const {
    const int which = balloon();
    if (which < 0) return;
    chain.devices[which].bulge = treatment_.bulge(devices_[which].device);
    physics::assign(chain);
}

/// The chain, at rest, where it would lie in vessels that it had not pushed aside.
physics::Chain Simulation::among_unmoved_vessels() const {
    physics::Chain chain = moving_;
    const auto by = displacement();
    if (!by) return chain;
    for (std::size_t j = 0; j < chain.joints.size(); ++j)
        chain.joints[j] -= wall_->foundation()->at(*by, chain.stations[j], moving_.joints[j]);
    for (std::size_t i = 1; i < chain.joints.size(); ++i)
        chain.tangents[i] = (chain.joints[i] - chain.joints[i - 1]).normalized();
    return chain;
}

geometry::Polyline Simulation::axis_now(const PlacedStent& stent) const {
    geometry::Polyline axis;
    const auto by = displacement();
    for (const PlacedStent::Sample& sample : stent.samples) {
        axis.push_back(place_now(sample.at));
        if (!by) continue;
        const physics::Foundation& foundation = *wall_->foundation();
        axis.back() += foundation.at(*by, foundation.tree().locate(sample.at, -1), sample.at);
    }
    return axis;
}

/// By a frame. Whether vessels or devices are others now.
bool Simulation::treat() {
    const int which = balloon();
    if (!treatment_.step(1 / scenario_.frame_rate, frames_, among_unmoved_vessels(), which,
                         which < 0 ? nullptr : &devices_[which].device, contrast_->blood(), *anatomy_))
        return false;
    prepare_balloon(moving_);
    return true;
}

/// A torn wall has a flap, one that is torn through a hole; a balloon that bursts lets its contrast into the
/// blood.
void Simulation::follow_events(std::size_t from, StepReport& report) {
    for (const TreatmentEvent& event : treatment_.events().subspan(from)) {
        report.treated.push_back(event);
        using Kind = TreatmentEvent::Kind;
        const auto in_branch = [&] {
            return anatomy_->branches[static_cast<std::size_t>(event.branch)].name;
        };
        if (event.kind == Kind::Dissection) {
            const script::Complicate flap{script::ComplicationKind::Dissection, in_branch(), event.along,
                                          tear_length, tear_percent};
            if (Complications::problem(flap, *anatomy_).empty())
                complications_.set(flap, *anatomy_, frames_, [](const Complication&) { return true; });
        } else if (event.kind == Kind::Rupture) {
            contrast_->pierce(event.place, event.outward, rupture_width);
        } else if (event.kind == Kind::Burst && event.volume > 0) {
            contrast_->inject({event.place, burst_rate, event.volume, Treatment::iodine_in_balloon});
        }
    }
    relieve_stented();
}

/// A stent holds the flaps to the wall that it lies over.
void Simulation::relieve_stented() {
    if (treatment_.stents().empty()) return;
    for (std::size_t n = 0; n < complications_.all().size(); ++n) {
        const Complication& c = complications_.all()[n];
        if (c.kind != script::ComplicationKind::Dissection || !c.set()) continue;
        const BranchStretch flap = stretch_of(*anatomy_, c.branch, c.at, c.over);
        const std::size_t middle = flap.axis.size() / 2;
        const auto holds = [&](const PlacedStent::Sample& sample) {
            return (sample.at - flap.axis[middle]).norm() < covers * flap.lumen[middle] &&
                   sample.place.stent > 0.9 * sample.place.reference;
        };
        if (std::ranges::any_of(treatment_.stents(), [&](const PlacedStent& stent) {
                return std::ranges::any_of(stent.samples, holds);
            }))
            complications_.relieve(n, frames_);
    }
}

std::string sentence(const TreatmentEvent& event, const anatomy::Anatomy& anatomy) {
    using Kind = TreatmentEvent::Kind;
    const std::string where =
        event.branch < 0
            ? ""
            : anatomy::clinical_name(anatomy.branches[static_cast<std::size_t>(event.branch)].name);
    switch (event.kind) {
        case Kind::Burst:
            return fmt::format("The balloon has burst at {:.1f} atm", event.pressure);
        case Kind::Dissection:
            return fmt::format(
                "The wall of the {} has torn {:.0f} mm from its origin: the balloon opened it to "
                "{:.2f} times its diameter",
                where, event.along, event.ratio);
        case Kind::Rupture:
            return fmt::format(
                "The {} has ruptured {:.0f} mm from its origin: the balloon opened it to {:.2f} "
                "times its diameter",
                where, event.along, event.ratio);
        case Kind::Deployed:
            return "The stent begins to open";
    }
    return {};
}

}  // namespace exercise
