#pragma once
/// What an attempt is worth against its par, line by line, and a trainee's best results.

#include <atomic>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/anatomy/model_cache.h"
#include "engine/exercise/score.h"
#include "engine/room/session.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace room {

struct GradeLine {
    std::string name, unit;
    std::optional<double> yours;  // empty: not reached
    std::optional<double> par;    // empty: there is none, and the line costs nothing
    double most = 0;              // points that it can cost at most
    double cost = 0;              // points
};

struct Grade {
    bool reached = false;
    std::vector<GradeLine> lines;
    double points = 0;  // 100 less all costs; 0 when the target was not reached
};

/// How points are lost, as one sentence for the end page.
extern const char* const grade_formula;

/// A line above its par costs most · min(1, yours / par − 1); each handling error costs 5 points, at most 15.
Grade grade(const exercise::Score&, const Handling&, const std::optional<exercise::Score>& par);

/// The score of a scenario's solution, run without images; empty when `stop` became true during the run.
/// Throws InputError.
std::optional<exercise::Score> par_of(const scenario::Scenario&, const script::CommandScript& solution,
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
    void add(const std::string& scenario, const Grade&, const exercise::Score&);

private:
    std::filesystem::path file_;
    std::map<std::string, BestResult> best_;
};

}  // namespace room
