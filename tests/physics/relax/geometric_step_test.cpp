#include "physics/relax/geometric_step.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "physics/relax/relaxer.h"
#include "physics/wire/bending.h"
#include "physics/wire/energy.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

/// The bending of three segments of a wire, their neighbours fixed.
SegmentProblem bending_of(const Chain& wire, int first, int count = 3) {
    SegmentProblem p;
    p.count = count;
    for (auto& row : p.curvature) row.fill(Mat3::Zero());
    for (int m = 0; m < count; ++m) {
        const BendingTerms terms = bending_terms(wire, {}, {}, first + m);
        p.tangent[m] = wire.tangents[first + m];
        p.pull[m] = terms.pull;
        p.curvature[m][m] = terms.curvature;
        if (m == 0) continue;
        p.curvature[m - 1][m] = neighbour_curvature(wire, first + m - 1);
        p.curvature[m][m - 1] = p.curvature[m - 1][m].transpose();
    }
    return p;
}

std::array<double, 3> lengths_of(const Chain& wire, int first) {
    return {wire.lengths[first], wire.lengths[first + 1], wire.lengths[first + 2]};
}

Vec3 chord(const std::array<double, 3>& lengths, const GeometricStep::Tangents& v) {
    return lengths[0] * v[0] + lengths[1] * v[1] + lengths[2] * v[2];
}

/// A bent wire whose segments are of several lengths.
Chain uneven_wire() {
    Chain wire = bent_wire(24, 0.0);
    for (const int i : {4, 9, 10, 17}) split_segment(wire, i, 0.3);
    return wire;
}

double energy_with(Chain wire, int first, int count, const GeometricStep::Tangents& v) {
    for (int m = 0; m < count; ++m) wire.tangents[first + m] = v[m];
    return bending_energy(wire);
}

}  // namespace

TEST(NeighbourCurvature, IsTheMixedSecondDerivativeOfTheBending) {
    // Eq. 1 with both segments of a joint varied: quadratic in ε_i, ε_j but for terms of third order.
    const Chain wire = bent_wire(12, 0.0);
    const Mat3 mixed = neighbour_curvature(wire, 5);
    const auto energy = [&](const Vec3& di, const Vec3& dj) {
        const double c = wire.spring_constant(5), k = (wire.tangents[5] + di).dot(wire.tangents[6] + dj);
        return c / 12 * (13 - 14 * k + k * k);
    };
    const double h = 1e-3;
    for (int r = 0; r < 3; ++r)
        for (int s = 0; s < 3; ++s) {
            const Vec3 a = h * Vec3::Unit(r), b = h * Vec3::Unit(s);
            const double difference = energy(a, b) - energy(a, -b) - energy(-a, b) + energy(-a, -b);
            EXPECT_NEAR(mixed(r, s), difference / (4 * h * h), 1e-5 * wire.spring_constant(5));
        }
}

TEST(GeometricStep, LeavesBothEndsOfAPieceOfUnequalSegmentsWhereTheyAre) {
    const Chain wire = uneven_wire();
    for (int first = 1; first + 2 <= wire.segments(); ++first) {
        const auto lengths = lengths_of(wire, first);
        const SegmentProblem p = bending_of(wire, first);
        const GeometricStep step(p, lengths, true);
        for (const double fraction : {1.0, 0.4, 0.01}) {
            const auto v = step.turned(fraction, 0.1);
            ASSERT_TRUE(v) << first;
            EXPECT_LT((chord(lengths, *v) - chord(lengths, p.tangent)).norm(), 1e-14) << first;
            for (int m = 0; m < 3; ++m) {
                EXPECT_NEAR((*v)[m].norm(), 1, 1e-14);
                EXPECT_LE(((*v)[m] - p.tangent[m]).norm(), 0.1);
            }
        }
    }
}

