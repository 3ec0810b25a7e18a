#include "physics/relax/relaxer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>

#include "physics/relax/global_relaxer.h"
#include "physics/relax/segment_relaxer.h"

namespace physics {

std::vector<std::string> problems(const RelaxerConfig& c) {
    std::vector<std::string> out;
    if (c.varied_segments < 1 || c.varied_segments > most_varied_segments)
        out.push_back("varied_segments must lie in 1 to 5, not " + std::to_string(c.varied_segments) + ".");
    if (c.stored_planes && c.kind != RelaxerKind::Segment && c.kind != RelaxerKind::FirstOrder)
        out.emplace_back("stored_planes go with the segment and the first-order relaxer.");
    if (c.printed && c.kind != RelaxerKind::Segment)
        out.emplace_back("printed goes with the segment relaxer.");
    if (c.separation && (*c.separation < 2 || *c.separation > 200))
        out.push_back("separation must lie in 2 to 200, not " + std::to_string(*c.separation) + ".");
    if (!std::isfinite(c.turn_limit) || c.turn_limit <= 0 || c.turn_limit > 2)
        out.emplace_back("turn_limit must lie in (0, 2].");
    return out;
}

std::string why_not(RelaxerKind kind, std::span<const Device> devices) {
    assert(!devices.empty());
    if (kind == RelaxerKind::Global) return "";
    for (const Device& device : devices) {
        const DeviceSpec& spec = device.spec;
        if (spec.holding_friction() > 0 || spec.holding_inner_friction() > 0 ||
            spec.holding_valve_friction() > 0)
            return "the paper's relaxers know no friction";
        if (device.twists_by_segments() || (device.spec.twists() && !device.spec.shape.empty()))
            return "the paper's relaxers know no torsion";
    }
    return "";
}

std::string message(Termination end) {
    switch (end) {
        case Termination::NotStarted:
            return "nothing has been relaxed";
        case Termination::StrictMinimum:
            return "at rest: a strict minimum of the energy";
        case Termination::Stationary:
            return "at rest, not certified as a strict minimum";
        case Termination::Settled:
            return "settled: no segment turned in a whole sweep";
        case Termination::OutOfBudget:
            return "not at rest: the budget of updates ran out";
        case Termination::Stuck:
            return "not at rest: no step lowers the energy";
    }
    assert(false);
    return {};
}

void RelaxReport::add(const RelaxReport& later) {
    assert(later.updates >= 0 && later.newton_steps >= 0 && later.rejected >= 0);
    const RelaxReport before = *this;
    *this = later;
    updates += before.updates;
    newton_steps += before.newton_steps;
    rejected += before.rejected;
    wall_queries += before.wall_queries;
    lag_rounds += before.lag_rounds;
    largest_turn = std::max(largest_turn, before.largest_turn);
    window = std::max(window, before.window);
}

RelaxBudget whole_cycles(int segments, int cycles) {
    assert(segments >= 1 && cycles >= 0);
    constexpr double most = 1e9;  // of any wire: more than ever comes to an end
    return {static_cast<int>(std::min(most, 0.5 * cycles * segments * (segments + 1.0))), 0.0, 0};
}

std::unique_ptr<Relaxer> make_relaxer(const RelaxerConfig& config, const LumenWall& wall) {
    if (const auto wrong = problems(config); !wrong.empty()) throw std::invalid_argument(wrong.front());
    if (config.kind == RelaxerKind::Global) return std::make_unique<GlobalRelaxer>(config, wall);
    return std::make_unique<SegmentRelaxer>(config, wall);
}

}  // namespace physics
