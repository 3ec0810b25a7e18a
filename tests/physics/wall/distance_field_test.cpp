#include "physics/wall/distance_field.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <sstream>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/scenes.h"
#include "engine/io/files.h"
#include "physics/geometry/mapped_file.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/mesh_wall.h"
#include "physics/wall/past_end.h"
#include "physics/wire/energy.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

constexpr double fixed_stiffness = 20, fixed_wire_radius = 0.4;

DistanceField field_of(const anatomy::Anatomy& anatomy, double wire = 0.0,
                       const DistanceFieldOptions& options = {.threads = 2}) {
    return {anatomy.lumen, anatomy.branches, anatomy.openings(), fixed_stiffness, wire, options};
}

/// A coarser grid than the default and a narrow band: fast to build.
const DistanceField& iliac_field() {
    static const DistanceField field = field_of(test::iliac_renal(), fixed_wire_radius,
                                                {.spacing = 0.4, .inner = 0.6, .outer = 0.5, .threads = 2});
    return field;
}

/// Half a turn of a torus of radius 12 about the z axis, its tube of radius 2.
const anatomy::Anatomy& bend() {
    static const anatomy::Anatomy anatomy = [] {
        const std::vector<anatomy::PenMove> path = {anatomy::Arc{12, std::numbers::pi, Vec3::UnitZ()}};
        return anatomy::tube_anatomy("bend", anatomy::draw(path), 2.0, 192, 0.08);
    }();
    return anatomy;
}
const DistanceField& bend_field() {
    static const DistanceField field = field_of(bend());
    return field;
}
double distance_to_torus(const Vec3& x) {  // the pen turns about (0, 12, 0)
    return std::hypot(std::hypot(x.x(), x.y() - 12) - 12, x.z()) - 2;
}
Vec3 on_bend(double along, double around, double r) {
    const double far = 12 + r * std::cos(around);
    return {far * std::sin(along), 12 - far * std::cos(along), r * std::sin(around)};
}

/// A cone about the x axis whose radius grows from 1.6 mm on, to 6 mm over 30 mm.
constexpr double taper = 4.4 / 30;
anatomy::Anatomy cone(double length = 30, int around = 128) {
    anatomy::Anatomy anatomy = anatomy::tube_anatomy("cone", {{0, 0, 0}, {length, 0, 0}}, 1.0, around, 0.25);
    auto radius = [](double x) { return 1.6 + taper * x; };
    for (Vec3& v : anatomy.lumen.vertices) v.tail<2>() *= radius(v.x());
    for (std::size_t i = 0; i < anatomy.branches[0].points.size(); ++i)
        anatomy.branches[0].radii[i] = radius(anatomy.branches[0].points[i].x());
    for (anatomy::VesselEnd& end : anatomy.ends) end.opening.radius = radius(end.opening.centre.x());
    return anatomy;
}

/// The field of a cone of this length; facets are up to `sag` inside it [mm].
void expect_one_function(const DistanceField& field, double length, double sag) {
    const double h = field.spacing();
    std::mt19937 random(8);
    auto unit = [&] { return random() / 4294967296.0; };
    for (int n = 0; n < 3000; ++n) {
        const double along = 4 + (length - 8) * unit(), around = 6.28 * unit(),
                     r = 1.6 + taper * along + unit() - 0.6;
        Vec3 x(along, r * std::cos(around), r * std::sin(around));
        for (int d = 0; d < 3; ++d)
            if (n % 2 && n / 2 % (d + 2) == 0) x[d] = h * std::round(x[d] / h);
        const WallContact c = ask(field, x);
        const double distance = (std::hypot(x.y(), x.z()) - 1.6 - taper * x.x()) / std::hypot(1.0, taper);
        EXPECT_NEAR(c.penetration, distance, sag + 7e-4) << x.transpose();
        EXPECT_NEAR(c.normal.norm(), 1, 1.5e-2) << x.transpose();
        // Coefficients in single precision leave steps of up to 1e-7 mm between the two grids.
        const double e = 1e-3;
        for (int d = 0; d < 3; ++d) {
            const Vec3 step = e * Vec3::Unit(d);
            const WallContact up = ask(field, x + step, c.station), down = ask(field, x - step, c.station);
            EXPECT_NEAR((up.penetration - down.penetration) / (2 * e), c.normal[d], 1e-4) << x.transpose();
            const Vec3 bend = (up.normal - down.normal) / (2 * e);
            EXPECT_LT((bend - c.curvature.col(d)).norm(), 2e-3) << x.transpose();
        }
    }
}

