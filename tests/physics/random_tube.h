#pragma once
/// Random tubes and the wires that are pushed into them: one seed is one case, and shares no draws with the
/// next. Curvature, radius, wall, EI, soft and shaped tips and the pushes are drawn; λ is what `auto` would
/// choose.

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "engine/anatomy/scenes.h"
#include "engine/io/cpu_clock.h"
#include "engine/studies/plain_wire.h"
#include "physics/geometry/random.h"
#include "physics/relax/discretisation_error.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

class RandomTube {
public:
    struct Options {
        int finer = 1;         // λ is that of `auto` over it
        int tip_segments = 0;  // Grid::tip_segments
        bool pushed = true;    // λ by λ to where the wire ends; else it lies at the start
    };
    explicit RandomTube(std::uint64_t seed) : RandomTube(seed, Options{}) {}
    RandomTube(std::uint64_t seed, const Options& options) {
        geometry::Random random(geometry::mixed(geometry::golden_step * (seed + 1)));
        const int finer = options.finer;
        std::vector<anatomy::PenMove> path = {anatomy::Run{random.between(10, 40)}};
        double sharpest = 0;
        for (int k = 0, arcs = 1 + static_cast<int>(4 * random()); k < arcs; ++k) {
            const double bend = 12 * std::pow(5, random()), angle = random.between(0.3, 1.7);
            const bool flat = random() < 0.4;
            path.push_back(anatomy::Arc{bend, angle, flat ? Vec3(Vec3::UnitZ()) : direction(random)});
            path.push_back(anatomy::Run{random.between(5, 30)});
            sharpest = std::max(sharpest, 1 / bend);
        }
        const double most = anatomy::length(path);
        path.push_back(anatomy::Run{60});
        radius = 1.2 * std::pow(5, random());
        studies::PlainWire wire;
        wire.diameter = 0.6;
        wire.shaft_rigidity = 20 * std::pow(20, random());
        wire.tip_rigidity = std::min(wire.shaft_rigidity, 2 * std::pow(10, random()));
        wire.tip_length = random.between(10, 30);
        wire.transition_length = random.between(20, 100);
        wire.curved_angle = random() < 0.6 ? random.between(0.2, 1.4) : 0;
        wire.curved_length = random.between(5, 15);
        if (wire.curved_angle > 0) sharpest = std::max(sharpest, wire.curved_angle / wire.curved_length);
        constexpr double sagitta = 0.05;  // [mm]
        lambda = std::clamp(std::min(std::sqrt(8 * sagitta / sharpest), radius), 0.2, 5.0);
        wire.curved_length = lambda * std::max(1.0, std::round(wire.curved_length / lambda));
        wire.segment_length = lambda / finer;
        const double per_length = std::pow(5, random()), turn = random.between(0, 2 * M_PI);
        const double last = random.between(20, most), part = random();
        stiffness = per_length * wire.segment_length;
        wire_radius = 0.5 * wire.diameter;
        wall = std::make_unique<physics::TubeWall>(anatomy::draw(path), radius, stiffness, wire_radius);
        const int cells = static_cast<int>(std::max(20.0, wire.curved_length + 4 * lambda) / lambda);
        const double start = cells * lambda;
        hand = std::min(lambda, (most + 40 - start) / 20);
        hands = std::clamp(static_cast<int>(std::lround((last - start) / hand)), 20, 40);
        physics::Grid grid = wire.grid();
        grid.tip_segments = options.tip_segments;
        chain = physics::wire_along(wire.device(), grid, wall->centreline(), cells * finer);
        physics::rotate(chain, physics::every_device, turn);
        hub = std::make_unique<physics::Hub>(physics::RelaxerConfig{}, *wall);
        at_rest = hub->settle(chain, unlimited).relax.converged();
        if (!options.pushed) return;
        while (at_rest && chain.inserted_length() < last) push(wire.segment_length);
        if (at_rest) push(part * wire.segment_length);
    }

    void push(double feed) {
        const double before = io::thread_cpu_seconds();
        const physics::HubReport report = hub->move(chain, {feed, 0}, unlimited);
        seconds_of_push = io::thread_cpu_seconds() - before;
        updates_of_push = report.relax.updates;
        at_rest = report.outcome == physics::HubReport::Outcome::AtRest && report.relax.strict_minimum();
        seconds_of_pushes += seconds_of_push;
        updates_of_pushes += updates_of_push;
        fed_by_push = report.made.feed;
        ++pushes;
    }

    /// The same until all of it is fed, in parts of λ at most: a hub may make less of a push.
    void push_all(double feed) {
        const double lambda_here = chain.grid.segment_length;
        for (double left = feed; at_rest && left > 1e-9; left -= fed_by_push)
            push(left / std::max(1.0, std::ceil(left / lambda_here - 1e-9)));
    }

