#include "engine/studies/pareto_measure.h"

#include <algorithm>

#include "engine/io/cpu_clock.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/slow_flow.h"
#include "physics/relax/relaxer.h"

namespace studies {
namespace {

/// The wire through these joints; a rival's segments may be a little longer or shorter than λ.
Chain through(Chain wire, const std::vector<Vec3>& joints) {
    for (int i = 1; i <= wire.segments(); ++i) wire.tangents[i] = (joints[i] - joints[i - 1]).normalized();
    physics::rebuild_joints(wire);
    return wire;
}

struct End {
    std::vector<std::vector<Vec3>> seen;
    ParetoCourse course;
};

/// Looks whenever 15 % more work is done. A Newton method is looked at after `newton` times as many steps, or
/// after each where that is 1: in a dead end the global relaxer needs more than a step's budget to get out.
End watch(ParetoRunner& runner, const Chain& start, const ParetoMethod& method, int most, int series,
          double newton) {
    End end;
    runner.start(start);
    double cpu = 0;
    int done = 0;
    bool over = false;
    for (double goal = method.first; done < most && !over;
         goal = std::max(goal + 1, (method.newton ? newton : 1.15) * goal)) {
        const int rounds = std::min(static_cast<int>(goal), most) - done;
        if (rounds < 1) continue;
        const double begin = io::thread_cpu_seconds();
        over = runner.advance(rounds);
        cpu += io::thread_cpu_seconds() - begin;
        done += rounds;
        end.course.points.push_back({series, cpu, 0});
        end.course.work.push_back(runner.work());
        end.seen.push_back(runner.joints());
    }
    end.course.end = runner.end();
    return end;
}

/// Finds the rest that the course's end leads to, and how far from it every look was.
ParetoCourse measured(End end, const ParetoVessel& vessel, const Chain& start, const Chain& rest) {
    ParetoCourse& course = end.course;
    Chain own = through(start, end.seen.back());
    const SlowFlowReport flow = flow_to_rest(own, *vessel.wall);
    course.energy = flow.energy;
    course.gradient = flow.gradient;
    course.basin = farthest_joint(own, rest);
    for (std::size_t k = 0; k < end.seen.size(); ++k)
        course.points[k].deviation = farthest_joint(end.seen[k], own.joints);
    return course;
}

int part(const ParetoMethod& method, int most, double share) {
    return method.newton ? most : std::max(1, static_cast<int>(most * share));
}

}  // namespace

ParetoCourse from_centreline(const ParetoVessel& vessel, const ParetoMethod& method, int series,
                             double share) {
    const Chain start = vessel.wire(vessel.segments);
    const Chain rest = global_rest(*vessel.wall, start).wire;
    const auto runner = method.make(vessel, false);
    return measured(watch(*runner, start, method, part(method, method.most_cold, share), series, 2), vessel,
                    start, rest);
}

std::vector<ParetoPush> pareto_pushes(const ParetoVessel& vessel, int count) {
    const auto relaxer = physics::make_relaxer({}, *vessel.wall);
    const int first = std::max(2, static_cast<int>(0.4 * vessel.segments));
    Chain wire = vessel.wire(first);
    relaxer->relax(wire, {1'000'000'000, 0, 0});
    std::vector<ParetoPush> list;
    while (wire.segments() < vessel.segments) {
        ParetoPush push{wire, {}, {}};
        physics::move(wire, wire.grid.segment_length);
        push.pushed = wire;
        relaxer->relax(wire, {1'000'000'000, 0, 0});
        push.rest = wire;
        const int made = static_cast<int>(list.size());
        if (wire.segments() - first >= static_cast<int>((made + 1.0) * (vessel.segments - first) / count))
            list.push_back(std::move(push));
    }
    return list;
}

ParetoCourse course_of(const ParetoVessel& vessel, const ParetoMethod& method, const ParetoPush& push,
                       int series, double share) {
    const auto runner = method.make(vessel, true);
    runner->remember(push.before);
    return measured(watch(*runner, push.pushed, method, part(method, method.most_push, share), series, 1),
                    vessel, push.pushed, push.rest);
}

ParetoFloor floor_of(const ParetoVessel& vessel, const ParetoMethod& method, double share) {
    const Chain rest = global_rest(*vessel.wall, vessel.wire(vessel.segments)).wire;
    const auto runner = method.make(vessel, false);
    const ParetoCourse course = measured(
        watch(*runner, rest, method, part(method, 2 * method.most_cold, share), 0, 2), vessel, rest, rest);
    return {course.points.back().deviation, course.end};
}

}  // namespace studies
