#pragma once
/// What a teacher said and did in a recording, moment by moment, for the debriefing.

#include <string>

#include "engine/debrief/story.h"

namespace debrief {

/// A heading and a list, of the last attempt; comments on those before it follow with their frames. Empty
/// where no teacher was. An item with "data-frame" moves the time line to its moment.
std::string teacher_section(const Story&);

}  // namespace debrief
