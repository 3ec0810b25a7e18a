#include "app/play/solver_page.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <imgui.h>

#include "app/play/theme.h"

namespace app {
namespace {

namespace palette = render::palette;

constexpr std::size_t remembered = 300;  // frames in the plots

struct Method {
    physics::RelaxerKind kind;
    int varied;
};
using physics::RelaxerKind;
constexpr Method methods[] = {
    {RelaxerKind::Global, 2},  {RelaxerKind::FirstOrder, 1}, {RelaxerKind::Segment, 1},
    {RelaxerKind::Segment, 2}, {RelaxerKind::Segment, 3},    {RelaxerKind::Segment, 4},
    {RelaxerKind::Segment, 5}, {RelaxerKind::Combined, 2},   {RelaxerKind::Konings, 1}};
constexpr int method_count = static_cast<int>(std::size(methods));
constexpr const char* method_names[method_count] = {"global", "first order", "M = 1",    "M = 2",  "M = 3",
                                                    "M = 4",  "M = 5",       "combined", "Konings"};

int method_of(const physics::RelaxerConfig& config) {
    for (int k = 0; k < method_count; ++k)
        if (methods[k].kind == config.kind &&
            (config.kind != RelaxerKind::Segment || methods[k].varied == config.varied_segments))
            return k;
    return 0;
}

/// Okabe and Ito's eight colours, which people with red-green colour blindness can distinguish, and white.
ImU32 method_colour(int method) {
    constexpr ImU32 colours[] = {
        IM_COL32(230, 159, 0, 255), IM_COL32(204, 121, 167, 255), IM_COL32(86, 180, 233, 255),
        IM_COL32(0, 158, 115, 255), IM_COL32(240, 228, 66, 255),  IM_COL32(0, 114, 178, 255),
        IM_COL32(213, 94, 0, 255),  IM_COL32(160, 160, 160, 255), IM_COL32(255, 255, 255, 255)};
    return colours[method % std::size(colours)];
}

}  // namespace

/// Plots the time of a frame's motion against the remaining distance from rest, both in powers of ten.
void SolverPage::draw_speed_against_accuracy(float unit, double frame_ms) const {
    constexpr double least_ms = 0.01, most_ms = 1000, least_mm = 1e-10, most_mm = 10;
    ImGui::TextDisabled("distance from rest [mm] over time [ms]");
    const ImVec2 size(unit * 300, unit * 120), corner = ImGui::GetCursorScreenPos();
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.AddRectFilled(corner, ImVec2(corner.x + size.x, corner.y + size.y), colour(palette::well));
    const auto at = [&](double ms, double mm) {
        const double x = std::log(ms / least_ms) / std::log(most_ms / least_ms);
        const double y = std::log(mm / least_mm) / std::log(most_mm / least_mm);
        return ImVec2(corner.x + size.x * static_cast<float>(std::clamp(x, 0.0, 1.0)),
                      corner.y + size.y * static_cast<float>(1 - std::clamp(y, 0.0, 1.0)));
    };
    for (double ms = least_ms; ms <= most_ms; ms *= 10)
        list.AddLine(at(ms, least_mm), at(ms, most_mm), colour(palette::rule));
    for (double mm = least_mm; mm <= most_mm * 1.1; mm *= 1000)
        list.AddLine(at(least_ms, mm), at(most_ms, mm), colour(palette::rule));
    list.AddLine(at(frame_ms, least_mm), at(frame_ms, most_mm), colour(palette::alarm));
    for (const Dot& dot : dots_)
        list.AddCircleFilled(at(dot.ms, std::max(least_mm, dot.error)), unit * 2, method_colour(dot.method),
                             6);
    ImGui::Dummy(size);
    ImGui::TextDisabled("0.01 to 1000 ms, 1e-10 to 10 mm");
    ImGui::TextDisabled("red: the time of a frame");
}

/// Returns settings that were changed and released.
std::optional<exercise::Tuning> SolverPage::draw_controls(const exercise::Tuning& now, float unit) {
    exercise::Tuning next = edited_.value_or(now);
    bool held = false, done = false;
    const auto slider = [&](const char* name, double& value, float least, float most, const char* format,
                            ImGuiSliderFlags scale = ImGuiSliderFlags_Logarithmic) {
        float shown = static_cast<float>(value);
        ImGui::SetNextItemWidth(unit * 220);
        if (ImGui::SliderFloat(name, &shown, least, most, format, scale | ImGuiSliderFlags_AlwaysClamp))
            value = shown;
        held = held || ImGui::IsItemActive();
        done = done || ImGui::IsItemDeactivatedAfterEdit();
    };
    slider("EI shaft", next.shaft_rigidity, 1, 5000, "%.0f N mm2");
    slider("EI tip", next.tip_rigidity, 0.5f, 200, "%.1f N mm2");
    slider("wall k", next.wall_stiffness, 0.1f, 200, "%.1f N/mm");
    slider("segment", next.segment_length, 0.5f, 6, "%.2f mm");
    slider("friction", next.friction, 0, 0.5f, "%.2f", ImGuiSliderFlags_None);
    int method = method_of(next.relaxer);
    ImGui::SetNextItemWidth(unit * 220);
    if (ImGui::Combo("method", &method, method_names, method_count)) {
        next.relaxer.kind = methods[method].kind;
        next.relaxer.varied_segments = methods[method].varied;
        done = true;
    }
    edited_ = held && !done ? std::optional(next) : std::nullopt;
    return done ? std::optional(next) : std::nullopt;
}

void SolverPage::observe(const room::View& view) {
    if (!view.solver || view.frames == seen_) return;
    seen_ = view.frames;
    const room::SolverView& solver = *view.solver;
    const auto push = [](std::deque<float>& values, double value) {
        values.push_back(static_cast<float>(value));
        if (values.size() > remembered) values.pop_front();
    };
    push(motion_ms_, solver.motion_ms);
    push(image_ms_, solver.image_ms);
    push(steps_, solver.relax.newton_steps > 0 ? solver.relax.newton_steps : solver.relax.updates);
    push(residual_, std::log10(std::max(1e-16, solver.relax.gradient)));
    if (solver.relax.updates == 0 && solver.relax.newton_steps == 0) return;
    if (!solver.error) return;
    dots_.push_back({solver.motion_ms, *solver.error, method_of(solver.tuning.relaxer)});
    if (dots_.size() > 3 * remembered) dots_.pop_front();
}

void SolverPage::reset() {
    seen_ = -1;
    dots_.clear();
    edited_.reset();
    for (auto* values : {&motion_ms_, &image_ms_, &steps_, &residual_}) values->clear();
}

std::optional<exercise::Tuning> SolverPage::draw(const room::View& view, bool may_tune, float unit) {
    if (!view.solver) {
        wrapped(palette::label, "It shows the solver from the next frame on.");
        return std::nullopt;
    }
    const room::SolverView& solver = *view.solver;
    const auto plot = [&](const char* name, std::deque<float>& values, const std::string& last, float most) {
        std::vector<float> row(values.begin(), values.end());
        const float low = row.empty() ? 0 : std::min(0.0f, *std::min_element(row.begin(), row.end()));
        const float high = row.empty() ? 1 : std::max(most, *std::max_element(row.begin(), row.end()));
        ImGui::TextDisabled("%s", name);
        ImGui::PlotLines(fmt::format("##{}", name).c_str(), row.data(), static_cast<int>(row.size()), 0,
                         last.c_str(), low, high, ImVec2(unit * 300, unit * 36));
    };
    plot("motion and solver [ms]", motion_ms_,
         fmt::format("{:.2f} of {:.0f} ms", solver.motion_ms, solver.frame_ms), 1);
    plot("image [ms]", image_ms_, fmt::format("{:.1f} ms", solver.image_ms), 1);
    plot(solver.relax.newton_steps > 0 ? "Newton steps" : "updates", steps_,
         fmt::format("{} (window {})",
                     solver.relax.newton_steps > 0 ? solver.relax.newton_steps : solver.relax.updates,
                     solver.relax.window),
         1);
    plot("residual |g|/C, power of ten", residual_, fmt::format("{:.1e}", solver.relax.gradient), 0);
    ImGui::Text("%d segments, %d contacts", static_cast<int>(solver.joints.size()) - 1,
                solver.relax.contacts);
    wrapped(palette::value, room::tip_text(solver));
    ImGui::PushStyleColor(ImGuiCol_Text, tint(solver.relax.converged() ? palette::good : palette::caution));
    ImGui::TextUnformatted(physics::message(solver.relax.termination).c_str());
    ImGui::PopStyleColor();
    draw_speed_against_accuracy(unit, solver.frame_ms);
    if (!may_tune) return std::nullopt;
    wrapped(palette::caution, "A change of these ends the recording, and the attempt has no score.");
    return draw_controls(solver.tuning, unit);
}

}  // namespace app