/// Two straight tubes of radius 2 with walls 0.2 mm apart, along x.
anatomy::Anatomy close_tubes() {
    auto tube = [](double y) {
        return anatomy::tube_anatomy("tube", {{0, y, 0}, {20, y, 0}}, 2.0, 96, 0.25);
    };
    anatomy::Anatomy both = tube(0), other = tube(4.2);
    const int offset = static_cast<int>(both.lumen.vertices.size());
    both.lumen.vertices.insert(both.lumen.vertices.end(), other.lumen.vertices.begin(),
                               other.lumen.vertices.end());
    for (auto t : other.lumen.triangles)
        both.lumen.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    both.branches.push_back(other.branches[0]);
    both.ends.insert(both.ends.end(), other.ends.begin(), other.ends.end());
    return both;
}

std::string saved(const DistanceField& field) {
    std::ostringstream out;
    field.save(out);
    return out.str();
}

bool same_bits(const WallContact& a, const WallContact& b) {
    return a.penetration == b.penetration && a.normal == b.normal && a.curvature == b.curvature &&
           a.trust == b.trust && a.clearance == b.clearance && a.station == b.station;
}

}  // namespace

TEST(DistanceField, AgreesWithTheClosedFormAroundABend) {
    // Facets of 192 are up to 2(1 - cos(π/192)) = 2.7e-4 mm inside the tube, chords of 0.08 mm 7e-5 mm.
    double worst = 0, worst_slope = 0;
    for (double along = 0.4; along < 2.8; along += 0.037)
        for (double around = 0; around < 6.28; around += 0.31)
            for (double r : {1.2, 1.6, 1.9, 2.0, 2.1, 2.6, 3.2}) {
                const Vec3 x = on_bend(along, around, r);
                const WallContact c = ask(bend_field(), x);
                worst = std::max(worst, std::abs(c.penetration - distance_to_torus(x)));
                worst_slope = std::max(worst_slope, std::abs(c.normal.norm() - 1));
            }
    RecordProperty("worst_um", static_cast<int>(worst * 1e3));
    EXPECT_LT(worst, 1e-3 + 3.4e-4);
    EXPECT_LT(worst_slope, 5e-3);
}

TEST(DistanceField, CurvatureIsThatOfTheBend) {
    for (double along : {0.7, 1.6, 2.3})
        for (double around : {0.0, 1.1, 2.6, 4.0}) {
            const WallContact c = ask(bend_field(), on_bend(along, around, 2.05));
            const Vec3 round(std::cos(along), std::sin(along), 0);  // along the tube
            const Vec3 hoop = round.cross(c.normal).normalized();
            EXPECT_NEAR(hoop.dot(c.curvature * hoop), 1 / 2.05, 0.03);
            EXPECT_NEAR(round.dot(c.curvature * round), std::cos(around) / (12 + 2.05 * std::cos(around)),
                        0.03);
        }
}

TEST(DistanceField, NormalAndCurvatureAreDerivativesWithinACellAndAcrossItsBorders) {
    const double h = bend_field().spacing();
    std::mt19937 random(3);
    auto unit = [&] { return random() / 4294967296.0; };
    for (int n = 0; n < 300; ++n) {
        Vec3 x = on_bend(0.4 + 2.3 * unit(), 6.28 * unit(), 1.4 + 1.2 * unit());
        // Every other point on a face, an edge or a corner between cells: differences straddle it.
        for (int d = 0; d < 3; ++d)
            if (n % 2 && n / 2 % (d + 2) == 0) x[d] = h * std::round(x[d] / h);
        const WallContact c = ask(bend_field(), x);
        const double e = 1e-4;
        for (int d = 0; d < 3; ++d) {
            const Vec3 step = e * Vec3::Unit(d);
            const WallContact up = ask(bend_field(), x + step, c.station);
            const WallContact down = ask(bend_field(), x - step, c.station);
            // The third derivative jumps at a border and is about 1/mm² elsewhere: e² and e/2 of it are seen.
            EXPECT_NEAR((up.penetration - down.penetration) / (2 * e), c.normal[d], 1e-6);
            const Vec3 bend = (up.normal - down.normal) / (2 * e);
            EXPECT_LT((bend - c.curvature.col(d)).norm(), n % 2 ? 1e-4 : 1e-5) << x.transpose();
        }
    }
}

