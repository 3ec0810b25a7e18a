#include "engine/io/files.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <fstream>
#include <iterator>
#include <mutex>
#include <optional>
#include <set>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "engine/io/error.h"
#include "engine/io/text.h"

namespace io {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::filesystem::path& path, int reason) {
    throw InputError("{}: cannot be written: {}", path.string(), std::strerror(reason));
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

/// The paths that remove_unfinished() is for.
struct Unfinished {
    std::mutex mutex;
    std::set<fs::path> paths;
    std::set<fs::path> folders;  // removed where they are empty
};
Unfinished& unfinished() {
    static Unfinished* const all = new Unfinished;  // outlives what is destroyed at the program's end
    return *all;
}
void add_unfinished(const fs::path& path) {
    const std::lock_guard lock(unfinished().mutex);
    unfinished().paths.insert(fs::absolute(path));
}
void drop_unfinished(const fs::path& path) {
    const std::lock_guard lock(unfinished().mutex);
    unfinished().paths.erase(fs::absolute(path));
}

void add_empty_folder(const fs::path& path) {
    const std::lock_guard lock(unfinished().mutex);
    unfinished().folders.insert(path);
}
void drop_empty_folder(const fs::path& path) {
    const std::lock_guard lock(unfinished().mutex);
    unfinished().folders.erase(path);
}

/// NAME.PROCESS.COUNT.part
std::string part_name(const std::string& name) {
    static std::atomic<int> count = 0;
    return fmt::format("{}.{}.{}.part", name, ::getpid(), ++count);
}
/// The process in such a name.
std::optional<pid_t> process_of(std::string_view name) {
    if (!name.ends_with(".part")) return {};
    name.remove_suffix(5);
    const std::size_t count = name.rfind('.');
    if (count == std::string_view::npos || count == 0) return {};
    const std::size_t process = name.rfind('.', count - 1);
    if (process == std::string_view::npos || !parse_integer(name.substr(count + 1))) return {};
    return parse_integer(name.substr(process + 1, count - process - 1));
}

/// Whether there is such a process, and not only what its parent has yet to take notice of.
bool runs(pid_t process) {
    if (::kill(process, 0) != 0) return errno != ESRCH;
    std::ifstream stream(fmt::format("/proc/{}/stat", process));
    const std::string stat(std::istreambuf_iterator<char>(stream), {});
    const std::size_t name_end = stat.rfind(") ");  // the name may hold anything
    return name_end == std::string::npos || stat.compare(name_end + 2, 1, "Z") != 0;
}

/// Removes from the folder what processes that have ended left of names that begin so.
void remove_leftovers_of(const fs::path& folder, std::string_view begin) {
    std::error_code failed;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
         entry.increment(failed)) {
        const std::string name = entry->path().filename().string();
        const std::optional<pid_t> process = process_of(name);
        if (!process || *process <= 0 || !name.starts_with(begin)) continue;
        if (runs(*process)) continue;
        std::error_code ignored;
        fs::remove_all(entry->path(), ignored);
    }
}

/// Where files for a while should be, whether the folder is there or not.
std::string temporary_folder_named() {
    for (const char* name : {"TMPDIR", "TMP", "TEMP", "TEMPDIR"})
        if (const char* const folder = std::getenv(name)) return folder;
    return "/tmp";
}

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

void require_no_device(const fs::path& path) {
    struct stat found {};
    if (::stat(path.c_str(), &found) != 0 || S_ISREG(found.st_mode) || S_ISDIR(found.st_mode)) return;
    throw InputError("{}: is a {}; expected a regular file", path.string(),
                     S_ISFIFO(found.st_mode)   ? "FIFO"
                     : S_ISSOCK(found.st_mode) ? "socket"
                                               : "device");
}

std::ifstream open_to_read(const fs::path& path, std::string_view what, std::string_view accepted) {
    require_no_device(path);
    std::error_code ignored;
    std::ifstream stream;
    if (fs::is_regular_file(path, ignored)) stream.open(path, std::ios::binary);
    if (!stream.is_open()) throw InputError("{}: no such {} can be read; {}", path.string(), what, accepted);
    return stream;
}

