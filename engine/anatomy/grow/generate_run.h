#pragma once
/// Generates one anatomy, from a preset or a file to the files in a folder.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/grow/vessel_tree.h"
#include "engine/anatomy/model_cache.h"

namespace anatomy {

struct GenerateRequest {
    std::string source;  // a preset's name, or a .toml file
    std::uint64_t seed = 0;
    PatientWish patient;
    std::filesystem::path out;
    std::string name;  // of the files; by default the preset's or the file's
    std::vector<Stenosis> stenoses;
    std::vector<Aneurysm> aneurysms;
    std::vector<Tortuosity> tortuosities;
    int threads = 2;
    std::string program;  // name and version, for the provenance
    std::function<void(double part, const char* what)> progress;
};

struct GenerateOutcome {
    std::filesystem::path file;  // NAME.anatomy.json
    std::size_t triangles = 0, branches = 0;
    std::vector<std::string> ends, targets;
    std::string patient;  // empty for vessels that are not a preset's
    bool kept = false;    // the folder already held it, made from the same input by the same version
};

/// Generates the anatomy unless the folder already holds it. Throws InputError; for a folder that cannot be
/// written, before any work.
GenerateOutcome run_generate(const GenerateRequest&);

/// The anatomy of a spec: read from the cache when that holds the same shape; else generated, which takes
/// seconds, and stored there in anatomy-SHAPE/. The result has the same bits either way. Throws InputError as
/// generate does.
Anatomy generated_anatomy(const VesselTreeSpec&, const ModelCache& = {});
/// Whether the cache has it, whole.
bool is_kept(const VesselTreeSpec&, const ModelCache&);

}  // namespace anatomy
