#pragma once
/// Colours of the panel: a dark room, grey images, and colour only for what needs attention.

#include "render/panel/canvas.h"

namespace render::palette {

constexpr Ink ground{14, 18, 21};
constexpr Ink well{7, 10, 12};  // behind pictures, dials and bars
constexpr Ink rule{38, 46, 52};
constexpr Ink faint{86, 97, 105};
constexpr Ink label{134, 147, 156};
constexpr Ink value{214, 221, 226};
constexpr Ink bright{240, 243, 245};
constexpr Ink calm{88, 150, 168};
constexpr Ink good{92, 184, 120};
constexpr Ink caution{232, 178, 62};
constexpr Ink alarm{232, 86, 72};
constexpr Ink beam{246, 204, 62};
constexpr Ink black{0, 0, 0};

constexpr Ink with_alpha(Ink ink, std::uint8_t alpha) {
    ink.alpha = alpha;
    return ink;
}

}  // namespace render::palette
