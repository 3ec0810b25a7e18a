/// The pages of the window around the room: chooser, briefing, end, keys and menu.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <imgui.h>
#include <numbers>

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

std::string degrees(double radians) {
    return fmt::format("{:.0f}°", radians * 180 / std::numbers::pi);
}

std::string view_text(const render::CArm& arm) {
    return fmt::format("{} {}, {} {}, field {:.0f} mm", arm.lao < 0 ? "RAO" : "LAO",
                       degrees(std::abs(arm.lao)), arm.cranial < 0 ? "caudal" : "cranial",
                       degrees(std::abs(arm.cranial)), arm.detector_width);
}

/// What a trainee reads before the start, line by line.
std::vector<std::pair<std::string, std::string>> briefing(const scenario::Scenario& s) {
    std::vector<std::pair<std::string, std::string>> lines;
    const std::string target = s.target.name.empty() ? "a marked place" : s.target.name;
    lines.emplace_back(
        "Task", fmt::format("Bring the tip to {} (within {:g} mm) and hold it there for {:g} s.", target,
                            s.target.radius, s.target.hold));
    lines.emplace_back("Access", s.entry.end);
    for (const scenario::PlacedDevice& placed : s.devices)
        lines.emplace_back("Device", fmt::format("{}, {}: {:.0f} mm inside", placed.name(),
                                                 placed.device.title, placed.inserted));
    lines.emplace_back("View", view_text(s.c_arm));
    lines.emplace_back("Contrast", fmt::format("{:.0f} ml at most", s.blood.limit));
    lines.emplace_back("Time", s.time_limit ? fmt::format("{:.0f} s", *s.time_limit) : "no limit");
    if (s.beam_limit) lines.emplace_back("Beam", fmt::format("{:.0f} s", *s.beam_limit));
    for (const scenario::SuggestedView& view : s.lesson.views) {
        render::CArm arm = s.c_arm;
        arm.lao = view.lao;
        arm.cranial = view.cranial;
        lines.emplace_back("Look", fmt::format("{}: {}", view_text(arm), view.shows));
    }
    for (const std::string& hint : s.lesson.hints) lines.emplace_back("Hint", hint);
    return lines;
}

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

void Play::draw_chooser() {
    const float width = static_cast<float>(window_.width()), height = static_cast<float>(window_.height());
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::SetNextWindowSize(ImVec2(width, height));
    ImGui::Begin("chooser", nullptr, bare);
    wrapped(window_, Face::Title, palette::bright, "Seldinger");
    text(palette::label, fmt::format("Choose an exercise.   {}: keys   F12: instructor's view",
                                     options_.keys.text(Action::Help)));
    ImGui::Dummy(ImVec2(0, u(6)));
    const float card = u(300), picture = u(200), gap = ImGui::GetStyle().ItemSpacing.x;
    const int columns = std::max(1, static_cast<int>((width - u(24)) / (card + gap)));
    ImGui::BeginChild("cards", ImVec2(0, 0), false, ImGuiWindowFlags_NavFlattened);
    for (std::size_t k = 0; k < options_.exercises.size(); ++k) {
        const Exercise& exercise = options_.exercises[k];
        if (k % columns != 0) ImGui::SameLine();
        ImGui::PushID(static_cast<int>(k));
        ImGui::BeginChild("card", ImVec2(card, picture + u(158)), true,
                          ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NavFlattened);
        const ImVec2 corner = ImGui::GetCursorScreenPos();
        const float side = ImGui::GetContentRegionAvail().x;
        const Texture* shown = thumbnail(k);
        ImGui::Dummy(ImVec2(side, picture));
        ImDrawList& list = *ImGui::GetWindowDrawList();
        list.AddRectFilled(corner, ImVec2(corner.x + side, corner.y + picture), colour(palette::well));
        if (!shown->empty()) {
            // The middle of the picture, cut to the card's width.
            const float cut = std::max(0.0f, 1 - picture / side * shown->width() / shown->height()) / 2;
            list.AddImage(shown->id(), corner, ImVec2(corner.x + side, corner.y + picture), ImVec2(0, cut),
                          ImVec2(1, 1 - cut));
        }
        const int level = exercise.scenario.lesson.level;
        wrapped(
            window_, Face::Bold, palette::bright,
            level > 0 ? fmt::format("{}   level {}", exercise.scenario.name, level) : exercise.scenario.name);
        wrapped(palette::value, exercise.scenario.title);
        if (const room::BestResult* best = results_.find(exercise.scenario.name))
            wrapped(palette::good, best->reached == 0
                                       ? fmt::format("tried {} times, not reached yet", best->attempts)
                                       : fmt::format("best {:.0f} points{}, {} of {} reached", best->points,
                                                     best->time ? fmt::format(", {:.1f} s", *best->time) : "",
                                                     best->reached, best->attempts));
        else
            text(palette::faint, "not tried yet");
        ImGui::SetCursorPosY(picture + u(158) - ImGui::GetFrameHeight() - ImGui::GetStyle().WindowPadding.y);
        const bool opens = ImGui::Button("Exercise");
        if (k == chosen_.value_or(0)) ImGui::SetItemDefaultFocus();
        if (opens) open(k, false);
        ImGui::SameLine();
        if (ImGui::Button("Free practice")) open(k, true);
        if (exercise.solution) {
            ImGui::SameLine();
            if (ImGui::Button("Show me")) {
                chosen_ = k;
                play_solution();
            }
        }
        ImGui::EndChild();
        ImGui::PopID();
    }
    ImGui::EndChild();
    ImGui::End();
}