TEST(DistanceField, IsOneFunctionFromANarrowVesselToTheWidest) {
    // To a radius of 10.4 mm, 39 spacings: the coarsest grid is asked for from 6.4 mm on.
    const DistanceField field = field_of(cone(60, 192));
    const std::size_t uniform =
        field_of(cone(60, 192), 0, {.spacing = field.spacing(), .threads = 2}).bytes();
    EXPECT_LT(field.bytes(), 0.25 * static_cast<double>(uniform));
    const FieldEstimate expected = DistanceField::estimate(cone(60, 192).branches);
    EXPECT_EQ(expected.spacing, field.spacing());
    EXPECT_NEAR(expected.bytes / static_cast<double>(field.bytes()), 1, 0.5);
    expect_one_function(field, 60, 1.4e-3);  // 10.4(1 - cos(π/192))
}

TEST(DistanceField, RelaxesAWireToTheEnergyOfTheTubeWall) {
    const anatomy::Scene& scene = *anatomy::find_scene("hairpin");
    const anatomy::Anatomy anatomy =
        anatomy::tube_anatomy("hairpin", anatomy::draw(scene.path), scene.radius, 96, 0.2);
    const DistanceField field(anatomy.lumen, anatomy.branches, anatomy.openings(), scene.wall_stiffness, 0.0,
                              {.threads = 2});
    const SceneSetup setup = scene_setup("hairpin");
    auto relaxed = [&](const LumenWall& wall) {
        Chain wire = setup.wire;
        global_relaxer(wall)->relax(wire, whole_cycles(wire.segments(), 12));
        EXPECT_TRUE(validate(wire).empty());
        return total_energy(wire, all_contacts(wire, wall)).total();
    };
    // The mesh is up to 8e-4 mm narrower in its facets, 1e-3 in the chords of its bends; 40 mm of wire bent
    // by 13.5 N·mm feel 1e-3 mm of the wall as 0.004 N·mm.
    const double of_tube = relaxed(setup.wall);
    EXPECT_NEAR(relaxed(field), of_tube, 0.005);
    // The planes of its facets are up to 0.01 mm narrower.
    const MeshWall mesh(anatomy.lumen, anatomy.branches, anatomy.openings(), scene.wall_stiffness);
    EXPECT_NEAR(relaxed(mesh), of_tube, 0.1);
}

TEST(DistanceField, PushesAJointBackFromFarOutside) {
    for (double r : {2.5, 3.4, 4.0, 6.0, 9.0})
        for (double around : {0.3, 2.0, 3.1, 5.0}) {
            const Vec3 x = on_bend(1.3, around, r);
            const WallContact c = ask(bend_field(), x, ask(bend_field(), on_bend(1.3, around, 1.0)).station);
            EXPECT_NEAR(c.penetration, r - 2, 0.02 * r);
            EXPECT_GT(c.normal.dot(on_bend(1.3, around, 2) - on_bend(1.3, around, 0)), 1.9);
        }
}

TEST(DistanceField, PushIsTheSlopeOfTheEnergyOutsideTheBandToo) {
    std::mt19937 random(11);
    std::normal_distribution<double> bell;
    const auto stations = iliac_field().tree().stations();
    constexpr double h = 1e-3;
    int asked = 0, wrong = 0;
    for (int n = 0; n < 2000; ++n) {
        const Station& s = stations[random() % stations.size()];
        const Vec3 way = Vec3(bell(random), bell(random), bell(random)).normalized();
        const Vec3 x = s.centre + (1 + random() / 4294967296.0) * s.radius * way;
        const WallContact c = ask(iliac_field(), x);
        const auto energy = [&](const Vec3& at) {
            const WallContact there = ask(iliac_field(), at, c.station);
            return there.touches() ? there.energy() : 0;
        };
        if (!c.touches()) continue;
        ++asked;
        Vec3 slope;
        for (int d = 0; d < 3; ++d)
            slope[d] = (energy(x + h * Vec3::Unit(d)) - energy(x - h * Vec3::Unit(d))) / (2 * h);
        // Where the place that it goes on from is another node of the grid, the continuation has a step; and
        // the slope has one where the station or its nearest piece is another.
        wrong += !((slope - c.push()).norm() < 1e-3 * c.push().norm());
    }
    EXPECT_GT(asked, 1000);
    EXPECT_LT(wrong, 0.02 * asked) << asked;
}

