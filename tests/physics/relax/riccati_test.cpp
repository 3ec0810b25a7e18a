#include "physics/relax/riccati.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <gtest/gtest.h>
#include <random>

#include "physics/relax/newton_terms.h"
#include "physics/wire/energy.h"
#include "physics/wire/feed.h"
#include "tests/finite_difference.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

NewtonTerms terms_of(const Chain& wire, std::span<const WallContact> contacts, int first = 1) {
    NewtonTerms terms;
    std::vector<Vec3> d;
    if (wire.bent_segments() > 0) d = directors(wire);
    newton_terms(wire, contacts, d, first, terms);
    return terms;
}

/// The quadratic model of the stages, written out over all α and then, of each frame f in turn, the twists β
/// of all segments, element 2N + fN + j, and its turn at the base, 2N + FN + f.
struct Dense {
    Eigen::MatrixXd hessian;
    Eigen::VectorXd gradient;
};
Dense dense(const NewtonTerms& terms, double mu, std::span<const FedStage> fed = {}) {
    const auto& stages = terms.stages;
    const int n = static_cast<int>(stages.size()), frames = terms.frames.count;
    const int all = 2 * n + frames * n + frames;
    Dense d{Eigen::MatrixXd::Zero(all, all), Eigen::VectorXd::Zero(all)};
    Eigen::MatrixXd x = Eigen::MatrixXd::Zero(3, all);  // δx_j as a linear function of them
    std::vector<Eigen::MatrixXd> twist(frames, Eigen::MatrixXd::Zero(1, all));  // ψ_{f,j-1}
    for (int f = 0; f < frames; ++f) twist[f](0, 2 * n + frames * n + f) = 1;
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
        const auto scalar = [](double value) { return Eigen::MatrixXd::Constant(1, 1, value); };
        add(pick_prev, s.prev_prev, pick_prev);
        add(pick, s.own, pick);
        d.hessian += add(pick_prev, s.cross, pick).transpose();
        d.gradient += pick_prev.transpose() * s.slope_prev + pick.transpose() * s.slope;
        add(pick, -s.axial * Mat2::Identity(), pick);
        for (int f = 0; f < frames; ++f) {
            const FrameStage& t = terms.frame_stages[j * frames + f];
            add(twist[f], scalar(t.curve), twist[f]);
            d.hessian += add(twist[f], t.cross_prev.transpose(), pick_prev).transpose();
            d.hessian += add(twist[f], t.cross.transpose(), pick).transpose();
            d.gradient += t.slope * twist[f].transpose();
            for (int g = 0; g < f && !terms.mixed.empty(); ++g)
                d.hessian +=
                    add(twist[f], scalar(terms.mixed[(j * frames + f) * frames + g]), twist[g]).transpose();
        }
        for (int f = 0; f < frames; ++f)
            twist[f] += s.twist_prev.transpose() * pick_prev + s.twist.transpose() * pick;
        x += s.length * s.basis * pick;
        Mat3 h = mu * s.length * Mat3::Identity();
        if (s.touches) {
            h += s.stiffness;
            d.gradient += x.transpose() * s.force;
        }
        add(x, h, x);
        for (const FedStage& f : fed)
            if (f.stage <= j) d.gradient += x.transpose() * (h * f.by);
        for (int f = 0; f < frames; ++f) {
            const FrameStage& t = terms.frame_stages[j * frames + f];
            Eigen::MatrixXd pick_twist = Eigen::MatrixXd::Zero(1, all);
            pick_twist(0, 2 * n + f * n + j) = 1;
            for (const FedStage& by : fed)
                if (by.stage <= j)
                    d.gradient += t.grip_cross.dot(by.by) * (twist[f] + pick_twist).transpose();
            if (t.twist_stiffness == 0) {  // stands still
                add(pick_twist, scalar(1), pick_twist);
                continue;
            }
            twist[f] += pick_twist;
            const double weight = mu * s.length * twist_arm * twist_arm;
            add(pick_twist, scalar(t.twist_stiffness + weight), pick_twist);
            add(twist[f], scalar(t.grip_grip), twist[f]);
            d.hessian += add(twist[f], t.grip_cross.transpose(), x).transpose();
            d.gradient += t.twist_slope * pick_twist.transpose() + t.grip_slope * twist[f].transpose();
        }
    }
    return d;
}

