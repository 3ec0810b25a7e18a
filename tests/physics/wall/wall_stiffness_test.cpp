#include "physics/wall/wall_stiffness.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <stdexcept>

#include "engine/anatomy/scenes.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/distance_field.h"
#include "physics/wall/mesh_wall.h"
#include "physics/wire/energy.h"
#include "tests/finite_difference.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

/// Nine terms as in the paper, with amplitudes 2^-g k and some phases.
WallStiffness fourier(double mean, double length) {
    std::vector<WallStiffness::Term> terms;
    for (int g = 1; g <= 9; ++g) terms.push_back({mean * std::pow(2.0, -g) * 0.9, 1.7 * g * g});
    return {mean, length, terms};
}

std::vector<OpenEnd> openings(const anatomy::Anatomy& anatomy) {
    return {anatomy.ends[0].opening, anatomy.ends[1].opening};
}

/// A wire along the spatial scene pressed against its wall.
Chain pressed_wire(const TubeWall& tube) {
    studies::PlainWire spec{.curved_length = 0, .curved_angle = 0};
    Chain wire = wire_along(spec, tube.centreline(), 40);
    for (int i = 5; i <= 40; ++i)
        wire.tangents[i] = (wire.tangents[i] + Vec3(0.02, -0.11 * std::sin(0.4 * i), 0.1)).normalized();
    rebuild_joints(wire);
    return wire;
}

}  // namespace

TEST(WallStiffness, IsThePapersSeries) {
    // Eq. 41 by hand at ω/Ω = 1/3: cos(π/3 + 0) = 1/2, cos(2π/3 + π/3) = −1.
    const WallStiffness k(40, 162, {{8, 0}, {4, M_PI / 3}});
    EXPECT_NEAR(k.at(54), 40 + 4 - 4, 1e-12);
    EXPECT_NEAR(k.at(0), 40 + 8 + 2, 1e-12);
    EXPECT_NEAR(k.at(162), 40 - 8 + 2, 1e-12);
    EXPECT_EQ(WallStiffness(40).at(17), 40);
    EXPECT_EQ(WallStiffness(40).slope(17), 0);
}

TEST(WallStiffness, StaysPositiveAndBelowTwiceTheMean) {
    // The bounds that the paper gives, with the largest amplitudes and the phases π and 0.
    for (const double phase : {0.0, M_PI}) {
        std::vector<WallStiffness::Term> terms;
        for (int g = 1; g <= 9; ++g) terms.push_back({40 * std::pow(2.0, -g), phase});
        const WallStiffness k(40, 100, terms);
        EXPECT_NEAR(k.at(0), phase == 0 ? 80 - 40.0 / 512 : 40.0 / 512, 1e-12);
        for (double s = -10; s <= 110; s += 0.7) {
            EXPECT_GT(k.at(s), 0);
            EXPECT_LT(k.at(s), 80);
        }
    }
}

TEST(WallStiffness, SlopeIsTheDerivativeAndTheAverageTheIntegral) {
    const WallStiffness k = fourier(40, 120);
    for (const double s : {3.0, 41.7, 100.2}) {
        EXPECT_NEAR(k.slope(s), (k.at(s + 1e-5) - k.at(s - 1e-5)) / 2e-5, 1e-7 * 40);
        EXPECT_NEAR(k.average(s, s + 1e-6), k.at(s), 1e-5);
    }
    for (const auto& [from, to] : {std::pair{0.0, 120.0}, {13.0, 87.5}, {-20.0, 50.0}, {80.0, 190.0}}) {
        double sum = 0;
        const int count = 20'000;
        for (int i = 0; i < count; ++i) sum += k.at(from + (to - from) * (i + 0.5) / count);
        EXPECT_NEAR(k.average(from, to), sum / count, 1e-5) << from;
    }
    EXPECT_EQ(k.slope(-1), 0);  // beyond the profile the wall is as stiff as at its end
    EXPECT_EQ(k.at(121), k.at(120));
}

