#include <array>
#include <fmt/format.h>
#include <unistd.h>

#include "engine/error.h"
#include "engine/files.h"
#include "engine/studies/anatomy.h"
#include "engine/studies/economy.h"
#include "engine/studies/imaging.h"
#include "engine/studies/pareto.h"
#include "engine/studies/stability.h"
#include "engine/studies/study.h"
#include "engine/text.h"

namespace engine {
namespace {

// Explicit, for a study that registers itself vanishes when it is linked from a static library.
const std::array<Study, 5> studies = {{
    {"stability", "Which method survives which way of breaking it?", run_stability},
    {"pareto", "Which method reaches which accuracy in the least time?", run_pareto},
    {"anatomy", "Are generated vessels fit to push wires through?", run_anatomy},
    {"economy", "What do a chosen λ and an adaptive wire save?", run_economy},
    {"imaging", "Are frames what physics says, and what do they cost?", run_imaging},
}};

void make_writable(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!error && std::filesystem::is_directory(folder) && ::access(folder.c_str(), W_OK) == 0) return;
    throw InputError(fmt::format("{}: cannot be written: {}; a folder that may be written is accepted",
                                 folder.string(), error ? error.message() : "it is not such a folder"));
}

}  // namespace

std::span<const Study> all_studies() {
    return studies;
}

const Study& find_study(std::string_view id) {
    std::vector<std::string_view> ids;
    for (const Study& study : studies) {
        if (study.id == id) return study;
        ids.push_back(study.id);
    }
    throw InputError(fmt::format("'{}' is not a study; studies are: {}", id, joined(ids)));
}

std::vector<std::string> run_study(const Study& study, const std::filesystem::path& out,
                                   const StudyOptions& options) {
    make_writable(out);
    StudyOptions with_cache = options;
    if (with_cache.cache.folder.empty()) with_cache.cache.folder = cache_beside(out);
    const StudyResult result = study.run(with_cache);
    for (const Table& table : result.tables) write_whole(out / (table.name + ".csv"), to_csv(table));
    write_whole(out / (std::string(study.id) + ".md"), result.page);
    std::vector<std::string> notices;
    for (const Plot& plot : result.plots) {
        if (const std::string notice = write_plot(plot, out); !notice.empty()) notices.push_back(notice);
    }
    return notices;
}

}  // namespace engine
