#pragma once
/// Where what takes seconds to make is kept between runs: generated vessels, the distance fields of their
/// walls.

#include <filesystem>
#include <functional>

namespace anatomy {

/// A folder that cannot be written to, or an empty path, only means that everything is made every time.
struct ModelCache {
    std::filesystem::path folder;
    std::function<void(double part, const char* what)>
        progress;  // called with 0 to 1 while something is made
};

/// The usual folder: cache, next to an output file or folder.
std::filesystem::path cache_beside(const std::filesystem::path& output);

}  // namespace anatomy
