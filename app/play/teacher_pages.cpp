/// The pages of the teacher's window: what happens, what the trainee sees, results.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <imgui.h>
#include <utility>

#include "app/play/teacher.h"
#include "app/play/theme.h"
#include "engine/exercise/score.h"
#include "render/panel/readout.h"

namespace app {
namespace {

namespace palette = render::palette;
using render::Face;
using room::LessonEvent;
using room::Phase;
using Thing = script::TeacherAct::Thing;

/// What a button says of a moment.
constexpr const char* quick_marks[] = {"Well done", "Look at this", "Ask about this"};

render::Ink ink_of(LessonEvent::Kind kind) {
    using Kind = LessonEvent::Kind;
    switch (kind) {
        case Kind::Injury:
            return palette::alarm;
        case Kind::Error:
        case Kind::Branch:
            return palette::caution;
        case Kind::Target:
            return palette::good;
        case Kind::Comment:
            return palette::beam;
        case Kind::Patient:
        case Kind::Teacher:
            return palette::calm;
        default:
            return palette::value;
    }
}

std::string newtons(double force) {
    return fmt::format("{:.2f} N", force);
}

/// What the text of an input becomes as a comment: without blanks at its ends.
std::string trimmed(std::string_view text) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    return std::string(text);
}

}  // namespace

void Teacher::draw_lesson(const Lesson& lesson) {
    const room::View* view = lesson.view.get();
    if (!view || view->phase == Phase::Loading || view->phase == Phase::Failed)
        return wrapped(palette::faint,
                       view ? "Nothing happens yet." : "What happens is shown once an exercise is chosen.");
    if (view->frames == 0) return wrapped(palette::faint, "The trainee has not begun yet.");
    draw_figures(*view);
    ImGui::Separator();
    const float foot =
        2 * ImGui::GetFrameHeightWithSpacing() + 2 * ImGui::GetTextLineHeightWithSpacing() + u(8);
    draw_events(*view, std::max(u(60), ImGui::GetContentRegionAvail().y - foot));
    draw_comments(lesson);
}

void Teacher::draw_figures(const room::View& view) const {
    const render::Readout& r = view.readout;
    double push = 0;
    for (const render::Readout::Device& device : r.devices)
        push = std::max(push, std::abs(device.push_force.value_or(0)));
    const struct {
        const char* name;
        double now, largest;
    } forces[] = {{"Push of a hand", push, view.peaks.push},
                  {"Wall on the tip", r.tip_force.value_or(0), view.peaks.tip},
                  {"Wall, hardest place", r.largest_wall_force.value_or(0), view.peaks.wall}};
    if (ImGui::BeginTable("forces", 3, ImGuiTableFlags_SizingStretchProp)) {
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 2);
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 1);
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 1);
        const auto row = [](const std::string& name, const std::string& now, const std::string& largest,
                            render::Ink ink) {
            ImGui::TableNextRow();
            for (const std::string* words : {&name, &now, &largest}) {
                ImGui::TableNextColumn();
                text(words == &name ? palette::label : ink, *words);
            }
        };
        row("Force", "now", "largest", palette::label);
        for (const auto& force : forces)
            row(force.name, newtons(force.now), newtons(force.largest),
                force.largest >= r.force_limit ? palette::caution : palette::value);
        ImGui::EndTable();
    }
    wrapped(
        palette::value,
        fmt::format(
            "{:.0f} mm to the target   beam {:.0f} s   {} mGy   contrast {:.0f} of {:.0f} ml   {} error{}",
            view.score.tip_to_target, view.score.beam_on_time, render::figure_text(r.air_kerma, 1),
            r.contrast.value_or(0), r.contrast_limit.value_or(0), view.score.handling_errors.size(),
            view.score.handling_errors.size() == 1 ? "" : "s"));
    if (view.solver) wrapped(palette::label, room::tip_text(*view.solver));
    if (view.tuned) wrapped(palette::alarm, "The model was changed: this attempt has no score.");
}

/// The last stand at the foot, where the list stays unless it was scrolled.
void Teacher::draw_events(const room::View& view, float height) const {
    ImGui::BeginChild("events", ImVec2(0, height));
    const bool at_end = ImGui::GetScrollY() >= ImGui::GetScrollMaxY() - 1;
    if (!view.events || view.events->empty()) text(palette::faint, "Nothing has happened yet.");
    if (view.events)
        for (const LessonEvent& event : *view.events) {
            text(palette::faint, render::clock_text(event.seconds));
            ImGui::SameLine(u(52));
            wrapped(ink_of(event.kind),
                    event.where.empty() ? event.what : fmt::format("{} ({})", event.what, event.where));
        }
    if (at_end) ImGui::SetScrollHereY(1);
    ImGui::EndChild();
}

