#include <gtest/gtest.h>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "engine/anatomy/scenes.h"
#include "physics/wall/distance_field.h"
#include "physics/wall/mesh_wall.h"
#include "physics/wall/tube_wall.h"
#include "tests/engine/fixtures.h"

using namespace physics;

TEST(LumenWall, APositionThatIsNotFiniteIsRefusedByEveryWallWithTheJointNamed) {
    const Polyline line = {{0, 0, 0}, {20, 0, 0}};
    const anatomy::Anatomy tube = anatomy::tube_anatomy("tube", line, 2);
    const TubeWall round(line, 2, 42);
    const MeshWall mesh(tube.lumen, tube.branches, tube.openings(), 42);
    const DistanceField field(tube.lumen, tube.branches, tube.openings(), 42);
    const double none = std::numeric_limits<double>::quiet_NaN(),
                 endless = std::numeric_limits<double>::infinity();
    for (const LumenWall* wall : {static_cast<const LumenWall*>(&round), static_cast<const LumenWall*>(&mesh),
                                  static_cast<const LumenWall*>(&field)})
        for (const double value : {none, -none, endless, -endless})
            for (int axis = 0; axis < 3; ++axis)
                for (const int station : {-1, 3}) {
                    std::vector<Vec3> joints(3, Vec3(10, 1, 0));
                    std::vector<WallContact> contacts(3);
                    for (WallContact& c : contacts) c.station = station;
                    EXPECT_NO_THROW(wall->contacts(joints, contacts));
                    joints[1][axis] = value;
                    SCOPED_TRACE(testing::Message() << value << " on axis " << axis);
                    test::expect_refusal<std::logic_error>([&] { wall->contacts(joints, contacts); },
                                                           "joint 1 of 3");
                }
}
