/// A teacher beside the trainee: what is set, shown and said comes into the exercise and into its recording.

#include <gtest/gtest.h>
#include <thread>

#include "engine/room/session.h"
#include "engine/run/headless.h"
#include "tests/engine/fixtures.h"

namespace room {
namespace {

using Thing = script::TeacherAct::Thing;

SessionOptions recorded_in(const std::filesystem::path& file) {
    SessionOptions options;
    options.scenario = test::small_scenario();
    options.keys = load_keys(test::asset("keys.toml"));
    options.record = Attempts(file);
    return options;
}

bool comes(const Session& session, const std::function<bool(const View&)>& pleases) {
    for (int k = 0; k < 6000; ++k) {
        if (pleases(*session.view())) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
}
bool reaches(const Session& session, Phase phase) {
    return comes(session, [phase](const View& view) { return view.phase == phase; });
}
bool makes(const Session& session, int frames) {
    return comes(session, [frames](const View& view) { return view.frames >= frames; });
}
bool tells(const Session& session, const std::string& words) {
    return comes(session, [&](const View& view) {
        return view.events && std::ranges::any_of(*view.events, [&](const LessonEvent& event) {
                   return event.what.find(words) != std::string::npos;
               });
    });
}

run::RunResult again(const std::filesystem::path& recording) {
    run::RunOptions options;
    options.images = false;
    options.expect = recording;
    return run::run_headless(test::small_scenario(), script::load_commands(recording), options);
}

TEST(SessionOfATeacher, WhatIsShownSetAndSaidIsRecordedAndReplays) {
    test::TemporaryFolder folder;
    Session session(recorded_in(folder / "run.gw"));
    ASSERT_TRUE(reaches(session, Phase::Ready));
    script::TeacherScreen screen = script::usual_screen;
    screen[static_cast<std::size_t>(Thing::Hints)] = false;
    session.give(screen);
    session.give(Control::Start);
    ASSERT_TRUE(makes(session, 3));
    screen[static_cast<std::size_t>(Thing::Target)] = true;
    session.give(screen);
    ASSERT_TRUE(tells(session, "target shown"));
    script::Complicate spasm{script::ComplicationKind::Spasm, "tube", 40, 10, 50, {}};
    session.give_command(spasm);
    ASSERT_TRUE(tells(session, "Set: spasm of the tube"));
    session.give(script::Comment{2, "look here"});
    ASSERT_TRUE(tells(session, "look here"));
    EXPECT_EQ(session.view()->refused, "");
    session.give_command(script::Relieve{script::ComplicationKind::Spasm, "tube"});
    ASSERT_TRUE(tells(session, "Relieved: spasm of the tube"));
    session.give(Control::Finish);
    ASSERT_TRUE(reaches(session, Phase::Ended));
    session.give(script::Comment{session.view()->frames - 1, "after the end"});
    ASSERT_TRUE(tells(session, "after the end"));

    const script::CommandScript script = script::load_commands(folder / "run.gw");
    ASSERT_TRUE(script.origin && script.origin->date);
    const auto age = std::chrono::system_clock::now() - *script.origin->date;
    EXPECT_LT(age, std::chrono::hours(1));
    ASSERT_EQ(script.comments.size(), 2u);
    EXPECT_EQ(script.comments[0].text, "look here");
    EXPECT_EQ(script.comments[0].frame, 2);
    EXPECT_EQ(script::to_text(script.commands.at(0).command), "teacher hints off");
    EXPECT_EQ(script.commands.at(0).frame, 0);
    const run::RunResult result = again(folder / "run.gw");
    EXPECT_TRUE(result.differences.empty());
    EXPECT_GT(result.compared_states, 0);
    ASSERT_EQ(result.score.teacher.size(), 2u);
    EXPECT_EQ(exercise::text_of(result.score.teacher[1].act), "target shown");
}

TEST(SessionOfATeacher, WhatTheseVesselsCannotHaveIsRefusedAndNotRecorded) {
    test::TemporaryFolder folder;
    Session session(recorded_in(folder / "run.gw"));
    ASSERT_TRUE(reaches(session, Phase::Ready));
    session.give(Control::Start);
    session.give_command(script::Complicate{script::ComplicationKind::Thrombus, "nowhere", 10, 10, 100, {}});
    ASSERT_TRUE(comes(session, [](const View& view) { return !view.refused.empty(); }));
    test::expect_said(session.view()->refused, "nowhere");
    session.give(script::Comment{session.view()->frames + 100'000, "of no frame"});
    ASSERT_TRUE(comes(session, [](const View& view) { return view.refused.starts_with("A comment"); }));
    session.give(Control::Finish);
    ASSERT_TRUE(reaches(session, Phase::Ended));
    const script::CommandScript script = script::load_commands(folder / "run.gw");
    EXPECT_TRUE(script.commands.empty());
    EXPECT_TRUE(script.comments.empty());
}

TEST(SessionOfATeacher, WhatATeacherStopsOnlyATeacherLetsGoOn) {
    test::TemporaryFolder folder;
    Session session(recorded_in(folder / "run.gw"));
    ASSERT_TRUE(reaches(session, Phase::Ready));
    session.give(Control::Start);
    ASSERT_TRUE(makes(session, 3));
    session.give(Control::TeacherPause);
    ASSERT_TRUE(reaches(session, Phase::Paused));
    EXPECT_TRUE(session.view()->teacher_paused);
    const int frames = session.view()->frames;
    const long serial = session.view()->serial;
    session.give(Control::Resume);
    ASSERT_TRUE(comes(session, [&](const View& view) { return view.serial > serial; }));
    EXPECT_EQ(session.view()->phase, Phase::Paused);
    EXPECT_EQ(session.view()->frames, frames);
    session.give(Control::TeacherResume);
    ASSERT_TRUE(makes(session, frames + 2));
    session.give(Control::Finish);
    ASSERT_TRUE(reaches(session, Phase::Ended));
    ASSERT_EQ(session.view()->score.teacher.size(), 1u);
    EXPECT_EQ(exercise::text_of(session.view()->score.teacher[0].act), "paused");
}

TEST(SessionOfATeacher, OfARecordingTheCommentsAreToldAndNothingIsTaken) {
    SessionOptions options = recorded_in({});
    options.record = {};
    options.script = script::parse_commands("0 beam on\ncomment 4 well done\n12 end\n", "script.gw");
    Session session(std::move(options));
    ASSERT_TRUE(reaches(session, Phase::Ready));
    session.give(script::TeacherScreen{true, true, false, false, false, false, true});
    session.give(Control::Start);
    ASSERT_TRUE(reaches(session, Phase::Ended));
    ASSERT_TRUE(tells(session, "well done"));
    EXPECT_EQ(session.view()->events->size(), 1u);
    EXPECT_TRUE(session.view()->score.teacher.empty());
}

}  // namespace
}  // namespace room
