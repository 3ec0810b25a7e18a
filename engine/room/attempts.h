#pragma once
/// Where the room keeps attempts: each in a file of its own, none of which is ever replaced. What
/// cannot be written ends a recording, and never the exercise.

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "engine/script/recording.h"

namespace room {

class Attempts {
public:
    /// Keeps none.
    Attempts() = default;
    /// `wanted` names a folder, which is made when the first attempt is kept, or the file of the first
    /// attempt: a name with an extension where there is no folder. In a folder the attempts at `renal` are
    /// renal-001.gw, renal-002.gw and so on; those after my.gw are my-2.gw, my-3.gw and so on.
    explicit Attempts(std::filesystem::path wanted);

    bool kept() const { return !wanted_.empty(); }
    const std::filesystem::path& wanted() const { return wanted_; }
    /// Throws io::InputError where no attempt could be kept now. Leaves nothing behind.
    void require_writable() const;
    /// Makes the empty file of the next attempt, numbered after all that are there, also where several
    /// programs share the folder. Throws io::InputError.
    std::filesystem::path make_next(const std::string& scenario) const;

private:
    bool in_folder() const;

    std::filesystem::path wanted_;
};

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
