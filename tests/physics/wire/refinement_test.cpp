#include "physics/wire/refinement.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "physics/relax/relaxer.h"
#include "physics/wire/energy.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

/// The scene's wire at rest, with λ as the scene has it.
SceneSetup at_rest(const char* scene) {
    SceneSetup setup = scene_setup(scene);
    global_relaxer(setup.wall)->relax(setup.wire, unlimited);
    return setup;
}

/// A real wire, soft and curved at its tip, in a wide straight tube.
SceneSetup in_straight_tube(int segments) {
    const Polyline centreline = {{-5, 0, 0}, {2000, 0, 0}};
    return {TubeWall(centreline, 4, 42),
            wire_along(studies::PlainWire{}, {{0, 0, 0}, {2000, 0, 0}}, segments)};
}

double distance_to(const Chain& wire, const Vec3& x) {
    double nearest = 1e9;
    for (int i = 1; i <= wire.segments(); ++i) {
        const Vec3 from = x - wire.joints[i - 1];
        const double along = std::clamp(from.dot(wire.tangents[i]), 0.0, wire.lengths[i]);
        nearest = std::min(nearest, (from - along * wire.tangents[i]).norm());
    }
    return nearest;
}

/// Distance of the farthest joint of `fine` from the curve of `wire` [mm].
double curve_error(const Chain& fine, const Chain& wire) {
    double farthest = 0;
    for (const Vec3& x : fine.joints) farthest = std::max(farthest, distance_to(wire, x));
    return farthest;
}

void expect_sound(const Chain& wire, const RefinementOptions& options = {}) {
    EXPECT_TRUE(validate(wire).empty());
    const double lambda = wire.grid.segment_length;
    double from_end = 0;
    for (int i = wire.segments(); i >= 1; --i) {
        const double units = wire.lengths[i] / lambda;
        EXPECT_EQ(std::exp2(std::round(std::log2(units))), units);
        EXPECT_LE(units, options.longest);
        if (i > 1) {
            EXPECT_LE(wire.lengths[i], 2 * wire.lengths[i - 1]) << i;
            EXPECT_LE(wire.lengths[i - 1], 2 * wire.lengths[i]) << i;
        }
        if (from_end < wire.devices[0].spec.sections[0].length + options.fine_length) {
            EXPECT_EQ(wire.lengths[i], lambda) << i;
        }
        from_end += wire.lengths[i];
        // The mean of 1/EI along the joint, more of it near the joint.
        double give = 0, weights = 0;
        const double distal = wire.lengths[i], proximal = i > 1 ? wire.lengths[i - 1] : 0;
        for (double s = -distal + 0.005; s < proximal; s += 0.01) {
            const double weight = 1 - std::abs(s) / (s < 0 ? distal : proximal);
            give += weight / rigidity_at(wire.devices[0].spec, from_end + s);
            weights += weight;
        }
        // Where lengths change, the taper within a segment counts: λ/12 of it at most.
        EXPECT_NEAR(wire.rigidity[i - 1], weights / give, 1e-2 * wire.rigidity[i - 1]) << i;
    }
    EXPECT_EQ(wire.lengths[1], lambda);
}

/// A floor at y = 0 with a ridge across it at `at`, too narrow for coarse segments to see with their ends.
class RidgedFloor final : public LumenWall {
public:
    explicit RidgedFloor(double at) : at_(at) {}
    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        for (std::size_t i = 0; i < joints.size(); ++i) {
            const double ridge = std::exp(-0.5 * std::pow(joints[i].x() - at_, 2));
            contacts[i].penetration = ridge - joints[i].y();
            contacts[i].normal = -Vec3::UnitY();
            contacts[i].stiffness = 42;
            contacts[i].trust = 0;
        }
    }

private:
    double at_;
};

}  // namespace

TEST(Refinement, CoarsensAStraightWireToItsLongestSegments) {
    auto [wall, wire] = in_straight_tube(500);
    const double length = wire.inserted_length();
    const RefinementReport report = refine(wire, wall);
    expect_sound(wire);
    EXPECT_EQ(wire.inserted_length(), length);
    EXPECT_EQ(wire.segments(), 500 - report.merged);
    EXPECT_EQ(std::count(wire.lengths.begin(), wire.lengths.end(), 32.0), 28);  // 16 λ, from 32 to 928 mm
    EXPECT_LT((wire.tip() - in_straight_tube(500).wire.tip()).norm(), 1e-9);
}

TEST(Refinement, KeepsTheTurnsOfAHairpinFine) {
    auto [wall, wire] = at_rest("hairpin");
    refine(wire, wall);
    expect_sound(wire);
    EXPECT_LT(wire.segments(), 100);
    // The first turn, of radius 8 mm, lies from 30 to 54 mm: two λ would sag by 0.06 mm.
    double from_base = 0;
    for (int i = 1; i <= wire.segments(); ++i) {
        if (from_base > 34 && from_base < 50) {
            EXPECT_EQ(wire.lengths[i], 1.0) << from_base;
        }
        from_base += wire.lengths[i];
    }
}

