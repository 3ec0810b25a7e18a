#include "engine/room/attempt_recording.h"

#include <chrono>
#include <fmt/format.h>
#include <utility>

#include "engine/io/error.h"

namespace room {

void AttemptRecording::begin(const Attempts& attempts, const std::string& scenario,
                             script::RecordingHeader header) {
    header.origin.date = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
    try {
        const std::filesystem::path file = attempts.make_next(scenario);
        recording_.emplace(file, header);
        file_ = file;
        works_ = true;
    } catch (const io::InputError& error) {
        say_(fmt::format("This attempt is not recorded: {}", error.what()));
    }
}

template <class Write>
void AttemptRecording::write(Write&& what) {
    if (!recording_) return;
    try {
        what(*recording_);
    } catch (const io::InputError& error) {
        say_(fmt::format("The recording ends here: {}", error.what()));
        recording_.reset();
        works_ = false;
    }
}

void AttemptRecording::frame(int number, std::span<const script::Command> commands,
                             const script::Recording::StateHash& hash) {
    if (works_) write([&](script::Recording& file) { file.frame(number, commands, hash); });
}

void AttemptRecording::take_back(int frame) {
    if (works_) write([&](script::Recording& file) { file.take_back(frame); });
}

void AttemptRecording::practised(int steps_done, int steps) {
    if (works_) write([&](script::Recording& file) { file.practised(steps_done, steps); });
}

void AttemptRecording::close(const script::Recording::StateHash& hash) {
    if (works_) write([&](script::Recording& file) { file.close(hash); });
    works_ = false;
}

bool AttemptRecording::comment(const script::Comment& comment) {
    if (!recording_ || comment.frame > recording_->last_frame()) return false;
    write([&](script::Recording& file) { file.comment(comment); });
    return recording_.has_value();
}

}  // namespace room
