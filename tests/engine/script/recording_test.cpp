#include "engine/script/recording.h"

#include "tests/engine/fixtures.h"

namespace script {

TEST(Recording, IsAScriptWithTheCommandsStatesAndEnd) {
    const test::TemporaryFolder folder;
    Recording recording(folder / "run.gw", {{"test 1", "small", "Ada # <b>", "2", 1, 2, 3}, 2});
    recording.frame(0, std::vector<Command>{Beam{true}}, [] { return 0xaull; });
    recording.frame(1, std::vector<Command>{Advance{2}, Rotate{0.5}}, [] { return 0xbull; });
    recording.frame(2, {}, [] { return 0xcull; });
    recording.frame(3, {}, [] { return 0xdull; });
    recording.practised(3, 5);
    recording.close([] { return 0xdull; });
    const CommandScript script = load_commands(folder / "run.gw");
    ASSERT_TRUE(script.origin);
    EXPECT_EQ(script.origin->patient, "2");
    EXPECT_EQ(script.origin->steps_done, 3);
    EXPECT_EQ(script.origin->steps, 5);
    EXPECT_EQ(script.origin->program, "test 1");
    EXPECT_EQ(script.origin->scenario, "small");
    EXPECT_EQ(script.origin->learner, "Ada # <b>");
    EXPECT_EQ(script.origin->program_hash, 1u);
    EXPECT_EQ(script.origin->scenario_hash, 2u);
    EXPECT_EQ(script.origin->anatomy_hash, 3u);
    ASSERT_EQ(script.commands.size(), 3u);
    EXPECT_EQ(script.commands[1].frame, 1);
    ASSERT_EQ(script.checks.size(), 3u);  // 0, 2 and the last
    EXPECT_EQ(script.checks[2].frame, 3);
    EXPECT_EQ(script.checks[2].hash, 0xdu);
    EXPECT_EQ(script.end, 3);
}

TEST(Recording, CanBeReplayedAfterEachFrame) {
    const test::TemporaryFolder folder;
    Recording recording(folder / "run.gw", {{"test 1", "small", "", "", 0, 0, 0}, 10});
    for (int frame = 0; frame < 5; ++frame) {
        recording.frame(frame, std::vector<Command>{Advance{1}}, [] { return 7ull; });
        EXPECT_EQ(load_commands(folder / "run.gw").commands.size(), static_cast<std::size_t>(frame) + 1);
    }
}

TEST(Recording, OfTheFirstVersionIsRead) {
    const CommandScript script =
        parse_commands("# recorded by seldinger 0.1.0\n# scenario renal\n0 beam on\n5 end\n", "old.gw");
    ASSERT_TRUE(script.origin);
    EXPECT_EQ(script.origin->program, "seldinger 0.1.0");
    EXPECT_EQ(script.origin->scenario, "renal");
    EXPECT_EQ(script.origin->scenario_hash, 0u);
    EXPECT_EQ(parse_commands("# scenario renal\n0 beam on\n", "old.gw").origin->scenario, "renal");
    EXPECT_FALSE(parse_commands("0 beam on\n", "script.gw").origin);
}

TEST(Recording, AHeaderThatIsNoneIsRefusedWithItsLine) {
    const auto said = [](const std::string& text) {
        return test::refusal([&] { parse_commands(text, "x.gw"); });
    };
    test::expect_said(said("recording 4\n"),
                      "x.gw:1:1: expected 'recording 3' in the first line, found 'recording 4'");
    test::expect_said(said("recording 2\n"), "x.gw:1:1: expected 'recording 3', found 'recording 2'");
    test::expect_said(said("0 beam on\nrecording 3\n"), "x.gw:2:1");
    test::expect_said(said("recording 3\nscenario 12 renal\n"), "x.gw:2:10: a hash of 16");
    test::expect_said(said("recording 3\nlesson 6 of 5\n"),
                      "x.gw:2:1: expected, in a recording, 'lesson DONE");
    test::expect_said(said("recording 3\npatient Ada B\n"), "x.gw:2:9: expected a number, or seed:17");
    test::expect_said(said("learner Ada\n"), "x.gw:1:1: 'learner' was found");
    test::expect_said(said("recording 3\nlearner " + std::string(65, 'a') + "\n"), "x.gw:2:9: a name of at");
    test::expect_said(said("recording 3\n1 beam on\nlearner Ada\n"), "x.gw:3:1");
}

TEST(Recording, UnwritablePlaceIsRefused) {
    test::expect_refusal([] { Recording("/nowhere/run.gw", {}); }, "/nowhere/run.gw");
}

}  // namespace script
