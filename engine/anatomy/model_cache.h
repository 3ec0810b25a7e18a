#pragma once
/// Where results that take seconds to make are kept between runs: generated vessels and the distance fields
/// of their walls.

#include <filesystem>
#include <functional>

namespace anatomy {

/// With a folder that cannot be written to, or an empty path, everything is merely made anew every time.
struct ModelCache {
    std::filesystem::path folder;
    std::function<void(double part, const char* what)>
        progress;  // called with 0 to 1 while something is made
};

/// The usual folder: cache, next to an output file or folder.
std::filesystem::path cache_beside(const std::filesystem::path& output);

}  // namespace anatomy
