#pragma once
/// What the window and the page say alike: before an attempt and after it.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/exercise/grade.h"
#include "engine/room/keys.h"
#include "engine/room/session.h"
#include "engine/scenario/scenario.h"

namespace room {

using Lines = std::vector<std::pair<std::string, std::string>>;

/// What a trainee reads before the start, line by line.
Lines briefing(const scenario::Scenario&);
/// How the attempt is judged.
std::string judgement(const scenario::Scenario&);
/// The keys that one needs first.
std::string keys_line(const KeyMap&, const scenario::Scenario&);

/// How an attempt by hand has ended: "Target reached: 87 points, passed".
std::string outcome(const View&, const std::optional<exercise::Grade>&, bool free_practice);
bool is_lesson_passed(const View&);
/// The figures of an attempt that is not graded.
std::string without_benchmark(const exercise::Score&);
std::string error_text(const exercise::HandlingErrorMark&);
std::string wrong_branch_text(const exercise::WrongBranch&);
inline constexpr const char *without_error = "No error of handling, no wrong branch.",
                            *times_open = "A time opens the images of its moment.";
/// What a teacher showed, hid or stopped; empty where he did nothing.
std::string teacher_text(const exercise::Score&);

}  // namespace room
