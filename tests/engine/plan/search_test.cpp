#include "engine/plan/search.h"

#include <cmath>
#include <cstdlib>

#include "engine/author/attempt.h"
#include "engine/plan/case.h"
#include "engine/plan/judge.h"
#include "physics/geometry/random.h"
#include "tests/engine/plan/fork.h"

namespace plan {
namespace {

using exercise::Exercise;

using test::plan_cache;

Exercise start_of(const scenario::Scenario& s) {
    return {s, exercise::Pictures::None, plan_cache};
}

/// A straight wire, and a straight catheter that starts outside.
scenario::Scenario in_straight_catheter() {
    const CaseText both = with_devices(
        {test::fork_toml(), "fork.toml"},
        {"both",
         {{script::DeviceRole::Wire, "glidestraight035"}, {script::DeviceRole::Catheter, "guide6f"}}});
    return scenario::parse_scenario(both.toml, both.file, test::asset("devices"));
}

SearchOptions small_search() {
    SearchOptions options;
    options.most_frames = 4000;
    options.courses = 3;
    return options;
}

std::vector<std::string> texts_of(const Found& found) {
    std::vector<std::string> texts;
    for (const Course& course : found.courses) texts.push_back(course.text());
    texts.push_back(found.nearest.text());
    return texts;
}

}  // namespace

TEST(PlanSearch, AnAngledWireReachesABranchThatAStraightOneGoesPast) {
    const Found angled = search(start_of(test::fork("glide035")), small_search());
    ASSERT_FALSE(angled.courses.empty());
    const Found straight = search(start_of(test::fork("glidestraight035")), small_search());
    EXPECT_TRUE(straight.courses.empty());
    ASSERT_FALSE(straight.failures.empty());
    // It says what the wire did and where.
    EXPECT_EQ(straight.failures.front().ending, Ending::Passes);
    EXPECT_EQ(straight.failures.front().branch, "trunk");
    EXPECT_GT(std::abs(straight.nearest.left), 10);
}

/// What the search has found is what a script of it does, on an exercise of its own.
TEST(PlanSearch, EveryCourseReachesTheTargetWhenItsScriptIsPlayed) {
    for (const char* name : {"straight", "s_bend", "renal_right"}) {
        const scenario::Scenario s = scenario::load_scenario(
            test::asset(std::string("scenarios/") + name + ".toml"), test::asset("devices"));
        const Exercise start = start_of(s);
        const Found found = search(start, small_search());
        ASSERT_FALSE(found.courses.empty()) << name;
        for (const Course& course : found.courses) {
            Exercise own(s, exercise::Pictures::None, plan_cache);
            const author::Attempt made = author::attempt(own, course.script(), author::exact_hand, 0);
            EXPECT_TRUE(made.score.completed) << name << "\n" << course.text();
            EXPECT_EQ(made.defects, std::vector<std::string>()) << name << "\n" << course.text();
        }
    }
}

/// A wire of 0.018 in that a guiding catheter's bend holds back, in renal_stent.
TEST(PlanSearch, AShaftThatBowsOutsideIsHeldCloser) {
    const scenario::Scenario s = test::shipped_scenario("renal_stent");
    SearchOptions options = small_search();
    options.courses = 1;
    options.most_frames = 1500;
    const Found found = search(start_of(s), options);
    ASSERT_FALSE(found.courses.empty());
    test::expect_said(found.courses.front().text(), "grip wire 20 mm");
    Exercise own(s, exercise::Pictures::None, plan_cache);
    EXPECT_LE(author::attempt(own, found.courses.front().script(), author::exact_hand, 0).smallest_radius,
              s.target.radius);
}

/// A straight wire in a straight catheter, which no turn leads aside, changed for an angled one there.
TEST(PlanSearch, AWireThatCannotIsExchangedForOneThatCan) {
    const scenario::Scenario s = in_straight_catheter();
    SearchOptions options = small_search();
    options.most_frames = 8000;
    EXPECT_TRUE(search(start_of(s), options).courses.empty());
    options.wires = {"glide035"};
    const Found found = search(start_of(s), options);
    ASSERT_FALSE(found.courses.empty());
    for (const Course& course : found.courses) {
        EXPECT_GE(course.exchanges(), 1);
        test::expect_said(course.text(), "remove wire");
        test::expect_said(course.text(), "exchange wire glide035");
        Exercise own(s, exercise::Pictures::None, plan_cache);
        const author::Attempt made = author::attempt(own, course.script(), author::exact_hand, 0);
        EXPECT_TRUE(made.score.completed) << course.text();
        EXPECT_EQ(made.defects, std::vector<std::string>()) << course.text();
    }
}

/// The same for targets, holds, starts and wires that nobody chose; SELDINGER_FUZZ_SEEDS=1000 tries more.
TEST(PlanSearch, WildTargetsAreReachedByTheScriptOrByNone) {
    const char* asked = std::getenv("SELDINGER_FUZZ_SEEDS");
    const int seeds = asked ? std::atoi(asked) : 8;
    int reached = 0, exchanged = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
        geometry::Random random(geometry::golden_step * static_cast<std::uint64_t>(seed));
        const char* wires[] = {"glide035", "glidestraight035", "jwire035", "rosen035", "floppy014", "v18"};
        scenario::Scenario s = test::fork(wires[static_cast<int>(6 * random())]);
        // Every third time the wire lies in a catheter, through which it may be exchanged.
        const bool exchanges = seed % 3 == 0;
        if (exchanges) s = in_straight_catheter();
        s.target.name.clear();
        // In the trunk, or along the branch.
        const double along = random.between(0, 38);
        s.target.centre = random() < 0.4 ? geometry::Vec3(random.between(-2, 2), 0, random.between(45, 128))
                                         : geometry::Vec3(along, 0, 70 + along);
        s.target.radius = random.between(0.5, 8);
        s.target.hold = random.between(0, 1);
        s.wire().inserted = random.between(20, 60);
        const Exercise start = start_of(s);
        SearchOptions options = small_search();
        options.most_frames = 1000;
        options.seed = static_cast<std::uint64_t>(seed);
        if (exchanges)
            options.wires = {wires[static_cast<int>(4 * random())], "standard014"},
            options.most_frames = 3000;
        const Found found = search(start, options);
        for (const Course& course : found.courses) exchanged += course.exchanges() > 0;
        reached += !found.courses.empty();
        for (const Course& course : found.courses) {
            Exercise own(start);
            const author::Attempt made = author::attempt(own, course.script(), author::exact_hand, 0);
            EXPECT_TRUE(made.score.completed) << "seed " << seed << "\n" << course.text();
        }
        EXPECT_TRUE(std::isfinite(found.nearest.left)) << "seed " << seed;
    }
    std::printf("%d of %d wild targets reached, by %d courses with an exchange\n", reached, seeds, exchanged);
    EXPECT_GT(reached, 0);
}

