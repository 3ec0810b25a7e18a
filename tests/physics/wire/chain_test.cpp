#include <Eigen/LU>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "engine/studies/plain_wire.h"
#include "physics/geometry/random.h"
#include "physics/wire/bending.h"
#include "physics/wire/crossings.h"
#include "physics/wire/feed.h"
#include "tests/physics/wires.h"

using namespace physics;

TEST(DeviceSpec, ListsEverythingWrongWithIt) {
    EXPECT_TRUE(studies::PlainWire{}.problems().empty());
    studies::PlainWire spec{.segment_length = -1, .shaft_rigidity = std::nan(""), .tip_rigidity = 1e12};
    EXPECT_GE(spec.problems().size(), 3u);
}

TEST(DeviceSpec, RigidityRisesGeometricallyFromTipToShaft) {
    studies::PlainWire spec;
    EXPECT_EQ(rigidity_at(spec.device(), 10), spec.tip_rigidity);
    EXPECT_EQ(rigidity_at(spec.device(), 500), spec.shaft_rigidity);
    const double middle = rigidity_at(spec.device(), spec.tip_length + spec.transition_length / 2);
    EXPECT_NEAR(middle, std::sqrt(spec.tip_rigidity * spec.shaft_rigidity), 1e-9);
}

TEST(Chain, StartsStraightAndWithoutLoadInItsShaft) {
    const Chain wire = straight_wire(studies::PlainWire{}, {0, 0, 0}, {0, 0, 2}, 30);
    EXPECT_TRUE(validate(wire).empty());
    EXPECT_NEAR(wire.inserted_length(), 60, 1e-12);
    EXPECT_NEAR((wire.tip() - Vec3(0, 0, 60)).norm(), 0, 1e-12);
}

TEST(Chain, RefusesWhatCannotBeAWire) {
    EXPECT_THROW(straight_wire(studies::PlainWire{}, {0, 0, 0}, {0, 0, 0}, 30), std::invalid_argument);
    EXPECT_THROW(straight_wire(studies::PlainWire{}, {std::nan(""), 0, 0}, {0, 0, 1}, 30),
                 std::invalid_argument);
    EXPECT_THROW(straight_wire(studies::PlainWire{}, {0, 0, 0}, {0, 0, 1}, 1),
                 std::invalid_argument);  // no room
    EXPECT_THROW(wire_along(studies::PlainWire{}, {{0, 0, 0}}, 30), std::invalid_argument);
    studies::PlainWire spec{.diameter = 0};
    EXPECT_THROW(straight_wire(spec, {0, 0, 0}, {0, 0, 1}, 30), std::invalid_argument);
}

TEST(Chain, LiesAlongAPathWithJointsOneSegmentApart) {
    const Polyline path = anatomy::draw(anatomy::find_scene("spatial")->path);
    studies::PlainWire spec{.segment_length = 1};
    const Chain wire = wire_along(spec, path, 170);
    EXPECT_TRUE(validate(wire).empty());
    for (const Vec3& x : wire.joints) {
        double nearest = 1e9;
        for (const Vec3& p : path) nearest = std::min(nearest, (p - x).norm());
        EXPECT_LT(nearest, 0.05);
    }
}

TEST(Chain, InsertsJustBeforeTheCurvedTipAndMovesTheTipAlong) {
    Chain wire = bent_wire(30, 0.8);
    const Chain before = wire;
    const int last = wire.segments() - 6;  // the curved tip is 9 mm long
    ASSERT_EQ(move(wire, 1.5), 1);
    ASSERT_EQ(wire.segments(), 31);
    EXPECT_TRUE(validate(wire).empty());
    for (int i = 0; i <= last; ++i) EXPECT_EQ(wire.joints[i], before.joints[i]);
    const Vec3 shift = 1.5 * before.tangents[last];
    for (int i = last; i <= 30; ++i)
        EXPECT_LT((wire.joints[i + 1] - before.joints[i] - shift).norm(), 1e-12) << i;
    // Rigidity and curvature belong to the material, counted from the tip.
    const auto &now = wire.devices[0], &then = before.devices[0];
    EXPECT_NEAR(now.rest[30].angle, then.rest[29].angle, 1e-12);
    EXPECT_EQ(now.rest[last].angle, 0.0);
    EXPECT_NEAR(wire.rigidity[30], before.rigidity[29], 1e-9);
}

