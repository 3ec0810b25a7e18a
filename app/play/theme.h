#pragma once
/// The panel's colours and fonts for Dear ImGui, and the frame of a page.

#include <cstdint>
#include <imgui.h>
#include <string>

#include "app/play/window.h"
#include "render/panel/palette.h"

namespace app {

inline ImU32 colour(render::Ink ink) {
    return IM_COL32(ink.red, ink.green, ink.blue, ink.alpha);
}
inline ImVec4 tint(render::Ink ink) {
    return ImGui::ColorConvertU32ToFloat4(colour(ink));
}

/// A texture of OpenGL as Dear ImGui knows it: a pointer, from 1.91.4 on a number.
inline ImTextureID texture_id(unsigned texture) {
    return (ImTextureID) static_cast<std::uintptr_t>(texture);
}

/// A Dear ImGui window that the user cannot move and whose edge is invisible.
constexpr ImGuiWindowFlags bare = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoScrollbar |
                                  ImGuiWindowFlags_NoScrollWithMouse | ImGuiWindowFlags_NoResize |
                                  ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                                  ImGuiWindowFlags_NoSavedSettings;

void text(render::Ink, const std::string&);
/// Draws text wrapped at the edge of the window or column.
void wrapped(render::Ink, const std::string&);
/// The same in a face other than the plain one.
void wrapped(const Window&, render::Face, render::Ink, const std::string&);

/// Begins a page in the middle of the window, `wanted` pixels wide if the window has them and as high as its
/// contents; a page higher than the window scrolls. ImGui::End() ends it.
void begin_page(const Window&, const char* name, float wanted);

}  // namespace app
