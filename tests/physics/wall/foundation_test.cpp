#include "physics/wall/foundation.h"

#include <cmath>
#include <gtest/gtest.h>
#include <numeric>
#include <random>

#include "physics/relax/hub.h"
#include "tests/finite_difference.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

CentrelineBranch straight_vessel(double length, double radius, double step = 1) {
    CentrelineBranch branch;
    branch.name = "vessel";
    for (double s = 0; s <= length; s += step) {
        branch.points.emplace_back(s, 0, 0);
        branch.radii.push_back(radius);
    }
    return branch;
}

Vec3 moved(const Foundation& foundation, const Foundation::Displacement& by, int station) {
    return foundation.at(by, station, foundation.tree().stations()[station].centre);
}

/// A tube around a polyline in tissue.
TubeWall tube_in_tissue(const Polyline& line, double radius, double stiffness, double joint,
                        const Tissue& tissue) {
    CentrelineBranch branch{"tube", -1, -1, line, std::vector<double>(line.size(), radius)};
    TubeWall wall(line, radius, stiffness, joint);
    wall.lie_in(std::make_shared<Foundation>(std::span(&branch, 1), std::span(&tissue, 1)));
    return wall;
}

}  // namespace

TEST(Foundation, ASingleForceMovesALongVesselByItsGiveAndSpreads) {
    for (const Tissue tissue : {Tissue{0.1, 0.05}, Tissue{0.02, 0.1}, Tissue{0.3, 0.01}})
        for (const double radius : {1.5, 4.0, 10.0}) {
            const CentrelineBranch branch = straight_vessel(600, radius);
            const Foundation foundation({&branch, 1}, {&tissue, 1});
            const Foundation::Load load{300, branch.points[300], {0, 0.4, -0.3}};
            const auto by = foundation.displacement({&load, 1});
            const double give = foundation.give(300), beta = 2 * give * tissue.modulus;
            const double spread =
                std::pow(4 * M_PI * std::pow(radius, 4) * tissue.wall / tissue.modulus, 0.25);
            EXPECT_NEAR(give, 1 / (2 * tissue.modulus * spread), 2e-3 * give);
            for (const int aside : {0, 3, 10, 25, 40}) {
                const double x = beta * aside;
                const double way = give * std::exp(-x) * (std::cos(x) + std::sin(x));
                EXPECT_LT((moved(foundation, by, 300 + aside) - way * load.force).norm(), 2e-3 * give * 0.5)
                    << radius << " mm, " << aside << " mm aside";
            }
        }
}

TEST(Foundation, AnEvenLoadMovesAVesselByLoadOverModulus) {
    const CentrelineBranch branch = straight_vessel(300, 3);
    const Tissue tissue{0.07, 0.05};
    const Foundation foundation({&branch, 1}, {&tissue, 1});
    std::vector<Foundation::Load> loads;
    for (int s = 0; s <= 300; ++s)
        loads.push_back({s, branch.points[s], Vec3(0, 0, s % 300 == 0 ? 0.005 : 0.01)});
    const auto by = foundation.displacement(loads);
    for (const int s : {0, 40, 150, 260, 300})
        EXPECT_NEAR(moved(foundation, by, s).z(), 0.01 / 0.07, (s % 300 == 0 ? 1e-2 : 1e-3) * 0.01 / 0.07)
            << s;
    EXPECT_NEAR(foundation.give_of_many(150, 2), 1 / (0.07 * 2), 1e-12);
}

TEST(Foundation, ABranchIsCarriedByItsParent) {
    CentrelineBranch child{"branch", 0, 100, {}, {}};
    for (int i = 0; i <= 60; ++i) child.points.emplace_back(100, i, 0), child.radii.push_back(2);
    const CentrelineBranch tree[] = {straight_vessel(200, 4), child};
    const Tissue tissue;
    const Foundation foundation(tree, {&tissue, 1});
    const Foundation::Load load{100, tree[0].points[100], {0, 0, 0.5}};
    const auto by = foundation.displacement({&load, 1});
    const Vec3 parent = moved(foundation, by, 100), start = moved(foundation, by, 201);
    EXPECT_GT(parent.z(), 0.1);
    EXPECT_LT((parent - start).norm(), 1e-3 * parent.norm());
    EXPECT_LT(moved(foundation, by, 201 + 60).norm(), 0.1 * parent.norm());
    // Maxwell and Betti: a force there moves the parent by as much as one on the parent moves it.
    const Foundation::Load other{201 + 30, child.points[30], {0, 0, 0.5}};
    const auto back = foundation.displacement({&other, 1});
    EXPECT_NEAR(moved(foundation, back, 100).z(), moved(foundation, by, 201 + 30).z(), 1e-9);
}

