#include "physics/relax/segment_relaxer.h"

#include <cmath>
#include <gtest/gtest.h>
#include <map>

#include "physics/wire/energy.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

Chain straight_along_x(int segments) {
    return uniform_wire(50, 1.0, {0, 0, 0}, {1, 0, 0}, std::vector<Vec3>(segments, Vec3::UnitX()));
}

}  // namespace

TEST(RelaxerConfig, RefusesWhatCannotRun) {
    EXPECT_TRUE(problems(RelaxerConfig{}).empty());
    const TubeWall wall({{0, 0, 0}, {0, 0, 10}}, 2.0, 20.0);
    for (int m : {-1, 0, 6}) EXPECT_THROW(make_relaxer(segment_config(m), wall), std::invalid_argument);
    RelaxerConfig config{.separation = 1};
    EXPECT_THROW(make_relaxer(config, wall), std::invalid_argument);
    config.separation = 15;
    config.turn_limit = 0;
    EXPECT_THROW(make_relaxer(config, wall), std::invalid_argument);
    RelaxerConfig stored = segment_config(2);
    stored.stored_planes = true;
    EXPECT_TRUE(problems(stored).empty());
    for (const RelaxerKind kind : {RelaxerKind::Global, RelaxerKind::Geometric, RelaxerKind::Combined}) {
        stored.kind = kind;
        EXPECT_FALSE(problems(stored).empty());
    }
}

TEST(SegmentRelaxer, ThePrintedSystemMovesAWireAsThePlainFormDoes) {
    // From the centreline and from a shaken wire; later the least differences grow (PHYSICS: Section 2).
    for (const char* name : {"sinuous", "spatial"})
        for (int varied = 1; varied <= 5; ++varied)
            for (const bool shaken : {false, true}) {
                const SceneSetup scene = scene_setup(name);
                RelaxerConfig config = segment_config(varied, false);
                Chain plain = scene.wire;
                std::mt19937 random(varied);
                const auto unit = [&] { return random() / 2147483648.0 - 1.0; };
                if (shaken)
                    for (Vec3& u : plain.tangents) u = (u + 0.03 * Vec3(unit(), unit(), unit())).normalized();
                Chain printed = plain;
                const RelaxBudget budget{plain.segments(), 0, 0};
                make_relaxer(config, scene.wall)->relax(plain, budget);
                config.printed = true;
                make_relaxer(config, scene.wall)->relax(printed, budget);
                double apart = 0;
                for (int i = 0; i <= plain.segments(); ++i)
                    apart = std::max(apart, (plain.tangents[i] - printed.tangents[i]).norm());
                EXPECT_LT(apart, 1e-12) << name << ", M = " << varied << ", shaken " << shaken;
                EXPECT_GT((plain.tip() - scene.wire.tip()).norm(), 1e-3);
            }
}

TEST(SegmentRelaxer, NeverTurnsASegmentBeyondItsLimit) {
    for (int m = 1; m <= 5; ++m) {
        auto [wall, wire] = scene_setup("hairpin");
        const int n = wire.segments();
        Chain last = wire;
        auto relaxer = make_relaxer(segment_config(m), wall);
        relaxer->relax(wire, {2000, 0, 0}, [&](int, const Chain& now) {
            for (int i = 1; i <= n; ++i)
                ASSERT_LE((now.tangents[i] - last.tangents[i]).norm(), 0.1 / std::sqrt(n + 1.0 - i) + 1e-12);
            last = now;
        });
    }
}

