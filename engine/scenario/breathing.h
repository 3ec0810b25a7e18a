#pragma once
/// The patient's breath: free, held on demand, and caught again.

#include "engine/scenario/vessel_motion.h"
#include "physics/geometry/state.h"

namespace scenario {

/// Asked to hold his breath, the patient breathes out first and holds it there: at the end of expiration
/// organs come to the same place each time. He holds it for VesselMotion::breath_hold at most, then gasps:
/// for a while he breathes twice as fast and can't hold it again.
class Breathing {
public:
    enum class State { Free, Asked, Held, Gasping };
    /// What a frame brought.
    enum class Event { None, Held, Freed, Gasped, Refused };

    /// Asks to hold the breath, or to breathe again.
    void ask(bool hold);
    /// To be called at the end of a frame: its `time`, and the time since the frame before [s].
    Event step(double time, double since, const VesselMotion&);

    /// The time at which free breathing would be where breathing is now [s].
    double clock(double time) const { return state_ == State::Held ? held_at_ : time - behind_; }
    State state() const { return state_; }
    double held_for() const { return state_ == State::Held ? since_ : 0; }  // [s]
    /// Whether the breath ever was held, or is to be.
    bool was_held() const { return state_ != State::Free || behind_ != 0 || pending_ != Event::None; }

    void state(geometry::StateStream& s) { s(state_, pending_, behind_, held_at_, since_); }

    /// Share of a breath at which the lungs count as empty [-].
    static constexpr double empty = 0.02;
    /// A gasp: for how long [s], and how much faster than before [-]. Both are estimates.
    static constexpr double gasp_time = 8, gasp_speed = 2;

private:
    State state_ = State::Free;
    Event pending_ = Event::None;  // of what was asked since the last frame
    double behind_ = 0;            // the clock, behind the time [s]
    double held_at_ = 0;           // the clock during a hold [s]
    double since_ = 0;             // the start of a hold or a gasp [s]
};

}  // namespace scenario
