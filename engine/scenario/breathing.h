#pragma once
/// Heartbeat and breathing: where the vessels are at a time, and the patient's breath: free, held on demand,
/// and caught again.

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"

namespace scenario {

/// Vessels, introducer and wire move together, without turning or changing shape, so that the wire's
/// equilibrium is the same in their frame; bones and skin stand still. Off at zero amplitude.
struct VesselMotion {
    double heart_rate = 70;                                   // [1/min]
    geometry::Vec3 heart_reach = geometry::Vec3::Zero();      // at the end of systole [mm]
    double breathing_rate = 15;                               // [1/min]
    geometry::Vec3 breathing_reach = geometry::Vec3::Zero();  // at the end of inspiration [mm]

    /// Longest that the patient holds his breath after breathing out [s]. Without oxygen, volunteers do so
    /// for 32 s on average, patients with chronic lung disease for 9 (J Magn Reson Imaging 1997;7:595); 20 is
    /// an estimate for a patient between them.
    double breath_hold = 20;

    bool moves() const { return !heart_reach.isZero() || !breathing_reach.isZero(); }
    /// Displacement from diastole at the end of expiration, the state at time 0 [mm]. `time` [s];
    /// `breathing_time`: the time that breathing is at, other than the heart's after a breath was held [s].
    geometry::Vec3 at(double time, double breathing_time) const;
    geometry::Vec3 at(double time) const { return at(time, time); }
};

/// 0 at the end of diastole, 1 at the end of systole; `time` [s], `rate` [1/min]. Systole takes a third of
/// the beat and the return the rest, each half a cosine.
double contraction(double time, double rate);

/// 0 where the bowel's gas is at time 0, 1 when it has gone farthest, half a minute later, and back again.
/// The period is an estimate: waves of the small bowel come 8 to 12 times a minute, those that carry gas
/// along less often. `time` [s].
double peristalsis(double time);

/// 0 at the end of expiration, 1 at the end of inspiration: sin⁴ of half the phase, which rests in expiration
/// (Lujan et al. 1999, with n = 2). `time` [s], `rate` [1/min].
double inspiration(double time, double rate);

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
