#include "engine/studies/random_tubes.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <random>

#include "engine/anatomy/scenes.h"
#include "engine/io/cpu_clock.h"
#include "engine/studies/plain_wire.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using geometry::Vec3;

constexpr int unlimited = 1'000'000'000;  // updates
constexpr double straight_at_start = 22;  // λ
constexpr double straight_at_end = 30;    // [mm]
constexpr double sharpest_arc = 1.2;      // radius relative to the lumen's
constexpr double largest_excess = 0.05;   // of the energy, beyond the hand's work
constexpr double excess_floor = 1e-3;     // [N·mm]

/// Random numbers that are the same on every machine, unlike the standard's distributions.
class Draw {
public:
    explicit Draw(std::uint64_t seed) : random_(seed) {}
    double unit() { return std::ldexp(static_cast<double>(random_() >> 11), -53); }  // [0, 1)
    double between(double from, double to) { return from + (to - from) * unit(); }
    double by_logarithm(double from, double to) { return from * std::pow(to / from, unit()); }

private:
    std::mt19937_64 random_;
};

/// Pushes, with the outcome of each by its own figures and by the energy module.
class Course {
public:
    Course(std::uint64_t seed, int most_pushes, const TubeRange& range)
        : most_(most_pushes),
          tube_(random_tube(seed, range)),
          wall_(tube_.centreline, tube_.radius, tube_.wall_stiffness),
          hub_({}, wall_),
          wire_(wire_along(PlainWire::uniform(tube_.rigidity, tube_.segment_length), tube_.centreline,
                           segments_at_start)) {
        course_.seed = seed;
        last_ = hub_.settle(wire_, unlimited).relax;
        energy_ = energy();
    }

    TubeCourse run() {
        const double whole = tube_.segments * tube_.segment_length;
        while (course_.pushes < most_ && wire_.inserted_length() < whole - 1e-6)
            if (!push()) break;
        course_.reached = wire_.segments();
        course_.tube = std::move(tube_);
        return std::move(course_);
    }

private:
    /// Returns false where nothing can follow.
    bool push() {
        const double lambda = tube_.segment_length;
        double left = lambda, work = 0, time = 0;
        int steps = 0;
        bool refused = false;
        while (left > 1e-9 * lambda && !refused) {
            const double before = hand_force();
            const double start = io::thread_cpu_seconds();
            const physics::HubReport made = hub_.move(wire_, {left, 0}, unlimited);
            time += io::thread_cpu_seconds() - start;
            last_ = made.relax;
            steps += last_.newton_steps;
            refused = made.outcome != physics::HubReport::Outcome::AtRest;
            left -= made.made.feed;
            work += made.made.feed * std::max({before, hand_force(), 0.0});
            if (!last_.converged()) break;
        }
        course_.times.push_back(1e3 * time);
        course_.steps += steps;
        ++course_.pushes;
        return judge(refused, work);
    }

    double energy() const {
        return physics::total_energy(wire_, physics::all_contacts(wire_, wall_)).total();
    }

    /// Rise of the energy at rest per length let in [N]. At rest nothing else changes the energy, so the
    /// wire's directions are kept as they are. The force along the wire at its introducer equals this except
    /// for the length of the segments, whose joints are not quite where the curve touches the wall.
    double hand_force() const {
        const double little = 1e-5 * tube_.segment_length;
        physics::Chain longer = wire_;
        physics::feed(longer, physics::every_device, little);
        if (longer.segments() != wire_.segments()) return 0;  // the segment grew beyond what it may be
        const auto contacts = physics::all_contacts(longer, wall_);
        return (physics::total_energy(longer, contacts).total() - energy()) / little;
    }

