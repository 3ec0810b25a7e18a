#include "engine/exercise/trace.h"

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
    : target_(anatomy::nearest_place(simulation.anatomy(), simulation.target())) {}

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
    if (report.reset) turned_ = push_ = torque_ = 0;
    turned_ += report.turned;
    // A frame that asked nothing of the relaxer leaves the hand's forces as they were.
    if (report.relax.at_rest) {
        push_ = physics::hand_force(wire, report.relax.push_force);
        torque_ = report.relax.base_torque;
    }
    const anatomy::Anatomy& anatomy = simulation.anatomy();
    const anatomy::VesselPlace place = anatomy::nearest_place(anatomy, wire.tip());
    const geometry::CentrelineBranch& branch = anatomy.branches[place.branch];
    const auto contacts = simulation.contacts();
    int touching = 0;
    for (const physics::WallContact& c : contacts) touching += c.touches();
    const geometry::Vec3 tip = wire.tip() + simulation.vessel_shift(), &along = wire.tangents.back();
    const std::vector<io::CsvCell> row = {
        static_cast<double>(frame.time.index),
        frame.time.seconds,
        std::string("wire"),
        simulation.inserted(),
        turned_ / geometry::degree,
        tip.x(),
        tip.y(),
        tip.z(),
        along.x(),
        along.y(),
        along.z(),
        branch.name,
        geometry::length_of(std::span(branch.points).first(place.sample + 1)),
        anatomy::way_between(anatomy, place, target_).value_or(absent),
        push_,
        torque_,
        contacts.empty() ? 0.0 : contacts.back().force(),
        physics::largest_force(contacts),
        static_cast<double>(touching),
        wire.friction_loss,
        report.settling ? 1.0 : 0.0,
        score.air_kerma.value_or(absent)};
    std::string text;
    io::append_row(text, row);
    return text;
}

}  // namespace exercise