TEST(DistanceField, AJointTouchesNothingWithinItsTrust) {
    std::mt19937 random(5);
    std::normal_distribution<double> bell;
    const auto stations = iliac_field().tree().stations();
    for (int n = 0; n < 20000; ++n) {
        const Station& s = stations[random() % stations.size()];
        const Vec3 way = Vec3(bell(random), bell(random), bell(random)).normalized();
        const Vec3 x = s.centre + s.radius * std::cbrt(random() / 4294967296.0) * way;
        const WallContact c = ask(iliac_field(), x);
        if (c.trust <= 0) continue;
        const Vec3 to = x + c.trust * Vec3(bell(random), bell(random), bell(random)).normalized();
        EXPECT_FALSE(ask(iliac_field(), to, c.station).touches()) << x.transpose();
    }
}

/// Out of an open end by `out`, beside its axis by `r` of its radii.
Vec3 past(const OpenEnd& end, double out, double r, double angle) {
    Vec3 a, b;
    tangent_basis(end.outward_normal, a, b);
    return end.centre + out * end.outward_normal +
           r * end.radius * (std::cos(angle) * a + std::sin(angle) * b);
}

/// Depth of a joint off the axis of the cone past an end, from one radius past its plane on.
double round_depth(const OpenEnd& end, double out, double r, double joint) {
    const double narrows = (end.radius - 0.3 - 0.375 * std::min(0.5, 0.25 * end.radius)) / (14 * end.radius);
    return r * end.radius - (end.radius - narrows * (out - 0.125 * end.radius)) + joint;
}

TEST(DistanceField, TheVesselGoesOnRoundAndNarrowingPastAnEnd) {
    std::mt19937 random(6);
    std::uniform_real_distribution<double> unit(0, 1);
    for (const OpenEnd& end : test::iliac_renal().openings()) {
        const int station = iliac_field().tree().locate(end.centre, -1);
        for (int n = 0; n < 1000; ++n) {
            const double out = end.radius * (1 + 13 * unit(random)), r = 0.25 + 3 * unit(random);
            const WallContact c =
                ask(iliac_field(), past(end, out, r, 2 * std::numbers::pi * unit(random)), station);
            EXPECT_NEAR(c.penetration, round_depth(end, out, r, fixed_wire_radius), 1e-9)
                << end.name << " " << out << " " << r;
        }
        EXPECT_FALSE(ask(iliac_field(), past(end, 0.4 * end.radius, 0.5, 1), station).touches()) << end.name;
        EXPECT_TRUE(ask(iliac_field(), past(end, 14 * end.radius + 1, 0, 0), station).touches()) << end.name;
    }
}

TEST(DistanceField, TheAorticRootIsPastTheEndWhereTheValveIs) {
    anatomy::Anatomy tube = anatomy::tube_anatomy("root", {{0, 0, 0}, {40, 0, 0}}, 12.0, 64, 1.0);
    tube.body = {Landmark::AorticValve, Vec3(1, 2, 0)};
    const DistanceField field = field_of(tube, 0.4);
    const OpenEnd root = tube.openings()[0], other = tube.openings()[1];
    EXPECT_EQ(root.goes_on, Continuation::Root);
    EXPECT_EQ(other.goes_on, Continuation::Artery);
    EXPECT_TRUE(ask(field, past(root, 22.5, 0.62, 0)).touches());
    EXPECT_FALSE(ask(field, past(root, 21, 0.62, 0)).touches());
    // The closed valve costs a joint in its middle what its cusps do, and nothing below.
    const double parted = cones_past(root).seam.force(0.4);  // by a joint that stands for 1 mm [N·mm]
    EXPECT_NEAR(ask(field, past(root, cones_past(root).seam.middle, 0, 0)).energy(), parted, 1e-9);
    EXPECT_FALSE(ask(field, past(root, 24.5, 0, 0)).touches());
    EXPECT_FALSE(ask(field, past(other, 22.5, 0.58, 0)).touches());
}

