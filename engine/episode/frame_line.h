#pragma once
/// States of an episode as lines of JSON, for programs in other languages.

#include <string>

#include "engine/episode/episode.h"

namespace episode {

/// One line: time, tip, target, wire and catheter in the room and in the image, hands, forces, flags, hash.
/// The keys are the names of State's fields in Python; numbers read back to the same bits.
std::string to_json(const Episode&);
/// The score as in score.json, in one line. `program`: its name and version.
std::string score_line(const Episode&, const std::string& program);
/// A text as JSON.
std::string quoted(const std::string&);

}  // namespace episode
