#pragma once
/// The room on screen: chooser, briefing, the room itself, the end page.

#include <array>
#include <atomic>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/play/glossary.h"
#include "app/play/measure.h"
#include "app/play/review.h"
#include "app/play/teacher.h"
#include "app/play/window.h"
#include "engine/exercise/grade.h"
#include "engine/room/attempts.h"
#include "engine/room/keys.h"
#include "engine/room/results.h"
#include "engine/room/session.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace app {

/// A scenario that can be chosen.
struct Exercise {
    scenario::Scenario scenario;
    std::optional<script::CommandScript> solution;
    std::filesystem::path file;     // the scenario's
    std::filesystem::path picture;  // may be missing
};

/// A recording that is shown, and the place of its exercise among those that can be chosen.
struct Replay {
    std::size_t exercise = 0;
    script::CommandScript recording;
};

/// Makes the page about an attempt and returns its file; ends early where the flag is set. Throws
/// io::InputError.
using MakeDebriefing = std::function<std::filesystem::path(
    const std::filesystem::path& recording, const scenario::Scenario&, const std::atomic<bool>& stop)>;

struct PlayOptions {
    std::vector<Exercise> exercises;   // in the order of the curriculum
    std::optional<std::size_t> start;  // this scenario at once, without the chooser
    std::vector<Replay> replays;       // shown one after the other, from the first
    room::Learners learners;
    std::optional<std::string> learner;    // who trains, "" is a guest; empty = to be chosen
    std::optional<room::Attempts> record;  // where attempts are kept, in place of the learner's folder
    std::filesystem::path measure;         // file; empty = none
    std::filesystem::path settings;        // file that remembers the window's state
    std::filesystem::path cache;           // folder of models
    room::KeyMap keys;
    bool free_practice = false;
    int width = 1280, height = 800;
    bool teacher = false;  // the teacher's window is open from the start
    int teacher_width = 1280, teacher_height = 800;
    bool open_all = false;  // every exercise is open, whatever was passed
    script::Origin origin;  // of recordings: the program
    std::string patient;    // of `start`, as scenario::load_scenario takes it; empty = the first
    /// The exercise with another patient. Throws io::InputError.
    std::function<scenario::Scenario(const Exercise&, const std::string& patient)> of_patient;
    MakeDebriefing make_debriefing;
    std::function<void(const std::filesystem::path&)> show_page;  // in a browser. Throws io::InputError
    /// Called with each attempt's file when nothing more is written to it. Throws nothing.
    std::function<void(const std::filesystem::path&)> recorded = {};
    std::function<bool()> interrupted;  // asked several times a second; true closes the window
};

class Play {
public:
    Play(Window&, PlayOptions);
    ~Play();
    /// Runs until the window is closed. Returns whether a replay differed from its recording.
    bool run();

private:
    enum class Screen { Learner, Chooser, Briefing, Room, End };

    void set_learner(const std::string&);
    /// Whether the learner may try it: its level is the first, or enough of the level before is passed.
    bool is_open(std::size_t exercise) const;
    bool has_passed(std::size_t exercise) const;
    /// The next to be tried after this one; empty when all are passed.
    std::optional<std::size_t> next_exercise(std::optional<std::size_t> after) const;
    void watch_attempt();
    void ask_debriefing();
    void watch_debriefing();

    void open(std::size_t exercise, bool free_practice, const std::string& patient = {});
    void show_replay(std::size_t number);
    void play_solution();
    void leave();  // leaves the room
    void pass_on(const Events&);
    room::Input input_of(const Events&);
    void obey(room::Action);
    void ask(room::Action);
    void answer(bool yes);
    void hear_answer(const Events&);
    void watch_session();
    void tell_guide();
    void end_attempt();
    void settle();
    bool running() const { return view_ && view_->phase == room::Phase::Running; }
    void open_teacher();
    Lesson lesson() const;
    void list_results();
    bool shows(script::TeacherAct::Thing thing) const { return teacher_.shows(thing); }