TEST(DistanceField, HasNoStepAtAnOpenEnd) {
    constexpr double h = 1e-5, step = 0.02;
    for (const OpenEnd& end : test::iliac_renal().openings())
        for (const double angle : {0.3, 2.4, 4.5}) {
            WallContact before;
            for (double out = -1; out < 9.9; out += step) {
                const Vec3 x = past(end, out, 1.05, angle);
                const WallContact c = ask(iliac_field(), x);
                if (out > -1 && before.touches()) {
                    const double slope = before.push().dot(end.outward_normal);
                    EXPECT_NEAR(c.energy() - before.energy(), slope * step, 0.02 * fixed_stiffness * step)
                        << end.name << " " << out;
                }
                before = c;
                if (!c.touches() || out < 0.01) continue;
                const Vec3 back = end.outward_normal * h;
                const WallContact lower = ask(iliac_field(), x - back, c.station),
                                  upper = ask(iliac_field(), x + back, c.station);
                const double scale = std::max(1.0, c.penetration);
                EXPECT_NEAR((upper.penetration - lower.penetration) / (2 * h),
                            c.normal.dot(end.outward_normal), 1e-5 * scale)
                    << end.name << " " << out;
                EXPECT_LT(((upper.normal - lower.normal) / (2 * h) - c.curvature * end.outward_normal).norm(),
                          1e-3 * scale)
                    << end.name << " " << out;
            }
        }
}

TEST(DistanceField, HasNoStepBesideTheWayOutOfAnEnd) {
    constexpr double step = 0.02;
    for (const OpenEnd& end : test::iliac_renal().openings())
        for (const double out : {1.0, 4.0, 8.0, 9.5})
            for (const double angle : {0.3, 2.4, 4.5}) {
                WallContact before = ask(iliac_field(), past(end, out, 0.5, angle));
                for (double r = 0.5; r < 6; r += step / end.radius) {
                    const WallContact c = ask(iliac_field(), past(end, out, r, angle), before.station);
                    EXPECT_LT(std::max(0.0, c.penetration) - std::max(0.0, before.penetration), 10 * step)
                        << end.name << ", " << out << " mm past it, " << r << " radii beside it";
                    before = c;
                }
            }
}

TEST(DistanceField, FeelsTheWallUpToTheOpenEnd) {
    const DistanceField& field = bend_field();
    for (double before : {0.02, 0.1, 0.3, 0.6})
        for (double r : {1.7, 2.0, 2.3}) {
            const Vec3 x = on_bend(before / 12, 0.7, r);
            EXPECT_NEAR(ask(field, x).penetration, r - 2, 0.01) << before;
        }
}

TEST(DistanceField, KeepsVesselsApartThatNearlyTouch) {
    const anatomy::Anatomy anatomy = close_tubes();
    const DistanceField field = field_of(anatomy);
    // Out of the first tube, through the gap and the other's wall, to the other's axis and beyond.
    int station = ask(field, {10, 0, 0}).station;
    for (double y = 1.0; y < 5.0; y += 0.05) {
        const WallContact c = ask(field, {10, y, 0.1}, station);
        station = c.station;
        EXPECT_EQ(field.tree().stations()[station].branch, 0);
        const double distance = std::hypot(y, 0.1) - 2;
        EXPECT_NEAR(c.penetration, distance, 0.01);
        EXPECT_GT(c.normal.y(), 0.98);
    }
    // And a joint of the other tube feels its own wall there.
    station = ask(field, {10, 4.2, 0}).station;
    EXPECT_NEAR(ask(field, {10, 2.0, 0}, station).penetration, 0.2, 0.002);
    EXPECT_LT(ask(field, {10, 2.0, 0}, station).normal.y(), -0.98);
}

