#include "engine/exercise/trace.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/io/csv.h"
#include "physics/geometry/vec.h"
#include "physics/wire/energy.h"

namespace exercise {
namespace {

constexpr double absent = std::numeric_limits<double>::quiet_NaN();  // an empty cell

}  // namespace

Trace::Trace(const Simulation& simulation)
    : ways_(simulation.anatomy()),
      target_(anatomy::nearest_place(simulation.anatomy(), simulation.target())) {}

std::string Trace::header() {
    return "frame,time_s,device,inserted_mm,turned_deg,tip_x_mm,tip_y_mm,tip_z_mm,direction_x,direction_y,"
           "direction_z,"
           "branch,along_branch_mm,left_to_target_mm,push_N,torque_N_mm,tip_force_N,wall_force_N,contacts,"
           "friction_loss_N_mm,settling,air_kerma_mGy\n";
}

std::string Trace::rows(const Frame& frame, const Score& score) {
    const Simulation& simulation = frame.simulation;
    const physics::Guidewire& wire = simulation.wire();
    const StepReport& report = frame.motion;
    if (report.reset) wire_ = catheter_ = {};
    wire_.turned += report.turned;
    catheter_.turned += report.catheter_turned;
    // A frame that asked nothing of the relaxer leaves the hands' forces as they were.
    if (report.relax.at_rest) {
        if (wire.devices.empty()) {
            wire_.load = {physics::hand_force(wire, report.relax.push_force), report.relax.base_torque};
        } else {
            const auto loads = physics::hub_loads(wire, simulation.contacts());
            wire_.load = loads[Simulation::wire_device];
            catheter_.load = loads[Simulation::catheter_device];
        }
    }
    std::string text = row(script::Held::Wire, wire_, frame, score);
    if (simulation.has_catheter()) text += row(script::Held::Catheter, catheter_, frame, score);
    return text;
}

std::string Trace::row(script::Held held, const Hand& hand, const Frame& frame, const Score& score) const {
    const Simulation& simulation = frame.simulation;
    const physics::Guidewire& wire = simulation.wire();
    const anatomy::Anatomy& anatomy = simulation.anatomy();
    const bool inside = simulation.inserted(held) > 0;
    const Simulation::Tip tip = simulation.tip_of(held);
    const anatomy::VesselPlace place = anatomy::nearest_place(anatomy, tip.at);
    const geometry::CentrelineBranch& branch = anatomy.branches[place.branch];
    const geometry::Vec3 at = tip.at + simulation.vessel_shift();
    const auto contacts = simulation.contacts();
    // Contacts of the joints that the device bears: those that it is outermost at.
    const double reach = simulation.inserted(script::Held::Catheter);
    double s = 0, largest = 0, tip_force = 0;
    int touching = 0;
    for (std::size_t j = 1; j < contacts.size(); ++j) {
        s += wire.lengths[j];
        const bool catheters = simulation.has_catheter() && s <= reach + 1e-9;
        if (catheters != (held == script::Held::Catheter)) continue;
        largest = std::max(largest, contacts[j].force());
        touching += contacts[j].touches();
        tip_force = contacts[j].force();
    }
    const auto or_absent = [inside](double value) { return inside ? value : absent; };
    const std::vector<io::CsvCell> cells = {
        static_cast<double>(frame.time.index),
        frame.time.seconds,
        std::string(script::held_names[static_cast<std::size_t>(held)]),
        simulation.inserted(held),
        hand.turned / geometry::degree,
        or_absent(at.x()),
        or_absent(at.y()),
        or_absent(at.z()),
        or_absent(tip.along.x()),
        or_absent(tip.along.y()),
        or_absent(tip.along.z()),
        inside ? branch.name : std::string(),
        or_absent(geometry::length_of(std::span(branch.points).first(place.sample + 1))),
        or_absent(ways_.between(place, target_).value_or(absent)),
        hand.load.push,
        hand.load.torque,
        tip_force,
        largest,
        static_cast<double>(touching),
        wire.friction_loss,
        frame.motion.settling ? 1.0 : 0.0,
        score.air_kerma.value_or(absent)};
    std::string text;
    io::append_row(text, cells);
    return text;
}

}  // namespace exercise
