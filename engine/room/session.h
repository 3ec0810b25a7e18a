#pragma once
/// One exercise in the room, on a thread of its own: frames are made at their rate, whatever the window does;
/// or, where a page has but one, in turns that its caller gives it. Input of the hands in between becomes the
/// commands of the next frame; the result is a View that is never changed afterwards. Wall-clock time decides
/// when a frame is made, never what is in it.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "engine/anatomy/model_cache.h"
#include "engine/exercise/exercise.h"
#include "engine/exercise/model_errors.h"
#include "engine/exercise/score.h"
#include "engine/exercise/simulation.h"
#include "engine/room/attempts.h"
#include "engine/room/guide.h"
#include "engine/room/hands.h"
#include "engine/room/lesson_log.h"
#include "engine/room/sequence.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"
#include "render/panel/readout.h"

namespace room {

/// The devices as the solver left them, for the view into the patient.
struct SolverView {
    std::vector<geometry::Vec3> joints;             // [mm]
    std::vector<float> radii;                       // of what lies outermost there [mm]
    std::vector<physics::WallContact> contacts;     // of the joints
    geometry::Vec3 shift = geometry::Vec3::Zero();  // of vessels and wire in the patient [mm]
    std::vector<Eigen::Vector3f> lumen_moves;       // of its vertices, pushed aside; empty = none [mm]
    physics::RelaxReport relax;
    exercise::Tuning tuning;             // the tuning it was moved with
    std::optional<double> error;         // largest distance of a joint from where it comes to rest [mm]
    std::optional<double> tip_error;     // estimate of the foremost tip's, for λ → 0 [mm]
    exercise::ModelErrors model_errors;  // of that tip
    double motion_ms = 0, image_ms = 0;  // taken by this frame
    double frame_ms = 0;                 // time available for a frame
};

/// The state after the simulation's last frame; its times are zero. `relax` is the report of that frame. For
/// the `error`, if it is wanted, the fast solver brings a copy of the wire to rest.
SolverView solver_view(const exercise::Simulation&, const physics::RelaxReport& relax, bool error = true);

/// "tip ± 0.06 mm by segments, 0.02 by the wall's field".
std::string tip_text(const SolverView&);

using Clock = std::chrono::steady_clock;

enum class Phase { Loading, Ready, Running, Paused, Ended, Failed };
/// What a teacher stops only a teacher lets go on.
enum class Control {
    Start,
    Pause,
    Resume,
    TakeBack,
    Finish,
    SkipStep,  // of a guided lesson
    TeacherPause,
    TeacherResume,
    WatchDevices,  // the view into the patient
    WatchSolver,   // the same with what the solver did, and its error
    WatchNothing
};

/// All that the window shows of one frame.
struct View {
    Phase phase = Phase::Loading;
    double loading = 0;                                         // fraction of the loading that is done
    std::string doing;                                          // what is done during loading
    std::string error;                                          // why loading failed
    long serial = 0;                                            // number of the view
    Clock::time_point made;                                     // when it was
    long image_serial = 0;                                      // number of the image
    std::shared_ptr<const render::GrayImage> image, reference;  // null before the first
    render::Readout readout;
    exercise::Score score;
    std::vector<std::shared_ptr<const Sequence>> runs;
    bool slow = false;  // frames take longer than they should
    bool time_is_up = false;
    bool tuned = false;                      // by an instructor: the exercise no longer has a score
    bool recording = false;                  // a recording was begun and still works
    std::filesystem::path recorded;          // its file, also after it has ended; empty = none was begun
    int last_frame = -1;                     // of the script being played
    std::vector<std::string> differences;    // of a replay from its recording
    std::optional<Clock::time_point> asked;  // when the hand last requested a motion that the image shows
    int taken_back = 0;                      // times, of the last seconds
    int lost_frames = 0;                     // frames made late by more than one frame
    int frames = 0;
    std::shared_ptr<const SolverView> solver;  // while it is watched
    std::shared_ptr<const Guide> guide;        // of a guided lesson by hand; null otherwise
    bool teacher_paused = false;
    std::shared_ptr<const std::vector<LessonEvent>> events;  // null before the first frame
    PeakForces peaks;
    std::string refused;  // what a teacher asked for last and was not done, and why
    /// How the image was taken, for marks on it; none before the first.
    std::optional<render::CArm> image_arm;
    geometry::Vec3 target_in_image = geometry::Vec3::Zero();  // where the target is in that [mm]
};

struct SessionOptions {
    scenario::Scenario scenario;
    anatomy::ModelCache cache;  // its `progress` is the session's own
    KeyMap keys;
    bool free_practice = false;                   // no end at the target, and actions can be taken back
    std::optional<script::CommandScript> script;  // played instead of the hands' input
    Attempts record;                              // where hands' attempts are kept
    script::Origin origin;                        // program and learner, named in the recording
    /// Called with the file of the recording when nothing more is written to it, by who ends the session.
    /// Throws nothing.
    std::function<void(const std::filesystem::path&)> recorded = {};
    std::function<void()> wake;  // called from the session's thread when there is a new view
    bool own_thread = true;      // else nothing is done but in turn()
    double speed = 1;            // at first, of show_at()
};

class Session {
public:
    explicit Session(SessionOptions);
    /// May end at any time: a frame being made is finished first.
    ~Session();
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    /// To be called from the window's thread, which none of these delay.
    void give(const Input&, std::optional<Clock::time_point> asked = {});
    void give(Control);
    /// The window did what the action asks of it alone: a guided lesson counts it.
    void did(Action);
    /// Takes effect before the next frame; ends the recording, and the exercise then has no score.
    void give(const exercise::Tuning&);
    /// A teacher's, for the next frame, after those of the hands. What the exercise cannot do is refused in
    /// the view. Of a script's session nothing of a teacher's is taken but its pause.
    void give_command(const script::Command&);
    /// A teacher's comment on a frame that was made: kept in the recording, also of an attempt that has
    /// ended.
    void give(const script::Comment&);
    /// What the teacher lets the trainee see, from the next frame on: the recording keeps what changes.
    void give(const script::TeacherScreen&);
    /// Of a script's session: it is shown so many times faster than it was made.
    void show_at(double speed) { speed_ = speed; }
    std::shared_ptr<const View> view() const;

    /// Of a session without a thread of its own: does what is due, at first the loading, then at most one
    /// frame, and prepares a part of what later frames need. Returns when it is to be called again at the
    /// latest; empty = when something was given.
    std::optional<Clock::time_point> turn();

    const SessionOptions& options() const { return options_; }
    /// The vessels, once they are loaded; null before.
    std::shared_ptr<const anatomy::Anatomy> anatomy() const;

private:
    class Worker;

    SessionOptions options_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool stop_ = false;
    std::atomic<double> speed_ = 1;
    Input held_;   // as the keys stand, passed again with each frame
    Input since_;  // what happened since the last frame
    std::optional<Clock::time_point> asked_;
    std::vector<Control> controls_;
    std::vector<Action> deeds_;  // of the window
    std::optional<exercise::Tuning> tuning_;
    std::vector<script::Command> commands_;  // of the teacher
    std::vector<script::Comment> comments_;
    script::TeacherScreen screen_ = script::usual_screen;
    std::shared_ptr<const View> view_;
    std::shared_ptr<const anatomy::Anatomy> anatomy_;
    std::unique_ptr<Worker> worker_;  // of a session in turns
    std::thread thread_;              // last, as it starts when everything else exists
};

}  // namespace room
