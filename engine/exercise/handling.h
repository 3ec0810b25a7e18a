#pragma once
/// Errors of handling with their moments: what a hand does that the hands of experts do not. Their composite
/// was the most reliable metric of a commercial trainer (Patel 2006, r = 0.9 test to retest). Among them is
/// what the image would not show.

#include <array>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/exercise/frame.h"
#include "engine/exercise/simulation.h"

namespace exercise {

enum class HandlingError {
    BlindMotion,      // a device moves, the beam is off
    IdleBeam,         // the beam is on, nothing moves and no contrast runs
    AgainstStop,      // pushed on while the tip stays, or against an end of the way
    HardPress,        // one joint presses the wall with more than the limit
    OutOfView,        // a device moves, its tip is outside the open field
    TargetLost,       // the tip has left the target it was at
    InjectionAtWall,  // contrast leaves a catheter whose tip presses the wall
    StaleRoadmap,     // a device moves under a roadmap that has no map of this view
    Dissection,       // injuries of the wall, see injury.h
    Perforation,
};
inline constexpr std::size_t handling_error_kinds = 10;
/// As in score.json.
inline constexpr std::array<const char*, handling_error_kinds> handling_error_ids = {
    "motion_without_beam", "beam_without_motion", "push_against_resistance", "force_over_limit",
    "left_field_of_view",  "target_lost",         "injection_at_wall",       "stale_roadmap",
    "dissection",          "perforation"};
/// For the trainee.
inline constexpr std::array<const char*, handling_error_kinds> handling_error_texts = {
    "The device was moved without beam",
    "The beam was on while nothing moved",
    "It was pushed against resistance",
    "The wall was pressed hard",
    "It was moved with its tip unseen",
    "The target was lost again",
    "Contrast was given against the wall",
    "It was moved under a roadmap of another view",
    "The wall was dissected",
    "The wall was perforated"};

/// Why each matters and what to do instead, for the trainee.
inline constexpr std::array<const char*, handling_error_kinds> handling_error_advice = {
    "A device that moves unseen can enter any branch. Press the pedal first, then move.",
    "The patient is irradiated and nothing is learnt. Take the foot off the pedal while you think: the last "
    "image stays on the screen.",
    "What is fed in bows or loops somewhere, or the tip digs into the wall. Stop, pull back a little, turn, "
    "and try again.",
    "The wall can tear. Pull back until the force falls, and look where the device bears on it.",
    "Nobody sees what the tip does. Move the table or open the collimator so that the tip stays in the "
    "image.",
    "The way has to be found again. Hold the device, and push on no further once the tip is there.",
    "A jet against the wall can dissect it. Pull back or turn until the tip lies free, then inject.",
    "The map shows vessels where they were in another view. Take a new angiogram in this view, or go back to "
    "its view.",
    "The end was pushed into the wall until its layers parted. Do not push against resistance; pull back, "
    "and show it by contrast.",
    "The end went through the wall: blood leaks out. Do not pull the wire out at once, call for help, and "
    "have a balloon ready."};

/// Of a mark's amount: how long, how much was fed in vain, the largest force, the largest distance.
inline constexpr std::array<const char*, handling_error_kinds> handling_error_units = {
    "s", "s", "mm", "N", "s", "mm", "N", "s", "N", "N"};

/// Where an error begins. None of these is a threshold of injury: those are the scenario's [injury].
struct HandlingErrorLimits {
    double idle_beam = 3;    // beam without motion or contrast for longer [s]
    double stuck_feed = 10;  // of a device, while its tip has moved by less than a tenth of that [mm]
    double force = 1;        // of one joint on the wall [N]
    double lost = 2;         // distance from the target in radii of it [-]
    double tip_force = 0.1;  // of a catheter's tip on the wall while contrast leaves it [N]
    double pause = 0.5;      // an interruption as short as this does not make one error into two [s]
};

/// Of an injury, whose place is that of the wall.
struct InjuredWall {
    script::DeviceRole device = script::DeviceRole::Wire;
    double along = 0;      // from the branch's start along its centreline [mm]
    double threshold = 0;  // end-on force that the wall bears [N]
    std::string source;    // of the threshold
    void state(geometry::StateStream& s) { s(device, along, threshold, source); }
};

struct HandlingErrorMark {
    HandlingError kind = HandlingError::BlindMotion;
    int first = 0, last = 0;                        // frames of the run
    double start = 0;                               // of the attempt [s]
    geometry::Vec3 place = geometry::Vec3::Zero();  // of the tip, at the first frame [mm]
    std::string branch;                             // of the anatomy, there
    double amount = 0;                              // the largest so far, in the kind's unit
    std::optional<InjuredWall> wall = {};

