/// The exercise on its own thread: what hands did is recorded and replays to the bit, whatever the clock did.

#include "engine/room/session.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <random>
#include <thread>

#include "engine/run/headless.h"
#include "tests/engine/fixtures.h"

namespace room {
namespace {

using namespace std::chrono_literals;

SessionOptions options_of(const std::string& toml = test::small_toml) {
    SessionOptions options;
    options.scenario = test::small_scenario(toml);
    options.keys = load_keys(test::asset("keys.toml"));
    return options;
}

SessionOptions recording_to(const std::filesystem::path& file) {
    SessionOptions options = options_of();
    options.record = Attempts(file);
    return options;
}

/// Waits for a view that meets the condition; false after many seconds.
bool wait_for(const Session& session, const std::function<bool(const View&)>& pleases) {
    for (int k = 0; k < 6000; ++k) {
        if (pleases(*session.view())) return true;
        std::this_thread::sleep_for(5ms);
    }
    return false;
}
bool wait_for(const Session& session, Phase phase) {
    return wait_for(session, [phase](const View& view) { return view.phase == phase; });
}
bool wait_for_frames(const Session& session, int frames) {
    return wait_for(session, [frames](const View& view) { return view.frames >= frames; });
}

/// A session that is ready, and has begun.
struct Begun : Session {
    explicit Begun(SessionOptions options = options_of()) : Session(std::move(options)) {
        EXPECT_TRUE(wait_for(*this, Phase::Ready));
        give(Control::Start);
    }
};
void finish(Session& session) {
    session.give(Control::Finish);
    EXPECT_TRUE(wait_for(session, Phase::Ended));
}

Input holding(std::initializer_list<Action> held) {
    Input input;
    for (const Action action : held) input.held.set(static_cast<std::size_t>(action));
    return input;
}

run::RunResult replayed(const std::filesystem::path& recording) {
    const script::CommandScript script = script::load_commands(recording);
    run::RunOptions options;
    options.images = false;
    options.expect = recording;
    return run::run_headless(test::small_scenario(), script, options);
}

TEST(Session, TheReadoutSaysWhatEachHandAndTheHelperHold) {
    Begun session(options_of(std::string(test::small_toml) + "[catheter]\ndevice = \"cobra5f\"\n"));
    const auto shows = [&](const std::string& right, const std::string& left, const std::string& helper) {
        return wait_for(session, [&](const View& view) {
            const render::Readout& r = view.readout;
            return r.held == right && r.left_hand == left && r.helper == helper;
        });
    };
    EXPECT_TRUE(shows("wire", "catheter", ""));
    Input input;
    input.pressed = {Action::Helper};
    session.give(input);
    EXPECT_TRUE(shows("", "catheter", "wire"));
    input.pressed = {Action::LeftDevice};
    session.give(input);
    EXPECT_TRUE(shows("", "all", ""));
    finish(session);
}

TEST(Session, WhatHandsDidReplaysToTheSameStates) {
    test::TemporaryFolder folder;
    for (unsigned seed = 0; seed < 3; ++seed) {
        std::mt19937 random(seed);
        SessionOptions options = options_of();
        options.free_practice = true;
        options.record = Attempts(folder / "run.gw");
        std::filesystem::path recorded;
        {
            Session session(std::move(options));
            ASSERT_TRUE(wait_for(session, Phase::Ready));
            EXPECT_EQ(session.view()->frames, 0);
            session.give(Control::Start);
            for (int k = 0; k < 40; ++k) {
                Input input;
                for (int a = 0; a < static_cast<int>(room::first_pressed); ++a)
                    if (random() % 4 == 0) input.held.set(static_cast<std::size_t>(a));
                if (random() % 3 == 0)
                    input.pressed.push_back(static_cast<Action>(
                        static_cast<unsigned>(room::first_pressed) +
                        random() % (room::actions - static_cast<unsigned>(room::first_pressed))));
                if (random() % 10 == 0) input.injections.push_back(0);
                session.give(input);
                if (random() % 12 == 0) session.give(Control::TakeBack);
                if (random() % 12 == 0) session.give(Control::Pause);
                session.give(Control::Resume);
                std::this_thread::sleep_for(std::chrono::milliseconds(random() % 40));
            }
            // However busy the machine is, two states stand in the recording.
            session.give(Input());
            ASSERT_TRUE(wait_for_frames(session, std::max(21, session.view()->frames + 2)))
                << "seed " << seed;
            session.give(Control::Finish);
            ASSERT_TRUE(wait_for(session, Phase::Ended)) << "seed " << seed;
            recorded = session.view()->recorded;
        }
        EXPECT_EQ(recorded, folder / (seed == 0 ? "run.gw" : "run-" + std::to_string(seed + 1) + ".gw"));
        const run::RunResult result = replayed(recorded);
        EXPECT_TRUE(result.differences.empty()) << "seed " << seed << ": " << result.differences.front();
        EXPECT_GT(result.compared_states, 0) << "seed " << seed;
    }
}

TEST(Session, WhatWasTakenBackIsNotInTheRecording) {
    test::TemporaryFolder folder;
    SessionOptions options = recording_to(folder / "run.gw");
    options.free_practice = true;
    Begun session(std::move(options));
    session.give(holding({Action::Advance}));
    ASSERT_TRUE(wait_for_frames(session, 25));
    session.give(Input());
    session.give(Control::TakeBack);
    ASSERT_TRUE(wait_for(session, [](const View& view) { return view.taken_back == 1; }));
    EXPECT_LT(session.view()->frames, 25);
    ASSERT_TRUE(wait_for_frames(session, 5));
    finish(session);
    const run::RunResult result = replayed(folder / "run.gw");
    EXPECT_TRUE(result.differences.empty());
    EXPECT_LT(result.score.advanced, 2);
}

TEST(Session, InAnExerciseNothingIsTakenBack) {
    Begun session;
    ASSERT_TRUE(wait_for_frames(session, 5));
    session.give(Control::TakeBack);
    ASSERT_TRUE(wait_for_frames(session, 8));
    EXPECT_EQ(session.view()->taken_back, 0);
}

TEST(Session, APauseMakesNoFrames) {
    Begun session;
    ASSERT_TRUE(wait_for_frames(session, 3));
    session.give(Control::Pause);
    ASSERT_TRUE(wait_for(session, Phase::Paused));
    const int frames = session.view()->frames;
    std::this_thread::sleep_for(300ms);
    EXPECT_EQ(session.view()->frames, frames);
    session.give(Control::Resume);
    EXPECT_TRUE(wait_for_frames(session, frames + 2));
}

TEST(Session, AScriptIsPlayedAndHeldAgainstItsStates) {
    for (const bool wrong : {false, true}) {
        SessionOptions options = options_of();
        const std::string hash = wrong ? "0123456789abcdef" : "";
        options.script = script::parse_commands(
            "0 beam on\n2..6 advance 1 mm\n" + (wrong ? "state 5 " + hash + "\n" : std::string()) + "9 end\n",
            "script.gw");
        Session session(std::move(options));
        ASSERT_TRUE(wait_for(session, Phase::Ready));
        session.give(holding({Action::Withdraw}));  // nobody listens
        session.give(Control::Start);
        ASSERT_TRUE(wait_for(session, Phase::Ended));
        EXPECT_EQ(session.view()->frames, 10);
        EXPECT_NEAR(session.view()->score.advanced, 5, 1e-9);
        EXPECT_EQ(session.view()->differences.empty(), !wrong);
    }
}

TEST(Session, ItsImagesAreThoseOfARunToTheByte) {
    const script::CommandScript script = script::parse_commands(
        "0 beam on\n1..8 advance 1 mm\n4 contrast 20 mg/ml\n10 mode dsa\n12 contrast 60 mg/ml\n16 mode "
        "roadmap\n20 end\n",
        "script.gw");
    render::GrayImage last;
    run::RunOptions whole;
    whole.images_for_observer = true;
    whole.observer = [&](const exercise::Frame&, exercise::Exercise& exercise) { last = exercise.image(); };
    run::run_headless(test::small_scenario(), script, whole);
    SessionOptions options = options_of();
    options.script = script;
    Begun session(std::move(options));
    ASSERT_TRUE(wait_for(session, Phase::Ended));
    ASSERT_TRUE(session.view()->image);
    EXPECT_EQ(*session.view()->image, last);
}

TEST(Session, AnInstructorsChangeActsAtOnceAndEndsTheRecording) {
    test::TemporaryFolder folder;
    Session session(recording_to(folder / "run.gw"));
    ASSERT_TRUE(wait_for(session, Phase::Ready));
    session.give(Control::WatchSolver);
    session.give(Control::Start);
    session.give(holding({Action::Advance}));
    std::shared_ptr<const SolverView> sure;
    ASSERT_TRUE(wait_for(session, [&](const View& view) {
        if (view.solver && view.solver->tip_error) sure = view.solver;
        return sure && view.frames > 10;
    }));
    EXPECT_GT(*sure->tip_error, 0);
    EXPECT_LT(*sure->tip_error, 1);
    SolverView made;
    made.tip_error = 0.0123;
    made.model_errors = {.wall = 0.05, .wall_off = 0.1, .vessels = {}, .twist = 1.234};
    EXPECT_EQ(tip_text(made), "tip ± 0.012 mm by segments, 0.05 by the wall's field, 1.2 by rigid shafts");
    EXPECT_EQ(tip_text({}), "tip ± unknown by segments");
    test::expect_said(tip_text(*sure), fmt::format("tip ± {:.2g} mm by segments", *sure->tip_error));
    exercise::Tuning tuning = session.view()->solver->tuning;
    tuning.segment_length = 1;
    tuning.shaft_rigidity *= 4;
    tuning.wall_stiffness = 2;
    for (const physics::RelaxerKind kind :
         {physics::RelaxerKind::Segment, physics::RelaxerKind::FirstOrder, physics::RelaxerKind::Global}) {
        tuning.relaxer.kind = kind;
        const double before = *session.view()->readout.devices[0].inserted;
        session.give(tuning);
        ASSERT_TRUE(wait_for(session, [&](const View& view) {
            return view.tuned && view.solver->tuning.relaxer.kind == kind;
        }));
        EXPECT_NEAR(*session.view()->readout.devices[0].inserted, before, 4);
        EXPECT_EQ(session.view()->solver->tuning.segment_length, 1);
        EXPECT_EQ(session.view()->solver->tuning.wall_stiffness, 2);
        EXPECT_LT(session.view()->solver->error, kind == physics::RelaxerKind::Global ? 1e-6 : 5);
    }
    tuning.segment_length = -1;  // is refused, and nothing changes
    session.give(tuning);
    const int frames = session.view()->frames;
    ASSERT_TRUE(wait_for_frames(session, frames + 3));
    EXPECT_EQ(session.view()->solver->tuning.segment_length, 1);
    EXPECT_FALSE(session.view()->recording);
    finish(session);
    EXPECT_TRUE(replayed(folder / "run.gw").differences.empty());
}

TEST(Session, WhatCannotBeLoadedOrRecordedIsSaid) {
    SessionOptions options = recording_to("/no/such/folder/run.gw");
    Session refused(std::move(options));
    ASSERT_TRUE(wait_for(refused, Phase::Failed));
    test::expect_said(refused.view()->error, "/no/such/folder/run.gw");

    SessionOptions bad = options_of();
    bad.scenario.entry.end = "nowhere";
    Session failed(std::move(bad));
    ASSERT_TRUE(wait_for(failed, Phase::Failed));
    test::expect_said(failed.view()->error, "nowhere");
    failed.give(Control::Start);  // has no effect
}

TEST(Session, WhatIsRecordedSaysWhatItIsOf) {
    test::TemporaryFolder folder;
    for (const bool free : {false, true}) {
        SessionOptions options = options_of();
        options.free_practice = free;
        options.record = Attempts(folder / "run.gw");
        const scenario::Scenario scenario = options.scenario;
        Session session(std::move(options));
        ASSERT_TRUE(wait_for(session, Phase::Ready));
        EXPECT_TRUE(session.view()->recorded.empty());  // nobody has begun
        session.give(Control::Start);
        ASSERT_TRUE(wait_for_frames(session, 3));
        finish(session);
        const auto origin = script::load_commands(session.view()->recorded).origin;
        ASSERT_TRUE(origin);
        EXPECT_EQ(origin->scenario, scenario.name);
        EXPECT_EQ(origin->scenario_hash, scenario.content);
        EXPECT_NE(origin->anatomy_hash, 0u);
        EXPECT_EQ(origin->free_practice, free);
    }
}

TEST(Session, ItsRecordingIsHandedOverWhenNothingIsWrittenToItAnyMore) {
    test::TemporaryFolder folder;
    std::string handed;
    for (const bool begun : {true, false}) {
        SessionOptions options = recording_to(folder / "run.gw");
        int calls = 0;
        options.recorded = [&](const std::filesystem::path& file) {
            ++calls;
            EXPECT_EQ(file, folder / "run.gw");
            handed = test::read(file);
        };
        {
            Session session(std::move(options));
            ASSERT_TRUE(wait_for(session, Phase::Ready));
            if (begun) {
                session.give(Control::Start);
                ASSERT_TRUE(wait_for_frames(session, 3));
                finish(session);
                session.give(script::Comment{1, "said after the end"});
                ASSERT_TRUE(wait_for(session, [&](const View&) {
                    return test::read(folder / "run.gw").find("said after") != std::string::npos;
                }));
            }
            EXPECT_EQ(calls, 0);
        }
        EXPECT_EQ(calls, begun ? 1 : 0);
    }
    EXPECT_EQ(handed, test::read(folder / "run.gw"));
    EXPECT_NE(handed.find("comment 1 said after the end\n"), std::string::npos);
}

TEST(Session, AnAttemptThatNobodyBeginsLeavesEarlierOnesAndNoFile) {
    test::TemporaryFolder folder;
    test::write(folder / "run.gw", "earlier");
    SessionOptions options = recording_to(folder / "run.gw");
    {
        Session session(std::move(options));
        ASSERT_TRUE(wait_for(session, Phase::Ready));
    }
    EXPECT_EQ(test::read(folder / "run.gw"), "earlier");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(Session, AFileThatTakesNothingIsRefusedBeforeTheStart) {
    Session session(recording_to("/dev/full"));
    ASSERT_TRUE(wait_for(session, Phase::Failed));
    test::expect_said(session.view()->error, "/dev/full");
}

TEST(Session, ItEndsInMidFrameWheneverItIsTold) {
    for (unsigned seed = 0; seed < 30; ++seed) {
        std::mt19937 random(seed);
        Session session(options_of());
        std::this_thread::sleep_for(std::chrono::milliseconds(random() % 60));
        session.give(Control::Start);
        session.give(holding({Action::Advance, Action::Fluoroscopy}));
        std::this_thread::sleep_for(std::chrono::milliseconds(random() % 60));
    }
}

/// As a page's worker does: in turns, without a thread, as often as they are asked for.
void take_turns(Session& session, const std::function<bool(const View&)>& until) {
    for (int k = 0; k < 100000 && !until(*session.view()); ++k)
        if (const auto next = session.turn()) std::this_thread::sleep_until(*next);
    ASSERT_TRUE(until(*session.view())) << session.view()->error;
}

TEST(Session, InTurnsItMakesRecordingsThatReplayAndNothingWithoutATurn) {
    test::TemporaryFolder folder;
    SessionOptions options = recording_to(folder / "run.gw");
    options.own_thread = false;
    {
        Session session(options);
        EXPECT_EQ(session.view()->phase, Phase::Loading);
        take_turns(session, [](const View& view) { return view.phase == Phase::Ready; });
        EXPECT_FALSE(session.turn());  // it waits for the start
        session.give(Control::Start);
        session.give(holding({Action::Advance, Action::Fluoroscopy}));
        take_turns(session, [](const View& view) { return view.frames >= 12 && view.image; });
        const int made = session.view()->frames;
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        EXPECT_EQ(session.view()->frames, made);
        EXPECT_GT(session.view()->readout.devices.at(0).inserted.value_or(0),
                  options.scenario.devices.at(0).inserted + 1);
        session.give(Control::Finish);
        take_turns(session, [](const View& view) { return view.phase == Phase::Ended; });
        EXPECT_FALSE(session.turn());
    }
    SessionOptions replay = options;
    replay.record = {};
    replay.script = script::load_commands(folder / "run.gw");
    replay.speed = 0.1;
    ASSERT_GT(replay.script->checks.size(), 1u);
    Session shown(replay);
    take_turns(shown, [](const View& view) { return view.phase == Phase::Ready; });
    shown.give(Control::Start);
    shown.show_at(20);  // else it takes ten times as long as it was made in
    const auto begun = Clock::now();
    take_turns(shown, [](const View& view) { return view.phase == Phase::Ended; });
    EXPECT_LT(std::chrono::duration<double>(Clock::now() - begun).count(),
              5 * shown.view()->frames / options.scenario.frame_rate);
    EXPECT_TRUE(shown.view()->differences.empty());
}

TEST(Session, InTurnsWhatCannotBeLoadedFailsOnce) {
    SessionOptions options = recording_to("/proc/no-such-folder/run.gw");
    options.own_thread = false;
    Session session(options);
    EXPECT_FALSE(session.turn());
    EXPECT_EQ(session.view()->phase, Phase::Failed);
    const long serial = session.view()->serial;
    session.give(Control::Start);
    EXPECT_FALSE(session.turn());
    EXPECT_EQ(session.view()->phase, Phase::Failed);
    EXPECT_EQ(session.view()->serial, serial);
}

}  // namespace
}  // namespace room
