#include "physics/wire/crossings.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "physics/relax/relaxer.h"
#include "physics/wire/energy.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

constexpr double precision = 0.026;  // of a depth: 0.02 mm, and what 0.01 mm of the way can add [mm]

/// All of space but a ridge |y| < x·tan(half angle) along z: a carina in wide vessels. Exact distances.
class Ridge final : public LumenWall {
public:
    explicit Ridge(double half_angle) : sine_(std::sin(half_angle)), cosine_(std::cos(half_angle)) {}

    double penetration(const Vec3& x) const { return contact(x).penetration; }
    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        for (std::size_t i = 0; i < joints.size(); ++i) {
            const double thickness = contacts[i].thickness;
            contacts[i] = contact(joints[i]);
            contacts[i].thickness = thickness;
            contacts[i].penetration += thickness;
            contacts[i].trust = std::max(0.0, -contacts[i].penetration);
        }
        asked += static_cast<int>(joints.size());
    }
    mutable int asked = 0;

private:
    WallContact contact(const Vec3& x) const {
        const double side = x.y() < 0 ? -1 : 1;
        WallContact c;
        c.normal = Vec3(sine_, -side * cosine_, 0);
        c.penetration = c.normal.dot(x);
        if (cosine_ * x.x() + side * sine_ * x.y() < 0) {  // before the edge
            const Vec3 from_edge(x.x(), x.y(), 0);
            c.penetration = -from_edge.norm();
            c.normal = -from_edge.normalized();
        }
        c.stiffness = 40;
        c.clearance = 4;
        c.trust = std::max(0.0, -c.penetration);
        return c;
    }
    double sine_, cosine_;
};

std::optional<Crossing> crossing(const LumenWall& wall, const Vec3& from, const Vec3& to) {
    return crossing_between(wall, from, to, ask(wall, from), ask(wall, to), 0.1);
}

/// Depth of the deepest of many points, over the ends' depth [mm].
double sampled_depth(const LumenWall& wall, const Vec3& from, const Vec3& to) {
    const double ends = std::max({0.0, ask(wall, from).penetration, ask(wall, to).penetration});
    double deepest = 0;
    for (int k = 0; k <= 400; ++k)
        deepest = std::max(deepest, ask(wall, from + k / 400.0 * (to - from)).penetration - ends);
    return deepest;
}

studies::PlainWire plain_spec(double segment_length) {
    return studies::PlainWire::uniform(50, segment_length);
}

/// The lumen is where |x| > 2.1 mm.
struct OtherVessel : LumenWall {
    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        for (std::size_t i = 0; i < joints.size(); ++i) {
            WallContact& c = contacts[i];
            c.penetration = 2.1 - std::abs(joints[i].x());
            c.normal = Vec3(joints[i].x() > 0 ? -1 : 1, 0, 0);
            c.stiffness = 10;
            c.clearance = 10;
            c.trust = std::max(0.0, -c.penetration);
        }
    }
    bool same_vessel(int a, int b) const override { return a == b; }
};
struct SameVessel : OtherVessel {
    bool same_vessel(int, int) const override { return true; }
};

/// A wire at rest against the tip of a ridge that it was laid across between two joints.
Chain across(const Ridge& ridge, double curved_angle = 0) {
    studies::PlainWire spec = plain_spec(2);
    spec.curved_length = curved_angle == 0 ? 0 : 12;
    spec.curved_angle = curved_angle;
    Chain wire = straight_wire(spec, {0.7, -13, 0}, {0, 1, 0}, 12);
    wire.base_director = -Vec3::UnitX();
    global_relaxer(ridge)->relax(wire, {100000, 0, 0});
    return wire;
}

}  // namespace

TEST(Crossings, AreFoundWhereTheyAreDeepest) {
    const Ridge ridge(0.4);
    const auto found = crossing(ridge, {0.7, -0.6, 0}, {0.7, 0.4, 0});
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->fraction, 0.6, 0.1);
    EXPECT_NEAR(found->depth, 0.7 * std::sin(0.4), precision);
}

TEST(Crossings, OfRandomChordsAreAllFoundAndNoneInvented) {
    std::mt19937 random(5);
    const auto unit = [&] { return random() / 2147483648.0 - 1.0; };
    int deep = 0;
    for (const double half_angle : {0.1, 0.3, 0.6, 1.2}) {
        const Ridge ridge(half_angle);
        for (int k = 0; k < 4000; ++k) {
            const Vec3 from(3 * unit(), 2 * unit(), unit());
            const Vec3 to = from + (1 + (k % 2)) * Vec3(unit(), unit(), unit()).normalized();
            const double depth = sampled_depth(ridge, from, to);
            const auto found = crossing(ridge, from, to);
            deep += depth > 0.1;
            EXPECT_TRUE(found || depth < 0.106) << depth;
            EXPECT_TRUE(!found || std::abs(found->depth - depth) < precision) << found->depth << " " << depth;
        }
    }
    EXPECT_GT(deep, 500);
}

