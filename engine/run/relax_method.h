#pragma once
/// Methods of relaxation by the words that the command line and the studies use for them.

#include <string>
#include <string_view>

#include "physics/relax/relaxer.h"

namespace run {

/// The words that parse_method accepts, one per line, for --help.
extern const std::string_view method_words;

/// Accepts one of method_words. Throws InputError listing them.
physics::RelaxerConfig parse_method(std::string_view);

/// The word that parse_method reads back; it omits settings that have no word, such as the turn limit.
std::string method_text(const physics::RelaxerConfig&);

}  // namespace run