void Play::draw_briefing() {
    const scenario::Scenario& s = session_->options().scenario;
    begin_page(window_, "briefing", u(680));
    wrapped(window_, Face::Title, palette::bright, s.title);
    text(palette::label,
         free_practice_ ? "Free practice: no score, and the last 10 s can be taken back" : "Exercise");
    ImGui::Separator();
    if (!s.lesson.briefing.empty()) {
        wrapped(palette::value, s.lesson.briefing);
        ImGui::Dummy(ImVec2(0, u(6)));
    }
    if (ImGui::BeginTable("lines", 2)) {
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, u(80));
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed,
                                ImGui::GetContentRegionAvail().x - u(100));
        for (const auto& [name, words] : briefing(s)) {
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            text(palette::label, name);
            ImGui::TableNextColumn();
            wrapped(palette::value, words);
        }
        ImGui::EndTable();
    }
    ImGui::Dummy(ImVec2(0, u(6)));
    if (view_->phase == Phase::Failed || view_->phase == Phase::Loading) {
        draw_progress();
    } else {
        text(palette::good, "Ready");
        if (options_.record.kept())
            wrapped(palette::faint,
                    fmt::format("Each attempt is kept: {}", options_.record.wanted().string()));
        else
            wrapped(palette::caution, fmt::format("Attempts are not kept: {}", options_.record_problem));
    }
    ImGui::Dummy(ImVec2(0, u(10)));
    if (view_->phase == Phase::Ready) {
        if (ImGui::IsWindowAppearing() || !ImGui::IsAnyItemFocused()) ImGui::SetKeyboardFocusHere();
        if (ImGui::Button("Start (Enter)") ||
            ImGui::IsKeyPressed(ImGui::GetIO().KeyMap[ImGuiKey_Enter], false)) {
            screen_ = Screen::Room;
            countdown_ = room::Clock::now() + std::chrono::seconds(free_practice_ ? 0 : 3);
        }
        ImGui::SameLine();
    }
    if (ImGui::Button("Back")) leave();
    ImGui::End();
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

