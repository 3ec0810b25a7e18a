#pragma once
/// The panel's colours as Dear ImGui takes them.

#include <imgui.h>

#include "render/panel/palette.h"

namespace app {

inline ImU32 colour(render::Ink ink) {
    return IM_COL32(ink.red, ink.green, ink.blue, ink.alpha);
}
inline ImVec4 tint(render::Ink ink) {
    return ImGui::ColorConvertU32ToFloat4(colour(ink));
}

}  // namespace app