    /// Depth to which the wire would go if the hub let it [mm].
    double depth_of_next_rest() const {
        double deepest = 0;
        for (const double part : {1.0 / 32, 1.0 / 4}) {
            physics::Chain wire = wire_;
            physics::feed(wire, physics::every_device, part * tube_.segment_length);
            physics::make_relaxer({}, wall_)->relax(wire, {unlimited, 0, 0});
            deepest = std::max(deepest, physics::largest_penetration(physics::all_contacts(wire, wall_)));
        }
        return deepest;
    }

    bool judge(bool refused, double work) {
        const auto contacts = physics::all_contacts(wire_, wall_);
        const double gradient = physics::relative_gradient(wire_, contacts), now = energy(),
                     depth = physics::largest_penetration(contacts), excess = now - energy_ - work;
        energy_ = now;
        const double bend = last_.largest_bend / geometry::degree;
        const bool fold = bend > 90, deep = depth > tube_.radius;
        const double next = refused ? depth_of_next_rest() : 0;
        const bool gave_way = next > tube_.radius;
        count(refused && !gave_way, course_.refused, fmt::format("refused: {:.3g} mm deep", depth));
        count(
            gave_way, course_.gave_way,
            fmt::format("refused: the next rest is {:.3g} mm outside a lumen of {:.3g}", next, tube_.radius));
        if (!refused) {
            course_.gradient = std::max(course_.gradient, gradient);
            course_.excess = std::max(course_.excess, excess / std::max(now, excess_floor));
            course_.flat += last_.at_rest() && !last_.converged();
            count(!last_.at_rest(), course_.unconverged,
                  fmt::format("not at rest: |g|/C {:.1e}", last_.gradient));
            count(!(gradient <= rest_limit), course_.restless, fmt::format("|g|/C {:.1e}", gradient));
            count(fold, course_.folds, fmt::format("a joint bent by {:.0f}°", bend));
            count(deep, course_.deep, fmt::format("{:.3g} mm outside", depth));
            count(excess > largest_excess * now + excess_floor, course_.over_work,
                  fmt::format("energy {:.3g} N·mm, of which {:.2g} are not the hand's", now, excess));
        }
        return !refused && !fold && !deep;
    }

    void count(bool found, int& counter, const std::string& what) {
        if (!found) return;
        ++counter;
        course_.incidents.push_back({"random tube", course_.seed, course_.pushes - 1, what});
    }

    int most_;
    RandomTube tube_;
    physics::TubeWall wall_;
    physics::Hub hub_;
    physics::Chain wire_;
    physics::RelaxReport last_;
    double energy_ = 0;  // [N·mm]
    TubeCourse course_;
};

}  // namespace

RandomTube random_tube(std::uint64_t seed, const TubeRange& range) {
    Draw draw(seed);
    RandomTube tube;
    tube.radius = draw.between(1, 6);
    tube.segment_length = draw.between(0.5, 3);
    tube.rigidity = draw.by_logarithm(range.least_rigidity, 2000);
    tube.wall_stiffness = draw.by_logarithm(1, range.most_stiffness);
    tube.segments = 50 + static_cast<int>(351 * draw.unit());
    std::vector<anatomy::PenMove> path = {
        anatomy::Run{std::max(10.0, straight_at_start * tube.segment_length)}};
    const double length_needed = tube.segment_length * (tube.segments + 5);
    while (anatomy::length(path) < length_needed) {
        const double x = draw.between(-1, 1), y = draw.between(-1, 1), z = draw.between(-1, 1);
        const double radius = tube.radius * draw.by_logarithm(sharpest_arc, 20),
                     angle = draw.between(0.2, 2.6);
        path.push_back(anatomy::Arc{radius, (draw.unit() < 0.5 ? -1 : 1) * angle, Vec3(x, y, z)});
        path.push_back(anatomy::Run{draw.between(0, 4 * tube.radius)});
    }
    path.push_back(anatomy::Run{straight_at_end});
    tube.centreline = anatomy::draw(path);
    return tube;
}

TubeCourse push_through(std::uint64_t seed, int most_pushes, const TubeRange& range) {
    return Course(seed, most_pushes, range).run();
}

}  // namespace studies
