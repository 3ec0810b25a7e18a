/// What comes after an attempt: its grade, what happened when and what to do instead, and where to go next.
/// The final image stays beside it.

#include <algorithm>
#include <fmt/format.h>
#include <imgui.h>

#include "app/play/play.h"
#include "app/play/theme.h"
#include "engine/exercise/grade.h"
#include "engine/room/words.h"
#include "render/panel/readout.h"

namespace app {
namespace {

namespace palette = render::palette;
using render::Face;

}  // namespace

/// Where the errors happened; each is a way into the images of its moment.
void Play::draw_events() {
    const exercise::Score& score = view_->score;
    if (const std::string words = room::teacher_text(score); !words.empty()) wrapped(palette::calm, words);
    if (view_->events)
        for (const room::LessonEvent& event : *view_->events)
            if (event.kind == room::LessonEvent::Kind::Comment)
                wrapped(palette::beam,
                        fmt::format("{}  The teacher: {}", render::clock_text(event.seconds), event.what));
    if (score.handling_errors.empty() && score.wrong_branches.empty()) {
        if (score.frames > 0) text(palette::good, room::without_error);
        return;
    }
    for (std::size_t k = 0; k < score.handling_errors.size(); ++k) {
        const exercise::HandlingErrorMark& mark = score.handling_errors[k];
        const auto kind = static_cast<std::size_t>(mark.kind);
        ImGui::PushID(static_cast<int>(k));
        if (ImGui::SmallButton(render::clock_text(mark.start).c_str())) {
            review_open_ = true;
            review_.go_to(view_->runs, mark.first);
        }
        ImGui::SameLine();
        wrapped(palette::caution, room::error_text(mark));
        wrapped(palette::label, exercise::handling_error_advice[kind]);
        ImGui::PopID();
    }
    for (const exercise::WrongBranch& branch : score.wrong_branches)
        wrapped(palette::caution, room::wrong_branch_text(branch));
    if (!score.handling_errors.empty()) wrapped(palette::faint, room::times_open);
}

void Play::draw_grade() {
    if (view_->guide) return draw_guide_end();
    const exercise::Score& score = view_->score;
    const scenario::Benchmark& skilled = session_->options().scenario.lesson.benchmark;
    if (!skilled.given()) {
        wrapped(palette::label, room::without_benchmark(score));
        return;
    }
    const exercise::Grade made = grade_ ? *grade_ : exercise::grade(score, skilled);
    if (ImGui::BeginTable("score", 4, ImGuiTableFlags_RowBg | ImGuiTableFlags_SizingStretchProp)) {
        for (const float fraction : {4.0f, 2.0f, 3.1f, 0.9f})
            ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, fraction);
        // Not as headers, which keys could reach between the buttons.
        ImGui::TableNextRow();
        for (const char* name : {"", shows_solution_ || is_replay_ ? "here" : "yours", "skilled", "costs"}) {
            ImGui::TableNextColumn();
            text(palette::label, name);
        }
        for (const exercise::GradeLine& line : made.lines) {
            const bool costs = line.cost >= 0.5;
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            wrapped(palette::value, line.measure->name);
            ImGui::TableNextColumn();
            text(costs ? palette::caution : palette::value, exercise::own_text(line));
            ImGui::TableNextColumn();
            text(palette::label, exercise::skilled_text(line));
            ImGui::TableNextColumn();
            text(costs ? palette::alarm : palette::faint, costs ? fmt::format("-{:.0f}", line.cost) : "0");
        }
        if (made.cost_of_injuries() > 0) {
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            text(palette::alarm, "Injuries of the wall");
            ImGui::TableNextColumn();
            text(palette::alarm, std::to_string(made.dissections + made.perforations));
            ImGui::TableNextColumn();
            ImGui::TableNextColumn();
            text(palette::alarm, fmt::format("-{:.0f}", made.cost_of_injuries()));
        }
        ImGui::EndTable();
    }
    if (shows_solution_ || is_replay_) return;
    bool blind = false;
    for (const exercise::GradeLine& line : made.lines) blind = blind || line.unseen;
    if (blind) wrapped(palette::value, exercise::blind_advice);
    for (const exercise::GradeLine& line : made.lines)
        if (line.cost >= 2 && !line.unseen && std::string_view(line.measure->id) != "errors")
            wrapped(palette::label, fmt::format("{}: {}", line.measure->name, line.measure->advice));
    wrapped(palette::faint,
            fmt::format("Skilled: {} attempts{} by {}. Time runs from the start, as in the strip.",
                        skilled.attempts, patient_.empty() ? "" : " at the first patient", skilled.by));
    if (ImGui::TreeNode("How points are lost, and what is known of these figures")) {
        wrapped(palette::faint, exercise::grade_formula);
        for (const exercise::Measure& measure : exercise::measures())
            wrapped(palette::faint,
                    fmt::format("{}: separates the experienced? {}.", measure.name, measure.evidence));
        ImGui::TreePop();
    }
}

