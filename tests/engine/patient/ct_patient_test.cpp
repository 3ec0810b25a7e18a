/// The closed loop: a patient of meshes becomes a CT and is imaged again; and how CTs and meshes are asked
/// for.

#include "engine/patient/ct_patient.h"

#include <algorithm>
#include <cmath>

#include "engine/exercise/imaging.h"
#include "engine/patient/voxelise.h"
#include "engine/scenario/scenario.h"
#include "physics/geometry/mesh_topology.h"
#include "render/patient/patient.h"
#include "render/patient/solids.h"
#include "render/xray/path_length.h"
#include "render/xray/volume.h"
#include "tests/engine/anatomy/mesh_texts.h"
#include "tests/engine/fixtures.h"
#include "tests/engine/patient/closed_loop.h"

namespace patient {
namespace {

using geometry::Vec3;

/// A body of 60 mm around the small scenario's tube.
std::vector<render::TissueLayer> small_body() {
    return {{"body", render::Material::SoftTissue, render::Material::Air,
             render::ellipsoid({40, 10, 0}, {60, 50, 60}, 40)}};
}

scenario::Scenario with_patient(const test::TemporaryFolder& folder, const std::string& section) {
    return scenario::parse_scenario(test::small_toml_with("patient = false", "[patient]\n" + section),
                                    folder / "mine.toml", test::asset("devices"));
}

}  // namespace

using CtPatient = test::InFolder;

TEST_F(CtPatient, ImagesOfThePatientAndOfItsCoarseCtAgree) {
    // Edges that a voxel blurs are the limit, in proportion to it, but for texture finer than both:
    // tests/studies has a scanner's own.
    const test::LoopErrors coarse = test::closed_loop(folder / "coarse.nii.gz", 3.0, 128),
                           finer = test::closed_loop(folder / "finer.nrrd", 1.5, 128);
    for (std::size_t view = 0; view < coarse.size(); ++view) {
        EXPECT_LT(finer[view].signal, 0.07) << view;
        EXPECT_LT(finer[view].logarithm, 0.05) << view;
        EXPECT_LT(finer[view].signal, 0.8 * coarse[view].signal) << view;
        EXPECT_LT(finer[view].logarithm, 0.8 * coarse[view].logarithm) << view;
    }
}

TEST_F(CtPatient, GasIsNowhereLighterThanAir) {
    // Where gas overlaps fat or other gas, the changes of attenuation add up to less than nothing, which no
    // CT can state. A few voxels at walls of 2 mm remain; it was 3000 to 5000 mm³ before the walls were kept.
    constexpr double voxel = 2.0;
    constexpr std::uint64_t seeds[] = {0, 12};
    for (const std::uint64_t seed : seeds) {
        render::PatientSpec spec;
        spec.seed = seed;
        const std::vector<render::TissueLayer> layers = render::make_patient(spec);
        const auto gas = std::find_if(layers.begin(), layers.end(), [](const render::TissueLayer& layer) {
            return layer.name == "bowel gas";
        });
        ASSERT_NE(gas, layers.end());
        Vec3 low = gas->mesh.vertices.front(), high = low;
        for (const Vec3& v : gas->mesh.vertices) {
            low = low.cwiseMin(v);
            high = high.cwiseMax(v);
        }
        const render::VolumeGrid grid = grid_around(low, high, voxel);
        const auto attenuation = [](render::Material m) { return render::attenuation(m, 60.0); };
        const double soft = attenuation(render::Material::SoftTissue);
        std::vector<double> sum(grid.count()), of_gas(grid.count());
        const std::size_t in_layer = static_cast<std::size_t>(grid.size[0]) * grid.size[1];
        for (const render::TissueLayer& layer : layers) {
            if (layer.material == layer.inside) continue;
            const double change = attenuation(layer.material) - attenuation(layer.inside);
            const MeshCoverage coverage(layer.mesh, grid);
            const MeshCoverage::Window& window = coverage.window();
            std::vector<float> fractions;
            for (int k = std::max(coverage.first_layer(), 0);
                 k < std::min(coverage.end_layer(), grid.size[2]); ++k) {
                coverage.layer(k, fractions);
                for (int j = window.first_row; j < window.end_row; ++j)
                    for (int i = window.first_column; i < window.end_column; ++i) {
                        const std::size_t at = static_cast<std::size_t>(j) * grid.size[0] + i,
                                          voxel_at = in_layer * static_cast<std::size_t>(k) + at;
                        sum[voxel_at] += change * fractions[at];
                        if (&layer == &*gas) of_gas[voxel_at] = fractions[at];
                    }
            }
        }
        double lighter = 0, all = 0;  // [mm³]
        for (std::size_t i = 0; i < sum.size(); ++i) {
            if (of_gas[i] > 0.05 && sum[i] < -0.02 * soft) lighter += std::pow(voxel, 3);
            all += of_gas[i] * std::pow(voxel, 3);
        }
        EXPECT_GT(all, 100'000.0) << "seed " << seed;
        EXPECT_LT(lighter, 200.0) << "seed " << seed;
    }
}

TEST_F(CtPatient, ScenarioTakesItsBodyFromACtAndKeepsItPrepared) {
    write_ct(folder / "mine.nrrd", voxelised(small_body(), grid_around({-30, -50, -70}, {110, 70, 70}, 2)));
    const scenario::Scenario scenario = with_patient(folder, "ct = \"mine.nrrd\"\n");
    const anatomy::Anatomy anatomy = scenario::anatomy_of(scenario);
    EXPECT_EQ(exercise::tissue_layers(scenario, anatomy).size(), 1u);
    anatomy::ModelCache cache;
    cache.folder = folder / "cache";
    int steps = 0;
    cache.progress = [&](double part, const char*) {
        EXPECT_TRUE(part >= 0 && part <= 1);
        ++steps;
    };
    const blood::ContrastFlow contrast(anatomy);
    const auto image = [&](const scenario::Scenario& of) {
        exercise::ImagingChain imaging = exercise::make_imaging(of, anatomy, contrast, cache);
        render::Exposure exposure{.kvp = 70};
        return imaging.fluoroscope.expected_quanta(of.c_arm, {}, exposure).values;
    };
    const std::vector<float> first = image(scenario);
    EXPECT_GT(steps, 0);
    steps = 0;
    EXPECT_EQ(image(scenario), first);
    EXPECT_EQ(steps, 0);  // from the cache
    // A damaged file there is made anew.
    for (const auto& entry : std::filesystem::directory_iterator(folder / "cache")) {
        std::string bytes = test::read(entry.path());
        bytes[bytes.size() / 2] ^= 1;
        test::write(entry.path(), bytes);
    }
    EXPECT_EQ(image(scenario), first);
    EXPECT_GT(steps, 0);
    // The body is that of the mesh.
    scenario::Scenario air = test::small_scenario();
    render::Fluoroscope meshes({}, small_body());
    render::Exposure exposure{.kvp = 70};
    const std::vector<float> expected = meshes.expected_quanta(air.c_arm, {}, exposure).values;
    const std::size_t middle = expected.size() / 2 + 32;
    EXPECT_NEAR(first[middle], expected[middle], 0.03 * expected[middle]);
    // Moved: another image, which is kept beside the first.
    const scenario::Scenario moved = with_patient(folder, "ct = \"mine.nrrd\"\nshift_mm = [0, 0, 30]\n");
    EXPECT_NE(image(moved), first);
    EXPECT_EQ(image(scenario), first);
    EXPECT_NE(moved.content, scenario.content);
}

TEST_F(CtPatient, ABodyThatTheScanCutsOffGoesOnAndFades) {
    // A trunk of 400 mm, of which the scan has 100.
    const std::vector<render::TissueLayer> trunk = {
        {"trunk", render::Material::SoftTissue, render::Material::Air,
         render::loft({{Vec3(0, 0, -200), Vec3::UnitX(), Vec3::UnitY(), 90, 70, 4},
                       {Vec3(0, 0, 200), Vec3::UnitX(), Vec3::UnitY(), 90, 70, 4}},
                      48)}};
    render::VolumeGrid grid = grid_around({-100, -80, -50}, {100, 80, 50}, 2.5);
    write_ct(folder / "cut.nrrd", voxelised(trunk, grid));
    PatientFiles files;
    files.ct = folder / "cut.nrrd";
    const render::VolumeRayCaster scan(ct_volume(files, {}));
    render::PathLengthRenderer renderer;
    const int mesh = renderer.add(trunk.front().mesh);
    const render::CArm arm{.detector_width = 400, .pixels = 128};  // 270 mm at the isocentre
    const render::Field whole = renderer.render(mesh, arm).length;
    render::Field length(arm.pixels, arm.pixels);
    const auto attenuation = [](render::Material m) { return render::attenuation(m, 60.0); };
    const std::vector<render::Field> parts = scan.every_length(arm);
    for (std::size_t p = 0; p < parts.size(); ++p)
        for (std::size_t i = 0; i < length.values.size(); ++i)
            length.values[i] += static_cast<float>(
                (attenuation(scan.parts()[p].material) - attenuation(scan.parts()[p].inside)) /
                (attenuation(render::Material::SoftTissue) - attenuation(render::Material::Air)) *
                parts[p].values[i]);
    double before = 1;
    for (int j = arm.pixels / 2; j < arm.pixels; ++j) {
        const auto middle = static_cast<std::size_t>(j * arm.pixels + arm.pixels / 2);
        const double seen = length.values[middle] / whole.values[middle];
        const double away = (j + 0.5 - arm.pixels / 2) * render::pixel_width(arm) * arm.sod / arm.sid;
        if (away < 75) {
            EXPECT_NEAR(seen, 1, 0.05) << away;
        }
        EXPECT_LT(seen, before + 0.05) << away;
        EXPECT_GT(seen, before - 0.1) << "an edge at " << away;
        before = seen;
    }
    EXPECT_LT(before, 0.6);
}

TEST_F(CtPatient, ItsVoxelsAreKeptForTheirOwnerAloneAndHaveNoNameOfThePatient) {
    write_ct(folder / "smith.nrrd", voxelised(small_body(), grid_around({-30, -50, -70}, {110, 70, 70}, 4)));
    PatientFiles files;
    files.ct = folder / "smith.nrrd";
    ct_volume(files, {}, {folder / "cache", {}});
    namespace fs = std::filesystem;
    const std::vector<std::string> names = test::names_in(folder / "cache");
    ASSERT_EQ(names.size(), 1u);
    const fs::path kept = folder / ("cache/" + names[0]);
    EXPECT_TRUE(names[0].starts_with("ct-"));
    EXPECT_EQ(fs::status(kept).permissions(), fs::perms::owner_read | fs::perms::owner_write);
    EXPECT_EQ(test::read(kept).find("smith"), std::string::npos);
}

TEST_F(CtPatient, ScenarioIsAnotherWhereTheCtIs) {
    CtImage ct = voxelised(small_body(), grid_around({-30, -50, -70}, {110, 70, 70}, 4));
    write_ct(folder / "mine.nii", ct);
    const std::uint64_t before = with_patient(folder, "ct = \"mine.nii\"\n").content;
    EXPECT_EQ(with_patient(folder, "ct = \"mine.nii\"\n").content, before);
    ct.hu[7] = 40;
    write_ct(folder / "mine.nii", ct);
    EXPECT_NE(with_patient(folder, "ct = \"mine.nii\"\n").content, before);
}

TEST_F(CtPatient, PlacesTurnAboutXThenYThenZAndThenMove) {
    const CtImage ct = voxelised(small_body(), grid_around({-30, -50, -70}, {110, 70, 70}, 4));
    write_ct(folder / "mine.nrrd", ct);
    PatientFiles files;
    files.ct = folder / "mine.nrrd";
    files.keep_table = files.keep_contrast = true;
    const render::VolumeGrid plain = ct_volume(files, {}).grid;
    files.rotation = {90 * geometry::degree, 0, 90 * geometry::degree};
    files.shift = {1, 2, 3};
    const render::VolumeGrid turned = ct_volume(files, {}).grid;
    // About x, +y goes to +z and +z to −y; about z then, +x goes to +y and −y to +x.
    const auto expected = [](const Vec3& p) { return Vec3(p.z(), p.x(), p.y()); };
    EXPECT_LT((turned.origin - expected(plain.origin) - Vec3(1, 2, 3)).norm(), 1e-9);
    for (int a = 0; a < 3; ++a) EXPECT_LT((turned.steps[a] - expected(plain.steps[a])).norm(), 1e-9);
}

TEST_F(CtPatient, MeshesOfThePatientAreLayersAndMustBeClosed) {
    auto bone = render::ellipsoid({40, 10, 0}, {5, 6, 7}, 16);
    for (auto& triangle : bone.triangles) std::swap(triangle[1], triangle[2]);  // inside out
    test::write(folder / "bone.stl", test::text_stl(bone));
    geometry::TriangleMesh holed_bone = bone;
    holed_bone.triangles.erase(holed_bone.triangles.begin(), holed_bone.triangles.begin() + 3);
    test::write(folder / "open.stl", test::text_stl(holed_bone));
    const std::string mesh = "[[patient.mesh]]\nfile = \"bone.stl\"\nmaterial = \"cortical bone\"\n";
    const scenario::Scenario scenario =
        with_patient(folder, "shift_mm = [5, 0, 0]\n" + mesh + "inside = \"adipose\"\n");
    const anatomy::Anatomy anatomy = scenario::anatomy_of(scenario);
    const std::vector<render::TissueLayer> layers = exercise::tissue_layers(scenario, anatomy);
    const auto found = std::find_if(layers.begin(), layers.end(),
                                    [](const render::TissueLayer& layer) { return layer.name == "bone"; });
    ASSERT_NE(found, layers.end());
    EXPECT_EQ(found->material, render::Material::CorticalBone);
    EXPECT_EQ(found->inside, render::Material::Adipose);
    EXPECT_GT(geometry::signed_volume(found->mesh), 500);
    double sum = 0;
    for (const Vec3& v : found->mesh.vertices) sum += v.x();
    EXPECT_NEAR(sum / static_cast<double>(found->mesh.vertices.size()), 45, 0.5);
    EXPECT_GT(layers.size(), 5u);  // with the procedural body

    // One that is named as an organ takes its contrast.
    test::write(folder / "left kidney.stl", test::text_stl(bone));
    std::string kidney = mesh;
    kidney.replace(kidney.find("bone.stl"), 8, "left kidney.stl");
    kidney.replace(kidney.find("cortical bone"), 13, "soft tissue");
    const std::vector<render::TissueLayer> with_organ =
        exercise::tissue_layers(with_patient(folder, kidney), anatomy);
    blood::Outlet outlet;
    outlet.organ = "kidney";
    outlet.place = Vec3(40, 10, 0);
    const auto blushing = exercise::blushing_organs(with_organ, std::vector<blood::Outlet>{outlet});
    ASSERT_EQ(blushing.size(), 1u);
    EXPECT_EQ(with_organ[static_cast<std::size_t>(blushing[0].layer)].mesh.triangles.size(),
              bone.triangles.size());

    std::string open = mesh;
    open.replace(open.find("bone.stl"), 8, "open.stl");
    const scenario::Scenario holed = with_patient(folder, open);
    const std::string said = test::refusal([&] { exercise::tissue_layers(holed, anatomy); });
    test::expect_said(said, "open.stl' is open: ");
    test::expect_said(said, "mine.toml:");
}

TEST_F(CtPatient, AMeshFarFromThePatientIsRefused) {
    test::write(folder / "bone.stl", test::text_stl(render::ellipsoid({40, 10, 0}, {5, 6, 7}, 16)));
    const scenario::Scenario far =
        with_patient(folder,
                     "shift_mm = [9999, 0, 0]\n[[patient.mesh]]\nfile = \"bone.stl\"\nmaterial = \"cortical "
                     "bone\"\n");
    const anatomy::Anatomy anatomy = scenario::anatomy_of(far);
    const std::string said = test::refusal([&] { exercise::tissue_layers(far, anatomy); });
    test::expect_said(said, "bone.stl: a corner at (");
    test::expect_said(said, "expected coordinates up to 10000 mm");
    test::expect_said(said, "mine.toml:");
}

TEST_F(CtPatient, WrongKeysSayWhatWasExpected) {
    const auto said = [&](const std::string& section) {
        return test::refusal([&] { with_patient(folder, section); });
    };
    test::expect_said(said("ct = \"none.nii\"\n"), "NIfTI (.nii, .nii.gz, .hdr with .img), NRRD");
    test::expect_said(said("ct = \"none.nii\"\n"), "mine.toml:");
    test::expect_said(said("series = \"3\"\n"), "expected it only with ct");
    test::expect_said(said("[[patient.mesh]]\nmaterial = \"wood\"\n"), "cortical bone, trabecular bone");
    test::expect_said(said("[[patient.mesh]]\nfile = \"a.stl\"\n"),
                      "material of a patient's mesh is missing");
    test::expect_said(said("table = true\n"), "keep_table");
    write_ct(folder / "mine.nii", voxelised(small_body(), grid_around({-30, -50, -70}, {110, 70, 70}, 4)));
    std::string bytes = test::read(folder / "mine.nii");
    test::write(folder / "mine.nii", bytes.substr(0, 5000));
    const scenario::Scenario cut = with_patient(folder, "ct = \"mine.nii\"\n");
    const anatomy::Anatomy anatomy = scenario::anatomy_of(cut);
    const blood::ContrastFlow contrast(anatomy);
    const std::string damaged = test::refusal([&] { exercise::make_imaging(cut, anatomy, contrast); });
    test::expect_said(damaged, "its header asks for");
    test::expect_said(damaged, "asked for by " + (folder / "mine.toml").string());
}

}  // namespace patient
