/// A wire under a load: both relaxers against beam theory and against each other.

#include <cmath>
#include <gtest/gtest.h>

#include "physics/energy.h"
#include "physics/relaxer.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

constexpr double kLength = 40, kRigidity = 50, kWeight = 1e-5;  // [mm], [N·mm²], [N/mm]

/// How far the end of a horizontal wire, clamped at its base and far from any wall, sinks [mm].
double sag(RelaxerKind kind, int segments) {
    Guidewire wire = uniform_wire(kRigidity, kLength / segments, {0, 0, 0}, {1, 0, 0},
                                  std::vector<Vec3>(segments, Vec3::UnitX()));
    wire.load = Vec3(0, 0, -kWeight);
    const TubeWall wall({{-10, 0, 0}, {60, 0, 0}}, 30.0, 40);
    RelaxerConfig config;
    config.kind = kind;
    config.varied_segments = 1;
    const RelaxReport report = make_relaxer(config)->relax(wire, wall, {2'000'000, 0, 0});
    EXPECT_TRUE(report.converged);
    EXPECT_NEAR(wire.tip().y(), 0, 1e-12);
    return -wire.tip().z();
}

}  // namespace

TEST(LoadedWire, SagsAsABeamUnderItsWeight) {
    // w L⁴/8EI. A load and a bend at every joint make it 10/3N larger, which two lengths of segments take
    // out.
    const double beam = kWeight * std::pow(kLength, 4) / (8 * kRigidity);
    for (const RelaxerKind kind : {RelaxerKind::Global, RelaxerKind::Segment}) {
        const double coarse = sag(kind, 10), fine = sag(kind, 20);
        EXPECT_NEAR((coarse - beam) / (fine - beam), 2, 0.1);
        EXPECT_NEAR(2 * fine - coarse, beam, 0.02 * beam);
    }
    EXPECT_NEAR(2 * sag(RelaxerKind::Global, 400) - sag(RelaxerKind::Global, 200), beam, 5e-5 * beam);
}

TEST(LoadedWire, RestsInATubeWhereBothRelaxersSay) {
    const Polyline line = engine::draw(engine::find_scene("spatial")->path);
    const TubeWall wall(line, 2.0, 40, 0.44);
    GuidewireSpec spec;
    spec.segment_length = 2;
    spec.tip_length = 20;
    Guidewire unloaded = wire_along(spec, line, 40), wire = unloaded;
    wire.load = Vec3(0.005, 0.01, -0.02);
    Guidewire other = wire;
    RelaxerConfig segment;
    segment.kind = RelaxerKind::Segment;
    const RelaxBudget unlimited{1'000'000'000, 0, 0};
    make_relaxer({})->relax(unloaded, wall, unlimited);
    const RelaxReport report = make_relaxer({})->relax(wire, wall, unlimited);
    EXPECT_TRUE(report.converged);
    make_relaxer(segment)->relax(other, wall, whole_cycles(40, 150));
    double farthest = 0, moved = 0;
    for (int i = 0; i <= 40; ++i) {
        farthest = std::max(farthest, (wire.joints[i] - other.joints[i]).norm());
        moved = std::max(moved, (wire.joints[i] - unloaded.joints[i]).norm());
    }
    EXPECT_GT(moved, 0.5);
    EXPECT_LT(farthest, 1e-3);
    EXPECT_NEAR(total_energy(wire, all_contacts(wire, wall)).total(),
                total_energy(other, all_contacts(other, wall)).total(), 1e-6);
}
