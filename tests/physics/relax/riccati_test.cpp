#include "physics/relax/riccati.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <gtest/gtest.h>
#include <random>

#include "physics/relax/newton_terms.h"
#include "physics/wire/energy.h"
#include "tests/finite_difference.h"
#include "tests/physics/wires.h"

using namespace geometry;

using namespace physics;

namespace {

NewtonTerms terms_of(const Guidewire& wire, std::span<const WallContact> contacts, int first = 1) {
    NewtonTerms terms;
    std::vector<Vec3> d;
    if (wire.curved_segments() > 0) d = directors(wire);
    newton_terms(wire, contacts, d, first, terms);
    return terms;
}

/// The quadratic model of the stages, written out over all α and, where each segment twists, all β after
/// them.
struct Dense {
    Eigen::MatrixXd hessian;
    Eigen::VectorXd gradient;
};
Dense dense(const NewtonTerms& terms, double mu, std::span<const FedStage> fed = {}) {
    const auto& stages = terms.stages;
    const int n = static_cast<int>(stages.size()), all = terms.each ? 3 * n : 2 * n;
    Dense d{Eigen::MatrixXd::Zero(all, all), Eigen::VectorXd::Zero(all)};
    Eigen::MatrixXd x = Eigen::MatrixXd::Zero(3, all);      // δx_j as a linear function of them
    Eigen::MatrixXd twist = Eigen::MatrixXd::Zero(1, all);  // ψ_{j-1}
    for (int j = 0; j < n; ++j) {
        const RiccatiStage& s = stages[j];
        const int own = 2 * j, prev = 2 * (j - 1);
        Eigen::MatrixXd pick = Eigen::MatrixXd::Zero(2, all), pick_prev = pick;
        pick.block<2, 2>(0, own).setIdentity();
        if (j > 0) pick_prev.block<2, 2>(0, prev).setIdentity();
        auto add = [&](const Eigen::MatrixXd& left, const Eigen::MatrixXd& block,
                       const Eigen::MatrixXd& right) {
            const Eigen::MatrixXd part = left.transpose() * block * right;
            d.hessian += part;
            return part;
        };
        add(pick_prev, s.prev_prev, pick_prev);
        add(pick, s.own, pick);
        d.hessian += add(pick_prev, s.cross, pick).transpose();
        d.gradient += pick_prev.transpose() * s.slope_prev + pick.transpose() * s.slope;
        add(pick, -s.axial * Mat2::Identity(), pick);
        if (terms.twist) {
            add(twist, Eigen::MatrixXd::Constant(1, 1, s.twist_twist), twist);
            d.hessian += add(twist, s.twist_cross_prev.transpose(), pick_prev).transpose();
            d.hessian += add(twist, s.twist_cross.transpose(), pick).transpose();
            d.gradient += s.slope_twist * twist.transpose();
            twist += s.twist_prev.transpose() * pick_prev + s.twist.transpose() * pick;
        }
        x += s.length * s.basis * pick;
        Mat3 h = mu * s.length * Mat3::Identity();
        if (s.touches) {
            h += s.stiffness;
            d.gradient += x.transpose() * s.force;
        }
        add(x, h, x);
        for (const FedStage& f : fed)
            if (f.stage <= j) d.gradient += x.transpose() * (h * f.by);
        if (!terms.each) continue;
        const TwistStage& t = terms.twist_stages[j];
        Eigen::MatrixXd pick_twist = Eigen::MatrixXd::Zero(1, all);
        pick_twist(0, 2 * n + j) = 1;
        twist += pick_twist;
        const double weight = mu * s.length * twist_arm * twist_arm;
        add(pick_twist, Eigen::MatrixXd::Constant(1, 1, t.stiffness + weight), pick_twist);
        add(twist, Eigen::MatrixXd::Constant(1, 1, t.grip_grip), twist);
        d.hessian += add(twist, t.grip_cross.transpose(), x).transpose();
        d.gradient += t.slope * pick_twist.transpose() + t.grip_slope * twist.transpose();
    }
    return d;
}

Eigen::VectorXd rolled_out(const NewtonTerms& terms, std::span<const RiccatiGain> gains,
                           std::span<const FedStage> fed = {}, std::span<const TwistGain> twist_gains = {}) {
    const int n = static_cast<int>(terms.stages.size());
    Eigen::VectorXd alpha(terms.each ? 3 * n : 2 * n);
    Vec3 x = Vec3::Zero();
    Vec2 prev = Vec2::Zero();
    double twist = 0;
    for (int j = 0; j < n; ++j) {
        const RiccatiStage& s = terms.stages[j];
        Vec2 now = gains[j].step + gains[j].from_x * x + gains[j].from_prev * prev;
        if (terms.twist) {
            now += gains[j].from_twist * twist;
            twist += s.twist_prev.dot(prev) * (j > 0) + s.twist.dot(now);
        }
        x += s.length * s.basis * now;
        for (const FedStage& f : fed)
            if (f.stage == j) x += f.by;
        alpha.segment<2>(2 * j) = now;
        prev = now;
        if (!terms.each) continue;
        const TwistGain& own = twist_gains[j];
        alpha[2 * n + j] = own.step + own.from_x.dot(x) + own.from_turn.dot(now) + own.from_twist * twist;
        twist += alpha[2 * n + j];
    }
    return alpha;
}

Eigen::VectorXd riccati_solution(const NewtonTerms& terms, double mu, RiccatiReport& report) {
    std::vector<RiccatiGain> gains(terms.stages.size());
    report = riccati_backward(terms.stages, mu, 1e-9, terms.twists(), gains);
    return rolled_out(terms, gains);
}

/// The terms, made positive definite where they are not.
NewtonTerms convex(NewtonTerms terms, double mu) {
    const double least =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense(terms, mu).hessian).eigenvalues()[0];
    if (least <= 0)
        for (RiccatiStage& s : terms.stages) s.own += (1 - least) * Mat2::Identity();
    return terms;
}

