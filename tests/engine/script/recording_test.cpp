#include "engine/script/recording.h"

#include <random>

#include "engine/io/files.h"
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

TEST(Recording, CutByAKillAtAnyByteItIsTheLinesThatAreWhole) {
    const test::TemporaryFolder folder;
    Recording recording(folder / "run.gw", {{"test 1", "small", "Ada", "", 1, 2, 3}, 2});
    for (int frame = 0; frame < 4; ++frame)
        recording.frame(
            frame,
            std::vector<Command>{Advance{1.25}, Inject{5, 2.5, "main"}, Rotate{0.5, DeviceRole::Catheter}},
            [] { return 7ull; });
    recording.comment({1, "slower"});
    recording.close([] { return 7ull; });
    const std::string text = io::read_text(folder / "run.gw", "recording", "");
    const auto said = [](const CommandScript& script) {
        std::string all = fmt::format("{} {} {} checks, {} comments, end {}\n", script.origin->program,
                                      script.origin->scenario, script.checks.size(), script.comments.size(),
                                      script.end.value_or(-1));
        for (const TimedCommand& timed : script.commands)
            all += fmt::format("{} {}\n", timed.frame, to_text(timed.command));
        return all;
    };
    for (std::size_t cut = text.find('\n') + 1; cut + 1 < text.size(); ++cut) {
        const std::string whole = text.substr(0, text.rfind('\n', cut - 1) + 1);
        EXPECT_EQ(said(parse_commands(text.substr(0, cut), "x.gw")), said(parse_commands(whole, "x.gw")))
            << cut;
    }
    // An editor may leave out the last line feed.
    EXPECT_EQ(said(parse_commands(text.substr(0, text.size() - 1), "x.gw")),
              said(parse_commands(text, "x.gw")));
    EXPECT_EQ(parse_commands("0 beam on\n1 advance 2 mm", "script.gw").commands.size(), 2u);
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
    test::expect_said(said("recording 3\nscenario 12 renal\n"), "x.gw:2:10: expected a hash of 16");
    test::expect_said(said("recording 3\nlesson 6 of 5\n"),
                      "x.gw:2:1: expected, in a recording, 'lesson DONE");
    test::expect_said(said("recording 3\npatient Ada B\n"), "x.gw:2:9: expected a number, or seed:17");
    test::expect_said(said("learner Ada\n"), "x.gw:1:1: 'learner' was found");
    test::expect_said(said("recording 3\nlearner " + std::string(65, 'a') + "\n"),
                      "x.gw:2:9: expected a name of at");
    test::expect_said(said("recording 3\n1 beam on\nlearner Ada\n"), "x.gw:3:1");
}

TEST(Recording, ASignatureIsItsLastLineAndNothingElse) {
    const std::string start = "recording 3\n0 beam on\n5 end\n", digits(128, 'a');
    const auto said = [](const std::string& text) {
        return test::refusal([&] { parse_commands(text, "x.gw"); });
    };
    EXPECT_EQ(parse_commands(start + "signature ed25519 " + digits + "\n", "x.gw").end, 5);
    for (const char* after : {"\n", "# said\n", "comment 3 said\n", " "})
        test::expect_said(said(start + "signature ed25519 " + digits + "\n" + after),
                          "x.gw:5:1: the line before is a recording's signature; expected nothing after it");
    for (const std::string& wrong :
         {"ed25519 " + digits + "a", "ed25519 " + digits.substr(1), "ed25519 " + digits.substr(1) + "A",
          "ed25519 " + digits + "\r", "rsa " + digits, std::string()})
        test::expect_said(said(start + "signature " + wrong + "\n"),
                          "x.gw:4:1: expected, at the end of a recording, 'signature ed25519 ' and 128");
    test::expect_said(said("0 beam on\nsignature ed25519 " + digits + "\n"),
                      "x.gw:2:1: expected, at the end");
}