TEST(WallStiffness, RefusesAWallThatMightNotBeStiff) {
    EXPECT_THROW(WallStiffness(0), std::invalid_argument);
    EXPECT_THROW(WallStiffness{std::numeric_limits<double>::quiet_NaN()}, std::invalid_argument);
    EXPECT_THROW(WallStiffness(40, 0, {{1, 0}}), std::invalid_argument);
    EXPECT_THROW(WallStiffness(40, 100, {{30, 0}, {-10, 0}}), std::invalid_argument);
    EXPECT_THROW(WallStiffness(40, 100, {{std::numeric_limits<double>::infinity(), 0}}),
                 std::invalid_argument);
}

TEST(CentrelineCoordinate, GrowsSteadilyRoundABend) {
    // Off the centreline the closest point jumps at every corner on the inside of a bend; this way does not.
    const Polyline line = anatomy::draw(anatomy::find_scene("hairpin")->path, 0.5);
    const std::vector<double> ways = arc_lengths(line);
    for (const double aside : {-1.4, 0.0, 1.4}) {
        double before = 0.5;  // at the first point asked
        for (std::size_t i = 1; i + 1 < line.size(); ++i)
            for (int part = 0; part < 10; ++part) {
                const Vec3 across = (line[i + 1] - line[i - 1]).normalized().cross(Vec3::UnitZ());
                const Vec3 next =
                    (line[std::min(i + 2, line.size() - 1)] - line[i]).normalized().cross(Vec3::UnitZ());
                const double t = 0.1 * part;
                const Vec3 x = (1 - t) * (line[i] + aside * across) + t * (line[i + 1] + aside * next);
                const CentrelineCoordinate at = centreline_coordinate(line, ways, static_cast<int>(i), x);
                ASSERT_GE(at.arc, before - 1e-9) << i << " " << aside;
                ASSERT_LT(at.arc - before, 0.3) << i << " " << aside;
                before = at.arc;
                if (at.arc <= 0 || at.arc >= ways.back()) continue;
                const auto way = [&](const Eigen::VectorXd& p) {
                    return centreline_coordinate(line, ways, static_cast<int>(i), Vec3(p)).arc;
                };
                if (part > 0 && part < 9) {
                    ASSERT_LT((finite_gradient(way, x, 1e-4) - at.gradient).norm(), 1e-6) << i;
                }
            }
    }
}

TEST(WallStiffness, WallsAreAsStiffAsTheProfileSaysWhereAJointIs) {
    const anatomy::Scene& scene = *anatomy::find_scene("spatial");
    const Polyline line = anatomy::draw(scene.path);
    const WallStiffness k = fourier(40, 150);
    const anatomy::Anatomy anatomy = anatomy::tube_anatomy("tube", line, scene.radius, 24, 1.0);
    const TubeWall tube(line, scene.radius, k);
    const MeshWall mesh(anatomy.lumen, anatomy.branches, openings(anatomy), k);
    const std::vector<double> ways = arc_lengths(line);
    for (std::size_t i = 200; i < line.size() - 700; i += 211) {
        const Vec3 along = (line[i + 1] - line[i - 1]).normalized();
        const Vec3 x = line[i] + 2.02 * along.cross(Vec3(0.3, -0.2, 1)).normalized();
        EXPECT_NEAR(ask(tube, x).stiffness, k.at(ways[i]), 1e-6 * 40) << i;
        EXPECT_NEAR(ask(mesh, x).stiffness, k.at(ways[i]), 2e-3 * 40) << i;
        EXPECT_LT((ask(tube, x).stiffening - k.slope(ways[i]) * along).norm(),
                  0.2 * std::abs(k.slope(ways[i])) + 1e-3);
    }
}

TEST(WallStiffness, PushStaysTheGradientOfTheEnergy) {
    const Polyline line = anatomy::draw(anatomy::find_scene("spatial")->path);
    const TubeWall even(line, 2.0, 40.0), uneven(line, 2.0, fourier(40, 60));
    const Chain wire = pressed_wire(even);
    for (const LumenWall* wall :
         {static_cast<const LumenWall*>(&even), static_cast<const LumenWall*>(&uneven)}) {
        const auto contacts = all_contacts(wire, *wall);
        const auto gradient = energy_gradient(wire, contacts);
        double largest = 0, difference = 0;
        for (int i = 1; i <= wire.segments(); ++i) {
            Vec3 a, b;
            tangent_basis(wire.tangents[i], a, b);
            for (const Vec3& way : {a, b}) {
                auto energy = [&](double h) {
                    Chain other = wire;
                    other.tangents[i] = (other.tangents[i] + h * way).normalized();
                    rebuild_joints(other);
                    return total_energy(other, all_contacts(other, *wall)).total();
                };
                const double slope = (energy(1e-6) - energy(-1e-6)) / 2e-6;
                difference = std::max(difference, std::abs(slope - gradient[i].dot(way)));
                largest = std::max(largest, std::abs(slope));
            }
        }
        EXPECT_GT(largest, 10);
        EXPECT_LT(difference, 1e-5 * largest);
    }
}