void Teacher::say(const Lesson& lesson, const std::string& words, int frame) {
    if (script::is_comment(words)) lesson.session->give(script::Comment{frame, words});
}

/// A comment belongs to the moment at which it was begun.
void Teacher::draw_comments(const Lesson& lesson) {
    const room::View& view = *lesson.view;
    ImGui::Separator();
    if (lesson.session->options().script)
        return wrapped(palette::faint, "A recording or a solution is played: it takes no comments.");
    const int now = view.frames - 1;
    for (const char* mark : quick_marks) {
        if (mark != quick_marks[0]) ImGui::SameLine();
        if (ImGui::Button(mark)) say(lesson, mark, now);
    }
    ImGui::SetNextItemWidth(-u(80));
    if (std::exchange(begins_comment_, false)) ImGui::SetKeyboardFocusHere();
    const bool entered = ImGui::InputTextWithHint(fmt::format("##comment {}", inputs_).c_str(),
                                                  "Enter begins a comment on this moment", typed_.data(),
                                                  typed_.size(), ImGuiInputTextFlags_EnterReturnsTrue);
    const bool typing = ImGui::IsItemActive();
    const std::string words = trimmed(typed_.data());
    if (words.empty()) moment_.reset();
    if (!words.empty() && !moment_) moment_ = now;
    ImGui::SameLine();
    const bool kept = ImGui::Button("Keep", ImVec2(-1, 0));
    if (!words.empty() && (kept || entered || (typing && enter_))) {
        say(lesson, words, *moment_);
        typed_.fill(0);
        moment_.reset();
        ++inputs_;  // one that did not see the key would keep its text
    } else if (enter_ && !typing) {
        begins_comment_ = true;
        redraw_ = 3;
    }
    const double rate = lesson.session->options().scenario.frame_rate;
    if (!view.refused.empty())
        wrapped(palette::alarm, view.refused);
    else if (moment_)
        wrapped(palette::label,
                fmt::format("It is kept at frame {}, {:.0f} s ago.", *moment_, (now - *moment_) / rate));
    else if (!view.recording)
        wrapped(palette::caution, view.recorded.empty()
                                      ? "This attempt is not recorded."
                                      : "The recording has ended; it still takes comments.");
}

void Teacher::draw_screen(const Lesson& lesson) {
    constexpr struct {
        Thing thing;
        const char* name;
    } rows[] = {{Thing::Target, "The target, in the live image"},
                {Thing::Way, "The way, on a map"},
                {Thing::Hints, "Hints"},
                {Thing::Readouts, "Figures of forces and of the target's distance"},
                {Thing::Reference, "The reference image"},
                {Thing::Captions, "Captions of a solution that is shown"}};
    wrapped(palette::label, "What the trainee's window shows:");
    for (const auto& row : rows) {
        bool& on = screen_[static_cast<std::size_t>(row.thing)];
        if (ImGui::Checkbox(row.name, &on)) redraw_ = 3;
    }
    ImGui::Dummy(ImVec2(0, u(6)));
    wrapped(
        palette::faint,
        "Each change is kept in the recording. The score, the debriefing and the course say it beside the "
        "figures, which stay as they are. When this window is closed the trainee sees what is usual.");
    if (!lesson.view || lesson.view->score.teacher.empty()) return;
    ImGui::Separator();
    wrapped(palette::value,
            fmt::format("In this attempt: {}.", exercise::text_of(lesson.view->score.teacher)));
}

void Teacher::draw_results(const Lesson& lesson) {
    wrapped(palette::label, lesson.learner.empty()
                                ? "A guest trains: results are not kept after this session."
                                : lesson.learner + " so far:");
    if (!lesson.results || !ImGui::BeginTable("results", 2, ImGuiTableFlags_RowBg)) return;
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 3);
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 2);
    for (const Lesson::Result& result : *lesson.results) {
        ImGui::TableNextRow();
        ImGui::TableNextColumn();
        wrapped(palette::value,
                result.level > 0 ? fmt::format("{}  {}", result.level, result.exercise) : result.exercise);
        ImGui::TableNextColumn();
        wrapped(result.text.starts_with("passed") ? palette::good
                : result.text.empty()             ? palette::faint
                                                  : palette::caution,
                result.text.empty() ? "not tried" : result.text);
    }
    ImGui::EndTable();
}

}  // namespace app
