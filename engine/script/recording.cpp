#include "engine/script/recording.h"

#include <algorithm>
#include <cassert>
#include <fmt/format.h>
#include <fstream>
#include <string>

#include "engine/io/error.h"
#include "engine/io/text.h"

namespace script {
namespace {

/// libc++ has no to_sys before version 14, libstdc++ no to_time_t.
template <class Clock>
std::chrono::system_clock::time_point system_time(const typename Clock::time_point& time) {
    using System = std::chrono::system_clock;
    if constexpr (requires { Clock::to_sys(time); })
        return std::chrono::time_point_cast<System::duration>(Clock::to_sys(time));
    else
        return System::from_time_t(Clock::to_time_t(time));
}

}  // namespace

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
    if (origin.date) text += fmt::format("date {}\n", date_text(*origin.date));
    file_.append(text);
    header_ = file_.size();
}

void Recording::frame(int number, std::span<const Command> commands, const StateHash& state_hash) {
    std::string lines;
    for (const Command& command : commands) lines += fmt::format("{} {}\n", number, to_text(command));
    if (states(number)) lines += fmt::format("state {} {}\n", number, io::hash_text(state_hash()));
    if (!lines.empty()) file_.append(lines);
    last_frame_ = number;
    const long long before = ends_.empty() ? header_ : ends_.back();
    ends_.resize(static_cast<std::size_t>(number - first_ + 1), before);
    ends_.back() = file_.size();
    for (; ends_.size() > kept_frames; ++first_) ends_.pop_front();
}

void Recording::comment(const Comment& comment) {
    assert(comment.frame >= 0 && comment.frame <= last_frame_ && is_comment(comment.text));
    comments_.emplace_back(file_.size(), comment);
    file_.append(fmt::format("comment {} {}\n", comment.frame, comment.text));
    ends_.back() = file_.size();
}

void Recording::take_back(int frame) {
    assert(frame >= -1 && frame <= last_frame_);
    assert(frame < 0 || frame >= first_);
    file_.cut(frame < 0 ? header_ : ends_[static_cast<std::size_t>(frame - first_)]);
    if (frame < 0) first_ = 0;
    ends_.resize(static_cast<std::size_t>(frame - first_ + 1));
    last_frame_ = frame;
    const auto first_cut =
        std::ranges::find_if(comments_, [this](const auto& kept) { return kept.first >= file_.size(); });
    const std::vector<std::pair<long long, Comment>> cut(first_cut, comments_.end());
    comments_.erase(first_cut, comments_.end());
    for (const auto& [place, said] : cut)
        if (said.frame <= frame) comment(said);
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

std::chrono::system_clock::time_point time_of(const std::filesystem::path& file) {
    constexpr int header_lines = 8;
    std::ifstream text(file);
    std::string line;
    for (int k = 0; k < header_lines && std::getline(text, line); ++k) {
        if (line.ends_with('\r')) line.pop_back();
        if (!line.starts_with("date ")) continue;
        if (const auto date = parse_date(std::string_view(line).substr(5))) return *date;
    }
    return system_time<std::chrono::file_clock>(std::filesystem::last_write_time(file));
}

std::vector<std::filesystem::path> recordings_of(const std::filesystem::path& place) {
    namespace fs = std::filesystem;
    std::error_code error;
    if (!fs::is_directory(place, error)) {
        if (fs::exists(place, error)) return {place};
        throw io::InputError("{}: expected a recording (.gw) or a folder of them, found nothing of that name",
                             place.string());
    }
    std::vector<std::pair<std::chrono::system_clock::time_point, fs::path>> found;
    for (fs::recursive_directory_iterator it(place, fs::directory_options::skip_permission_denied, error),
         end;
         !error && it != end; it.increment(error))
        if (it->is_regular_file(error) && it->path().extension() == ".gw")
            found.emplace_back(time_of(it->path()), it->path());
    if (found.empty())
        throw io::InputError("{}: there are no recordings in it; expected files ending in .gw",
                             place.string());
    std::ranges::sort(found);
    std::vector<fs::path> files;
    for (auto& [time, file] : found) files.push_back(std::move(file));
    return files;
}

}  // namespace script