TEST(DistanceField, KeepsTheLimbsOfATightBendApart) {
    const std::vector<anatomy::PenMove> path = {
        anatomy::Run{12}, anatomy::Arc{2.1, std::numbers::pi, Vec3::UnitZ()}, anatomy::Run{12}};
    const anatomy::Anatomy anatomy = anatomy::tube_anatomy("loop", anatomy::draw(path), 2.0, 64, 0.2);
    const DistanceField field = field_of(anatomy);
    const int station = ask(field, {3, 0, 0}).station;
    for (double y : {1.9, 2.0, 2.1, 2.3}) {
        EXPECT_NEAR(ask(field, {3, y, 0}, station).penetration, y - 2, 0.01) << y;
        EXPECT_GT(ask(field, {3, y, 0}, station).normal.y(), 0.98) << y;
    }
}

TEST(DistanceField, MakesNoJumpBetweenAVesselAndItsBranches) {
    int crossings = 0, felt = 0;
    for (const CentrelineBranch& child : test::iliac_renal().branches)
        for (int n = 0; child.parent >= 0 && n < 128; ++n) {
            const double around = n / 4 * 0.2, fraction = 0.65 + 0.13 * (n % 4);
            std::vector<Vec3> way;  // along one side of the branch, from within its parent
            for (std::size_t i = 0; i < 60; ++i)
                for (double t = 0; t < 1; t += 0.1) {
                    Vec3 a, b;
                    tangent_basis((child.points[40] - child.points[10]).normalized(), a, b);
                    way.push_back(child.points[i] + t * (child.points[i + 1] - child.points[i]) +
                                  fraction * child.radii[i] * (std::cos(around) * a + std::sin(around) * b));
                }
            way.insert(way.end(), way.rbegin(), way.rend());  // and back
            WallContact before = ask(iliac_field(), way[0]);
            for (std::size_t i = 1; i < way.size(); ++i) {
                const WallContact c = ask(iliac_field(), way[i], before.station);
                const auto stations = iliac_field().tree().stations();
                crossings += stations[c.station].branch != stations[before.station].branch;
                const double step = (way[i] - way[i - 1]).norm();
                // Where both know the wall, it is one function: 1-Lipschitz but for the spline's waves.
                if (c.normal != Vec3::Zero() && before.normal != Vec3::Zero()) {
                    ++felt;
                    EXPECT_LE(std::abs(c.penetration - before.penetration), 1.05 * step + 1e-3)
                        << way[i].transpose();
                }
                if (c.touches() != before.touches()) {  // a touch begins and ends gently
                    EXPECT_LT(std::abs(c.touches() ? c.penetration : before.penetration), 1.05 * step + 1e-3)
                        << way[i].transpose();
                }
                before = c;
            }
        }
    EXPECT_GT(crossings, 100);
    EXPECT_GT(felt, 10000);
}

TEST(DistanceField, FindsAJointInTheBranchThatItWentIntoWhileItsParentKeptIt) {
    const auto stations = iliac_field().tree().stations();
    std::mt19937 random(20261126);
    auto unit = [&] { return random() / 4294967296.0; };
    int found = 0;
    for (int n = 0; n < 4000; ++n) {
        const auto& branches = test::iliac_renal().branches;
        const CentrelineBranch& child = branches[random() % branches.size()];
        if (child.parent < 0) continue;
        const std::size_t i = random() % child.points.size();
        // The parent's station that a joint at the child's sample is nearest to.
        const Vec3 &centre = child.points[i], x = centre + 0.5 * child.radii[i] * unit() * Vec3::UnitZ();
        int kept = -1;
        for (int s = 0; s < static_cast<int>(stations.size()); ++s)
            if (stations[s].branch == child.parent &&
                (kept < 0 || stations[s].power(x) < stations[kept].power(x)))
                kept = s;
        const double way = static_cast<double>(i) * (child.points[1] - child.points[0]).norm();
        // Clear of the parent, and not farther than it sees.
        const double gap = std::sqrt(std::max(0.0, stations[kept].power(x) +
                                                       stations[kept].radius * stations[kept].radius)) -
                           stations[kept].radius - child.radii[i];
        if (gap < 0.5 * child.radii[i] || way > 2 * (stations[kept].radius + child.radii[i])) continue;
        ++found;
        for (const bool held : {false, true}) {
            WallContact c;
            c.station = kept;
            c.held = held;
            iliac_field().contacts({&x, 1}, {&c, 1});
            EXPECT_EQ(stations[c.station].branch, stations[ask(iliac_field(), x).station].branch)
                << child.name << ", sample " << i;
            EXPECT_FALSE(c.held);
            EXPECT_EQ(c.penetration, ask(iliac_field(), x, c.station).penetration);
        }
    }
    EXPECT_GT(found, 30);
}

