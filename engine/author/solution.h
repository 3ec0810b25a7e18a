#pragma once
/// A solution made of a recording of a hand: one line a frame, made into ranges of frames with one amount
/// each.

#include <optional>
#include <string>
#include <vector>

#include "engine/author/attempt.h"
#include "engine/script/command.h"

namespace author {

/// A line of a script: "51..80 advance 2 mm".
struct ScriptLine {
    int first = 0, last = 0;  // frames
    script::Command command;
};

/// How far motions in ranges may be from those of the recording, at any frame, of each device.
struct Nearness {
    double length = 1;                    // [mm]
    double angle = 5 * geometry::degree;  // [rad]
};

/// A script's lines, motions of consecutive frames in ranges where their amounts are equal or nearly so. The
/// sum of every motion (pushes, pulls, turns to either side, of each device) stays, to a thousandth of a
/// millimetre or degree; all other commands stay in their frames and order. Frames that bring a device out,
/// exchange or grip it, or push and pull at once, stay as they are. Throws InputError for a script with a
/// reset: it holds several attempts.
std::vector<ScriptLine> in_ranges(const script::CommandScript&, const Nearness& = {});

/// Pairs of lines of one device and kind, the second in the opposite direction, that come to nothing (nearer
/// than `near`) with no other motion in between: places of the first and the second line.
std::vector<std::pair<std::size_t, std::size_t>> coming_to_nothing(const std::vector<ScriptLine>&,
                                                                   const Nearness& = {});

/// The lines as a script, with comments above it (without "# ") and the last frame where there is one.
std::string to_text(const std::vector<ScriptLine>&, std::optional<int> end,
                    const std::vector<std::string>& comments = {});

struct Solution {
    std::string text;              // of the script
    script::CommandScript script;  // what that says
    Attempt exact;                 // the script as it is
    double nearness = 1;           // of the ranges, in parts of Nearness: smaller where these did not reach
    std::size_t dropped = 0;       // pairs of motions that came to nothing
};

/// Throws InputError for a recording of another exercise than `name`, one without motions or with a reset.
void require_recording_of(const script::CommandScript&, const std::string& name);

/// The recording in the coarsest ranges that still reach the target, without motions that come to nothing
/// where it is reached without them. `file` names the script in messages. Empty: interrupted. Throws
/// InputError where the recording itself does not reach the target.
std::optional<Solution> solution_of(const script::CommandScript& recording, const std::string& file,
                                    const exercise::Exercise& start, const TrialOptions& = {});

}  // namespace author