TEST(SegmentRelaxer, MovesOnlyVariedSegmentsAndTheirOwnJoints) {
    auto [wall, wire] = scene_setup("hairpin");
    SegmentRelaxer relaxer(segment_config(3), wall);
    Chain last = wire;
    std::map<int, int> separations;
    relaxer.relax(wire, whole_cycles(wire.segments(), 1), [&](int first, const Chain& now) {
        const auto varied = relaxer.last_varied();
        ASSERT_EQ(varied.front(), first);
        for (std::size_t m = 1; m < varied.size(); ++m) ++separations[varied[m] - varied[m - 1]];
        for (int i = 1; i <= now.segments(); ++i) {
            if (std::find(varied.begin(), varied.end(), i) == varied.end()) {
                ASSERT_EQ(now.tangents[i], last.tangents[i]) << i;
            }
        }
        last = now;
    });
    ASSERT_FALSE(separations.empty());
    EXPECT_GE(separations.begin()->first, 5);  // Algorithm 2 looks at 5 … 25
    EXPECT_LE(separations.rbegin()->first, 25);
    EXPECT_GT(separations.size(), 5u);
}

TEST(SegmentRelaxer, FixedSeparationIsKept) {
    auto [wall, wire] = scene_setup("hairpin");
    RelaxerConfig config = segment_config(3);
    config.separation = 12;
    SegmentRelaxer relaxer(config, wall);
    int triples = 0;
    relaxer.relax(wire, {3000, 0, 0}, [&](int, const Chain&) {
        const auto varied = relaxer.last_varied();
        for (std::size_t m = 1; m < varied.size(); ++m) ASSERT_EQ(varied[m] - varied[m - 1], 12);
        triples += varied.size() == 3;
    });
    EXPECT_GT(triples, 100);
}

TEST(SegmentRelaxer, TakesTheSegmentsOfLeastEstimatedEnergy) {
    // Eqs. 37 and 38 over i+5…i+25 by hand, before every update.
    SceneSetup scene = past_the_first_turn();
    const TubeWall& wall = scene.wall;
    Chain& wire = scene.wire;
    SegmentRelaxer relaxer(segment_config(3), wall);
    relaxer.relax(wire, whole_cycles(wire.segments(), 1));
    Chain before = wire;
    rebuild_joints(before);
    int doubles = 0, triples = 0;
    relaxer.relax(wire, {60, 0, 0}, [&](int i, const Chain& now) {
        ContactSet contacts(wall);
        contacts.reset(before);
        const auto turn = [&](int j) -> Vec3 {
            const Vec3 q = bending_terms(before, {}, {}, j).pull - contacts.sum_from(j).force;  // λ = 1
            return q.normalized() - before.tangents[j];
        };
        std::vector<int> expected = {i};
        Vec3 sum = turn(i);
        for (int from = i; expected.size() < 3 && contacts.last_touching() >= from + 5;
             from = expected.back()) {
            double least = 1e300;
            int best = -1;
            for (int j = from + 5; j <= std::min(from + 25, contacts.last_touching()); ++j) {
                const BendingTerms terms = bending_terms(before, {}, {}, j);
                const PushSum push = contacts.sum_from(j);
                const Vec3 e = turn(j), q = terms.pull - push.force;
                const Mat3 p = terms.curvature + push.stiffness;
                const double change = -q.dot(e) + 0.5 * e.dot(p * e) + sum.dot(push.stiffness * e);
                if (change < least) least = change, best = j;
            }
            expected.push_back(best);
            sum += turn(best);
        }
        const auto varied = relaxer.last_varied();
        ASSERT_EQ(std::vector<int>(varied.begin(), varied.end()), expected) << i;
        doubles += varied.size() == 2;
        triples += varied.size() == 3;
        before = now;
    });
    EXPECT_GT(triples, 20);
    EXPECT_GT(doubles + triples, 40);
}

TEST(SegmentRelaxer, GuardedEnergyNeverRises) {
    for (const char* scene : {"hairpin", "stiffwall"})
        for (int m : {1, 2, 3}) {
            auto [wall, wire] = scene_setup(scene);
            auto relaxer = make_relaxer(segment_config(m), wall);
            double last = energy_of(wire, wall);
            for (int k = 0; k < 30; ++k) {
                relaxer->relax(wire, {200, 0, 0});
                const double now = energy_of(wire, wall);
                ASSERT_LE(now, last * (1 + 1e-12)) << scene << " M = " << m << " after " << 200 * (k + 1);
                last = now;
            }
            EXPECT_TRUE(validate(wire).empty());
        }
}

