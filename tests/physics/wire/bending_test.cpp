#include "physics/wire/bending.h"

#include <cmath>
#include <gtest/gtest.h>

#include "tests/finite_difference.h"
#include "tests/physics/wires.h"

using namespace physics;

TEST(Bending, JointEnergyIsThePapersFormula) {
    for (double theta : {0.01, 0.1, 0.5, 1.0, 2.0, 3.1}) {
        const Vec3 u(1, 0, 0), v(std::cos(theta), std::sin(theta), 0);
        const double c = std::cos(theta);
        EXPECT_NEAR(joint_energy(50, u, v), 50.0 / 12 * (13 - 14 * c + c * c), 1e-12 * 50) << theta;
    }
}

TEST(Bending, KeepsItsDigitsWhereTheWireIsNearlyStraight) {
    const double theta = 1e-7;
    const Vec3 u(1, 0, 0), v(std::cos(theta), std::sin(theta), 0);
    EXPECT_NEAR(joint_energy(1, u, v) / (0.5 * theta * theta), 1, 1e-6);
}

TEST(Bending, ArcHasTheBeamsEnergy) {
    // EI L / 2R². With chords of the arc, and a chord before its first for the clamp, every joint stands for
    // a whole segment, as it does by the paper's rule: only the polynomial of Eq. 1 is off, by 3/1280 C θ⁶ a
    // joint, as λ⁴ in all.
    const double radius = 20, angle = 1.5, rigidity = 50;
    const double exact = rigidity * radius * angle / (2 * radius * radius);
    double last_error = 0;
    for (int n : {25, 50, 100}) {
        const double step = angle / n, lambda = 2 * radius * std::sin(step / 2);
        std::vector<Vec3> tangents;
        for (int i = 0; i < n; ++i)
            tangents.emplace_back(std::cos(step * (i + 0.5)), std::sin(step * (i + 0.5)), 0);
        const Vec3 clamped(std::cos(step / 2), -std::sin(step / 2), 0);
        const double error =
            bending_energy(uniform_wire(rigidity, lambda, Vec3::Zero(), clamped, tangents, EndCells::Paper)) /
                exact -
            1;
        EXPECT_LT(std::abs(error), 1e-7);
        if (last_error != 0) {
            EXPECT_NEAR(last_error / error, 16, 0.1);
        }
        last_error = error;
    }
}

TEST(Bending, ArcClampedAlongItsOwnTangentHasTheBeamsEnergyUpToHalfASegmentBeforeItsEnd) {
    // The first chord turns by half a step from the clamp, with twice the spring: a half cell. Each joint has
    // the energy of the wire it stands for, which ends half a segment before the tip. The first is off by
    // θ²/32 of its own, so by λ³ in all.
    const double radius = 20, angle = 1.5, rigidity = 50;
    double last_error = 0;
    for (int n : {25, 50, 100}) {
        const double step = angle / n, lambda = 2 * radius * std::sin(step / 2);
        const double exact = rigidity * (angle - step / 2) / (2 * radius);
        std::vector<Vec3> tangents;
        for (int i = 0; i < n; ++i)
            tangents.emplace_back(std::cos(step * (i + 0.5)), std::sin(step * (i + 0.5)), 0);
        const double error =
            bending_energy(uniform_wire(rigidity, lambda, Vec3::Zero(), Vec3::UnitX(), tangents)) / exact - 1;
        EXPECT_NEAR(error / (step * step * step / (64 * angle)), 1, 0.05);
        if (last_error != 0) {
            EXPECT_NEAR(last_error / error, 8, 0.3);
        }
        last_error = error;
    }
}

TEST(Bending, UnloadedCurvedTipHasNoEnergy) {
    studies::PlainWire spec;
    Chain wire = straight_wire(spec, {0, 0, 0}, {0, 0, 1}, 30);
    EXPECT_GT(bending_energy(wire), 0.01);
    for (int i = 0; i < 30; ++i) {
        const auto d = directors(wire);
        wire.tangents[i + 1] =
            rest_direction(wire.tangents[i], rest_bend(wire.devices[0], i, wire.tangents[i], d[i]));
    }
    EXPECT_NEAR(bending_energy(wire), 0, 1e-14);
    const double turned = std::acos(wire.tangents[30].dot(wire.tangents[0]));
    // The last segment lies along the chord of its own arc.
    EXPECT_NEAR(turned, spec.curved_angle * (1 - 0.5 * spec.segment_length / spec.curved_length), 1e-9);
}

