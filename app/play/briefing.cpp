/// The briefing: what is to be done, the way on a map, what is in the hands, how the attempt is judged.

#include <cmath>
#include <fmt/format.h>
#include <imgui.h>
#include <numbers>
#include <utility>

#include "app/play/map.h"
#include "app/play/play.h"
#include "app/play/theme.h"
#include "engine/anatomy/organs.h"
#include "engine/exercise/grade.h"

namespace app {
namespace {

namespace palette = render::palette;
using render::Face;
using room::Action;
using room::Phase;

using Lines = std::vector<std::pair<std::string, std::string>>;

std::string degrees(double radians) {
    return fmt::format("{:.0f}°", radians * 180 / std::numbers::pi);
}

std::string view_text(const render::CArm& arm) {
    return fmt::format("{} {}, {} {}, field {:.0f} mm", arm.lao < 0 ? "RAO" : "LAO",
                       degrees(std::abs(arm.lao)), arm.cranial < 0 ? "caudal" : "cranial",
                       degrees(std::abs(arm.cranial)), arm.detector_width);
}

/// What a trainee reads before the start, line by line.
Lines briefing(const scenario::Scenario& s) {
    Lines lines;
    const std::string name = anatomy::clinical_name(s.target.name);
    const std::string target = name.empty()            ? "the target on the map"
                               : name == s.target.name ? name
                                                       : "the " + name;
    lines.emplace_back(
        "Task", fmt::format("Bring the tip of the {} to {} (within {:g} mm) and hold it there for {:g} s.",
                            script::name_of(s.target.device), target, s.target.radius, s.target.hold));
    lines.emplace_back("Access", anatomy::clinical_end(s.entry.end));
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
    return lines;
}

/// How the attempt is judged.
std::string judgement(const scenario::Scenario& s) {
    if (s.lesson.guided())
        return fmt::format(
            "A guided lesson of {} steps: nothing is judged, and it is passed when all of them were done and "
            "the "
            "target is reached.",
            s.lesson.steps.size());
    const scenario::Benchmark& skilled = s.lesson.benchmark;
    if (!skilled.given())
        return "There is no benchmark yet, and so no points: 'seldinger benchmark' makes one of recordings.";
    std::string words = "Against skilled attempts: ";
    for (const exercise::GradeLine& line : exercise::grade({}, skilled).lines)
        if (line.mean && *line.mean > 0 && *line.measure->unit)
            words += fmt::format("{}{} {}", words.ends_with(": ") ? "" : ", ", line.measure->name,
                                 exercise::skilled_text(line));
    if (skilled.angiograms.least() >= 1) words += "; all of them took an angiogram";
    if (!s.patient.empty()) words += ". These were at the first patient";
    return words + fmt::format(". {:.0f} points pass.", room::pass_mark);
}

void draw_lines(const char* name, const Lines& lines, float first) {
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
    draw_lines("lines", briefing(s), u(80));
    if (has_map) {
        ImGui::TableNextColumn();
        draw_briefing_map();
        ImGui::EndTable();
    }
    if (!free_practice_) wrapped(palette::label, judgement(s));
    const auto first = [&](Action action) { return options_.keys.first(action); };
    wrapped(palette::label,
            fmt::format(
                "Keys: {} {} push and pull, {} {} turn, {} fluoroscopy, {} {} run, {} roadmap, {} image to "
                "the reference screen{}, {} all keys",
                first(Action::Advance), first(Action::Withdraw), first(Action::RotateLeft),
                first(Action::RotateRight), first(Action::Fluoroscopy), first(Action::Acquisition),
                script::title_of(s.imaging.acquisition), first(Action::Roadmap), first(Action::Reference),
                s.devices.size() > 1 ? fmt::format(", left hand {} {} and {} {}", first(Action::LeftAdvance),
                                                   first(Action::LeftWithdraw), first(Action::LeftRotateLeft),
                                                   first(Action::LeftRotateRight))
                                     : "",
                first(Action::Help)));
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
    MapMarks marks{{}, target_of(s.target, *anatomy), s.target.radius};
    for (const anatomy::VesselEnd& end : anatomy->ends)
        if (end.opening.name == s.entry.end) marks.start = end.opening.centre;
    draw_map(*ImGui::GetWindowDrawList(), area, window_.unit(), *anatomy, s.c_arm, marks);
}

}  // namespace app