TEST(GeometricStep, LowersTheEnergyAndEndsWhereItsSlopeVanishes) {
    Chain wire = uneven_wire();
    const int first = 9;
    const auto lengths = lengths_of(wire, first);
    double before = bending_energy(wire);
    const double start = before;
    for (int k = 0; k < 60; ++k) {
        const auto v = GeometricStep(bending_of(wire, first), lengths, true).turned(1, 0.05);
        if (!v) break;
        const double after = energy_with(wire, first, 3, *v);
        ASSERT_LE(after, before * (1 + 1e-14)) << k;
        for (int m = 0; m < 3; ++m) wire.tangents[first + m] = (*v)[m];
        before = after;
    }
    EXPECT_LT(before, 0.999 * start);
    // No turn that keeps the closure to first order lowers the energy: dU/du is normal to them all, λ_m μ.
    const SegmentProblem p = bending_of(wire, first);
    Mat3 square = Mat3::Zero();
    Vec3 sum = Vec3::Zero();
    for (int m = 0; m < 3; ++m) {
        const Mat3 across = Mat3::Identity() - p.tangent[m] * p.tangent[m].transpose();
        square += lengths[m] * lengths[m] * across;
        sum += lengths[m] * (across * p.pull[m]);
    }
    const Vec3 mu = square.ldlt().solve(sum);
    for (int m = 0; m < 3; ++m) {
        const Vec3 left = p.pull[m] - lengths[m] * mu;
        EXPECT_LT(left.cross(p.tangent[m]).norm(), 1e-7 * p.pull[m].norm());
    }
}

TEST(GeometricStep, AStretchedPieceStays) {
    const Chain wire = uniform_wire(50, 1, {0, 0, 0}, {1, 0, 0}, std::vector<Vec3>(6, Vec3::UnitX()));
    SegmentProblem p = bending_of(wire, 2);
    p.pull[0] += Vec3(0, 3, 0);  // pushed aside, but as long as its chord
    const auto v = GeometricStep(p, {1, 1, 1}, true).turned(1, 0.1);
    if (v) {
        for (int m = 0; m < 3; ++m) EXPECT_LT(((*v)[m] - Vec3::UnitX()).norm(), 1e-6);
    }
}

TEST(GeometricRelaxer, MovesOnlyThePieceThatItUpdates) {
    auto [wall, start] = scene_setup("hairpin");
    Chain wire = wire_along(start.devices[0].spec, start.grid, wall.centreline(), 70);
    RelaxerConfig config = of_kind(RelaxerKind::Geometric);
    Chain last = wire;
    bool moved = false;
    make_relaxer(config, wall)->relax(wire, {1500, 0, 0}, [&](int first, const Chain& now) {
        for (int i = 0; i <= 70; ++i) {
            if (i >= first && i <= (first + 2 <= 70 ? first + 1 : 70)) {
                moved = moved || now.joints[i] != last.joints[i];
                continue;
            }
            ASSERT_LT((now.joints[i] - last.joints[i]).norm(), 1e-12) << first << " " << i;
        }
        last = now;
    });
    EXPECT_TRUE(moved);
    EXPECT_TRUE(validate(wire).empty());
}

TEST(GeometricRelaxer, EnergyNeverRisesAloneOrCombinedForUnequalSegmentsToo) {
    for (const RelaxerKind kind : {RelaxerKind::Geometric, RelaxerKind::Combined})
        for (const bool uneven : {false, true}) {
            const SceneSetup scene = scene_setup("hairpin");
            const TubeWall& wall = scene.wall;
            Chain wire = wire_along(scene.wire.devices[0].spec, scene.wire.grid, wall.centreline(), 60);
            if (uneven)
                for (int i = 40; i > 8; i -= 3) split_segment(wire, i, 0.35);
            rebuild_joints(wire);
            RelaxerConfig config = of_kind(kind);
            const auto relaxer = make_relaxer(config, wall);
            const auto energy = [&] { return total_energy(wire, all_contacts(wire, wall)).total(); };
            const double begin = energy();
            double last = begin;
            for (int k = 0; k < 20; ++k) {
                relaxer->relax(wire, {300, 0, 0});
                const double now = energy();
                ASSERT_LE(now, last * (1 + 1e-12)) << uneven << " " << k;
                last = now;
            }
            EXPECT_LT(last, 0.97 * begin);
            EXPECT_TRUE(validate(wire).empty());
        }
}