std::string read_text(const fs::path& path, std::string_view what, std::string_view accepted) {
    std::ifstream stream = open_to_read(path, what, accepted);
    std::error_code failed;
    const std::uintmax_t size = fs::file_size(path, failed);
    if (failed || size > largest_text)
        throw InputError("{}: {:.3g} million bytes were found; expected at most {:.0f} million",
                         path.string(), 1e-6 * static_cast<double>(failed ? 0 : size),
                         1e-6 * static_cast<double>(largest_text));
    std::string text(size, '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
    return text;
}

WholeFile::WholeFile(const fs::path& path, Readers readers) : path_(path), target_(path) {
    std::error_code ignored;
    // A link remains a link: its target is replaced.
    target_ = file_behind(path);
    if (fs::is_symlink(target_, ignored)) refuse(path_, ELOOP);
    if (fs::is_directory(target_, ignored)) refuse(path_, EISDIR);
    // Devices and pipes are written to directly.
    through_ = fs::exists(target_, ignored) && !fs::is_regular_file(target_, ignored);
    beside_ = through_ ? target_ : target_.parent_path() / part_name(target_.filename().string());
    const int how = through_ ? 0 : O_CREAT | O_EXCL;
    if (!through_) add_unfinished(beside_);
    descriptor_ =
        ::open(beside_.c_str(), O_WRONLY | O_CLOEXEC | how, readers == Readers::Owner ? 0600 : 0666);
    if (descriptor_ >= 0) return;
    const int why = errno;
    if (!through_) drop_unfinished(beside_);
    refuse(path_, why);
}

WholeFile::WholeFile(WholeFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      beside_(std::move(other.beside_)),
      through_(std::exchange(other.through_, true)),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

WholeFile::~WholeFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (through_) return;
    ::unlink(beside_.c_str());
    drop_unfinished(beside_);
}

void WholeFile::append(std::string_view piece) {
    if (const int reason = write_all(descriptor_, piece); reason != 0) refuse(path_, reason);
}

void WholeFile::close() {
    // Some file systems report a failure only now.
    if (::close(std::exchange(descriptor_, -1)) != 0) refuse(path_, errno);
}

void WholeFile::put() {
    if (descriptor_ >= 0) close();
    if (through_) return;
    if (std::rename(beside_.c_str(), target_.c_str()) != 0) refuse(path_, errno);
    drop_unfinished(beside_);
    through_ = true;
}

void require_writable(const fs::path& path) {
    std::error_code ignored;
    // Opening a FIFO waits for its reader, and closing it again would end what the reader gets.
    if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored) &&
        !fs::is_directory(path, ignored)) {
        if (::access(path.c_str(), W_OK) != 0) refuse(path, errno);
        return;
    }
    if (path.empty() || !path.has_filename()) refuse(path, path.empty() ? ENOENT : EISDIR);
    const WholeFile removed_again(path);
    const fs::path target = fs::weakly_canonical(file_behind(path), ignored);
    remove_leftovers_of(target.parent_path(), target.filename().string() + ".");
}

void write_whole(const std::filesystem::path& path, std::string_view text, Readers readers) {
    WholeFile file(path, readers);
    file.append(text);
    file.put();
}

void write_whole(const std::vector<std::pair<std::filesystem::path, std::string_view>>& files) {
    std::vector<WholeFile> parts;
    for (const auto& [path, text] : files) {
        parts.emplace_back(path).append(text);
        parts.back().close();
    }
    for (WholeFile& part : parts) part.put();
}

std::string make_private_folder(const fs::path& path) {
    const fs::path folder = path.has_filename() ? path : path.parent_path();
    std::error_code failed;
    if (fs::is_directory(folder, failed)) return {};
    if (folder.has_parent_path()) fs::create_directories(folder.parent_path(), failed);
    if (::mkdir(folder.c_str(), 0700) == 0) return {};
    const int why = errno;
    return fs::is_directory(folder, failed) ? std::string() : std::strerror(why);
}

