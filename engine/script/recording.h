#pragma once
/// run.gw: the commands of an attempt as they were made, with the state hashes they led to. A recording is a
/// command script: replayed, it reaches the same state, and says so.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

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
    /// What came after a frame was not: the frame after that comes next. With -1 all goes.
    void take_back(int frame);
    /// States the last frame and its hash. Nothing may follow.
    void close(const StateHash&);

private:
    bool states(int frame) const { return frame % hash_every_ == 0; }

    io::GrowingFile file_;
    std::vector<long long> ends_;  // of the header and of each frame, in the file [bytes]
    int hash_every_ = 10;
    int last_frame_ = -1;
};

}  // namespace script
