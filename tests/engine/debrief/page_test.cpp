#include "engine/debrief/page.h"

#include <nlohmann/json.hpp>

#include "tests/engine/debrief/html.h"
#include "tests/engine/exercise/treated.h"

namespace debrief {
namespace {

script::CommandScript recording(const std::string& script, const std::string& learner = "") {
    script::CommandScript made = script::parse_commands(script, "run.gw");
    made.origin.emplace();
    made.origin->learner = learner;
    return made;
}

/// Moved without beam, then turned and pushed to the open end, with an injection.
const std::string clumsy =
    "2 advance 2 mm\n5 beam on\n6..40 advance 2 mm\n41 rotate 30 deg\n45 inject 2 ml at 4 ml/s into tube\n"
    "120 end\n";

StoryOptions quick() {
    StoryOptions options;
    options.images = false;
    return options;
}

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
}

}  // namespace

TEST(Debrief, ThePageHasEveryErrorAndFigureAndIsWhole) {
    scenario::Scenario scenario = test::small_scenario();
    scenario.lesson.benchmark.by = "two <people>";
    scenario.lesson.benchmark.attempts = 2;
    scenario.lesson.benchmark.completed_after.values = {2.0, 2.4};
    const std::vector<Story> stories = {
        *tell(scenario, recording("0 beam on\n1..24 advance 2 mm\n40 end\n"), quick()),
        *tell(scenario, recording(clumsy, "Ada"), quick())};
    const Story& story = stories.back();
    ASSERT_EQ(story.moments.size(), 121u);
    ASSERT_GE(story.score.handling_errors.size(), 3u);
    const std::string html = page(stories, &stories.front());
    EXPECT_EQ(test::unbalanced(html), "");
    test::expect_said(html, "of Ada");
    // Each error: in the list, in the time line, on both sides of the way.
    EXPECT_EQ(count(html, "href=\"#e1\""), 4u);
    EXPECT_EQ(count(html, "id=\"row"), story.score.handling_errors.size());
    for (const char* part :
         {"Time to the target", "expert", "attempt before", "skilled attempts", "by two &lt;people&gt;",
          "2.2 ± 0.3 s", "Learning curve", "Smoothness", "of 100 points"})
        EXPECT_NE(html.find(part), std::string::npos) << part;
    const std::string open = "<script type=\"application/json\" id=\"data\">";
    const std::size_t begin = html.find(open) + open.size();
    const auto data = nlohmann::json::parse(html.substr(begin, html.find("</script>", begin) - begin));
    EXPECT_EQ(data["moments"].size(), 121u);
    EXPECT_EQ(data["marks"].size(), story.score.handling_errors.size());
    EXPECT_NEAR(data["moments"].back()[5].get<double>(), story.moments.back().inserted.at(0), 0.01);
}

TEST(Debrief, EveryFigureHasAMeaningAndAMissedAttemptIsBetterAtNothing) {
    Story story = *tell(test::small_scenario(), recording(clumsy), quick());
    scenario::Benchmark& skilled = story.scenario.lesson.benchmark;
    skilled.attempts = 2;
    skilled.wire_travel.values = {1e5, 1e5};
    story.score.completed = true;
    std::string html = page(std::span(&story, 1), nullptr);
    EXPECT_EQ(count(html, "class=\"better\""), 1u);
    EXPECT_EQ(count(html, "<dt>"), 27u);  // 25 figures, and what the marks mean
    EXPECT_EQ(count(html, "<dd></dd>"), 0u);
    story.score.completed = false;
    EXPECT_EQ(count(page(std::span(&story, 1), nullptr), "class=\"better\""), 0u);
    skilled.wire_travel.values = {1, 1};
    html = page(std::span(&story, 1), nullptr);
    EXPECT_EQ(count(html, "class=\"worse\""), 1u);
    // Less than what the grade says does not matter is not judged.
    skilled.wire_travel.values = {story.score.wire_travel - 9, story.score.wire_travel - 9};
    EXPECT_EQ(count(page(std::span(&story, 1), nullptr), "class=\"worse\""), 0u);
}

