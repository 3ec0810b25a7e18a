/// The study of what devices do in hands, at its quick size, and the measures that it uses.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <set>

#include "engine/studies/hands_behaviours.h"
#include "engine/studies/hands_published.h"
#include "engine/studies/hands_realistic.h"
#include "engine/studies/runs.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"
#include "tests/studies/quick_study.h"

namespace studies {
namespace {

StudyOptions quick_hands() {
    StudyOptions options = test::quick_study(2);
    options.scenarios = SELDINGER_SOURCE "/assets/scenarios";
    options.devices = SELDINGER_SOURCE "/assets/devices";
    options.cache = test::cache();
    return options;
}

std::vector<HandSample> samples_of(const std::vector<Vec3>& tips, const Vec3& along) {
    std::vector<HandSample> samples;
    for (const Vec3& tip : tips) {
        HandSample sample;
        sample.devices.resize(1);
        sample.devices[0].tip = tip, sample.devices[0].along = along;
        samples.push_back(sample);
    }
    return samples;
}

}  // namespace

TEST(HandsStudy, QuickStudyMeasuresAllBehavioursAndBalancesTheirEnergy) {
    const StudyResult result = run_hands(quick_hands());
    const io::Table &table = test::table_of(result, "hands"),
                    &balance = test::table_of(result, "hands_balance");
    ASSERT_EQ(table.rows.size(), 13u);
    ASSERT_EQ(balance.rows.size(), 13u);
    // With vessels that make way these gain energy that no hand has put in (docs/hands.md, "Energy").
    const std::set<std::string> unbalanced = {"whip", "stick-slip", "prolapse", "deep seating"};
    std::set<std::string> inside;
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
        const std::string& name = table.word(r, "behaviour");
        EXPECT_EQ(name, published_sizes()[r].behaviour);
        EXPECT_TRUE(std::isfinite(table.number(r, "measured"))) << name;
        if (table.word(r, "verdict") == "inside") {
            inside.insert(name);
            EXPECT_GE(table.number(r, "measured"), table.number(r, "published_low")) << name;
            EXPECT_LE(table.number(r, "measured"), table.number(r, "published_high")) << name;
            EXPECT_NE(table.word(r, "mark"), "none found") << name;
        }
        EXPECT_LE(balance.number(r, "error_percent"), unbalanced.contains(name) ? 5.0 : 1.0) << name;
        EXPECT_GE(balance.number(r, "friction_N_mm"), 0.0) << name;
        EXPECT_GE(balance.number(r, "jumps_N_mm"), 0.0) << name;
        EXPECT_GT(balance.number(r, "to_and_fro_N_mm"), 0.0) << name;
    }
    const std::set<std::string> expected = {"whip",      "wind-up",      "stick-slip", "buckling",
                                            "kick-back", "deep seating", "root loop",  "straightening"};
    EXPECT_EQ(inside, expected);
    EXPECT_EQ(test::table_of(result, "hands_balance_exercises").rows.size(), 2u);
    const io::Table& pushes = test::table_of(result, "hands_pushes");
    ASSERT_EQ(pushes.rows.size(), 2u);
    for (std::size_t r = 0; r < pushes.rows.size(); ++r) {
        EXPECT_LE(pushes.number(r, "push_p50_N"), pushes.number(r, "push_p95_N"));
        EXPECT_LE(pushes.number(r, "push_p95_N"), pushes.number(r, "push_max_N"));
    }
}

TEST(HandsStudy, EveryPublishedSizeHasItsSourceAndOthersClaimNothing) {
    EXPECT_EQ(published_sizes().size(), behaviours().size());
    for (const PublishedSize& size : published_sizes()) {
        EXPECT_EQ(size.known(), size.mark != SourceMark::None) << size.behaviour;
        EXPECT_EQ(size.known(), !size.source.empty()) << size.behaviour;
        EXPECT_EQ(size.holds(size.low), size.known() && size.same_kind) << size.behaviour;
        EXPECT_FALSE(size.holds(size.high + 1)) << size.behaviour;
        EXPECT_FALSE(size.holds(std::nan(""))) << size.behaviour;
    }
}

