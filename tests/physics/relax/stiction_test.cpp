/// Static and kinetic friction of a wire on the wall, against closed forms.

#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "engine/anatomy/scenes.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"
#include "physics/wire/friction.h"
#include "tests/physics/capstan.h"
#include "tests/physics/wires.h"

namespace physics {
namespace {

constexpr int no_bound = 10'000'000;

/// A thread of two coefficients, at rest along a line under a load.
struct Sticking {
    Sticking(const LumenWall& wall, const Polyline& line, double rigidity, double still, double slides,
             double lambda, double length, const Vec3& load = Vec3::Zero())
        : hub({}, wall), wall(wall) {
        studies::PlainWire spec = studies::PlainWire::uniform(rigidity, lambda);
        spec.diameter = 0.01;
        spec.friction = slides;
        Device device;
        device.spec = spec.device();
        device.spec.static_friction = still;
        device.inserted = length;
        wire = chain_along({device}, spec.grid(), line);
        wire.load = load;
        hub.settle(wire, no_bound);
        start_grips(wire);
        hub.settle(wire, no_bound);
    }
    /// Force of the hand after the motion.
    double feed(double mm) {
        const HubReport report = hub.move(wire, {mm, 0}, no_bound);
        EXPECT_EQ(report.outcome, HubReport::Outcome::AtRest);
        EXPECT_NEAR(report.made.feed, mm, 1e-12);
        push = report.relax.push_force;
        return hub.loads()[0].push;
    }
    /// The largest force on the way, in steps that are small against what is left of what gives.
    double break_away(int way) {
        double most = 0;
        for (int k = 0; k < 300; ++k) {
            double stretched = 0;
            for (std::size_t j = 1; j < wire.grips.size(); ++j)
                if (wire.grips[j].holds())
                    stretched = std::max(stretched, wire.grips[j].stretch(wire.joints[j]).norm());
            // Those that have not let go of the last motion come from the other side.
            feed(way * (stretched < 0.95 * slip_length ? 0.002 : 0.0001));
            if (way * push > most) {
                most = way * push;
                pressed_at_most = pressed();
            }
        }
        return most;
    }
    double slide(int way) {
        for (int k = 0; k < 20; ++k) feed(way * 0.25);
        return way * push;
    }
    void rest(double seconds) {
        let_rest(wire, 0);
        let_rest(wire, seconds);
        hub.settle(wire, no_bound);
    }
    double energy() const { return total_energy(wire, all_contacts(wire, wall)).total(); }
    double pressed() const {
        double sum = 0;
        for (const WallContact& c : hub.contacts()) sum += c.force();
        return sum;
    }

