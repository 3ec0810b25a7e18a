#include "engine/script/recording.h"

#include <algorithm>
#include <cassert>
#include <fmt/format.h>

#include "engine/io/error.h"
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
    if (!origin.patient.empty()) text += fmt::format("patient {}\n", origin.patient);
    if (origin.free_practice) text += "practice free\n";
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

void Recording::practised(int steps_done, int steps) {
    assert(steps_done >= 0 && steps_done <= steps);
    if (last_frame_ >= 0) file_.append(fmt::format("lesson {} of {}\n", steps_done, steps));
}

void Recording::close(const StateHash& state_hash) {
    if (last_frame_ < 0) return;
    std::string lines;
    if (!states(last_frame_)) lines = fmt::format("state {} {}\n", last_frame_, io::hash_text(state_hash()));
    file_.append(lines + fmt::format("{} end\n", last_frame_));
}

std::vector<std::filesystem::path> recordings_of(const std::filesystem::path& place) {
    namespace fs = std::filesystem;
    std::error_code error;
    if (!fs::is_directory(place, error)) {
        if (fs::exists(place, error)) return {place};
        throw io::InputError("{}: expected a recording (.gw) or a folder of them, found nothing of that name",
                             place.string());
    }
    std::vector<std::pair<fs::file_time_type, fs::path>> found;
    for (fs::recursive_directory_iterator it(place, fs::directory_options::skip_permission_denied, error),
         end;
         !error && it != end; it.increment(error))
        if (it->is_regular_file(error) && it->path().extension() == ".gw")
            found.emplace_back(it->last_write_time(error), it->path());
    if (found.empty())
        throw io::InputError("{}: there are no recordings in it; files ending in .gw are accepted",
                             place.string());
    std::sort(found.begin(), found.end());
    std::vector<fs::path> files;
    for (auto& [time, file] : found) files.push_back(std::move(file));
    return files;
}

}  // namespace script
