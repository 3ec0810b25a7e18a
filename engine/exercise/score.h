#pragma once
/// What an attempt is judged by. Completion time runs from the first motion of the wire to the first frame at
/// which the tip has stayed within the target's radius for the hold. Time is frame divided by frame rate.

#include <optional>
#include <span>
#include <string>

#include "engine/exercise/frame.h"

namespace exercise {

/// The deepest contact of an attempt and what explains it: penetration · stiffness = force.
struct DeepestContact {
    double penetration = 0;  // [mm]
    int joint = -1;
    int frame = -1;
    double stiffness = 0;  // [N/mm]
    double force = 0;      // [N]

    void state(geometry::StateStream& s) { s(penetration, joint, frame, stiffness, force); }
};

/// Covers the attempt since the start or the last reset; `frames` and `resets` cover the whole run.
struct Score {
    std::string scenario;
    bool completed = false;
    std::optional<double> completion_time;  // [s]
    double beam_on_time = 0;                // [s]
    /// Dose to the patient; empty when no images were made, as these alone determine what the tube must
    /// deliver.
    std::optional<double> air_kerma;     // K_a,r at the reference point [mGy]
    std::optional<double> area_product;  // P_KA [Gy·cm²]
    double contrast = 0;                 // given [ml]
    double wire_travel = 0;              // Σ|Δs| of the inserted length s [mm]
    double advanced = 0, withdrawn = 0;  // its two parts [mm]
    double back_and_forth_ratio = 0;     // (Σ|Δs| − |ΣΔs|) / Σ|Δs| [-]
    int reversals = 0;                   // changes between advancing and withdrawing
    double rotation = 0;                 // Σ|angle| of the hub [rad]
    double tip_path = 0;                 // distance travelled by the tip over the frames [mm]
    double path_efficiency = 0;          // distance from start to tip along the centreline / tip_path [-]
    double peak_wall_force = 0;          // of one joint [N]
    double wall_force_impulse = 0;       // ∫ of the forces of all joints dt [N·s]
    DeepestContact deepest;
    int buckled_frames = 0;    // in which a push bowed the shaft outside and was not passed on
    double tip_to_target = 0;  // at the end [mm]
    int resets = 0;
    int frames = 0;
    bool interrupted = false;  // by the user, before the script's end

    void state(geometry::StateStream& s) {
        s(scenario, completed, completion_time, beam_on_time, air_kerma, area_product, contrast, wire_travel,
          advanced, withdrawn, back_and_forth_ratio, reversals, rotation, tip_path, path_efficiency,
          peak_wall_force, wall_force_impulse, deepest, tip_to_target, resets, frames, interrupted);
        if (!s.part(buckled_frames > 0, buckled_frames)) buckled_frames = 0;
    }
};

/// The text of score.json: keys carry units.
std::string to_json(const Score&);

class Scorer {
public:
    explicit Scorer(const Simulation&);
    /// To be called once after each frame.
    void observe(const Frame&);
    Score score() const;
    void state(geometry::StateStream& s) {
        s(score_, beam_frames_, first_motion_, on_target_since_, net_insertion_, direction_, first_tip_,
          last_tip_, shortest_);
    }

private:
    Scorer() = default;
    void begin(const Simulation&);
    void observe_motion(const Frame&);
    void observe_wall(const Frame&);
    void observe_target(const Frame&);

    Score score_;
    double frame_time_ = 0, hold_ = 0, target_radius_ = 0;  // [s], [s], [mm]
    int beam_frames_ = 0;
    std::optional<double> first_motion_, on_target_since_;  // [s] of the attempt
    double net_insertion_ = 0;                              // [mm]
    int direction_ = 0;
    geometry::Vec3 first_tip_ = geometry::Vec3::Zero(), last_tip_ = geometry::Vec3::Zero();
    double shortest_ = 0;  // along centrelines from the first tip to the last [mm]
};

}  // namespace exercise