void Play::draw_end() {
    begin_page(window_, "end", u(680));
    const exercise::Score& score = view_->score;
    if (shows_solution_ || is_replay_)
        wrapped(window_, Face::Title, palette::bright,
                shows_solution_ ? "That was the solution. Your turn." : "The recording ends here");
    else if (free_practice_)
        wrapped(window_, Face::Title, palette::bright, "Free practice has ended");
    else
        wrapped(window_, Face::Title, score.completed ? palette::good : palette::caution,
                score.completed ? fmt::format("Target reached: {:.0f} points", grade_ ? grade_->points : 0)
                : view_->time_is_up ? "The time is over: target not reached"
                                    : "Ended: target not reached");
    text(palette::label, session_->options().scenario.title);
    ImGui::Separator();
    if (is_replay_) {
        if (view_->differences.empty()) text(palette::good, "Every recorded state was reached to the bit.");
        for (std::size_t k = 0; k < std::min<std::size_t>(8, view_->differences.size()); ++k)
            wrapped(palette::alarm, view_->differences[k]);
    }
    if (grade_ && ImGui::BeginTable("score", 4, ImGuiTableFlags_RowBg)) {
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, u(260));
        for (const char* name : {"yours", "skilled", "costs"})
            ImGui::TableSetupColumn(name, ImGuiTableColumnFlags_WidthFixed, u(96));
        // Not as headers, which keys could reach between the buttons.
        ImGui::TableNextRow();
        for (const char* name : {"", "yours", "skilled", "costs"}) {
            ImGui::TableNextColumn();
            text(palette::label, name);
        }
        for (const exercise::GradeLine& line : grade_->lines) {
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            text(palette::value, line.measure->name);
            ImGui::TableNextColumn();
            text(line.cost > 0 ? palette::caution : palette::value, exercise::own_text(line));
            ImGui::TableNextColumn();
            text(palette::label, exercise::skilled_text(line));
            ImGui::TableNextColumn();
            text(line.cost > 0 ? palette::alarm : palette::faint,
                 line.cost > 0 ? fmt::format("-{:.0f}", line.cost) : "0");
        }
        ImGui::EndTable();
        wrapped(palette::faint, exercise::grade_formula);
        const auto errors = exercise::counts(view_->score.mishaps);
        for (std::size_t k = 0; k < errors.size(); ++k)
            if (errors[k] > 0)
                wrapped(palette::caution,
                        fmt::format("{}: {}", exercise::mishap_texts[k],
                                    errors[k] == 1 ? "once" : fmt::format("{} times", errors[k])));
        for (const exercise::WrongBranch& branch : view_->score.wrong_branches)
            wrapped(palette::caution,
                    fmt::format("The tip was in {} for {:.1f} s.", branch.name, branch.seconds));
    } else if (view_->tuned) {
        text(palette::label, "The instructor changed the model: this attempt has no score.");
    } else if (free_practice_) {
        text(palette::value, fmt::format("{:.0f} s, {} times taken back", view_->readout.time.value_or(0),
                                         view_->taken_back));
    }
    if (!view_->recorded.empty())
        wrapped(palette::faint, fmt::format("Recorded: {}", view_->recorded.string()));
    if (!results_problem_.empty()) wrapped(palette::alarm, results_problem_);
    for (const render::Message& message : view_->readout.messages)
        if (message.notice == render::Notice::Alarm) wrapped(palette::alarm, message.text);
    ImGui::Dummy(ImVec2(0, u(6)));
    const std::size_t chosen = *chosen_;
    const bool has_solution = options_.exercises[chosen].solution.has_value();
    if (is_replay_ && replay_ + 1 < options_.replays.size()) {
        if (ImGui::IsWindowAppearing() || !ImGui::IsAnyItemFocused()) ImGui::SetKeyboardFocusHere();
        if (ImGui::Button(
                fmt::format("Next recording ({} of {})", replay_ + 2, options_.replays.size()).c_str())) {
            show_replay(replay_ + 1);
            ImGui::End();
            return;
        }
        ImGui::SameLine();
    }
    const bool again = ImGui::Button(is_replay_ ? "Try it yourself" : "Again");
    if (!is_replay_) ImGui::SetItemDefaultFocus();
    if (again) {
        shows_solution_ = is_replay_ = false;
        open(chosen, free_practice_);
        ImGui::End();
        return;
    }
    ImGui::SameLine();
    if (ImGui::Button("Look at the runs")) review_open_ = true;
    if (has_solution) {
        ImGui::SameLine();
        if (ImGui::Button("Show me")) {
            play_solution();
            ImGui::End();
            return;
        }
    }
    ImGui::SameLine();
    if (ImGui::Button("Other exercises")) leave();
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
        if (ImGui::Button("Instructor's view", wide)) {
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
    if (ImGui::Button("Quit", wide)) quits_ = true;
    ImGui::End();
}

}  // namespace app
