#include "physics/relax/segment_step.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

using namespace physics;

namespace {

/// A problem as the relaxer poses it: positive curvature, pulls near the tangents, coupled segments.
SegmentProblem random_problem(int count, unsigned seed, double wall = 1.0) {
    std::mt19937 random(seed);
    auto unit = [&] { return random() / 2147483648.0 - 1.0; };
    auto vector = [&] { return Vec3(unit(), unit(), unit()); };
    SegmentProblem p;
    p.count = count;
    std::array<Mat3, most_varied_segments> tail;  // R₍m,N₎: grows towards the proximal end
    Mat3 sum = Mat3::Zero();
    for (int m = count - 1; m >= 0; --m) {
        for (int k = 0; k < 3; ++k) {
            const Vec3 n = vector().normalized();
            sum += wall * n * n.transpose();
        }
        tail[m] = sum;
    }
    for (int m = 0; m < count; ++m) {
        p.tangent[m] = vector().normalized();
        p.pull[m] = 3 * (p.tangent[m] + 0.3 * vector());
        for (int n = 0; n < count; ++n) p.curvature[m][n] = tail[std::max(m, n)];
        const Vec3 a = vector();
        p.curvature[m][m] += 0.3 * a * a.transpose();
    }
    return p;
}

/// The paper's own form: Newton–Raphson on Eqs. 26, 32, 33 with 4M unknowns v_m, σ_m.
SegmentSolution oracle(const SegmentProblem& p, int iterations) {
    SegmentSolution s;
    for (int m = 0; m < p.count; ++m) {
        s.multiplier[m] = p.pull[m].norm();
        s.tangent[m] = p.pull[m] / s.multiplier[m];
    }
    const int size = 4 * p.count;
    for (int k = 0; k < iterations; ++k) {
        Eigen::MatrixXd a = Eigen::MatrixXd::Zero(size, size);
        Eigen::VectorXd f(size);
        for (int m = 0; m < p.count; ++m) {
            Vec3 force = s.multiplier[m] * s.tangent[m] - p.pull[m];
            for (int n = 0; n < p.count; ++n) {
                a.block<3, 3>(3 * m, 3 * n) = p.curvature[m][n];
                force += p.curvature[m][n] * (s.tangent[n] - p.tangent[n]);
            }
            a.block<3, 3>(3 * m, 3 * m) += s.multiplier[m] * Mat3::Identity();
            a.block<3, 1>(3 * m, 3 * p.count + m) = s.tangent[m];
            a.block<1, 3>(3 * p.count + m, 3 * m) = s.tangent[m].transpose();
            f.segment<3>(3 * m) = force;
            f[3 * p.count + m] = 0.5 * (s.tangent[m].squaredNorm() - 1);
        }
        const Eigen::VectorXd step = a.fullPivLu().solve(-f);
        for (int m = 0; m < p.count; ++m) {
            s.tangent[m] = (s.tangent[m] + step.segment<3>(3 * m)).normalized();
            s.multiplier[m] += step[3 * p.count + m];
        }
    }
    return s;
}

}  // namespace

class SegmentStep : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(VariedSegments, SegmentStep, testing::Range(1, 6));

TEST_P(SegmentStep, TangentAndPrintedFormTakeTheIteratesOfThePapersFourMEquations) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        const SegmentProblem p = random_problem(GetParam(), seed);
        for (int iterations : {1, 2, 3, 6}) {
            const SegmentSolution theirs = oracle(p, iterations);
            for (const bool by_print : {false, true}) {
                const SegmentSolution ours =
                    by_print ? printed_step(p, iterations) : plain_step(p, iterations);
                for (int m = 0; m < GetParam(); ++m) {
                    EXPECT_LT((ours.tangent[m] - theirs.tangent[m]).norm(), 1e-12)
                        << seed << " " << iterations << (by_print ? " printed" : " tangent");
                    EXPECT_NEAR(ours.multiplier[m], theirs.multiplier[m],
                                1e-12 * std::abs(theirs.multiplier[m]) + 1e-12);
                }
            }
        }
        const SegmentSolution printed = printed_step(p), tangent = plain_step(p);
        EXPECT_TRUE(printed.converged && tangent.converged) << seed;
        for (int m = 0; m < GetParam(); ++m)
            EXPECT_LT((printed.tangent[m] - tangent.tangent[m]).norm(), 1e-12) << seed;
    }
}

TEST_P(SegmentStep, PrintedFormEndsInUnitVectorsWhateverTheProblem) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    for (unsigned seed = 1; seed <= 400; ++seed) {
        SegmentProblem p = random_problem(GetParam(), seed, std::pow(10, seed % 13 - 3.0));
        for (int m = 0; m < GetParam(); ++m) {
            if (seed % 3 == 0) p.pull[m] *= -1;
            if (seed % 5 == 0) p.pull[m].setZero();
            if (seed % 7 == 0) p.pull[m] *= 1e-200;
            if (seed % 11 == 0) p.pull[m] *= 1e150;
        }
        if (seed % 4 == 0)
            for (auto& row : p.curvature) row.fill(Mat3::Zero());
        if (seed % 17 == 0) p.curvature[0][0](0, 0) = none;
        const SegmentSolution s = printed_step(p);
        EXPECT_LE(s.iterations, 30);
        for (int m = 0; m < GetParam(); ++m) EXPECT_NEAR(s.tangent[m].norm(), 1, 1e-12) << seed;
        if (seed % 17 == 0) {
            EXPECT_FALSE(s.converged);
        }
    }
    // Nothing pulls and nothing bends: Eq. 33 is singular, and the segments stay as they are.
    SegmentProblem p = random_problem(GetParam(), 1);
    for (auto& row : p.curvature) row.fill(Mat3::Zero());
    for (Vec3& pull : p.pull) pull.setZero();
    const SegmentSolution s = printed_step(p);
    EXPECT_FALSE(s.converged);
    EXPECT_EQ(s.iterations, 0);
    for (int m = 0; m < GetParam(); ++m) EXPECT_EQ(s.tangent[m], p.tangent[m]);
}

