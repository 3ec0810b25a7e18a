#include <fmt/format.h>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/studies/claims.h"
#include "engine/studies/runs.h"
#include "engine/studies/study.h"
#include "engine/studies/study_files.h"

namespace studies {
namespace {

// Listed explicitly, because a self-registering study vanishes when linked from a static library.
const Study studies[] = {
    {"stability", "Which method survives which way of breaking it?", run_stability},
    {"pareto", "Which method reaches which accuracy in the least time?", run_pareto},
    {"accuracy", "How exact is a wire of segments, and what does it cost?", run_accuracy},
    {"anatomy", "Are generated vessels fit to push wires through?", run_anatomy},
    {"patients", "Are the generator's patients those of published populations?", run_patients},
    {"robustness", "Does anything a hand may do break the wire?", run_robustness},
    {"hands", "Do devices answer the hand as they do in life?", run_hands},
    {"economy", "What do a chosen λ and an adaptive wire save?", run_economy},
    {"models", "What does each simplification of the model cost and save?", run_models},
    {"devices", "What do friction and torsion do, and what do they cost?", run_devices},
    {"imaging", "Are frames what physics says, and what do they cost?", run_imaging},
    {"realism", "Do images have the noise, greys and structure of real ones?", run_realism},
    {"separation", "How far apart should varied segments be?", run_separation},
    {"varied-segments", "How many segments should be varied at a time?", run_varied_segments},
    {"separation-frequency", "Which separations does the paper's rule choose?", run_separation_frequency},
    {"pair-relaxation", "Which two segments relax better together?", run_pair_relaxation},
    {"static-contact", "Which terms keep a wire at rest in touch with the wall?", run_static_contact},
    {"resolution", "How does the energy depend on the number of segments?", run_resolution},
    {"wall-variation", "How far does an uneven wall move the wire?", run_wall_variation,
     &wall_variation_pieces},
    {"paper-tubes", "Which tube has the paper's Fig. 13 and its Fig. 18?", run_paper_tubes},
    {"cost", "What does a relaxation cycle cost?", run_cost},
    {"triangle-walls", "Where do wires come to rest on walls of triangles?", run_triangle_walls},
};

}  // namespace

std::span<const Study> all_studies() {
    return studies;
}

const Study& find_study(std::string_view id) {
    if (id == "views") id = "realism";  // its name before it measured anything
    std::vector<std::string_view> ids;
    for (const Study& study : studies) {
        if (study.id == id) return study;
        ids.push_back(study.id);
    }
    throw io::InputError("'{}' is not a study{}; studies are: {}", id, io::suggestion(id, ids),
                         io::joined(ids));
}

std::vector<std::string> run_study(const Study& study, const std::filesystem::path& out,
                                   const StudyOptions& options) {
    const io::OwnFolder own(out);
    io::remove_leftovers(out);
    StudyOptions with_cache = options;
    if (with_cache.cache.folder.empty()) with_cache.cache.folder = anatomy::cache_beside(out);
    return write_study(study, study.run(with_cache), out);
}

std::vector<std::string> run_all_studies(const std::filesystem::path& out, const StudyOptions& options) {
    io::OwnFolder own(out);
    for (const Study& study : studies) {
        own.make(study.id);
        io::require_writable(out / study.id / fmt::format("{}.md", study.id));
        io::remove_leftovers(out / study.id);
    }
    StudyOptions each = options;
    if (each.cache.folder.empty()) each.cache.folder = anatomy::cache_beside(out);
    std::vector<std::string> notices;
    std::vector<std::pair<const Study*, StudyResult>> results;
    for (const Study& study : studies) {
        if (options.progress)
            each.progress = [&](StudyProgress p) {
                p.what = fmt::format("study {}/{}, {}: {}", results.size() + 1, std::size(studies), study.id,
                                     p.what);
                options.progress(p);
            };
        StudyResult result = study.run(each);
        for (const std::string& notice : write_study(study, result, out / study.id))
            notices.push_back(fmt::format("{}/{}", study.id, notice));
        results.emplace_back(&study, std::move(result));
    }
    std::vector<ClaimList> claims;
    for (const auto& [study, result] : results)
        if (!result.claims.empty()) claims.push_back({std::string(study->id), result.claims, result.notes});
    io::write_whole(out / "claims.json", claims_json(claims));
    io::write_whole(out / "index.html", studies_html(results, options.quick));
    return notices;
}

}  // namespace studies
