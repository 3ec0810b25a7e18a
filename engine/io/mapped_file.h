#pragma once
/// A file's bytes as they lie in the system's memory, without a copy.

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>

namespace io {

/// The bytes stay those of the file that was opened, also where the path is given to another one or removed
/// later. Files that are mapped must never be written in place.
class MappedFile {
public:
    /// Nothing for what is no regular file, is empty, or cannot be read.
    static std::optional<MappedFile> of(const std::filesystem::path&);
    ~MappedFile();
    MappedFile(MappedFile&&) noexcept;
    MappedFile& operator=(MappedFile&&) = delete;
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;

    std::span<const std::byte> bytes() const { return bytes_; }

private:
    explicit MappedFile(std::span<const std::byte> bytes) : bytes_(bytes) {}
    std::span<const std::byte> bytes_;
};

}  // namespace io
