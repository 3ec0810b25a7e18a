#include <nlohmann/json.hpp>

#include "engine/exercise/exercise.h"
#include "engine/exercise/score.h"
#include "engine/exercise/score_file.h"
#include "engine/run/headless.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

run::RunResult played(const std::string& script) {
    run::RunOptions options;
    options.images = false;
    return run::run_headless(test::small_scenario(), script::parse_commands(script, "run.gw"), options);
}

TEST(TeacherMarks, TheScoreSaysWhatWasShownHiddenAndPausedAndWhen) {
    const run::RunResult result = played(
        "0 advance 1 mm\n29 teacher target on\n44 teacher target off\n50 teacher hints off\n59 teacher "
        "paused\n"
        "70 end\n");
    const auto& marks = result.score.teacher;
    ASSERT_EQ(marks.size(), 4u);
    EXPECT_EQ(text_of(marks),
              "target shown at 0:02, target hidden at 0:03, hints hidden at 0:03, paused at 0:04");
    EXPECT_EQ(heading_of(marks), "helped by the teacher");
    EXPECT_EQ(heading_of(std::span(marks).subspan(1)), "by the teacher");
    EXPECT_EQ(marks[3].frame, 59);
}

TEST(TeacherMarks, NothingMovesByThem) {
    const run::RunResult with =
                             played("0..20 advance 1 mm\n5 teacher way on\n8 teacher readouts off\n60 end\n"),
                         without = played("0..20 advance 1 mm\n60 end\n");
    EXPECT_EQ(with.score.tip_path, without.score.tip_path);
    EXPECT_EQ(with.score.handling_errors.size(), without.score.handling_errors.size());
    EXPECT_TRUE(without.score.teacher.empty());
}

TEST(TeacherMarks, WhatIsStillShownIsSaidOfTheNextAttemptAsWell) {
    const run::RunResult result = played(
        "0 advance 1 mm\n9 teacher target on\n12 teacher hints off\n15 teacher hints on\n20 teacher paused\n"
        "30 reset\n60 end\n");
    ASSERT_EQ(result.earlier.size(), 1u);
    EXPECT_EQ(result.earlier[0].teacher.size(), 4u);
    ASSERT_EQ(result.score.teacher.size(), 1u);
    EXPECT_EQ(text_of(result.score.teacher), "target shown at 0:00");
    EXPECT_EQ(result.score.teacher[0].frame, 30);
}

TEST(TeacherMarks, StandInTheFileWhereThereAreAny) {
    const run::RunResult result = played("0 advance 1 mm\n9 teacher window on\n20 end\n");
    const auto json = nlohmann::json::parse(to_json({"test 1", "", result.score, {}, {}}));
    ASSERT_EQ(json["teacher"].size(), 1u);
    EXPECT_EQ(json["teacher"][0]["act"], "window");
    EXPECT_EQ(json["teacher"][0]["frame"], 9);
    const run::RunResult alone = played("0 advance 1 mm\n20 end\n");
    EXPECT_FALSE(nlohmann::json::parse(to_json({"test 1", "", alone.score, {}, {}})).contains("teacher"));
}

TEST(TeacherMarks, TheirLinesReadBackAndOthersAreRefused) {
    for (const char* line :
         {"teacher target on", "teacher way off", "teacher hints off", "teacher readouts on",
          "teacher reference off", "teacher captions off", "teacher window on", "teacher paused"})
        EXPECT_EQ(script::to_text(
                      script::parse_commands(std::string("0 ") + line + "\n", "x.gw").commands.at(0).command),
                  line);
    const auto said = [](const std::string& text) {
        return test::refusal([&] { script::parse_commands(text, "x.gw"); });
    };
    test::expect_said(said("0 teacher score on\n"), "expected paused, target, way");
    test::expect_said(said("0 teacher target\n"), "expected 'on' or 'off'");
    test::expect_said(said("0 teacher paused on\n"), "expected the end of the line");
}

}  // namespace
}  // namespace exercise