TEST_P(SegmentStep, SolvesTheStationarityOfEq32) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        const SegmentProblem p = random_problem(GetParam(), seed);
        const SegmentSolution s = descending_step(p);
        EXPECT_TRUE(s.converged);
        for (int m = 0; m < GetParam(); ++m) {
            Vec3 slope = -p.pull[m];
            for (int n = 0; n < GetParam(); ++n) slope += p.curvature[m][n] * (s.tangent[n] - p.tangent[n]);
            EXPECT_LT(slope.cross(s.tangent[m]).norm(), 1e-10);
            EXPECT_NEAR(s.tangent[m].norm(), 1, 1e-14);
        }
    }
}

TEST_P(SegmentStep, DescendingFormAlwaysLowersTheModel) {
    // Violent: wall forces far above the bending, pulls against the tangents.
    for (unsigned seed = 1; seed <= 300; ++seed) {
        SegmentProblem p = random_problem(GetParam(), seed, 30.0);
        for (int m = 0; m < GetParam(); ++m)
            if (seed % 3 == 0) p.pull[m] *= -1;
        const SegmentSolution s = descending_step(p);
        EXPECT_LE(model_energy(p, s.tangent), 1e-12) << seed;
        for (int m = 0; m < GetParam(); ++m) EXPECT_TRUE(s.tangent[m].allFinite());
    }
}

TEST_P(SegmentStep, WithoutCurvatureBothFormsAreTheFirstOrderOne) {
    SegmentProblem p = random_problem(GetParam(), 3);
    for (auto& row : p.curvature) row.fill(Mat3::Zero());
    const SegmentSolution plain = plain_step(p), safe = descending_step(p);
    for (int m = 0; m < GetParam(); ++m) {
        EXPECT_LT((plain.tangent[m] - p.pull[m].normalized()).norm(), 1e-13);
        EXPECT_LT((safe.tangent[m] - p.pull[m].normalized()).norm(), 1e-8);
    }
}

TEST(SegmentStep, LeavesAnExactlyBalancedMaximum) {
    SegmentProblem p;
    p.count = 1;
    p.tangent[0] = Vec3::UnitX();
    p.pull[0] = -Vec3::UnitX();  // pushed back along itself: stationary, but the highest point
    p.curvature[0][0] = Mat3::Zero();
    const SegmentSolution s = descending_step(p);
    EXPECT_LT(model_energy(p, s.tangent), -1.9);
}

TEST(SegmentStep, BothFormsFindTheSameMinimumWhenCalm) {
    for (int count = 1; count <= 5; ++count)
        for (unsigned seed = 1; seed <= 20; ++seed) {
            SegmentProblem p = random_problem(count, seed, 0.1);
            for (int m = 0; m < count; ++m)
                p.pull[m] = 3 * p.tangent[m] + 0.1 * (p.pull[m] - 3 * p.tangent[m]);
            const SegmentSolution plain = plain_step(p), safe = descending_step(p);
            for (int m = 0; m < count; ++m) EXPECT_LT((plain.tangent[m] - safe.tangent[m]).norm(), 1e-9);
        }
}

TEST(SegmentStep, SmallTurnSolvesItsLinearSystemAndIsTheStepWhereTheTurnIsSmall) {
    // (σ + P) ε = q in the plane ⟂ u, then made unit.
    for (unsigned seed = 1; seed <= 20; ++seed) {
        const SegmentProblem p = random_problem(1, seed);
        const double sigma = 5;
        const Vec3 v = small_turn_step(p, sigma), u = p.tangent[0];
        const Vec3 e = v / v.dot(u) - u;
        const Vec3 left = sigma * e + p.curvature[0][0] * e - p.pull[0];
        EXPECT_LT(left.cross(u).norm(), 1e-12 * p.pull[0].norm());
        EXPECT_NEAR(e.dot(u), 0, 1e-14);
        EXPECT_NEAR(v.norm(), 1, 1e-14);
    }
    // For a pull that is nearly along the tangent it is the second-order step.
    SegmentProblem p = random_problem(1, 4);
    p.pull[0] = 3 * (p.tangent[0] + 1e-4 * Vec3(1, -2, 0.5));
    const double sigma = p.pull[0].dot(p.tangent[0]);
    EXPECT_LT((small_turn_step(p, sigma) - plain_step(p).tangent[0]).norm(), 1e-6);
}

TEST(LimitedTurn, TurnsByTheLimitExactly) {
    const Vec3 u = Vec3(1, 2, 3).normalized();
    for (const Vec3& v : {Vec3(3, -1, 0.2), Vec3(-1, -2, -2.9), Vec3(0, 1, -1)}) {
        for (double limit : {1e-6, 0.01, 0.1, 0.7}) {
            const double fraction = largest_fraction(u, v.normalized(), limit);
            EXPECT_GT(fraction, 0);
            EXPECT_LT(fraction, 1);
            EXPECT_NEAR((limited_turn(u, v.normalized(), fraction) - u).norm(), limit, 1e-9 * limit + 1e-14);
        }
    }
    EXPECT_EQ(largest_fraction(u, u, 0.1), 1.0);
}

TEST(LimitedTurn, HasAWayOutOfTheExactOpposite) {
    const Vec3 u = Vec3::UnitX();
    const Vec3 turned = limited_turn(u, -u, 0.5);
    EXPECT_NEAR(turned.norm(), 1, 1e-14);
    EXPECT_GT((turned - u).norm(), 0.1);
}
