#include "engine/imaging.h"

#include "render/path_length.h"
#include "tests/engine/fixtures.h"

namespace engine {

TEST(Imaging, EveryLayerIsClosedWithAndWithoutAPatient) {
    Scenario scenario = test::small_scenario();
    const Anatomy anatomy = anatomy_of(scenario);
    EXPECT_EQ(tissue_layers(scenario, anatomy).size(), 1u);
    scenario.imaging.patient = true;
    const auto layers = tissue_layers(scenario, anatomy);
    EXPECT_GT(layers.size(), 3u);
    for (const render::TissueLayer& layer : layers) {
        EXPECT_EQ(render::unmatched_edges(layer.mesh), 0) << layer.name;
        EXPECT_EQ(layer.takes_contrast, layer.name == "lumen");
    }
}

TEST(Imaging, LumenThatCappingDoesNotCloseIsRefused) {
    const Scenario scenario = test::small_scenario();
    Anatomy anatomy = anatomy_of(scenario);
    anatomy.lumen.triangles.push_back(anatomy.lumen.triangles.front());
    const std::string text = test::refusal([&] { make_fluoroscope(scenario, anatomy); });
    EXPECT_NE(text.find("a closed mesh is needed"), std::string::npos) << text;
}

}  // namespace engine