TEST(Chain, AShapeThatBeginsAtAJointIsThereHoweverPlacesRound) {
    // Curved tips are whole numbers of λ, so that they begin where a joint lies, but for rounding.
    for (int seed = 0; seed < 2000; ++seed) {
        geometry::Random random(seed);
        const double lambda = random.between(0.5, 3);
        studies::PlainWire wire{.segment_length = lambda,
                                .tip_length = 30,
                                .curved_length = lambda * (2 + static_cast<int>(6 * random())),
                                .curved_angle = 0.8};
        physics::Chain chain = straight_wire(wire, geometry::Vec3::Zero(), geometry::Vec3::UnitX(), 20);
        for (int k = 0; k < 4; ++k) {
            physics::feed(chain, physics::every_device, lambda * random());
            double turn = 0;
            for (const physics::RestTurn& rest : chain.devices[0].rest) turn += rest.angle;
            ASSERT_NEAR(turn, 0.8, 0.8 / wire.curved_segments()) << "seed " << seed << ", feed " << k;
        }
    }
}

TEST(Chain, WithdrawsWhatItAdvanced) {
    Chain wire = bent_wire(30, 0.8);
    const Chain before = wire;
    EXPECT_EQ(move(wire, 7.5), 5);
    EXPECT_EQ(move(wire, -7.5), -5);
    ASSERT_EQ(wire.segments(), 30);
    for (int i = 0; i <= 30; ++i) EXPECT_LT((wire.joints[i] - before.joints[i]).norm(), 1e-12);
}

TEST(Chain, ASegmentSplitAndMergedAgainIsAsBefore) {
    Chain wire = bent_wire(30, 0.8);
    const Chain before = wire;
    split_segment(wire, 12);
    ASSERT_EQ(wire.segments(), 31);
    EXPECT_TRUE(validate(wire).empty());
    EXPECT_EQ(wire.lengths[12], 0.75);
    EXPECT_NE(wire.tangents[12], wire.tangents[13]);
    EXPECT_NEAR(wire.inserted_length(), before.inserted_length(), 1e-12);
    merge_segments(wire, 12);
    ASSERT_EQ(wire.segments(), 30);
    for (int i = 0; i <= 30; ++i) EXPECT_LT((wire.joints[i] - before.joints[i]).norm(), 1e-12) << i;
    for (int i = 0; i < 30; ++i) EXPECT_NEAR(wire.rigidity[i], before.rigidity[i], 1e-9);
}

TEST(Chain, ASplitArcBendsEvenly) {
    studies::PlainWire spec{.curved_length = 0, .curved_angle = 0};
    Chain wire = straight_wire(spec, {0, 0, 0}, {1, 0, 0}, 20);
    for (int i = 0; i <= 20; ++i) wire.tangents[i] = {std::cos(0.1 * i), std::sin(0.1 * i), 0};
    rebuild_joints(wire);
    for (int i = 12; i >= 8; --i) split_segment(wire, i);
    for (int i = 8; i < 18; ++i) {
        const double turn = std::acos(wire.tangents[i].dot(wire.tangents[i + 1]));
        EXPECT_NEAR(turn / wire.length_of(i), 0.05, 0.05 * 0.2) << i;
    }
}

/// A wire in a catheter whose shape ends behind it: the chain grows where the catheter is bent at rest.
TEST(Chain, ASegmentSplitWhereDevicesAreBentAtRestKeepsTheEnergy) {
    Device wire, catheter;
    wire.spec.outer_diameter = 0.89;
    wire.spec.sections = soft_tip(15, 0, 0, 15);
    wire.spec.length = catheter.spec.length = 400;
    wire.spec.shape = {{6, 60 * degree, 0}};
    wire.inserted = 62.7;
    catheter.spec.outer_diameter = 1.67;
    catheter.spec.inner_diameter = 1.1;
    catheter.spec.sections = soft_tip(60, 0, 0, 60);
    catheter.spec.shape = {{40, 120 * degree, 0}};
    catheter.inserted = 60;
    catheter.roll = 0.4;
    Chain chain = chain_along({wire, catheter}, {2}, {{0, 0, 0}, {100, 0, 0}});
    // Each joint lies between what the devices ask for and straight, as a vessel would hold it.
    std::vector<Vec3> frames = directors(chain);
    for (int j = 0; j < chain.segments(); ++j) {
        Vec3 turn = Vec3::Zero();
        for (const Device& device : chain.devices)
            if (device.rest[j].angle != 0)
                turn +=
                    device.rigidity[j] / chain.rigidity[j] *
                    (rest_direction(chain.tangents[j], rest_bend(device, j, chain.tangents[j], frames[j])) -
                     chain.tangents[j]);
        chain.tangents[j + 1] = (chain.tangents[j] + 0.8 * turn).normalized();
        transport_directors(chain, j + 1, frames);
    }
    rebuild_joints(chain);
    const double whole = bending_energy(chain);
    const int grows = chain.growing();
    ASSERT_GT(chain.devices[1].rest[grows].angle, 0.05);
    for (const double fraction : {0.5, 0.7}) {
        Chain split = chain;
        split_segment(split, grows, fraction);
        // A joint that stays straight adds 0.07 N·mm.
        EXPECT_NEAR(bending_energy(split), whole, 0.02) << fraction << " of " << whole;
        EXPECT_LT((split.tip() - chain.tip()).norm(), 0.05);
    }
}