namespace {

/// A vessel along x, of which a branch leaves at x = 100 at this angle.
std::vector<CentrelineBranch> fork(double radius, double degrees) {
    CentrelineBranch branch{"branch", 0, 100, {}, {}};
    for (int i = 0; i <= 60; ++i) {
        const double angle = degrees * M_PI / 180;
        branch.points.emplace_back(100 + i * std::cos(angle), i * std::sin(angle), 0);
        branch.radii.push_back(radius);
    }
    return {straight_vessel(200, radius), branch};
}

}  // namespace

TEST(Foundation, WhereTwoLumensAreOneTheyMoveTogether) {
    const Tissue tissue;
    for (const double degrees : {20.0, 40.0, 70.0}) {
        const std::vector<CentrelineBranch> vessels = fork(4, degrees);
        const Foundation foundation(vessels, {&tissue, 1});
        // Of the branch's stations the last whose centre is within the parent.
        const int inside = static_cast<int>(4 / std::sin(degrees * M_PI / 180));
        const Vec3 place = vessels[1].points[inside];
        const int beside = static_cast<int>(std::lround(place.x()));
        const Foundation::Load pull[] = {{201 + inside, place, {0, 0, 1}},
                                         {beside, vessels[0].points[beside], {0, 0, -1}}};
        const auto one = foundation.displacement({pull, 1}), both = foundation.displacement(pull);
        const double whole = moved(foundation, one, 201 + inside).z();
        EXPECT_NEAR(whole, foundation.give(201 + inside), 1e-3 * whole) << degrees;
        EXPECT_LT((moved(foundation, one, 201 + inside) - moved(foundation, one, beside)).norm(), 0.3 * whole)
            << degrees;
        EXPECT_LT(std::abs(moved(foundation, both, 201 + inside).z()), 0.3 * whole) << degrees;
        // Far from there each goes its own way.
        const Foundation::Load far{201 + 55, vessels[1].points[55], {0, 0, 1}};
        EXPECT_LT(moved(foundation, foundation.displacement({&far, 1}), 150).norm(), 0.05) << degrees;
    }
}

TEST(Foundation, GoesOnPastAnOpenEnd) {
    const CentrelineBranch branch = straight_vessel(100, 2);
    const Tissue tissue;
    OpenEnd end{"end", {100, 0, 0}, Vec3::UnitX(), 2};
    const Foundation open({&branch, 1}, {&tissue, 1}, {&end, 1}), closed({&branch, 1}, {&tissue, 1});
    // In the middle of a long vessel a force moves it by less than at its end.
    EXPECT_NEAR(open.give(100), open.give(50), 1e-3 * open.give(50));
    EXPECT_GT(closed.give(100), 2 * closed.give(50));
    const Vec3 past(115, 0, 0);
    const Foundation::Load load{100, past, {0, 0, 0.1}};
    const auto by = open.displacement({&load, 1});
    EXPECT_NEAR(open.at(by, 100, past).z(), 0.1 * open.give(50), 1e-2 * open.give(50));
    EXPECT_LT(moved(open, by, 100).norm(), 0.3 * open.at(by, 100, past).norm());
    // A sheath is none.
    end.goes_on = Continuation::Sheath;
    end.length = 30;
    EXPECT_NEAR(Foundation({&branch, 1}, {&tissue, 1}, {&end, 1}).give(100), closed.give(100), 1e-12);
}

TEST(Foundation, RefusesTissuesThatHoldNothing) {
    const CentrelineBranch branch = straight_vessel(50, 3);
    for (const Tissue tissue :
         {Tissue{0, 0.1}, Tissue{-1, 0.1}, Tissue{0.1, -1}, Tissue{NAN, 0}, Tissue{1, INFINITY}})
        EXPECT_THROW(Foundation({&branch, 1}, {&tissue, 1}), std::invalid_argument);
    const Tissue two[2] = {};
    EXPECT_THROW(Foundation({&branch, 1}, two), std::invalid_argument);
}

