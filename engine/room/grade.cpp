#include "engine/room/grade.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/exercise/exercise.h"
#include "engine/io/files.h"

namespace room {

const char* const grade_formula =
    "100 points less what each line costs: nothing up to its par, all of its points at twice the par; 5 "
    "points for "
    "each handling error, 15 at most. Par is the score of the solution.";

Grade grade(const exercise::Score& score, const Handling& handling,
            const std::optional<exercise::Score>& par) {
    Grade result;
    result.reached = score.completed;
    const auto line = [&](const char* name, const char* unit, std::optional<double> yours,
                          std::optional<double> its_par, double most) {
        double cost = 0;
        if (yours && its_par && *its_par > 0) cost = most * std::clamp(*yours / *its_par - 1, 0.0, 1.0);
        result.lines.push_back({name, unit, yours, its_par, most, cost});
    };
    const auto of_par = [&](auto value) { return par ? std::optional<double>(value(*par)) : std::nullopt; };
    line("Time to the target", "s", score.completion_time,
         of_par([](const exercise::Score& p) { return p.completion_time.value_or(0); }), 30);
    line("Beam", "s", score.beam_on_time, of_par([](const auto& p) { return p.beam_on_time; }), 25);
    line("Contrast", "ml", score.contrast, of_par([](const auto& p) { return p.contrast; }), 15);
    line("Travel of the wire", "mm", score.wire_travel, of_par([](const auto& p) { return p.wire_travel; }),
         15);
    line("Largest force of the wall", "N", score.peak_wall_force, std::nullopt, 0);
    const double errors = handling.errors();
    result.lines.push_back({"Handling errors", "", errors, 0.0, 15, std::min(15.0, 5 * errors)});
    result.points = 100;
    for (const GradeLine& l : result.lines) result.points -= l.cost;
    if (!result.reached) result.points = 0;
    return result;
}

std::optional<exercise::Score> par_of(const scenario::Scenario& scenario,
                                      const script::CommandScript& solution, const anatomy::ModelCache& cache,
                                      const std::atomic<bool>& stop) {
    exercise::Exercise exercise(scenario, false, cache);
    std::vector<script::Command> commands;
    for (int frame = 0,
             last = solution.last_frame(2 + static_cast<int>(scenario.target.hold * scenario.frame_rate));
         frame <= last && !exercise.score().completed && !exercise.time_is_up(); ++frame) {
        if (stop) return std::nullopt;
        commands.clear();
        for (const script::TimedCommand& timed : solution.at(frame)) commands.push_back(timed.command);
        exercise.next_frame(commands);
    }
    return exercise.score();
}

Results::Results(std::filesystem::path file) : file_(std::move(file)) {
    std::ifstream text(file_);
    const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_object()) return;
    for (const auto& [name, entry] : json.items()) {
        if (!entry.is_object()) continue;
        const auto number = [&entry = entry](const char* key) {
            const auto found = entry.find(key);
            return found != entry.end() && found->is_number() ? found->template get<double>() : 0.0;
        };
        BestResult& best = best_[name];
        best.attempts = static_cast<int>(std::clamp(number("attempts"), 0.0, 1e9));
        best.reached = static_cast<int>(std::clamp(number("reached"), 0.0, 1e9));
        best.points = std::clamp(number("points"), 0.0, 100.0);
        if (entry.contains("time_s") && number("time_s") > 0) best.time = number("time_s");
    }
}

const BestResult* Results::find(const std::string& scenario) const {
    const auto found = best_.find(scenario);
    return found == best_.end() ? nullptr : &found->second;
}

void Results::add(const std::string& scenario, const Grade& grade, const exercise::Score& score) {
    BestResult& best = best_[scenario];
    ++best.attempts;
    best.reached += grade.reached;
    best.points = std::max(best.points, grade.points);
    if (score.completion_time) best.time = std::min(best.time.value_or(1e9), *score.completion_time);
    if (file_.empty()) return;
    nlohmann::json json = nlohmann::json::object();
    for (const auto& [name, entry] : best_) {
        json[name] = {{"attempts", entry.attempts}, {"reached", entry.reached}, {"points", entry.points}};
        if (entry.time) json[name]["time_s"] = *entry.time;
    }
    std::error_code ignored;
    std::filesystem::create_directories(file_.parent_path(), ignored);
    io::write_whole(file_, json.dump(2) + "\n");
}

}  // namespace room