TEST(WallStiffness, PushOfADistanceFieldIsTheGradientOfItsEnergyToo) {
    const anatomy::PenMove path[] = {anatomy::Run{4}, anatomy::Arc{12, 0.8, Vec3::UnitZ()}, anatomy::Run{4}};
    const Polyline line = anatomy::draw(path);
    const anatomy::Anatomy anatomy = anatomy::tube_anatomy("tube", line, 1.5, 32, 0.5);
    const WallStiffness k = fourier(40, 18);
    const DistanceField field(anatomy.lumen, anatomy.branches, openings(anatomy), k);
    const std::vector<double> ways = arc_lengths(line);
    for (const std::size_t i : {120, 170, 231}) {
        const Vec3 along = (line[i + 1] - line[i - 1]).normalized();
        const Vec3 x = line[i] + 1.62 * along.cross(Vec3(0.5, 0.2, -0.3)).normalized();
        const WallContact c = ask(field, x);
        ASSERT_GT(c.penetration, 0.05);
        EXPECT_NEAR(c.stiffness, k.at(ways[i]), 0.01 * 40) << i;
        EXPECT_GT(c.stiffening.norm(), 0.1) << i;
        const auto energy = [&](const Eigen::VectorXd& p) { return ask(field, Vec3(p)).energy(); };
        EXPECT_LT((finite_gradient(energy, x, 1e-4) - c.push()).norm(), 1e-6 * c.push().norm()) << i;
    }
}

TEST(WallStiffness, BothRelaxersRestAtTheSamePlaceInAVariedWall) {
    const anatomy::Scene& scene = *anatomy::find_scene("hairpin");
    const Polyline line = anatomy::draw(scene.path);
    const SceneSetup setup = scene_setup("hairpin");
    const TubeWall wall(line, scene.radius, fourier(scene.wall_stiffness, 70));
    const auto energy = [](const Chain& wire, const LumenWall& in) {
        return total_energy(wire, all_contacts(wire, in)).total();
    };
    Chain wire = wire_along(setup.wire.devices[0].spec, setup.wire.grid, line, 60);
    paper_relaxer(wall)->relax(wire, whole_cycles(60, 25));
    const double by_segments = energy(wire, wall);
    EXPECT_TRUE(global_relaxer(wall)->relax(wire, {1'000'000, 0, 0}).converged());
    EXPECT_LT(relative_gradient(wire, all_contacts(wire, wall)), 1e-8);
    EXPECT_NEAR(by_segments, energy(wire, wall), 1e-3 * by_segments);
    const double varied = energy(wire, wall);
    global_relaxer(setup.wall)->relax(wire, {1'000'000, 0, 0});
    EXPECT_GT(std::abs(energy(wire, setup.wall) - varied), 1e-5 * varied);  // the profile is felt
}

namespace {

/// The deepest joint of each half of a wire at rest [mm].
std::pair<double, double> deepest_halves(const LumenWall& wall, Chain wire) {
    global_relaxer(wall)->relax(wire, {2'000'000, 0, 0});
    const auto contacts = all_contacts(wire, wall);
    double proximal = 0, distal = 0;
    for (int i = 1; i <= wire.segments(); ++i) {
        double& deepest = 2 * i <= wire.segments() ? proximal : distal;
        deepest = std::max(deepest, contacts[i].penetration);
    }
    return {proximal, distal};
}

}  // namespace