    bool draw_if_due(const Events&);
    void measure(room::Clock::time_point start);
    void draw(float seconds);
    void draw_learner();
    void draw_chooser();
    void draw_card(std::size_t exercise, float width, float picture);
    void draw_briefing();
    void draw_loading();
    void draw_progress();
    void draw_room();
    void draw_image(const render::Box&);
    void draw_column(const render::Box&);
    void draw_reference(const render::Box&);
    void draw_runs(const render::Box&);
    void draw_strip(const render::Box&);
    void draw_hint(const render::Box&);
    void draw_guide(const render::Box& image);
    void draw_guide_end();
    void draw_countdown();
    void draw_meaning();
    void point_at(const render::Canvas&, std::string_view, render::Face, render::Ink, render::Point);
    void draw_end();
    void draw_events();
    void draw_grade();
    void draw_end_buttons();
    void draw_caption(const render::Box& image);
    void draw_shown_by_teacher(const render::Box& image, float left, float top, float side);
    render::Readout shown_readout() const;
    void draw_briefing_map();
    std::optional<std::string> draw_patients();
    void draw_help();
    void draw_hands_help();
    void draw_keys_of(room::Task);
    void draw_asking();
    void draw_menu();
    Texture* thumbnail(std::size_t exercise);
    float u(float units) const { return units * window_.unit(); }
    render::Canvas canvas(render::Point origin = {0, 0});
    void load_settings();
    void save_settings() const;

    Window& window_;
    PlayOptions options_;
    std::string learner_;
    room::Results results_;
    room::Attempts attempts_;
    std::string attempts_problem_;  // why none is kept
    std::array<char, script::longest_learner + 1> typed_{};
    std::string typed_problem_;
    Screen screen_ = Screen::Learner;
    std::optional<GlossaryWord> pointed_at_;  // by the mouse, among what was drawn in this frame
    room::Clock::time_point still_since_;     // the mouse
    std::optional<std::size_t> chosen_;
    std::size_t replay_ = 0;  // number of the one that is shown
    std::string patient_;     // of the exercise; empty = the first
    bool free_practice_ = false, shows_solution_ = false, is_replay_ = false;
    std::unique_ptr<room::Session> session_;
    std::shared_ptr<const room::View> view_;
    std::optional<Replay> watched_;  // the learner's own attempt, shown once more
    std::atomic<bool> debriefing_stops_ = false;
    std::future<std::filesystem::path> debriefing_;
    std::string debriefing_text_;
    std::optional<exercise::Grade> grade_;
    bool settled_ = false;  // the attempt is among the results
    std::string results_problem_;
    std::optional<room::Clock::time_point> countdown_;
    bool help_ = false, menu_ = false, review_open_ = false, hints_ = true;
    std::array<bool, 3> were_open_{};  // review, help and menu, when the guide was last told
    bool quits_ = false, differed_ = false;
    std::optional<room::Action> asking_;  // whether it is meant; the exercise waits meanwhile
    bool ran_ = false;                    // before it asked
    bool used_left_ = false;              // the left hand, in this exercise
    int hint_ = 0;
    std::size_t hints_shown_ = 0;  // of the briefing
    bool start_focused_ = false;   // its button, once there is one
    double drag_up_ = 0, drag_right_ = 0, arm_lao_ = 0, arm_cranial_ = 0, table_left_ = 0, table_head_ = 0;
    Texture image_, reference_;
    std::vector<std::unique_ptr<Texture>> thumbnails_;
    std::map<int, std::unique_ptr<Texture>> run_pictures_;  // by the run's number
    Review review_;
    Teacher teacher_;
    std::vector<Lesson::Result> lesson_results_;  // of the learner, for the teacher
    std::string teacher_problem_;
    Measure measure_;
    std::optional<room::Clock::time_point> measured_;
    long drawn_serial_ = -1, drawn_image_ = -1;
    int redraw_ = 3;  // frames still to be drawn: ImGui settles in three
    room::Clock::time_point opened_, drawn_at_;
    std::string title_;
};

}  // namespace app
