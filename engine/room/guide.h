#pragma once
/// A guided lesson: which step is shown, and what of it was really done.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "engine/exercise/frame.h"
#include "engine/room/grasp.h"
#include "engine/room/hands.h"
#include "engine/room/keys.h"
#include "engine/scenario/scenario.h"

namespace room {

using script::Practice;
using script::practices;

/// What came of each practice: [mm] of devices and table, [rad] of turns, pulses of the beam; of all else how
/// often.
using Effects = std::array<double, practices>;
/// So much of it is done well enough.
double enough(Practice);

/// What effects are differences of.
struct Situation {
    std::array<std::optional<script::DeviceRole>, 2> held;  // by each Side
    std::string helper;                                     // what he holds
    struct Device {
        script::DeviceRole role;
        double inserted = 0, turned = 0;  // [mm], [rad]
        std::optional<double> grip;       // [mm]
    };
    std::vector<Device> devices;
    render::CArm arm;
    geometry::Vec3 table = geometry::Vec3::Zero();  // [mm]
    double pulse_rate = 0;                          // [1/s]
    bool acquires = false;                          // a run of DSA
    bool breathes = true;
    /// Of the balloon or the stent, where there is one.
    struct Balloon {
        std::string device;
        double wanted = 0, to_uncover = 0;  // [atm], [mm]
        bool deployed = false;
    };
    std::optional<Balloon> balloon;
};
/// `grasp` may be null.
Situation situation_of(const exercise::Simulation&, const Grasp*);
/// Of a frame: what the hands asked for and what came of it. Of what the window does alone, as a pause, it
/// has nothing. `completed`: the target was reached in this attempt.
Effects effects_of(const Situation& before, const Situation& after, const Input&, const exercise::Frame&,
                   const KeyMap&, bool completed);

/// How a practice is done: "Up; mouse wheel, or drag up on the image; right stick up".
std::string inputs_of(Practice, const KeyMap&);

class Guide {
public:
    explicit Guide(std::vector<scenario::LessonStep>);

    /// A step is done when enough came of all that it practises, since it is shown or was left out.
    void count(const Effects&);
    /// The window did it whole.
    void did(Action);
    /// Leaves out the step that is shown; one that is done later all the same counts.
    void skip();

    std::size_t size() const { return steps_.size(); }
    const scenario::LessonStep& step(std::size_t k) const { return steps_[k]; }
    /// The first that is neither done nor left out; size() after the last.
    std::size_t shown() const;
    bool is_done(std::size_t step) const;
    bool is_done(std::size_t step, std::size_t practice) const {
        return amounts_[step][practice] >= enough(steps_[step].practise[practice]);
    }
    bool is_skipped(std::size_t step) const { return skipped_[step] && !is_done(step); }
    int done() const;
    int skipped() const;
    bool over() const { return shown() == size(); }
    bool passed() const { return done() == static_cast<int>(size()); }

private:
    std::vector<scenario::LessonStep> steps_;
    std::vector<std::vector<double>> amounts_;  // of each step's practices, so far
    std::vector<bool> skipped_;
};

}  // namespace room
