#pragma once
/// Files that are either complete or absent.

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace io {

/// Returns the whole file. Throws InputError "PATH: no such WHAT can be read; ACCEPTED".
std::string read_text(const std::filesystem::path&, std::string_view what, std::string_view accepted);

/// Writes to a unique name ending in ".part" next to the target, then renames. The target of a link is
/// replaced, not the link; devices and pipes are written to directly. On failure nothing is left behind and
/// InputError states the path and the system's reason.
void write_whole(const std::filesystem::path&, std::string_view text);
/// The same for several files: none is replaced before all are written.
void write_whole(const std::vector<std::pair<std::filesystem::path, std::string_view>>&);

/// A file that grows by whole pieces: a piece that cannot be written in full is removed again.
class GrowingFile {
public:
    /// Creates the file or empties it. Throws InputError.
    explicit GrowingFile(const std::filesystem::path&);
    ~GrowingFile();
    GrowingFile(GrowingFile&&) noexcept;
    GrowingFile(const GrowingFile&) = delete;
    GrowingFile& operator=(const GrowingFile&) = delete;
    GrowingFile& operator=(GrowingFile&&) = delete;

    /// Hands the piece to the system before returning. Throws InputError and leaves the file as it was
    /// before.
    void append(std::string_view piece);
    long long size() const { return size_; }  // [bytes]
    /// Removes everything after the first `size` bytes. Throws InputError.
    void cut(long long size);

private:
    std::filesystem::path path_;
    int descriptor_ = -1;
    long long size_ = 0;  // [bytes]
};

/// A folder with a unique name, deleted at the end unless it has been renamed.
class ScratchFolder {
public:
    /// Created beside `wanted`, or in the folder for temporary files when `wanted` is empty or cannot be
    /// written. Throws std::filesystem::filesystem_error when neither works.
    explicit ScratchFolder(const std::filesystem::path& wanted = {});
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

}  // namespace io
