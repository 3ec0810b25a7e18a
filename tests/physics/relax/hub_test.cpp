#include "physics/relax/hub.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <stdexcept>

#include "physics/wall/mesh_wall.h"
#include "physics/wire/energy.h"
#include "physics/wire/outside_shaft.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

using Outcome = HubReport::Outcome;
constexpr int all_it_takes = 1'000'000'000;

/// Feeds part by part; false where a part was refused.
bool feed_at(Hub& hub, Chain& wire, double mm) {
    while (std::abs(mm) > 1e-12) {
        const HubReport report = hub.move(wire, {mm, 0}, all_it_takes);
        if (report.outcome != Outcome::AtRest) return false;
        mm -= report.made.feed;
    }
    return true;
}

/// A wire with a curved tip at rest in that vessel, and its hub.
struct InSmoothVessel {
    SmoothVessel vessel = smooth_vessel();
    Hub hub{{}, vessel.wall};
    Chain wire;
    explicit InSmoothVessel(double length, double lambda = 2)
        : wire(wire_of_length(tipped(lambda), vessel.line, length)) {
        hub.settle(wire, all_it_takes);
    }
};

/// A wire that is far stiffer than the wall round a bend: pushed on, it would go through it.
struct BeforeAWeakBend {
    Polyline line = anatomy::draw(std::vector<anatomy::PenMove>{
        anatomy::Run{60}, anatomy::Arc{2.5, 3.0, Vec3::UnitZ()}, anatomy::Run{60}});
    TubeWall wall{line, 2, 0.05};
    Hub hub{{}, wall};
    Chain wire = wire_of_length(studies::PlainWire::uniform(2000, 2), line, 40);
    BeforeAWeakBend() { hub.settle(wire, all_it_takes); }
};

}  // namespace

TEST(Hub, TakesTheGlobalRelaxerAlone) {
    const SmoothVessel vessel = smooth_vessel();
    RelaxerConfig config = of_kind(RelaxerKind::Segment);
    EXPECT_THROW(Hub(config, vessel.wall), std::invalid_argument);
}

TEST(Hub, LetsInWhatIsAskedForAndTheTipFollowsSmoothly) {
    InSmoothVessel at(61.3);
    auto& [vessel, hub, wire] = at;
    Vec3 tip = wire.tip();
    double asked = 61.3, largest = 0;
    for (int k = 0; k < 400; ++k) {
        ASSERT_TRUE(feed_at(hub, wire, 0.1));
        asked += 0.1;
        ASSERT_NEAR(wire.inserted_length(), asked, 1e-9);
        ASSERT_TRUE(validate(wire).empty()) << validate(wire).front();
        ASSERT_LE(relative_gradient(wire, all_contacts(wire, vessel.wall)), 2e-8);
        largest = std::max(largest, (wire.tip() - tip).norm());
        tip = wire.tip();
    }
    EXPECT_LE(largest, 0.3);
}

TEST(Hub, LosesNothingWhereTheHandTurnsRound) {
    InSmoothVessel at(90);
    auto& [vessel, hub, wire] = at;
    ASSERT_TRUE(feed_at(hub, wire, 7.3));
    const Vec3 tip = wire.tip();
    ASSERT_TRUE(feed_at(hub, wire, 5.1));
    ASSERT_TRUE(feed_at(hub, wire, -5.1));
    EXPECT_LE((wire.tip() - tip).norm(), 0.05);
    EXPECT_NEAR(wire.inserted_length(), 97.3, 1e-9);
}

TEST(Hub, SegmentsDependOnTheLengthAloneHoweverItWasFed) {
    const SmoothVessel vessel = smooth_vessel();
    std::mt19937 random(11);
    for (int trial = 0; trial < 6; ++trial) {
        const double lambda = 0.7 + 0.4 * trial;
        Hub hub({}, vessel.wall);
        const double start = 2 * lambda + 30;
        Chain wire = wire_of_length(tipped(lambda), vessel.line, start);
        hub.settle(wire, all_it_takes);
        double asked = start;
        for (int k = 0; k < 60; ++k) {
            const double mm = 6 * (random() / 4294967296.0) - 2.4;
            ASSERT_TRUE(feed_at(hub, wire, mm)) << "trial " << trial << ", motion " << k;
            asked += mm;
            ASSERT_NEAR(wire.inserted_length(), asked, 1e-9);
            const Chain fresh = wire_of_length(tipped(lambda), vessel.line, asked);
            ASSERT_EQ(wire.segments(), fresh.segments()) << "trial " << trial << ", motion " << k;
            for (int i = 1; i <= wire.segments(); ++i) ASSERT_NEAR(wire.lengths[i], fresh.lengths[i], 1e-9);
            for (int i = 0; i < wire.segments(); ++i) {
                ASSERT_NEAR(wire.devices[0].rest[i].angle, fresh.devices[0].rest[i].angle, 1e-9);
                ASSERT_NEAR(wire.rigidity[i], fresh.rigidity[i], 1e-6 * fresh.rigidity[i]);
            }
        }
    }
}

