#include "engine/room/session.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <deque>
#include <fmt/format.h>
#include <limits>

#include "engine/exercise/room_readout.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/room/attempts.h"
#include "physics/geometry/state.h"
#include "physics/relax/relaxer.h"

namespace room {
namespace {

/// Largest distance of a joint from where the fast solver brings it to rest [mm].
double distance_from_rest(const exercise::Simulation& simulation) {
    physics::Chain rest = simulation.wire();
    physics::RelaxerConfig config;
    if (!simulation.wall().smooth()) config.tolerance = 1e-3;
    physics::make_relaxer(config, simulation.wall())->relax(rest, {400 * rest.segments(), 0, 0});
    double largest = 0;
    for (std::size_t i = 0; i < rest.joints.size(); ++i)
        largest = std::max(largest, (rest.joints[i] - simulation.wire().joints[i]).norm());
    return largest;
}

constexpr double take_back_time = 10;  // [s]
constexpr double slow_for = 1;         // for which the strip says so [s]

double milliseconds(Clock::duration d) {
    return std::chrono::duration<double, std::milli>(d).count();
}

}  // namespace

SolverView solver_view(const exercise::Simulation& simulation, const physics::RelaxReport& relax,
                       bool error) {
    SolverView view;
    view.joints.assign(simulation.wire().joints.begin(), simulation.wire().joints.end());
    const physics::Chain& chain = simulation.wire();
    for (std::size_t i = 0; i < chain.joints.size(); ++i)
        view.radii.push_back(
            static_cast<float>(chain.inner_radius() + (i < chain.thickness.size() ? chain.thickness[i] : 0)));
    view.contacts.assign(simulation.contacts().begin(), simulation.contacts().end());
    view.shift = simulation.vessel_shift();
    constexpr double seen = 0.1;  // [mm]
    if (simulation.farthest_vessel_move() > seen || !simulation.narrowed_lumen().empty())
        view.lumen_moves = simulation.lumen_moves();
    view.relax = relax;
    view.tuning = simulation.tuning();
    if (error) view.error = distance_from_rest(simulation);
    if (const auto estimate = simulation.tip_error()) view.tip_error = estimate->tip;
    view.model_errors = exercise::model_errors(simulation);
    return view;
}

std::string tip_text(const SolverView& view) {
    std::string text = view.tip_error ? fmt::format("tip ± {:.2g} mm by segments", *view.tip_error)
                                      : "tip ± unknown by segments";
    const auto add = [&text](const std::optional<double>& error, const char* by) {
        if (error) text += fmt::format(", {:.2g} by {}", *error, by);
    };
    add(view.model_errors.wall, "the wall's field");
    add(view.model_errors.vessels, "vessels that stay");
    add(view.model_errors.twist, "rigid shafts");
    return text;
}

/// Lives on the session's thread, except for the mailboxes.
class Session::Worker {
public:
    explicit Worker(Session& session)
        : session_(session),
          options_(session.options_),
          period_(1 / options_.scenario.frame_rate),
          hands_(options_.keys, period_) {
        const scenario::Lesson& lesson = options_.scenario.lesson;
        if (lesson.guided() && !options_.script && !options_.free_practice) guide_.emplace(lesson.steps);
        show_guide();
    }

    /// Until the session ends.
    void run() {
        guarded([this] {
            load();
            for (;;) {
                if (view_.phase == Phase::Running) draw_ahead(next_);
                {
                    std::unique_lock lock(session_.mutex_);
                    const auto called = [this] { return session_.stop_ || has_mail(); };
                    if (view_.phase == Phase::Running)
                        session_.changed_.wait_until(lock, next_, called);
                    else
                        session_.changed_.wait(lock, called);
                    if (session_.stop_) break;
                }
                go_on();
            }
            finish();
        });
    }

    /// Session::turn().
    std::optional<Clock::time_point> turn() {
        guarded([this] {
            if (!exercise_) return load();
            const long frame = view_.frames;
            go_on();
            if (view_.phase == Phase::Running && view_.frames == frame) draw_ahead(next_, 1);
        });
        if (view_.phase != Phase::Running) return {};
        return is_prepared_ ? next_ : Clock::now();
    }
    void end() {
        guarded([this] {
            if (exercise_) finish();
        });
    }

private:
    template <class Work>
    void guarded(const Work& work) {
        try {
            work();
        } catch (const std::exception& error) {
            view_.phase = Phase::Failed;
            view_.error = error.what();
            publish();
        }
    }