TEST(Crossings, AskNothingOfAWireFarFromTheWallAndLittleOfOneOnIt) {
    Ridge ridge(0.3);
    Chain wire = straight_wire(plain_spec(1), {-3, 0, 0}, {0, 0, 1}, 300);
    auto contacts = all_contacts(wire, ridge);
    ridge.asked = 0;
    EXPECT_TRUE(crossings(wire, contacts, ridge).empty());
    EXPECT_EQ(ridge.asked, 0);
    wire = straight_wire(plain_spec(1), {1, 0.31, 0}, {0, 0, 1}, 300);  // along a flank
    contacts = all_contacts(wire, ridge);
    EXPECT_LT(std::abs(contacts[0].penetration), 0.05);
    ridge.asked = 0;
    EXPECT_TRUE(crossings(wire, contacts, ridge).empty());
    EXPECT_LE(ridge.asked, 300);
}

TEST(Crossings, ASegmentFromOneVesselIntoAnotherIsInEitherAsItHasMoved) {
    // Both ends touch; the first vessel has gone by 2 mm one way, the other one as far the other way.
    const OtherVessel wall;
    WallContact from, to;
    from.station = 0, to.station = 1;
    const Vec3 a(0, 0, 0), b(0, 0, 2);
    const auto contact = [&](const Vec3& x, int station, const Vec3& given) {
        WallContact c;
        c.station = station;
        const Vec3 y = x - given;
        wall.contacts({&y, 1}, {&c, 1});
        c.given = given;
        return c;
    };
    from = contact(a, 0, {2, 0, 0}), to = contact(b, 1, {-2, 0, 0});
    ASSERT_TRUE(from.touches() && to.touches());
    EXPECT_FALSE(crossing_between(wall, a, b, from, to));
    // The same ends in one vessel: between them it is where neither has it.
    const SameVessel one;
    EXPECT_TRUE(crossing_between(one, a, b, from, to));
}

TEST(Crossings, AJointAtEachMendsThem) {
    for (const double curved_angle : {0.0, 0.3}) {
        const Ridge ridge(0.3);
        Chain wire = across(ridge, curved_angle);
        auto found = crossings(wire, all_contacts(wire, ridge), ridge);
        ASSERT_FALSE(found.empty());
        const double before = found.front().depth, length = wire.inserted_length();
        for (int round = 0; round < 4 && !found.empty(); ++round) {
            ASSERT_GT(split_crossings(wire, found), 0);
            ASSERT_TRUE(validate(wire).empty());
            EXPECT_TRUE(global_relaxer(ridge)->relax(wire, {100000, 0, 0}).converged());
            found = crossings(wire, all_contacts(wire, ridge), ridge);
        }
        EXPECT_TRUE(found.empty());
        EXPECT_GT(before, 0.1);
        EXPECT_NEAR(wire.inserted_length(), length, 1e-12);
        for (int i = 1; i <= wire.segments(); ++i)
            EXPECT_LT(sampled_depth(ridge, wire.joints[i - 1], wire.joints[i]), 0.106);
    }
}

TEST(Crossings, SegmentsAreMadeWholeOnceTheyNoLongerCross) {
    const Ridge ridge(0.3);
    const Chain before = across(ridge, 0.3);
    Chain wire = before;
    const auto found = crossings(wire, all_contacts(wire, ridge), ridge);
    ASSERT_GT(split_crossings(wire, found), 0);
    ASSERT_GT(wire.segments(), before.segments());
    EXPECT_EQ(merge_pieces(wire, ridge), 0);  // still across
    for (Vec3& x : wire.joints) x.x() -= 5;
    EXPECT_GT(merge_pieces(wire, ridge), 0);
    EXPECT_EQ(wire.lengths, before.lengths);
    EXPECT_EQ(wire.rigidity, before.rigidity);
    for (int i = 0; i <= wire.segments(); ++i)
        EXPECT_NEAR(wire.devices[0].rest[i].angle, before.devices[0].rest[i].angle, 1e-12);
    for (int i = 1; i <= wire.segments(); ++i)
        EXPECT_LT((wire.tangents[i] - before.tangents[i]).norm(), 1e-12) << i;
}

TEST(Crossings, SegmentsAreShortBeforeTheyTouchAnEdgeAndStayShortUntilTheyAreClear) {
    // A straight wire that goes by the edge of a ridge, nearer and nearer, then away.
    const Ridge ridge(0.3);
    const double lambda = 2;
    const auto at = [&](double gap) {
        return straight_wire(plain_spec(lambda), {-gap, -13, 0}, {0, 1, 0}, 13);
    };
    Chain far = at(0.26 * lambda);
    EXPECT_EQ(split_before_edges(far, ridge), 0);
    Chain near = at(0.2 * lambda);
    ASSERT_GT(split_before_edges(near, ridge), 0);
    EXPECT_EQ(split_before_edges(near, ridge), 0);  // once is enough
    ASSERT_TRUE(validate(near).empty());
    double beside = 0;  // of the segment that goes over the edge
    for (int i = 1; i <= near.segments(); ++i)
        if (near.joints[i - 1].y() <= 0 && near.joints[i].y() > 0) beside = near.lengths[i];
    EXPECT_LE(beside, lambda / 2);
    EXPECT_EQ(merge_pieces(near, ridge), 0);
    Chain away = near;
    for (Vec3& x : away.joints) x.x() -= 0.15 * lambda;  // 0.35 λ off: farther than what is split
    EXPECT_EQ(merge_pieces(away, ridge), 0);
    for (Vec3& x : away.joints) x.x() -= 0.1 * lambda;
    EXPECT_GT(merge_pieces(away, ridge), 0);
    EXPECT_EQ(away.lengths, far.lengths);
}
