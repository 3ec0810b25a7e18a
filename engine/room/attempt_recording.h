#pragma once
/// The recording of a session's attempt: what cannot be written ends it, and never the exercise.

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "engine/room/attempts.h"
#include "engine/script/recording.h"

namespace room {

class AttemptRecording {
public:
    /// `say` is told why a recording is not begun, or ends.
    explicit AttemptRecording(std::function<void(std::string)> say) : say_(std::move(say)) {}

    /// Into the next file of those kept, with the time of now.
    void begin(const Attempts&, const std::string& scenario, script::RecordingHeader);
    void frame(int number, std::span<const script::Command>, const script::Recording::StateHash&);
    void take_back(int frame);
    /// Of a guided lesson, before it is closed.
    void practised(int steps_done, int steps);
    /// Nothing follows but comments.
    void close(const script::Recording::StateHash&);
    /// Returns whether it was kept: there is a recording of its frame.
    bool comment(const script::Comment&);

    bool works() const { return works_; }                        // frames can follow
    const std::filesystem::path& file() const { return file_; }  // also of one that has ended; empty = none

private:
    template <class Write>
    void write(Write&&);

    std::function<void(std::string)> say_;
    std::optional<script::Recording> recording_;
    std::filesystem::path file_;
    bool works_ = false;
};

}  // namespace room