namespace {

/// From the file's folder; empty for what lies elsewhere. By names alone: a link within the folder was put
/// there by whoever put the folder there.
fs::path from_beside(const fs::path& file, const std::string& name) {
    fs::path path(name);
    std::error_code failed;
    if (path.is_absolute()) {
        path = path.lexically_normal().lexically_relative(
            fs::absolute(file, failed).parent_path().lexically_normal());
        if (failed) return {};
    }
    path = path.lexically_normal();
    if (path.empty() || *path.begin() == ".." || path == "." || name.find('\0') != std::string::npos)
        return {};
    return path;
}

}  // namespace

fs::path file_beside(const fs::path& file, const std::string& where, const std::string& name) {
    const fs::path path = from_beside(file, name);
    if (path.empty())
        throw InputError("{}: {}: '{}' was found; expected a file beside this one, or in a folder beside it",
                         file.string(), where, name.substr(0, 100));
    return file.parent_path() / path;
}
bool lies_beside(const fs::path& file, const std::string& name) {
    return !from_beside(file, name).empty();
}

void make_folder(const fs::path& folder) {
    std::error_code failed;
    fs::create_directories(folder, failed);
    std::error_code unknown;
    if (!fs::is_directory(folder, unknown))
        throw InputError("{}: the folder cannot be made: {}", folder.string(),
                         failed ? failed.message() : "a file is in its place");
}

void put_beside(const fs::path& from, const fs::path& to) {
    try {
        fs::remove_all(to);
        try {
            fs::copy(from, to, fs::copy_options::recursive | fs::copy_options::create_hard_links);
        } catch (const fs::filesystem_error&) {
            fs::remove_all(to);
            fs::copy(from, to, fs::copy_options::recursive);
        }
    } catch (const fs::filesystem_error& error) {
        throw InputError("{}: {} cannot be put there: {}", to.string(), from.string(),
                         error.code().message());
    }
}

bool make_new(const std::filesystem::path& path) {
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor < 0 && errno == EEXIST) return false;
    if (descriptor < 0) refuse(path, errno);
    ::close(descriptor);
    return true;
}

GrowingFile::GrowingFile(const std::filesystem::path& path)
    : path_(path), descriptor_(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666)) {
    if (descriptor_ < 0) refuse(path_, errno);
    struct stat found {};
    if (::fstat(descriptor_, &found) != 0 || !S_ISREG(found.st_mode)) return;  // nothing to lock or to empty
    const bool other = ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (!other && ::ftruncate(descriptor_, 0) == 0) return;
    const int why = errno;
    ::close(descriptor_);
    if (!other) refuse(path_, why);
    throw InputError(
        "{}: another process is writing it; expected another file, or this one when that has ended",
        path_.string());
}

GrowingFile::~GrowingFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

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
    const std::string own = part_name(wanted.empty() ? "seldinger" : wanted.filename().string());
    std::error_code failed;
    if (wanted.has_parent_path()) {
        std::filesystem::create_directories(wanted.parent_path(), failed);
        path_ = wanted.parent_path() / own;
        add_unfinished(path_);
        if (std::filesystem::create_directory(path_, failed)) return;
        drop_unfinished(path_);
    }
    const fs::path folder = std::filesystem::temp_directory_path(failed);
    if (!failed) {
        remove_leftovers_of(folder, "seldinger.");
        path_ = folder / own;
        add_unfinished(path_);
        if (std::filesystem::create_directory(path_, failed)) return;
        drop_unfinished(path_);
    }
    throw InputError(
        "{}: a folder for temporary files cannot be made: {}; expected a folder that can be written, named "
        "by TMPDIR",
        folder.empty() ? temporary_folder_named() : folder.string(),
        failed ? failed.message() : "something is in its place");
}

ScratchFolder::~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
    drop_unfinished(path_);
}

LockFile::~LockFile() {
    if (descriptor_ < 0) return;
    ::unlink(path_.c_str());
    drop_unfinished(path_);
    ::close(descriptor_);
}

