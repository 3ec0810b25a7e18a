#pragma once
/// Methods of relaxation by the words that the command line and the studies call them.

#include <string>
#include <string_view>

#include "physics/relax/relaxer.h"

namespace run {

/// The words that parse_method knows, a line each, for --help.
extern const std::string_view method_words;

/// One of method_words. Throws InputError that lists them.
physics::RelaxerConfig parse_method(std::string_view);

/// The word that parse_method reads back; settings that have no word, as the turn limit, are not part of it.
std::string method_text(const physics::RelaxerConfig&);

}  // namespace run