    void load() {
        if (view_.phase == Phase::Failed) return;
        if (options_.record.kept()) options_.record.require_writable();
        anatomy::ModelCache cache = options_.cache;
        cache.progress = [this](double part, const char* what) {
            view_.loading = part;
            view_.doing = what;
            publish();
            const std::lock_guard lock(session_.mutex_);
            if (session_.stop_) throw io::InputError("loading was given up");  // nobody waits for it any more
        };
        publish();
        exercise_.emplace(options_.scenario, true, cache);
        const auto anatomy = std::make_shared<anatomy::Anatomy>(exercise_->simulation().anatomy());
        {
            const std::lock_guard lock(session_.mutex_);
            session_.anatomy_ = anatomy;
        }
        if (options_.script) {
            const script::CommandScript& script = *options_.script;
            auto wrong = script::problems(script, options_.scenario.c_arm, options_.scenario.frame_rate);
            for (const std::string& text : exercise_->simulation().problems(script)) wrong.push_back(text);
            if (!wrong.empty()) throw io::InputError(io::joined(wrong, "\n"));
            view_.last_frame =
                script.last_frame(static_cast<int>(std::ceil(options_.scenario.target.hold / period_)) + 1);
        }
        // The first exposure of a view takes longer than a frame.
        const exercise::Exercise::Snapshot start = exercise_->snapshot();
        exercise_->next_frame(std::vector<script::Command>{script::Beam{true}});
        exercise_->image();
        while (exercise_->monitor()->draw_ahead()) {
        }
        exercise_->restore(start);
        view_.loading = 1;
        view_.phase = Phase::Ready;
        view_.readout.title = options_.scenario.title;
        remember();
        publish();
    }

    bool has_mail() const {
        return !session_.controls_.empty() || !session_.deeds_.empty() || session_.tuning_ ||
               !session_.comments_.empty();
    }

    /// Does what was asked for, and makes the frame that is due.
    void go_on() {
        std::vector<Control> controls;
        std::vector<Action> deeds;
        std::optional<exercise::Tuning> tuning;
        std::vector<script::Comment> comments;
        {
            const std::lock_guard lock(session_.mutex_);
            controls.swap(session_.controls_);
            deeds.swap(session_.deeds_);
            tuning = std::exchange(session_.tuning_, {});
            comments.swap(session_.comments_);
        }
        if (tuning) retune(*tuning);
        for (const script::Comment& comment : comments) keep(comment);
        const bool stood = view_.phase != Phase::Running;
        for (const Control control : controls) obey(control);
        for (const Action deed : deeds) guide_did(deed);
        if (stood) next_ = Clock::now();
        if (!controls.empty() || !deeds.empty() || !comments.empty() || tuning) publish();
        if (view_.phase != Phase::Running) return;
        const auto now = Clock::now();
        if (now < next_) return;
        const auto period = std::chrono::duration_cast<Clock::duration>(
            std::chrono::duration<double>(period_ / session_.speed_));
        if (now > next_ + period) {
            ++view_.lost_frames;
            slow_until_ =
                now + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(slow_for));
            next_ = now;  // a delay is not made up: no frame is skipped to catch up
        }
        next_ += period;
        view_.slow = now < slow_until_ && session_.speed_ <= 1;
        is_prepared_ = false;
        frame();
    }

    /// Uses the time before the next frame for what later ones need, while the beam is on: up to `most` parts
    /// of it.
    void draw_ahead(Clock::time_point next, int most = std::numeric_limits<int>::max()) {
        is_prepared_ = true;
        if (!exercise_->simulation().console().beam_on()) return;
        int parts = 0;
        for (auto now = Clock::now(); now + longest_part_ < next;) {
            if (parts++ == most) {
                is_prepared_ = false;
                return;
            }
            if (!exercise_->monitor()->draw_ahead()) return;
            const auto then = Clock::now();
            longest_part_ = std::max(longest_part_, then - now);
            now = then;
        }
    }

