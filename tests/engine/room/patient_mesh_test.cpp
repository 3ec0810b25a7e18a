/// What the view into the patient is made of.

#include "engine/room/patient_mesh.h"

#include <algorithm>
#include <gtest/gtest.h>

#include "tests/anatomies.h"

namespace room {
namespace {

void expect_sound(const PatientMesh& mesh, std::size_t corners) {
    ASSERT_FALSE(mesh.indices.empty());
    EXPECT_EQ(mesh.indices.size() % corners, 0u);
    EXPECT_LT(*std::ranges::max_element(mesh.indices), mesh.vertices.size());
    for (const PatientVertex& vertex : mesh.vertices) ASSERT_TRUE(vertex.place.allFinite());
}

TEST(PatientMesh, LumenIsThatOfTheAnatomyAndMovesWithItsWall) {
    const anatomy::Anatomy& anatomy = test::iliac_renal();
    const PatientMesh still = lumen_mesh(anatomy, {});
    expect_sound(still, 3);
    ASSERT_EQ(still.vertices.size(), anatomy.lumen.vertices.size());
    EXPECT_EQ(still.indices.size(), 3 * anatomy.lumen.triangles.size());
    std::vector<Eigen::Vector3f> moves(still.vertices.size(), Eigen::Vector3f::Zero());
    moves[7] = {0, 0, 3};
    const PatientMesh moved = lumen_mesh(anatomy, moves);
    EXPECT_NEAR(moved.vertices[7].place.z(), still.vertices[7].place.z() + 3, 1e-4);
    EXPECT_EQ(moved.vertices[8].place, still.vertices[8].place);
}

TEST(PatientMesh, DevicesAreTubesAndTheirForcesLines) {
    SolverView solver;
    for (int k = 0; k < 5; ++k) solver.joints.push_back({0, 0, 10.0 * k});
    solver.radii.assign(5, 0.5f);
    const PatientMesh tube = device_mesh(solver);
    expect_sound(tube, 3);
    EXPECT_EQ(tube.vertices.size(), 40u);
    for (const PatientVertex& vertex : tube.vertices) EXPECT_NEAR(vertex.place.head<2>().norm(), 1, 1e-3);
    EXPECT_TRUE(force_lines(solver).vertices.empty());
    solver.contacts.resize(5);
    EXPECT_TRUE(force_lines(solver).indices.empty());
}

TEST(PatientMesh, TargetIsABallOfItsRadius) {
    const PatientMesh ball = target_mesh({1, 2, 3}, 6);
    expect_sound(ball, 3);
    for (const PatientVertex& vertex : ball.vertices)
        EXPECT_NEAR((vertex.place - Eigen::Vector3f(1, 2, 3)).norm(), 6, 1e-4);
}

TEST(PatientMesh, ForcesGoFromBlueToYellow) {
    const auto blue = [](double force) { return int{force_colour(force).blue} - force_colour(force).red; };
    EXPECT_GT(blue(0), 50);
    EXPECT_GT(blue(0.001), 50);
    EXPECT_LT(blue(0.5), -100);
    EXPECT_LT(blue(0.2), blue(0.02));
    EXPECT_EQ(force_legend(), "wall force 0.001 to 0.5 N");
}

TEST(PatientMesh, TheEyeStaysOutsideOfThePatientsPoles) {
    Eye eye;
    for (int k = 0; k < 100; ++k) eye.turn(0.1f, 0.1f);
    EXPECT_EQ(eye.elevation, Eye::steepest);
    for (int k = 0; k < 100; ++k) eye.zoom(0.5f);
    EXPECT_EQ(eye.distance, Eye::nearest);
}

}  // namespace
}  // namespace room
