#pragma once
/// A solution made of a recording of a hand.

#include <optional>
#include <string>
#include <vector>

#include "engine/author/attempt.h"
#include "engine/author/ranges.h"

namespace author {

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
