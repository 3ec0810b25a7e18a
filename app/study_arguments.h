#pragma once
/// The arguments of `seldinger study`: `seldinger` knows them for its help, and seldinger-study reads them.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/arguments.h"

namespace app {

struct StudyArguments {
    std::string id, out;
    std::vector<std::filesystem::path> folders;  // of shards to merge
    std::filesystem::path pictures;
    std::optional<std::string> shard;
    bool quick = false;
    int threads = 2;
    std::uint64_t seed = 1;
};

extern const char* const study_description;
void add_study_arguments(CLI::App&, StudyArguments&);

}  // namespace app
