#pragma once
/// Files that are whole or not there.

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace io {

/// The whole file. Throws InputError "PATH: no such WHAT can be read; ACCEPTED".
std::string read_text(const std::filesystem::path&, std::string_view what, std::string_view accepted);

/// Writes next to the target, under a name of its own that ends in ".part", then renames. A link's target is
/// replaced, not the link; devices and pipes are written to. On failure nothing is left behind and InputError
/// names the path and the reason the system gave.
void write_whole(const std::filesystem::path&, std::string_view text);
/// The same for several: none is touched before all are written.
void write_whole(const std::vector<std::pair<std::filesystem::path, std::string_view>>&);

/// A file that grows by whole pieces: one that cannot be written in full is taken back.
class GrowingFile {
public:
    /// Creates the file or empties it. Throws InputError.
    explicit GrowingFile(const std::filesystem::path&);
    ~GrowingFile();
    GrowingFile(GrowingFile&&) noexcept;
    GrowingFile(const GrowingFile&) = delete;
    GrowingFile& operator=(const GrowingFile&) = delete;
    GrowingFile& operator=(GrowingFile&&) = delete;

    /// Hands the piece to the system before it returns. Throws InputError with the file as it was before.
    void append(std::string_view piece);
    long long size() const { return size_; }  // [bytes]
    /// Takes back all after the first `size` bytes. Throws InputError.
    void cut(long long size);

private:
    std::filesystem::path path_;
    int descriptor_ = -1;
    long long size_ = 0;  // [bytes]
};

/// A folder of its own, gone at the end unless it has been renamed.
class ScratchFolder {
public:
    /// Beside `wanted`, or where temporary files are when nothing is wanted or that cannot be written. Throws
    /// std::filesystem::filesystem_error when there is no place at all.
    explicit ScratchFolder(const std::filesystem::path& wanted = {});
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

}  // namespace io