TEST(DistanceField, KnowsInsideFromOutside) {
    // Against the capped mesh's winding number, wherever the wall is more than 0.1 mm away.
    std::mt19937 random(11);
    std::normal_distribution<double> bell;
    const TriangleMesh closed = anatomy::closed_lumen(test::iliac_renal());
    const MeshWall rays(test::iliac_renal().lumen, test::iliac_renal().branches,
                        test::iliac_renal().openings(), fixed_stiffness);
    int asked = 0, wrong = 0;
    while (asked < 500) {
        const auto stations = iliac_field().tree().stations();
        const Station& s = stations[random() % stations.size()];
        const Vec3 way = Vec3(bell(random), bell(random), bell(random)).normalized();
        const Vec3 x = s.centre + s.radius * (0.7 + 0.5 * (random() / 4294967296.0)) * way;
        bool at_end = false;
        for (const OpenEnd& end : test::iliac_renal().openings())
            at_end |= (x - end.centre).norm() < 3 * end.radius;
        if (at_end) continue;
        const WallContact c = ask(iliac_field(), x);
        const double d = c.penetration - fixed_wire_radius;
        if (c.normal == Vec3::Zero() || std::abs(d) < 0.1) continue;
        double angle = 0;  // solid angle of the surface (van Oosterom and Strackee 1983)
        for (const auto& t : closed.triangles) {
            const Vec3 p = closed.vertices[t[0]] - x, q = closed.vertices[t[1]] - x,
                       r = closed.vertices[t[2]] - x;
            const double np = p.norm(), nq = q.norm(), nr = r.norm();
            angle += 2 * std::atan2(p.dot(q.cross(r)),
                                    np * nq * nr + p.dot(q) * nr + q.dot(r) * np + r.dot(p) * nq);
        }
        ++asked;
        wrong += (angle > 2 * std::numbers::pi) != (d < 0);
    }
    EXPECT_EQ(wrong, 0) << "of " << asked;  // at most 0.1 %
}

TEST(DistanceField, IsTheSameHoweverTrianglesAreTurned) {
    anatomy::Anatomy anatomy = anatomy::tube_anatomy("tube", {{0, 0, 0}, {8, 1, 2}}, 1.5, 48, 0.3);
    const DistanceField whole = field_of(anatomy);
    std::mt19937 random(2);
    for (auto& t : anatomy.lumen.triangles)
        if (random() % 20 == 0) std::swap(t[0], t[1]);
    const DistanceField flipped = field_of(anatomy);
    for (auto& t : anatomy.lumen.triangles) std::swap(t[1], t[2]);
    const DistanceField inverted = field_of(anatomy);
    for (double r = 0.5; r < 2.5; r += 0.1) {
        const Vec3 x(4, 0.5 + r * 0.6, 1 - r * 0.8);
        EXPECT_TRUE(same_bits(ask(whole, x), ask(flipped, x)));
        EXPECT_TRUE(same_bits(ask(whole, x), ask(inverted, x)));
    }
}

TEST(DistanceField, HasTheSameBitsForAnyNumberOfThreads) {
    const anatomy::Anatomy anatomy = anatomy::tube_anatomy("tube", {{0, 0, 0}, {8, 1, 2}}, 1.5, 48, 0.3);
    const std::string one = saved(field_of(anatomy, 0, {.threads = 1}));
    EXPECT_EQ(one, saved(field_of(anatomy, 0, {.threads = 2})));
    EXPECT_EQ(one, saved(field_of(anatomy, 0, {.threads = 5})));
    EXPECT_EQ(saved(field_of(cone(), 0, {.threads = 1})), saved(field_of(cone(), 0, {.threads = 3})));
}

