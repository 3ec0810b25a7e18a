#pragma once
/// The teacher's own window: the patient in 3D with the devices in it, what happens, comments, what the
/// patient does, what the trainee sees, and the solver. Nothing of it is drawn in the trainee's window.

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/play/patient_scene.h"
#include "app/play/solver_page.h"
#include "app/play/window.h"
#include "engine/room/session.h"

namespace app {

/// What the trainee is at, for the teacher's window.
struct Lesson {
    struct Result {
        std::string exercise;
        int level = 0;
        std::string text;  // "passed, best 84 points"; empty = not tried
    };
    std::string learner;  // empty = a guest
    std::string at;       // "chooses an exercise"
    room::Session* session = nullptr;
    std::shared_ptr<const room::View> view;  // null without a session
    bool free_practice = false;
    const std::vector<Result>* results = nullptr;  // of all exercises, in order
};

class Teacher {
public:
    /// Size of the window once it is opened [pixels].
    Teacher(int width, int height) : width_(width), height_(height) {}

    bool is_open() const { return window_ != nullptr; }
    /// Beside the trainee's, which stays activated. Throws io::InputError.
    void open(const Window& trainee);
    /// The trainee then sees what is usual.
    void close();
    /// Another session begins, or none (null).
    void attend(room::Session*);
    bool shows(script::TeacherAct::Thing thing) const { return screen_[static_cast<std::size_t>(thing)]; }

    /// Takes what was done in the window, which may close it, and notes the view.
    void hear(const Lesson&, const Window& trainee);
    /// Draws the window, if it is due and `may_draw`: while nobody waits for the trainee's. Returns how long
    /// that took [ms].
    std::optional<double> draw_if_due(const Lesson&, const Window& trainee, bool may_draw);
    /// Until it is due [s]; empty = not before something happens.
    std::optional<double> due_in() const;

private:
    using Clock = room::Clock;

    void draw(const Lesson&);
    void draw_header(const Lesson&, float height);
    void draw_patient(const Lesson&, const render::Box&);
    void draw_legend(const render::Box&) const;
    void draw_pages(const Lesson&);
    void draw_solver(const Lesson&);
    void draw_lesson(const Lesson&);
    void draw_figures(const room::View&) const;
    void draw_events(const room::View&, float height) const;
    void draw_comments(const Lesson&);
    void draw_complications(const Lesson&);
    void draw_set_now(room::Session&, const room::View&);
    void draw_vessel_complication(room::Session&, const anatomy::Anatomy&);
    void draw_screen(const Lesson&);
    void draw_results(const Lesson&);
    void say(const Lesson&, const std::string& text, int frame);
    void watch(room::Session*);
    float u(float units) const { return units * window_->unit(); }

    int width_, height_;
    std::unique_ptr<Window> window_;
    std::unique_ptr<PatientScene> scene_;
    SolverPage solver_;
    script::TeacherScreen screen_ = script::usual_screen;
    room::Control watched_ = room::Control::WatchNothing;  // by the session
    bool solver_shown_ = false;
    std::array<char, script::longest_comment + 1> typed_{};
    std::optional<int> moment_;  // frame at which the comment being typed was begun
    bool enter_ = false;         // pressed since the last drawing
    bool begins_comment_ = false;
    std::optional<std::size_t> asked_page_;                                       // by a key
    int inputs_ = 0;                                                              // comments typed so far
    script::Complicate wanted_{script::ComplicationKind::Spasm, "", 10, 20, 60};  // as the page has it
    std::string title_;
    long drawn_ = -1;       // serial of the view
    int redraw_ = 3;        // drawings that ImGui still needs
    bool touched_ = false;  // by the teacher, since the last drawing
    Clock::time_point drawn_at_{};
    double cost_ = 0;  // of a drawing [s]
};

}  // namespace app
