#pragma once
/// The people who train on this computer: each has a folder of attempts and results of her own.

#include <filesystem>
#include <string>
#include <vector>

#include "engine/room/attempts.h"

namespace room {

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
