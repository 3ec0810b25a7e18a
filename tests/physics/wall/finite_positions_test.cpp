#include <gtest/gtest.h>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "engine/anatomy/scenes.h"
#include "physics/wall/distance_field.h"
#include "physics/wall/mesh_wall.h"
#include "physics/wall/tube_wall.h"

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
                    try {
                        wall->contacts(joints, contacts);
                        ADD_FAILURE() << value << " on axis " << axis << " was answered";
                    } catch (const std::logic_error& error) {
                        EXPECT_NE(std::string(error.what()).find("joint 1 of 3"), std::string::npos)
                            << error.what();
                    }
                }
}
