#include "tests/physics/wild_relaxations.h"

#include <gtest/gtest.h>
#include <limits>
#include <stdexcept>

#include "tests/physics/wires.h"

using namespace physics;

TEST(WildRelaxations, EndWithinTheirBudgetInAFiniteStateOfUnchangedLengths) {
    int made = 0;
    for (unsigned seed = 1; seed <= 60; ++seed) {
        WildRelaxation relaxation(seed);
        if (!relaxation.made()) continue;
        ++made;
        std::string wrong;
        EXPECT_NO_THROW(wrong = relaxation.run()) << "seed " << seed;
        EXPECT_EQ(wrong, "");
    }
    EXPECT_GT(made, 40);
}

TEST(WildRelaxations, AWireAtRestInATubeStaysFiniteOnItsFacets) {
    // 413 segments over 175 mm: many pivots of no curvature follow one another here.
    const anatomy::Scene& scene = *anatomy::find_scene("sinuous");
    const Polyline line = anatomy::draw(scene.path);
    const anatomy::Anatomy facets = anatomy::tube_anatomy("sinuous", line, scene.radius, 48, 0.2);
    Chain wire =
        wire_along(studies::PlainWire::uniform(scene.rigidity, 175.0 / 413, EndCells::Paper), line, 413);
    const TubeWall tube(line, scene.radius, scene.wall_stiffness);
    global_relaxer(tube)->relax(wire, unlimited);
    const MeshWall mesh(facets.lumen, facets.branches, facets.openings(), scene.wall_stiffness);
    const double before = energy_of(wire, mesh);
    EXPECT_NO_THROW(global_relaxer(mesh)->relax(wire, unlimited));
    EXPECT_TRUE(validate(wire).empty());
    EXPECT_LE(energy_of(wire, mesh), before);
}

TEST(WildRelaxations, AWireThatIsNotFiniteIsAFaultOfTheCallerForEveryMethod) {
    const SceneSetup scene = scene_setup("hairpin");
    for (const RelaxerKind kind : {RelaxerKind::Global, RelaxerKind::Segment, RelaxerKind::FirstOrder,
                                   RelaxerKind::Geometric, RelaxerKind::Combined, RelaxerKind::Konings}) {
        RelaxerConfig config = of_kind(kind);
        Chain wire = scene.wire;
        wire.joints[0].y() = std::numeric_limits<double>::quiet_NaN();
        EXPECT_THROW(make_relaxer(config, scene.wall)->relax(wire, {1000, 0, 0}), std::logic_error);
    }
}

namespace {

/// A tube whose answers past x = 15 mm are broken in one way or the other.
class BrokenWall final : public LumenWall {
public:
    BrokenWall(const TubeWall& tube, int way) : tube_(tube), way_(way) {}
    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        tube_.contacts(joints, contacts);
        const double none = std::numeric_limits<double>::quiet_NaN(),
                     endless = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < joints.size(); ++i) {
            if (joints[i].x() < 15) continue;
            WallContact& c = contacts[i];
            c.trust = 0;
            switch (way_) {
                case 0:
                    c.penetration = none;
                    break;
                case 1:
                    c.penetration = endless;
                    break;
                case 2:
                    c.penetration = 1, c.stiffness = 1e200;
                    break;
                case 3:
                    c.penetration = 1, c.normal.setConstant(none);
                    break;
                case 4:
                    c.penetration = 1, c.curvature.setConstant(none);
                    break;
                default:
                    c.penetration = 1, c.clearance = 1e-300;
            }
        }
    }

private:
    const TubeWall& tube_;
    int way_;
};

}  // namespace

TEST(WildRelaxations, EveryMethodEndsInAFiniteStateOnAWallThatAnswersNonsense) {
    const SceneSetup scene = scene_setup("sinuous");
    for (const RelaxerKind kind : {RelaxerKind::Global, RelaxerKind::Segment, RelaxerKind::FirstOrder,
                                   RelaxerKind::Geometric, RelaxerKind::Combined, RelaxerKind::Konings})
        for (int way = 0; way < 6; ++way)
            for (int form = 0; form < (kind == RelaxerKind::Segment ? 4 : 1); ++form) {
                const BrokenWall wall(scene.wall, way);
                RelaxerConfig config = of_kind(kind);
                config.safeguard = form == 0;
                config.printed = form == 2;
                config.stored_planes = form == 3;
                Chain wire = wire_along(studies::PlainWire::uniform(50, 1), scene.wall.centreline(), 30);
                const auto relaxer = make_relaxer(config, wall);
                for (int call = 0; call < 2; ++call)
                    EXPECT_NO_THROW(relaxer->relax(wire, {3'000, 0, 0}))
                        << static_cast<int>(kind) << " " << way << " " << form;
                const auto wrong = validate(wire);
                EXPECT_TRUE(wrong.empty()) << static_cast<int>(kind) << " " << way << " " << form << ": "
                                           << (wrong.empty() ? "" : wrong.front());
            }
}
