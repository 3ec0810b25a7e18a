#pragma once
/// A file's bytes as they lie in the system's memory.

#include <cstddef>
#include <fcntl.h>
#include <filesystem>
#include <memory>
#include <span>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace geometry {

/// A file's bytes without a copy, which all processes that map the file share. They stay those of the file
/// that was opened, also where the path is given to another one or removed later. Files that are mapped must
/// never be written in place.
class MappedFile {
public:
    /// Null for what is no regular file, is empty, or cannot be read.
    static std::shared_ptr<const MappedFile> of(const std::filesystem::path& path) {
        // A FIFO must not hold up whoever opens it.
        const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
        if (descriptor < 0) return nullptr;
        std::shared_ptr<const MappedFile> file = of_descriptor(descriptor);
        ::close(descriptor);
        return file;
    }
    /// The same of a file that is open, and stays so.
    static std::shared_ptr<const MappedFile> of_descriptor(int descriptor) {
        struct stat found {};
        void* at = MAP_FAILED;
        if (::fstat(descriptor, &found) == 0 && S_ISREG(found.st_mode) && found.st_size > 0)
            at = ::mmap(nullptr, static_cast<std::size_t>(found.st_size), PROT_READ,
                        MAP_PRIVATE | MAP_POPULATE, descriptor, 0);
        if (at == MAP_FAILED) return nullptr;
        return std::shared_ptr<const MappedFile>(
            new MappedFile({static_cast<const std::byte*>(at), static_cast<std::size_t>(found.st_size)}));
    }
    ~MappedFile() { ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size()); }
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;

    std::span<const std::byte> bytes() const { return bytes_; }

private:
    explicit MappedFile(std::span<const std::byte> bytes) : bytes_(bytes) {}
    std::span<const std::byte> bytes_;
};

}  // namespace geometry
