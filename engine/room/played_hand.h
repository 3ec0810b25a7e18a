#pragma once
/// A hand at the keys that follows a script: the same way at the speeds that keys have, with the time that a
/// person takes to decide. Attempts of it stand in for skilled ones where nobody has recorded any.

#include <cstdint>
#include <random>
#include <vector>

#include "engine/exercise/simulation.h"
#include "engine/room/keys.h"
#include "engine/script/command.h"

namespace room {

struct Habits {
    /// Each line's amounts are off by up to this fraction [-].
    double error = 0.05;
    /// Median time before another kind of movement, and the spread of its logarithm. 1.35 s is what it takes
    /// to prepare an action at a keyboard (mental operator, Card, Moran and Newell, Commun ACM 1980;23:396);
    /// the spread is an estimate.
    double decision = 1.35, decision_spread = 0.35;  // [s], [-]
    /// Each push goes so much too far and comes back, as that of a hand that does not look [-].
    double overshoot = 0;
};

class PlayedHand {
public:
    /// Commands that move no device keep their distance in frames to each other; motions take as long as keys
    /// need for them. `frame_rate` [1/s].
    PlayedHand(const script::CommandScript&, const Speeds&, double frame_rate, const Habits&,
               std::uint64_t seed);

    /// The commands of the next frame. Like a hand in the room it waits for a device that lags behind; `last`
    /// is what the previous frame did.
    std::vector<script::Command> next(const exercise::StepReport& last);
    bool done() const { return step_ == steps_.size(); }

private:
    struct Motion {
        bool turns = false;
        script::DeviceRole held = script::DeviceRole::Wire;
        double amount = 0;  // signed; [mm], [rad]
        double speed = 0;   // of the keys [mm/s], [rad/s]

        bool like(const Motion& other) const {
            return turns == other.turns && held == other.held && (amount > 0) == (other.amount > 0);
        }
    };
    /// Commands at once, then motions together, or frames of waiting.
    struct Step {
        std::vector<script::Command> commands;
        std::vector<Motion> motions;
        int frames = 0;       // waited
        bool runs_up = true;  // the hand starts from rest
    };

    void add_group(std::vector<Motion>, int idle_frames);
    double decision_frames();

    Speeds speeds_;
    double frame_time_;
    Habits habits_;
    std::mt19937_64 random_;
    std::vector<Step> steps_;
    std::size_t step_ = 0;
    double moving_ = 0, fraction_ = 0;  // in the step: time [s], and what is done of its motions [-]
    int waited_ = 0;
    std::vector<Motion> before_;  // of the last group
};

}  // namespace room
