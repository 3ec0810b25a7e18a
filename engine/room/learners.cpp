#include "engine/room/learners.h"

#include <algorithm>

#include "engine/io/text.h"
#include "engine/script/command.h"

namespace room {
namespace {

namespace fs = std::filesystem;

/// What folder_of() made the folder's name of.
std::string learner_of(const std::string& folder) {
    const auto digit = [](char c) {
        return c >= '0' && c <= '9' ? c - '0' : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
    };
    std::string name;
    for (std::size_t i = 0; i < folder.size(); ++i) {
        const bool coded = folder[i] == '%' && i + 2 < folder.size() && digit(folder[i + 1]) >= 0 &&
                           digit(folder[i + 2]) >= 0;
        name += coded ? static_cast<char>(digit(folder[i + 1]) * 16 + digit(folder[i + 2])) : folder[i];
        if (coded) i += 2;
    }
    return name;
}

}  // namespace

std::string folder_of(const std::string& learner) {
    return learner.empty() ? "guest" : io::file_name_of(learner);
}

std::vector<std::string> Learners::names() const {
    if (data_.empty()) return {};
    std::vector<std::pair<fs::file_time_type, std::string>> found;
    std::error_code failed;
    for (const auto& entry : fs::directory_iterator(data_ / "recordings", failed)) {
        if (!entry.is_directory(failed)) continue;
        const std::string folder = entry.path().filename().string(), name = learner_of(folder);
        // A folder that is no learner's own is somebody else's.
        if (folder == folder_of("") || !script::is_learner(name) || folder_of(name) != folder) continue;
        found.emplace_back(fs::last_write_time(entry.path(), failed), name);
    }
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
        return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    std::vector<std::string> names;
    for (auto& [time, name] : found) names.push_back(std::move(name));
    return names;
}

Attempts Learners::attempts(const std::string& learner) const {
    return data_.empty() ? Attempts() : Attempts(folder(learner) / "");
}

std::filesystem::path Learners::results(const std::string& learner) const {
    if (data_.empty()) return {};
    return learner.empty() ? data_ / "results.json" : folder(learner) / "results.json";
}

}  // namespace room