TEST(Chain, WallFractionsAreLengthsAndExactlyOneWhereLambdaIsUniform) {
    Chain wire = bent_wire(30, 0.8);
    wire.grid.segment_length = 1.1;  // no binary fraction
    std::fill(wire.lengths.begin() + 1, wire.lengths.end(), 1.1);
    wire.devices[0].inserted = wire.inserted_length();
    rebuild_joints(wire);
    assign(wire);
    for (int i = 1; i < 30; ++i) EXPECT_EQ(wire.wall_fraction(i), 1.0);
    for (const int i : {0, 30}) EXPECT_EQ(wire.wall_fraction(i), 0.5);  // half of their one segment
    merge_segments(wire, 10);
    EXPECT_NEAR(wire.wall_fraction(10), 1.5, 1e-12);
    EXPECT_NEAR(wire.wall_fraction(9), 1.5, 1e-12);
    EXPECT_EQ(wire.wall_fraction(12), 1.0);
}

TEST(Chain, TheFirstAndTheLastJointStandForHalfASegmentOrByThePapersRuleForAWholeOne) {
    Chain wire = bent_wire(30, 0.8);
    split_segment(wire, 1, 0.2);  // segments of 0.3 and 1.2 mm, then of 1.5 mm
    ASSERT_EQ(wire.segments(), 31);
    struct Expected {
        EndCells ends;
        double first, last;  // lengths [mm]
    };
    for (const auto& [ends, first, last] :
         {Expected{EndCells::Half, 0.15, 0.75}, {EndCells::Paper, 0.3, 1.5}}) {
        wire.grid.end_cells = ends;
        EXPECT_NEAR(wire.length_of(0), first, 1e-12);
        EXPECT_NEAR(wire.length_of(1), 0.75, 1e-12);
        EXPECT_NEAR(wire.length_of(2), 1.35, 1e-12);
        EXPECT_NEAR(wire.length_of(31), last, 1e-12);
        EXPECT_NEAR(wire.spring_constant(0), wire.rigidity[0] / first, 1e-9);
        EXPECT_NEAR(wire.spring_constant(2), wire.rigidity[2] / 1.35, 1e-9);
        EXPECT_NEAR(wire.wall_fraction(31), last / 1.5, 1e-12);
    }
    // Half cells share out the whole wire; the paper's are a segment more.
    double sum = 0;
    for (int i = 0; i <= 31; ++i) sum += wire.length_of(i);
    EXPECT_NEAR(sum, wire.inserted_length() + 0.15 + 0.75, 1e-12);
    wire.grid.end_cells = EndCells::Half;
    sum = 0;
    for (int i = 0; i <= 31; ++i) sum += wire.length_of(i);
    EXPECT_NEAR(sum, wire.inserted_length(), 1e-12);
}

TEST(Chain, CarriesMovementShorterThanASegment) {
    Chain wire = bent_wire(30, 0.8);  // λ = 1.5 mm
    EXPECT_EQ(move(wire, 1.0), 0);
    EXPECT_EQ(wire.segments(), 30);
    EXPECT_EQ(move(wire, 1.0), 1);
    EXPECT_NEAR(wire.carried, 0.5, 1e-12);
    EXPECT_EQ(move(wire, -1.0), 0);
    EXPECT_NEAR(wire.carried, -0.5, 1e-12);
    for (int i = 0; i < 10; ++i) move(wire, 0.2);  // decimal steps make whole segments in spite of rounding
    EXPECT_EQ(wire.segments(), 32);
    EXPECT_NEAR(wire.carried, 0.0, 1e-9);
}

