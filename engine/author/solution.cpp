#include "engine/author/solution.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <utility>

#include "engine/io/error.h"

namespace author {
namespace {

/// One motion of one device in one direction.
struct Way {
    enum class Kind { Push, Pull, Left, Right } kind = Kind::Push;
    script::DeviceRole held = script::DeviceRole::Wire;
    bool operator==(const Way&) const = default;
    bool operator<(const Way& other) const {
        return std::pair(kind, held) < std::pair(other.kind, other.held);
    }
    bool turns() const { return kind == Kind::Left || kind == Kind::Right; }
    Way back() const {
        constexpr Kind opposite[] = {Kind::Pull, Kind::Push, Kind::Right, Kind::Left};
        return {opposite[static_cast<int>(kind)], held};
    }
};

struct Motion {
    Way way;
    double amount = 0;  // [mm] or [deg], above 0
};

/// Empty for all other commands.
std::optional<Motion> motion_of(const script::Command& command) {
    if (const auto* c = std::get_if<script::Advance>(&command))
        return Motion{{Way::Kind::Push, c->held}, c->length};
    if (const auto* c = std::get_if<script::Withdraw>(&command))
        return Motion{{Way::Kind::Pull, c->held}, c->length};
    if (const auto* c = std::get_if<script::Rotate>(&command))
        return Motion{{c->angle < 0 ? Way::Kind::Right : Way::Kind::Left, c->held},
                      std::abs(c->angle) / geometry::degree};
    return std::nullopt;
}

script::Command command_of(const Motion& motion) {
    const auto [kind, held] = motion.way;
    switch (kind) {
        case Way::Kind::Push:
            return script::Advance{motion.amount, held};
        case Way::Kind::Pull:
            return script::Withdraw{motion.amount, held};
        case Way::Kind::Left:
            return script::Rotate{motion.amount * geometry::degree, held};
        case Way::Kind::Right:
            return script::Rotate{-motion.amount * geometry::degree, held};
    }
    return script::Reset{};
}

/// Whether the frame's motions must stay as they are.
bool is_fixed(std::span<const script::TimedCommand> commands) {
    std::vector<Way> ways;
    for (const script::TimedCommand& timed : commands) {
        const script::Command& command = timed.command;
        if (std::holds_alternative<script::Remove>(command) ||
            std::holds_alternative<script::Exchange>(command) ||
            std::holds_alternative<script::Grip>(command))
            return true;
        if (const auto motion = motion_of(command)) {
            if (std::ranges::find(ways, motion->way.back()) != ways.end()) return true;
            ways.push_back(motion->way);
        }
    }
    return false;
}

/// Amounts of one motion in consecutive frames.
struct Stretch {
    int first = 0;
    std::vector<double> amounts;
};

/// How many of the amounts, from the first of them on, one mean stands for.
std::size_t alike(std::span<const double> amounts, double near) {
    std::size_t most = 1;
    double sum = amounts[0];
    for (std::size_t n = 2; n <= amounts.size(); ++n) {
        sum += amounts[n - 1];
        const double mean = sum / static_cast<double>(n);
        double ahead = 0, farthest = 0;
        for (std::size_t i = 0; i < n; ++i) {
            ahead += amounts[i] - mean;
            farthest = std::max(farthest, std::abs(ahead));
        }
        if (farthest > near + 1e-9) return most;
        most = n;
    }
    return most;
}

/// The shortest amount that `frames` of come to the sum.
double amount_of(double sum, std::size_t frames) {
    constexpr double exactness = 5e-4;  // [mm], [deg]
    const double mean = sum / static_cast<double>(frames);
    for (double unit = 1; unit > 1e-9; unit /= 10) {
        const double rounded = std::round(mean / unit) * unit;
        if (std::abs(rounded * static_cast<double>(frames) - sum) <= exactness)
            return std::round(rounded * 1e9) / 1e9;
    }
    return mean;
}

void append_ranges(const Way& way, const Stretch& stretch, const Nearness& near, double& carried,
                   std::vector<ScriptLine>& lines) {
    const double most = way.turns() ? near.angle / geometry::degree : near.length;
    for (std::size_t at = 0; at < stretch.amounts.size();) {
        const auto rest = std::span(stretch.amounts).subspan(at);
        const std::size_t count = alike(rest, most);
        double sum = carried;
        for (const double amount : rest.first(count)) sum += amount;
        const double each = sum > 0 ? amount_of(sum, count) : 0.0;
        carried = sum - each * static_cast<double>(count);
        const int first = stretch.first + static_cast<int>(at);
        if (each > 0) lines.push_back({first, first + static_cast<int>(count) - 1, command_of({way, each})});
        at += count;
    }
}

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

std::vector<ScriptLine> in_ranges(const script::CommandScript& script, const Nearness& near) {
    std::vector<ScriptLine> lines;
    std::map<Way, std::vector<Stretch>> ways;
    for (auto at = script.commands.begin(); at != script.commands.end();) {
        const int frame = at->frame;
        const auto commands = script.at(frame);
        at += static_cast<std::ptrdiff_t>(commands.size());
        const bool fixed = is_fixed(commands);
        for (const script::TimedCommand& timed : commands) {
            if (std::holds_alternative<script::Reset>(timed.command))
                throw io::InputError(
                    "{}: expected one attempt, found a reset in frame {}; pass the lines after it, with "
                    "frames from 0",
                    script.file, frame);
            const auto motion = motion_of(timed.command);
            if (fixed || !motion) {
                lines.push_back({frame, frame, timed.command});
            } else if (motion->amount > 0) {
                std::vector<Stretch>& of = ways[motion->way];
                const int next =
                    of.empty() ? -1 : of.back().first + static_cast<int>(of.back().amounts.size());
                if (next == frame + 1)
                    of.back().amounts.back() += motion->amount;  // a second line of the frame
                else if (next == frame)
                    of.back().amounts.push_back(motion->amount);
                else
                    of.push_back({frame, {motion->amount}});
            }
        }
    }
    for (const auto& [way, stretches] : ways) {
        double carried = 0;
        for (const Stretch& stretch : stretches) append_ranges(way, stretch, near, carried, lines);
    }
    std::ranges::stable_sort(lines, {}, &ScriptLine::first);
    return lines;
}

std::vector<std::pair<std::size_t, std::size_t>> coming_to_nothing(const std::vector<ScriptLine>& lines,
                                                                   const Nearness& near) {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    std::size_t before = lines.size();  // the last motion; this: none
    for (std::size_t k = 0; k < lines.size(); ++k) {
        const auto motion = motion_of(lines[k].command);
        if (!motion) continue;
        if (before < lines.size() && lines[before].last < lines[k].first) {
            const auto earlier = motion_of(lines[before].command);
            const auto all = [](const ScriptLine& line, double each) {
                return each * (line.last - line.first + 1);
            };
            const double net = std::abs(all(lines[before], earlier->amount) - all(lines[k], motion->amount));
            if (motion->way == earlier->way.back() &&
                net < (motion->way.turns() ? near.angle / geometry::degree : near.length)) {
                pairs.emplace_back(before, k);
                before = lines.size();
                continue;
            }
        }
        before = k;
    }
    return pairs;
}

std::string to_text(const std::vector<ScriptLine>& lines, std::optional<int> end,
                    const std::vector<std::string>& comments) {
    std::string text;
    for (const std::string& comment : comments) text += "# " + comment + "\n";
    const auto add = [&text](const std::string& frames, const std::string& what) {
        text += fmt::format("{:<9} {}\n", frames, what);
    };
    for (const ScriptLine& line : lines)
        add(line.first == line.last ? std::to_string(line.first)
                                    : fmt::format("{}..{}", line.first, line.last),
            script::to_text(line.command));
    if (end) add(std::to_string(*end), "end");
    return text;
}

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
