#include "engine/script/recording.h"

#include <cassert>
#include <fmt/format.h>

#include "engine/io/text.h"

namespace script {

Recording::Recording(const std::filesystem::path& path, const RecordingHeader& header)
    : file_(path), hash_every_(header.hash_every) {
    assert(hash_every_ > 0);
    const Origin& origin = header.origin;
    std::string text =
        fmt::format("recording {}\nprogram {} {}\nscenario {} {}\nanatomy {}\n", recording_schema,
                    io::hash_text(origin.program_hash), origin.program, io::hash_text(origin.scenario_hash),
                    origin.scenario, io::hash_text(origin.anatomy_hash));
    if (is_learner(origin.learner)) text += fmt::format("learner {}\n", origin.learner);
    file_.append(text);
    ends_.push_back(file_.size());
}

void Recording::frame(int number, std::span<const Command> commands, const StateHash& state_hash) {
    std::string lines;
    for (const Command& command : commands) lines += fmt::format("{} {}\n", number, to_text(command));
    if (states(number)) lines += fmt::format("state {} {}\n", number, io::hash_text(state_hash()));
    if (!lines.empty()) file_.append(lines);
    last_frame_ = number;
    ends_.resize(number + 2, ends_.back());
    ends_.back() = file_.size();
}

void Recording::take_back(int frame) {
    assert(frame >= -1 && frame <= last_frame_);
    file_.cut(ends_[frame + 1]);
    ends_.resize(frame + 2);
    last_frame_ = frame;
}

void Recording::close(const StateHash& state_hash) {
    if (last_frame_ < 0) return;
    std::string lines;
    if (!states(last_frame_)) lines = fmt::format("state {} {}\n", last_frame_, io::hash_text(state_hash()));
    file_.append(lines + fmt::format("{} end\n", last_frame_));
}

}  // namespace script
