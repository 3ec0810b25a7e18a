/// The map of the briefing: what lies on it, and that the way leads from the start to the target.

#include "engine/room/way_map.h"

#include <cmath>
#include <gtest/gtest.h>

#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace room {
namespace {

double between(const WayMap::Point& a, const WayMap::Point& b) {
    return std::hypot(a.x - b.x, a.y - b.y);
}

TEST(WayMap, LeadsFromTheStartToTheTargetInsideOfWhatIsSeen) {
    const scenario::Scenario s = test::shipped_scenario("renal");
    const anatomy::Anatomy anatomy = scenario::anatomy_of(s, test::cache());
    const WayMap map = way_map(s, anatomy, s.c_arm);
    ASSERT_EQ(map.vessels.size(), anatomy.branches.size());
    ASSERT_GT(map.way.size(), 50u);
    EXPECT_LT(between(map.way.front(), map.start), 10);
    EXPECT_LT(between(map.way.back(), map.target), 10);
    for (std::size_t k = 1; k < map.way.size(); ++k) EXPECT_LT(between(map.way[k - 1], map.way[k]), 20) << k;
    for (const WayMap::Point& p : map.way) {
        EXPECT_GT(p.x, map.low.x + 14);
        EXPECT_LT(p.x, map.high.x - 14);
        EXPECT_GT(p.y, map.low.y + 14);
        EXPECT_LT(p.y, map.high.y - 14);
    }
    // From the front the head is above and the patient's left to the right: the target is there from the
    // groin.
    EXPECT_LT(map.target.y, map.start.y - 100);
    EXPECT_EQ(map.radius, s.target.radius);
    for (const WayMap::Branch& branch : map.vessels) EXPECT_EQ(branch.points.size(), branch.radii.size());
}

TEST(WayMap, IsSeenFromWhereTheArmStands) {
    const scenario::Scenario s = test::shipped_scenario("renal");
    const anatomy::Anatomy anatomy = scenario::anatomy_of(s, test::cache());
    render::CArm side = s.c_arm;
    side.lao += 1.5;
    const WayMap front = way_map(s, anatomy, s.c_arm), turned = way_map(s, anatomy, side);
    EXPECT_GT(std::abs(front.target.x - turned.target.x), 5);
    EXPECT_NEAR(front.target.y, turned.target.y, 1e-9);
}

}  // namespace
}  // namespace room
