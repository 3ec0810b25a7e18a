#pragma once
/// A hand that moves a scenario's devices by small steps, each to its rest, and keeps count of its work.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/exercise/simulation.h"
#include "engine/scenario/scenario.h"
#include "engine/studies/study.h"

namespace studies {

/// A scenario that ships, with values in place of the file's.
struct HandScene {
    std::string scenario;
    std::vector<scenario::Override> with = {};
};

/// Of one device.
struct HandReading {
    double inserted = 0;  // [mm]
    double turned = 0;    // of its hub, Σ since the start [rad]
    double tip_roll = 0;  // of its material at the distal end, Σ since the start [rad]
    double push = 0;      // that the hand exerts [N]
    double torque = 0;    // [N·mm]
    Vec3 tip = Vec3::Zero(), along = Vec3::Zero();  // where it ends, and the direction there
};

/// After a step of the hand, at rest. Energies are since the start [N·mm].
struct HandSample {
    std::vector<HandReading> devices;  // innermost first
    double work = 0;                   // of the hands
    double stored = 0;                 // gain of the energy of devices, walls and vessels
    double friction = 0;               // that friction has cost
    double jumps = 0;                  // that jumps from rest to rest have cost
    double vessel_moved = 0;           // farthest that a joint has pushed a vessel [mm]
    double contact_force = 0;          // largest of a joint [N]
    bool buckled = false, refused = false;
    bool jumped = false;  // with this step
    int chapter = 0;      // counts the calls of begin()
};

/// Hands' work against what became of it.
struct HandBalance {
    double work = 0, stored = 0, friction = 0, jumps = 0;  // [N·mm]
    double exchanged = 0;                                  // Σ|work| of the steps [N·mm]
    int steps = 0, jumping_steps = 0;

    double missing() const { return work - stored - friction - jumps; }
    /// Of the larger of the work and what became of it; of a course that has gone back, so that both are
    /// small, no less than a tenth of the work that went to and fro.
    double error() const;
};

/// The course of one hand. Work is that of the loads at the hubs, by the mean of those before and after a
/// frame. Where this leaves more than a hundredth of a step's work unexplained, the step is made again in
/// eighths, where these leave less. The error of the mean falls with the square of the step, so that a loss
/// that stays, and in one eighth, is a jump: the chain has left a rest that is no more, and the energy
/// between that and the next is lost (quasi-static: it would swing, and damping would take it). All else that
/// is missing is the balance's error, and so is all energy that is gained without work.
class HandCourse {
public:
    HandCourse(const StudyOptions&, const HandScene&);

    /// Feeds or turns by `step` a frame; ends early where `until` holds after one, and returns whether it
    /// did. What a hand at another device's hub does is counted alike.
    bool feed(double mm, script::DeviceRole = script::DeviceRole::Wire,
              const std::function<bool()>& until = {});
    bool turn(double rad, script::DeviceRole = script::DeviceRole::Wire,
              const std::function<bool()>& until = {});
    /// Holds still.
    void hold(int frames);
    /// What follows is another part of the course, of which the samples are told apart.
    void begin() { ++chapter_; }
    /// Frames that the simulation may take for one step before what is left of it is given up.
    static constexpr int most_frames = 60;

    double feed_step = 0.1;                   // [mm]
    double turn_step = 1 * geometry::degree;  // [rad]

    const exercise::Simulation& simulation() const { return *simulation_; }
    const std::vector<HandSample>& samples() const { return samples_; }
    const HandSample& last() const { return samples_.back(); }
    /// Place of a device in the samples' lists.
    std::size_t at(script::DeviceRole) const;
    const HandReading& reading(script::DeviceRole held = script::DeviceRole::Wire) const {
        return last().devices[at(held)];
    }
    /// From the introducer to where the device ends.
    Polyline path(script::DeviceRole held = script::DeviceRole::Wire) const {
        return simulation_->path_of(held);
    }
    HandBalance balance() const;

private:
    bool go(const std::function<script::Command(double)>&, double amount, double step,
            const std::function<bool()>& until);
    bool go_in_parts(const exercise::Simulation& before, const script::Command& part, double missing);
    HandSample moved(const HandSample& from, const script::Command&);
    HandSample read() const;
    void take(HandSample);
    double unexplained(const HandSample& before, const HandSample& after) const;

    std::unique_ptr<exercise::Simulation> simulation_;
    std::vector<HandSample> samples_;
    std::vector<double> rolled_;        // at the start [rad]
    double energy_ = 0, friction_ = 0;  // at the start [N·mm]
    double exchanged_ = 0;
    int jumping_steps_ = 0, steps_ = 0, chapter_ = 0;
};

}  // namespace studies