    void obey(Control control) {
        switch (control) {
            case Control::Start:
                if (view_.phase == Phase::Ready) view_.phase = Phase::Running;
                break;
            case Control::TeacherPause:
                if (view_.phase != Phase::Running && view_.phase != Phase::Paused) break;
                view_.teacher_paused = teacher_stopped_ = true;
                [[fallthrough]];
            case Control::Pause:
                if (view_.phase == Phase::Running) view_.phase = Phase::Paused;
                view_.readout.beam_on = false;
                hands_.rest();
                break;
            case Control::TeacherResume:
                view_.teacher_paused = false;
                [[fallthrough]];
            case Control::Resume:
                if (view_.phase == Phase::Paused && !view_.teacher_paused) view_.phase = Phase::Running;
                break;
            case Control::TakeBack:
                take_back();
                break;
            case Control::Finish:
                if (view_.phase == Phase::Running || view_.phase == Phase::Paused) finish();
                break;
            case Control::WatchDevices:
            case Control::WatchSolver:
            case Control::WatchNothing:
                watch_ = control;
                if (watch_ == Control::WatchNothing) view_.solver.reset();
                break;
            case Control::SkipStep:
                if (guide_) guide_->skip();
                show_guide();
                break;
        }
    }

    void guide_did(Action deed) {
        if (guide_) guide_->did(deed);
        show_guide();
    }
    void show_guide() {
        if (guide_) view_.guide = std::make_shared<const Guide>(*guide_);
    }
    /// A lesson has no score, and what was done can be taken back, as in free practice.
    bool takes_back() const { return options_.free_practice || guide_; }
    /// Whether hands have done all that the exercise asks.
    bool is_completed() const { return view_.score.completed && (!guide_ || guide_->over()); }

    void frame() {
        const int index = exercise_->frame() + 1;
        Messages messages;
        std::optional<Clock::time_point> asked;
        std::vector<script::Command> commands;
        Input input;
        const Situation before = guided_situation();
        if (options_.script) {
            for (const script::TimedCommand& timed : options_.script->at(index))
                commands.push_back(timed.command);
        } else {
            {
                const std::lock_guard lock(session_.mutex_);
                input = session_.held_;
                input.add(session_.since_);
                input.push = session_.held_.push;
                input.turn = session_.held_.turn;
                session_.since_ = {};
                asked = std::exchange(session_.asked_, {});
            }
            commands = hands_.commands(input, exercise_->simulation(), last_, messages);
            add_commands_of_teacher(commands);
        }

        begin_recording();
        const auto start = Clock::now();
        const exercise::Frame made = exercise_->next_frame(commands);
        last_ = made.motion;
        const auto moved = Clock::now();
        recording_.frame(index, commands, [this] { return state_hash(); });
        readout_.observe(made, exercise_->score());
        for (render::Message& said : messages) readout_.say(std::move(said.text), said.notice);
        log_.observe(made, exercise_->score());
        if (options_.script) log_comments_of_script(index);

        const bool moves = std::ranges::any_of(commands, [](const script::Command& c) {
            return std::holds_alternative<script::Advance>(c) ||
                   std::holds_alternative<script::Withdraw>(c) || std::holds_alternative<script::Rotate>(c);
        });
        if (moves && asked) waiting_ = asked;
        if (made.motion.console.pulse || made.motion.reset || (view_.image && !made.mask_shifts.empty())) {
            view_.image = std::make_shared<const render::GrayImage>(exercise_->image());
            ++view_.image_serial;
            if (made.motion.console.pulse && waiting_) view_.asked = std::exchange(waiting_, {});
            if (const render::GrayImage* reference = made.monitor->reference()) {
                if (!view_.reference || made.motion.console.reference)
                    view_.reference = std::make_shared<const render::GrayImage>(*reference);
            } else {
                view_.reference.reset();
            }
        } else if (made.motion.console.reference && made.monitor->reference()) {
            view_.reference = std::make_shared<const render::GrayImage>(*made.monitor->reference());
        }
        sequences_.observe(made, *exercise_->monitor(), view_.image);
        const auto shown = Clock::now();

        view_.runs = sequences_.runs();
        view_.score = exercise_->score();
        if (guide_) {
            guide_->count(
                effects_of(before, guided_situation(), input, made, options_.keys, view_.score.completed));
            show_guide();
        }
        view_.readout = readout_.read(made, view_.score);
        // No console knows where the target is.
        if (!options_.free_practice) view_.readout.tip_to_target.reset();
        show_hands();
        view_.frames = index + 1;
        view_.peaks = log_.peaks();
        keep_view_of_image(made);
        if (watch_ != Control::WatchNothing) {
            SolverView solver =
                solver_view(made.simulation, made.motion.relax, watch_ == Control::WatchSolver);
            solver.motion_ms = milliseconds(moved - start);
            solver.image_ms = milliseconds(shown - moved);
            solver.frame_ms = period_ * 1000;
            view_.solver = std::make_shared<const SolverView>(std::move(solver));
        }
        if (options_.script) check(index);
        view_.time_is_up = exercise_->time_is_up();
        const bool over = options_.script ? index >= view_.last_frame || view_.time_is_up
                                          : !options_.free_practice && (is_completed() || view_.time_is_up);
        if (over)
            finish();
        else if (takes_back() && index % whole_second() == 0)
            remember();
        publish();
    }

