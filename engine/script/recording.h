#pragma once
/// run.gw: the commands of an attempt as they were made, with the state hashes they led to. A recording is a
/// command script: replayed, it reaches the same state and checks that it does.

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "engine/io/files.h"
#include "engine/script/command.h"

namespace script {

struct RecordingHeader {
    Origin origin;
    int hash_every = 10;  // frames between two state lines
};

/// Grows by one frame at a time, each handed to the system whole, so that the part written can be replayed
/// even if the program is killed.
class Recording {
public:
    /// This and all below throw InputError when the file cannot be written.
    Recording(const std::filesystem::path&, const RecordingHeader&);

    /// Computes the state's hash; called only where it is written.
    using StateHash = std::function<std::uint64_t()>;
    void frame(int number, std::span<const Command>, const StateHash&);
    /// Keeps a teacher's comment on a frame that is made.
    void comment(const Comment&);
    /// Removes everything after a frame but comments on it and those before; the next frame to come is the
    /// one after it. The frame is one of the last `kept_frames`; with -1 all are removed.
    static constexpr std::size_t kept_frames = 4096;
    void take_back(int frame);
    /// Of a guided lesson, before the end.
    void practised(int steps_done, int steps);
    /// Writes the last frame and its hash. Nothing may follow but comments.
    void close(const StateHash&);
    int last_frame() const { return last_frame_; }  // -1 before the first

private:
    bool states(int frame) const { return frame % hash_every_ == 0; }

    io::GrowingFile file_;
    std::vector<std::pair<long long, Comment>> comments_;  // and where each stands in the file [bytes]
    long long header_ = 0;                                 // its end in the file [bytes]
    std::deque<long long> ends_;                           // of the last frames, in the file [bytes]
    int first_ = 0;                                        // frame that `ends_` begins with
    int hash_every_ = 10;
    int last_frame_ = -1;
};

/// When the recording was begun, as it says; else when its file was last written. Throws
/// std::filesystem::filesystem_error where there is none.
std::chrono::system_clock::time_point time_of(const std::filesystem::path&);

/// The recordings (.gw) in a folder and in those below it, in the order of their times; a file is its own.
/// Throws InputError where there are none, or nothing of that name.
std::vector<std::filesystem::path> recordings_of(const std::filesystem::path& file_or_folder);

}  // namespace script
