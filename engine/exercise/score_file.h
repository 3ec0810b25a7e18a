#pragma once
/// score.json, schema 3. `assets/score.schema.json` describes it as a JSON Schema.

#include <span>
#include <string>

#include "engine/exercise/score.h"
#include "engine/scenario/scenario.h"

namespace exercise {

/// What a run leaves about itself.
struct ScoreReport {
    std::string program;  // "seldinger 0.1.0"
    std::string learner;  // empty = nobody's
    Score score;          // of the last attempt, finished
    std::span<const Score> earlier;
    scenario::Benchmark benchmark;
};

/// Keys carry units. The last attempt's figures stand at the top, with benchmark and grade where there is a
/// benchmark; `earlier_attempts` holds those that a reset ended.
std::string to_json(const ScoreReport&);

}  // namespace exercise
