/// Friction of a wire on the wall: the law itself, and the force that it takes of a hand, against closed
/// forms.

#include <Eigen/Eigenvalues>
#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <random>

#include "engine/anatomy/scenes.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/crossings.h"
#include "physics/wire/energy.h"
#include "physics/wire/refinement.h"
#include "tests/physics/capstan.h"
#include "tests/physics/wires.h"

namespace physics {
namespace {

constexpr int enough = 10'000'000;

studies::PlainWire thread(double rigidity, double friction, double lambda = 1) {
    studies::PlainWire spec = studies::PlainWire::uniform(rigidity, lambda);
    spec.diameter = 0.01;
    spec.friction = friction;
    return spec;
}

/// At rest along the wall's centreline, with grips that begin there.
struct Gripped {
    Gripped(const LumenWall& wall, const Polyline& line, const studies::PlainWire& spec, double length,
            const Vec3& load = Vec3::Zero())
        : hub({}, wall), wire(studies::wire_of_length(spec, line, length)) {
        wire.load = load;
        hub.settle(wire, enough);
        start_grips(wire);
        hub.settle(wire, enough);
    }
    RelaxReport feed(double mm, int times = 1) {
        RelaxReport last;
        for (int k = 0; k < times; ++k) {
            const HubReport report = hub.move(wire, {mm, 0}, enough);
            EXPECT_EQ(report.outcome, HubReport::Outcome::AtRest);
            EXPECT_NEAR(report.made.feed, mm, 1e-12);
            EXPECT_TRUE(report.relax.converged());
            last = report.relax;
        }
        return last;
    }
    Hub hub;
    Chain wire;
};

TEST(Grip, PushAndStiffnessAreTheDerivativesOfItsEnergy) {
    std::mt19937 random(3);
    const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -31) - 1; };
    for (int k = 0; k < 1000; ++k) {
        Grip grip;
        grip.anchor = {unit(), unit(), unit()};
        grip.normal = Vec3(unit(), unit(), unit()).normalized();
        grip.force = 0.1 + std::abs(unit());
        const double size = std::exp(5 * unit()) * slip_length;
        const Vec3 joint = grip.anchor + size * Vec3(unit(), unit(), unit());
        if (std::abs(grip.stretch(joint).norm() - slip_length) < 1e-4) continue;  // its stiffness jumps there
        const double h = 1e-6 * slip_length;
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3 step = h * Vec3::Unit(axis);
            EXPECT_NEAR((grip.energy(joint + step) - grip.energy(joint - step)) / (2 * h),
                        grip.push(joint)[axis], 1e-6 * grip.force);
            const Vec3 bend = (grip.push(joint + step) - grip.push(joint - step)) / (2 * h);
            EXPECT_LT((bend - grip.stiffness(joint).col(axis)).norm(), 1e-5 * grip.force / slip_length);
        }
        const Eigen::SelfAdjointEigenSolver<Mat3> eigen(grip.stiffness(joint));
        EXPECT_GE(eigen.eigenvalues()[0], -1e-12 * grip.force / slip_length);
        EXPECT_LE(grip.push(joint).norm(), grip.force * (1 + 1e-12));
    }
}

TEST(Grip, AnAnchorFollowsWhatSlipsAndChangesNoForce) {
    Grip grip;
    grip.normal = Vec3::UnitZ();
    grip.force = 0.3;
    const Vec3 near(0.6 * slip_length, 0, 0.7), far(0.3, -0.4, 0.2);
    EXPECT_EQ(grip.follow(near), 0);
    EXPECT_EQ(grip.anchor, Vec3::Zero());
    const Vec3 push = grip.push(far);
    const double cost = grip.follow(far);
    EXPECT_NEAR(cost, 0.3 * (0.5 - slip_length), 1e-12);
    EXPECT_LT((grip.push(far) - push).norm(), 1e-12);
    EXPECT_NEAR(grip.stretch(far).norm(), slip_length, 1e-12);
    grip.force = 0;
    EXPECT_EQ(grip.follow(near), 0);
    EXPECT_EQ(grip.anchor, near);
}

TEST(Friction, AStraightWireOnAFloorAsksForItsWeightTimesMu) {
    const Polyline line = {{0, 0, 0}, {300, 0, 0}};
    const TubeWall wall(line, 2, 42, 0);
    constexpr double weight = 0.002, slope = 0.1;  // [N/mm]; uphill
    const Vec3 load(-weight * std::sin(slope), 0, -weight * std::cos(slope));
    for (const double mu : {0.05, 0.2, 0.4}) {
        Gripped g(wall, line, thread(5, mu), 150, load);
        const auto pressed = [&] {
            double sum = 0;
            for (const WallContact& c : g.hub.contacts()) sum += c.force();
            return sum;
        };
        for (const int way : {1, -1}) {
            const double force = g.feed(0.5 * way, 10).push_force;
            const double along = weight * std::sin(slope) * g.wire.inserted_length(), grip = mu * pressed();
            EXPECT_NEAR(force, along + way * grip, 0.01 * (along + grip)) << mu << ", " << way;
            // The introducer bears the part that hangs free next to it.
            EXPECT_NEAR(pressed(), weight * std::cos(slope) * g.wire.inserted_length(), 0.2 * pressed());
        }
    }
}

