#pragma once
/// A course to the target, found by trying: is an exercise possible at all?

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <memory>
#include <optional>
#include <queue>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "engine/anatomy/vessel_paths.h"
#include "engine/exercise/exercise.h"
#include "engine/script/command.h"

namespace test::course {

constexpr double frame_push = 1.5, frame_turn = 15;  // of one frame [mm], [degrees]
constexpr double push = 6;                           // of one step [mm]
constexpr int most_steps = 1500;                     // that are tried in all
constexpr int longest_wait = 45;                     // for a device that lags behind [frames]
/// A step that brings the tip nearer by this fraction of the push needs no other tried beside it for now.
constexpr double good_fraction = 0.6;
/// What a node loses each time that it was gone on from [mm].
constexpr double penalty = 6;

struct Step {
    double turn = 0, push = 0;  // [degrees], [mm]; < 0 draws back
};
/// After the plain push: the other turns, and those after drawing back.
inline const std::vector<Step>& other_steps() {
    static const std::vector<Step> steps = [] {
        std::vector<Step> made;
        for (const double turn : {45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0}) made.push_back({turn, 1});
        for (const double turn : {90.0, -90.0, 180.0}) made.push_back({turn, -2});
        return made;
    }();
    return steps;
}

struct Node {
    std::shared_ptr<const Node> before;
    exercise::Exercise::Snapshot state;
    std::string lines;  // of the step that led here
    int frames = 0;     // made so far
    double left = 0;    // along the vessels to the target [mm]
    bool reached = false;
};
using NodePtr = std::shared_ptr<const Node>;

class Search {
public:
    explicit Search(const exercise::Exercise& start)
        : exercise_(start), held_(exercise_.simulation().scenario().target.device) {}

    std::optional<std::string> run() {
        auto first = std::make_shared<Node>();
        first->state = exercise_.snapshot();
        first->left = left();
        first->frames = exercise_.frame() + 1;
        open(first, 0);
        while (!open_.empty() && tried_ < most_steps) {
            const Open now = open_.top();
            open_.pop();
            if (const NodePtr end = go_on(now)) return course_to(*end);
        }
        return std::nullopt;
    }

private:
    struct Open {
        double cost = 0;
        int number = 0;  // of equals the first
        int times = 0;   // gone on from before
        NodePtr node;
        bool operator<(const Open& other) const {
            return std::tie(cost, number) > std::tie(other.cost, other.number);
        }
    };

    double left() const {
        const exercise::Simulation& simulation = exercise_.simulation();
        return anatomy::centreline_distance(simulation.anatomy(), simulation.tip(), simulation.target()) +
               0.1 * simulation.tip_to_target();
    }
    void open(const NodePtr& node, int times) {
        open_.push({node->left + penalty * times, number_++, times, node});
    }

    /// First the plain push alone; when the node is met again, all other steps. The node that reached, or
    /// null.
    NodePtr go_on(const Open& now) {
        if (now.times == 0) {
            const NodePtr next = tried(now.node, {0, push});
            if (next && next->reached) return next;
            if (next) open(next, 0);
            const bool good = next && next->left < now.node->left - good_fraction * push;
            open(now.node, good ? 3 : 1);
            return nullptr;
        }
        for (const Step& step : other_steps()) {
            const NodePtr next = tried(now.node, {step.turn, step.push * push});
            if (next && next->reached) return next;
            if (next) open(next, 0);
        }
        return nullptr;
    }

    /// The state after the step; null where it is known, or injured the wall, or time was up.
    NodePtr tried(const NodePtr& from, const Step& step) {
        ++tried_;
        exercise_.restore(from->state);
        auto made = std::make_shared<Node>();
        made->before = from;
        made->frames = from->frames;
        const std::size_t injuries = exercise_.simulation().injuries().all().size();
        amount(*made, "rotate", "deg", step.turn, frame_turn);
        amount(*made, step.push < 0 ? "withdraw" : "advance", "mm", std::abs(step.push), frame_push);
        for (int k = 0; k < longest_wait && waits_ && !exercise_.completed(); ++k) idle(*made);
        const exercise::Simulation& simulation = exercise_.simulation();
        const scenario::Target& target = simulation.scenario().target;
        const int hold = static_cast<int>(std::ceil(target.hold * simulation.scenario().frame_rate)) + 1;
        for (int k = 0; k < hold && simulation.tip_to_target() <= target.radius && !exercise_.completed();
             ++k)
            idle(*made);
        if (simulation.injuries().all().size() > injuries || exercise_.time_is_up()) return nullptr;
        made->reached = exercise_.completed();
        made->left = left();
        if (!made->reached && !known_.insert(key()).second) return nullptr;
        made->state = exercise_.snapshot();
        return made;
    }

    /// Makes the amount in equal frames, and keeps their line.
    void amount(Node& node, const char* verb, const char* unit, double whole, double of_frame) {
        if (whole == 0) return;
        const int frames = std::max(1, static_cast<int>(std::ceil(std::abs(whole) / of_frame - 1e-9)));
        const std::string command =
            fmt::format("{} {} {} {}", verb, script::name_of(held_), whole / frames, unit);
        node.lines += fmt::format("{}..{} {}\n", node.frames, node.frames + frames - 1, command);
        const script::CommandScript read = script::parse_commands("0 " + command + "\n", "search");
        for (int k = 0; k < frames; ++k) make(node, {&read.commands[0].command, 1});
    }
    void idle(Node& node) { make(node, {}); }
    void make(Node& node, std::span<const script::Command> commands) {
        const exercise::StepReport report = exercise_.next_frame(commands).motion;
        waits_ = report.waiting_insertion > 0 || report.waiting_rotation > 0;
        ++node.frames;
    }

    /// States that are as good as the same: tip, length inside and turn of the hub.
    std::tuple<int, int, int, int, int> key() const {
        const exercise::Simulation& simulation = exercise_.simulation();
        const geometry::Vec3 tip = simulation.tip();
        const auto step = [](double value, double of) { return static_cast<int>(std::lround(value / of)); };
        return {step(tip.x(), 1.5), step(tip.y(), 1.5), step(tip.z(), 1.5),
                step(simulation.inserted(held_), 3),
                step(simulation.hand(held_).turned / geometry::degree, 45)};
    }

    std::string course_to(const Node& end) const {
        std::vector<const Node*> way;
        for (const Node* node = &end; node; node = node->before.get()) way.push_back(node);
        std::reverse(way.begin(), way.end());
        std::string script = "0 beam on\n";
        for (const Node* node : way) script += node->lines;
        return script + fmt::format("{} end\n", end.frames - 1);
    }

    exercise::Exercise exercise_;
    script::DeviceRole held_;
    std::priority_queue<Open> open_;
    std::set<std::tuple<int, int, int, int, int>> known_;
    int number_ = 0, tried_ = 0;
    bool waits_ = false;
};

}  // namespace test::course

namespace test {

/// A script to the target. Pushes the device that the exercise is about, step by step, and goes on from where
/// its tip is nearest to the target along the vessels; where a push does not bring it nearer, from where it
/// was, turned first or drawn back and turned. What injures the wall is no step. `start` must have no images;
/// the same start gives the same script. Empty: none was found.
inline std::optional<std::string> find_course(const exercise::Exercise& start) {
    return course::Search(start).run();
}

}  // namespace test
