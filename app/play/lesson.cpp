/// What the teacher's window is told of the trainee's, and what the trainee's shows because the teacher says
/// so.

#include <algorithm>
#include <fmt/format.h>
#include <imgui.h>

#include "app/play/map.h"
#include "app/play/play.h"
#include "app/play/theme.h"
#include "engine/io/error.h"

namespace app {
namespace {

namespace palette = render::palette;
using room::Phase;
using Thing = script::TeacherAct::Thing;

}  // namespace

void Play::open_teacher() {
    try {
        teacher_.open(window_);
        teacher_problem_.clear();
    } catch (const io::InputError& error) {
        teacher_problem_ = error.what();
    }
}

/// Of all exercises, in order.
void Play::list_results() {
    lesson_results_.clear();
    for (const Exercise& exercise : options_.exercises) {
        Lesson::Result& result = lesson_results_.emplace_back();
        result.exercise = exercise.scenario.title;
        result.level = exercise.scenario.lesson.level;
        if (const room::BestResult* best = results_.find(exercise.scenario.name))
            result.text = best->passed > 0    ? fmt::format("passed, best {:.0f} points", best->points)
                          : best->reached > 0 ? fmt::format("reached, best {:.0f} points", best->points)
                                              : fmt::format("tried {} times", best->attempts);
    }
}

Lesson Play::lesson() const {
    Lesson lesson;
    lesson.learner = learner_;
    lesson.session = session_.get();
    lesson.view = session_ ? view_ : nullptr;
    lesson.results = &lesson_results_;
    const auto phase = [&] {
        if (countdown_) return "begins";
        if (asking_) return "is asked whether to end it";
        switch (view_ ? view_->phase : Phase::Loading) {
            case Phase::Paused:
                return view_->teacher_paused ? "stopped by you" : "paused";
            case Phase::Ended:
                return "ended";
            case Phase::Failed:
                return "failed to load";
            case Phase::Loading:
                return "is loaded";
            default:
                return "runs";
        }
    };
    switch (screen_) {
        case Screen::Learner:
            lesson.at = "says who trains";
            break;
        case Screen::Chooser:
            lesson.at = "chooses an exercise";
            break;
        case Screen::Briefing:
            lesson.at = "reads the briefing";
            break;
        case Screen::Room:
            lesson.at = is_replay_        ? "a recording is shown"
                        : shows_solution_ ? "the solution is shown"
                                          : phase();
            break;
        case Screen::End:
            lesson.at = "reads the result";
            break;
    }
    return lesson;
}

/// Without what the teacher hides.
render::Readout Play::shown_readout() const {
    render::Readout readout = view_->readout;
    if (shows(Thing::Readouts)) return readout;
    readout.tip_to_target.reset();
    readout.tip_force.reset();
    readout.largest_wall_force.reset();
    readout.force_history.clear();
    for (render::Readout::Device& device : readout.devices) {
        device.push_force.reset();
        device.torque.reset();
    }
    return readout;
}

/// `left`, `top` and `side`: of the image, which the target is marked in, on the screen [pixels].
void Play::draw_shown_by_teacher(const render::Box& area, float left, float top, float side) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const float unit = window_.unit();
    const scenario::Scenario& s = session_->options().scenario;
    const auto anatomy = session_->anatomy();
    if (!anatomy) return;
    if (shows(Thing::Target) && view_->image_arm) {
        const render::CArm& arm = *view_->image_arm;
        const render::Pixel at = render::project(arm, view_->target_in_image);
        const float per_pixel = side / static_cast<float>(arm.pixels);
        if (at.depth > 0) {
            const ImVec2 place(left + static_cast<float>(at.x) * per_pixel,
                               top + static_cast<float>(at.y) * per_pixel);
            const double shadow = s.target.radius * arm.sid / at.depth / render::pixel_width(arm);
            list.PushClipRect(ImVec2(left, top), ImVec2(left + side, top + side), true);
            list.AddCircle(place, std::max(6 * unit, static_cast<float>(shadow) * per_pixel),
                           colour(palette::good), 40, 2 * unit);
            list.PopClipRect();
        }
    }
    if (!shows(Thing::Way)) return;
    const float wide = std::min(u(230), 0.42f * side);
    const render::Box corner{area.left + u(8), area.bottom - wide - u(64), area.left + u(8) + wide,
                             area.bottom - u(64)};
    draw_map(list, corner, unit, room::way_map(s, *anatomy, view_->image_arm.value_or(s.c_arm)));
    list.AddRect(ImVec2(corner.left, corner.top), ImVec2(corner.right, corner.bottom), colour(palette::rule));
}

}  // namespace app