/// Drawn out against the weight of the straight run beyond it.
TEST(Friction, RoundABendItIsThatOfTheCapstan) {
    for (const double angle : {60.0, 120.0, 180.0}) {
        const test::Capstan capstan(angle * degree);
        for (const double mu : {0.1, 0.2, 0.3}) {
            const TubeWall wall(capstan.line, capstan.lumen, 42, 0);
            Gripped g(wall, capstan.way, thread(5, mu, 0.5), capstan.length(), capstan.load());
            const double force = -g.feed(-0.25, 60).push_force;
            const double tension = capstan.tension(mu, g.wire.inserted_length());
            EXPECT_NEAR(force, tension, 0.01 * tension) << angle << " deg, mu " << mu;
            RecordProperty(fmt::format("capstan_{}_{}", angle, mu),
                           fmt::format("{:.4f} {:.4f}", force, tension));
        }
    }
}

/// Work of the hand over a loop of push and pull is what slip has cost.
TEST(Friction, TheHandsWorkIsTheEnergyGainedAndTheLoss) {
    for (const char* name : {"sinuous", "spatial"}) {
        const anatomy::Scene& scene = *anatomy::find_scene(name);
        constexpr double lambda = 0.5;
        const TubeWall wall(anatomy::draw(scene.path), scene.radius, lambda * scene.wall_stiffness, 0);
        Gripped g(wall, wall.centreline(), thread(scene.rigidity, 0.2, lambda), 100);
        const auto energy = [&] {
            const Energy e = total_energy(g.wire, all_contacts(g.wire, wall));
            return e.total();
        };
        constexpr double step = 0.05;
        const auto hand = [&](const RelaxReport&) { return g.hub.loads()[0].push; };
        double force = hand(g.feed(step)), work = 0;
        const double before = energy(), loss_before = g.wire.friction_loss;
        for (int k = 1; k < 800; ++k) {
            const double by = k < 400 ? step : -step;
            const RelaxReport report = g.feed(by);
            work += by * 0.5 * (force + hand(report));
            force = hand(report);
        }
        const double gained = energy() - before, loss = g.wire.friction_loss - loss_before;
        EXPECT_NEAR(work, gained + loss, 0.01 * loss) << name << ": gained " << gained << ", loss " << loss;
        EXPECT_GT(loss, 0.5) << name;
    }
}