TEST(HandsStudy, EnergyThatIsMissingIsOfTheLargerSideAndOfAllThatWentToAndFro) {
    HandBalance balance;
    balance.work = 10, balance.stored = 5, balance.friction = 3, balance.jumps = 1, balance.exchanged = 10;
    EXPECT_DOUBLE_EQ(balance.error(), 0.1);
    balance.jumps = 4;  // more than the work
    EXPECT_DOUBLE_EQ(balance.error(), 2.0 / 12);
    balance.work = 0.1, balance.stored = balance.friction = balance.jumps = 0;
    EXPECT_DOUBLE_EQ(balance.error(), 0.1);  // of a tenth of 10
}

TEST(HandsStudy, AnEvenCourseHasNoJumps) {
    HandCourse straight(quick_hands(), {"straight", {{"guidewire.valve_friction_N", "0.1"}}});
    straight.feed(5);
    EXPECT_EQ(straight.balance().jumping_steps, 0);
    EXPECT_NEAR(straight.balance().work, 0.5, 0.01);  // the valve's force times the way
    EXPECT_NEAR(straight.balance().friction, straight.balance().work, 0.01 * straight.balance().work);
    EXPECT_LE(straight.balance().error(), 0.01);
}

TEST(HandsStudy, AWhipIsAJumpWhoseEnergyIsLostAndNothingElseIs) {
    HandCourse course(quick_hands(), {"cerebral", {}});
    course.feed_step = 0.5;
    course.feed(75);
    const double before = course.last().jumps;
    course.turn(200 * geometry::degree);
    EXPECT_GT(course.last().jumps - before, 1e-3);
    EXPECT_LE(course.balance().jumping_steps, 20);
    EXPECT_LE(course.balance().error(), 0.01);
    double largest = 0;
    for (std::size_t k = 1; k < course.samples().size(); ++k) {
        const HandSample &a = course.samples()[k - 1], &b = course.samples()[k];
        if (b.jumped) largest = std::max(largest, (b.devices[0].tip - a.devices[0].tip).norm());
        EXPECT_GE(b.jumps, a.jumps);
    }
    // An eighth of a degree of the hub moves a tip 10 mm beside its axis by 0.02 mm.
    EXPECT_GT(largest, 0.5);
}

TEST(HandsStudy, WayBackIsTheFarthestThatTheTipWentBackAlongItself) {
    const Vec3 x = Vec3::UnitX();
    const std::vector<HandSample> samples =
        samples_of({0 * x, 5 * x, 4 * x, 8 * x, 1 * x, 3 * x, 0.5 * x}, x);
    const Recoil back = recoil(samples, 0, 0);
    EXPECT_NEAR(back.length, 7.5, 1e-12);
    EXPECT_EQ(back.from, 3u);
    EXPECT_EQ(back.to, 6u);
    EXPECT_NEAR(recoil(samples, 0, 5).length, 2.5, 1e-12);
}

TEST(HandsStudy, ALoopIsAsWideAsItsLimbsAreApart) {
    Polyline loop;
    for (double z = 40; z > 0; z -= 0.5) loop.emplace_back(-10, 0, z);
    for (double angle = 0; angle < std::numbers::pi; angle += 0.02)
        loop.emplace_back(-10 * std::cos(angle), 0, -10 * std::sin(angle));
    Polyline open = loop;
    for (double z = 0; z < 30; z += 0.5) loop.emplace_back(10, 0, z);
    EXPECT_NEAR(loop_width(loop, -Vec3::UnitZ(), 15), 20, 0.1);
    EXPECT_TRUE(std::isnan(loop_width(open, -Vec3::UnitZ(), 15)));  // comes back by 10 only
}

TEST(HandsStudy, AHandIsNoFasterThanAPhysicians) {
    exercise::Simulation simulation(test::shipped_scenario("straight"), test::cache());
    SlowHand hand(4);
    const double dt = 1 / simulation.scenario().frame_rate;
    double fastest = 0, turned = 0;
    for (int frame = 0; frame < 150; ++frame) {
        const double before = simulation.inserted(), angle = simulation.hand(script::DeviceRole::Wire).turned;
        hand.act(simulation);
        const exercise::StepReport report = simulation.step();
        ASSERT_EQ(report.waiting_insertion, 0);
        fastest = std::max(fastest, std::abs(simulation.inserted() - before) / dt);
        turned = std::max(turned, std::abs(simulation.hand(script::DeviceRole::Wire).turned - angle) / dt);
    }
    EXPECT_LE(fastest, SlowHand::fastest_feed);
    EXPECT_LE(turned, SlowHand::fastest_turn);
    EXPECT_GT(fastest, 10);
    EXPECT_GT(turned, 0.1);
}

}  // namespace studies