TEST(Refinement, KeepsTheCurveWithinTheToleranceAndTheLengthExactly) {
    for (const char* scene : {"sinuous", "spatial", "hairpin", "stiffwall"}) {
        auto [wall, wire] = at_rest(scene);
        const Chain fine = wire;
        const double before = largest_penetration(all_contacts(wire, wall));
        refine(wire, wall);
        expect_sound(wire);
        EXPECT_LT(wire.segments(), fine.segments() - 15) << scene;
        EXPECT_EQ(wire.inserted_length(), fine.inserted_length());
        EXPECT_LT(curve_error(fine, wire), 0.05) << scene;
        EXPECT_LT(largest_penetration(all_contacts(wire, wall)), before + 0.05) << scene;
    }
}

TEST(Refinement, ASecondCallChangesNothing) {
    for (const char* scene : {"sinuous", "spatial", "hairpin"}) {
        auto [wall, wire] = at_rest(scene);
        refine(wire, wall);
        const Chain once = wire;
        const RefinementReport report = refine(wire, wall);
        EXPECT_EQ(report.split + report.merged, 0) << scene;
        EXPECT_EQ(wire.joints, once.joints);
    }
}

TEST(Refinement, RestOfAPushedWireStaysWithinTheToleranceOfTheFineWires) {
    RefinementOptions finest{.longest = 1};
    for (const char* scene : {"sinuous", "hairpin"}) {
        auto [wall, fine] = scene_setup(scene);
        const int segments = fine.segments();
        fine = wire_along(fine.devices[0].spec, fine.grid, wall.centreline(), 20);
        Chain wire = fine;
        const auto fines = global_relaxer(wall), coarses = global_relaxer(wall);
        while (fine.segments() < segments) {
            move(fine, fine.grid.segment_length);
            fines->relax(fine, unlimited);
            refine(wire, wall);
            move(wire, wire.grid.segment_length);
            ASSERT_TRUE(coarses->relax(wire, unlimited).converged()) << scene << fine.segments();
            if (fine.segments() % 10 != 0) continue;
            // The fine wire of the same rest: where there is one rest alone, it is `fine`. From 112 mm on the
            // hairpin has two, strict minima 0.01 mm apart whose energies differ by 7e-6 of 13 N mm, a
            // thousandth of what coarse segments change them by: rounding chooses. Between the two next to
            // nothing resists, and there the coarse wire lies off by 0.075 mm.
            Chain split = wire;
            refine(split, wall, finest);
            ASSERT_TRUE(global_relaxer(wall)->relax(split, unlimited).strict_minimum()) << scene;
            ASSERT_NEAR(energy_of(split, wall), energy_of(fine, wall), 1e-6 * energy_of(fine, wall)) << scene;
            const bool one_rest = curve_error(fine, split) < 1e-3;
            EXPECT_LT(curve_error(fine, wire), one_rest ? 0.05 : 0.1) << scene << " " << fine.segments();
        }
        refine(wire, wall);
        expect_sound(wire);
        EXPECT_LT(wire.segments(), 0.8 * segments) << scene;
    }
}

TEST(Refinement, ThePapersRelaxerFindsTheSameRest) {
    auto [wall, wire] = at_rest("hairpin");
    refine(wire, wall);
    Chain other = wire;
    global_relaxer(wall)->relax(wire, unlimited);
    paper_relaxer(wall)->relax(other, whole_cycles(other.segments(), 60));
    EXPECT_LT(curve_error(wire, other), 0.02);
}

TEST(Refinement, SplitsAgainWhereTheWireBends) {
    auto [wall, wire] = in_straight_tube(200);
    refine(wire, wall);
    const int coarse = wire.segments();
    for (int i = coarse / 3; i <= coarse; ++i) wire.tangents[i] = Vec3(0.98, 0.02 * std::sqrt(99.0), 0);
    for (Vec3& u : wire.tangents) u.normalize();
    rebuild_joints(wire);
    const RefinementReport report = refine(wire, TubeWall(wall.centreline(), 400, 42));
    EXPECT_GT(report.split, 3);
    expect_sound(wire);
}

TEST(Refinement, CoarsenedAndSplitBackTheWireIsWhereItWas) {
    auto [wall, wire] = at_rest("sinuous");
    const Chain fine = wire;
    refine(wire, wall);
    ASSERT_LT(wire.segments(), fine.segments());
    RefinementOptions finest{.longest = 1};
    refine(wire, wall, finest);
    ASSERT_EQ(wire.segments(), fine.segments());
    EXPECT_EQ(wire.lengths, fine.lengths);
    EXPECT_LT(farthest_apart(wire, fine), 0.05);
}

