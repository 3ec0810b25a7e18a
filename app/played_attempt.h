#pragma once
/// Attempts that a program makes, as a hand at the room's keys would: they stand in for skilled ones.

#include <cstdint>
#include <filesystem>
#include <optional>

#include "engine/anatomy/model_cache.h"
#include "engine/exercise/score.h"
#include "engine/room/keys.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace app {

/// What a benchmark of such attempts says of who made them.
extern const char* const by_a_program;
/// As many as a benchmark has where nobody says another number.
inline constexpr int usual_attempts = 5;

/// How fast the room's keys move the hands. To be asked before any work. Throws InputError.
room::Speeds key_speeds();

/// One attempt, recorded in the file `keep` unless that is empty; no value where it was interrupted. Throws
/// InputError.
std::optional<exercise::Score> played_attempt(const scenario::Scenario&,
                                              const script::CommandScript& solution, const room::Speeds&,
                                              std::uint64_t seed, const anatomy::ModelCache&,
                                              const std::filesystem::path& keep = {});

}  // namespace app
