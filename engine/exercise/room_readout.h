#pragma once
/// Follows an exercise and fills in the readouts of its panel; says what a trainee should know about a run:
/// stops of the wire, and shortcomings of the simulation.

#include <deque>
#include <string>
#include <vector>

#include "engine/exercise/frame.h"
#include "engine/exercise/monitor.h"
#include "engine/exercise/score.h"
#include "render/panel/readout.h"

namespace exercise {

/// "The mask was shifted by 1.30 pixels to the right and 0.40 down", or why it was not.
std::string mask_shift_sentence(const MaskShift&);

class Notices {
public:
    /// To be called once after each frame.
    void observe(const Frame&);
    /// A sentence for each kind of event that happened, with the number of frames.
    std::vector<std::string> text() const;

private:
    int stopped_withdrawals_ = 0, past_ends_ = 0, used_up_ = 0, kinked_ = 0, restless_ = 0, crossed_ = 0;
    int settling_ = 0, refused_ = 0, buckled_ = 0, late_ = 0, flat_ = 0;
    int too_thick_ = 0, limited_doses_ = 0;
    /// Beam on a tip that it does not show.
    struct Unseen {
        int frames = 0, episodes = 0, first = 0;
        std::string remedy;  // what would have shown it then
        bool now = false;
    };
    void watch_tip(const Frame&);
    Unseen unseen_;
    bool beam_was_on_ = false,
         wire_was_out_ = false;  // at the first frame with beam nothing was in the image
    /// The first of many sentences, and how many there are more.
    struct First {
        std::size_t most;
        std::vector<std::string> sentences = {};
        int more = 0;
        void add(int frame, const std::string& sentence);
        void end(std::vector<std::string>& text, const char* what) const;
    };
    First treated_{20}, injuries_{20}, changes_{6},
        mask_shifts_{20};  // shifts: of those that were found, or not made
    std::vector<std::string> denied_;
    int gasps_ = 0;
    double deepest_crossing_ = 0, most_waiting_ = 0;  // [mm]
};

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
          was_past_end_, notified_, errors_, pressures_, inflated_, was_inflated_, beyond_rated_);
    }

private:
    void notify_of_dose(const Score&);
    void say_of_breath(scenario::Breathing::Event);
    void follow_balloon(const Frame&);

    struct TimedMessage {
        int frame = 0;  // of the attempt
        render::Message message;
        void state(geometry::StateStream& s) { s(frame, message.text, message.notice); }
    };
    int frame_ = -1;  // of the attempt, last observed
    std::deque<TimedMessage> messages_;
    std::deque<double> wall_forces_;  // largest of each frame [N]
    std::deque<double> pressures_;    // a few of each frame, NaN where none was read [mmHg]
    double pulse_rate_ = 0;           // at the last pulse [1/s]
    bool was_complete_ = false;
    bool pressed_hard_ = false;  // the wall, at the last frame
    bool tip_shows_ = true;      // in the image, when the beam was last on
    bool was_past_end_ = false;  // the tip, of the vessels, at the last frame
    std::size_t errors_ = 0;     // of handling, told so far
    double inflated_ = 0;        // for so long, the balloon now or at the last inflation [s]
    bool was_inflated_ = false;  // and going up, at the last frame
    bool beyond_rated_ = false;  // its pressure, at the last frame
    int notified_ = 0;           // dose notifications already given, a bit for each kind
};

}  // namespace exercise
