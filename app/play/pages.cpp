/// The pages of the window around the room: learner, chooser, loading and menu.

#include <algorithm>
#include <fmt/format.h>
#include <imgui.h>

#include "app/play/play.h"
#include "app/play/theme.h"
#include "engine/io/files.h"
#include "render/picture/png.h"

namespace app {
namespace {

namespace palette = render::palette;
using render::Face;
using room::Action;
using room::Phase;

}  // namespace

Texture* Play::thumbnail(std::size_t exercise) {
    std::unique_ptr<Texture>& texture = thumbnails_[exercise];
    if (!texture) {
        texture = std::make_unique<Texture>(window_.gl());
        try {
            io::require_no_device(options_.exercises[exercise].picture);
            texture->show(render::read_png(options_.exercises[exercise].picture), 1);
        } catch (const std::exception&) {
            // The card stays without a picture.
        }
    }
    return texture.get();
}

/// Who trains: kept names, a new one, or a guest.
void Play::draw_learner() {
    begin_page(window_, "learner", u(460));
    wrapped(window_, Face::Title, palette::bright, "Seldinger");
    text(palette::label, "Who is training?");
    ImGui::Separator();
    const auto goes_on_as = [&](const std::string& name) {
        set_learner(name);
        typed_.fill(0);
        typed_problem_.clear();
        screen_ = Screen::Chooser;
    };
    const ImVec2 wide(-1, 0);
    const std::vector<std::string> names = options_.learners.names();
    const bool appears = ImGui::IsWindowAppearing();
    if (!names.empty()) {
        const float rows = static_cast<float>(std::min<std::size_t>(names.size(), 10));
        ImGui::BeginChild("names", ImVec2(0, rows * ImGui::GetFrameHeightWithSpacing()), false,
                          ImGuiWindowFlags_NavFlattened);
        for (std::size_t k = 0; k < names.size(); ++k) {
            ImGui::PushID(static_cast<int>(k));
            if (appears && k == 0) ImGui::SetKeyboardFocusHere();
            if (ImGui::Button(names[k].c_str(), wide)) goes_on_as(names[k]);
            ImGui::PopID();
        }
        ImGui::EndChild();
    }
    if (ImGui::Button("Guest", wide)) goes_on_as("");
    ImGui::Dummy(ImVec2(0, u(6)));
    text(palette::label, names.empty() ? "Your name; without one you are a guest:" : "Another name:");
    ImGui::SetNextItemWidth(-u(90));
    if (appears && names.empty()) ImGui::SetKeyboardFocusHere();
    const bool entered =
        ImGui::InputText("##name", typed_.data(), typed_.size(), ImGuiInputTextFlags_EnterReturnsTrue);
    ImGui::SameLine();
    if (ImGui::Button("Begin", wide) || entered) {
        const std::string name = typed_.data();
        if (name.empty() || script::is_learner(name))
            goes_on_as(name);
        else
            typed_problem_ =
                fmt::format("expected a name of 1 to {} letters, found '{}'", script::longest_learner, name);
    }
    if (!typed_problem_.empty()) wrapped(palette::alarm, typed_problem_);
    wrapped(palette::faint, "Attempts, results and progress are kept for each name on this computer.");
    ImGui::End();
}

void Play::draw_chooser() {
    const float width = static_cast<float>(window_.width()), height = static_cast<float>(window_.height());
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::SetNextWindowSize(ImVec2(width, height));
    ImGui::Begin("chooser", nullptr, bare);
    wrapped(window_, Face::Title, palette::bright, "Seldinger");
    std::size_t of_path = 0, passed = 0;
    for (std::size_t k = 0; k < options_.exercises.size(); ++k) {
        of_path += options_.exercises[k].scenario.lesson.level > 0;
        passed += options_.exercises[k].scenario.lesson.level > 0 && has_passed(k);
    }
    text(palette::label,
         fmt::format("{}: {} of {} exercises passed, each with {:.0f} points or more.   {}: keys",
                     learner_.empty() ? "Guest" : learner_, passed, of_path, room::pass_mark,
                     options_.keys.text(Action::Help)));
    const std::optional<std::size_t> next = next_exercise({});
    if (next) {
        const std::string words = "Next for you: " + options_.exercises[*next].scenario.title;
        if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
        if (ImGui::Button(words.c_str())) open(*next, false);
        ImGui::SetItemDefaultFocus();
        ImGui::SameLine();
    }
    if (ImGui::Button("Another learner")) screen_ = Screen::Learner;
    ImGui::Dummy(ImVec2(0, u(4)));
    const float card = u(300), picture = u(200), gap = ImGui::GetStyle().ItemSpacing.x;
    // As many as fit, as wide as the window has room for.
    const float room = width - 2 * ImGui::GetStyle().WindowPadding.x - ImGui::GetStyle().ScrollbarSize;
    const int columns = std::max(1, static_cast<int>((room + gap) / (card + gap)));
    const float wide =
        std::floor((room - gap * static_cast<float>(columns - 1)) / static_cast<float>(columns));
    ImGui::BeginChild("cards", ImVec2(0, 0), false, ImGuiWindowFlags_NavFlattened);
    int level = -1, column = 0;
    for (std::size_t k = 0; k < options_.exercises.size() && screen_ == Screen::Chooser; ++k) {
        const int its_level = options_.exercises[k].scenario.lesson.level;
        if (its_level != level) {
            level = its_level;
            column = 0;
            wrapped(window_, Face::Bold, palette::calm,
                    level > 0 ? fmt::format("Level {} of {}", level, scenario::Lesson::levels)
                              : std::string("Exercises of your own"));
        }
        if (column++ % columns != 0) ImGui::SameLine();
        ImGui::PushID(static_cast<int>(k));
        draw_card(k, wide, picture);
        ImGui::PopID();
    }
    ImGui::EndChild();
    ImGui::End();
}

void Play::draw_card(std::size_t k, float width, float picture) {
    const Exercise& exercise = options_.exercises[k];
    ImGui::BeginChild("card", ImVec2(width, picture + u(122)), true,
                      ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NavFlattened);
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const float side = ImGui::GetContentRegionAvail().x;
    const Texture* shown = thumbnail(k);
    const bool opens = is_open(k);
    ImGui::Dummy(ImVec2(side, picture));
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.AddRectFilled(corner, ImVec2(corner.x + side, corner.y + picture), colour(palette::well));
    if (!shown->empty()) {
        // The middle of the picture, cut to the card's width.
        const float cut = std::max(0.0f, 1 - picture / side * shown->width() / shown->height()) / 2;
        list.AddImage(texture_id(shown->id()), corner, ImVec2(corner.x + side, corner.y + picture),
                      ImVec2(0, cut), ImVec2(1, 1 - cut),
                      opens ? IM_COL32_WHITE : IM_COL32(255, 255, 255, 90));
    }
    wrapped(window_, Face::Bold, opens ? palette::bright : palette::label, exercise.scenario.title);
    const room::BestResult* best = results_.find(exercise.scenario.name);
    if (!opens)
        wrapped(palette::faint, fmt::format("Opens when two thirds of level {} are passed",
                                            exercise.scenario.lesson.level - 1));
    else if (!best)
        text(palette::faint, "not tried yet");
    else if (exercise.scenario.lesson.guided())
        wrapped(best->passed > 0 ? palette::good : palette::caution,
                fmt::format("{}{} of {} steps done", best->passed > 0 ? "passed: " : "", best->steps,
                            exercise.scenario.lesson.steps.size()));
    else
        wrapped(
            best->passed > 0 ? palette::good : palette::caution,
            best->reached == 0
                ? fmt::format("tried {}, not reached yet",
                              best->attempts == 1 ? "once" : fmt::format("{} times", best->attempts))
                : fmt::format("{}best {:.0f} points{}, {} of {} reached", best->passed > 0 ? "passed: " : "",
                              best->points, best->time ? fmt::format(", {:.1f} s", *best->time) : "",
                              best->reached, best->attempts));
    if (best && !best->patients.empty() && opens)
        text(palette::faint, fmt::format("{} other patient{} tried", best->patients.size(),
                                         best->patients.size() == 1 ? "" : "s"));
    ImGui::SetCursorPosY(picture + u(122) - ImGui::GetFrameHeight() - ImGui::GetStyle().WindowPadding.y);
    bool chosen = false, free = false, shows = false;
    if (opens) {
        chosen = ImGui::Button("Exercise");
        ImGui::SameLine();
    }
    free = ImGui::Button("Free practice");
    if (exercise.solution) {
        ImGui::SameLine();
        shows = ImGui::Button("Show me");
    }
    ImGui::EndChild();
    if (chosen || free) open(k, free);
    if (shows) {
        chosen_ = k;
        play_solution();
    }
}

void Play::draw_progress() {
    if (view_->phase == Phase::Failed) {
        wrapped(palette::alarm, view_->error);
        return;
    }
    text(palette::label, view_->doing.empty() ? "Loading the vessels" : view_->doing);
    ImGui::ProgressBar(static_cast<float>(view_->loading), ImVec2(-1, 0));
}

void Play::draw_loading() {
    begin_page(window_, "loading", u(460));
    draw_progress();
    if (view_->phase == Phase::Failed && ImGui::Button("Back")) leave();
    ImGui::End();
}

void Play::draw_menu() {
    begin_page(window_, "menu", u(300));
    const ImVec2 wide(-1, 0);
    const auto go_on = [&] {
        menu_ = false;
        if (session_) session_->give(room::Control::Resume);
    };
    if (ImGui::Button("Go on", wide)) go_on();
    if (ImGui::Button("Keys", wide)) help_ = true;
    if (ImGui::Checkbox("Hints", &hints_)) {
        hint_ = 0;
        save_settings();
    }
    if (session_ && screen_ == Screen::Room) {
        if (ImGui::Button(teacher_.is_open() ? "Close the teacher's window" : "Teacher's window", wide)) {
            go_on();
            obey(Action::Instructor);
        }
        if (ImGui::Button("Look at the runs", wide)) {
            go_on();
            review_open_ = true;
        }
        if (ImGui::Button("End the exercise", wide)) {
            menu_ = false;
            session_->give(room::Control::Finish);
        }
        if (ImGui::Button("Other exercises", wide)) leave();
    }
    if (ImGui::Checkbox("All exercises open (teacher)", &options_.open_all)) save_settings();
    if (ImGui::Button("Quit", wide)) quits_ = true;
    ImGui::End();
}

}  // namespace app
