/// The briefing: what is to be done, the way on a map, what is in the hands, how the attempt is judged.

#include <cmath>
#include <fmt/format.h>
#include <imgui.h>
#include <numbers>
#include <utility>

#include "app/play/map.h"
#include "app/play/play.h"
#include "app/play/theme.h"
#include "engine/room/words.h"

namespace app {
namespace {

namespace palette = render::palette;
using render::Face;
using room::Phase;

void draw_lines(const char* name, const room::Lines& lines, float first) {
    if (!ImGui::BeginTable(name, 2)) return;
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, first);
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch);
    for (const auto& [key, words] : lines) {
        ImGui::TableNextRow();
        ImGui::TableNextColumn();
        text(palette::label, key);
        ImGui::TableNextColumn();
        wrapped(palette::value, words);
    }
    ImGui::EndTable();
}

}  // namespace

/// Buttons for the exercise's patients; the one that was chosen now.
std::optional<std::string> Play::draw_patients() {
    const std::vector<scenario::LessonPatient>& others = session_->options().scenario.lesson.patients;
    if (others.empty() || !session_->options().scenario.places.contains("anatomy.preset")) return {};
    const room::BestResult* best = results_.find(session_->options().scenario.name);
    std::optional<std::string> chosen;
    text(palette::label, "Patient");
    for (std::size_t k = 0; k <= others.size(); ++k) {
        const std::string word = k == 0 ? "" : std::to_string(k + 1);
        std::string words = k == 0 ? "the first" : fmt::format("{}: {}", word, others[k - 1].who);
        if (best)
            if (const auto found = best->patients.find(word); found != best->patients.end())
                words += fmt::format(" ({} of {} reached)", found->second.reached, found->second.attempts);
        const float wide = ImGui::CalcTextSize(words.c_str()).x + 2 * ImGui::GetStyle().FramePadding.x;
        ImGui::SameLine();
        if (ImGui::GetContentRegionAvail().x < wide) ImGui::NewLine();
        const bool is_this = word == patient_;
        if (is_this) ImGui::PushStyleColor(ImGuiCol_Button, tint(palette::with_alpha(palette::good, 110)));
        if (ImGui::SmallButton(words.c_str()) && !is_this) chosen = word;
        if (is_this) ImGui::PopStyleColor();
    }
    return chosen;
}

void Play::draw_briefing() {
    const scenario::Scenario& s = session_->options().scenario;
    const float width = static_cast<float>(window_.width());
    const bool has_map = width >= u(760);
    begin_page(window_, "briefing", has_map ? u(1010) : u(680));
    wrapped(window_, Face::Title, palette::bright, s.title);
    text(palette::label,
         fmt::format(
             "{}   {}", learner_.empty() ? "Guest" : learner_,
             free_practice_ ? "Free practice: no score, and the last 10 s can be taken back" : "Exercise"));
    ImGui::Separator();
    const std::optional<std::string> patient = draw_patients();
    if (has_map) {
        ImGui::BeginTable("halves", 2);
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch);
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, u(330));
        ImGui::TableNextColumn();
    }
    if (!s.lesson.indication.empty()) {
        wrapped(palette::beam, s.lesson.indication);
        ImGui::Dummy(ImVec2(0, u(4)));
    }
    if (!s.lesson.briefing.empty()) {
        wrapped(palette::value, s.lesson.briefing);
        ImGui::Dummy(ImVec2(0, u(6)));
    }
    draw_lines("lines", room::briefing(s), u(80));
    if (has_map) {
        ImGui::TableNextColumn();
        draw_briefing_map();
        ImGui::EndTable();
    }
    if (!free_practice_) wrapped(palette::label, room::judgement(s));
    wrapped(palette::label, room::keys_line(options_.keys, s));
    ImGui::Dummy(ImVec2(0, u(4)));
    if (view_->phase == Phase::Failed || view_->phase == Phase::Loading) {
        draw_progress();
    } else {
        text(palette::good, "Ready");
        if (attempts_.kept())
            wrapped(palette::faint, fmt::format("Each attempt is kept: {}", attempts_.wanted().string()));
        else
            wrapped(palette::caution, fmt::format("Attempts are not kept: {}", attempts_problem_));
    }
    ImGui::Dummy(ImVec2(0, u(8)));
    if (view_->phase == Phase::Ready) {
        if (!std::exchange(start_focused_, true) || !ImGui::IsAnyItemFocused()) ImGui::SetKeyboardFocusHere();
        if (ImGui::Button("Start (Enter)")) {
            screen_ = Screen::Room;
            countdown_ = room::Clock::now() + std::chrono::seconds(free_practice_ ? 0 : 3);
        }
        ImGui::SameLine();
    }
    if (hints_shown_ < s.lesson.hints.size()) {
        if (ImGui::Button(hints_shown_ == 0 ? "A hint" : "Another hint")) ++hints_shown_;
        ImGui::SameLine();
    }
    if (ImGui::Button("Back")) leave();
    for (std::size_t k = 0; k < std::min(hints_shown_, s.lesson.hints.size()); ++k)
        wrapped(palette::calm, s.lesson.hints[k]);
    ImGui::End();
    if (patient && session_) open(*chosen_, free_practice_, *patient);
}

/// The vessels are known once they are loaded.
void Play::draw_briefing_map() {
    const scenario::Scenario& s = session_->options().scenario;
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const ImVec2 size(ImGui::GetContentRegionAvail().x, u(330));
    ImGui::Dummy(size);
    const render::Box area{corner.x, corner.y, corner.x + size.x, corner.y + size.y};
    const auto anatomy = session_->anatomy();
    if (!anatomy) {
        ImGui::GetWindowDrawList()->AddRectFilled(corner, ImVec2(area.right, area.bottom),
                                                  colour(palette::well));
        return;
    }
    draw_map(*ImGui::GetWindowDrawList(), area, window_.unit(), room::way_map(s, *anatomy, s.c_arm));
}

}  // namespace app
