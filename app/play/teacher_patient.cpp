/// The page of the teacher's window on which the patient is given spasm, thrombus, dissection, cough, and
/// relieved of them.

#include <algorithm>
#include <fmt/format.h>
#include <imgui.h>

#include "app/play/teacher.h"
#include "app/play/theme.h"
#include "engine/anatomy/organs.h"
#include "engine/exercise/complications.h"
#include "engine/room/way_map.h"

namespace app {
namespace {

namespace palette = render::palette;
using room::Phase;
using script::BreathManner;
using script::Complicate;
using script::ComplicationKind;

/// Draws a slider of a whole number of millimetres, or percent, between two limits.
void whole_number(const char* name, double& value, double least, double most, const char* format) {
    int shown = static_cast<int>(value);
    ImGui::SliderInt(name, &shown, static_cast<int>(least), static_cast<int>(most), format,
                     ImGuiSliderFlags_AlwaysClamp);
    value = shown;
}

/// By their clinical names, in the order of the alphabet; at first the one at the target.
void choose_branch(std::string& chosen, const anatomy::Anatomy& anatomy, const geometry::Vec3& target) {
    std::vector<std::pair<std::string, std::string>> names;
    for (const geometry::CentrelineBranch& branch : anatomy.branches)
        names.emplace_back(anatomy::clinical_name(branch.name), branch.name);
    std::sort(names.begin(), names.end());
    const auto now =
        std::find_if(names.begin(), names.end(), [&](const auto& name) { return name.second == chosen; });
    if (now == names.end()) {
        const int nearest = anatomy::nearest_place(anatomy, target).branch;
        chosen = nearest >= 0 ? anatomy.branches[nearest].name : names.front().second;
    }
    if (!ImGui::BeginCombo("##vessel", anatomy::clinical_name(chosen).c_str())) return;
    for (const auto& [clinical, name] : names) {
        ImGui::PushID(name.c_str());
        if (ImGui::Selectable(clinical.c_str(), name == chosen)) chosen = name;
        ImGui::PopID();
    }
    ImGui::EndCombo();
}

double length_along(const anatomy::Anatomy& anatomy, const std::string& branch) {
    for (const geometry::CentrelineBranch& one : anatomy.branches)
        if (one.name == branch) return geometry::length_of(one.points);
    return 0;
}

script::Command relief_of(const exercise::SetByTeacher& set) {
    if (set.what.kind != ComplicationKind::Breath) return script::Relieve{set.what.kind, set.branch};
    Complicate breathes_freely;
    breathes_freely.kind = ComplicationKind::Breath;
    return breathes_freely;
}

}  // namespace

void Teacher::draw_complications(const Lesson& lesson) {
    const room::View* view = lesson.view.get();
    const auto anatomy = lesson.session ? lesson.session->anatomy() : nullptr;
    if (!view || !anatomy || lesson.session->options().script)
        return wrapped(palette::faint,
                       anatomy ? "A recording or a solution is played: the patient does what he did."
                               : "What the patient does can be set once an exercise is loaded.");
    if (view->phase == Phase::Ended || view->phase == Phase::Failed)
        return wrapped(palette::faint, "This attempt has ended.");
    constexpr std::pair<const char*, BreathManner> breaths[] = {{"Deep breathing", BreathManner::Deep},
                                                                {"Cough", BreathManner::Cough},
                                                                {"Breathe freely", BreathManner::Free}};
    wrapped(palette::label, "Breath");
    for (const auto& [name, breath] : breaths) {
        if (breath != BreathManner::Deep) ImGui::SameLine();
        Complicate command;
        command.kind = ComplicationKind::Breath;
        command.breath = breath;
        if (ImGui::Button(name)) lesson.session->give_command(command);
    }
    ImGui::Separator();
    wrapped(palette::label, "Vessel");
    draw_vessel_complication(*lesson.session, *anatomy);
    wrapped(palette::faint,
            "It comes with the next frame, nothing tells the trainee, and the recording keeps it.");
    if (!view->refused.empty()) wrapped(palette::alarm, view->refused);
    ImGui::Separator();
    draw_set_now(*lesson.session, *view);
}

void Teacher::draw_set_now(room::Session& session, const room::View& view) {
    wrapped(palette::label, "Set now");
    bool nothing = true;
    for (std::size_t k = 0; k < view.score.set_by_teacher.size(); ++k) {
        const exercise::SetByTeacher& set = view.score.set_by_teacher[k];
        if (set.relieved) continue;
        nothing = false;
        ImGui::PushID(static_cast<int>(k));
        if (ImGui::Button("Relieve")) session.give_command(relief_of(set));
        ImGui::PopID();
        ImGui::SameLine();
        wrapped(palette::caution, set.what.held_off ? set.text + ", held off by a device in it" : set.text);
    }
    if (nothing) wrapped(palette::faint, "nothing");
}

/// What, in which vessel, how far along it, how much.
void Teacher::draw_vessel_complication(room::Session& session, const anatomy::Anatomy& anatomy) {
    constexpr std::pair<const char*, ComplicationKind> kinds[] = {
        {"Spasm", ComplicationKind::Spasm},
        {"Thrombus", ComplicationKind::Thrombus},
        {"Dissection", ComplicationKind::Dissection}};
    for (const auto& [name, kind] : kinds) {
        if (kind != ComplicationKind::Spasm) ImGui::SameLine();
        if (ImGui::RadioButton(name, wanted_.kind == kind)) wanted_.kind = kind;
    }
    ImGui::PushItemWidth(-u(110));
    choose_branch(wanted_.branch, anatomy, room::target_of(session.options().scenario.target, anatomy));
    const double most = std::clamp(length_along(anatomy, wanted_.branch), 1.0, script::largest_place);
    wanted_.at = std::min(wanted_.at, most);
    whole_number("along it", wanted_.at, 0, most, "%d mm");
    whole_number("long", wanted_.over, script::shortest_complication, script::longest_complication, "%d mm");
    if (wanted_.kind == ComplicationKind::Thrombus)
        wanted_.percent = 100;
    else
        whole_number("of it lost", wanted_.percent, script::least_narrowing, script::largest_narrowing,
                     "%d percent");
    ImGui::PopItemWidth();
    const std::string problem = exercise::Complications::problem(wanted_, anatomy);
    if (!problem.empty()) return wrapped(palette::caution, problem);
    if (ImGui::Button("Set it", ImVec2(u(110), 0))) session.give_command(wanted_);
}

}  // namespace app