TEST(Hub, WithdrawsToTwoSegmentsAndNoFarther) {
    InSmoothVessel at(30);
    auto& [vessel, hub, wire] = at;
    for (int k = 0; k < 40; ++k) hub.move(wire, {-2, 0}, all_it_takes);
    EXPECT_NEAR(wire.inserted_length(), least_length(wire.grid), 1e-9);
    EXPECT_EQ(hub.move(wire, {-2, 0}, all_it_takes).made.feed, 0);
    EXPECT_TRUE(validate(wire).empty());
}

TEST(Hub, GoesOnWhereItsBudgetEndedAndComesToTheSameRest) {
    const SmoothVessel vessel = smooth_vessel();
    Hub hub({}, vessel.wall), other({}, vessel.wall);
    Chain wire = wire_of_length(tipped(2), vessel.line, 120);
    hub.settle(wire, all_it_takes);
    Chain whole = wire;
    other.settle(whole, all_it_takes);
    HubReport report = hub.move(wire, {0, Hub::largest_turn}, 1);
    ASSERT_EQ(report.outcome, Outcome::Working);
    int calls = 0;
    for (; hub.working() && calls < 100; ++calls) report = hub.resume(wire, 1);
    EXPECT_EQ(report.outcome, Outcome::AtRest);
    EXPECT_GT(calls, 1);
    EXPECT_NEAR(report.made.turn, Hub::largest_turn, 1e-12);
    other.move(whole, {0, Hub::largest_turn}, all_it_takes);
    for (int i = 0; i <= wire.segments(); ++i) ASSERT_LT((wire.joints[i] - whole.joints[i]).norm(), 1e-5);
}

TEST(Hub, RefusesWhatLeadsThroughTheWallAndLeavesTheWireAsItWas) {
    BeforeAWeakBend at;
    auto& [line, wall, hub, wire] = at;
    bool refused = false;
    for (int k = 0; k < 40 && !refused; ++k) {
        const Chain before = wire;
        refused = !feed_at(hub, wire, 1);
        const auto contacts = all_contacts(wire, wall);
        ASSERT_LE(largest_penetration(contacts), 2.0);
        ASSERT_LE(relative_gradient(wire, contacts), 2e-8);
        if (refused) {
            EXPECT_LE(wire.inserted_length(), before.inserted_length() + 1);
        }
    }
    EXPECT_TRUE(refused);
}

/// A frictionless wire in a straight closed tube buckles into waves and then into a helix, which turns
/// freely: a direction without curvature, in which the gradient stayed at 1e-4 to 1e-8 and every push was
/// refused.
TEST(Hub, PushesAWireThroughTheOnsetOfItsHelix) {
    const TubeWall wall({{0, 0, 0}, {300, 0, 0}}, 1, 50);
    Hub hub({}, wall);
    Chain wire = wire_of_length(studies::PlainWire::uniform(50, 2), {{0, 0, 0}, {300, 0, 0}}, 296);
    hub.settle(wire, all_it_takes);
    for (int k = 0; k < 60; ++k) {
        const HubReport report = hub.move(wire, {1, 0}, all_it_takes);
        ASSERT_EQ(report.outcome, Outcome::AtRest) << "push " << k;
        ASSERT_LE(relative_gradient(wire, all_contacts(wire, wall)), 2e-8) << "push " << k;
    }
    EXPECT_GT(wire.inserted_length(), 310);
}

TEST(Hub, RefusesTheSameAgainWithoutWorkUntilTheWireHasMoved) {
    BeforeAWeakBend at;
    auto& [line, wall, hub, wire] = at;
    HubReport report;
    for (int k = 0; k < 40 && report.outcome == Outcome::AtRest; ++k)
        report = hub.move(wire, {1, 0}, all_it_takes);
    ASSERT_EQ(report.outcome, Outcome::Refused);
    EXPECT_GT(report.relax.newton_steps, 0);
    EXPECT_LE(report.relax.updates, Hub::most_work(wire, {1, 0}) + 7 * Hub::least_updates(wire));
    const std::vector<Vec3> tangents = wire.tangents;
    for (const double feed : {1.0, 0.5, 0.04}) {
        report = hub.move(wire, {feed, 0}, all_it_takes);
        EXPECT_EQ(report.outcome, Outcome::Refused) << feed;
        EXPECT_EQ(report.relax.updates, 0) << feed;
        EXPECT_EQ(wire.tangents, tangents);
    }
    EXPECT_EQ(hub.move(wire, {-1, 0}, all_it_takes).outcome, Outcome::AtRest);
    EXPECT_GT(hub.move(wire, {2, 0}, all_it_takes).relax.updates, 0);
}

