#pragma once
/// What an attempt is judged by; what that is worth is in grade.h. An attempt is completed at the first frame
/// at which the tip has stayed within the target's radius for the hold. Time is frame divided by frame rate.
/// Also how smoothly the tip moves, and the branches it went into although they do not lead to the target,
/// and what a teacher did to screen and clock.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/exercise/dose.h"
#include "engine/exercise/frame.h"
#include "engine/exercise/handling.h"
#include "engine/exercise/treatment_score.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"
#include "physics/geometry/state.h"

namespace exercise {

struct TeacherMark {
    script::TeacherAct act;
    int frame = 0;       // of the run
    double seconds = 0;  // of the attempt, at the frame's end

    void state(geometry::StateStream& s) { s(act.thing, act.on, frame, seconds); }
};

/// As in score.json: one of script::teacher_things, or "paused".
std::string id_of(const script::TeacherAct&);
/// Whether the act shows what the trainee has to find.
bool helps(const script::TeacherAct&);
/// "target shown", "hints hidden", "paused".
std::string text_of(const script::TeacherAct&);
/// "0:31".
std::string moment_text(double seconds);
/// "target shown at 0:31, target hidden at 0:45"; empty for none.
std::string text_of(std::span<const TeacherMark>);
/// What stands before that: "helped by the teacher" where one of them helps, else "by the teacher".
std::string heading_of(std::span<const TeacherMark>);

struct WrongBranch {
    std::string name;  // of the anatomy
    int entries = 0;
    double seconds = 0;  // that the tip was in it

    void state(geometry::StateStream& s) { s(name, entries, seconds); }
};

/// Branches of the way from the tip at the start to the target, along the centrelines, are right, all others
/// wrong. A tip is in a wrong branch when that is the nearest and the tip is a millimetre or more outside the
/// right ones; it has left when it is inside a right one again. To come back from a branch into its parent is
/// no entry.
class WrongTurns {
public:
    WrongTurns(const anatomy::Anatomy&, const geometry::Vec3& start, const geometry::Vec3& target);

    /// `seconds`: since the last call, which the tip spent where it is [s].
    void observe(const anatomy::Anatomy&, const geometry::Vec3& tip, double seconds);
    /// In the order of their first entry.
    const std::vector<WrongBranch>& branches() const { return found_; }
    void state(geometry::StateStream& s) { s(found_, inside_); }

private:
    std::vector<bool> right_;  // of each branch
    std::vector<WrongBranch> found_;
    int inside_ = -1;  // the wrong branch that the tip is in
};

/// Spectral arc length (Balasubramanian 2012): −∫ of the arc of the speed's normalised spectrum up to 10 Hz,
/// or to half the rate where that is less, from the first to the last frequency with at least 5 % of the
/// greatest; the speed is padded by zeros to 16 times its length or more. Near −1.4 for one smooth stroke,
/// the lower the more the speed changes. Empty for fewer than two frames, for a tip that never moves, and for
/// more than `most_smooth_frames`. `speed` [mm/s], `rate` of its frames [1/s].
inline constexpr std::size_t most_smooth_frames = std::size_t{1} << 18;  // 4.9 hours of 15 frames a second
std::optional<double> spectral_arc_length(std::span<const double> speed, double rate);

/// Log dimensionless jerk (Balasubramanian 2015): −ln(T³/v_max² · Σ (d²v/dt²)² Δt), differences of second
/// order. The lower the less smooth. Empty for fewer than three frames or a speed without a second
/// derivative.
std::optional<double> log_dimensionless_jerk(std::span<const double> speed, double rate);

/// The deepest contact of an attempt and what explains it: penetration · stiffness = force.
struct DeepestContact {
    double penetration = 0;  // [mm]
    int joint = -1;
    int frame = -1;
    double stiffness = 0;  // [N/mm]
    double force = 0;      // [N]

    void state(geometry::StateStream& s) { s(penetration, joint, frame, stiffness, force); }
};

/// A complication that a teacher set: an event of the attempt, and no error.
struct SetByTeacher {
    Complication what;
    std::string branch, text;        // as files and as clinicians say it
    double set = 0;                  // from the attempt's start [s]
    std::optional<double> relieved;  // [s]

