#pragma once
/// The people who train on this computer, each with a folder of attempts, and their best results.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/exercise/grade.h"
#include "engine/exercise/score.h"
#include "engine/room/attempts.h"

namespace room {

using exercise::pass_mark;

struct BestResult {
    int attempts = 0, reached = 0;
    double points = 0;           // best
    int passed = 0;              // attempts worth the pass mark, or with all steps of a guided lesson
    int steps = 0;               // of a guided lesson, the most that were done
    std::optional<double> time;  // shortest to the target [s]
    struct Patient {
        int attempts = 0, reached = 0;
    };
    std::map<std::string, Patient> patients;  // those beyond the first, by Scenario::patient
};

/// Best results by scenario, kept in a file of the user.
class Results {
public:
    /// A file that is missing or holds no results counts as empty.
    explicit Results(std::filesystem::path);
    const BestResult* find(const std::string& scenario) const;
    /// Throws InputError when the file cannot be written; the result is then still kept in memory.
    void add(const std::string& scenario, const exercise::Grade&, const exercise::Score&,
             const std::string& patient = {});
    /// The same of a guided lesson, which is passed by doing all its steps and reaching its target.
    void add_lesson(const std::string& scenario, int steps_done, int steps, const exercise::Score&);

private:
    void keep() const;

    std::filesystem::path file_;
    std::map<std::string, BestResult> best_;
};

/// The name of a learner's folder: the learner's own, with what a file name cannot hold written as %XX;
/// "guest" for nobody's.
std::string folder_of(const std::string& learner);

class Learners {
public:
    /// Keeps nobody.
    Learners() = default;
    /// `data`: the user's folder of data. Attempts are in recordings/NAME, results in its results.json; those
    /// of guests are in results.json of `data`.
    explicit Learners(std::filesystem::path data) : data_(std::move(data)) {}

    /// Those who have a folder, who trained last first.
    std::vector<std::string> names() const;
    /// Where the learner's attempts are kept; "" is a guest.
    Attempts attempts(const std::string& learner) const;
    /// File of the learner's results; empty where nothing is kept.
    std::filesystem::path results(const std::string& learner) const;

private:
    std::filesystem::path folder(const std::string& learner) const {
        return data_ / "recordings" / folder_of(learner);
    }

    std::filesystem::path data_;
};

}  // namespace room
