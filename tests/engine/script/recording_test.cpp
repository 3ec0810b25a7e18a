#include "engine/script/recording.h"

#include "tests/engine/fixtures.h"

namespace script {

TEST(Recording, IsAScriptWithTheCommandsStatesAndEnd) {
    const test::TemporaryFolder folder;
    Recording recording(folder / "run.gw", {"test 1", "small", 2});
    recording.frame(0, std::vector<Command>{Beam{true}}, [] { return 0xaull; });
    recording.frame(1, std::vector<Command>{Advance{2}, Rotate{0.5}}, [] { return 0xbull; });
    recording.frame(2, {}, [] { return 0xcull; });
    recording.frame(3, {}, [] { return 0xdull; });
    recording.close([] { return 0xdull; });
    const CommandScript script = load_commands(folder / "run.gw");
    ASSERT_EQ(script.commands.size(), 3u);
    EXPECT_EQ(script.commands[1].frame, 1);
    ASSERT_EQ(script.checks.size(), 3u);  // 0, 2 and the last
    EXPECT_EQ(script.checks[2].frame, 3);
    EXPECT_EQ(script.checks[2].hash, 0xdu);
    EXPECT_EQ(script.end, 3);
}

TEST(Recording, CanBeReplayedAfterEachFrame) {
    const test::TemporaryFolder folder;
    Recording recording(folder / "run.gw", {"test 1", "small", 10});
    for (int frame = 0; frame < 5; ++frame) {
        recording.frame(frame, std::vector<Command>{Advance{1}}, [] { return 7ull; });
        EXPECT_EQ(load_commands(folder / "run.gw").commands.size(), static_cast<std::size_t>(frame) + 1);
    }
}

TEST(Recording, UnwritablePlaceIsRefused) {
    EXPECT_NE(test::refusal([] { Recording("/nowhere/run.gw", {}); }).find("/nowhere/run.gw"),
              std::string::npos);
}

}  // namespace script
