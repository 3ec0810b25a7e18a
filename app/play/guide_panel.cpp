/// A guided lesson in the room: the step that is shown, with its keys, and at the end what was done.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <imgui.h>
#include <utility>

#include "app/play/play.h"
#include "app/play/theme.h"
#include "engine/room/guide.h"

namespace app {
namespace {

namespace palette = render::palette;
using render::Box;
using render::Face;
using room::Action;

/// What the step practises, a line each, ticked once it was done.
void draw_practices(const Window& window, const room::KeyMap& keys, const room::Guide& guide,
                    std::size_t step) {
    if (!ImGui::BeginTable("practices", 3)) return;
    const float unit = window.unit();
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, 20 * unit);
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 1.0f);
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 1.7f);
    const std::vector<script::Practice>& practise = guide.step(step).practise;
    for (std::size_t k = 0; k < practise.size(); ++k) {
        const bool done = guide.is_done(step, k);
        ImGui::TableNextRow();
        ImGui::TableNextColumn();
        const ImVec2 at = ImGui::GetCursorScreenPos();
        const float side = 12 * unit, top = at.y + 4 * unit;
        ImDrawList& list = *ImGui::GetWindowDrawList();
        list.AddRect(ImVec2(at.x, top), ImVec2(at.x + side, top + side),
                     colour(done ? palette::good : palette::label), 2 * unit);
        if (done) {
            list.AddLine(ImVec2(at.x + 0.2f * side, top + 0.5f * side),
                         ImVec2(at.x + 0.45f * side, top + 0.8f * side), colour(palette::good), 2 * unit);
            list.AddLine(ImVec2(at.x + 0.45f * side, top + 0.8f * side),
                         ImVec2(at.x + 0.85f * side, top + 0.2f * side), colour(palette::good), 2 * unit);
        }
        ImGui::TableNextColumn();
        wrapped(done ? palette::good : palette::value, std::string(script::help_of(practise[k])));
        ImGui::TableNextColumn();
        wrapped(window, Face::Bold, done ? palette::faint : palette::beam,
                room::inputs_of(practise[k], keys));
    }
    ImGui::EndTable();
}

}  // namespace

void Play::draw_guide(const Box& image) {
    const room::Guide& guide = *view_->guide;
    if (countdown_ || view_->phase == room::Phase::Loading || help_ || menu_ || asking_) return;
    const float width = std::min(image.right - image.left - u(20), u(640));
    ImGui::SetNextWindowPos(ImVec2(std::round((image.left + image.right - width) / 2), image.top + u(56)));
    ImGui::SetNextWindowSize(ImVec2(width, 0));
    ImGui::SetNextWindowBgAlpha(0.85f);
    ImGui::Begin("guide", nullptr,
                 bare | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_AlwaysAutoResize);
    const std::size_t shown = guide.shown();
    const std::string task(
        guide.over()
            ? "All steps"
            : script::task_names[static_cast<std::size_t>(script::task_of(guide.step(shown).practise[0]))]);
    text(palette::calm, task);
    ImGui::SameLine();
    text(palette::label,
         fmt::format("{} of {}{}", guide.done(), guide.size(),
                     guide.skipped() > 0 ? fmt::format(", {} left out", guide.skipped()) : ""));
    const std::string skip = fmt::format("Leave out ({})", options_.keys.first(Action::Skip));
    ImGui::SameLine(ImGui::GetWindowContentRegionMax().x - ImGui::CalcTextSize(skip.c_str()).x -
                    2 * ImGui::GetStyle().FramePadding.x);
    if (!guide.over() && ImGui::SmallButton(skip.c_str())) session_->give(room::Control::SkipStep);
    ImGui::ProgressBar(static_cast<float>(guide.done()) / static_cast<float>(guide.size()), ImVec2(-1, u(4)),
                       "");
    if (guide.over()) {
        wrapped(window_, Face::Title, palette::bright, "Now bring the tip to the target and hold it there.");
    } else {
        wrapped(window_, Face::Title, palette::bright, guide.step(shown).text);
        draw_practices(window_, options_.keys, guide, shown);
    }
    ImGui::End();
}

/// What was done and what was left out, by the groups of keys.
void Play::draw_guide_end() {
    const room::Guide& guide = *view_->guide;
    wrapped(guide.passed() ? palette::good : palette::caution,
            fmt::format("{} of {} steps done{}. A lesson is not judged: no points are taken.", guide.done(),
                        guide.size(),
                        guide.passed() ? "" : "; it is passed when all are done and the target is reached"));
    for (std::size_t of = 0; of < script::task_names.size(); ++of) {
        bool first = true;
        for (std::size_t k = 0; k < guide.size(); ++k) {
            if (static_cast<std::size_t>(script::task_of(guide.step(k).practise[0])) != of) continue;
            if (std::exchange(first, false))
                wrapped(window_, Face::Bold, palette::bright, std::string(script::task_names[of]));
            std::string words;
            for (const script::Practice practice : guide.step(k).practise)
                words += (words.empty() ? "" : ", ") + std::string(script::help_of(practice));
            const bool done = guide.is_done(k);
            wrapped(done ? palette::value : palette::caution, fmt::format("{}: {}",
                                                                          done                  ? "done"
                                                                          : guide.is_skipped(k) ? "left out"
                                                                                                : "not done",
                                                                          words));
        }
        if (!first) ImGui::Dummy(ImVec2(0, u(3)));
    }
}

}  // namespace app