TEST(Hub, EveryPushIsBoundedByTheShaftOutside) {
    const TubeWall wall({{0, 0, 0}, {100, 0, 0}}, 1, 50);
    const double most = euler_force(40, 100);
    EXPECT_NEAR(most, 0.158, 0.001);
    Hub hub({}, wall);
    hub.bear(0, most);
    Chain wire = wire_of_length(studies::PlainWire::uniform(40, 2), {{0, 0, 0}, {100, 0, 0}}, 96);
    hub.settle(wire, all_it_takes);
    bool buckled = false;
    for (int k = 0; k < 40; ++k) {
        buckled = hub.move(wire, {1, 0}, all_it_takes).buckled || buckled;
        EXPECT_LE(hub.loads()[0].push, most);
    }
    EXPECT_TRUE(buckled);
    // A shaft that bears more takes up what was refused.
    const double inside = wire.inserted_length();
    EXPECT_EQ(hub.move(wire, {1, 0}, all_it_takes).outcome, Outcome::Refused);
    hub.bear(0, 4 * most);
    EXPECT_EQ(hub.move(wire, {1, 0}, all_it_takes).outcome, Outcome::AtRest);
    EXPECT_GT(wire.inserted_length(), inside);
    Hub other({}, wall);
    wire.devices[0].spec.buckling_force = 0.1;
    EXPECT_EQ(other.passes_on(wire), 0.1);
    EXPECT_EQ(Hub({}, wall).passes_on(uniform_wire(40, 2, Vec3::Zero(), Vec3::UnitX(), {Vec3::UnitX()})),
              std::numeric_limits<double>::infinity());
}

TEST(Hub, AShaftBowsByTheLoadThatIsReported) {
    const SmoothVessel vessel = smooth_vessel();
    std::mt19937 random(7);
    int pushed = 0;
    for (int round = 0; round < 40; ++round) {
        studies::PlainWire spec = tipped(2);
        spec.friction = round % 2 == 0 ? 0.2 : 0;
        Chain wire = wire_of_length(spec, vessel.line, 30 + 2 * round);
        Hub hub({}, vessel.wall);
        hub.settle(wire, all_it_takes);
        start_grips(wire);
        hub.settle(wire, all_it_takes);
        for (int part = 0; part < 5; ++part) {
            const auto state = state_of(hub);
            const Chain before = wire;
            const HubMotion motion = {0.2 + 0.8 * std::ldexp(static_cast<double>(random()), -32), 0};
            const HubReport report = hub.move(wire, motion, all_it_takes);
            if (report.outcome != Outcome::AtRest || report.made.feed != motion.feed) continue;
            ASSERT_EQ(hub.loads().size(), 1u);
            const double push = hub.loads()[0].push;
            if (!(push > 0)) continue;
            ++pushed;
            // The same push bows a shaft that bears the least bit less, and no other.
            for (const double limit : {push, std::nextafter(push, 0.0)}) {
                Hub again({}, vessel.wall);
                restore_state(again, state);
                Chain other = before;
                other.devices[0].spec.buckling_force = limit;
                EXPECT_EQ(again.move(other, motion, all_it_takes).buckled, limit < push)
                    << "round " << round << ", part " << part;
            }
        }
    }
    EXPECT_GT(pushed, 50);
}

TEST(Hub, ReportsNoLoadOfAWireOnItsWay) {
    InSmoothVessel at(60);
    auto& [vessel, hub, wire] = at;
    ASSERT_EQ(hub.loads().size(), 1u);
    const HubReport report = hub.move(wire, {1, 0}, 1);
    ASSERT_EQ(report.outcome, Outcome::Working);
    EXPECT_TRUE(hub.loads().empty());
    const HubReport later = hub.resume(wire, all_it_takes);
    ASSERT_EQ(later.outcome, Outcome::AtRest);
    EXPECT_EQ(hub.loads()[0].push, hub_loads(wire, hub.contacts())[0].push);
    EXPECT_EQ(hub.loads()[0].torque, hub_loads(wire, hub.contacts())[0].torque);
}