TEST(Chain, StopsWithdrawingAtTwoSegments) {
    Chain wire = bent_wire(12, 0.8);
    EXPECT_EQ(move(wire, -400), -10);
    EXPECT_EQ(wire.segments(), 2);
    EXPECT_EQ(wire.carried, 0.0);
    EXPECT_TRUE(validate(wire).empty());
}

TEST(Chain, DirectorsStayPerpendicularAndRestBendsTurnWithTheHub) {
    Chain wire = bent_wire(40, 0.8);
    const auto d = directors(wire);
    for (int i = 0; i <= 40; ++i) {
        EXPECT_NEAR(d[i].norm(), 1, 1e-12);
        EXPECT_NEAR(d[i].dot(wire.tangents[i]), 0, 1e-12);
    }
    const int joint = 38;
    const Vec3& u = wire.tangents[joint];
    const Vec3 before = rest_bend(wire.devices[0], joint, u, d[joint]).direction;
    rotate(wire, every_device, 1.1);
    // Torsionally rigid: the whole wire turns by the hub's angle about its own tangent.
    const Vec3 after = rest_bend(wire.devices[0], joint, u, d[joint]).direction;
    EXPECT_LT((after - std::cos(1.1) * before - std::sin(1.1) * u.cross(before)).norm(), 1e-12);
}

TEST(Chain, ParallelTransportInAPlaneDoesNotTwist) {
    studies::PlainWire spec{.curved_length = 0, .curved_angle = 0};
    Chain wire = straight_wire(spec, {0, 0, 0}, {0, 0, 1}, 40);
    for (int i = 1; i <= 40; ++i) wire.tangents[i] = {std::sin(0.05 * i), 0, std::cos(0.05 * i)};
    wire.base_director = Vec3::UnitY();
    for (const Vec3& d : directors(wire)) EXPECT_LT((d - Vec3::UnitY()).norm(), 1e-12);
}

TEST(Chain, ValidationTellsWhatIsBroken) {
    Chain wire = bent_wire(20, 0.8);
    EXPECT_TRUE(validate(wire).empty());
    wire.joints[7].x() = std::numeric_limits<double>::quiet_NaN();
    wire.tangents[3] *= 1.001;
    const auto wrong = validate(wire);
    EXPECT_GE(wrong.size(), 2u);
}

TEST(Chain, TangentBasisIsOrthonormal) {
    for (const Vec3& u :
         {Vec3(0, 0, 1), Vec3(0, 0, -1), Vec3(1, 0, 0), Vec3(0.6, -0.8, 0), Vec3(1, 2, -3).normalized()}) {
        Vec3 a, b;
        tangent_basis(u, a, b);
        Mat3 frame;
        frame << u, a, b;
        EXPECT_LT((frame.transpose() * frame - Mat3::Identity()).norm(), 1e-14);
        EXPECT_NEAR(frame.determinant(), 1, 1e-14);
    }
}

/// A shape that is partly outside goes in and out by random steps: the segments are those of a chain laid
/// anew with the same length, the growing one before the shape.
TEST(Feed, SegmentsOfAShapeOnItsWayInDependOnTheLengthAlone) {
    const Polyline path = {{0, 0, 0}, {400, 0, 0}};
    for (unsigned seed = 0; seed < 1000; ++seed) {
        std::mt19937 random(seed);
        const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
        studies::PlainWire wire;
        wire.segment_length = 0.7 + 2 * unit();
        wire.curved_length = 10 + 40 * unit();
        wire.curved_angle = 0.5;
        double length = wire.curved_length - 6 + 14 * unit();
        length = std::max(length, 2.2 * wire.segment_length);
        Chain fed = studies::wire_of_length(wire, path, length);
        for (int step = 0; step < 80; ++step) {
            const double least = 2.05 * wire.segment_length - length;
            length += feed(fed, every_device, std::max(12 * (unit() - 0.5), least));
            const Chain laid = studies::wire_of_length(wire, path, length);
            ASSERT_EQ(fed.segments(), laid.segments()) << "seed " << seed << ", step " << step;
            for (int i = 1; i <= laid.segments(); ++i)
                ASSERT_NEAR(fed.lengths[i], laid.lengths[i], 1e-6)
                    << "seed " << seed << ", step " << step << ", segment " << i;
            for (int i = 0; i < laid.segments(); ++i) {
                ASSERT_NEAR(fed.devices[0].rest[i].angle, laid.devices[0].rest[i].angle, 1e-6)
                    << "seed " << seed << ", step " << step << ", joint " << i;
                ASSERT_NEAR(fed.rigidity[i], laid.rigidity[i], 1e-5 * laid.rigidity[i])
                    << "seed " << seed << ", step " << step << ", joint " << i;
            }
        }
    }
}

