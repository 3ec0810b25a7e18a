#include "app/play/teacher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <imgui.h>
#include <utility>

#include "app/play/theme.h"
#include "engine/room/way_map.h"
#include "render/panel/readout.h"

namespace app {
namespace {

namespace palette = render::palette;
using render::Face;
using room::Control;
using room::Phase;

/// In the order of the keys that open them: F1, F2, ...
constexpr std::array page_names = {"Lesson", "Patient", "Trainee sees", "Results", "Solver"};

/// Between drawings for what the exercise does, and for what the teacher does [s].
constexpr double while_watching = 0.1, while_touched = 1.0 / 30;
/// Of the time is for drawing at most a part of this size [-].
constexpr double largest_fraction = 0.25;

double in_seconds(room::Clock::duration d) {
    return std::chrono::duration<double>(d).count();
}

}  // namespace

void Teacher::open(const Window& trainee) {
    if (is_open()) return;
    try {
        window_ = std::make_unique<Window>(Window::Place{width_, height_, &trainee}, "Teacher's window");
        scene_ = std::make_unique<PatientScene>(window_->gl());
    } catch (...) {
        scene_.reset();
        window_.reset();
        trainee.activate();
        throw;
    }
    screen_[static_cast<std::size_t>(script::TeacherAct::Thing::Window)] = true;
    redraw_ = 3;
    title_.clear();
    drawn_at_ = {};
    trainee.activate();
}

void Teacher::close() {
    if (!is_open()) return;
    window_->activate();
    scene_.reset();
    window_.reset();
    screen_ = script::usual_screen;
    moment_.reset();
    typed_.fill(0);
}

void Teacher::attend(room::Session* session) {
    solver_.reset();
    if (scene_) scene_->reset();
    moment_.reset();
    typed_.fill(0);
    drawn_ = -1;
    redraw_ = 3;
    watched_ = Control::WatchNothing;
    watch(session);
}

/// Tells the session what is seen of it and shown to the trainee.
void Teacher::watch(room::Session* session) {
    if (!session) return;
    session->give(screen_);
    const Control wanted = !is_open()      ? Control::WatchNothing
                           : solver_shown_ ? Control::WatchSolver
                                           : Control::WatchDevices;
    if (wanted != watched_) session->give(watched_ = wanted);
}

void Teacher::hear(const Lesson& lesson, const Window& trainee) {
    if (is_open()) {
        const Events events = window_->take_events();
        if (events.any) {
            touched_ = true;
            redraw_ = 3;
        }
        for (const room::Key key : events.pressed) {
            const std::string_view name = room::key_names()[static_cast<std::size_t>(key)];
            enter_ = enter_ || name == "Enter" || name == "KeypadEnter";
            for (std::size_t k = 0; k < page_names.size(); ++k)
                if (name == fmt::format("F{}", k + 1)) asked_page_ = k;
        }
        if (window_->wants_to_close()) {
            close();
            trainee.activate();
        }
    }
    if (!is_open() && lesson.session && lesson.view && lesson.view->teacher_paused)
        lesson.session->give(Control::TeacherResume);
    watch(lesson.session);
    if (lesson.view && is_open()) solver_.observe(*lesson.view);
}

std::optional<double> Teacher::due_in() const {
    if (!is_open() || redraw_ == 0 || !window_->can_be_seen()) return {};
    const double between = std::max(touched_ ? while_touched : while_watching, cost_ / largest_fraction);
    return std::max(0.0, between - in_seconds(Clock::now() - drawn_at_));
}

std::optional<double> Teacher::draw_if_due(const Lesson& lesson, const Window& trainee, bool may_draw) {
    if (!is_open()) return {};
    if (lesson.view && lesson.view->serial != drawn_) redraw_ = std::max(redraw_, 1);
    const std::optional<double> due = due_in();
    if (!may_draw || !due || *due > 0) return {};
    const std::string title =
        fmt::format("Teacher's window - {}", lesson.learner.empty() ? "guest" : lesson.learner);
    if (title != title_) window_->set_title(title_ = title);
    const auto start = Clock::now();
    window_->begin_frame(window_->fitting_unit());
    draw(lesson);
    window_->end_frame();
    trainee.activate();
    drawn_at_ = start;
    cost_ = in_seconds(Clock::now() - start);
    if (--redraw_ == 0) touched_ = false;
    enter_ = false;
    if (lesson.view) drawn_ = lesson.view->serial;
    return 1000 * cost_;
}

void Teacher::draw(const Lesson& lesson) {
    const float width = static_cast<float>(window_->width()), height = static_cast<float>(window_->height());
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
    const float head = u(52), pages = std::clamp(0.42f * width, std::min(u(400), 0.6f * width), u(640));
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::SetNextWindowSize(ImVec2(width, head));
    ImGui::Begin("head", nullptr, bare | ImGuiWindowFlags_NoBringToFrontOnFocus);
    draw_header(lesson, head);
    ImGui::End();
    draw_patient(lesson, {0, head, width - pages, height});
    ImGui::SetNextWindowPos(ImVec2(width - pages, head));
    ImGui::SetNextWindowSize(ImVec2(pages, height - head));
    ImGui::Begin("pages", nullptr, bare);
    draw_pages(lesson);
    ImGui::End();
    ImGui::PopStyleVar(2);
}

/// Who, what, how far; and the pause.
void Teacher::draw_header(const Lesson& lesson, float height) {
    const room::View* view = lesson.view.get();
    const bool goes = view && (view->phase == Phase::Running || view->phase == Phase::Paused);
    ImGui::SetCursorPosY((height - ImGui::GetFrameHeight()) / 2);
    ImGui::AlignTextToFramePadding();
    ImGui::PushFont(window_->faces().fonts[static_cast<std::size_t>(Face::Bold)]);
    text(palette::bright, lesson.learner.empty() ? "Guest" : lesson.learner);
    ImGui::PopFont();
    ImGui::SameLine();
    std::string words = lesson.session
                            ? fmt::format("{}: {}", lesson.session->options().scenario.title, lesson.at)
                            : lesson.at;
    if (goes) words += "   " + render::clock_text(view->readout.time);
    text(palette::label, words);
    if (!goes) return;
    const bool stopped = view->phase == Phase::Paused;
    const char* name = stopped ? "Let the trainee go on" : "Stop the trainee's clock";
    const float wide = ImGui::CalcTextSize(name).x + 2 * ImGui::GetStyle().FramePadding.x;
    ImGui::SameLine(static_cast<float>(window_->width()) - wide - ImGui::GetStyle().WindowPadding.x);
    if (ImGui::Button(name)) lesson.session->give(stopped ? Control::TeacherResume : Control::TeacherPause);
}

void Teacher::draw_patient(const Lesson& lesson, const render::Box& area) {
    ImGui::SetNextWindowPos(ImVec2(area.left, area.top));
    ImGui::SetNextWindowSize(ImVec2(area.right - area.left, area.bottom - area.top));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
    ImGui::Begin("patient", nullptr, bare | ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::PopStyleVar();
    const auto anatomy = lesson.session ? lesson.session->anatomy() : nullptr;
    if (anatomy && lesson.view) {
        const scenario::Target& goal = lesson.session->options().scenario.target;
        const int columns = std::max(16, static_cast<int>(area.right - area.left)),
                  rows = std::max(16, static_cast<int>(area.bottom - area.top));
        const GLuint picture = scene_->picture(*lesson.view, *anatomy, room::target_of(goal, *anatomy),
                                               goal.radius, columns, rows);
        ImGui::SetCursorPos(ImVec2(0, 0));
        ImGui::Image(texture_id(picture), ImVec2(static_cast<float>(columns), static_cast<float>(rows)),
                     ImVec2(0, 1), ImVec2(1, 0));
        const ImGuiIO& io = ImGui::GetIO();
        if (ImGui::IsItemHovered()) {
            if (io.MouseWheel != 0) scene_->zoom(io.MouseWheel > 0 ? 0.85f : 1.18f);
            if (ImGui::IsMouseDown(0) && (io.MouseDelta.x != 0 || io.MouseDelta.y != 0))
                scene_->turn(0.008f * io.MouseDelta.x, 0.008f * io.MouseDelta.y);
        }
        draw_legend(area);
    } else {
        ImGui::SetCursorPos(ImVec2(u(16), u(14)));
        wrapped(palette::faint, lesson.session ? "The vessels are being loaded."
                                               : "The vessels are shown once an exercise is chosen.");
    }
    ImGui::End();
}

void Teacher::draw_legend(const render::Box& area) const {
    ImDrawList& list = *ImGui::GetWindowDrawList();
    constexpr int shades = 40;
    const float wide = std::min(u(180), area.right - area.left - u(28)), left = area.left + u(14),
                top = area.bottom - u(24);
    for (int k = 0; k < shades; ++k) {
        const float step = wide / shades;
        list.AddRectFilled(ImVec2(left + k * step, top), ImVec2(left + (k + 1) * step, top + u(8)),
                           colour(room::legend_colour(k / (shades - 1.0))));
    }
    const ImVec2 at(left, top - u(5) - ImGui::GetTextLineHeight());
    list.AddText(at, colour(palette::label), (room::force_legend() + "; drag turns, wheel zooms").c_str());
}

void Teacher::draw_pages(const Lesson& lesson) {
    solver_shown_ = false;
    if (!ImGui::BeginTabBar("tabs")) return;
    const std::optional<std::size_t> asked = std::exchange(asked_page_, {});
    constexpr std::array<void (Teacher::*)(const Lesson&), page_names.size()> pages = {
        &Teacher::draw_lesson, &Teacher::draw_complications, &Teacher::draw_screen, &Teacher::draw_results,
        &Teacher::draw_solver};
    for (std::size_t k = 0; k < pages.size(); ++k) {
        const ImGuiTabItemFlags chosen = asked == k ? ImGuiTabItemFlags_SetSelected : ImGuiTabItemFlags_None;
        if (!ImGui::BeginTabItem(page_names[k], nullptr, chosen)) continue;
        ImGui::BeginChild("page");
        (this->*pages[k])(lesson);
        ImGui::EndChild();
        ImGui::EndTabItem();
    }
    ImGui::EndTabBar();
}

void Teacher::draw_solver(const Lesson& lesson) {
    solver_shown_ = true;
    if (!lesson.session || !lesson.view) return wrapped(palette::faint, "It shows an exercise that runs.");
    const Phase phase = lesson.view->phase;
    const auto asked =
        solver_.draw(*lesson.view, phase == Phase::Running || phase == Phase::Paused, window_->unit());
    if (asked) lesson.session->give(*asked);
}

}  // namespace app