TEST(Bending, PaperTermsAreExactForAStraightWire) {
    // Eq. 3 is quadratic in ε without remainder.
    const Chain wire = bent_wire(20, 0.0);
    for (int i : {1, 7, 19, 20}) {
        const BendingTerms terms = bending_terms(wire, {}, {}, i);
        auto energy = [&](const Vec3& u) {
            auto polynomial = [](double c, double k) { return c / 12 * (13 - 14 * k + k * k); };
            double sum = polynomial(wire.spring_constant(i - 1), wire.tangents[i - 1].dot(u));
            if (i < 20) sum += polynomial(wire.spring_constant(i), u.dot(wire.tangents[i + 1]));
            return sum;
        };
        const Vec3 u = wire.tangents[i];
        for (const Vec3& e : {Vec3(0.1, 0, 0), Vec3(0, -0.2, 0.05), Vec3(0.03, 0.02, -0.3)}) {
            const double model = energy(u) - terms.pull.dot(e) + 0.5 * e.dot(terms.curvature * e);
            EXPECT_NEAR(energy(u + e), model, 1e-12 * wire.spring_constant(i - 1)) << i;
        }
    }
}

TEST(Bending, PullIsMinusTheGradientWithEveryExtensionOn) {
    // Curved tip, rotation, rising rigidity; each tangent turns the rest direction of the whole tip with it.
    const Chain wire = bent_wire(24, 1.2);
    const auto d = directors(wire);
    std::vector<double> torque;
    frame_torque(wire, d, torque);
    for (int i = 1; i <= 24; ++i) {
        Vec3 a, b;
        tangent_basis(wire.tangents[i], a, b);
        auto energy = [&](const Eigen::VectorXd& t) {
            Chain turned = wire;
            turned.tangents[i] = (wire.tangents[i] + t[0] * a + t[1] * b).normalized();
            return bending_energy(turned);
        };
        const Eigen::VectorXd slope = finite_gradient(energy, Eigen::VectorXd::Zero(2), 1e-3);
        const Vec3 pull = bending_terms(wire, d, torque, i).pull;
        const double scale = wire.spring_constant(i - 1);
        EXPECT_NEAR(slope[0], -pull.dot(a), 1e-7 * scale) << i;
        EXPECT_NEAR(slope[1], -pull.dot(b), 1e-7 * scale) << i;
    }
}

TEST(Bending, CurvatureIsThatOfTheCosineLinearInTheTurn) {
    const Chain wire = bent_wire(24, 1.2);
    const auto d = directors(wire);
    std::vector<double> torque;
    frame_torque(wire, d, torque);
    for (int i : {3, 18, 19, 22, 24}) {
        // Σ C/12 (13 − 14κ + κ²) with κ = κ₀ + slope·ε, the slopes by differences of the true cosines.
        auto cosine = [&](int joint, const Vec3& e) {
            Chain turned = wire;
            turned.tangents[i] = wire.tangents[i] + e;  // to first order; the director is carried along
            RestBend rest = rest_bend(wire.devices[0], joint, wire.tangents[joint], d[joint]);
            if (joint == i) rest.direction -= rest.direction.dot(e) * wire.tangents[i];
            return rest_direction(turned.tangents[joint], rest).dot(turned.tangents[joint + 1]);
        };
        Mat3 expected = Mat3::Zero();
        for (int joint : {i - 1, i}) {
            if (joint == 24) continue;
            Vec3 slope;
            for (int k = 0; k < 3; ++k)
                slope[k] =
                    (cosine(joint, 1e-6 * Vec3::Unit(k)) - cosine(joint, -1e-6 * Vec3::Unit(k))) / 2e-6;
            expected += wire.spring_constant(joint) / 6 * slope * slope.transpose();
        }
        EXPECT_LT((bending_terms(wire, d, torque, i).curvature - expected).norm(), 1e-7 * expected.norm())
            << i;
    }
}

TEST(Bending, TorqueIsTheEnergysAnswerToTheHub) {
    Chain wire = bent_wire(24, 1.2);
    std::vector<double> torque;
    frame_torque(wire, directors(wire), torque);
    const double roll = wire.devices[0].roll;
    auto energy = [&](const Eigen::VectorXd& x) {
        wire.devices[0].roll = roll + x[0];
        return bending_energy(wire);
    };
    const double slope = finite_gradient(energy, Eigen::VectorXd::Zero(1), 1e-3)[0];
    EXPECT_NEAR(torque[0], slope, 1e-7 * std::abs(slope));
    EXPECT_GT(std::abs(slope), 1e-3);
}