/// A wire of 30 segments pressed into a tube, at rest shape curved where asked.
struct Pressed {
    Guidewire wire;
    TubeWall wall;
};
Pressed pressed(double curved_angle, const Vec3& load = Vec3::Zero()) {
    Guidewire wire = bent_wire(30, curved_angle);
    wire.load = load;
    return {wire, TubeWall({{1, -2, 0}, {2, -1, 20}, {6, 3, 60}}, 3.0, 30.0, 0.4)};
}
const Vec3 test_load(0.3, -0.5, 0.2);  // of the order of what bending and wall push with

}  // namespace

TEST(Riccati, StepEqualsADenseFactorisation) {
    for (const double curved : {0.0, 1.2})
        for (const double mu : {0.0, 5.0}) {
            const auto [wire, wall] = pressed(curved);
            const NewtonTerms terms = convex(terms_of(wire, all_contacts(wire, wall)), mu);
            RiccatiReport report;
            const Dense d = dense(terms, mu);
            const Eigen::VectorXd expected = -d.hessian.llt().solve(d.gradient);
            const Eigen::VectorXd found = riccati_solution(terms, mu, report);
            EXPECT_EQ(report.shifted, 0);
            EXPECT_LT((found - expected).norm(), 1e-10 * expected.norm()) << curved << " " << mu;
        }
}

TEST(Riccati, AnswerToFedSegmentsEqualsADenseFactorisation) {
    for (const double curved : {0.0, 1.2})
        for (const bool anew : {false, true}) {
            const auto [wire, wall] = pressed(curved);
            const NewtonTerms terms = convex(terms_of(wire, all_contacts(wire, wall)), 0);
            const FedStage fed[] = {{22, {0.3, -0.1, 0.7}}, {21, {-0.1, 0.2, 0.1}}};
            std::vector<RiccatiGain> gains(terms.stages.size());
            riccati_backward(terms.stages, 0, 1e-9, terms.twists(), gains);
            riccati_answer(terms.stages, 0, 0, anew, 1e-9, terms.twists(), gains, fed);
            const Dense d = dense(terms, 0, fed);
            const Eigen::VectorXd expected = -d.hessian.llt().solve(d.gradient);
            EXPECT_LT((rolled_out(terms, gains, fed) - expected).norm(), 1e-10 * expected.norm())
                << curved << " " << anew;
        }
}

