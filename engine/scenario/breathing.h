#pragma once
/// Heartbeat and breathing: where the vessels are at a time, and the patient's breath: free, held on demand,
/// and caught again.

#include <vector>

#include "engine/script/command.h"
#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"

namespace scenario {

/// 0 at the end of diastole, 1 at the end of systole; `time` [s], `rate` [1/min]. Systole takes a third of
/// the beat and the return the rest, each half a cosine.
double contraction(double time, double rate);

/// 0 at the end of expiration, 1 at the end of inspiration: sin⁴ of half the phase, which rests in expiration
/// (Lujan et al. 1999, with n = 2). `time` [s], `rate` [1/min].
double inspiration(double time, double rate);

/// Vessels, introducer and wire move together, so that the wire's equilibrium is that of vessels at rest;
/// bones and skin stand still. How each place moves is in MotionField. Off at zero amplitude.
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
    geometry::Vec3 at(double time, double breathing_time) const {
        return with_breath(time, inspiration(breathing_time, breathing_rate));
    }
    geometry::Vec3 at(double time) const { return at(time, time); }
    /// The same at a fraction of the way to the end of a quiet inspiration [-].
    geometry::Vec3 with_breath(double time, double breath) const {
        return contraction(time, heart_rate) * heart_reach + breath * breathing_reach;
    }
};

/// 0 where the bowel's gas is at time 0, 1 when it has gone farthest, half a minute later, and back again.
/// The period is an estimate: waves of the small bowel come 8 to 12 times a minute, those that carry gas
/// along less often. `time` [s].
double peristalsis(double time);

/// Asked to hold his breath, the patient breathes out first and holds it there: at the end of expiration
/// organs come to the same place each time. He holds it for VesselMotion::breath_hold at most, then gasps:
/// for a while he breathes twice as fast and can't hold it again. Besides, a teacher may let him breathe
/// deeply, or cough (docs/complications.md).
class Breathing {
public:
    enum class State { Free, Asked, Held, Gasping };
    /// What a frame brought.
    enum class Event { None, Held, Freed, Gasped, Refused };

    /// Asks to hold the breath, or to breathe again.
    void ask(bool hold);
    /// Deeply, or as at the start, from now on; or once a cough.
    void breathe(script::BreathManner);
    /// To be called at the end of a frame: its `time`, and the time since the frame before [s].
    Event step(double time, double since, const VesselMotion&);

    /// The time at which free breathing would be where breathing is now [s].
    double clock(double time) const { return state_ == State::Held ? held_at_ : time - behind_; }
    /// Fraction of the way to the end of a quiet inspiration: 0 to `deepest` [-].
    double depth(double time, const VesselMotion&) const;
    State state() const { return state_; }
    double held_for() const { return state_ == State::Held ? since_ : 0; }  // [s]

    void state(geometry::StateStream& s) {
        s(state_, pending_, behind_, held_at_, since_);
        s.unless_empty(manner_);
    }

    /// Fraction of a breath at which the lungs count as empty [-].
    static constexpr double empty = 0.02;
    /// A gasp: for how long [s], and how much faster than before [-]. Both are estimates.
    static constexpr double gasp_time = 8, gasp_speed = 2;
    /// A deep breath: its depth and speed over those of a quiet one [-], and how long it takes to become one
    /// [s]. Estimates: the deepest breath moves the diaphragm by four times a quiet one (Boussuges 2009).
    static constexpr double deep = 2.5, deep_speed = 1.2, becomes_deep = 2;
    /// A cough: its depth besides the breath's [-], and its time [s]. Estimates.
    static constexpr double cough = 1.2, cough_time = 0.6;
    static constexpr double deepest = deep + cough;

private:
    State state_ = State::Free;
    Event pending_ = Event::None;  // of what was asked since the last frame
    double behind_ = 0;            // the clock, behind the time [s]
    double held_at_ = 0;           // the clock during a hold [s]
    double since_ = 0;             // the start of a hold or a gasp [s]
    struct Manner {
        bool deep = false;       // from now on
        double fraction = 0;     // of the way from a quiet to a deep breath [-]
        double coughs_for = -1;  // so far; < 0: he does not cough [s]

        void state(geometry::StateStream& s) { s(deep, fraction, coughs_for); }
    };
    void change_manner(double since);
    std::vector<Manner> manner_;  // one, or none where he breathes as at the start
};

}  // namespace scenario