/// The buttons of the page's foot; one of them may leave the page.
void Play::draw_end_buttons() {
    const std::size_t chosen = *chosen_;
    const bool more = is_replay_ && !watched_ && replay_ + 1 < options_.replays.size();
    const bool own = !view_->recorded.empty() && !view_->recording && !free_practice_;
    const auto next = next_exercise(chosen);
    std::function<void()> act;
    if (more) {
        if (ImGui::IsWindowAppearing() || !ImGui::IsAnyItemFocused()) ImGui::SetKeyboardFocusHere();
        if (ImGui::Button(
                fmt::format("Next recording ({} of {})", replay_ + 2, options_.replays.size()).c_str()))
            act = [this] { show_replay(replay_ + 1); };
        ImGui::SameLine();
    }
    if (ImGui::Button(is_replay_ || shows_solution_ ? "Try it yourself" : "Again"))
        act = [this, chosen] {
            shows_solution_ = is_replay_ = false;
            watched_.reset();
            open(chosen, free_practice_, std::string(patient_));
        };
    if (!more) ImGui::SetItemDefaultFocus();
    if (next && !is_replay_ && !shows_solution_) {
        ImGui::SameLine();
        if (ImGui::Button("Next exercise")) act = [this, next] { open(*next, false); };
    }
    if (options_.exercises[chosen].solution && !shows_solution_) {
        ImGui::SameLine();
        if (ImGui::Button("Show me")) act = [this] { play_solution(); };
    }
    ImGui::SameLine();
    if (ImGui::Button("Other exercises")) act = [this] { leave(); };
    if (own && !is_replay_ && !shows_solution_) {
        if (ImGui::Button("Watch my attempt")) act = [this] { watch_attempt(); };
        ImGui::SameLine();
        if (options_.make_debriefing) {
            if (ImGui::Button("Debriefing")) ask_debriefing();
            ImGui::SameLine();
        }
    }
    if (ImGui::Button("Look at the runs")) review_open_ = true;
    if (act) act();
}

void Play::draw_end() {
    const float width = static_cast<float>(window_.width()), height = static_cast<float>(window_.height());
    // The image keeps what the page leaves it.
    const float wanted = u(520), page = std::max(std::min(wanted, width), width - height);
    const float left = width - std::min(page, width);
    if (left >= u(120)) draw_image({0, 0, left, height});
    ImGui::SetNextWindowPos(ImVec2(left, 0));
    ImGui::SetNextWindowSize(ImVec2(width - left, height));
    ImGui::SetNextWindowBgAlpha(0.97f);
    ImGui::Begin("end", nullptr, bare);
    const exercise::Score& score = view_->score;
    if (shows_solution_ || is_replay_)
        wrapped(window_, Face::Title, palette::bright,
                shows_solution_ ? "That was the solution. Your turn." : "The recording ends here");
    else
        wrapped(window_, Face::Title,
                free_practice_                                      ? palette::bright
                : room::is_lesson_passed(*view_) || score.completed ? palette::good
                                                                    : palette::caution,
                room::outcome(*view_, grade_, free_practice_));
    const scenario::Scenario& shown = session_->options().scenario;
    wrapped(palette::label,
            fmt::format("{}{}   {}", shown.title, shown.patient.empty() ? "" : ", " + shown.patient_text(),
                        learner_.empty() || is_replay_ || shows_solution_ ? "" : learner_));
    ImGui::Separator();
    const float foot = 2 * ImGui::GetFrameHeightWithSpacing() + u(8);
    ImGui::BeginChild("what", ImVec2(0, -foot), false, ImGuiWindowFlags_NavFlattened);
    if (is_replay_) {
        if (view_->differences.empty()) text(palette::good, "Every recorded state was reached to the bit.");
        for (std::size_t k = 0; k < std::min<std::size_t>(8, view_->differences.size()); ++k)
            wrapped(palette::alarm, view_->differences[k]);
    }
    if (view_->tuned)
        text(palette::label, "The teacher changed the model: this attempt has no score.");
    else if (free_practice_)
        text(palette::value, fmt::format("{} of practice, {} times taken back",
                                         render::clock_text(view_->readout.time), view_->taken_back));
    else
        draw_grade();
    if (shows_solution_) {
        ImGui::Dummy(ImVec2(0, u(6)));
        wrapped(window_, Face::Bold, palette::bright, "What was done");
        const double rate = session_->options().scenario.frame_rate;
        for (const script::Caption& caption : session_->options().script->captions)
            wrapped(palette::value,
                    fmt::format("{}  {}", render::clock_text(caption.frame / rate), caption.text));
    } else if (!free_practice_ && !view_->guide) {
        ImGui::Dummy(ImVec2(0, u(6)));
        wrapped(window_, Face::Bold, palette::bright, "What happened");
        draw_events();
    }
    if (!view_->recorded.empty())
        wrapped(palette::faint, fmt::format("Recorded: {}", view_->recorded.string()));
    if (!debriefing_text_.empty()) wrapped(palette::value, debriefing_text_);
    if (!results_problem_.empty()) wrapped(palette::alarm, results_problem_);
    for (const render::Message& message : view_->readout.messages)
        if (message.notice == render::Notice::Alarm) wrapped(palette::alarm, message.text);
    ImGui::EndChild();
    draw_end_buttons();
    ImGui::End();
}

}  // namespace app
