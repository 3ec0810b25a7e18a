#include "engine/io/outputs.h"

#include <algorithm>

#include "engine/io/error.h"

namespace io {
namespace {

namespace fs = std::filesystem;

/// Absolute, without links as far as it exists.
fs::path whole_path(const fs::path& path) {
    std::error_code failed;
    const fs::path behind = fs::absolute(file_behind(path), failed);
    const fs::path whole = fs::weakly_canonical(behind, failed);
    return failed ? behind.lexically_normal() : whole;
}

/// Whether the file is there, and lies in the folder or in one of its folders.
bool is_found_below(const fs::path& file, const fs::path& folder) {
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored) || !fs::exists(file, ignored)) return false;
    const fs::path below = whole_path(file), above = whole_path(folder);
    return std::mismatch(above.begin(), above.end(), below.begin(), below.end()).first == above.end();
}

}  // namespace

fs::path file_behind(const fs::path& path) {
    constexpr int most_links = 40;  // as the system follows
    fs::path at = path;
    std::error_code failed;
    for (int link = 0; link < most_links && fs::is_symlink(at, failed); ++link) {
        const fs::path to = fs::read_symlink(at, failed);
        if (failed) break;
        at = to.is_absolute() ? to : at.parent_path() / to;
    }
    return at;
}

bool same_file(const fs::path& a, const fs::path& b) {
    if (a.empty() || b.empty()) return false;
    std::error_code failed;
    if (fs::equivalent(a, b, failed) && !failed) return true;
    return whole_path(a) == whole_path(b);
}

void require_distinct(std::span<const Output> outputs, std::span<const fs::path> inputs) {
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        const auto& [option, file] = outputs[i];
        for (const fs::path& input : inputs)
            if (same_file(file, input) || is_found_below(file, input))
                throw InputError("{}: {} would overwrite what is read; expected another file", option,
                                 file.string());
        for (std::size_t j = 0; j < i; ++j)
            if (same_file(file, outputs[j].file))
                throw InputError("{}: {} would be written twice, by {} too; expected another file", option,
                                 file.string(), outputs[j].option);
    }
}

}  // namespace io
