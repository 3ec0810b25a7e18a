#pragma once
/// A page that teaches: one self-contained HTML file, without scripts or pictures from elsewhere, that a
/// browser opens from disk.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/debrief/story.h"

namespace debrief {

/// The page about the last story: grade, figures against those of skilled attempts, the expert's and the
/// earlier stories', a time line, the tip's way over the vessels from two sides, errors with their pictures,
/// and, from two attempts on, the learning curve. There must be a story; all are of one exercise. `expert`
/// may be null.
std::string page(std::span<const Story> stories, const Story* expert);

/// The bytes of a picture as the text that a page holds it in.
std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace debrief
