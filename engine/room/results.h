#pragma once
/// A trainee's best results.

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "engine/exercise/grade.h"
#include "engine/exercise/score.h"

namespace room {

using exercise::pass_mark;

struct BestResult {
    int attempts = 0, reached = 0;
    double points = 0;           // best
    int passed = 0;              // attempts worth the pass mark
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