/// Its minimum with the frames at the base held, or on springs of `base` [N·mm].
Eigen::VectorXd minimum(Dense d, int frames, double base = 0) {
    for (int f = 0; f < frames; ++f) {
        const auto k = d.gradient.size() - frames + f;
        if (base > 0) {
            d.hessian(k, k) += base;
        } else {
            d.hessian.row(k).setZero(), d.hessian.col(k).setZero();
            d.hessian(k, k) = 1, d.gradient[k] = 0;
        }
    }
    EXPECT_EQ(d.hessian.llt().info(), Eigen::Success);
    return -d.hessian.llt().solve(d.gradient);
}

/// Gains of a pass over all stages.
struct Gains {
    std::vector<RiccatiGain> turns;
    std::vector<FrameGain> frames;
    explicit Gains(const NewtonTerms& terms)
        : turns(terms.stages.size()), frames(terms.frame_stages.size()) {}
    RiccatiReport solve(const NewtonTerms& terms, double mu) {
        return riccati_backward(terms.stages, mu, 1e-9, turns, terms.framed(1, frames));
    }
};

Eigen::VectorXd rolled_out(const NewtonTerms& terms, const Gains& gains, std::span<const FedStage> fed = {},
                           const FrameVector& base = {}) {
    const int n = static_cast<int>(terms.stages.size()), frames = terms.frames.count;
    Eigen::VectorXd alpha = Eigen::VectorXd::Zero(2 * n + frames * n + frames);
    Vec3 x = Vec3::Zero();
    Vec2 prev = Vec2::Zero();
    FrameVector twist = base;
    for (int f = 0; f < frames; ++f) alpha[2 * n + frames * n + f] = base[f];
    for (int j = 0; j < n; ++j) {
        const RiccatiStage& s = terms.stages[j];
        const RiccatiGain& gain = gains.turns[j];
        Vec2 now = gain.step + gain.from_x * x + gain.from_prev * prev;
        for (int f = 0; f < frames; ++f) now += gains.frames[j * frames + f].turn * twist[f];
        for (int f = 0; f < frames; ++f) twist[f] += s.twist_prev.dot(prev) * (j > 0) + s.twist.dot(now);
        x += s.length * s.basis * now;
        for (const FedStage& f : fed)
            if (f.stage == j) x += f.by;
        alpha.segment<2>(2 * j) = now;
        prev = now;
        for (int f = frames - 1; f >= 0; --f) {
            if (terms.frame_stages[j * frames + f].twist_stiffness == 0) continue;
            const FrameGain& own = gains.frames[j * frames + f];
            double by = own.step + own.from_x.dot(x) + own.from_turn.dot(now);
            for (int g = 0; g < frames; ++g) by += own.from_frame[g] * twist[g];
            alpha[2 * n + f * n + j] = by;
            twist[f] += by;
        }
    }
    return alpha;
}

Eigen::VectorXd riccati_solution(const NewtonTerms& terms, double mu, RiccatiReport& report) {
    Gains gains(terms);
    report = gains.solve(terms, mu);
    return rolled_out(terms, gains);
}

/// The Hessian but for what stands still, which has 1 on its diagonal.
Eigen::MatrixXd held_hessian(const NewtonTerms& terms, double mu) {
    Dense d = dense(terms, mu);
    for (int f = 0; f < terms.frames.count; ++f) {
        const auto k = d.gradient.size() - terms.frames.count + f;
        d.hessian.row(k).setZero(), d.hessian.col(k).setZero();
        d.hessian(k, k) = 1;
    }
    return d.hessian;
}

/// The terms, made positive definite where they are not.
NewtonTerms convex(NewtonTerms terms, double mu) {
    const double least =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(held_hessian(terms, mu)).eigenvalues()[0];
    if (least <= 0)
        for (RiccatiStage& s : terms.stages) s.own += (1 - least) * Mat2::Identity();
    if (least <= 0)
        for (FrameStage& t : terms.frame_stages)
            if (t.twist_stiffness > 0) t.twist_stiffness += 1 - least;
    return terms;
}

/// A wire of 30 segments pressed into a tube, at rest shape curved where asked.
struct Pressed {
    Chain wire;
    TubeWall wall;
};
Pressed pressed(double curved_angle, const Vec3& load = Vec3::Zero()) {
    Chain wire = bent_wire(30, curved_angle);
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
            const Eigen::VectorXd expected = minimum(dense(terms, mu), terms.frames.count);
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
            Gains gains(terms);
            gains.solve(terms, 0);
            riccati_answer(terms.stages, 0, 0, anew, 1e-9, gains.turns, terms.framed(1, gains.frames), fed);
            const Eigen::VectorXd expected = minimum(dense(terms, 0, fed), terms.frames.count);
            EXPECT_LT((rolled_out(terms, gains, fed) - expected).norm(), 1e-10 * expected.norm())
                << curved << " " << anew;
        }
}