/// A wire whose segments twist, each by itself, some of whose joints grip the wall.
TEST(Riccati, TwistOfEachSegmentEqualsADenseFactorisation) {
    std::mt19937 random(3);
    const auto unit = [&] { return random() / 2147483648.0 - 1.0; };
    for (const double mu : {0.0, 5.0}) {
        auto [wire, wall] = pressed(1.2);
        wire.spec.torsional_rigidity = 400;
        wire.spec.friction = 0.3;
        start_twists(wire);
        start_grips(wire);
        std::vector<WallContact> contacts = all_contacts(wire, wall);
        for (int j = 1; j <= wire.segments(); ++j) {
            wire.twists[j] = 0.1 * unit();
            Grip& grip = wire.grips[j];
            if (!contacts[j].touches()) continue;
            grip.force = 0.3 * contacts[j].force();
            grip.normal = contacts[j].normal.normalized();
            grip.around = 0.45 * wire.tangents[j].cross(grip.normal);
            grip.roll = unit();
            grip.anchor += 0.1 * Vec3(unit(), unit(), unit());
        }
        const int n = wire.segments();
        NewtonTerms terms;
        std::vector<ContactPlane> planes(n + 1);
        std::vector<RiccatiGain> gains(n);
        std::vector<TwistGain> twist_gains(n);
        assemble_and_solve(wire, contacts, directors(wire), 1, mu, 1e-9, terms, planes, gains, twist_gains);
        ASSERT_TRUE(terms.each);
        terms = convex(terms, mu);
        const Dense d = dense(terms, mu);
        // The gradient of the recursion's stages is that of the sums.
        for (int j = 0; j < n; ++j) {
            EXPECT_NEAR(d.gradient[2 * n + j], terms.twist_gradient[j], 1e-9) << j;
            EXPECT_LT((d.gradient.segment<2>(2 * j) - terms.gradient[j]).norm(), 1e-9) << j;
        }
        const Eigen::VectorXd expected = -d.hessian.llt().solve(d.gradient);
        const RiccatiReport report =
            riccati_backward(terms.stages, mu, 1e-9, Twist::Each, gains, {terms.twist_stages, twist_gains});
        EXPECT_EQ(report.shifted, 0);
        EXPECT_LT((rolled_out(terms, gains, {}, twist_gains) - expected).norm(), 1e-10 * expected.norm())
            << mu;
    }
}

/// Two devices of one chain, each of which also turns by itself against the spring of its shaft: over all α,
/// the turn ψ of every frame at the base and the turn ρ of the second device alone.
TEST(Riccati, TwoTurnsAtTheBaseEqualADenseFactorisation) {
    CoaxialDevice inner, outer;
    inner.spec.outer_diameter = outer.spec.outer_diameter = 0.8;
    inner.spec.shape = {{20, 1.1, 0}};
    inner.inserted = 58;
    inner.roll = 0.4;
    outer.spec.shape = {{15, 1.5, 0}, {20, -0.8, 0.3}};
    outer.inserted = 44;
    outer.roll = -1.1;
    inner.spec.torsional_rigidity = outer.spec.torsional_rigidity = 500;
    Guidewire wire = coaxial_chain({inner, outer}, 2, {{0, 0, 0}, {0, 0, 100}});
    for (int i = 1; i <= wire.segments(); ++i)
        wire.tangents[i] =
            (wire.tangents[i - 1] + 0.1 * Vec3(std::sin(1.7 * i), std::cos(2.3 * i), 0)).normalized();
    rebuild_joints(wire);
    const TubeWall wall({{1, -2, 0}, {2, -1, 20}, {6, 3, 60}}, 3.0, 30.0, 0.4);
    NewtonTerms terms;
    std::vector<ContactPlane> planes(wire.joints.size());
    const int n = wire.segments(), psi = 2 * n, rho = 2 * n + 1;
    std::vector<RiccatiGain> gains(n);
    assemble_and_solve(wire, all_contacts(wire, wall), directors(wire), 1, 0, 1e-9, terms, planes, gains);
    ASSERT_TRUE(terms.second);
    const double stiff = 2000;  // so that the model is convex, also along ψ and ρ
    for (RiccatiStage& s : terms.stages) s.own += stiff * Mat2::Identity();

    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(2 * n + 2, 2 * n + 2);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(2 * n + 2);
    hessian.topLeftCorner(2 * n, 2 * n) = [&] {
        NewtonTerms alone = terms;
        return dense(alone, 0).hessian;
    }();
    gradient.head(2 * n) = dense(terms, 0).gradient;
    Eigen::RowVectorXd twist = Eigen::RowVectorXd::Zero(2 * n);  // ψ_{j-1} without ψ
    for (int j = 0; j < n; ++j) {
        const RiccatiStage& s = terms.stages[j];
        const auto cross = [&](int turn, double twice, const Vec2& prev, const Vec2& own, double slope) {
            gradient[turn] += slope;
            Eigen::VectorXd row = twice * twist.transpose();
            if (j > 0) row.segment<2>(2 * j - 2) += prev;
            row.segment<2>(2 * j) += own;
            hessian.row(turn).head(2 * n) += row.transpose();
            hessian.col(turn).head(2 * n) += row;
        };
        cross(psi, s.twist_twist, s.twist_cross_prev, s.twist_cross, s.slope_twist);
        cross(rho, s.second_second, s.second_cross_prev, s.second_cross, s.second_slope);
        hessian(psi, psi) += s.twist_twist;
        hessian(rho, rho) += s.second_second;
        hessian(psi, rho) += s.second_second;
        hessian(rho, psi) += s.second_second;
        if (j > 0) twist.segment<2>(2 * j - 2) += s.twist_prev.transpose();
        twist.segment<2>(2 * j) += s.twist.transpose();
    }
    hessian(psi, psi) += stiff;
    hessian(rho, rho) += stiff;
    ASSERT_EQ(hessian.llt().info(), Eigen::Success);
    const Eigen::VectorXd expected = -hessian.llt().solve(gradient);

    const RiccatiReport report = riccati_backward(terms.stages, 0, 1e-9, Twist::Two, gains);
    EXPECT_EQ(report.shifted, 0);
    Eigen::Matrix2d base;
    base << report.twist_twist + stiff, report.twist_second, report.twist_second,
        report.second_second + stiff;
    const Vec2 turns = -base.llt().solve(Vec2(report.slope_twist, report.slope_second));
    EXPECT_NEAR(turns[0], expected[psi], 1e-10 * expected.norm());
    EXPECT_NEAR(turns[1], expected[rho], 1e-10 * expected.norm());
    Vec3 x = Vec3::Zero();
    Vec2 prev = Vec2::Zero();
    double turned = turns[0];
    for (int j = 0; j < n; ++j) {
        const RiccatiStage& s = terms.stages[j];
        const Vec2 now = gains[j].step + gains[j].from_x * x + gains[j].from_prev * prev +
                         gains[j].from_twist * turned + gains[j].from_second * turns[1];
        if (j > 0) turned += s.twist_prev.dot(prev);
        turned += s.twist.dot(now);
        x += s.length * s.basis * now;
        EXPECT_LT((now - expected.segment<2>(2 * j)).norm(), 1e-10 * expected.norm()) << j;
        prev = now;
    }
}

