#include "engine/patient/vessel_fit.h"

#include <cmath>
#include <cstring>
#include <random>

#include "engine/patient/voxelise.h"
#include "render/patient/solids.h"
#include "tests/engine/fixtures.h"

namespace patient {
namespace {

using geometry::Vec3;
using render::Material;

/// A body that no half turn brings to itself, and a vessel through it.
CtImage body_ct() {
    const auto half = [](double x, double y) {
        return render::loft({{{x, y, -150}, Vec3::UnitX(), Vec3::UnitY(), 90, 60, 2},
                             {{x, y, 150}, Vec3::UnitX(), Vec3::UnitY(), 90, 60, 2}},
                            48);
    };
    const std::vector<render::TissueLayer> layers = {
        {"trunk", Material::SoftTissue, Material::Air, half(70, -90)}};
    return voxelised(layers, grid_around({-60, -170, -100}, {180, -10, 100}, 3));
}

geometry::TriangleMesh vessel() {
    return render::tube({{70, -90, -90}, {72, -88, 0}, {70, -90, 90}}, Vec3::UnitX(), {5, 5, 5}, {5, 5, 5},
                        12);
}

std::string refused(const CtImage& ct, const geometry::TriangleMesh& wall, const PatientFiles& files) {
    return test::refusal([&] { require_fit(ct, wall, files); });
}

}  // namespace

TEST(VesselFit, VesselsInTheBodyRaiseNoWord) {
    EXPECT_EQ(require_fit(body_ct(), vessel(), {}), "");
    EXPECT_EQ(require_fit(body_ct(), {}, {}), "");
}

TEST(VesselFit, WhatWouldBringThemTogetherDoes) {
    constexpr unsigned seed = 20261127;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> way(-600, 600);
    const CtImage ct = body_ct();
    int told = 0;
    for (int k = 0; k < 300; ++k) {
        // Half turns about axes and whole shifts, or both; the CT may have been moved before.
        PatientFiles files;
        files.ct = "x.nii";
        const int axis = static_cast<int>(random() % 4) - 1;
        const geometry::Mat3 turn =
            axis < 0 ? geometry::Mat3::Identity() : geometry::Mat3(Eigen::AngleAxisd(M_PI, Vec3::Unit(axis)));
        const Vec3 shift =
            random() % 2 == 0 ? Vec3(Vec3::Zero()) : Vec3(way(random), way(random), way(random));
        geometry::TriangleMesh wall = vessel();
        for (Vec3& x : wall.vertices) x = turn * x + shift;
        if (random() % 2 == 0) {
            files.shift = Vec3(way(random), way(random), way(random)).array().round();
            files.rotation = Vec3(0, 0, random() % 2 == 0 ? M_PI : M_PI / 2);
        }
        CtImage moved = ct;
        const auto place = [&](const Vec3& rotation, const Vec3& by) {
            moved.grid.origin = turn_by(rotation) * ct.grid.origin + by;
            for (int a = 0; a < 3; ++a) moved.grid.steps[a] = turn_by(rotation) * ct.grid.steps[a];
        };
        place(files.rotation, files.shift);
        if (vessel_fit(moved, wall).wrong() <= most_wrong) continue;
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", case " << k);
        const std::string said = refused(moved, wall, files);
        test::expect_said(said, "of the vessels' wall lie outside it");
        // As a user would: the keys that it names, in place of those that were there.
        Vec3 rotation = files.rotation, by = files.shift;
        const auto read = [&](const char* key, Vec3& to, double unit) {
            const std::size_t at = said.find(key);
            if (at == std::string::npos) return false;
            EXPECT_EQ(std::sscanf(said.c_str() + at + std::strlen(key), " = [%lf, %lf, %lf]", &to[0], &to[1],
                                  &to[2]),
                      3);
            to *= unit;
            return true;
        };
        const bool turns = read("rotation_deg", rotation, geometry::degree), moves = read("shift_mm", by, 1);
        if (!turns && !moves) continue;  // a quarter turn is not tried
        ++told;
        place(rotation, by);
        EXPECT_LT(vessel_fit(moved, wall).wrong(), 0.06) << said;
    }
    EXPECT_GT(told, 150);
}

TEST(VesselFit, APartialCtIsTakenAndAnotherPatientsIsNot) {
    geometry::TriangleMesh wall = vessel();
    for (Vec3& x : wall.vertices) x.z() *= 4;  // three quarters beyond the CT
    PatientFiles files;
    files.ct = "x.nii";
    const CtImage ct = body_ct();
    test::expect_said(refused(ct, wall, files), "partial = true says that it shows only some of the vessels");
    files.partial = true;
    test::expect_said(require_fit(ct, wall, files), "of the vessels' wall lie outside it");
    for (Vec3& x : wall.vertices) x = Vec3(x.x() - 120, x.y(), x.z() / 4);  // in the air beside the body
    test::expect_said(refused(ct, wall, files), "100 % in its air");
}

}  // namespace patient
