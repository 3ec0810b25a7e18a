#include "engine/run/still.h"

#include <algorithm>
#include <numbers>

#include "engine/run/picture_file.h"
#include "tests/engine/fixtures.h"

namespace run {
namespace {

render::GrayImage still(const StillRequest& request, const std::string& script = "") {
    return render_still(test::small_scenario(), script::parse_commands(script, "x.gw"), request);
}

int darkest(const render::GrayImage& image) {
    int least = 255;
    for (int row = 10; row < 54; ++row)
        for (int column = 10; column < 54; ++column)
            least = std::min<int>(least, image.pixels[row * 64 + column]);
    return least;
}

}  // namespace

TEST(Still, CarriesOutTheCommandsUpToItsFrame) {
    const std::string script = "2 advance 30 mm\n";
    EXPECT_EQ(still({1}, script), still({1}));
    EXPECT_NE(still({2}, script), still({2}));
}

TEST(Still, TurnsTheArmAndKeepsWhatTheScriptSet) {
    const StillRequest turned{.lao = 0.5}, both{.lao = 0.5, .cranial = 10 * std::numbers::pi / 180};
    EXPECT_NE(still(turned), still({}));
    EXPECT_EQ(still(turned, "0 arm cranial 10 deg\n"), still(both));
}

TEST(Still, ModesShowVesselsWithoutAScriptThatInjects) {
    StillRequest dsa, roadmap;
    dsa.mode = script::ImagingMode::Dsa;
    roadmap.mode = script::ImagingMode::Roadmap;
    EXPECT_LT(darkest(still(dsa)), 170) << "background is 205";
    EXPECT_NE(still(roadmap), still({}));
    EXPECT_EQ(still(dsa), still(dsa));
    dsa.iodine = 20;
    EXPECT_GT(darkest(still(dsa)), 120) << "less contrast is paler";
}

TEST(Still, RefusesWhatCannotBeFollowed) {
    StillRequest beyond{.lao = 3};
    test::expect_refusal([&] { still(beyond); }, "within 120 degrees");
    test::expect_refusal([&] { still({}, "0 inject 5 ml at 5 ml/s into nowhere\n"); }, "nowhere");
    EXPECT_NE(test::refusal([&] { write_picture("/nowhere/x.png", still({})); }), "");
}

}  // namespace run
