#include "engine/io/files.h"

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <fstream>
#include <iterator>
#include <unistd.h>
#include <utility>

#include "engine/io/error.h"

namespace io {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::filesystem::path& path, int reason) {
    throw InputError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(reason)));
}

/// Returns zero, or the system's error number.
int write_all(int descriptor, std::string_view text) {
    while (!text.empty()) {
        const ssize_t written = ::write(descriptor, text.data(), text.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return errno;
        text.remove_prefix(static_cast<std::size_t>(written));
    }
    return 0;
}

/// A file being written: it has a temporary name next to its target until it is renamed.
class Part {
public:
    Part(const fs::path& path, std::string_view text) : path_(path), target_(path) {
        std::error_code ignored;
        // A link remains a link: its target is replaced.
        if (fs::is_symlink(path, ignored)) target_ = fs::weakly_canonical(path, ignored);
        if (fs::is_directory(target_, ignored)) refuse(path_, EISDIR);
        // Devices and pipes are written to directly.
        through_ = fs::exists(target_, ignored) && !fs::is_regular_file(target_, ignored);
        static std::atomic<int> count = 0;
        beside_ = through_ ? target_
                           : fs::path(fmt::format("{}.{}.{}.part", target_.string(), ::getpid(), ++count));
        const int how = through_ ? 0 : O_CREAT | O_EXCL;
        const int descriptor = ::open(beside_.c_str(), O_WRONLY | O_CLOEXEC | how, 0666);
        if (descriptor < 0) refuse(path_, errno);
        int reason = write_all(descriptor, text);
        if (::close(descriptor) != 0 && reason == 0)
            reason = errno;  // some file systems report a failure only now
        if (reason == 0) return;
        drop();
        refuse(path_, reason);
    }
    Part(Part&& other) noexcept
        : path_(std::move(other.path_)),
          target_(std::move(other.target_)),
          beside_(std::move(other.beside_)),
          through_(std::exchange(other.through_, true)) {}
    ~Part() { drop(); }

    void put() {
        if (through_) return;
        if (std::rename(beside_.c_str(), target_.c_str()) != 0) refuse(path_, errno);
        through_ = true;
    }

private:
    void drop() {
        if (!through_) ::unlink(beside_.c_str());
        through_ = true;
    }

    fs::path path_, target_, beside_;
    bool through_ = false;  // written directly: there is nothing to rename or delete
};

}  // namespace

std::string read_text(const std::filesystem::path& path, std::string_view what, std::string_view accepted) {
    std::error_code ignored;
    std::ifstream stream(path, std::ios::binary);
    if (!fs::is_regular_file(path, ignored) || !stream)
        throw InputError(fmt::format("{}: no such {} can be read; {}", path.string(), what, accepted));
    std::string text(fs::file_size(path), '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
    return text;
}

void write_whole(const std::filesystem::path& path, std::string_view text) {
    write_whole({{path, text}});
}

void write_whole(const std::vector<std::pair<std::filesystem::path, std::string_view>>& files) {
    std::vector<Part> parts;
    for (const auto& [path, text] : files) parts.emplace_back(path, text);
    for (Part& part : parts) part.put();
}

GrowingFile::GrowingFile(const std::filesystem::path& path)
    : path_(path), descriptor_(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
    if (descriptor_ < 0) refuse(path_, errno);
}

GrowingFile::~GrowingFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

GrowingFile::GrowingFile(GrowingFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)), size_(other.size_) {}

void GrowingFile::append(std::string_view piece) {
    if (const int reason = write_all(descriptor_, piece); reason != 0) {
        if (::ftruncate(descriptor_, size_) == 0) ::lseek(descriptor_, size_, SEEK_SET);
        refuse(path_, reason);
    }
    size_ += static_cast<long long>(piece.size());
}

void GrowingFile::cut(long long size) {
    if (::ftruncate(descriptor_, size) != 0 || ::lseek(descriptor_, size, SEEK_SET) < 0) refuse(path_, errno);
    size_ = size;
}

ScratchFolder::ScratchFolder(const std::filesystem::path& wanted) {
    static std::atomic<int> count = 0;
    const std::string own = fmt::format("{}.{}.{}", wanted.empty() ? "seldinger" : wanted.filename().string(),
                                        ::getpid(), ++count);
    std::error_code failed;
    if (wanted.has_parent_path()) {
        std::filesystem::create_directories(wanted.parent_path(), failed);
        path_ = wanted.parent_path() / own;
        if (std::filesystem::create_directory(path_, failed)) return;
    }
    path_ = std::filesystem::temp_directory_path() / own;
    std::filesystem::create_directory(path_);
}

ScratchFolder::~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

}  // namespace io