TEST(DistanceField, ComesBackFromAStreamWithEqualBits) {
    const std::string text = saved(bend_field());
    const auto print =
        DistanceField::fingerprint(bend().lumen, bend().branches, bend().openings(), {.threads = 9});
    const test::TemporaryFolder folder;
    io::write_whole(folder / "field.bin", text);
    const auto load = [&](std::span<const std::byte> bytes, std::shared_ptr<const void> held) {
        return DistanceField::load(bytes, std::move(held), print, bend().branches, bend().openings(),
                                   fixed_stiffness, 0.0);
    };
    auto file = geometry::MappedFile::of(folder / "field.bin");
    ASSERT_TRUE(file);
    const DistanceField copied = load(std::as_bytes(std::span(text)), nullptr),
                        mapped = load(file->bytes(), file);
    // What is mapped stays when the file goes.
    file.reset();
    std::filesystem::remove(folder / "field.bin");
    for (const DistanceField* back : {&copied, &mapped}) {
        EXPECT_EQ(saved(*back), text);
        for (double around = 0; around < 6; around += 0.1) {
            const Vec3 x = on_bend(1 + 0.2 * around, around, 1.0 + 0.3 * around);
            EXPECT_TRUE(same_bits(ask(*back, x), ask(bend_field(), x)));
        }
    }
}

TEST(DistanceField, RefusesAStreamThatIsDamagedCutShortOrOfAnotherLumen) {
    const anatomy::Anatomy anatomy = anatomy::tube_anatomy("tube", {{0, 0, 0}, {6, 0, 0}}, 1.5, 32, 0.5);
    const auto print = DistanceField::fingerprint(anatomy.lumen, anatomy.branches, anatomy.openings());
    const std::string text = saved(field_of(anatomy));
    auto load = [&](const std::string& from, std::uint64_t fingerprint) {
        DistanceField::load(std::as_bytes(std::span(from)), nullptr, fingerprint, anatomy.branches,
                            anatomy.openings(), 20);
    };
    EXPECT_NO_THROW(load(text, print));
    EXPECT_THROW(load(text, print + 1), std::runtime_error);
    for (std::size_t length : {0ul, 5ul, 27ul, 100ul, text.size() / 2, text.size() - 1})
        EXPECT_THROW(load(text.substr(0, length), print), std::runtime_error) << length;
    EXPECT_THROW(load(text + "x", print), std::runtime_error);
    for (std::size_t at : {3ul, 10ul, 15ul, 24ul, 40ul, 70ul, text.size() / 2, text.size() - 1}) {
        std::string bad = text;
        bad[at] ^= 0x10;
        EXPECT_THROW(load(bad, print), std::runtime_error) << at;
    }
}

TEST(DistanceField, TellsItsProgress) {
    const anatomy::Anatomy anatomy = anatomy::tube_anatomy("tube", {{0, 0, 0}, {6, 0, 0}}, 1.5, 32, 0.5);
    std::vector<double> fractions;
    const DistanceField field(anatomy.lumen, anatomy.branches, anatomy.openings(), 20, 0,
                              {.threads = 1},  // others tell nothing
                              [&](double fraction) { fractions.push_back(fraction); });
    EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
    ASSERT_GT(fractions.size(), 5u);
    EXPECT_GE(fractions.front(), 0);
    EXPECT_EQ(fractions.back(), 1);
}

TEST(DistanceField, RefusesWhatItCannotHold) {
    const anatomy::Anatomy anatomy = anatomy::tube_anatomy("tube", {{0, 0, 0}, {6, 0, 0}}, 1.5, 32, 0.5);
    EXPECT_THROW(field_of(anatomy, 0, {.spacing = 1e-3}), std::invalid_argument);
    EXPECT_THROW(field_of(anatomy, 0, {.spacing = -1}), std::invalid_argument);
    EXPECT_THROW(field_of(anatomy, 2.0), std::invalid_argument);  // a wire thicker than the field is deep
    anatomy::Anatomy micrometres = anatomy;
    for (Vec3& v : micrometres.lumen.vertices) v *= 1e3;
    for (Vec3& v : micrometres.branches[0].points) v *= 1e3;
    for (double& r : micrometres.branches[0].radii) r *= 1e3;
    EXPECT_THROW(field_of(micrometres), std::invalid_argument);
    EXPECT_THROW(DistanceField({}, anatomy.branches, {}, 20), std::invalid_argument);
    EXPECT_THROW(DistanceField(anatomy.lumen, {}, {}, 20), std::invalid_argument);
    EXPECT_THROW(DistanceField(anatomy.lumen, anatomy.branches, {}, -1), std::invalid_argument);
}