TEST(SegmentRelaxer, PlainAndGuardedReachTheSameBasin) {
    const auto [wall, start] = past_the_first_turn();
    double rest[2];
    for (bool safeguard : {false, true}) {
        Chain wire = start;
        make_relaxer(segment_config(2, safeguard), wall)->relax(wire, whole_cycles(wire.segments(), 30));
        const double energy = energy_of(wire, wall);
        global_relaxer(wall)->relax(wire, {100000, 0, 0});
        rest[safeguard] = energy_of(wire, wall);
        EXPECT_NEAR(energy, rest[safeguard], 1e-3) << safeguard;
    }
    EXPECT_NEAR(rest[0], rest[1], 1e-6);
}

TEST(SegmentRelaxer, SecondOrderRestsWhereFirstOrderBounces) {
    // Fig. 11: mean |ε| of the first order stays far above that of the second.
    const auto [wall, start] = past_the_first_turn();
    double mean[2];
    for (int order : {1, 2}) {
        Chain wire = start;
        RelaxerConfig config = segment_config(2);
        if (order == 1) config.kind = RelaxerKind::FirstOrder;
        auto relaxer = make_relaxer(config, wall);
        relaxer->relax(wire, whole_cycles(wire.segments(), 30));
        mean[order - 1] = mean_turn(*relaxer, wire);
    }
    EXPECT_LT(mean[1], 1e-3 * mean[0]);
}

TEST(SegmentRelaxer, RestsAsLongAsTheWallsCurvatureIsKept) {
    // Section 3.3: (a) A and R and (c) R alone come to rest alike, (b) none and (d) A alone bounce alike.
    const SceneSetup scene = past_the_first_turn();
    const TubeWall& wall = scene.wall;
    const Chain& start = scene.wire;
    const auto mean = [&](bool bending, bool of_wall) {
        Chain wire = start;
        RelaxerConfig config = segment_config(1, false);
        config.bending_curvature = bending;
        config.wall_curvature = of_wall;
        const auto relaxer = make_relaxer(config, wall);
        relaxer->relax(wire, whole_cycles(wire.segments(), 15));
        return mean_turn(*relaxer, wire);
    };
    const double a = mean(true, true), b = mean(false, false), c = mean(false, true), d = mean(true, false);
    EXPECT_LT(a, 0.15 * b);
    EXPECT_NEAR(c, a, 0.2 * a);
    EXPECT_GT(d, 0.3 * b);
}

TEST(SegmentRelaxer, FirstOrderIsThePlainMethodWithoutBothCurvatures) {
    Vec3 tips[2];
    for (const bool first_order : {false, true}) {
        auto [wall, wire] = past_the_first_turn();
        RelaxerConfig config = segment_config(1, false);
        config.bending_curvature = config.wall_curvature = false;
        if (first_order) config.kind = RelaxerKind::FirstOrder;
        make_relaxer(config, wall)->relax(wire, {3000, 0, 0});
        tips[first_order] = wire.tip();
    }
    EXPECT_LT((tips[0] - tips[1]).norm(), 1e-9);
}