/// One to four devices, each with its own bends and roll, `each` of which twists segment by segment where its
/// bit is set; some joints grip the wall.
struct Several {
    Chain chain;
    std::vector<WallContact> contacts;
    NewtonTerms terms;
    Several(int count, unsigned each, double mu)
        : wall({{1, -2, 0}, {2, -1, 20}, {6, 3, 60}}, 3.0, 30.0, 0.4) {
        std::vector<Device> devices(count);
        for (int k = 0; k < count; ++k) {
            Device& device = devices[k];
            device.spec.sections = soft_tip(6, 30, 150, 250, 500 + 100 * k);
            device.spec.outer_diameter = 0.8;
            device.spec.friction = 0.3;
            device.spec.shape = {{20, 1.1 - 0.3 * k, 0}, {15.0 + k, 0.5 * k, 0.3 * k}};
            device.inserted = 58 - 1.3 * k;  // arcs that end in one joint couple
            device.roll = 0.4 - 0.9 * k;
        }
        chain = chain_along(devices, {2}, {{0, 0, 0}, {0, 0, 100}});
        std::mt19937 random(3 + count);
        const auto unit = [&] { return random() / 2147483648.0 - 1.0; };
        for (int i = 1; i <= chain.segments(); ++i)
            chain.tangents[i] = (chain.tangents[i - 1] + 0.1 * Vec3(unit(), unit(), unit())).normalized();
        rebuild_joints(chain);
        for (int k = 0; k < count; ++k)
            if (each >> k & 1) start_twists(chain, k);
        start_grips(chain);
        contacts = all_contacts(chain, wall);
        for (int j = 1; j <= chain.segments(); ++j) {
            for (Device& device : chain.devices)
                if (device.twists_by_segments()) device.wound[j] = device.wound[j - 1] + 0.1 * unit();
            Grip& grip = chain.grips[j];
            if (!contacts[j].touches()) continue;
            grip.force = 0.3 * contacts[j].force();
            grip.normal = contacts[j].normal.normalized();
            grip.around = 0.4 * chain.tangents[j].cross(grip.normal);
            grip.roll = unit();
            grip.anchor += 0.1 * Vec3(unit(), unit(), unit());
        }
        std::vector<ContactPlane> planes(chain.joints.size());
        std::vector<RiccatiGain> gains(chain.segments());
        std::vector<FrameGain> frame_gains;
        assemble_and_solve(chain, contacts, directors(chain), 1, mu, 1e-9, terms, planes, gains, frame_gains);
    }
    TubeWall wall;
};

TEST(Riccati, TwistsOfAnyDevicesEqualADenseFactorisation) {
    for (int count = 1; count <= most_devices; ++count)
        for (unsigned each = 0; each < 1u << count; ++each)
            for (const double mu : {0.0, 5.0}) {
                const NewtonTerms made = Several(count, each, mu).terms;
                ASSERT_EQ(made.frames.count, count);
                ASSERT_EQ(made.frames.each, each != 0);
                ASSERT_EQ(made.mixed.empty(), count == 1);
                const NewtonTerms terms = convex(made, mu);
                const Dense d = dense(terms, mu);
                const int n = static_cast<int>(terms.stages.size());
                // The gradient of the recursion's stages is that of the sums.
                for (int j = 0; j < n; ++j) {
                    EXPECT_LT((d.gradient.segment<2>(2 * j) - terms.gradient[j]).norm(), 1e-9) << j;
                    for (int f = 0; f < count; ++f) {
                        if (!(each >> f & 1)) continue;
                        EXPECT_NEAR(d.gradient[2 * n + f * n + j], terms.frame_gradient[j * count + f], 1e-9)
                            << j;
                    }
                }
                Gains gains(terms);
                const RiccatiReport report = gains.solve(terms, mu);
                EXPECT_EQ(report.shifted, 0);
                const Eigen::VectorXd expected = minimum(d, count);
                EXPECT_LT((rolled_out(terms, gains) - expected).norm(), 1e-9 * expected.norm())
                    << count << " " << each << " " << mu;
                // With every frame on a spring at the base.
                const double spring = 1e4;
                Eigen::MatrixXd curve(count, count);
                Eigen::VectorXd slope(count);
                for (int f = 0; f < count; ++f) {
                    slope[f] = report.slope[f];
                    for (int g = 0; g < count; ++g) curve(f, g) = report.curve[f][g] + (f == g) * spring;
                }
                const Eigen::VectorXd turns = -curve.llt().solve(slope);
                FrameVector base = {};
                for (int f = 0; f < count; ++f) base[f] = turns[f];
                const Eigen::VectorXd sprung = minimum(d, count, spring);
                EXPECT_LT((rolled_out(terms, gains, {}, base) - sprung).norm(), 1e-8 * sprung.norm())
                    << count << " " << each << " " << mu;
            }
}

