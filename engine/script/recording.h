#pragma once
/// run.gw: the commands of an attempt as they were made, with the state hashes they led to. A recording is a
/// command script: replayed, it reaches the same state, and says so.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "engine/io/files.h"
#include "engine/script/command.h"

namespace script {

struct RecordingHeader {
    std::string program;   // "seldinger 0.1.0"
    std::string scenario;  // name
    int hash_every = 10;   // frames between two state lines
};

/// Grows by one frame at a time, each handed to the system whole, so that what is there can be replayed even
/// if the program is killed.
class Recording {
public:
    /// Throws InputError when the file cannot be written, here and below.
    Recording(const std::filesystem::path&, const RecordingHeader&);

    /// The state's hash, asked for where it is written.
    using StateHash = std::function<std::uint64_t()>;
    void frame(int number, std::span<const Command>, const StateHash&);
    /// States the last frame and its hash. Nothing may follow.
    void close(const StateHash&);

private:
    io::GrowingFile file_;
    int hash_every_ = 10;
    int last_frame_ = -1;
    bool last_hash_written_ = false;
};

}  // namespace script