TEST(Recording, CommentsStandBetweenFramesAndAlsoAfterTheEnd) {
    const test::TemporaryFolder folder;
    Recording recording(folder / "run.gw", {{"test 1", "small", "", "", 0, 0, 0}, 10});
    for (int frame = 0; frame < 4; ++frame)
        recording.frame(frame, std::vector<Command>{Advance{1}}, [] { return 7ull; });
    recording.comment({2, "too fast # here"});
    recording.comment({1, "gut gemacht, Zoë"});
    recording.close([] { return 7ull; });
    recording.comment({3, "at the end"});
    const CommandScript script = load_commands(folder / "run.gw");
    ASSERT_EQ(script.comments.size(), 3u);
    EXPECT_EQ(script.comments[0].text, "gut gemacht, Zoë");
    EXPECT_EQ(script.comments[1].frame, 2);
    EXPECT_EQ(script.comments[1].text, "too fast # here");
    EXPECT_EQ(script.comments[2].text, "at the end");
    EXPECT_EQ(script.commands.size(), 4u);
    EXPECT_EQ(script.end, 3);
}

TEST(Recording, WhatIsTakenBackTakesTheCommentsOnItAlong) {
    const test::TemporaryFolder folder;
    Recording recording(folder / "run.gw", {{"test 1", "small", "", "", 0, 0, 0}, 10});
    for (int frame = 0; frame < 6; ++frame) recording.frame(frame, {}, [] { return 7ull; });
    recording.comment({5, "gone"});
    recording.comment({1, "stays"});
    recording.take_back(2);
    recording.frame(3, {}, [] { return 7ull; });
    recording.comment({3, "new"});
    recording.take_back(2);
    const CommandScript script = load_commands(folder / "run.gw");
    ASSERT_EQ(script.comments.size(), 1u);
    EXPECT_EQ(script.comments[0].text, "stays");
}

TEST(Recording, OfALongAttemptIsTakenBackToAnyOfItsLastFramesOrToNone) {
    const test::TemporaryFolder folder;
    const auto play = [](Recording& recording, int first, int end) {
        for (int frame = first; frame < end; ++frame)
            recording.frame(frame, std::vector<Command>{Advance{0.1}},
                            [frame] { return std::uint64_t(frame); });
    };
    constexpr int frames = 10'000, kept = static_cast<int>(Recording::kept_frames);
    for (const int back : {-1, frames - kept, frames - kept + 1, frames - 2, frames - 1}) {
        Recording recording(folder / "long.gw", {}), direct(folder / "direct.gw", {});
        play(recording, 0, frames);
        recording.take_back(back);
        play(recording, back + 1, back + 4);
        recording.close([] { return 1ull; });
        play(direct, 0, back + 4);
        direct.close([] { return 1ull; });
        EXPECT_EQ(io::read_text(folder / "long.gw", "", ""), io::read_text(folder / "direct.gw", "", ""))
            << back;
    }
}

TEST(Recording, CommentsThatCannotBeAreRefusedWithTheirLine) {
    const auto said = [](const std::string& text) {
        return test::refusal([&] { parse_commands(text, "x.gw"); });
    };
    EXPECT_EQ(said("comment 5 a\r\n0 beam on\n"), "");
    EXPECT_EQ(said("comment 5 " + std::string(longest_comment, 'a') + "\n"), "");
    test::expect_said(said("comment 5 " + std::string(longest_comment + 1, 'a') + "\n"),
                      "x.gw:1:11: expected a text of 1 to 300 bytes");
    for (const std::string bad : {"", " ", "\x01", "a\x7f", "a\tb", "\xff"})
        test::expect_said(said("0 beam on\ncomment 5 " + bad + "\n"),
                          "x.gw:2:11: expected a text of 1 to 300 bytes");
    for (const std::string bad : {"x", "-1", "1000001", "1..2", ""})
        test::expect_said(said("comment " + bad + " words\n"), "x.gw:1:9: ");
    test::expect_said(said("0 beam on\n5 end\ncomment 6 late\n"), "x.gw:3:9: ");
    test::expect_said(said("comment 6 late\n5 end\n"), "x.gw:2:1: ");
    std::mt19937 random(7);
    for (int k = 0; k < 2000; ++k) {
        std::string text;
        for (unsigned n = random() % 400; n > 0; --n) text += static_cast<char>(random() & 0xff);
        if (text.find('\n') != std::string::npos) continue;
        const std::string message = said("comment 5 " + text + "\n");
        std::string_view shown = text;
        while (shown.ends_with('\r') || shown.ends_with(' ')) shown.remove_suffix(1);
        EXPECT_EQ(message.empty(), is_comment(shown)) << message;
    }
}