TEST(WallVariation, AStifferHalfIsIndentedLessAndASofterOneMoreOnEveryWall) {
    const anatomy::Scene& scene = *anatomy::find_scene("sinuous");
    const Polyline line = anatomy::draw(scene.path);
    const anatomy::Anatomy tube = anatomy::tube_anatomy("sinuous", line, scene.radius, 48, 0.4);
    const Chain wire = wire_along(studies::PlainWire::uniform(scene.rigidity, 2), line, 80);
    const WallStiffness even(10), uneven = WallVariation{{{0.9, 0}}, 0}.of(10, 160);
    EXPECT_GT(uneven.average(0, 80), 1.5 * even.mean());
    const auto compare = [&](const char* kind, const LumenWall& uniform, const LumenWall& varied) {
        const auto [proximal, distal] = deepest_halves(uniform, wire);
        const auto [stiffer, softer] = deepest_halves(varied, wire);
        EXPECT_LT(stiffer, 0.9 * proximal) << kind;
        EXPECT_GT(softer, 1.1 * distal) << kind;
    };
    compare("tube", TubeWall(line, scene.radius, even), TubeWall(line, scene.radius, uneven));
    compare("mesh", MeshWall(tube.lumen, tube.branches, tube.openings(), even),
            MeshWall(tube.lumen, tube.branches, tube.openings(), uneven));
    compare("field", DistanceField(tube.lumen, tube.branches, tube.openings(), even),
            DistanceField(tube.lumen, tube.branches, tube.openings(), uneven));
}

TEST(WallVariation, TermsOfZeroChangeNothingToTheLastBit) {
    const SceneSetup scene = scene_setup("sinuous");
    const WallVariation nothing{{{0, 1}, {0, 2}}, 50};
    EXPECT_TRUE(nothing.of(42, 100).uniform());
    const TubeWall varied(scene.wall.centreline(), scene.wall.radius(), nothing.of(42, 100));
    Chain a = scene.wire, b = scene.wire;
    global_relaxer(scene.wall)->relax(a, unlimited);
    global_relaxer(varied)->relax(b, unlimited);
    for (int i = 0; i <= a.segments(); ++i) ASSERT_EQ(a.joints[i], b.joints[i]) << i;
}

TEST(WallVariation, IsDrawnWithinThePapersBoundsTheSameForTheSameSeed) {
    std::map<int, double> largest;
    for (std::uint64_t seed = 0; seed < 400; ++seed) {
        const WallVariation drawn = drawn_variation(seed);
        ASSERT_EQ(drawn.terms.size(), 9u);
        for (int g = 1; g <= 9; ++g) {
            const WallStiffness::Term& term = drawn.terms[g - 1];
            EXPECT_GE(term.amplitude, 0);
            EXPECT_LT(term.amplitude, std::pow(2.0, -g));
            EXPECT_GE(term.phase, 0);
            EXPECT_LT(term.phase, 2 * M_PI);
            largest[g] = std::max(largest[g], term.amplitude * std::pow(2.0, g));
            EXPECT_EQ(term.amplitude, drawn_variation(seed).terms[g - 1].amplitude);
        }
        EXPECT_LT(drawn.sum(), 1);
        EXPECT_NO_THROW(drawn.of(42, 100));
    }
    for (const auto& [g, fraction] : largest) EXPECT_GT(fraction, 0.98) << g;
    EXPECT_NE(drawn_variation(1).terms[0].amplitude, drawn_variation(2).terms[0].amplitude);
    EXPECT_NE(drawn_variation(1).terms[0].amplitude, drawn_variation(1 + (1ull << 32)).terms[0].amplitude);
}

TEST(WallVariation, GoesOverItsLengthOrTheWholeVessel) {
    const WallVariation own{{{0.5, 0}}, 60}, whole{{{0.5, 0}}, 0};
    EXPECT_EQ(own.of(40, 100).length(), 60);
    EXPECT_EQ(whole.of(40, 100).length(), 100);
    EXPECT_DOUBLE_EQ(own.of(40, 100).at(0), 60);
    EXPECT_DOUBLE_EQ(own.of(40, 100).at(80), 20);
    EXPECT_THROW((WallVariation{{{0.5, 0}, {-0.5, 0}}, 0}).of(40, 100), std::invalid_argument);
}
