/// Cine beside real cine: noise, greys and the depth of contrast.

#include <algorithm>
#include <gtest/gtest.h>

#include "engine/run/still.h"
#include "engine/studies/picture_measures.h"
#include "tests/engine/fixtures.h"

namespace exercise {

// Three frames of one real coronary cine, 512 × 512, have: noise 1.1 grey levels; first and 99th percentile
// 113 and 217; what lies darker than its surroundings of 31 pixels does so by 48 grey levels in its darkest
// half percent.
TEST(Cine, OfACoronaryArteryHasNoiseGreysAndContrastNearThoseOfARealOne) {
    const scenario::Scenario scenario = test::shipped_scenario("coronary_lad");
    script::CommandScript script = script::parse_commands(
        "0 mode cine\n0 beam on\n2 inject 5 ml at 4 ml/s through introducer\n20 end\n", "x.gw");
    run::StillRequest request;
    request.frame = 12;
    request.lao = -30 * geometry::degree;
    request.cranial = -20 * geometry::degree;
    request.mode = script::ImagingMode::Cine;
    const test::TemporaryFolder folder;
    anatomy::ModelCache cache;
    cache.folder = folder.path().string();
    const render::GrayImage image = run::render_still(scenario, script, request, cache);
    render::Field grey(image.width, image.height);
    std::copy(image.pixels.begin(), image.pixels.end(), grey.values.begin());
    grey = studies::inner_part(grey, 0.08);
    EXPECT_LE(studies::noise_of(grey), 1.5);
    EXPECT_GE(studies::noise_of(grey), 0.8);
    EXPECT_NEAR(studies::percentile(grey, 0.01), 113, 0.2 * 113);
    EXPECT_NEAR(studies::percentile(grey, 0.99), 217, 0.2 * 217);
    EXPECT_NEAR(studies::percentile(studies::depth_of_dark(grey, 15), 0.995), 48, 0.2 * 48);
}

}  // namespace exercise