TEST(PlanSearch, IsTheSameForAnyNumberOfThreadsAndLeavesTheStartAsItIs) {
    for (const std::uint64_t seed : {1u, 7u, 99u}) {
        // Only restarts draw numbers: the straight wire needs them, as it does not reach.
        for (const char* wire : {"glide035", "glidestraight035"}) {
            const Exercise start = start_of(test::fork(wire));
            const auto before = start.snapshot().state;
            SearchOptions options = small_search();
            options.seed = seed;
            options.threads = 1;
            const Found one = search(start, options);
            options.threads = 3;
            const Found three = search(start, options);
            EXPECT_EQ(texts_of(one), texts_of(three)) << wire << ", seed " << seed;
            EXPECT_EQ(one.frames, three.frames);
            EXPECT_EQ(one.states, three.states);
            EXPECT_EQ(start.snapshot().state, before);
        }
    }
}

TEST(PlanSearch, EndsWhenItIsToldToWithTheBestSoFar) {
    SearchOptions options = small_search();
    int asked = 0;
    options.stop = [&asked] { return ++asked == 2; };
    const Found found = search(start_of(test::fork("glidestraight035")), options);
    EXPECT_TRUE(found.stopped);
    EXPECT_EQ(asked, 2);
    EXPECT_FALSE(found.nearest.lines.empty());
    EXPECT_LT(found.frames, options.most_frames);
}

TEST(PlanSearch, SimulatesNoMoreThanItMay) {
    SearchOptions options = small_search();
    options.most_frames = 1000;
    const Found found = search(start_of(test::fork("glidestraight035")), options);
    // A round of moves ends after it began.
    EXPECT_LT(found.frames, 1000 + 8 * 400);
}

TEST(PlanJudge, CountsTheHandsThatReachAndPrefersMoreOfThem) {
    const scenario::Scenario s = test::fork();
    const Exercise start = start_of(s);
    const Found found = search(start, small_search());
    ASSERT_FALSE(found.courses.empty());
    JudgeOptions options;
    options.cache = plan_cache;
    const Judged judged = judge(start, found.courses.front(), options);
    EXPECT_TRUE(judged.reaches);
    EXPECT_EQ(judged.hands, 10);
    EXPECT_GE(judged.hands_reach, 5);
    Course short_of_it = found.courses.front();
    short_of_it.lines.pop_back();
    const Judged none = judge(start, short_of_it, options);
    EXPECT_FALSE(none.reaches);
    EXPECT_EQ(none.hands_reach, 0);
    EXPECT_LT(judged.order(), none.order());
    const Judged again = improved(start, judged, options);
    EXPECT_GE(again.success(), judged.success());
}

/// In a straight tube neither stiffness nor friction moves the tip by much; what is pushed does, by what is
/// pushed.
TEST(PlanJudge, SensitivitiesAreThoseOfTheWholeCourse) {
    const scenario::Scenario s =
        scenario::load_scenario(test::asset("scenarios/straight.toml"), test::asset("devices"));
    const Found found = search(start_of(s), small_search());
    ASSERT_FALSE(found.courses.empty());
    JudgeOptions options;
    options.cache = plan_cache;
    const Course& course = found.courses.front();
    const std::vector<Sensitivity> all = sensitivities(s, course.script(), options);
    ASSERT_EQ(all.size(), 6u);
    double pushed = 0;
    for (const author::ScriptLine& line : course.lines)
        if (const auto* advance = std::get_if<script::Advance>(&line.command))
            pushed += advance->length * (line.last - line.first + 1);
    for (const Sensitivity& one : all) {
        if (one.of == "amounts of pushes")
            EXPECT_NEAR(one.tip, 0.05 * pushed, 0.1);
        else
            EXPECT_LT(one.tip, 1) << one.of;
        // Friction and amounts of the hand are of the way, and have no derivative at its end.
        const bool at_end = one.of.starts_with("EI") || one.of == "stiffness of the wall" ||
                            one.of == "radius of the vessels";
        EXPECT_EQ(one.at_end.has_value(), at_end) << one.of;
        EXPECT_EQ(one.force_at_end.has_value(), at_end) << one.of;
    }
}

}  // namespace plan
