#include "engine/exercise/imaging.h"

#include <algorithm>
#include <map>

#include "engine/anatomy/grow/vessel_presets.h"
#include "render/patient/body.h"
#include "render/patient/solids.h"
#include "render/xray/path_length.h"
#include "tests/engine/fixtures.h"

namespace exercise {

TEST(Imaging, EveryLayerIsClosedWithAndWithoutAPatient) {
    scenario::Scenario scenario = test::small_scenario();
    const anatomy::Anatomy anatomy = scenario::anatomy_of(scenario);
    EXPECT_EQ(tissue_layers(scenario, anatomy).size(), 1u);
    scenario.imaging.patient = true;
    const auto layers = tissue_layers(scenario, anatomy);
    EXPECT_GT(layers.size(), 3u);
    for (const render::TissueLayer& layer : layers) {
        EXPECT_EQ(render::unmatched_edges(layer.mesh), 0) << layer.name;
        EXPECT_EQ(layer.takes_contrast, layer.name == "lumen");
    }
}

TEST(Imaging, PatientHasTheOrgansOfTheLandmark) {
    scenario::Scenario scenario = test::small_scenario();
    scenario.imaging.patient = true;
    anatomy::Anatomy anatomy = scenario::anatomy_of(scenario);
    const auto organs = [&] {
        std::set<std::string> names;
        for (const render::TissueLayer& layer : tissue_layers(scenario, anatomy)) names.insert(layer.name);
        return names;
    };
    const geometry::Vec3 middle = anatomy.branches[0].points[anatomy.branches[0].points.size() / 2];
    anatomy.body = {geometry::Landmark::Sella, middle};
    const auto head = organs();
    EXPECT_TRUE(head.contains("brain"));
    EXPECT_FALSE(head.contains("left kidney"));
    anatomy.body = {geometry::Landmark::AorticValve, middle};
    const auto chest = organs();
    EXPECT_TRUE(chest.contains("heart"));
    EXPECT_FALSE(chest.contains("brain"));
    anatomy.body = {geometry::Landmark::AorticBifurcation, middle};
    const auto belly = organs();
    EXPECT_TRUE(belly.contains("left kidney"));
    EXPECT_FALSE(belly.contains("brain"));
    anatomy.body.reset();  // as an imported one
    EXPECT_TRUE(organs().contains("left kidney"));
}

TEST(Imaging, EveryPresetKnowsWhereInTheBodyItIs) {
    // How high above the bifurcation of the aorta its vessels lie.
    const std::map<std::string_view, double> lowest = {
        {"iliac-renal", -250}, {"aorta", -250}, {"femoral", -400}, {"arch-arms", -150},
        {"lca", 200},          {"rca", 200},    {"cerebral", 560}, {"circle", 520}};
    for (const anatomy::VesselPreset& preset : anatomy::vessel_presets()) {
        const anatomy::VesselTreeSpec spec = anatomy::vessel_preset(preset.name);
        ASSERT_TRUE(spec.body) << preset.name;
        const double shift = render::place_in_body(spec.body->landmark).z() - spec.body->at.z();
        const auto expected = lowest.find(preset.name);
        const double low = expected == lowest.end() ? 100 : expected->second;  // arches
        for (const anatomy::SampledBranch& branch : anatomy::grow(spec).branches) {
            for (const geometry::Vec3& p : branch.points) {
                EXPECT_GT(p.z() + shift, low) << preset.name << " " << branch.name;
                EXPECT_LT(p.z() + shift, 720) << preset.name << " " << branch.name;
            }
        }
    }
}

TEST(Imaging, LumenThatCappingDoesNotCloseIsRefused) {
    const scenario::Scenario scenario = test::small_scenario();
    anatomy::Anatomy anatomy = scenario::anatomy_of(scenario);
    anatomy.lumen.triangles.push_back(anatomy.lumen.triangles.front());
    const std::string text =
        test::refusal([&] { make_imaging(scenario, anatomy, blood::ContrastFlow(anatomy)); });
    test::expect_said(text, "a closed mesh is needed");
}

TEST(Imaging, EachKidneyBlushesBehindItsOwnArtery) {
    std::vector<render::TissueLayer> layers(3);
    const char* const names[] = {"trunk", "left kidney", "right kidney"};
    for (int i = 0; i < 3; ++i) {
        layers[i].name = names[i];
        layers[i].mesh =
            render::ellipsoid(geometry::Vec3(i == 1 ? 60 : -60, 0, 0), geometry::Vec3(25, 20, 50));
    }
    std::vector<blood::Outlet> outlets(3);
    outlets[0].organ = "leg";
    outlets[1].organ = outlets[2].organ = "kidney";
    outlets[1].place = {-40, 0, 5};
    outlets[2].place = {40, 0, 5};
    const std::vector<BlushingOrgan> organs = blushing_organs(layers, outlets);
    ASSERT_EQ(organs.size(), 2u);
    EXPECT_EQ(organs[0].layer, 2);
    EXPECT_EQ(organs[0].outlets, std::vector<int>{1});
    EXPECT_EQ(organs[1].layer, 1);
    EXPECT_NEAR(organs[1].volume, 4.0 / 3 * 3.14159 * 2.5 * 2 * 5, 3);
}

TEST(Imaging, KidneysShowContrastInCortexAndMedulla) {
    std::vector<render::TissueLayer> layers(3);
    const char* const names[] = {"left kidney", "left kidney cortex", "left kidney medulla"};
    for (int i = 0; i < 3; ++i) {
        layers[i].name = names[i];
        layers[i].mesh = render::ellipsoid(geometry::Vec3::Zero(), geometry::Vec3::Constant(30.0 - 5 * i));
    }
    std::vector<blood::Outlet> outlets(2);
    outlets[0].organ = outlets[1].organ = "kidney";
    const std::vector<BlushingOrgan> organs = blushing_organs(layers, outlets);
    ASSERT_EQ(organs.size(), 2u);
    EXPECT_EQ(organs[0].layer, 1);
    EXPECT_EQ(organs[1].layer, 2);
    const std::vector<blood::Blush> blush{{100, 0, 30}, {7, 0, 0}};
    EXPECT_EQ(organs[0].iodine(blush), 77);
    EXPECT_EQ(organs[1].iodine(blush), 30);
}

TEST(Imaging, ArteriesOfTheBrainShowInTheirTerritories) {
    std::vector<render::TissueLayer> layers;
    const auto add = [&](const char* name, double x, double size) {
        layers.emplace_back().name = name;
        layers.back().mesh = render::ellipsoid({x, 0, 0}, geometry::Vec3::Constant(size));
    };
    add("brain", 0, 80);
    for (const char* side : {"left", "right"})
        for (const char* artery : {"ACA", "MCA", "PCA"})
            add((std::string("brain, ") + side + " " + artery).c_str(), *side == 'l' ? 40 : -40,
                *artery == 'M' ? 26 : 20);
    add("brain, cerebellum and stem", 0, 20);
    const auto shows = [&](const char* branch, double x) {
        blood::Outlet outlet;
        outlet.organ = "brain";
        outlet.branch = branch;
        outlet.place = {x, 0, -90};
        std::string text;
        double sum = 0;
        const std::vector<blood::Blush> blush{{50, 0, 0}};
        for (const BlushingOrgan& organ : blushing_organs(layers, std::span(&outlet, 1))) {
            text +=
                layers[organ.layer].name.substr(std::min<std::size_t>(7, layers[organ.layer].name.size()));
            text += ";";
            sum += organ.iodine(blush);
            // The same concentration in all that one artery supplies.
            EXPECT_NEAR(organ.iodine(blush) / organ.volume, 50 / (organ.volume / organ.fractions[0]), 1e-9);
        }
        EXPECT_NEAR(sum, 50, 1e-9) << branch;
        return text;
    };
    EXPECT_EQ(shows("LCCA+LICA", -3), "left ACA;left MCA;");
    EXPECT_EQ(shows("RCCA+RICA", 3), "right ACA;right MCA;");
    EXPECT_EQ(shows("ICA", 3), "left ACA;left MCA;");
    EXPECT_EQ(shows("ICA", -3), "right ACA;right MCA;");
    EXPECT_EQ(shows("LICA+LM1+LM2sup", 3), "left MCA;");
    EXPECT_EQ(shows("RA1+RA2", -3), "right ACA;");
    EXPECT_EQ(shows("LVA", 3), "left PCA;right PCA;cerebellum and stem;");
    EXPECT_EQ(shows("LVA+BA+LP1+LP2", 3), "left PCA;");
    EXPECT_EQ(shows("RPICA", -3), "cerebellum and stem;");
    EXPECT_EQ(shows("unknown", -3), ";");  // all of the brain
    blood::Outlet eye;
    eye.organ = "brain";
    eye.branch = "LICA+Lophthalmic";
    EXPECT_TRUE(blushing_organs(layers, std::span(&eye, 1)).empty());
}

}  // namespace exercise