TEST(LumenWall, WallAndVesselAreTwoSpringsInSeries) {
    constexpr unsigned seed = 3;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const TubeWall wall({{0, 0, 0}, {400, 0, 0}}, 3, 10, 0.4);
    for (int k = 0; k < 1000; ++k) {
        const double angle = 2 * M_PI * unit(random), depth = std::pow(10, -6 + 7.5 * unit(random));
        const double give = std::pow(10, -4 + 6 * unit(random)), fraction = 0.2 + unit(random);
        const Vec3 out(0, std::cos(angle), std::sin(angle));
        SCOPED_TRACE("seed " + std::to_string(seed) + ", case " + std::to_string(k));
        WallContact c;
        c.fraction = fraction;
        c.give = give;
        if (unit(random) < 0.5) c.given = 2 * depth * unit(random) * Vec3(0, unit(random), unit(random));
        const Vec3 x = Vec3(200 + unit(random), 0, 0) + (2.6 + depth) * out;
        wall.contacts({&x, 1}, {&c, 1});
        const double force = depth / (1 / (10 * fraction) + give);
        ASSERT_TRUE(c.touches()) << k;
        EXPECT_NEAR(c.penetration, depth, 1e-9 * (1 + depth)) << k;
        EXPECT_LT((c.push() - force * out).norm(), 1e-7 * force + 1e-9) << k << ": " << depth << ", " << give;
        EXPECT_NEAR(c.pressed_in(), force / (10 * fraction), 1e-8 * (1 + depth)) << k;
        EXPECT_LT((c.given - give * force * out).norm(), 1e-8 * (1 + depth)) << k;
        // Across, the joint comes nearer to the axis again. The Hessian is that of the last place but one.
        const Vec3 around(0, -std::sin(angle), std::cos(angle));
        EXPECT_NEAR(depth * around.dot(c.curvature * around), depth / (2.6 + depth), 1e-4) << k;
        EXPECT_NEAR(depth * out.dot(c.curvature * out), 0, 1e-5) << k;
    }
}

TEST(LumenWall, AVesselThatOthersHaveShiftedIsWhereItIs) {
    const TubeWall wall({{0, 0, 0}, {400, 0, 0}}, 3, 10, 0.4);
    std::mt19937 random(9);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int k = 0; k < 1000; ++k) {
        const Vec3 shift = 3 * Vec3(0, unit(random), unit(random));
        const Vec3 x = Vec3(200, 0, 0) + 5 * Vec3(unit(random), unit(random), unit(random));
        WallContact moved, still;
        moved.give = still.give = 0.4;
        moved.along = still.along = Vec3::UnitX();
        moved.shift = shift;
        const Vec3 there = x - shift;
        wall.contacts({&x, 1}, {&moved, 1});
        wall.contacts({&there, 1}, {&still, 1});
        EXPECT_EQ(moved.penetration, still.penetration) << k;
        EXPECT_EQ(moved.push(), still.push()) << k;
        EXPECT_LT((moved.given - still.given - shift).norm(), 1e-12) << k;
        EXPECT_LT((moved.on_vessel() - still.on_vessel()).norm(), 1e-12) << k;
    }
}

TEST(LumenWall, PushAndCurvatureOfAVesselThatMakesWayAreItsEnergys) {
    const Polyline line = anatomy::draw(anatomy::find_scene("spatial")->path);
    const TubeWall wall(line, 2.0, 40.0, 0.2);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    int asked = 0;
    for (int k = 0; k < 200; ++k) {
        const int i = 200 + static_cast<int>(unit(random) * (static_cast<double>(line.size()) - 400));
        const Vec3 along = (line[i + 1] - line[i]).normalized();
        const Vec3 x =
            line[i] +
            (1.9 + 2 * unit(random)) *
                along.cross(Vec3(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5)).normalized();
        const auto at = [&](const Vec3& p) {
            WallContact c;
            c.station = i;
            c.give = 0.5;
            wall.contacts({&p, 1}, {&c, 1});
            return c;
        };
        const WallContact c = at(x);
        if (!c.touches() || c.penetration < 0.01) continue;
        ++asked;
        const auto energy = [&](const Eigen::VectorXd& p) { return at(Vec3(p)).energy(); };
        // A polyline's distance has kinks of 1e-3 rad.
        EXPECT_LT((finite_gradient(energy, x, 1e-3) - c.push()).norm(), 3e-3 * c.push().norm()) << k;
    }
    EXPECT_GT(asked, 100);
}

namespace {

/// A straight wire along the wall of a straight tube in tissue, pressed on it by a load; how far its joints
/// go down [mm].
std::vector<double> pressed_down(const Tissue& tissue, double lambda, double length, double rigidity,
                                 double load) {
    constexpr double radius = 3, joint = 0.4;
    Polyline line;
    for (double s = -20; s <= length + 40; s += 2) line.emplace_back(s, 0, 0);
    const TubeWall wall = tube_in_tissue(line, radius, 2000 * lambda, joint, tissue);
    studies::PlainWire spec = studies::PlainWire::uniform(rigidity, lambda);
    spec.diameter = 2 * joint;
    Chain wire = straight_wire(spec, {0, 0, -(radius - joint)}, {1, 0, 0},
                               static_cast<int>(std::lround(length / lambda)));
    wire.load = {0, 0, -load};
    start_grips(wire, true);
    Hub hub({}, wall);
    HubReport report = hub.settle(wire, 100000);
    EXPECT_TRUE(report.relax.at_rest());
    std::vector<double> down;
    for (const Vec3& x : wire.joints) down.push_back(-(radius - joint) - x.z());
    return down;
}

}  // namespace

