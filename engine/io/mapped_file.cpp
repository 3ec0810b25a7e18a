#include "engine/io/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace io {

std::optional<MappedFile> MappedFile::of(const std::filesystem::path& path) {
    // A FIFO must not hold up whoever opens it.
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor < 0) return std::nullopt;
    struct stat found {};
    void* at = MAP_FAILED;
    if (::fstat(descriptor, &found) == 0 && S_ISREG(found.st_mode) && found.st_size > 0)
        at = ::mmap(nullptr, static_cast<std::size_t>(found.st_size), PROT_READ, MAP_PRIVATE | MAP_POPULATE,
                    descriptor, 0);
    ::close(descriptor);
    if (at == MAP_FAILED) return std::nullopt;
    return MappedFile({static_cast<const std::byte*>(at), static_cast<std::size_t>(found.st_size)});
}

MappedFile::MappedFile(MappedFile&& from) noexcept : bytes_(std::exchange(from.bytes_, {})) {}

MappedFile::~MappedFile() {
    if (!bytes_.empty()) ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

}  // namespace io