TEST(NewtonTerms, AreSolvedWhileTheyAreAssembled) {
    for (const double curved : {0.0, 1.2}) {
        const auto [wire, wall] = pressed(curved, test_load);
        const auto contacts = all_contacts(wire, wall);
        std::vector<Vec3> d;
        if (curved > 0) d = directors(wire);
        std::vector<ContactPlane> planes(wire.joints.size());
        for (std::size_t j = 0; j < planes.size(); ++j) planes[j].force = contacts[j].force();
        NewtonTerms terms;
        std::vector<RiccatiGain> gains(30);
        const RiccatiReport report =
            assemble_and_solve(wire, contacts, d, 1, 0.7, 1e-9, terms, planes, gains);
        EXPECT_TRUE(terms.exact);
        const NewtonTerms expected = terms_of(wire, contacts);
        std::vector<RiccatiGain> by_itself(30);
        EXPECT_EQ(report.shifted,
                  riccati_backward(expected.stages, 0.7, 1e-9, expected.twists(), by_itself).shifted);
        EXPECT_EQ(terms.relative_gradient, expected.relative_gradient);
        for (int j = 0; j < 30; ++j) {
            EXPECT_EQ(gains[j].step, by_itself[j].step) << j;
            EXPECT_EQ(gains[j].from_x, by_itself[j].from_x) << j;
        }
    }
}

TEST(Riccati, PivotsTellWhetherTheHessianIsPositiveDefinite) {
    int definite = 0, indefinite = 0;
    for (unsigned seed = 1; seed <= 40; ++seed) {
        Guidewire wire = bent_wire(20, seed % 2 ? 0.0 : 0.9, seed);
        const TubeWall wall({{1, -2, 0}, {2, -1, 20}, {6, 3, 60}}, 1.0 + 1.0 * seed, 30.0, 0.4);
        const NewtonTerms terms = terms_of(wire, all_contacts(wire, wall));
        RiccatiReport report;
        riccati_solution(terms, 0, report);
        const double least =
            Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense(terms, 0).hessian).eigenvalues()[0];
        EXPECT_EQ(report.shifted == 0, least > 0) << seed;
        ++(least > 0 ? definite : indefinite);
    }
    EXPECT_GT(definite, 3);
    EXPECT_GT(indefinite, 3);
}