    void state(geometry::StateStream& s) { s(what, branch, text, set, relieved); }
};

/// Covers the attempt since the start or the last reset; `frames` and `resets` cover the whole run.
struct Score {
    std::string scenario;
    bool completed = false;
    std::optional<double> completed_after;  // from the attempt's start, as the room's clock runs [s]
    std::optional<double> completion_time;  // of it, from the first motion of a device [s]
    double beam_on_time = 0;                // [s]
    int pulses = 0;                         // of the beam
    int runs = 0;                           // times that DSA was begun
    int cine_runs = 0;                      // times that cine was begun
    int views = 0;                          // of the C-arm and table, in which there were pulses
    /// Dose to the patient; empty when no images were made, as these alone determine what the tube must
    /// deliver.
    std::optional<double> air_kerma;     // K_a,r at the reference point [mGy]
    std::optional<double> area_product;  // P_KA [Gy·cm²]
    std::optional<Dose> dose;            // the same by mode; only Exercise::with_dose() gives it
    double contrast = 0;                 // given [ml]
    int angiograms = 0;                  // injections that a pulse showed
    double wire_travel = 0;              // Σ|Δs| of the inserted length s [mm]
    double advanced = 0, withdrawn = 0;  // its two parts [mm]
    double back_and_forth_ratio = 0;     // (Σ|Δs| − |ΣΔs|) / Σ|Δs| [-]
    int reversals = 0;                   // changes between advancing and withdrawing
    double rotation = 0;                 // Σ|angle| of the hub [rad]
    double idle_fraction = 0;    // of the frames from the first motion to completion, without motion [-]
    double tip_path = 0;         // distance travelled by the tip over the frames [mm]
    double path_efficiency = 0;  // distance from start to tip along the centreline / tip_path [-]
    double mean_tip_speed = 0;   // over the frames with motion, up to completion [mm/s]
    /// Smoothness of the tip's speed from the first motion to completion, or to the end, where these are not
    /// more than `most_smooth_frames`; only Scorer::finish() computes it.
    std::optional<double> spectral_arc_length, log_dimensionless_jerk;
    double peak_wall_force = 0;     // of one joint [N]
    double mean_wall_force = 0;     // mean over the frames of the largest of one joint [N]
    double time_over_force = 0;     // with a joint above HandlingErrorLimits::force [s]
    double wall_force_impulse = 0;  // ∫ of the forces of all joints dt [N·s]
    DeepestContact deepest;
    int buckled_frames = 0;    // in which a push bowed the shaft outside and was not passed on
    double tip_to_target = 0;  // at the end [mm]
    std::vector<WrongBranch> wrong_branches;
    std::vector<HandlingErrorMark> handling_errors;  // errors of handling
    std::vector<SetByTeacher> set_by_teacher;
    /// Where there is something to treat, or to treat with.
    std::optional<TreatmentScore> treatment;
    std::vector<TeacherMark> teacher;  // what a teacher showed, hid or stopped; costs nothing
    double duration = 0;               // of the attempt [s]
    int resets = 0;
    int frames = 0;
    bool interrupted = false;  // by the user, before the script's end

    int wrong_entries() const;
    void state(geometry::StateStream&);
};

class Scorer {
public:
    explicit Scorer(const Simulation&);
    /// To be called once after each frame.
    void observe(const Frame&);
    bool completed() const { return score_.completed; }
    /// Of the attempt so far, without smoothness.
    Score score() const;
    /// The same with smoothness, which takes a Fourier transform over the attempt.
    Score finish() const;
    /// Attempts that a reset has ended, in order.
    std::span<const Score> earlier() const { return earlier_; }
    void state(geometry::StateStream& s) {
        s(score_, earlier_, handling_, turns_, first_motion_, on_target_since_, net_insertion_, direction_,
          first_tip_, last_tip_, shortest_, speeds_, active_frames_, moving_frames_, moving_path_, frames_,
          beam_frames_, frames_over_force_, force_sum_, mode_, views_, injects_, shown_, last_injection_,
          screen_);
        s.beside(cine_runs_on_, treated_);
        s.unless_empty(ballooned_);
    }

private:
    void begin(const Simulation&);
    void observe_console(const Frame&);
    void observe_motion(const Frame&);
    void observe_wall(const Frame&);
    void observe_target(const Frame&);
    void observe_teacher(const Frame&);
    void observe_treatment(const Simulation&);

    Score score_;
    std::vector<Score> earlier_;
    Handling handling_;
    WrongTurns turns_;
    bool injects_ = false, shown_ = false;  // contrast ran in the last frame; a pulse has shown it
    std::optional<double> last_injection_;  // when it last ran [s]
    int beam_frames_ = 0, frames_over_force_ = 0;
    double frame_time_ = 0, hold_ = 0, target_radius_ = 0;  // [s], [s], [mm]
    std::optional<double> first_motion_, on_target_since_;  // [s] of the attempt
    double net_insertion_ = 0;                              // [mm]
    int direction_ = 0;
    geometry::Vec3 first_tip_ = geometry::Vec3::Zero(), last_tip_ = geometry::Vec3::Zero();
    double shortest_ = 0;        // along centrelines from the first tip to the last [mm]
    std::vector<float> speeds_;  // of the tip, from the first motion to completion [mm/s]; none when too many
    int active_frames_ = 0;      // from the first motion to completion
    int moving_frames_ = 0;      // among those
    double moving_path_ = 0;     // of the tip in these [mm]
    int frames_ = 0;             // of the attempt
    double force_sum_ = 0;       // of the largest force of each frame [N]
    script::ImagingMode mode_ = script::ImagingMode::Live;  // of the last pulse
    bool cine_runs_on_ = false;  // the last pulse was of cine, and the pedal has stayed down
    std::vector<render::CArm> views_;
    std::vector<Ballooned> ballooned_;  // of each lesion; empty before the first inflation
    std::uint64_t treated_ = 0;         // hash of what the score of the treatment was made of
    script::TeacherScreen screen_ =
        script::usual_screen;  // as a teacher has left it, also from one attempt to the next
};

}  // namespace exercise