TEST(Feed, PiecesOfTheGrowingSegmentStayWhereTheyAreUntilTheyGoOut) {
    constexpr double lambda = 2;
    std::mt19937 random(11);
    const auto unit = [&] { return random() / 4294967296.0; };
    const auto places = [](const Chain& chain) {
        std::vector<double> list(1, 0.0);
        for (int i = 1; i <= chain.segments(); ++i) list.push_back(list.back() + chain.lengths[i]);
        return list;
    };
    int kept = 0;
    for (int round = 0; round < 1000; ++round) {
        studies::PlainWire spec = studies::PlainWire::uniform(50, lambda);
        spec.curved_length = round % 2 == 0 ? 0 : 6;
        spec.curved_angle = round % 2 == 0 ? 0 : 0.5;
        Chain chain = straight_wire(spec, Vec3::Zero(), Vec3::UnitX(), 30);
        feed(chain, every_device, lambda * (unit() - 0.5));
        // A joint into the segment that grows, no nearer to its ends than a quarter of it.
        split_segment(chain, chain.growing(), 0.25 + 0.5 * unit());
        ASSERT_LT(first_growing(chain), chain.growing());
        const double place = places(chain)[static_cast<std::size_t>(first_growing(chain))];
        double length = chain.inserted_length();
        for (int k = 0; k < 6; ++k) {
            length += feed(chain, every_device, lambda * unit());
            ASSERT_TRUE(validate(chain).empty()) << round;
            ASSERT_NEAR(chain.inserted_length(), length, 1e-9);
            double nearest = lambda, shortest = lambda;
            for (const double s : places(chain)) nearest = std::min(nearest, std::abs(s - place));
            for (int i = 1; i <= chain.segments(); ++i) {
                shortest = std::min(shortest, chain.lengths[i]);
                ASSERT_LT(chain.lengths[i], 1.5 * lambda) << round;
            }
            ASSERT_GE(shortest, least_piece * lambda * (1 - 1e-6)) << round << ' ' << k;
            // A joint that the next whole one comes near goes.
            const double whole = std::abs(place / lambda - std::round(place / lambda));
            if (whole > least_piece + 1e-9) {
                EXPECT_LT(nearest, 1e-9) << round << ' ' << k;
            }
            kept += nearest < 1e-9;
        }
        // What goes out is made whole.
        while (places(chain)[static_cast<std::size_t>(chain.growing())] > place) {
            length += feed(chain, every_device, -lambda * unit());
            ASSERT_TRUE(validate(chain).empty()) << round;
            ASSERT_NEAR(chain.inserted_length(), length, 1e-9);
        }
        for (int i = 1; i < chain.segments(); ++i) ASSERT_FALSE(chain.within_a_segment(i)) << round;
    }
    EXPECT_GT(kept, 4000);
}

TEST(Feed, APieceThatEndsTheLeastBeforeAWholePlaceIsNotSplitBeyondItsEnd) {
    for (const double lambda : {2.0, 3.2002, 0.7}) {
        studies::PlainWire spec = studies::PlainWire::uniform(50, lambda);
        Chain chain = straight_wire(spec, Vec3::Zero(), Vec3::UnitX(), 10);
        // The segment that grows in eighths, the last of which grows on.
        ASSERT_EQ(chain.growing(), chain.segments());
        for (int k = 0; k < 3; ++k)
            for (int i = chain.segments(), first = first_growing(chain); i >= first; --i)
                split_segment(chain, i);
        ASSERT_EQ(chain.growing() - first_growing(chain), 7);
        for (int k = 0; k < 40; ++k) {
            feed(chain, every_device, 0.05 * lambda);
            ASSERT_TRUE(validate(chain).empty()) << lambda << ", " << k;
            for (int i = 1; i <= chain.segments(); ++i)
                ASSERT_GE(chain.lengths[i], least_piece * lambda * (1 - 1e-6)) << lambda << ", " << k;
        }
        EXPECT_NEAR(chain.inserted_length(), 12 * lambda, 1e-9);
    }
}
