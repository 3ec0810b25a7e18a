#pragma once
/// A trainee's best results, and the par of exercises whose author gave none.

#include <atomic>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "engine/anatomy/model_cache.h"
#include "engine/exercise/score.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace room {

/// The scenario's own par, or else the figures of its solution, run without images; empty when `stop` became
/// true during the run. Throws InputError.
std::optional<scenario::Par> par_of(const scenario::Scenario&, const script::CommandScript& solution,
                                    const anatomy::ModelCache&, const std::atomic<bool>& stop);

struct BestResult {
    int attempts = 0, reached = 0;
    double points = 0;           // best
    std::optional<double> time;  // shortest to the target [s]
};

/// Best results by scenario, kept in a file of the user.
class Results {
public:
    /// A file that is missing or holds no results counts as empty.
    explicit Results(std::filesystem::path);
    const BestResult* find(const std::string& scenario) const;
    /// Throws InputError when the file cannot be written; the result is then still kept in memory.
    void add(const std::string& scenario, const exercise::Grade&, const exercise::Score&);

private:
    std::filesystem::path file_;
    std::map<std::string, BestResult> best_;
};

}  // namespace room
