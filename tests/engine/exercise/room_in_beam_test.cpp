#include "engine/exercise/room_in_beam.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <set>

#include "engine/exercise/imaging.h"
#include "render/xray/path_length.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

std::multiset<std::string> names_in(const scenario::Scenario& scenario) {
    const anatomy::Anatomy anatomy = scenario::anatomy_of(scenario, test::cache());
    std::multiset<std::string> names;
    for (const render::TissueLayer& layer :
         room_in_beam(scenario, body_around(anatomy, test::cache()).get())) {
        EXPECT_EQ(render::unmatched_edges(layer.mesh), 0) << layer.name;
        names.insert(layer.name);
    }
    return names;
}

}  // namespace

TEST(RoomInBeam, IsClosedAndWhatTheScenarioAsksFor) {
    scenario::Scenario renal = test::shipped_scenario("renal");
    std::multiset<std::string> names = names_in(renal);
    EXPECT_EQ(names.count("table top"), 1u);
    renal.imaging.table = renal.imaging.leads = false;
    EXPECT_TRUE(names_in(renal).empty());
    names = names_in(test::shipped_scenario("coronary"));
    EXPECT_EQ(names.count("electrode"), 4u);
    EXPECT_EQ(names.count("lead"), 4u);
    EXPECT_TRUE(room_in_beam(renal, nullptr).empty());
}

TEST(RoomInBeam, TheTableCostsATenthOfTheDoseAndTheMeterKnowsIt) {
    scenario::Scenario with = test::shipped_scenario("renal"), without = with;
    without.imaging.table = false;
    const anatomy::Anatomy anatomy = scenario::anatomy_of(with, test::cache());
    const blood::ContrastFlow contrast(anatomy);
    render::Exposure exposure{.kvp = 80};
    render::ExposureMeter table = make_meter(with, anatomy, test::cache()),
                          none = make_meter(without, anatomy, test::cache());
    const render::CArm& arm = with.c_arm;
    const double ratio = table.technique(arm, exposure).air_kerma / none.technique(arm, exposure).air_kerma;
    EXPECT_GT(ratio, 1.06);
    EXPECT_LT(ratio, 1.25);
    ImagingChain chain = make_imaging(with, anatomy, contrast, test::cache());
    EXPECT_EQ(chain.fluoroscope.technique(arm, exposure).air_kerma, table.technique(arm, exposure).air_kerma);
}

TEST(RoomInBeam, LeadsLieOnTheSkinInFrontOfTheChest) {
    const scenario::Scenario scenario = test::shipped_scenario("coronary");
    const anatomy::Anatomy anatomy = scenario::anatomy_of(scenario, test::cache());
    const auto body = body_around(anatomy, test::cache());
    for (const render::TissueLayer& layer : room_in_beam(scenario, body.get())) {
        if (layer.name != "lead") continue;
        ASSERT_GT(layer.mesh.vertices.size(), 50u);
        for (const geometry::Vec3& v : layer.mesh.vertices) {
            double nearest = 1e9, front = 1e9;
            for (const geometry::Vec3& s : body->layers.front().mesh.vertices) {
                nearest = std::min(nearest, (s - v).norm());
                if (std::hypot(s.x() - v.x(), s.z() - v.z()) < 15) front = std::min(front, s.y());
            }
            EXPECT_LT(nearest, 25);        // the skin's corners lie that far apart
            EXPECT_LT(v.y(), front + 12);  // not on the back
        }
    }
}

}  // namespace exercise
