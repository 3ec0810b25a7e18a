#pragma once
/// Files of strangers are read behind a wall: in a child process with limits of time, memory, stack and
/// system calls, so that no file, whatever is in it, can end this process, hang it, write a file or reach the
/// network.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <shared_mutex>
#include <span>
#include <utility>

#include "physics/geometry/mapped_file.h"
#include "physics/geometry/state.h"

namespace io {

/// What a reader may take.
struct WallLimits {
    double processor_time = 600;           // of all its threads [s]
    std::uint64_t memory = 4'294'967'296;  // beyond what this process has, and the size of the file [bytes]
    std::uint64_t stack = 8'388'608;       // of its main thread [bytes]
};

/// Called with 0 to 1 while something takes long, and with what it is.
using Progress = std::function<void(double part, const char* what)>;

/// Held, shared, while libraries with locks of their own are used in this process (DCMTK, assimp): a child
/// that is made meanwhile by another thread would wait for those locks for ever.
class NoChildMeanwhile {
public:
    NoChildMeanwhile();

private:
    std::shared_lock<std::shared_mutex> lock_;
};

/// While one exists readers work in this process: for fuzzers, which look for what the wall keeps off.
class WithoutWall {
public:
    WithoutWall();
    ~WithoutWall();
    WithoutWall(const WithoutWall&) = delete;
    WithoutWall& operator=(const WithoutWall&) = delete;
};
bool has_wall();

/// Calls `work` in a child and returns the bytes that it passed to its stream, in memory that is no file.
/// Here `progress` is called with what `work` calls its own with; when it throws, the child ends. Throws what
/// `work` threw, InputError or std::bad_alloc, or else std::logic_error; and InputError "PATH: …" for a child
/// that met a limit or crashed. Of signals the child hears none that this process handles; it ends with the
/// thread that waits for it.
std::shared_ptr<const geometry::MappedFile> behind_wall(
    const std::filesystem::path& file, const Progress& progress,
    const std::function<void(geometry::StateStream&, const Progress&)>& work, const WallLimits& = {});

/// What `read(progress)` returns, read behind the wall. `fields(stream, value)` passes all of it to a stream,
/// as a state() does (physics/geometry/state.h). The caller checks what it relies on: bytes of a child that a
/// file has taken over may be any.
template <class Read, class Fields>
auto read_behind_wall(const std::filesystem::path& file, const Progress& progress, const Read& read,
                      const Fields& fields, const WallLimits& limits = {}) {
    if (!has_wall()) return read(progress);
    const auto bytes = behind_wall(
        file, progress,
        [&](geometry::StateStream& stream, const Progress& told) {
            auto result = read(told);
            fields(stream, result);
        },
        limits);
    decltype(read(progress)) result;
    geometry::StateReader reader(bytes ? bytes->bytes() : std::span<const std::byte>());
    fields(reader, result);
    reader.finish();
    return result;
}

}  // namespace io
