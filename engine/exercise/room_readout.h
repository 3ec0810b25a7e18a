#pragma once
/// Follows an exercise and fills in the readouts of its panel.

#include <deque>
#include <string>
#include <vector>

#include "engine/exercise/monitor.h"
#include "engine/exercise/score.h"
#include "render/panel/readout.h"

namespace exercise {

/// Follows an exercise frame by frame.
class RoomReadout {
public:
    /// To be called once after each frame.
    void observe(const Frame&, const Score&);
    render::Readout read(const Frame&, const Score&) const;
    /// Shows a message for some seconds from the last observed frame; saying the same text again restarts its
    /// time.
    void say(std::string text, render::Notice);
    std::vector<render::Message> messages() const;
    void state(geometry::StateStream& s) {
        s(frame_, messages_, wall_forces_, pulse_rate_, was_complete_, pressed_hard_, tip_shows_,
          was_past_end_, notified_, errors_);
    }

private:
    void notify_of_dose(const Score&);
    void say_of_breath(scenario::Breathing::Event);

    struct TimedMessage {
        int frame = 0;  // of the attempt
        render::Message message;
        void state(geometry::StateStream& s) { s(frame, message.text, message.notice); }
    };
    int frame_ = -1;  // of the attempt, last observed
    std::deque<TimedMessage> messages_;
    std::deque<double> wall_forces_;  // largest of each frame [N]
    double pulse_rate_ = 0;           // at the last pulse [1/s]
    bool was_complete_ = false;
    bool pressed_hard_ = false;  // the wall, at the last frame
    bool tip_shows_ = true;      // in the image, when the beam was last on
    bool was_past_end_ = false;  // the tip, of the vessels, at the last frame
    std::size_t errors_ = 0;     // of handling, told so far
    int notified_ = 0;           // dose notifications already given, a bit for each kind
};

}  // namespace exercise