TEST(Recording, ItsDateIsWrittenAndReadToTheSecond) {
    using namespace std::chrono;
    const sys_seconds at = sys_days(year(2026) / 11 / 26) + hours(20) + minutes(31) + seconds(5);
    EXPECT_EQ(date_text(at), "2026-11-26T20:31:05Z");
    EXPECT_EQ(parse_date("2026-11-26T20:31:05Z"), at);
    EXPECT_EQ(parse_date("2028-02-29T00:00:00Z"), sys_days(year(2028) / 2 / 29));
    for (const char* bad :
         {"", "2026-11-26", "2026-11-26 20:31:05Z", "2026-11-26T20:31:05", "2026-11-31T20:31:05Z",
          "2026-02-29T00:00:00Z", "2026-11-26T24:00:00Z", "2026-11-26T20:60:00Z", "1969-11-26T20:31:05Z",
          "2026-11-26T20:31:60Z", "+026-11-26T20:31:05Z", "2026-11-26T20:31:05Z0"})
        EXPECT_FALSE(parse_date(bad)) << bad;
    const test::TemporaryFolder folder;
    RecordingHeader header{{"test 1", "small", "Ada", "", 1, 2, 3}, 10};
    header.origin.date = at;
    Recording(folder / "run.gw", header).frame(0, {}, [] { return 7ull; });
    EXPECT_EQ(load_commands(folder / "run.gw").origin->date, at);
    EXPECT_EQ(time_of(folder / "run.gw"), at);
    test::expect_refusal([] { parse_commands("recording 3\ndate yesterday\n", "x.gw"); },
                         "x.gw:2:6: expected a time such as");
    test::expect_refusal([] { parse_commands("0 beam on\ndate 2026-11-26T20:31:05Z\n", "x.gw"); },
                         "x.gw:2:1: ");
    std::mt19937 random(8);
    for (int k = 0; k < 5000; ++k) {
        std::string text = "2026-11-26T20:31:05Z";
        for (int n = 0; n < 2; ++n) text[random() % text.size()] = static_cast<char>(random() & 0xff);
        const auto read = parse_date(text);
        EXPECT_TRUE(!read || date_text(*read) == text) << text;
    }
}

TEST(Recording, ThoseOfAFolderStandInTheOrderOfTheirDates) {
    const test::TemporaryFolder folder;
    for (const auto& [name, day] : {std::pair{"b.gw", 2}, {"c.gw", 1}, {"a.gw", 3}})
        test::write(folder / name,
                    "recording 3\ndate 2026-11-0" + std::to_string(day) + "T10:00:00Z\n0 beam on\n");
    std::vector<std::string> names;
    for (const auto& file : recordings_of(folder.path())) names.push_back(file.filename().string());
    EXPECT_EQ(names, (std::vector<std::string>{"c.gw", "b.gw", "a.gw"}));
}

TEST(Recording, UnwritablePlaceIsRefused) {
    test::expect_refusal([] { Recording("/nowhere/run.gw", {}); }, "/nowhere/run.gw");
}

}  // namespace script