TEST(Refinement, SeesARidgeBetweenTheEndsOfASegment) {
    auto [wall, wire] = in_straight_tube(200);
    Chain flat = wire;
    refine(wire, RidgedFloor(203));
    refine(flat, RidgedFloor(1e9));
    const auto nearest_to_ridge = [](const Chain& w) {
        double nearest = 1e9;
        for (const Vec3& x : w.joints) nearest = std::min(nearest, std::abs(x.x() - 203));
        return nearest;
    };
    EXPECT_GT(nearest_to_ridge(flat), 10);
    EXPECT_LE(nearest_to_ridge(wire), 2);
    expect_sound(wire);
}

TEST(Refinement, AMirroredWireIsRefinedAsItsImage) {
    auto [wall, wire] = at_rest("spatial");
    Polyline path = wall.centreline();
    Chain image = wire;
    for (auto* points : {&path, &image.joints, &image.tangents})
        for (Vec3& p : *points) p.z() = -p.z();
    refine(wire, wall);
    refine(image, TubeWall(path, wall.radius(), 42));
    ASSERT_EQ(wire.segments(), image.segments());
    for (int i = 0; i <= wire.segments(); ++i) {
        const Vec3 back(image.joints[i].x(), image.joints[i].y(), -image.joints[i].z());
        EXPECT_LT((wire.joints[i] - back).norm(), 1e-11);
    }
}

TEST(Refinement, WithdrawsIntoACoarseStretch) {
    auto [wall, wire] = in_straight_tube(200);
    refine(wire, wall);
    for (int k = 1; k <= 150; ++k) {
        ASSERT_TRUE(move(wire, -wire.grid.segment_length));
        ASSERT_NEAR(wire.inserted_length(), 400 - 2 * k, 1e-9);
        ASSERT_TRUE(validate(wire).empty());
        if (k % 10 == 0) {
            refine(wire, wall);
            expect_sound(wire);
        }
    }
    EXPECT_EQ(move(wire, -400), -48);
    EXPECT_EQ(wire.segments(), 2);
}

TEST(Refinement, HoldsTheTipsRollToLessThanADegree) {
    Chain wire = bent_wire(60, 0.8);
    const TubeWall wall({{0, 0, -500}, {0, 0, 500}}, 400, 42);
    for (int i = 1; i <= 60; ++i)  // a helix of 20 mm radius
        wire.tangents[i] = Vec3(std::cos(0.05 * i), std::sin(0.05 * i), 0.7).normalized();
    wire.tangents[0] = Vec3(1, 0, 0.7).normalized();
    Vec3 other;
    tangent_basis(wire.tangents[0], wire.base_director, other);
    rebuild_joints(wire);
    const Vec3 before = directors(wire).back();
    RefinementOptions options{.curve_tolerance = 0.2};
    EXPECT_GT(refine(wire, wall, options).merged, 10);
    EXPECT_LT(std::acos(std::min(1.0, before.dot(directors(wire).back()))), M_PI / 180);
}

TEST(Refinement, TheSegmentThatGrowsCountsAsOneWhateverItsLength) {
    std::mt19937 random(4);
    for (int k = 0; k < 300; ++k) {
        SceneSetup setup = in_straight_tube(60);
        Chain& wire = setup.wire;
        const int grows = wire.growing();
        // From half of it to one and a half, most often at the ends of that range.
        const double edge = k % 3 == 0 ? 0.5 : k % 3 == 1 ? 1.5 : 1.0;
        const double off = std::ldexp(static_cast<double>(random()), -31) - 1;
        wire.lengths[grows] = wire.grid.segment_length * (edge + off * std::pow(10.0, -1 - k % 15));
        if (edge != 1 && wire.lengths[grows] < 0.5 * wire.grid.segment_length * (1 - 1e-6)) continue;
        wire.devices[0].inserted = wire.inserted_length();
        rebuild_joints(wire);
        assign(wire);
        const double length = wire.inserted_length(), growing = wire.lengths[grows];
        refine(wire, setup.wall, {});
        EXPECT_NEAR(wire.inserted_length(), length, 1e-9) << k;
        EXPECT_EQ(wire.lengths[wire.growing()], growing) << k;
        EXPECT_LT(wire.segments(), 60) << k;
    }
}

TEST(Refinement, ListsEverythingWrongWithItsOptions) {
    EXPECT_TRUE(problems(RefinementOptions{}).empty());
    EXPECT_EQ(problems(RefinementOptions{0, 12, -1}).size(), 3u);
    EXPECT_EQ(problems(RefinementOptions{std::nan(""), 0, std::nan("")}).size(), 3u);
}
