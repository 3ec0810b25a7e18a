#include "engine/run/expectation.h"

#include <fmt/format.h>

#include "engine/io/text.h"
#include "engine/run/frame_sink.h"
#include "engine/run/picture_file.h"

namespace run {
namespace {

constexpr std::size_t most_differences = 5;

}  // namespace

void Expectation::add_states(const script::CommandScript& script) {
    for (const script::StateCheck& check : script.checks) states_.emplace(check.frame, check);
}

void Expectation::add(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_directory(path, error)) {
        const script::CommandScript recording = script::load_commands(path);
        if (recording.checks.empty()) {
            throw io::InputError(path.string() +
                                 ": no 'state FRAME HASH' line was found; expected a recording, or the "
                                 "output folder of a run");
        }
        add_states(recording);
        origin_ = recording.origin;
        file_ = recording.file;
        return;
    }
    add(path / "run.gw");
    folder_ = path.string();
    had_images_ = std::filesystem::exists(path / "sheet.png", error);  // which a run without images removes
    for (const auto& entry : std::filesystem::directory_iterator(path / "frames", error)) {
        const int frame = frame_of_file_name(entry.path().filename().string());
        if (frame < 0) continue;
        read_picture(entry.path());
        frames_[frame] = entry.path();
    }
}

void Expectation::check_state(int frame, std::uint64_t hash) {
    const auto [first, last] = states_.equal_range(frame);
    for (auto at = first; at != last; ++at) {
        ++compared_states_;
        if (at->second.hash == hash) continue;
        differ(
            io::located(at->second.place, fmt::format("the state of frame {} is {}; {} was expected", frame,
                                                      io::hash_text(hash), io::hash_text(at->second.hash))));
    }
}

void Expectation::check_frame(int frame, const render::GrayImage& image) {
    const auto at = frames_.find(frame);
    if (at == frames_.end()) {
        if (!frames_.empty()) absent_.push_back(frame);
        return;
    }
    ++compared_frames_;
    seen_.insert(frame);
    const render::GrayImage expected = read_picture(at->second);
    if (expected == image) return;
    if (expected.width != image.width || expected.height != image.height) {
        differ(fmt::format("{}: frame {} has {} x {} pixels; {} x {} were expected", at->second.string(),
                           frame, image.width, image.height, expected.width, expected.height));
        return;
    }
    const render::ImageDifference found = render::difference(expected, image);
    differ(fmt::format("{}: frame {} differs at {} pixels, by {} grey levels at most", at->second.string(),
                       frame, found.pixels_differing, found.largest));
}

void Expectation::finish(int last_frame, bool interrupted, bool images) {
    if (had_images_ && frames_.empty() && images)
        differ(fmt::format("{}: its sheet.png shows that it had images, of which none are left in frames/",
                           folder_));
    else if (!folder_.empty() && frames_.empty())
        notes_.push_back(fmt::format("{}: no images were found there, so none were compared", folder_));
    else if (!frames_.empty() && !images)
        notes_.push_back(fmt::format("{}: its {} images were not compared, as this run made none", folder_,
                                     frames_.size()));
    if (images && !absent_.empty())
        differ(fmt::format("{} of the frames, frame {} first, have no image in {}", absent_.size(),
                           absent_.front(), folder_));
    if (interrupted) return;
    if (images) {
        std::vector<int> missing;
        for (const auto& [frame, file] : frames_)
            if (frame <= last_frame && !seen_.contains(frame)) missing.push_back(frame);
        if (!missing.empty())
            differ(fmt::format(
                "{} images of {}, frame {} first, were not made by this run; the same --every makes them",
                missing.size(), folder_, missing.front()));
    }
    if (last_state() > last_frame) {
        differ(fmt::format("a state is expected of frame {}; the run ended at frame {}", last_state(),
                           last_frame));
    }
    if (!frames_.empty() && frames_.rbegin()->first > last_frame) {
        differ(fmt::format("frame {} is expected; the run ended at frame {}", frames_.rbegin()->first,
                           last_frame));
    }
}

std::vector<std::string> Expectation::differences() const {
    std::vector<std::string> lines = differences_;
    if (differing_ > lines.size()) lines.push_back(fmt::format("... and {} more", differing_ - lines.size()));
    return lines;
}

void Expectation::differ(const std::string& text) {
    ++differing_;
    if (differences_.size() < most_differences) differences_.push_back(text);
}

}  // namespace run
