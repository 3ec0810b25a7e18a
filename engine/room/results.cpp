#include "engine/room/results.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/io/error.h"
#include "engine/io/files.h"
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

Results::Results(std::filesystem::path file) : file_(std::move(file)) {
    const nlohmann::json json = [this] {
        std::error_code ignored;
        if (!std::filesystem::exists(file_, ignored)) return nlohmann::json();
        try {
            const std::string text =
                io::read_text(file_, "results", "expected a file that this program wrote");
            io::check_json_depth(text, file_.string());
            return nlohmann::json::parse(text, nullptr, false);
        } catch (const io::InputError&) {
            return nlohmann::json();  // they begin anew
        }
    }();
    if (!json.is_object()) return;
    for (const auto& [name, entry] : json.items()) {
        if (!entry.is_object()) continue;
        const auto number_in = [](const nlohmann::json& of, const char* key) {
            const auto found = of.find(key);
            return found != of.end() && found->is_number() ? found->get<double>() : 0.0;
        };
        const auto number = [&number_in, &entry = entry](const char* key) { return number_in(entry, key); };
        BestResult& best = best_[name];
        best.attempts = static_cast<int>(std::clamp(number("attempts"), 0.0, 1e9));
        best.reached = static_cast<int>(std::clamp(number("reached"), 0.0, 1e9));
        best.points = std::clamp(number("points"), 0.0, 100.0);
        best.passed = static_cast<int>(std::clamp(number("passed"), 0.0, 1e9));
        best.steps = static_cast<int>(std::clamp(number("steps_done"), 0.0, 1e9));
        if (const auto patients = entry.find("patients"); patients != entry.end() && patients->is_object())
            for (const auto& [patient, of] : patients->items())
                if (of.is_object())
                    best.patients[patient] = {
                        static_cast<int>(std::clamp(number_in(of, "attempts"), 0.0, 1e9)),
                        static_cast<int>(std::clamp(number_in(of, "reached"), 0.0, 1e9))};
        if (entry.contains("time_s") && number("time_s") > 0) best.time = number("time_s");
    }
}

const BestResult* Results::find(const std::string& scenario) const {
    const auto found = best_.find(scenario);
    return found == best_.end() ? nullptr : &found->second;
}

void Results::add(const std::string& scenario, const exercise::Grade& grade, const exercise::Score& score,
                  const std::string& patient) {
    BestResult& best = best_[scenario];
    ++best.attempts;
    best.reached += grade.reached;
    best.points = std::max(best.points, grade.points);
    best.passed += grade.reached && grade.points >= pass_mark;
    if (!patient.empty()) {
        ++best.patients[patient].attempts;
        best.patients[patient].reached += grade.reached;
    }
    if (score.completed_after) best.time = std::min(best.time.value_or(1e9), *score.completed_after);
    keep();
}

void Results::add_lesson(const std::string& scenario, int steps_done, int steps,
                         const exercise::Score& score) {
    BestResult& best = best_[scenario];
    ++best.attempts;
    best.reached += score.completed;
    best.passed += score.completed && steps_done == steps;
    best.steps = std::max(best.steps, steps_done);
    keep();
}

void Results::keep() const {
    if (file_.empty()) return;
    nlohmann::json json = nlohmann::json::object();
    for (const auto& [name, entry] : best_) {
        json[name] = {{"attempts", entry.attempts},
                      {"reached", entry.reached},
                      {"points", entry.points},
                      {"passed", entry.passed}};
        if (entry.time) json[name]["time_s"] = *entry.time;
        for (const auto& [patient, of] : entry.patients)
            json[name]["patients"][patient] = {{"attempts", of.attempts}, {"reached", of.reached}};
        if (entry.steps > 0) json[name]["steps_done"] = entry.steps;
    }
    io::make_folder(file_.parent_path());
    io::write_whole(file_, json.dump(2) + "\n");
}

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
    std::ranges::sort(found, [](const auto& a, const auto& b) {
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