    void state(geometry::StateStream& s) { s(kind, first, last, start, place, branch, amount, wall); }
};

/// "48 mm", "1.25 N", "5.8 s"; of an injury "1.53 N, the wall bears 1.40 N".
std::string amount_text(const HandlingErrorMark&);
/// "right renal artery"; of an injury "right renal artery, 12 mm along".
std::string place_text(const HandlingErrorMark&);
/// How many there are of each kind.
std::array<int, handling_error_kinds> counts(std::span<const HandlingErrorMark>);

/// The errors of one attempt.
class Handling {
public:
    explicit Handling(const Simulation&, const HandlingErrorLimits& = {});

    /// To be called once after each frame; begins anew with a reset.
    void observe(const Frame&);
    /// In the order in which they began.
    const std::vector<HandlingErrorMark>& marks() const { return marks_; }
    const HandlingErrorLimits& limits() const { return limits_; }
    void state(geometry::StateStream& s) {
        s(marks_, open_, idle_since_, devices_, against_stop_, was_at_target_, injects_through_, mapped_,
          map_, injuries_, open_injury_);
    }

private:
    /// What the hand has fed of a device without pulling back, and where the tip was then.
    struct Feed {
        struct Stop {
            double fed = 0;  // so far [mm]
            geometry::Vec3 tip = geometry::Vec3::Zero();
            void state(geometry::StateStream& s) { s(fed, tip); }
        };
        double inserted = 0;     // and in the bow outside, as of the last frame [mm]
        std::deque<Stop> stops;  // the last `stuck_feed` of it and one before; never empty
        double in_vain = 0;      // fed since the tip last went on [mm]
        void state(geometry::StateStream& s) { s(inserted, stops, in_vain); }
    };
    void begin(const Simulation&);
    /// Opens, extends or ends the error of this kind. `since`: the frame it began, if that was before.
    /// Without an amount it is how long the error has lasted.
    void note(HandlingError, const Frame&, bool now, std::optional<double> amount = {},
              std::optional<int> since = {});
    void note_injuries(const Frame&);
    double stuck(Feed&, script::DeviceRole, const Simulation&) const;
    void follow_roadmap(const Frame&);

    HandlingErrorLimits limits_;
    std::vector<HandlingErrorMark> marks_;
    std::array<int, handling_error_kinds> open_ = {};  // 1 + index of the last mark of a kind, 0 = none
    std::optional<int> idle_since_;                    // frame
    std::vector<Feed> devices_;
    double against_stop_ = 0;  // asked for since the stop was met [mm]
    bool was_at_target_ = false;
    script::DeviceRole injects_through_ = script::DeviceRole::All;  // All = no device
    std::optional<render::CArm> mapped_;                            // the view of the last pulse
    int map_ = 0;                         // pulses of DSA in that view since the mask
    int injuries_ = 0, open_injury_ = 0;  // seen so far; 1 + index of the last one's mark
};

/// The largest force of a joint on the wall where that is above the limit and the hand's doing: a balloon
/// that is inflated presses on the wall, and its figures are the treatment's; until the chain has come to
/// rest without it, so does what is shown. Both the error and the room's alarm go by it [N].
std::optional<double> hard_press(const Frame&, double limit = HandlingErrorLimits().force);

/// Whether a place in the vessels' frame, moved as they are now, projects into the field that the collimator
/// leaves open.
bool in_open_field(const Simulation&, const geometry::Vec3&);

/// Where the table would have to stand for the place to be at the isocentre: the arguments of `table` [mm].
geometry::Vec3 table_to_show(const Simulation&, const geometry::Vec3&);

}  // namespace exercise