TEST(LumenWall, AWireOnAVesselInTissueIsABeamOnWinklersFoundation) {
    const Tissue tissue{0.05, 0};
    const double rigidity = 200, load = 0.01, beta = std::pow(tissue.modulus / (4 * rigidity), 0.25);
    double before = 0;
    for (const double lambda : {2.0, 1.0, 0.5}) {
        const std::vector<double> down = pressed_down(tissue, lambda, 160, rigidity, load);
        double off = 0;
        for (std::size_t i = 0; i * lambda <= 80; ++i) {
            const double x = beta * lambda * static_cast<double>(i);
            const double exact = load / tissue.modulus * (1 - std::exp(-x) * (std::cos(x) + std::sin(x)));
            off = std::max(off, std::abs(down[i] - exact));
        }
        EXPECT_LT(off, (lambda == 2 ? 0.02 : 0.01) * load / tissue.modulus) << lambda;
        if (before > 0) {
            EXPECT_NEAR(std::log2(before / off), 2, 0.3);
        }
        before = off;
    }
}

TEST(LumenWall, AWireAndAVesselThatBendsShareALoadAsOneLinearSystemSays) {
    constexpr double lambda = 2, length = 120, rigidity = 300, load = 0.01, stiffness = 2000 * lambda;
    constexpr int count = 60;
    for (const Tissue tissue : {Tissue{0.1, 0.05}, Tissue{0.02, 0.2}, Tissue{0.05, 1}}) {
        const std::vector<double> down = pressed_down(tissue, lambda, length, rigidity, load);
        // What one newton at joint j moves the vessel by at joint i.
        CentrelineBranch branch = straight_vessel(length + 60, 3, 2);
        for (Vec3& p : branch.points) p.x() -= 20;
        const Foundation foundation({&branch, 1}, {&tissue, 1});
        Eigen::MatrixXd soft = Eigen::MatrixXd::Zero(count, count), beam = soft;
        for (int j = 1; j <= count; ++j) {
            const Foundation::Load one{10 + j, {lambda * j, 0, 0}, {0, 0, 1}};
            const auto by = foundation.displacement({&one, 1});
            for (int i = 1; i <= count; ++i)
                soft(i - 1, j - 1) = foundation.at(by, 10 + i, {lambda * i, 0, 0}).z();
            soft(j - 1, j - 1) += 1 / (stiffness * (j == count ? 0.5 : 1));
        }
        // Bending of joint i between z_{i-1}, z_i and z_{i+1}; the introducer holds z_0 and what is before
        // it.
        for (int i = 0; i < count; ++i) {
            Eigen::VectorXd turn = Eigen::VectorXd::Zero(count);
            if (i == 0) turn[0] = 1 / lambda;
            if (i == 1) turn[0] = -2 / lambda, turn[1] = 1 / lambda;
            if (i > 1) turn[i - 2] = 1 / lambda, turn[i - 1] = -2 / lambda, turn[i] = 1 / lambda;
            const double spring = rigidity / (i == 0 ? 0.5 * lambda : lambda);
            beam += spring * turn * turn.transpose();
        }
        Eigen::VectorXd weight = Eigen::VectorXd::Constant(count, load * lambda);
        weight[count - 1] *= 0.5;
        // Joints that the wall would have to hold back do not touch it.
        std::vector<int> touching(count);
        std::iota(touching.begin(), touching.end(), 0);
        Eigen::VectorXd z;
        for (std::size_t before = 0; before != touching.size();) {
            before = touching.size();
            const Eigen::MatrixXd stiff = soft(touching, touching).inverse();
            Eigen::MatrixXd whole = beam;
            whole(touching, touching) += stiff;
            z = whole.ldlt().solve(weight);
            const Eigen::VectorXd force = stiff * z(touching);
            std::vector<int> rest;
            for (std::size_t k = 0; k < before; ++k)
                if (force[static_cast<Eigen::Index>(k)] > 0) rest.push_back(touching[k]);
            touching = rest;
        }
        EXPECT_GT(touching.size(), 40u);
        double off = 0;
        for (int i = 1; i <= count; ++i) off = std::max(off, std::abs(down[i] - z[i - 1]));
        // A joint beside others that bear more is given their way by its own force alone: 3.5 % were found.
        EXPECT_LT(off, 0.05 * z.maxCoeff());
    }
}