TEST(NewtonTerms, GradientAndHessianAreThoseOfTheEnergy) {
    for (const auto& [curved, load] :
         {std::pair(0.0, Vec3(0, 0, 0)), {1.2, Vec3(0, 0, 0)}, {0.0, test_load}, {1.2, test_load}}) {
        const auto [wire, wall] = pressed(curved, load);
        const NewtonTerms terms = terms_of(wire, all_contacts(wire, wall));
        const int n = wire.segments();
        auto turned = [&, wire = wire](const Eigen::VectorXd& alpha) {
            Guidewire other = wire;
            for (int j = 1; j <= n; ++j)
                other.tangents[j] =
                    (wire.tangents[j] + terms.stages[j - 1].basis * alpha.segment<2>(2 * (j - 1)))
                        .normalized();
            rebuild_joints(other);
            return other;
        };
        auto energy = [&, wall = wall](const Eigen::VectorXd& alpha) {
            const Guidewire other = turned(alpha);
            return total_energy(other, all_contacts(other, wall)).total();
        };
        const Eigen::VectorXd zero = Eigen::VectorXd::Zero(2 * n);
        const Eigen::VectorXd slope = finite_gradient(energy, zero, 1e-5);
        Eigen::VectorXd found(2 * n);
        for (int j = 0; j < n; ++j) found.segment<2>(2 * j) = terms.gradient[j];
        EXPECT_LT((found - slope).norm(), 1e-7 * slope.norm()) << curved;
        EXPECT_LT((dense(terms, 0).gradient - slope).norm(), 1e-7 * slope.norm()) << curved;

        const auto gradient = [&](const Eigen::VectorXd& alpha) {
            return finite_gradient(energy, alpha, 1e-4);
        };
        const Eigen::MatrixXd curvature = finite_hessian(gradient, zero, 1e-4);
        const Eigen::MatrixXd ours = dense(terms, 0).hessian;
        // Curved: the terms left out are of the order of torque times bend.
        EXPECT_LT((ours - curvature).norm(), (curved == 0 ? 1e-5 : 1e-3) * curvature.norm()) << curved;
    }
}

TEST(NewtonTerms, AgreeWithTheEnergyModule) {
    const auto [wire, wall] = pressed(1.2, test_load);
    const auto contacts = all_contacts(wire, wall);
    const NewtonTerms terms = terms_of(wire, contacts);
    const auto gradient = energy_gradient(wire, contacts);
    for (int j = 1; j <= wire.segments(); ++j) {
        const Vec3 found = terms.stages[j - 1].basis * terms.gradient[j - 1];
        EXPECT_LT((found - gradient[j]).norm(), 1e-9 * (1 + gradient[j].norm())) << j;
    }
    EXPECT_NEAR(terms.relative_gradient, relative_gradient(wire, contacts), 1e-12 * terms.relative_gradient);
    Vec3 push = -wire.inserted_length() * test_load;
    for (const WallContact& c : contacts) push += c.push();
    EXPECT_LT((terms.push - push).norm(), 1e-12 * push.norm());
}

TEST(NewtonTerms, AWindowHasTheTermsOfTheWholeWire) {
    const auto [before, wall] = pressed(1.2, test_load);
    NewtonTerms window = terms_of(before, all_contacts(before, wall));
    Guidewire wire = before;
    for (int j = 21; j <= 30; ++j) wire.tangents[j] = (wire.tangents[j] + Vec3(0.02, 0, 0.01)).normalized();
    rebuild_joints(wire);
    const auto contacts = all_contacts(wire, wall);
    const NewtonTerms whole = terms_of(wire, contacts);
    newton_terms(wire, contacts, directors(wire), 21, window);
    ASSERT_EQ(window.window().size(), 10u);
    double inside = 0, proximal = 0;
    for (int j = 1; j <= 30; ++j) {
        EXPECT_LT((window.gradient[j - 1] - whole.gradient[j - 1]).norm(), 1e-12) << j;
        double& largest = j > 20 ? inside : proximal;
        largest = std::max(largest, whole.gradient[j - 1].norm() / wire.spring_constant(j - 1));
    }
    EXPECT_NEAR(window.relative_gradient, inside, 1e-12);
    EXPECT_NEAR(window.proximal_gradient, proximal, 1e-12);
}