    double radius = 0, stiffness = 0, wire_radius = 0;  // [mm], [N/mm], [mm]
    std::unique_ptr<physics::TubeWall> wall;
    std::unique_ptr<physics::Hub> hub;
    physics::Chain chain;
    double lambda = 0;  // that of `auto` [mm]
    double hand = 0;    // of a course of pushes: what each feeds [mm]
    int hands = 0;      // and how many they are
    bool at_rest = false;
    int pushes = 0;
    double fed_by_push = 0;  // [mm]
    double seconds_of_push = 0, seconds_of_pushes = 0;
    long long updates_of_push = 0, updates_of_pushes = 0;

private:
    using Vec3 = geometry::Vec3;
    static constexpr int unlimited = 1'000'000'000;

    static Vec3 direction(geometry::Random& random) {
        for (;;) {
            const double x = random.between(-1, 1), y = random.between(-1, 1), z = random.between(-1, 1);
            if (const Vec3 v(x, y, z); v.norm() > 0.1 && v.norm() < 1) return v.normalized();
        }
    }
};

/// The chain with every segment in halves, `times` over, at rest.
inline physics::Chain halved(const physics::Chain& chain, const physics::LumenWall& wall, int times) {
    physics::Chain fine = chain;
    for (int k = 0; k < times; ++k) {
        for (int i = fine.segments(); i >= 1; --i) physics::split_segment(fine, i);
        physics::GlobalRelaxer({}, wall).relax(fine, {1'000'000'000, 0, 0});
    }
    return fine;
}

/// The same with λ/16, and segments where contacts begin and end and those of the last λ in quarters of that:
/// what stands for infinitely short ones. An end that presses on a hard wall still sinks in with λ/16.
inline physics::Chain finest(const physics::Chain& chain, const physics::LumenWall& wall, int halvings = 4) {
    physics::Chain fine = halved(chain, wall, halvings);
    for (int k = 0; k < 2; ++k) {
        const auto contacts = physics::all_contacts(fine, wall);
        const int n = fine.segments();
        for (int i = n; i >= 1; --i)
            if (i > n - 16 || (i > 1 && contacts[i - 1].touches()) != contacts[i].touches())
                physics::split_segment(fine, i);
        physics::GlobalRelaxer({}, wall).relax(fine, {1'000'000'000, 0, 0});
    }
    return fine;
}

/// The largest force on a length λ of the chain, of which each joint of `coarse` bears half of its segments.
inline double largest_force_of(const physics::Chain& fine, const physics::Chain& coarse,
                               const physics::LumenWall& wall) {
    const auto contacts = physics::all_contacts(fine, wall);
    std::vector<double> force(coarse.joints.size(), 0.0);
    double place = 0, from = 0;
    int i = 1;
    for (int k = 1; k <= fine.segments(); ++k) {
        place += fine.lengths[k];
        while (i < coarse.segments() && place > from + coarse.lengths[i] + 1e-9) from += coarse.lengths[i++];
        const double s = (place - from) / coarse.lengths[i];
        force[i - 1] += (1 - s) * contacts[k].force();
        force[i] += s * contacts[k].force();
    }
    return *std::max_element(force.begin() + 1, force.end());
}

/// A true error over its estimate.
struct ErrorRatio {
    double tip = 0, force = 0;  // estimate of the true error
    double true_tip = 0, true_force = 0;
    bool estimated = false;
    /// Of the tip, and of the force where there is any; both rounded by what the relaxer leaves.
    double of_tip() const { return estimated ? std::max(1e-6, true_tip) / tip : HUGE_VAL; }
    double of_force() const {
        constexpr double seen = 1e-6;  // [N]
        if (!estimated) return HUGE_VAL;
        return std::max(seen, std::abs(true_force)) / std::max(seen, std::abs(force));
    }
};

/// Against finest().
inline ErrorRatio error_ratio(const RandomTube& tube) {
    ErrorRatio ratio;
    const physics::Chain& chain = tube.chain;
    const auto contacts = physics::all_contacts(chain, *tube.wall);
    const auto error = physics::ErrorEstimator(*tube.wall).of(chain, contacts);
    const physics::Chain fine = finest(chain, *tube.wall);
    ratio.true_tip = (fine.tip() - chain.tip()).norm();
    ratio.true_force = largest_force_of(fine, chain, *tube.wall) - largest_force_of(chain, chain, *tube.wall);
    ratio.estimated = error.has_value();
    if (error) ratio.tip = error->tip, ratio.force = error->wall_force;
    return ratio;
}

/// What share of cases lies within a factor of two, and the largest ratio.
struct RatioCounts {
    int cases = 0, within_two = 0, above_four = 0, without = 0;
    double largest = 0;
    void add(double ratio) {
        ++cases;
        without += std::isinf(ratio);
        within_two += ratio >= 0.5 && ratio <= 2;
        above_four += ratio > 4;
        largest = std::max(largest, ratio);
    }
    double share() const { return static_cast<double>(within_two) / cases; }
};
