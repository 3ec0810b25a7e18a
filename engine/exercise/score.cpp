#include "engine/exercise/score.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "physics/geometry/vec.h"

namespace exercise {

Scorer::Scorer(const Simulation& simulation) {
    begin(simulation);
}

void Scorer::begin(const Simulation& simulation) {
    const scenario::Scenario& scenario = simulation.scenario();
    const int resets = score_.resets;
    *this = Scorer();
    score_.scenario = scenario.name;
    score_.resets = resets;
    frame_time_ = 1.0 / scenario.frame_rate;
    hold_ = scenario.target.hold;
    target_radius_ = scenario.target.radius;
    first_tip_ = last_tip_ = simulation.tip_at_start();
}

void Scorer::observe(const Frame& frame) {
    const Simulation& simulation = frame.simulation;
    if (frame.motion.reset) {
        ++score_.resets;
        begin(simulation);
    }
    score_.frames = frame.time.index + 1;
    if (simulation.console().beam_on()) score_.beam_on_time = ++beam_frames_ * frame_time_;
    score_.contrast = simulation.contrast().injected();
    observe_motion(frame);
    observe_wall(frame);
    observe_target(frame);
}

void Scorer::observe_motion(const Frame& frame) {
    const Simulation& simulation = frame.simulation;
    for (const double insertion : frame.motion.insertions) {
        if (insertion == 0) continue;
        (insertion > 0 ? score_.advanced : score_.withdrawn) += std::abs(insertion);
        net_insertion_ += insertion;
        const int direction = insertion > 0 ? 1 : -1;
        if (direction_ != 0 && direction != direction_) ++score_.reversals;
        direction_ = direction;
    }
    score_.buckled_frames += frame.motion.buckled;
    score_.wire_travel = score_.advanced + score_.withdrawn;
    score_.rotation += frame.motion.rotation;
    if (!first_motion_ && (score_.wire_travel > 0 || score_.rotation > 0))
        first_motion_ = frame.time.seconds - frame_time_;
    score_.tip_path += (simulation.tip() - last_tip_).norm();
    last_tip_ = simulation.tip();
    shortest_ = anatomy::centreline_distance(simulation.anatomy(), first_tip_, last_tip_);
}

void Scorer::observe_wall(const Frame& frame) {
    const std::span<const physics::WallContact> contacts = frame.simulation.contacts();
    double sum = 0;
    for (std::size_t i = 1; i < contacts.size(); ++i) {  // joint 0 is held by the introducer
        const physics::WallContact& contact = contacts[i];
        sum += contact.force();
        score_.peak_wall_force = std::max(score_.peak_wall_force, contact.force());
        if (contact.penetration > score_.deepest.penetration) {
            score_.deepest = {contact.penetration, static_cast<int>(i), frame.time.index, contact.stiffness,
                              contact.force()};
        }
    }
    score_.wall_force_impulse += sum * frame_time_;
}

void Scorer::observe_target(const Frame& frame) {
    const double time = frame.time.seconds;
    score_.tip_to_target = frame.simulation.tip_to_target();
    if (score_.tip_to_target > target_radius_) {
        on_target_since_.reset();
        return;
    }
    if (!on_target_since_) on_target_since_ = time - frame_time_;
    // Half a frame of slack: sums of 1/rate do not add up exactly.
    if (score_.completed || time - *on_target_since_ < hold_ - 0.5 * frame_time_) return;
    if (!first_motion_) return;  // without an action, nothing counts as reached
    score_.completed = true;
    score_.completion_time = time - *first_motion_;
}

Score Scorer::score() const {
    Score result = score_;
    if (result.wire_travel > 0) {
        result.back_and_forth_ratio = (result.wire_travel - std::abs(net_insertion_)) / result.wire_travel;
    }
    if (result.tip_path > 0) result.path_efficiency = std::min(1.0, shortest_ / result.tip_path);
    return result;
}

std::string to_json(const Score& s) {
    nlohmann::ordered_json json;
    json["schema"] = 1;
    json["scenario"] = s.scenario;
    json["completed"] = s.completed;
    json["completion_time_s"] = s.completion_time ? nlohmann::ordered_json(*s.completion_time) : nullptr;
    json["beam_on_time_s"] = s.beam_on_time;
    json["air_kerma_mGy"] = s.air_kerma ? nlohmann::ordered_json(*s.air_kerma) : nullptr;
    json["kerma_area_product_Gy_cm2"] = s.area_product ? nlohmann::ordered_json(*s.area_product) : nullptr;
    json["contrast_ml"] = s.contrast;
    json["wire_travel_mm"] = s.wire_travel;
    json["advanced_mm"] = s.advanced;
    json["withdrawn_mm"] = s.withdrawn;
    json["back_and_forth_ratio"] = s.back_and_forth_ratio;
    json["reversals"] = s.reversals;
    json["rotation_deg"] = s.rotation / geometry::degree;
    json["tip_path_mm"] = s.tip_path;
    json["path_efficiency"] = s.path_efficiency;
    json["peak_wall_force_N"] = s.peak_wall_force;
    json["wall_force_impulse_N_s"] = s.wall_force_impulse;
    json["max_penetration_mm"] = s.deepest.penetration;
    if (s.deepest.joint >= 0) {
        json["max_penetration_at"] = {{"joint", s.deepest.joint},
                                      {"frame", s.deepest.frame},
                                      {"stiffness_N_per_mm", s.deepest.stiffness},
                                      {"force_N", s.deepest.force}};
    }
    json["buckled_frames"] = s.buckled_frames;
    json["tip_to_target_mm"] = s.tip_to_target;
    json["resets"] = s.resets;
    json["frames"] = s.frames;
    json["interrupted"] = s.interrupted;
    return json.dump(2) + "\n";
}

}  // namespace exercise