TEST(SegmentRelaxer, SegmentsOfUnequalLengthsRestWhereTheGlobalRelaxerRests) {
    auto [wall, wire] = past_the_first_turn();
    wire = wire_along(wire.devices[0].spec, wire.grid, wall.centreline(), 50);
    for (int i = 44; i > 8; i -= 4) split_segment(wire, i, 0.35);
    ASSERT_TRUE(validate(wire).empty());
    const Chain start = wire;
    RelaxerConfig konings = of_kind(RelaxerKind::Konings);
    RelaxerConfig combined = segment_config(2);
    combined.kind = RelaxerKind::Combined;
    RelaxerConfig stored = segment_config(2);
    stored.stored_planes = true;
    for (const RelaxerConfig& config : {segment_config(2), konings, combined, stored}) {
        wire = start;
        const double before = energy_of(wire, wall);
        make_relaxer(config, wall)->relax(wire, whole_cycles(wire.segments(), 25));
        const double energy = energy_of(wire, wall);
        EXPECT_TRUE(validate(wire).empty());
        global_relaxer(wall)->relax(wire, {1'000'000, 0, 0});
        const double rest = energy_of(wire, wall);
        const bool konings_slow = config.kind == RelaxerKind::Konings;
        EXPECT_NEAR(energy, rest, (konings_slow ? 0.1 : 1e-3) * (before - rest));
    }
}

TEST(SegmentRelaxer, BudgetIsCountedInUpdates) {
    auto [wall, wire] = scene_setup("hairpin");
    int seen = 0;
    const RelaxReport report =
        make_relaxer(segment_config(2), wall)->relax(wire, {137, 0.75, 40}, [&](int, const Chain&) {
            ++seen;
        });
    EXPECT_EQ(report.updates, 137);
    EXPECT_EQ(seen, 137);
    EXPECT_GE(report.wall_queries, wire.segments());
}

TEST(SegmentRelaxer, StopsWhenNothingTurnsAnyMore) {
    studies::PlainWire spec{.curved_length = 0, .curved_angle = 0};
    Chain wire = straight_wire(spec, {0, 0, 0}, {1, 0, 0}, 30);
    const TubeWall wall({{-1, 0, 0}, {100, 0, 0}}, 2, 40);
    const RelaxReport report = make_relaxer(segment_config(2), wall)->relax(wire, {100000, 0, 0});
    EXPECT_TRUE(report.converged());
    EXPECT_LE(report.updates, 60);
}

TEST(SegmentRelaxer, FreeCurvedTipTakesItsRestShape) {
    studies::PlainWire spec{.segment_length = 2, .tip_length = 20, .transition_length = 10};
    Chain wire = straight_wire(spec, {0, 0, 0}, {0, 0, 1}, 24);
    rotate(wire, every_device, 0.5);
    const TubeWall wall({{0, 0, -1}, {0, 0, 100}}, 50, 40);
    make_relaxer(segment_config(1), wall)->relax(wire, whole_cycles(24, 400));
    EXPECT_LT(total_energy(wire, all_contacts(wire, wall)).bending, 1e-8);
    const Vec3 aside = wire.tip() - Vec3(0, 0, wire.tip().z());
    EXPECT_GT(aside.norm(), 2.0);
    // Curved to where the hub points.
    const Vec3& d = wire.base_director;
    const Vec3 hub = std::cos(0.5) * d + std::sin(0.5) * Vec3::UnitZ().cross(d);
    EXPECT_LT((aside.normalized() - hub).norm(), 1e-3);
}

TEST(SegmentRelaxer, RotatingTheHubTurnsTheTip) {
    studies::PlainWire spec{.segment_length = 2};
    Chain wire = straight_wire(spec, {0, 0, 0}, {0, 0, 1}, 30);
    const TubeWall wall({{0, 0, -1}, {0, 0, 100}}, 4, 20, 0.44);
    auto relaxer = make_relaxer(segment_config(2), wall);
    relaxer->relax(wire, whole_cycles(30, 100));
    const Vec3 before = wire.tip();
    for (int k = 0; k < 18; ++k) {
        rotate(wire, every_device, 10 * M_PI / 180);
        relaxer->relax(wire, whole_cycles(30, 10));
    }
    const Vec3 after = wire.tip();
    EXPECT_GT(std::hypot(before.x(), before.y()), 1.0);
    EXPECT_LT((before.head<2>() + after.head<2>()).norm(), 0.05);  // half a turn: the other side
}

