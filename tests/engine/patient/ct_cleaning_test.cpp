#include "engine/patient/ct_cleaning.h"

#include <cmath>

#include "engine/patient/ct_image.h"
#include "engine/patient/voxelise.h"
#include "render/patient/solids.h"
#include "tests/engine/fixtures.h"

namespace patient {
namespace {

using geometry::Vec3;
using render::Material;
using render::TissueLayer;

geometry::TriangleMesh upright(const Vec3& middle, double a, double b, double half) {
    return render::loft({{middle - half * Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY(), a, b, 2},
                         {middle + half * Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY(), a, b, 2}},
                        48);
}

std::int16_t& at(CtImage& ct, const Vec3& place) {
    const Vec3 index = ct.grid.axes().inverse() * (place - ct.grid.origin);
    return ct
        .hu[ct.grid.index(static_cast<int>(std::lround(index[0])), static_cast<int>(std::lround(index[1])),
                          static_cast<int>(std::lround(index[2])))];
}

}  // namespace

TEST(CtCleaning, TheTableGoesAndLungsStay) {
    // A trunk with a lung, on a table whose shell touches the back; the scan ends within both.
    std::vector<TissueLayer> layers = {
        {"trunk", Material::SoftTissue, Material::Air, upright({0, 0, 0}, 80, 50, 200)},
        {"lung", Material::Lung, Material::SoftTissue, upright({30, 0, 0}, 25, 30, 200)}};
    const render::VolumeGrid grid = grid_around({-120, -60, -40}, {120, 90, 40}, 1.5);
    CtImage body = voxelised(layers, grid);
    // Wide, hollow and 4 mm thick.
    layers.push_back({"table", Material::SoftTissue, Material::Air, upright({0, 75, 0}, 110, 25.5, 200)});
    layers.push_back({"foam", Material::Air, Material::SoftTissue, upright({0, 75, 0}, 106, 21.5, 200)});
    CtImage ct = voxelised(layers, grid);
    for (std::size_t i = 0; i < ct.hu.size(); i += 5)  // noise of air
        if (ct.hu[i] == -1000) ct.hu[i] = static_cast<std::int16_t>(-1000 + i % 40);
    EXPECT_GT(at(ct, {90, 62, 0}), -600);
    remove_surroundings(ct, "x.nii");
    ASSERT_EQ(ct.notes.size(), 1u);
    test::expect_said(ct.notes[0], "outside the body of the CT were removed");
    test::expect_said(ct.notes[0], "mm behind it; keep_table = true keeps them");
    EXPECT_EQ(at(ct, {90, 62, 0}), -1000);
    EXPECT_EQ(at(ct, {0, 99, 0}), -1000);
    EXPECT_LT(std::abs(at(ct, {30, 0, 0}) - hounsfield(Material::Lung)), 2);
    // Within the body nothing changes, at its skin nothing but where the table touches.
    int differing = 0, inside = 0;
    for (std::size_t i = 0; i < ct.hu.size(); ++i) {
        if (body.hu[i] <= -400) continue;
        ++inside;
        differing += ct.hu[i] != body.hu[i];
    }
    EXPECT_LT(differing, 0.005 * inside);
    EXPECT_GT(inside, 100000);

    CtImage nothing = body;
    std::fill(nothing.hu.begin(), nothing.hu.end(), std::int16_t{-1000});
    test::expect_refusal([&] { remove_surroundings(nothing, "x.nii"); }, "x.nii: no body was found");
}

TEST(CtCleaning, LegsAreBothKept) {
    const std::vector<TissueLayer> layers = {
        {"left", Material::SoftTissue, Material::Air, upright({60, 0, 0}, 40, 40, 200)},
        {"right", Material::SoftTissue, Material::Air, upright({-60, 0, 0}, 42, 42, 200)},
        {"bottle", Material::SoftTissue, Material::Air, upright({0, 70, 0}, 10, 10, 200)}};
    CtImage ct = voxelised(layers, grid_around({-120, -60, -30}, {120, 90, 30}, 2));
    remove_surroundings(ct, "x.nii");
    EXPECT_GT(at(ct, {60, 0, 0}), 0);
    EXPECT_GT(at(ct, {-60, 0, 0}), 0);
    EXPECT_EQ(at(ct, {0, 70, 0}), -1000);
}

TEST(CtCleaning, ArmsAndTheShellOfASkullStayAndRailsOfATableGo) {
    const std::vector<TissueLayer> layers = {
        {"trunk", Material::SoftTissue, Material::Air, upright({0, 0, 0}, 120, 80, 200)},
        {"arm", Material::SoftTissue, Material::Air, upright({170, 10, 0}, 30, 30, 200)},
        {"humerus", Material::CorticalBone, Material::SoftTissue, upright({170, 10, 0}, 9, 9, 200)},
        // Crossed before the trunk, and apart from it.
        {"hand", Material::SoftTissue, Material::Air, upright({0, -110, 0}, 25, 20, 30)},
        {"bone", Material::CorticalBone, Material::SoftTissue, upright({0, -110, 0}, 6, 6, 30)},
        {"rail", Material::CorticalBone, Material::Air, upright({60, 120, 0}, 3, 12, 200)},
        {"pad", Material::SoftTissue, Material::Air, upright({-40, 120, 0}, 40, 15, 200)}};
    CtImage ct = voxelised(layers, grid_around({-160, -140, -50}, {210, 145, 50}, 2));
    remove_surroundings(ct, "x.nii");
    EXPECT_GT(at(ct, {190, 10, 0}), 0);
    EXPECT_GT(at(ct, {0, -122, 0}), 0);
    EXPECT_EQ(at(ct, {60, 120, 0}), -1000);
    EXPECT_EQ(at(ct, {-40, 120, 0}), -1000);
    ASSERT_EQ(ct.notes.size(), 1u);
    test::expect_said(ct.notes[0], "199 ml around (-39, 121,");

    // A dry skull: a vault of 5 mm around air, and something solid in it.
    const std::vector<TissueLayer> dry = {
        {"vault", Material::CorticalBone, Material::Air, upright({0, 0, 0}, 75, 90, 200)},
        {"inside", Material::Air, Material::CorticalBone, upright({0, 0, 0}, 70, 85, 200)},
        {"insert", Material::SoftTissue, Material::Air, upright({0, 0, 0}, 40, 40, 200)}};
    CtImage skull = voxelised(dry, grid_around({-90, -100, -40}, {90, 100, 40}, 1.5));
    remove_surroundings(skull, "x.nii");
    EXPECT_GT(at(skull, {72.5, 0, 0}), 600);
    EXPECT_GT(at(skull, {0, -87.5, 0}), 600);
    EXPECT_TRUE(skull.notes.empty());
}

TEST(CtCleaning, ContrastBecomesBloodAndTheBoneBesideItStays) {
    // A vessel of 320 HU and 8 mm, blurred by voxels, that runs along a bone of 2 mm distance.
    const auto lumen =
        render::tube({{0, 0, -60}, {3, 0, 0}, {0, 0, 60}}, Vec3::UnitX(), {4, 4, 4}, {4, 4, 4}, 32);
    std::vector<TissueLayer> layers = {
        {"trunk", Material::SoftTissue, Material::Air, upright({0, 0, 0}, 40, 40, 100)},
        {"bone", Material::CorticalBone, Material::SoftTissue, upright({14, 0, 0}, 6, 12, 100)}};
    const render::VolumeGrid grid = grid_around({-45, -45, -40}, {45, 45, 40}, 0.8);
    const CtImage plain = voxelised(layers, grid);
    CtImage ct = plain;
    const auto blood = static_cast<double>(std::lround(hounsfield(Material::Blood)));
    // Contrast as a scanner shows it: soft tissue and bone together that give its number.
    constexpr double contrast = 320;
    const CtImage filled =
        voxelised(std::vector<TissueLayer>{{"lumen", Material::SoftTissue, Material::Air, lumen}}, grid);
    const double whole = std::lround(hounsfield(Material::SoftTissue)) + 1000.0;
    double before = 0, after = 0, bone_before = 0, bone_after = 0;
    for (std::size_t i = 0; i < ct.hu.size(); ++i)
        ct.hu[i] = static_cast<std::int16_t>(plain.hu[i] +
                                             std::lround((filled.hu[i] + 1000) / whole * (contrast - blood)));
    const CtImage enhanced = ct;
    replace_contrast(ct, lumen);
    int touched = 0;
    for (std::size_t i = 0; i < ct.hu.size(); ++i) {
        before += enhanced.hu[i] - plain.hu[i];
        after += std::abs(ct.hu[i] - plain.hu[i]);
        if (filled.hu[i] == -1000 && plain.hu[i] > 800) {
            bone_before += plain.hu[i];
            bone_after += ct.hu[i];
        }
        touched += ct.hu[i] != enhanced.hu[i];
    }
    EXPECT_GT(touched, 1000);
    EXPECT_LT(after, 0.06 * before);  // of the iodine's amount
    EXPECT_NEAR(bone_after, bone_before, 0.01 * bone_before);
    for (std::size_t i = 0; i < ct.hu.size(); ++i)
        if (filled.hu[i] > 40) {
            EXPECT_EQ(ct.hu[i], blood);
        }
    // A CT without contrast stays as it is, but for its noise.
    CtImage native = plain;
    replace_contrast(native, lumen);
    for (std::size_t i = 0; i < native.hu.size(); ++i) EXPECT_NEAR(native.hu[i], plain.hu[i], 12);
}

}  // namespace patient
