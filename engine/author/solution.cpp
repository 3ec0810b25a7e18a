#include "engine/author/solution.h"

#include <algorithm>
#include <fmt/format.h>

#include "engine/io/error.h"

namespace author {
namespace {

/// Plays lines from the start of the exercise.
class Player {
public:
    Player(const exercise::Exercise& start, const std::string& file, const script::CommandScript& recording)
        : start_(start), file_(file), end_(recording.last_frame(tail)) {
        const std::string by =
            recording.origin && !recording.origin->learner.empty() ? ", by " + recording.origin->learner : "";
        comments_ = {"From a recording" + by + ", in ranges. " +
                     fmt::format("{:g} frames are a second.", start.simulation().scenario().frame_rate)};
    }
    Solution play(const std::vector<ScriptLine>& lines) const {
        Solution made;
        made.text = to_text(lines, end_, comments_);
        made.script = script::parse_commands(made.text, file_);
        exercise::Exercise exercise(start_);
        made.exact = attempt(exercise, made.script, exact_hand, 0);
        return made;
    }

private:
    static constexpr int tail = 10;  // frames
    const exercise::Exercise& start_;
    std::string file_;
    int end_;
    std::vector<std::string> comments_;
};

/// Drops what comes to nothing, one pair after the other, as long as the target is still reached.
bool drop(std::vector<ScriptLine>& lines, Solution& solution, const Player& player,
          const TrialOptions& options) {
    for (std::size_t tried = 0;;) {
        const auto pairs = coming_to_nothing(lines);
        if (tried >= pairs.size()) return true;
        if (options.interrupted && options.interrupted()) return false;
        std::vector<ScriptLine> fewer = lines;
        fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(pairs[tried].second));
        fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(pairs[tried].first));
        Solution made = player.play(fewer);
        if (!made.exact.score.completed) {
            ++tried;
            continue;
        }
        made.nearness = solution.nearness;
        made.dropped = solution.dropped + 1;
        solution = std::move(made);
        lines = std::move(fewer);
    }
}

}  // namespace

void require_recording_of(const script::CommandScript& recording, const std::string& name) {
    if (recording.origin && !recording.origin->scenario.empty() && recording.origin->scenario != name)
        throw io::InputError("{}: it is a recording of '{}'; expected one of '{}'", recording.file,
                             recording.origin->scenario, name);
    const auto moves = [](const script::TimedCommand& timed) {
        return std::holds_alternative<script::Advance>(timed.command) ||
               std::holds_alternative<script::Rotate>(timed.command) ||
               std::holds_alternative<script::Withdraw>(timed.command);
    };
    if (std::ranges::none_of(recording.commands, moves))
        throw io::InputError("{}: expected motions of a device, found none", recording.file);
    static_cast<void>(in_ranges(recording));  // throws for one with a reset
}

std::optional<Solution> solution_of(const script::CommandScript& recording, const std::string& file,
                                    const exercise::Exercise& start, const TrialOptions& options) {
    const Player player(start, file, recording);
    constexpr double parts[] = {1, 0.5, 0.25, 0.1, 0};  // of what ranges may be off
    double nearest = 0;
    for (std::size_t k = 0; k < std::size(parts); ++k) {
        if (options.interrupted && options.interrupted()) return std::nullopt;
        if (options.progress) options.progress(k, std::size(parts));
        const Nearness usual;
        std::vector<ScriptLine> lines =
            in_ranges(recording, {parts[k] * usual.length, parts[k] * usual.angle});
        Solution solution = player.play(lines);
        nearest = solution.exact.nearest;
        if (!solution.exact.score.completed) continue;
        solution.nearness = parts[k];
        if (!drop(lines, solution, player, options)) return std::nullopt;
        return solution;
    }
    throw io::InputError(
        "{}: it does not reach the target: its tip is {:.1f} mm away at its nearest; expected a recording of "
        "an attempt that reached it",
        recording.file, nearest);
}

}  // namespace author