TEST(SegmentRelaxer, LeavesAnExactHeadOnMeeting) {
    // A straight wire on the axis of a wall it meets at a right angle: no force has a side to turn to.
    for (int m : {1, 2, 3}) {
        Chain wire = straight_along_x(40);
        const TubeWall wall({{-1, 0, 0}, {38.5, 0, 0}}, 1.0, 42);
        const double before = energy_of(wire, wall);
        ASSERT_GT(before, 0.1);
        auto relaxer = make_relaxer(segment_config(m), wall);
        relaxer->relax(wire, whole_cycles(40, 40));
        EXPECT_TRUE(validate(wire).empty());
        EXPECT_LT(energy_of(wire, wall), 0.7 * before) << m;
        EXPECT_GT((wire.joints[20] - Vec3(20, 0, 0)).norm(), 0.05) << m;
    }
}

TEST(SegmentRelaxer, LeavesAnExactFold) {
    std::vector<Vec3> tangents(40, Vec3::UnitX());
    for (int i = 20; i < 40; ++i) tangents[i] = -Vec3::UnitX();
    for (int m : {1, 2, 3}) {
        Chain wire = uniform_wire(50, 1.0, {0, 0, 0}, {1, 0, 0}, tangents);
        const TubeWall wall({{-30, 0, 0}, {60, 0, 0}}, 3.0, 42);
        const double before = energy_of(wire, wall);
        make_relaxer(segment_config(m), wall)->relax(wire, whole_cycles(40, 30));
        EXPECT_TRUE(validate(wire).empty());
        EXPECT_LT(energy_of(wire, wall), 0.8 * before) << m;
    }
}

TEST(SegmentRelaxer, SurvivesWhatBreaksPlainMethods) {
    // Wall × 1000, twenty segments at once into a bend: no NaN, no broken wire, plain or guarded.
    for (bool safeguard : {false, true})
        for (int m : {1, 2, 4}) {
            auto setup = scene_setup("stiffwall");
            Chain& wire = setup.wire;
            for (int k = 0; k < 20; ++k) {
                wire.tangents[60 + k] = wire.tangents[59];
            }
            rebuild_joints(wire);
            make_relaxer(segment_config(m, safeguard), setup.wall)->relax(wire, {4000, 0.5, 60});
            EXPECT_TRUE(validate(wire).empty()) << m << safeguard;
        }
}

TEST(SegmentRelaxer, MirroredSceneGivesTheMirroredWire) {
    // Mirror in the plane z = 0 through a bend that is not symmetric; rotation changes its sign.
    const Polyline path = anatomy::draw(anatomy::find_scene("spatial")->path);
    Polyline mirrored = path;
    for (Vec3& p : mirrored) p.z() = -p.z();
    studies::PlainWire spec{.segment_length = 2, .tip_length = 20};
    auto run = [&](const Polyline& line, double sign) {
        const TubeWall wall(line, 2.0, 40, 0.44);
        Chain wire = wire_along(spec, line, 40);
        // d_0 in the mirror plane: its mirror image is itself.
        wire.base_director = Vec3::UnitY();
        auto relaxer = make_relaxer(segment_config(2), wall);
        for (int k = 0; k < 6; ++k) {
            move(wire, 4);
            rotate(wire, every_device, sign * 0.15);
            relaxer->relax(wire, whole_cycles(wire.segments(), 10));
        }
        return wire;
    };
    const Chain one = run(path, 1), other = run(mirrored, -1);
    ASSERT_EQ(one.segments(), other.segments());
    for (int i = 0; i <= one.segments(); ++i) {
        const Vec3 image(other.joints[i].x(), other.joints[i].y(), -other.joints[i].z());
        EXPECT_LT((one.joints[i] - image).norm(), 1e-3) << i;
    }
}

TEST(SegmentRelaxer, SameWorkTwiceGivesTheSameBits) {
    Vec3 tips[2];
    for (Vec3& tip : tips) {
        auto [wall, wire] = scene_setup("spatial");
        make_relaxer(segment_config(2), wall)->relax(wire, {3000, 0.5, 60});
        tip = wire.tip();
    }
    EXPECT_EQ(tips[0], tips[1]);
}

