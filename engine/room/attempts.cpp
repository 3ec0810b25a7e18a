#include "engine/room/attempts.h"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <utility>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"

namespace room {
namespace {

namespace fs = std::filesystem;

/// The largest number among files named START NUMBER END; 0 where there is none.
long long last_number(const fs::path& folder, const std::string& start, const std::string& end) {
    long long last = 0;
    std::error_code failed;
    for (const auto& entry : fs::directory_iterator(folder, failed)) {
        const std::string name = entry.path().filename().string();
        if (name.size() <= start.size() + end.size() || !name.starts_with(start) || !name.ends_with(end))
            continue;
        std::string digits = name.substr(start.size(), name.size() - start.size() - end.size());
        if (!std::ranges::all_of(digits, [](char c) { return c >= '0' && c <= '9'; })) continue;
        digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size() - 1));
        if (const auto number = io::parse_integer(digits); number) last = std::max<long long>(last, *number);
    }
    return last;
}

}  // namespace

Attempts::Attempts(fs::path wanted) : wanted_(std::move(wanted)) {}

bool Attempts::in_folder() const {
    std::error_code ignored;
    return fs::is_directory(wanted_, ignored) || !wanted_.has_filename() || !wanted_.has_extension();
}

void Attempts::require_writable() const {
    std::error_code ignored;
    if (fs::exists(wanted_, ignored) && !fs::is_directory(wanted_, ignored) &&
        !fs::is_regular_file(wanted_, ignored))
        throw io::InputError("{}: cannot keep attempts: expected a folder or a file, found a device",
                             wanted_.string());
    if (!in_folder()) return io::require_writable(wanted_);
    // The folders that are missing are made when the first attempt is kept; here it is enough that they can
    // be.
    fs::path there = fs::absolute(wanted_);
    while (!fs::exists(there, ignored) && there.has_relative_path()) there = there.parent_path();
    try {
        io::require_writable(there / "attempt.gw");
    } catch (const io::InputError& error) {
        throw io::InputError("{}: cannot be written, for {}", wanted_.string(), error.what());
    }
}

fs::path Attempts::make_next(const std::string& scenario) const {
    const bool folder = in_folder();
    const fs::path where = folder ? wanted_ : wanted_.parent_path();
    if (folder) io::make_folder(where);
    const std::string start = folder ? scenario + "-" : wanted_.stem().string() + "-";
    const std::string end = folder ? ".gw" : wanted_.extension().string();
    if (!folder && io::make_new(wanted_)) return wanted_;
    long long number = last_number(where.empty() ? "." : where, start, end);
    if (!folder) number = std::max(number, 1LL);  // the first has no number
    while (true) {
        const fs::path file = where / fmt::format("{}{:0{}}{}", start, ++number, folder ? 3 : 1, end);
        if (io::make_new(file)) return file;
    }
}

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