    Situation guided_situation() const {
        return guide_ ? situation_of(exercise_->simulation(), hands_.grasp()) : Situation();
    }

    /// What the teacher asked for since the last frame, where the exercise can do it.
    void add_commands_of_teacher(std::vector<script::Command>& commands) {
        using Thing = script::TeacherAct::Thing;
        std::vector<script::Command> asked;
        script::TeacherScreen screen;
        {
            const std::lock_guard lock(session_.mutex_);
            asked.swap(session_.commands_);
            screen = session_.screen_;
        }
        for (std::size_t k = 0; k < screen.size(); ++k)
            if (std::exchange(screen_[k], screen[k]) != screen[k])
                commands.push_back(script::TeacherAct{static_cast<Thing>(k), screen[k]});
        if (std::exchange(teacher_stopped_, false)) commands.push_back(script::TeacherAct{Thing::Paused});
        if (!asked.empty()) view_.refused.clear();
        for (const script::Command& command : asked) {
            script::CommandScript alone;
            alone.commands.push_back({exercise_->frame() + 1, command, {}});
            const auto problems = exercise_->simulation().problems(alone);
            if (problems.empty())
                commands.push_back(command);
            else
                view_.refused = io::joined(problems, "; ");
        }
    }

    /// On a frame that was made, also after the end.
    void keep(const script::Comment& comment) {
        view_.refused.clear();
        if (comment.frame > exercise_->frame() || options_.script) {
            view_.refused = "A comment is kept of a frame that hands have made";
            return;
        }
        log_.comment(comment);
        if (!recording_.comment(comment))
            view_.refused = "This comment is in no recording: none is kept of its frame";
    }

    void log_comments_of_script(int index) {
        for (const script::Comment& comment : options_.script->comments)
            if (comment.frame == index) log_.comment(comment);
    }

    void keep_view_of_image(const exercise::Frame& frame) {
        if (!frame.motion.console.pulse) return;
        view_.image_arm = frame.monitor->last_pulse()->arm;
        view_.target_in_image = frame.simulation.place_now(frame.simulation.target());
    }

    void show_hands() {
        const Grasp* grasp = hands_.grasp();
        if (!grasp || grasp->devices() == 1) return;
        const auto name = [grasp](Side side) {
            return grasp->in(side) ? std::string(script::name_of(*grasp->in(side))) : std::string();
        };
        view_.readout.held = name(Side::Right);
        view_.readout.left_hand = name(Side::Left);
        view_.readout.helper = grasp->helper_text();
    }

    int whole_second() const { return std::max(1, static_cast<int>(std::lround(1 / period_))); }

    /// Before the first frame and not at the briefing: an attempt that nobody makes leaves no file.
    void begin_recording() {
        if (!std::exchange(is_first_frame_, false) || !options_.record.kept()) return;
        script::RecordingHeader header{options_.origin};
        header.origin.free_practice = options_.free_practice;
        exercise::identify(header.origin, exercise_->simulation());
        recording_.begin(options_.record, options_.scenario.name, std::move(header));
    }

    std::uint64_t state_hash() const { return exercise_->simulation().state_hash(); }

    void remember() {
        if (!takes_back()) return;
        moments_.push_back({exercise_->snapshot(), geometry::state_of(readout_), exercise_->frame()});
        if (moments_.size() > take_back_time + 2) moments_.pop_front();
    }

    void take_back() {
        if (!takes_back()) {
            readout_.say("What was done is taken back in free practice and guided lessons only",
                         render::Notice::Warning);
            return;
        }
        if ((view_.phase != Phase::Running && view_.phase != Phase::Paused) || moments_.empty()) return;
        const int wanted = exercise_->frame() - static_cast<int>(std::lround(take_back_time / period_));
        while (moments_.size() > 1 && moments_.back().frame > wanted &&
               moments_[moments_.size() - 2].frame >= std::min(wanted, moments_.front().frame))
            moments_.pop_back();
        const Moment& moment = moments_.back();
        exercise_->restore(moment.exercise);
        geometry::restore_state(readout_, moment.readout);
        ++view_.taken_back;
        hands_.rest();
        last_ = {};
        recording_.take_back(moment.frame);
        log_.take_back(moment.frame, exercise_->score());
        view_.frames = moment.frame + 1;
        view_.image = std::make_shared<const render::GrayImage>(exercise_->image());
        ++view_.image_serial;
        readout_.say("The last seconds were taken back", render::Notice::Info);
        guide_did(Action::TakeBack);
    }

