#pragma once
/// Methods of relaxation by the words that the command line and the studies call them.

#include <string>
#include <string_view>

#include "physics/relaxer.h"

namespace engine {

/// `global`, `first-order`, or `segment:M` with M varied segments (1 to 5), `segment:M:delta` at a fixed
/// separation of 2 to 200 segments. Throws InputError that lists them; `geometric` is known and refused.
physics::RelaxerConfig parse_method(std::string_view);

/// The word that parse_method reads back; settings beyond kind, M and δ are not part of it.
std::string method_text(const physics::RelaxerConfig&);

}  // namespace engine
