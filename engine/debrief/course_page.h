#pragma once
/// A class on one page, for its teacher: self-contained as the debriefing's, and without a script.

#include <span>
#include <string>

#include "engine/debrief/course.h"

namespace debrief {

/// Where everybody stands, who needs what, each learner's attempts with links to their debriefings, errors by
/// kind, and what does not count. `today` tells what is overdue and who has not trained.
std::string course_page(std::span<const CourseRow>, const CoursePlan&, const std::string& title, Day today);

}  // namespace debrief
