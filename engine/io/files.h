#pragma once
/// Files that are either complete or absent, and none of which is both read and written, or written twice.

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace io {

/// Throws InputError "PATH: is a FIFO; expected a regular file" for what is neither a regular file nor a
/// folder: opening or reading it could take for ever. A path where nothing is passes.
void require_no_device(const std::filesystem::path&);

/// Opens a file for reading. Throws InputError as require_no_device, and "PATH: no such WHAT can be read;
/// ACCEPTED" for all else that is no regular file.
std::ifstream open_to_read(const std::filesystem::path&, std::string_view what, std::string_view accepted);

/// Returns the whole file. Throws InputError as open_to_read, and for a file larger than `largest_text`.
inline constexpr std::uintmax_t largest_text = 2'000'000'000;  // [bytes]
std::string read_text(const std::filesystem::path&, std::string_view what, std::string_view accepted);

/// The path of a file that another one names, which may come from anywhere: in the same folder, or one within
/// it. Throws InputError "FILE: WHERE: 'NAME' was found; …" for any other.
std::filesystem::path file_beside(const std::filesystem::path& file, const std::string& where,
                                  const std::string& name);
/// Whether file_beside takes the name.
bool lies_beside(const std::filesystem::path& file, const std::string& name);

/// Who may read a new file: whom the umask lets, or its owner alone whatever the umask.
enum class Readers { Usual, Owner };

/// Writes to a unique name ending in ".part" next to the target, then renames. The target of a link is
/// replaced, not the link; devices and pipes are written to directly. On failure nothing is left behind and
/// InputError states the path and the system's reason.
void write_whole(const std::filesystem::path&, std::string_view text, Readers = Readers::Usual);
/// Throws InputError, as write_whole would, where the file cannot be made or replaced now; nothing changes.
/// To be called before the work whose result it takes.
void require_writable(const std::filesystem::path&);
/// Makes a folder that its owner alone can enter, and those above it as usual. One that is there stays as it
/// is. Returns why it cannot be made; empty where it is there.
std::string make_private_folder(const std::filesystem::path&);
/// Makes a folder and those above it, unless they are there. Throws InputError.
void make_folder(const std::filesystem::path&);
/// Puts a folder at another path, too, in place of what is there: by links to the same files where the file
/// system has them. Throws InputError.
void put_beside(const std::filesystem::path& from, const std::filesystem::path& to);
/// Makes an empty file. False where something has that name already, which stays as it is; a link counts,
/// also one to nothing. Throws InputError where the file cannot be made.
bool make_new(const std::filesystem::path&);
/// The same as write_whole for several files: none is replaced before all are written.
void write_whole(const std::vector<std::pair<std::filesystem::path, std::string_view>>&);

/// The same for a file that is made piece by piece.
class WholeFile {
public:
    /// Opens the file under its temporary name. Throws InputError, as all below.
    explicit WholeFile(const std::filesystem::path&, Readers = Readers::Usual);
    /// Leaves nothing behind unless the file was put in its place.
    ~WholeFile();
    WholeFile(WholeFile&&) noexcept;
    WholeFile(const WholeFile&) = delete;
    WholeFile& operator=(const WholeFile&) = delete;
    WholeFile& operator=(WholeFile&&) = delete;

    void append(std::string_view piece);
    /// After the last piece: `put` cannot fail any more for want of room.
    void close();
    void put();

private:
    std::filesystem::path path_, target_, beside_;
    bool through_ = false;  // written directly, or put already: there is nothing to rename or delete
    int descriptor_ = -1;
};

/// A file that grows by whole pieces: a piece that cannot be written in full is removed again.
class GrowingFile {
public:
    /// Creates the file or empties it, and locks it while this exists. Throws InputError, also where another
    /// process is writing it.
    explicit GrowingFile(const std::filesystem::path&);
    ~GrowingFile();
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

/// A folder with a unique name ending in ".part", deleted at the end unless it has been renamed.
class ScratchFolder {
public:
    /// Created beside `wanted`, or in the folder for temporary files when `wanted` is empty or cannot be
    /// written. Throws InputError when neither works.
    explicit ScratchFolder(const std::filesystem::path& wanted = {});
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

/// A file of its own in a folder, locked until the process ends however it ends; it holds the process number.
class LockFile {
public:
    LockFile() = default;
    ~LockFile();
    LockFile(LockFile&&) noexcept;
    LockFile& operator=(LockFile&&) = delete;
    LockFile(const LockFile&) = delete;
    LockFile& operator=(const LockFile&) = delete;

    /// Makes and locks the file. Without success it is not held, and errno says why: EWOULDBLOCK where
    /// another process has it.
    static LockFile of(const std::filesystem::path&);
    bool held() const { return descriptor_ >= 0; }
    /// The process that has written its number into such a file, if it did.
    static std::optional<long> owner(const std::filesystem::path&);

private:
    std::filesystem::path path_;
    int descriptor_ = -1;
};

/// A folder for outputs, which this process alone writes to while this exists.
class OwnFolder {
public:
    /// Makes the folder, and those above it, and locks it by the file ".NAME.lock" in it. Throws InputError
    /// where it cannot be made or written to, and at once, with the number of the process, where another one
    /// has it.
    explicit OwnFolder(const std::filesystem::path&, const std::string& name = "seldinger");
    /// Removes the lock, and folders made here that are empty.
    ~OwnFolder();
    OwnFolder(const OwnFolder&) = delete;
    OwnFolder& operator=(const OwnFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }
    /// Makes a folder within it, unless it is there. Throws InputError where it cannot be made.
    void make(const std::filesystem::path& inner);
    /// From now on folders stay that are empty.
    void keep();

private:
    void remove_empty();

    std::filesystem::path path_;
    std::vector<std::filesystem::path> made_;  // outer ones first
    std::optional<LockFile> lock_;
};

/// Removes what this process is writing and has not finished: parts, scratch folders and locks; and folders
/// made for outputs that are still empty. For a program that ends without unwinding.
void remove_unfinished();
/// Removes from the folder what processes that have ended left unfinished there. Nothing happens where that
/// is not allowed, or where there is no such folder.
void remove_leftovers(const std::filesystem::path& folder);

/// A file that a command writes, and the option that asks for it, such as "--trace".
struct Output {
    std::string option;
    std::filesystem::path file;
};

/// The file that writing to the path would make or replace: links are followed, those to nothing too.
std::filesystem::path file_behind(const std::filesystem::path&);
/// Whether both are one file, there or yet to be made, under whatever names.
bool same_file(const std::filesystem::path&, const std::filesystem::path&);
/// To be called before any work. Throws InputError where an output is one of the inputs, a file that is there
/// below a folder among them, or another output.
void require_distinct(std::span<const Output> outputs, std::span<const std::filesystem::path> inputs);

}  // namespace io