    void retune(const exercise::Tuning& tuning) {
        if (view_.phase != Phase::Running && view_.phase != Phase::Paused) return;
        anatomy::ModelCache cache;
        cache.folder = options_.cache.folder;
        try {
            exercise_->retune(tuning, cache);
        } catch (const io::InputError& error) {
            readout_.say(error.what(), render::Notice::Warning);
            return;
        }
        view_.tuned = true;
        moments_.clear();  // they belong to another model
        last_ = {};
        if (!recording_.works()) return;
        close_recording();
        readout_.say("The recording ends here: the model was changed", render::Notice::Warning);
    }

    void check(int index) {
        for (const script::StateCheck& known : options_.script->checks) {
            if (known.frame != index) continue;
            const std::uint64_t hash = state_hash();
            if (hash != known.hash)
                view_.differences.push_back(
                    io::located(known.place, fmt::format("frame {} has state {}, recorded was {}", index,
                                                         io::hash_text(hash), io::hash_text(known.hash))));
        }
    }

    void close_recording() {
        if (guide_) recording_.practised(guide_->done(), static_cast<int>(guide_->size()));
        recording_.close([this] { return state_hash(); });
    }

    void finish() {
        close_recording();
        if (view_.phase == Phase::Running || view_.phase == Phase::Paused) view_.phase = Phase::Ended;
        view_.readout.beam_on = false;  // nobody is at the pedal any more
    }

    void publish() {
        ++view_.serial;
        view_.made = Clock::now();
        view_.readout.messages = readout_.messages();
        view_.recorded = recording_.file();
        view_.recording = recording_.works();
        if (!view_.events || told_ != log_.version()) {
            view_.events = std::make_shared<const std::vector<LessonEvent>>(log_.events());
            told_ = log_.version();
        }
        auto view = std::make_shared<const View>(view_);
        {
            const std::lock_guard lock(session_.mutex_);
            session_.view_ = std::move(view);
        }
        if (options_.wake) options_.wake();
    }

    struct Moment {  // a state that can be restored
        exercise::Exercise::Snapshot exercise;
        std::vector<std::byte> readout;
        int frame = -1;
    };

    Session& session_;
    const SessionOptions& options_;
    double period_;  // of frames [s]
    Hands hands_;
    std::optional<exercise::Exercise> exercise_;
    AttemptRecording recording_{
        [this](std::string why) { readout_.say(std::move(why), render::Notice::Alarm); }};
    exercise::RoomReadout readout_;
    exercise::StepReport last_;
    Sequences sequences_;
    std::deque<Moment> moments_;
    std::optional<Guide> guide_;
    std::optional<Clock::time_point> waiting_;  // of input that a pulse has yet to show
    Clock::duration longest_part_{};            // of what is drawn ahead
    bool is_prepared_ = false;                  // nothing more can be drawn ahead of the next frame
    Clock::time_point next_{}, slow_until_{};   // when the next frame is due
    LessonLog log_;
    long told_ = -1;  // version of the log in the view
    Control watch_ = Control::WatchNothing;
    script::TeacherScreen screen_ = script::usual_screen;  // as the recording has it
    bool teacher_stopped_ = false;                         // since the last frame
    bool is_first_frame_ = true;
    View view_;
};

Session::Session(SessionOptions options)
    : options_(std::move(options)), speed_(options_.speed), view_(std::make_shared<const View>()) {
    if (options_.own_thread)
        thread_ = std::thread([this] { Worker(*this).run(); });
    else
        worker_ = std::make_unique<Worker>(*this);
}

Session::~Session() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    if (worker_) worker_->end();
    if (thread_.joinable()) thread_.join();
    if (options_.recorded && !view_->recorded.empty()) options_.recorded(view_->recorded);
}

std::optional<Clock::time_point> Session::turn() {
    assert(worker_);
    return worker_->turn();
}

}  // namespace room
