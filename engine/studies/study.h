#pragma once
/// A study answers one question with numbers: tables, and a picture drawn from them.

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/anatomy/lumen_wall.h"
#include "engine/plot.h"
#include "engine/table.h"

namespace engine {

struct StudyProgress {
    int done = 0, of = 1;
    std::string what;  // was done last
};

struct StudyOptions {
    bool quick = false;                 // shorter wires and less work: a test, not a result
    int threads = 1;                    // results do not depend on it
    std::filesystem::path real_meshes;  // folder of meshes from elsewhere; may be missing
    ModelCache cache;                   // the folder, where empty, is cache beside the study's own
    std::function<void(const StudyProgress&)> progress;  // one call at a time
};

struct StudyResult {
    std::vector<Table> tables;  // each is written as NAME.csv
    std::vector<Plot> plots;    // each reads one of the tables
    std::string page;           // Markdown, written as ID.md
};

struct Study {
    std::string_view id, question;
    StudyResult (*run)(const StudyOptions&);
};

/// Every study there is, in the order they are listed.
std::span<const Study> all_studies();
/// Throws InputError that lists those that exist.
const Study& find_study(std::string_view id);

/// Runs the study and leaves its files in the folder, which is made. Returns notices, such as that no picture
/// was drawn. Throws InputError, before any work when the folder cannot be written.
std::vector<std::string> run_study(const Study&, const std::filesystem::path& out, const StudyOptions&);

}  // namespace engine