TEST(Debrief, NotesOfTheRunStandAtTheEndInClinicalNames) {
    Story story = *tell(test::small_scenario(), recording(clumsy), quick());
    story.branches[0].name = "aorta+LCIA+LEIA+LCFA";
    story.notices = {"segments of 2 mm were chosen: 'aorta+LCIA+LEIA+LCFA' is as narrow as 'LRA'"};
    const std::string html = page(std::span(&story, 1), nullptr);
    EXPECT_GT(html.find("segments of 2 mm"), html.find("What the figures mean"));
    test::expect_said(html, "Notes on the run (1)");
    test::expect_said(html, "&#39;aorta to left common femoral artery&#39; is as narrow as &#39;LRA&#39;");
}

TEST(Debrief, WhatPeopleTypedIsShownAndNotRun) {
    const std::string evil = "<script>alert(1)</script>\"'&<img src=x onerror=alert(2)>\x01";
    scenario::Scenario scenario = test::small_scenario();
    scenario.title = evil;
    script::CommandScript typed = recording(clumsy, evil);
    typed.origin->program = evil;
    typed.file = evil + ".gw";
    Story story = *tell(scenario, typed, quick());
    story.notices.push_back(evil);
    story.differences.push_back(evil);
    story.score.handling_errors[0].branch = evil;
    story.score.wrong_branches = {{evil, 1, 2.0}};
    story.key_frames.push_back({3, evil, {1, 2, 3, 4}});
    const std::string html = page(std::span(&story, 1), nullptr);
    EXPECT_EQ(html.find("<script>alert"), std::string::npos);
    EXPECT_EQ(html.find("<img src=x"), std::string::npos);
    EXPECT_EQ(html.find('\x01'), std::string::npos);
    EXPECT_EQ(test::unbalanced(html), "");
    test::expect_said(html, "base64,AQIDBA==");
}

TEST(Debrief, WhatTheTeacherSaidAndDidStandsAtItsMoment) {
    const std::string evil = "<script>alert(1)</script>";
    const script::CommandScript script = recording(
        "0 beam on\n1..20 advance 1 mm\n15 teacher target on\n20 complication breath cough\n25 reset\n"
        "comment 3 of the first\ncomment 50 " +
        evil +
        "\n40..60 advance 1 mm\n55 teacher paused\n"
        "60 complication spasm of tube at 40 mm over 10 mm by 50 percent\n80 end\n");
    const Story story = *tell(test::small_scenario(), script, quick());
    const std::string html = page(std::span(&story, 1), nullptr);
    EXPECT_EQ(test::unbalanced(html), "");
    EXPECT_EQ(html.find("<script>alert"), std::string::npos);
    test::expect_said(html, "of the first <small>frame 3");
    test::expect_said(html, "<li class=\"said\" data-frame=\"50\"><b>0:01</b>&lt;script&gt;");
    test::expect_said(html, "<li class=\"did\" data-frame=\"25\"><b>0:00</b>target shown");
    test::expect_said(html, "<li class=\"did\" data-frame=\"55\"><b>0:02</b>paused");
    test::expect_said(html, "<li>spasm of the tube at ");
    EXPECT_EQ(html.find("the patient coughs"), std::string::npos) << "of the attempt before";
    EXPECT_EQ(count(html, "38l-5-9h10z"), 1u);
    const Story alone = *tell(test::small_scenario(), recording(clumsy), quick());
    EXPECT_EQ(page(std::span(&alone, 1), nullptr).find("The teacher"), std::string::npos);
}

TEST(Debrief, ThePageAsksNothingOfAnyNetwork) {
    const Story story = *tell(test::small_scenario(), recording(clumsy), quick());
    const std::string html = page(std::span(&story, 1), nullptr);
    EXPECT_EQ(html.find("http:"), std::string::npos);
    EXPECT_EQ(html.find("https:"), std::string::npos);
    test::expect_said(html, "default-src 'none'");
}

