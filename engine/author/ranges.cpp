#include "engine/author/ranges.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <utility>

#include "engine/io/error.h"

namespace author {
namespace {

/// One motion of one device in one direction.
struct Manoeuvre {
    enum class Kind { Push, Pull, Left, Right } kind = Kind::Push;
    script::DeviceRole held = script::DeviceRole::Wire;
    bool operator==(const Manoeuvre&) const = default;
    bool operator<(const Manoeuvre& other) const {
        return std::pair(kind, held) < std::pair(other.kind, other.held);
    }
    bool turns() const { return kind == Kind::Left || kind == Kind::Right; }
    Manoeuvre back() const {
        constexpr Kind opposite[] = {Kind::Pull, Kind::Push, Kind::Right, Kind::Left};
        return {opposite[static_cast<int>(kind)], held};
    }
};

struct Motion {
    Manoeuvre manoeuvre;
    double amount = 0;  // [mm] or [deg], above 0
};

/// Empty for all other commands.
std::optional<Motion> motion_of(const script::Command& command) {
    if (const auto* c = std::get_if<script::Advance>(&command))
        return Motion{{Manoeuvre::Kind::Push, c->held}, c->length};
    if (const auto* c = std::get_if<script::Withdraw>(&command))
        return Motion{{Manoeuvre::Kind::Pull, c->held}, c->length};
    if (const auto* c = std::get_if<script::Rotate>(&command))
        return Motion{{c->angle < 0 ? Manoeuvre::Kind::Right : Manoeuvre::Kind::Left, c->held},
                      std::abs(c->angle) / geometry::degree};
    return std::nullopt;
}

script::Command command_of(const Motion& motion) {
    const auto [kind, held] = motion.manoeuvre;
    switch (kind) {
        case Manoeuvre::Kind::Push:
            return script::Advance{motion.amount, held};
        case Manoeuvre::Kind::Pull:
            return script::Withdraw{motion.amount, held};
        case Manoeuvre::Kind::Left:
            return script::Rotate{motion.amount * geometry::degree, held};
        case Manoeuvre::Kind::Right:
            return script::Rotate{-motion.amount * geometry::degree, held};
    }
    return script::Reset{};
}

/// Whether the frame's motions must stay as they are.
bool is_fixed(std::span<const script::TimedCommand> commands) {
    std::vector<Manoeuvre> manoeuvres;
    for (const script::TimedCommand& timed : commands) {
        const script::Command& command = timed.command;
        if (std::holds_alternative<script::Remove>(command) ||
            std::holds_alternative<script::Exchange>(command) ||
            std::holds_alternative<script::Grip>(command))
            return true;
        if (const auto motion = motion_of(command)) {
            if (std::ranges::find(manoeuvres, motion->manoeuvre.back()) != manoeuvres.end()) return true;
            manoeuvres.push_back(motion->manoeuvre);
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

void append_ranges(const Manoeuvre& manoeuvre, const Stretch& stretch, const Nearness& near, double& carried,
                   std::vector<ScriptLine>& lines) {
    const double most = manoeuvre.turns() ? near.angle / geometry::degree : near.length;
    for (std::size_t at = 0; at < stretch.amounts.size();) {
        const auto rest = std::span(stretch.amounts).subspan(at);
        const std::size_t count = alike(rest, most);
        double sum = carried;
        for (const double amount : rest.first(count)) sum += amount;
        const double each = sum > 0 ? amount_of(sum, count) : 0.0;
        carried = sum - each * static_cast<double>(count);
        const int first = stretch.first + static_cast<int>(at);
        if (each > 0)
            lines.push_back({first, first + static_cast<int>(count) - 1, command_of({manoeuvre, each})});
        at += count;
    }
}

}  // namespace

std::vector<ScriptLine> in_ranges(const script::CommandScript& script, const Nearness& near) {
    std::vector<ScriptLine> lines;
    std::map<Manoeuvre, std::vector<Stretch>> manoeuvres;
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
                std::vector<Stretch>& of = manoeuvres[motion->manoeuvre];
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
    for (const auto& [manoeuvre, stretches] : manoeuvres) {
        double carried = 0;
        for (const Stretch& stretch : stretches) append_ranges(manoeuvre, stretch, near, carried, lines);
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
            if (motion->manoeuvre == earlier->manoeuvre.back() &&
                net < (motion->manoeuvre.turns() ? near.angle / geometry::degree : near.length)) {
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

}  // namespace author