TEST(Friction, AWireStaysWhereItIsLeft) {
    const anatomy::Scene& scene = *anatomy::find_scene("sinuous");
    const TubeWall wall(anatomy::draw(scene.path), scene.radius, scene.wall_stiffness, 0);
    Gripped g(wall, wall.centreline(), thread(scene.rigidity, 0.2), 100);
    g.feed(0.5, 40);
    const Chain before = g.wire;
    for (int k = 0; k < 20'000; ++k) g.hub.settle(g.wire, enough);
    EXPECT_EQ(g.wire.joints, before.joints);
    EXPECT_EQ(g.wire.grips, before.grips);
    // And in a hub that knows nothing of it.
    Hub other({}, wall);
    for (int k = 0; k < 10; ++k) other.settle(g.wire, enough);
    EXPECT_LT((g.wire.tip() - before.tip()).norm(), 1e-5);
}

TEST(Friction, WithoutItTheGripsAreNoneAndTheWireIsAsBefore) {
    const anatomy::Scene& scene = *anatomy::find_scene("sinuous");
    const TubeWall wall(anatomy::draw(scene.path), scene.radius, scene.wall_stiffness, 0);
    Gripped g(wall, wall.centreline(), thread(scene.rigidity, 0), 100);
    g.feed(0.5, 5);
    EXPECT_TRUE(g.wire.grips.empty());
    Gripped little(wall, wall.centreline(), thread(scene.rigidity, 1e-7), 100);
    little.feed(0.5, 5);
    EXPECT_EQ(little.wire.grips.size(), little.wire.joints.size());
    EXPECT_LT((little.wire.tip() - g.wire.tip()).norm(), 1e-3);
}

/// Whatever is split, merged and fed, each joint has a grip, and anchors stay on the wire's path.
TEST(Friction, ARecalledWireKeepsTheForcesThatItWasLeftWith) {
    // Round a bend; forces that no round has brought up to date stand for those that agree with no others.
    const anatomy::Scene& scene = *anatomy::find_scene("sinuous");
    const TubeWall wall(anatomy::draw(scene.path), scene.radius, scene.wall_stiffness, 0);
    Gripped at(wall, wall.centreline(), thread(scene.rigidity, 0.2), 60);
    GlobalOptions once;
    once.lag.most_rounds = 0;
    GlobalRelaxer left({}, wall, once);
    HubMotion motion{0.5, 0};
    for (int k = 0; k < 4; ++k) ASSERT_TRUE(left.move(at.wire, motion, {enough, 0, 0}).at_rest());
    Chain recalled = at.wire, relaxed = at.wire;
    ASSERT_TRUE(GlobalRelaxer({}, wall).relax(relaxed, {enough, 0, 0}).at_rest());
    const RelaxReport report = GlobalRelaxer({}, wall).recall(recalled);
    EXPECT_TRUE(report.at_rest());
    EXPECT_LE(report.updates, 2 * recalled.segments());
    double moved = 0, changed = 0;
    for (std::size_t j = 0; j < recalled.joints.size(); ++j) {
        EXPECT_EQ(recalled.grips[j].force, at.wire.grips[j].force) << j;
        moved = std::max(moved, (recalled.joints[j] - at.wire.joints[j]).norm());
        changed = std::max(changed, std::abs(relaxed.grips[j].force - at.wire.grips[j].force));
    }
    EXPECT_LT(moved, 1e-6);
    EXPECT_GT(changed, 1e-4);  // relax() brings them up to date
}

TEST(Friction, AnchorsGoWithTheMaterial) {
    const Polyline line = {{0, 0, 0}, {400, 0, 0}};
    for (unsigned seed = 0; seed < 300; ++seed) {
        std::mt19937 random(seed);
        studies::PlainWire spec = thread(5, 0.2, 2);
        if (seed % 2 == 1) {
            spec.curved_length = 6;
            spec.curved_angle = 0.5;
        }
        Chain wire = wire_of_length(spec, line, 60);
        start_grips(wire);
        double fed = 0;
        for (int k = 0; k < 30; ++k) {
            switch (random() % 4) {
                case 0: {
                    const int i = 1 + static_cast<int>(random() % wire.segments());
                    if (wire.lengths[i] > 0.4) split_segment(wire, i, 0.25 + 0.5 * std::ldexp(random(), -32));
                    break;
                }
                case 1: {
                    const int i = 1 + static_cast<int>(random() % (wire.segments() - 1));
                    if (i + 1 < wire.segments() - 3) merge_segments(wire, i);
                    break;
                }
                default:
                    fed +=
                        feed(wire, every_device, 4 * (std::ldexp(static_cast<double>(random()), -32) - 0.4));
            }
            ASSERT_EQ(wire.grips.size(), wire.joints.size()) << "seed " << seed;
            // The wire lies straight: material was where it is now less what was fed. What came in since
            // holds where it would have been, and the tip's joints go with it.
            for (std::size_t j = 1; j < wire.grips.size(); ++j)
                ASSERT_NEAR(wire.grips[j].anchor.x(), wire.joints[j].x() - fed, 1e-9)
                    << "seed " << seed << ", joint " << j << " of " << wire.segments();
        }
    }
}

TEST(Friction, CoarseAndFineSegmentsAskForTheSameForce) {
    const anatomy::Scene& scene = *anatomy::find_scene("sinuous");
    std::vector<double> forces;
    for (const double lambda : {2.0, 1.0, 0.5}) {
        const TubeWall wall(anatomy::draw(scene.path), scene.radius, scene.wall_stiffness * lambda, 0);
        Gripped g(wall, wall.centreline(), thread(scene.rigidity, 0.2, lambda), 100);
        forces.push_back(g.feed(0.25, 120).push_force);
    }
    EXPECT_NEAR(forces[1], forces[2], 0.1 * forces[2]);
    EXPECT_NEAR(forces[0], forces[2], 0.2 * forces[2]);
}

TEST(Friction, APushThatTheShaftOutsideCannotBearIsNotPassedOn) {
    const anatomy::Scene& scene = *anatomy::find_scene("hairpin");
    const TubeWall wall(anatomy::draw(scene.path), scene.radius, scene.wall_stiffness, 0);
    for (const double limit : {0.0, 1.6}) {
        studies::PlainWire spec = thread(scene.rigidity, 0.4);
        spec.buckling_force = limit;
        Gripped g(wall, wall.centreline(), spec, 100);
        double most = 0, fed = 0;
        bool buckled = false;
        for (int k = 0; k < 160; ++k) {
            const HubReport report = g.hub.move(g.wire, {0.5, 0}, enough);
            fed += report.made.feed;
            buckled = buckled || report.buckled;
            most = std::max(most, g.hub.loads()[0].push);
        }
        if (limit == 0) {
            EXPECT_GT(most, 2);
            EXPECT_FALSE(buckled);
        } else {
            EXPECT_LE(most, limit);
            EXPECT_TRUE(buckled);
            EXPECT_GT(most, 0.9 * limit) << "the last part is small";
            // It can still be drawn back.
            EXPECT_EQ(g.hub.move(g.wire, {-0.5, 0}, enough).outcome, HubReport::Outcome::AtRest);
        }
        EXPECT_LT(fed, 80.001);
    }
}

}  // namespace
}  // namespace physics
