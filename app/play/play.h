#pragma once
/// The room on screen: chooser, briefing, the room itself, the end page.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/play/instructor.h"
#include "app/play/review.h"
#include "app/play/window.h"
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

struct PlayOptions {
    std::vector<Exercise> exercises;
    std::optional<std::size_t> start;        // this scenario at once, without the chooser
    std::vector<Replay> replays;             // shown one after the other, from the first
    room::Attempts record;                   // where attempts are kept
    std::string record_problem;              // why they are not, though nobody asked for that
    std::filesystem::path results, measure;  // files; empty = none
    std::filesystem::path settings;          // file that remembers the window's state
    std::filesystem::path cache;             // folder of models
    room::KeyMap keys;
    bool free_practice = false;
    int width = 1280, height = 800;
    script::Origin origin;              // of recordings: program and learner
    std::function<bool()> interrupted;  // asked several times a second; true closes the window
};

/// How responsive the window was, for --measure.
class Measure {
public:
    void interface(double ms) { interface_.push_back(ms); }
    void latency(double ms) { latency_.push_back(ms); }
    void first_image(double seconds) {
        if (!first_) first_ = seconds;
    }
    /// Writes JSON. Throws io::InputError.
    void write(const std::filesystem::path&, int frames, int lost) const;

private:
    std::vector<double> interface_, latency_;  // [ms]
    std::optional<double> first_;              // [s]
};

class Play {
public:
    Play(Window&, PlayOptions);
    /// Runs until the window is closed. Returns whether a replay differed from its recording.
    bool run();

private:
    enum class Screen { Chooser, Briefing, Room, End };

    void open(std::size_t exercise, bool free_practice);
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
    void end_attempt();
    void settle();
    bool running() const { return view_ && view_->phase == room::Phase::Running; }

    void draw(float seconds);
    void draw_chooser();
    void draw_briefing();
    void draw_loading();
    void draw_progress();
    void draw_room();
    void draw_image(const render::Box&);
    void draw_column(const render::Box&);
    void draw_reference(const render::Box&);
    void draw_strip(const render::Box&);
    void draw_hint(const render::Box&);
    void draw_countdown();
    void draw_end();
    void draw_help();
    void draw_hands_help();
    void draw_keys_of(room::Task);
    void draw_asking();
    void draw_menu();
    Texture* thumbnail(std::size_t exercise);
    float choose_unit() const;
    float u(float units) const { return units * window_.unit(); }
    render::Canvas canvas(render::Point origin = {0, 0}) const;
    bool load_settings() const;
    void save_settings() const;

    Window& window_;
    PlayOptions options_;
    room::Results results_;
    Screen screen_ = Screen::Chooser;
    std::optional<std::size_t> chosen_;
    std::size_t replay_ = 0;  // number of the one that is shown
    bool free_practice_ = false, shows_solution_ = false, is_replay_ = false;
    std::unique_ptr<room::Session> session_;
    std::shared_ptr<const room::View> view_;
    std::optional<exercise::Grade> grade_;
    std::string results_problem_;
    std::optional<room::Clock::time_point> countdown_;
    bool help_ = false, menu_ = false, review_open_ = false, instructor_open_ = false, hints_ = true;
    bool quits_ = false, differed_ = false;
    std::optional<room::Action> asking_;  // whether it is meant; the exercise waits meanwhile
    bool ran_ = false;                    // before it asked
    bool used_left_ = false;              // the left hand, in this exercise
    int hint_ = 0;
    double drag_up_ = 0, drag_right_ = 0, arm_lao_ = 0, arm_cranial_ = 0, table_left_ = 0, table_head_ = 0;
    Texture image_, reference_;
    std::vector<std::unique_ptr<Texture>> thumbnails_;
    Review review_;
    Instructor instructor_;
    Measure measure_;
    std::optional<room::Clock::time_point> measured_;
    long drawn_serial_ = -1, drawn_image_ = -1;
    int redraw_ = 3;  // frames still to be drawn: ImGui settles in three
    room::Clock::time_point opened_, drawn_at_;
    std::string title_;
};

}  // namespace app
