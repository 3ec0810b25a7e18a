/// How a simulation's devices push the vessels aside.

#include <algorithm>
#include <cassert>
#include <iterator>

#include "engine/exercise/distal_trees.h"
#include "engine/exercise/simulation.h"
#include "engine/exercise/simulation_parts.h"
#include "engine/scenario/placement.h"
#include "physics/wall/foundation.h"
#include "physics/wire/energy.h"

namespace exercise {

using geometry::Vec3;

double Simulation::farthest_vessel_move() const {
    double farthest = 0;
    for (const physics::WallContact& c : contacts_) farthest = std::max(farthest, c.given.norm());
    return farthest;
}

/// What is needed to judge vessels that stay.
void Simulation::know_vessels() {
    const auto tissues = scenario::tissues_that_could_move(scenario_, *anatomy_);
    const auto end = anatomy::find_end(*anatomy_, scenario_.entry.end);
    assert(end);
    if (!tissues.empty()) gives_.emplace(reach_, tissues, anatomy_->ends[*end].opening);
}

/// Of a chain that is laid.
bool Simulation::vessels_can_stay() const {
    return wall_->foundation() && !scenario_.tissue.rigid &&
           gives_->around(moving_, scenario::give_ahead, scenario::vessel_give_shows).most <=
               scenario::vessel_give_shows;
}

/// By which the devices at rest push the vessels aside now; those that stay would be, by
/// the forces on them as they stay.
scenario::VesselGive Simulation::pushed_now() const {
    const physics::Foundation* foundation = wall_->foundation();
    scenario::VesselGive found;
    if (!foundation) return found;
    const auto contacts = hub_->contacts();
    const auto find = [&](const Vec3& by, int station) {
        if (by.norm() > found.most) found = {by.norm(), reach_->name_of(station)};
    };
    std::vector<physics::Foundation::Load> loads;
    for (std::size_t j = 1; j < contacts.size(); ++j) {
        if (!contacts[j].touches()) continue;
        const Vec3 along = foundation->along(contacts[j].station), push = contacts[j].push();
        loads.push_back({contacts[j].station, moving_.joints[j], push - along.dot(push) * along});
        if (!moving_.vessels_stay) find(contacts[j].given, contacts[j].station);
    }
    if (loads.empty() || !moving_.vessels_stay) return found;
    const auto by = foundation->displacement(loads);
    for (const physics::Foundation::Load& load : loads)
        find(foundation->at(by, load.station, load.place), load.station);
    return found;
}

/// More than `enough` is not looked for.
scenario::VesselGive Simulation::vessel_give(double enough) const {
    if (!gives_ || !hub_) return {};
    const scenario::VesselGive now = pushed_now();
    if (now.most > enough) return now;
    const scenario::VesselGive next = gives_->around(moving_, scenario::give_ahead, enough);
    return next.most > now.most ? next : now;
}

std::string Simulation::vessels_sentence() const {
    return gives_
               ? scenario::vessels_sentence(vessel_give(), vessels_stay(), scenario_.tissue.rigid.has_value())
               : std::string();
}

/// Vessels stay where devices push them aside, or can where they come to next, by no more than shows, and
/// make way elsewhere; of a chain at rest, which then is no more. They stay again where that is less than
/// half, so that they do not change back and forth. Returns whether they do otherwise now, with what there is
/// to say about it.
bool Simulation::renew_vessels(std::string* said) {
    if (!wall_->foundation() || scenario_.tissue.rigid) return false;
    const bool stay = moving_.vessels_stay;
    const double limit = (stay ? 1 : 0.5) * scenario::vessel_give_shows;
    const scenario::VesselGive give = vessel_give(limit);
    if ((give.most <= limit) == stay) return false;
    if (stay)
        hub_->let_vessels_make_way(moving_);
    else
        physics::Hub::let_vessels_stay(moving_);
    ++model_changes_.vessels;
    if (said) *said = scenario::vessels_sentence(give, !stay, false);
    return true;
}

/// What complications and a treatment change of vessels and devices by a frame, of a chain at rest, with a
/// part of the frame's work each.
void Simulation::change_vessels(StepReport& report) {
    if (complications_.in_vessels()) {
        Complications before = complications_;
        const bool opens = going(complications_);
        if (complications_.step(1 / scenario_.frame_rate, moving_)) {
            settle_changed(report);
            // Where the chain finds no rest in what they leave of the lumen they stay as they were, and the
            // next frame tries again. What was relieved goes in any case.
            if (!opens && (hub_->working() || is_lost())) {
                complications_ = std::move(before);
                go_back(report);
            }
        }
    }
    if (!treatment_.given() || hub_->working()) return;
    Treatment before = treatment_;
    const std::size_t events = treatment_.events().size();
    const Inflation* inflation = treatment_.inflation();
    const bool rises = inflation && inflation->wanted > inflation->pressure;
    if (treat()) {
        settle_changed(report);
        // A chain that finds none around a balloon that is being inflated has it as it was. One that needs
        // more work goes on in the next frames.
        if (rises && !hub_->working() && !hub_->last_report().at_rest()) {
            treatment_ = std::move(before);
            return go_back(report);
        }
    }
    follow_events(events, report);
}

/// In vessels that have changed, with a part of the frame's work.
void Simulation::settle_changed(StepReport& report) {
    constexpr int fraction = 4;
    if (moving_.grips.empty()) physics::start_grips(moving_, true);
    take_up_changes();
    hub_->wall_has_changed();
    account(hub_->settle(moving_, frame_updates() / fraction), report);
}

/// To the last rest, in the vessels that it was in.
void Simulation::go_back(StepReport& report) {
    take_up_changes();
    hub_->wall_has_changed();
    moving_ = wire_;
    account(hub_->settle(moving_, updates_left(report)), report);
}

void Simulation::take_up_changes() {
    std::vector<physics::Narrowing> tubes = complications_.narrowings();
    std::ranges::move(treatment_.narrowings(), std::back_inserter(tubes));
    wall_->narrow(std::move(tubes));
    std::vector<blood::Obstruction> in_the_way = complications_.obstructions();
    std::ranges::move(treatment_.obstructions(), std::back_inserter(in_the_way));
    contrast_->obstruct(in_the_way);
}

/// Of the vessels under the forces of the wire shown; empty where they do not move.
std::optional<physics::Foundation::Displacement> Simulation::displacement() const {
    if (!wall_->foundation()) return {};
    const std::vector<physics::Foundation::Load> loads = physics::vessel_loads(wire_, contacts_);
    if (loads.empty()) return {};
    return wall_->foundation()->displacement(loads);
}

/// The displacement of places, whose stations are found when they are not known.
std::vector<Eigen::Vector3f> Simulation::moved(const physics::Foundation& foundation,
                                               const physics::Foundation::Displacement& by,
                                               std::span<const Vec3> places, std::vector<int>& stations) {
    if (stations.empty())
        for (const Vec3& place : places) stations.push_back(foundation.tree().locate(place, -1));
    std::vector<Eigen::Vector3f> moves(places.size());
    for (std::size_t k = 0; k < places.size(); ++k)
        moves[k] = foundation.at(by, stations[k], places[k]).cast<float>();
    return moves;
}

std::vector<Eigen::Vector3f> Simulation::lumen_moves() const {
    std::vector<Eigen::Vector3f> moves;
    if (const auto by = displacement())
        moves = moved(*wall_->foundation(), *by, anatomy_->lumen.vertices, vertex_stations_);
    if (!narrowed_lumen().empty()) moves.resize(anatomy_->lumen.vertices.size(), Eigen::Vector3f::Zero());
    for (const render::VertexMove& move : narrowed_lumen()) moves[move.vertex] += move.by;
    return moves;
}

const std::vector<render::VertexMove>& Simulation::narrowed_lumen() const {
    const Complications seen = complications_.as_seen();
    const Treatment opened = treatment_.as_seen();
    if (std::ranges::equal(seen.all(), narrowed_by_) && opened.same_lumen(opened_by_)) return narrowed_lumen_;
    narrowed_by_.assign(seen.all().begin(), seen.all().end());
    opened_by_ = opened;
    narrowed_lumen_.clear();
    physics::NarrowedWall tubes(wall_->vessels(), 0);
    std::vector<physics::Narrowing> narrowings = seen.narrowings();
    std::ranges::move(opened.narrowings(), std::back_inserter(narrowings));
    tubes.narrow(std::move(narrowings));
    const std::vector<Vec3>& vertices = anatomy_->lumen.vertices;
    for (std::size_t v = 0; v < vertices.size(); ++v)
        if (const Vec3 by = tubes.inward(vertices[v]); !by.isZero(0))
            narrowed_lumen_.push_back({static_cast<std::uint32_t>(v), by.cast<float>()});
    return narrowed_lumen_;
}

Simulation::VesselMoves Simulation::vessel_moves() const {
    VesselMoves moves;
    const auto by = displacement();
    if (!by && motion_->rigid()) return moves;
    if (by) moves.of_nodes = moved(*wall_->foundation(), *by, contrast_->nodes(), node_stations_);
    if (!motion_->rigid()) {
        moves.of_nodes.resize(contrast_->nodes().size(), Eigen::Vector3f::Zero());
        const Vec3 shift = vessel_shift();
        for (std::size_t n = 0; n < moves.of_nodes.size(); ++n) {
            const Vec3& node = contrast_->nodes()[n];
            moves.of_nodes[n] += (place_now(node) - node - shift).cast<float>();
        }
    }
    moves.of_distal = distal_moves(contrast_->blood(), moves.of_nodes);
    return moves;
}

}  // namespace exercise