TEST(Debrief, ATreatmentHasItsSectionWithPicturesBeforeAndAfter) {
    const script::CommandScript script = recording(
        "0 beam on\n1 inject 4 ml at 4 ml/s into tube\n30 beam off\n40 inflate 12 atm\n150 deflate\n230 beam "
        "on\n"
        "231 inject 4 ml at 4 ml/s into tube\n260 end\n");
    const scenario::Scenario scenario =
        test::scenario_to_treat(test::balloon_catheter(true), "stent_from_mm = 46\nstent_to_mm = 60\n");
    const Story story = *tell(scenario, script, {});
    ASSERT_EQ(story.treated.size(), 2u);
    EXPECT_TRUE(story.of_contrast);
    EXPECT_LT(story.treated[0].frame, 40);
    EXPECT_GT(story.treated[1].frame, 230);
    const std::string html = page(std::span(&story, 1), nullptr);
    EXPECT_EQ(test::unbalanced(html), "");
    for (const char* part :
         {"<h2>Treatment</h2>", "Residual stenosis", "Covered by stents", "Highest pressure",
          "balloon and lumen over time", "before the treatment", "Pd/Pa in hyperaemia"})
        EXPECT_NE(html.find(part), std::string::npos) << part;
    // Without images there are none, without contrast the last ones.
    const Story without = *tell(scenario, script, quick());
    EXPECT_TRUE(without.treated.empty());
    EXPECT_EQ(test::unbalanced(page(std::span(&without, 1), nullptr)), "");
    const Story plain = *tell(scenario, recording("0 beam on\n5 inflate 12 atm\n60 deflate\n130 end\n"), {});
    ASSERT_EQ(plain.treated.size(), 2u);
    EXPECT_FALSE(plain.of_contrast);
    EXPECT_EQ(plain.treated[0].frame, 4);
    EXPECT_EQ(plain.treated[1].frame, 130);
    const Story other = *tell(test::small_scenario(), recording(clumsy), quick());
    EXPECT_EQ(page(std::span(&other, 1), nullptr).find("Treatment"), std::string::npos);
}

TEST(Debrief, KeyFramesAreWhereErrorsBegan) {
    StoryOptions options;
    const Story story = *tell(test::small_scenario(), recording(clumsy), options);
    ASSERT_GE(story.key_frames.size(), 2u);
    for (const KeyFrame& frame : story.key_frames) {
        EXPECT_GT(frame.png.size(), 100u);
        const bool known = frame.frame == 120 ||
                           std::any_of(story.score.handling_errors.begin(), story.score.handling_errors.end(),
                                       [&](const auto& mark) { return mark.first == frame.frame; });
        EXPECT_TRUE(known) << frame.frame;
    }
    EXPECT_TRUE(story.score.air_kerma);
}

TEST(Debrief, AttemptsOfOneRecordingAreAllInTheCurve) {
    const Story story =
        *tell(test::small_scenario(),
              recording("0 beam on\n1..5 advance 2 mm\n10 reset\n11 beam on\n12..35 advance 2 mm\n50 end\n"),
              quick());
    EXPECT_EQ(story.earlier.size(), 1u);
    EXPECT_EQ(story.moments.front().frame, 10);
    test::expect_said(page(std::span(&story, 1), nullptr), "Learning curve");
}

TEST(Debrief, AnEmptyOrShortRecordingHasAPageAllTheSame) {
    for (const char* script : {"0 end\n", "", "0 advance 1 mm\n0 end\n"}) {
        const Story story = *tell(test::small_scenario(), recording(script), quick());
        EXPECT_EQ(test::unbalanced(page(std::span(&story, 1), nullptr)), "") << script;
    }
}

}  // namespace debrief
