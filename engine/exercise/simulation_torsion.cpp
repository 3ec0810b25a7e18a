/// How a simulation decides anew what its shafts are.

#include <fmt/format.h>

#include "engine/exercise/device_rules.h"
#include "engine/exercise/simulation.h"
#include "physics/wire/energy.h"

namespace exercise {

/// Of a chain that is laid, in place of one with this device: by what the scenario says, or as it was.
bool Simulation::twists_by_segments(const physics::Device* before) const {
    if (scenario_.torsion == scenario::TorsionModel::Auto) return before && before->twists_by_segments();
    return scenario_.torsion == scenario::TorsionModel::Segments;
}

scenario::ShaftState Simulation::shaft(int which) const {
    const physics::Device& device = moving_.devices[which];
    const physics::DeviceSpec spec = spec_of(scenario_, devices_[which].device);
    const auto loads = hub_->loads();
    // What rubs on hubs winds up no shaft here.
    std::vector<physics::HubLoad> rubs(loads.size());
    if (!loads.empty()) physics::add_rubs(moving_, hub_->contacts(), rubs);
    return {device.inserted,
            device.outside,
            loads.empty() ? 0.0 : loads[which].torque - rubs[which].torque,
            physics::held_back(moving_, which, spec),
            device.wound_up(),
            physics::torsion_of(device)};
}

scenario::TorsionNeed Simulation::torsion_need(int which) const {
    if (!hub_) return {};
    scenario::Device device = devices_[which].device;
    static_cast<physics::DeviceSpec&>(device) = spec_of(scenario_, device);
    return scenario::torsion_need(device, shaft(which), reach_->around(moving_, which));
}

std::string Simulation::torsion_sentence(int which) const {
    return fmt::format("the {}'s shaft {}", devices_[which].name(),
                       scenario::torsion_sentence(torsion_need(which), torsion(which)));
}

double Simulation::energy() const {
    return physics::total_energy(moving_, hub_->contacts()).total() + moving_.friction_loss;
}

/// Gives every shaft the least model that it needs where it is; of a chain at rest, which then is no more.
/// Returns whether one is another now, with what there is to say about it.
bool Simulation::renew_torsion(std::vector<std::string>* said) {
    if (scenario_.torsion != scenario::TorsionModel::Auto) return false;
    std::vector<scenario::TorsionNeed> needs;
    std::vector<physics::Torsion> next;
    for (int k = 0; k < static_cast<int>(devices_.size()); ++k) {
        needs.push_back(torsion_need(k));
        next.push_back(devices_[k].device.twists() ? scenario::least_torsion(needs[k], shaft(k))
                                                   : physics::Torsion::Rigid);
    }
    bool changed = false;
    for (int k = 0; k < static_cast<int>(devices_.size()); ++k) {
        if (next[k] == physics::torsion_of(moving_.devices[k])) continue;
        physics::change_torsion(moving_, k, spec_of(scenario_, devices_[k].device), next[k]);
        ++model_changes_.count;
        changed = true;
        if (said)
            said->push_back(fmt::format("the {}'s shaft {}", devices_[k].name(),
                                        scenario::torsion_sentence(needs[k], next[k])));
    }
    return changed;
}

/// Of shafts and vessels in a frame, with the way to rest.
void Simulation::renew_models(StepReport& report) {
    const double before = energy();
    const bool shafts = renew_torsion(&report.torsions), vessels = renew_vessels(&report.vessels);
    if (!shafts && !vessels) return;
    model_changes_.energy = before;
    account(hub_->settle(moving_, updates_left(report)), report);
    count_released();
}

/// Once the chain is at rest.
void Simulation::count_released() {
    if (!model_changes_.energy || !hub_is_idle()) return;
    model_changes_.released += *model_changes_.energy - energy();
    model_changes_.energy.reset();
}

}  // namespace exercise
