#include "app/play/theme.h"

#include <algorithm>

namespace app {

void text(render::Ink ink, const std::string& words) {
    ImGui::PushStyleColor(ImGuiCol_Text, tint(ink));
    ImGui::TextUnformatted(words.data(), words.data() + words.size());
    ImGui::PopStyleColor();
}

void wrapped(render::Ink ink, const std::string& words) {
    ImGui::PushTextWrapPos(0);
    text(ink, words);
    ImGui::PopTextWrapPos();
}

void wrapped(const Window& window, render::Face face, render::Ink ink, const std::string& words) {
    ImGui::PushFont(window.faces().fonts[static_cast<std::size_t>(face)]);
    wrapped(ink, words);
    ImGui::PopFont();
}

void begin_page(const Window& window, const char* name, float wanted) {
    const float width = static_cast<float>(window.width()), height = static_cast<float>(window.height());
    const float wide = std::min(wanted, 0.96f * width);
    ImGui::SetNextWindowPos(ImVec2(width / 2, height / 2), ImGuiCond_Always, ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSizeConstraints(ImVec2(wide, 0), ImVec2(wide, 0.96f * height));
    ImGui::SetNextWindowBgAlpha(0.97f);
    ImGui::Begin(name, nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_AlwaysAutoResize);
}

}  // namespace app
