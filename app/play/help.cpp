/// The keys, by what they are for, and the question before an attempt ends.

#include <algorithm>
#include <fmt/format.h>
#include <imgui.h>

#include "app/play/play.h"
#include "app/play/theme.h"
#include "engine/room/grasp.h"

namespace app {
namespace {

namespace palette = render::palette;
using render::Face;
using room::Action;
using room::Side;
using room::Task;

bool is_of_one_hand(Action action) {
    return std::ranges::any_of(room::actions_of_hands, [action](const auto& of_hand) {
        return std::ranges::find(of_hand, action) != of_hand.end();
    });
}

/// What an injection gives; and through what, where the vessels are known.
std::string words_of(const room::InjectionPreset& preset, const room::Session* session) {
    std::string words = room::sentence_of(preset);
    if (const auto anatomy = session ? session->anatomy() : nullptr)
        words += " " + room::site_name(preset, session->options().scenario.devices, *anatomy);
    return words;
}

}  // namespace

/// Both hands side by side.
void Play::draw_hands_help() {
    if (!ImGui::BeginTable("hands", 3, ImGuiTableFlags_RowBg)) return;
    constexpr std::array<const char*, 5> rows = {"push", "pull", "turn the hub to the left",
                                                 "turn the hub to the right",
                                                 "hold the next device, all, none"};
    const auto row = [](const std::string& name, const std::string& left, const std::string& right) {
        ImGui::TableNextRow();
        const std::pair<render::Ink, const std::string&> cells[] = {
            {palette::value, name}, {palette::beam, left}, {palette::beam, right}};
        for (const auto& [ink, words] : cells) {
            ImGui::TableNextColumn();
            wrapped(ink, words);
        }
    };
    const render::Readout none;
    const render::Readout& r = view_ ? view_->readout : none;
    const auto held = [&r](const std::string& by_hand, const char* at_first, const char* alone) {
        return r.devices.empty()       ? std::string(at_first)
               : r.devices.size() == 1 ? std::string(alone)
               : by_hand.empty()       ? "holds nothing"
                                       : "holds: " + by_hand;
    };
    ImGui::TableNextRow();
    for (const std::string& words :
         {std::string(),
          "Left hand, " + held(r.left_hand, "the catheter at first", "empty: there is a wire alone"),
          "Right hand, " + held(r.held, "the wire at first", "holds: wire")}) {
        ImGui::TableNextColumn();
        wrapped(palette::label, words);
    }
    const auto& [right, left] = room::actions_of_hands;
    for (std::size_t k = 0; k < rows.size(); ++k)
        row(rows[k], options_.keys.text(left[k]), options_.keys.text(right[k]));
    const std::string mouse = "wheel; drag on the image: up, sideways";
    const bool by_left = options_.keys.mouse == Side::Left;
    row("mouse", by_left ? mouse : "", by_left ? "" : mouse);
    row("gamepad", "left stick", "right stick");
    ImGui::EndTable();
}

void Play::draw_keys_of(Task task) {
    if (!ImGui::BeginTable("keys", 6)) return;
    for (const float width : {142.0f, 198.0f, 142.0f, 198.0f, 142.0f, 198.0f})
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, width);
    const auto item = [](const std::string& keys, const std::string& words) {
        ImGui::TableNextColumn();
        wrapped(palette::beam, keys);
        ImGui::TableNextColumn();
        wrapped(palette::value, words);
    };
    for (int k = 0; k < room::actions; ++k) {
        const auto action = static_cast<Action>(k);
        if (room::info(action).task != task || is_of_one_hand(action)) continue;
        item(options_.keys.text(action),
             fmt::format("{}{}", room::info(action).help, action < room::first_pressed ? " (hold)" : ""));
    }
    if (task == Task::Contrast)
        for (const room::InjectionPreset& preset : options_.keys.injections)
            item(options_.keys.label(preset.key), words_of(preset, session_.get()));
    ImGui::EndTable();
}

void Play::draw_help() {
    begin_page(window_, "help", u(1080));
    wrapped(window_, Face::Title, palette::bright, "Keys");
    const float height = 0.96f * static_cast<float>(window_.height()) - u(110);
    ImGui::BeginChild("list", ImVec2(0, std::max(height, u(60))));
    for (std::size_t k = 0; k < room::task_names.size(); ++k) {
        const auto task = static_cast<Task>(k);
        const bool treats = session_ && session_->options().scenario.index_of(script::DeviceRole::Balloon);
        if (task == Task::Treatment && !treats) continue;
        ImGui::PushID(static_cast<int>(k));
        wrapped(window_, Face::Bold, palette::bright, std::string(room::task_names[k]));
        if (task == Task::Hands) draw_hands_help();
        draw_keys_of(task);
        if (task == Task::Stand)
            wrapped(
                palette::label,
                "Mouse: dragging the C-arm's pictograms turns it; the right button on the image moves the "
                "table.");
        if (task == Task::Contrast)
            wrapped(palette::label, "One injection at a time; how much was given stands in the strip below.");
        ImGui::Dummy(ImVec2(0, u(4)));
        ImGui::PopID();
    }
    ImGui::EndChild();
    if (ImGui::Button("Close")) help_ = false;
    ImGui::End();
}

void Play::draw_asking() {
    const bool again = asking_ == Action::BackToStart;
    begin_page(window_, "asks", u(420));
    wrapped(window_, Face::Title, palette::bright, again ? "Start again?" : "End the exercise?");
    wrapped(palette::value, again ? "This attempt ends and a new one begins." : "This attempt ends here.");
    if (view_->recording) wrapped(palette::faint, "What was done stays in the recording.");
    ImGui::Dummy(ImVec2(0, u(6)));
    const bool yes = ImGui::Button("Yes (Enter)");
    ImGui::SameLine();
    const bool no = ImGui::Button("No (Escape)");
    ImGui::End();
    if (yes || no) answer(yes);
}

}  // namespace app