/// The gradient moves, the Hessian stays: what a fed or turned chain asks of the model.
TEST(Riccati, AnswerToAnotherGradientEqualsADenseFactorisation) {
    for (int count = 1; count <= most_devices; ++count)
        for (unsigned each = 0; each < 1u << count; ++each) {
            NewtonTerms terms = convex(Several(count, each, 0).terms, 0);
            Gains gains(terms);
            gains.solve(terms, 0);
            std::mt19937 random(count);
            const auto unit = [&] { return random() / 2147483648.0 - 1.0; };
            for (RiccatiStage& s : terms.stages) {
                s.slope += Vec2(unit(), unit()), s.slope_prev += Vec2(unit(), unit());
                if (s.touches) s.force += 0.1 * Vec3(unit(), unit(), unit());
            }
            for (FrameStage& t : terms.frame_stages) t.slope += unit(), t.twist_slope += unit();
            const FedStage fed[] = {{static_cast<int>(terms.stages.size()) - 1, {0.3, -0.1, 0.7}}};
            riccati_answer(terms.stages, 0, 0, false, 1e-9, gains.turns, terms.framed(1, gains.frames), fed);
            const Eigen::VectorXd expected = minimum(dense(terms, 0, fed), count);
            EXPECT_LT((rolled_out(terms, gains, fed) - expected).norm(), 1e-9 * expected.norm())
                << count << " " << each;
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
        std::vector<FrameGain> frame_gains;
        const RiccatiReport report =
            assemble_and_solve(wire, contacts, d, 1, 0.7, 1e-9, terms, planes, gains, frame_gains);
        EXPECT_TRUE(terms.exact);
        const NewtonTerms expected = terms_of(wire, contacts);
        Gains by_itself(expected);
        EXPECT_EQ(report.shifted, by_itself.solve(expected, 0.7).shifted);
        EXPECT_EQ(terms.relative_gradient, expected.relative_gradient);
        for (int j = 0; j < 30; ++j) {
            EXPECT_EQ(gains[j].step, by_itself.turns[j].step) << j;
            EXPECT_EQ(gains[j].from_x, by_itself.turns[j].from_x) << j;
        }
    }
}

TEST(Riccati, PivotsTellWhetherTheHessianIsPositiveDefinite) {
    int definite = 0, indefinite = 0;
    for (unsigned seed = 1; seed <= 40; ++seed) {
        Chain wire = bent_wire(20, seed % 2 ? 0.0 : 0.9, seed);
        const TubeWall wall({{1, -2, 0}, {2, -1, 20}, {6, 3, 60}}, 1.0 + 1.0 * seed, 30.0, 0.4);
        const NewtonTerms terms = terms_of(wire, all_contacts(wire, wall));
        RiccatiReport report;
        riccati_solution(terms, 0, report);
        const double least =
            Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(held_hessian(terms, 0)).eigenvalues()[0];
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
            Chain other = wire;
            for (int j = 1; j <= n; ++j)
                other.tangents[j] =
                    (wire.tangents[j] + terms.stages[j - 1].basis * alpha.segment<2>(2 * (j - 1)))
                        .normalized();
            rebuild_joints(other);
            return other;
        };
        auto energy = [&, wall = wall](const Eigen::VectorXd& alpha) {
            const Chain other = turned(alpha);
            return total_energy(other, all_contacts(other, wall)).total();
        };
        const Eigen::VectorXd zero = Eigen::VectorXd::Zero(2 * n);
        const Eigen::VectorXd slope = finite_gradient(energy, zero, 1e-5);
        Eigen::VectorXd found(2 * n);
        for (int j = 0; j < n; ++j) found.segment<2>(2 * j) = terms.gradient[j];
        EXPECT_LT((found - slope).norm(), 1e-7 * slope.norm()) << curved;
        EXPECT_LT((dense(terms, 0).gradient.head(2 * n) - slope).norm(), 1e-7 * slope.norm()) << curved;

        const auto gradient = [&](const Eigen::VectorXd& alpha) {
            return finite_gradient(energy, alpha, 1e-4);
        };
        const Eigen::MatrixXd curvature = finite_hessian(gradient, zero, 1e-4);
        const Eigen::MatrixXd ours = dense(terms, 0).hessian.topLeftCorner(2 * n, 2 * n);
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
    Chain wire = before;
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