LockFile::LockFile(LockFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

LockFile LockFile::of(const fs::path& path) {
    LockFile lock;
    while (true) {
        const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
        if (descriptor < 0) return lock;
        if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
            const int why = errno;
            if (why != EWOULDBLOCK) ::unlink(path.c_str());
            ::close(descriptor);
            errno = why;
            return lock;
        }
        // Who had it before may have removed the file since it was opened.
        struct stat mine {
        }, there{};
        if (::fstat(descriptor, &mine) == 0 && ::stat(path.c_str(), &there) == 0 &&
            mine.st_ino == there.st_ino && mine.st_dev == there.st_dev) {
            lock.path_ = path;
            lock.descriptor_ = descriptor;
            add_unfinished(path);
            // A full disk has no room for the number; the lock holds without it.
            if (::ftruncate(descriptor, 0) == 0) write_all(descriptor, fmt::format("{}\n", ::getpid()));
            return lock;
        }
        ::close(descriptor);
    }
}

std::optional<long> LockFile::owner(const fs::path& path) {
    char text[24] = {};
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (descriptor < 0) return {};
    const ssize_t got = ::read(descriptor, text, sizeof text);
    ::close(descriptor);
    const std::string_view all(text, static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    const std::size_t end = all.find('\n');
    if (end == std::string_view::npos) return {};
    return parse_integer(all.substr(0, end));
}

OwnFolder::OwnFolder(const fs::path& path, const std::string& name) : path_(path) {
    const auto refuse_folder = [&](const std::string& why) {
        remove_empty();
        throw InputError("{}: {}", path_.string(), why);
    };
    if (path.empty()) throw InputError("an output folder without a name was found; expected a folder");
    std::error_code error;
    std::vector<fs::path> missing;
    // "out/" and "out/." name the folder out.
    for (fs::path at = fs::absolute(path).lexically_normal();
         !fs::exists(at, error) && at.has_relative_path(); at = at.parent_path())
        if (at.has_filename()) missing.push_back(at);
    for (; !missing.empty(); missing.pop_back()) {
        if (!fs::create_directory(missing.back(), error)) break;  // another process may have made it
        made_.push_back(missing.back());
        add_empty_folder(missing.back());
    }
    fs::create_directories(path_, error);
    std::error_code ignored;
    if (!fs::is_directory(path_, ignored))
        refuse_folder(fmt::format(
            "cannot be written: the output folder cannot be made: {}; expected a folder that can be written",
            error ? error.message() : "a file is in its place"));
    const fs::path file = path_ / ("." + name + ".lock");
    lock_.emplace(LockFile::of(file));
    if (lock_->held()) return;
    const int why = errno;
    if (why == EWOULDBLOCK) {
        const std::optional<long> owner = LockFile::owner(file);
        refuse_folder(fmt::format(
            "{} is writing to this folder; expected another folder, or this one when that has ended",
            owner ? fmt::format("process {}", *owner) : "another process"));
    }
    // Some file systems know no locks; it is enough that a file can be made there.
    if (why == ENOLCK || why == ENOTSUP || why == ENOSYS || why == EINVAL) return;
    refuse_folder(
        fmt::format("cannot be written: {}; expected a folder that can be written", std::strerror(why)));
}

OwnFolder::~OwnFolder() {
    lock_.reset();
    remove_empty();
}

void OwnFolder::make(const fs::path& inner) {
    std::error_code error;
    const fs::path folder = fs::absolute(path_).lexically_normal() / inner;
    if (fs::create_directory(folder, error)) {
        made_.push_back(folder);
        add_empty_folder(folder);
    }
    if (std::error_code ignored; fs::is_directory(folder, ignored)) return;
    throw InputError(
        "{}: cannot be written: the output folder cannot be made: {}; expected a folder that can be written",
        folder.string(), error ? error.message() : "a file is in its place");
}

void OwnFolder::keep() {
    for (const fs::path& folder : made_) drop_empty_folder(folder);
    made_.clear();
}

void OwnFolder::remove_empty() {
    for (; !made_.empty(); made_.pop_back()) {
        ::rmdir(made_.back().c_str());
        drop_empty_folder(made_.back());
    }
}

void remove_unfinished() {
    const std::lock_guard lock(unfinished().mutex);
    std::error_code ignored;
    for (const fs::path& path : unfinished().paths) fs::remove_all(path, ignored);
    // What is within a folder is after it in the set.
    for (auto folder = unfinished().folders.rbegin(); folder != unfinished().folders.rend(); ++folder)
        ::rmdir(folder->c_str());
}

void remove_leftovers(const std::filesystem::path& folder) {
    remove_leftovers_of(folder, "");
}

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
