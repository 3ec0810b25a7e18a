#include "engine/anatomy/model_cache.h"

namespace anatomy {

std::filesystem::path cache_beside(const std::filesystem::path& output) {
    std::filesystem::path path = std::filesystem::absolute(output).lexically_normal();
    if (!path.has_filename()) path = path.parent_path();  // "out/renal/"
    return path.parent_path() / "cache";
}

}  // namespace anatomy
