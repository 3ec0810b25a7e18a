
#include <cmath>
#include <gtest/gtest.h>
#include <numeric>

#include "engine/patient/ct_image.h"
#include "engine/patient/voxelise.h"
#include "physics/geometry/mesh_topology.h"
#include "render/patient/solids.h"

namespace patient {
namespace {

using geometry::Vec3;

double covered(const geometry::TriangleMesh& mesh, const render::VolumeGrid& grid, int lines = 3) {
    const MeshCoverage coverage(mesh, grid, lines);
    double sum = 0;
    std::vector<float> fractions;
    for (int k = coverage.first_layer(); k < coverage.end_layer(); ++k) {
        coverage.layer(k, fractions);
        sum = std::accumulate(fractions.begin(), fractions.end(), sum);
    }
    return sum * std::abs(grid.axes().determinant());
}

render::VolumeGrid oblique_grid(bool mirrored) {
    render::VolumeGrid grid;
    const geometry::Mat3 turn = Eigen::AngleAxisd(0.4, Vec3(1, -2, 1).normalized()).toRotationMatrix();
    grid.size = {80, 90, 70};
    grid.steps = {0.9 * turn.col(0), 0.8 * turn.col(1), (mirrored ? -1.1 : 1.1) * turn.col(2)};
    grid.origin = Vec3(5, 6, 7) - grid.axes() * Vec3(40, 45, 35);
    return grid;
}

}  // namespace

TEST(MeshCoverage, AddsUpToTheVolumeOnObliqueAndMirroredGrids) {
    const auto ball = render::ellipsoid({5, 6, 7}, {20, 12, 16}, 40);
    const auto tube =
        render::tube({{-5, 6, 0}, {5, 0, 7}, {20, 10, 12}}, Vec3::UnitZ(), {3, 2, 4}, {3, 2, 4});
    for (const auto& mesh : {ball, tube})
        for (const bool mirrored : {false, true}) {
            const double volume = geometry::signed_volume(mesh);
            EXPECT_NEAR(covered(mesh, oblique_grid(mirrored)), volume, 3e-3 * volume);
            EXPECT_NEAR(covered(mesh, oblique_grid(mirrored), 1), volume, 2e-2 * volume);
        }
}

TEST(MeshCoverage, FractionsOfABoxAreExactAlongTheLinesAndNothingLeaksBesideIt) {
    render::VolumeGrid grid;
    grid.size = {10, 10, 10};
    // From −0.5 … to 9.5 in each direction; the box has faces within voxels along x, on their edges along y,
    // z.
    const auto box = render::loft({{Vec3(3.05, 4, 1.5), Vec3::UnitX(), Vec3::UnitY(), 2.25, 2.5, 1e6},
                                   {Vec3(3.05, 4, 6.5), Vec3::UnitX(), Vec3::UnitY(), 2.25, 2.5, 1e6}},
                                  4);
    const MeshCoverage coverage(box, grid);
    std::vector<float> fractions;
    double sum = 0;
    for (int k = 0; k < 10; ++k) {
        coverage.layer(k, fractions);
        for (int j = 0; j < 10; ++j) {
            float row = 0;
            for (int i = 0; i < 10; ++i) {
                EXPECT_GE(fractions[static_cast<std::size_t>(j * 10 + i)], -1e-6f);
                row += fractions[static_cast<std::size_t>(j * 10 + i)];
            }
            EXPECT_NEAR(fractions[static_cast<std::size_t>(j * 10 + 9)], 0, 1e-6);
            sum += row;
        }
    }
    EXPECT_NEAR(sum, geometry::signed_volume(box), 0.05 * geometry::signed_volume(box));
    // Twice the same solid counts twice.
    auto twice = box;
    render::append(twice, box);
    EXPECT_NEAR(covered(twice, grid), 2 * sum, 1e-4);
}

TEST(MeshCoverage, MeshesBeyondTheGridCoverWhatLiesWithin) {
    render::VolumeGrid grid;
    grid.size = {20, 20, 20};
    const auto around = render::ellipsoid({10, 10, 10}, {100, 100, 100}, 24);
    EXPECT_NEAR(covered(around, grid), 8000, 1e-2);
    EXPECT_EQ(covered(render::ellipsoid({10, 10, 100}, {10, 10, 10}, 24), grid), 0);
    EXPECT_NEAR(covered(render::ellipsoid({-50, 10, 10}, {10, 10, 10}, 24), grid), 0, 1e-3);
    EXPECT_NEAR(covered(render::ellipsoid({80, 10, 10}, {10, 10, 10}, 24), grid), 0, 1e-3);
}

TEST(Voxelised, LayersHaveTheNumbersOfTheirMaterials) {
    const std::vector<render::TissueLayer> layers = {
        {"body", render::Material::SoftTissue, render::Material::Air,
         render::ellipsoid({0, 0, 0}, {30, 30, 30}, 32)},
        {"bone", render::Material::CorticalBone, render::Material::SoftTissue,
         render::ellipsoid({0, 0, 0}, {10, 10, 10}, 32)}};
    const CtImage ct = voxelised(layers, grid_around({-32, -32, -32}, {32, 32, 32}, 2));
    const auto hu_at = [&](const Vec3& at) {
        const Vec3 place = ct.grid.axes().inverse() * (at - ct.grid.origin);
        return ct.hu[ct.grid.index(static_cast<int>(std::lround(place[0])),
                                   static_cast<int>(std::lround(place[1])),
                                   static_cast<int>(std::lround(place[2])))];
    };
    EXPECT_EQ(hu_at({0, 0, 0}), std::lround(hounsfield(render::Material::CorticalBone)));
    EXPECT_EQ(hu_at({20, 0, 0}), std::lround(hounsfield(render::Material::SoftTissue)));
    EXPECT_EQ(hu_at({31, 31, 31}), -1000);
}

}  // namespace patient
