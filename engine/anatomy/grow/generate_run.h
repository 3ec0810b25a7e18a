#pragma once
/// One generated anatomy, from a preset or a file to the files of a folder.

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
    std::filesystem::path out;
    std::string name;  // of the files; else the preset's or the file's
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
    bool kept = false;  // the folder held it already, made from the same by the same version
};

/// Makes the anatomy unless the folder holds it. Throws InputError, before any work when the folder cannot be
/// written.
GenerateOutcome run_generate(const GenerateRequest&);

/// The anatomy of a spec, from the cache when that holds the same shape; else it is made, which takes
/// seconds, and kept there in anatomy-SHAPE/. The same bits either way. Throws InputError as generate does.
Anatomy generated_anatomy(const VesselTreeSpec&, const ModelCache& = {});

}  // namespace anatomy