namespace {

/// A wire in a catheter, both with shapes and sections, turned against each other.
Chain wire_in_a_catheter(const Polyline& line) {
    std::vector<Device> devices(2);
    devices[0].spec.sections = soft_tip(6, 12, 20, 150);
    devices[0].spec.shape = {{30, 0.8, 0}};
    devices[0].inserted = 72.3;
    devices[1].spec.outer_diameter = 1.67, devices[1].spec.inner_diameter = 1.1;
    devices[1].spec.sections = soft_tip(60, 10, 15, 200);
    devices[1].spec.shape = {{10, 1.0, 0}, {20, -0.6, 0.4}};
    devices[1].inserted = 51.9;
    devices[1].roll = 2.1;
    return chain_along(devices, {2, EndCells::Half}, line);
}

}  // namespace

TEST(SegmentRelaxer, DevicesOnAChainRestWhereTheGlobalRelaxerRests) {
    const Polyline line = anatomy::draw(std::vector<anatomy::PenMove>{
        anatomy::Run{20}, anatomy::Arc{30, 0.9, Vec3::UnitZ()}, anatomy::Run{60}});
    const TubeWall wall(line, 4, 5, 0.44);
    Chain rest = wire_in_a_catheter(line);
    ASSERT_FALSE(rest.couplings.empty());
    ASSERT_TRUE(global_relaxer(wall)->relax(rest, unlimited).converged());
    RelaxerConfig geometric = segment_config(2);
    geometric.kind = RelaxerKind::Combined;
    for (const RelaxerConfig& config : {segment_config(1), segment_config(2), segment_config(3), geometric}) {
        Chain wire = wire_in_a_catheter(line);
        EXPECT_EQ(why_not(config.kind, wire.devices), "");
        const auto relaxer = make_relaxer(config, wall);
        RelaxReport report;
        for (int k = 0; k < 40 && !report.converged(); ++k)
            report.add(relaxer->relax(wire, whole_cycles(wire.segments(), 40)));
        // The energies round by 4e-16 of what an update touches, and turns by their root.
        EXPECT_NEAR(energy_of(wire, wall), energy_of(rest, wall), 1e-6 * energy_of(rest, wall));
        for (std::size_t j = 0; j < wire.joints.size(); ++j)
            EXPECT_LT((wire.joints[j] - rest.joints[j]).norm(), 1e-2) << "joint " << j;
    }
}

TEST(SegmentRelaxer, SaysInOneSentenceWhichChainItCannotRelax) {
    const Polyline line = {{0, 0, 0}, {100, 0, 0}};
    const TubeWall wall(line, 4, 5);
    const auto refused = [&](const Chain& chain, const std::string& found) {
        for (const RelaxerKind kind : {RelaxerKind::FirstOrder, RelaxerKind::Segment, RelaxerKind::Geometric,
                                       RelaxerKind::Combined, RelaxerKind::Konings}) {
            RelaxerConfig config = of_kind(kind);
            EXPECT_NE(why_not(config.kind, chain.devices).find(found), std::string::npos)
                << why_not(config.kind, chain.devices);
            Chain wire = chain;
            EXPECT_THROW(make_relaxer(config, wall)->relax(wire, whole_cycles(5, 1)), std::invalid_argument);
        }
        EXPECT_EQ(why_not(RelaxerKind::Global, chain.devices), "");
    };
    Chain chain = wire_in_a_catheter(line);
    chain.devices[1].spec.friction = 0.1;
    assign(chain);
    refused(chain, "friction");
    chain = wire_in_a_catheter(line);
    for (StiffnessSection& s : chain.devices[1].spec.sections)
        s.torsional_distal = s.torsional_proximal = 100;
    assign(chain);
    refused(chain, "torsion");
    start_twists(chain, 1);
    refused(chain, "torsion");
}