    Hub hub;
    const LumenWall& wall;
    Chain wire;
    double push = 0;             // at the introducer, along the wire [N]
    double pressed_at_most = 0;  // by the wall, where it broke away [N]
};

}  // namespace

/// A block: it holds by the static coefficient, slides by the kinetic one, holds so while it has lain still
/// for less than rest_time, and then by the static one again.
TEST(Stiction, AStraightWireOnAFloorSticksSlipsAndSticksAgain) {
    const Polyline line = {{0, 0, 0}, {300, 0, 0}};
    const TubeWall wall(line, 2, 42, 0);
    constexpr double still = 0.3, slides = 0.2;
    for (const int way : {1, -1}) {
        // It comes in where it lies.
        const Polyline floor = {{0, 0, -1.995}, {300, 0, -1.995}};
        Sticking g(wall, floor, 5, still, slides, 1, 150, Vec3(0, 0, -0.002));
        const auto breaks_away = [&](double mu) {
            const double force = g.break_away(way), exact = mu * g.pressed_at_most;
            EXPECT_NEAR(force, exact, 0.01 * exact) << way;
            std::printf("block, %+d: breaks away at %.5f N, closed form %.5f N\n", way, force, exact);
        };
        const auto slides_on = [&] {
            const double force = g.slide(way), exact = slides * g.pressed();
            EXPECT_NEAR(force, exact, 1e-3 * exact) << way;
        };
        breaks_away(still);
        slides_on();
        g.rest(0.6 * rest_time);
        breaks_away(slides);
        // Time before it slipped does not count.
        g.rest(0.6 * rest_time);
        breaks_away(slides);
        const double before = g.hub.loads()[0].push;
        g.rest(rest_time);
        EXPECT_NEAR(g.hub.loads()[0].push, before, 1e-6) << "a rest changes no force";
        breaks_away(still);
        slides_on();
    }
}

/// The coefficient is the static one where the wire breaks away, and the kinetic one beyond.
TEST(Stiction, TheCapstanBreaksAwayByTheStaticAndSlidesByTheKineticCoefficient) {
    for (const double angle : {60.0, 120.0, 180.0}) {
        const test::Capstan capstan(angle * degree);
        // Of a wall that gives, the bend's near end would slip first.
        const TubeWall wall(capstan.line, capstan.lumen, 2000, 0);
        constexpr double still = 0.3, slides = 0.2;
        Sticking g(wall, capstan.way, 5, still, slides, 0.5, capstan.length(), capstan.load());
        const auto exact = [&](double mu) { return capstan.tension(mu, g.wire.inserted_length()); };
        const double held = exact(still), broken = g.break_away(-1);
        EXPECT_NEAR(broken, held, 0.01 * held) << angle << " deg";
        const double sliding = g.slide(-1), drawn = exact(slides);
        EXPECT_NEAR(sliding, drawn, 0.01 * drawn) << angle << " deg";
        std::printf("capstan %3.0f deg: static %.4f N (closed form %.4f), kinetic %.4f N (%.4f)\n", angle,
                    broken, held, sliding, drawn);
    }
}

/// Over pushes, pulls and rests; a drop from static to kinetic gives what it frees to friction.
TEST(Stiction, TheHandsWorkIsTheEnergyGainedAndTheLoss) {
    for (const char* name : {"sinuous", "spatial"}) {
        const anatomy::Scene& scene = *anatomy::find_scene(name);
        constexpr double lambda = 0.5, step = 0.0125;
        const TubeWall wall(anatomy::draw(scene.path), scene.radius, lambda * scene.wall_stiffness, 0);
        Sticking g(wall, wall.centreline(), scene.rigidity, 0.3, 0.2, lambda, 100);
        double force = g.feed(step), work = 0;
        const double before = g.energy() + g.wire.friction_loss, loss_before = g.wire.friction_loss;
        for (int k = 1; k < 1600; ++k) {
            if (k % 200 == 0) {
                g.rest(rest_time);
                force = g.hub.loads()[0].push;
            }
            const double by = k < 800 ? step : -step, now = g.feed(by);
            work += by * 0.5 * (force + now);
            force = now;
        }
        const double gained = g.energy() + g.wire.friction_loss - before,
                     loss = g.wire.friction_loss - loss_before;
        EXPECT_NEAR(work, gained, 0.01 * loss) << name;
        EXPECT_GT(loss, 0.3) << name;
        std::printf("%s: work %.4f, gained and lost %.4f, lost %.4f N mm\n", name, work, gained, loss);
    }
}

TEST(Stiction, OneCoefficientIsAsWithoutTheOther) {
    const anatomy::Scene& scene = *anatomy::find_scene("sinuous");
    const TubeWall wall(anatomy::draw(scene.path), scene.radius, scene.wall_stiffness, 0);
    Sticking one(wall, wall.centreline(), scene.rigidity, 0, 0.2, 1, 60),
        same(wall, wall.centreline(), scene.rigidity, 0.2, 0.2, 1, 60);
    for (int k = 0; k < 20; ++k) {
        EXPECT_EQ(one.feed(0.5), same.feed(0.5));
        EXPECT_FALSE(let_rest(same.wire, 1));
    }
    EXPECT_EQ(one.wire.joints, same.wire.joints);
    EXPECT_EQ(one.wire.grips, same.wire.grips);
}

/// However the rest is cut into frames, and however the motion is cut into parts.
TEST(Stiction, TimeAndNotFramesOrPartsDecides) {
    const Polyline line = {{0, 0, 0}, {300, 0, 0}};
    const TubeWall wall(line, 2, 42, 0);
    for (const double rate : {0.5, 7.5, 15.0, 60.0}) {
        Sticking g(wall, line, 5, 0.3, 0.2, 1, 150, Vec3(0, 0, -0.002));
        g.slide(1);
        let_rest(g.wire, 1 / rate);  // the frame that it slipped in
        double time = 0;
        const auto holds = [&] {
            return std::any_of(g.wire.grips.begin(), g.wire.grips.end(),
                               [](const Grip& grip) { return grip.holds() && grip.rests(); });
        };
        while (!holds() && time < 10) {
            let_rest(g.wire, 1 / rate);
            time += 1 / rate;
        }
        EXPECT_GE(time, rest_time - 1e-9) << rate;
        EXPECT_LT(time, rest_time + 1 / rate) << rate;
    }
    Sticking whole(wall, line, 5, 0.3, 0.2, 1, 150, Vec3(0, 0, -0.002)),
        halves(wall, line, 5, 0.3, 0.2, 1, 150, Vec3(0, 0, -0.002));
    for (int k = 0; k < 10; ++k) {
        const double force = whole.feed(0.5);
        halves.feed(0.25);
        EXPECT_NEAR(halves.feed(0.25), force, 1e-3 * force);
    }
}

TEST(Stiction, IsPartOfTheStateWhereItActs) {
    Grip grip;
    grip.force = 0.3;
    grip.normal = Vec3::UnitZ();
    const std::uint64_t hash = geometry::state_hash_of(grip);
    grip.rested = 0.05;
    EXPECT_NE(geometry::state_hash_of(grip), hash);
    Grip restored;
    geometry::restore_state(restored, geometry::state_of(grip));
    EXPECT_EQ(restored.rested, 0.05);
    EXPECT_EQ(restored, grip);
    // With more force than before, it pushes as before.
    const Vec3 joint(0.3 * slip_length, 0.4 * slip_length, 0.2), push = grip.push(joint);
    const double energy = grip.energy(joint), freed = grip.strengthen(joint, 0.45);
    EXPECT_LT((grip.push(joint) - push).norm(), 1e-12);
    EXPECT_NEAR(grip.energy(joint) + freed, energy, 1e-15);
    EXPECT_GT(freed, 0);
}

}  // namespace physics
