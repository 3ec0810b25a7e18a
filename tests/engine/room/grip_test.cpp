/// A hand closer to the valve, from the key to the last page: key file, room, recording, replay, trace,
/// debriefing and course. Nothing is put in between.

#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <map>
#include <sstream>
#include <thread>

#include "engine/debrief/course.h"
#include "engine/debrief/page.h"
#include "engine/room/session.h"
#include "engine/run/headless.h"
#include "tests/engine/fixtures.h"

namespace room {
namespace {

/// A wire that rubs in a bend by more than its shaft bears at 100 mm.
scenario::Scenario rubbing() {
    return test::small_scenario(
        test::small_toml_with("frictionless = true\nbuckling_force_N = 0",
                              "friction = 0.5\nstatic_friction = 0.5\nbuckling_force_N = 0.012"));
}

class GripSeam : public test::InFolder {
protected:
    /// What a key of the shipped file does while a hand taps it.
    static Input tapping(const char* name, int times) {
        const KeyMap map = load_keys(test::asset("keys.toml"));
        const Key key = find_key(name).value();
        Input input;
        for (int k = 0; k < actions; ++k)
            if (std::find(map.keys[k].begin(), map.keys[k].end(), key) != map.keys[k].end())
                input.pressed.insert(input.pressed.end(), static_cast<std::size_t>(times),
                                     static_cast<Action>(k));
        return input;
    }
    static bool wait_until(const Session& session, const std::function<bool(const View&)>& pleases) {
        for (int k = 0; k < 6000 && !pleases(*session.view()); ++k)
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        return pleases(*session.view());
    }
    /// Taps, then pushes 32 mm by notches of the wheel. The recording, and what the panel showed at the end.
    std::pair<std::filesystem::path, render::Readout> attempt(const std::string& name, const Input& taps) {
        SessionOptions options;
        options.scenario = rubbing();
        options.keys = load_keys(test::asset("keys.toml"));
        options.record = Attempts(folder / (name + ".gw"));
        Session session(std::move(options));
        EXPECT_TRUE(wait_until(session, [](const View& view) { return view.phase == Phase::Ready; }));
        session.give(Control::Start);
        session.give(taps);
        for (int notch = 0; notch < 16; ++notch) {
            const int frames = session.view()->frames;
            EXPECT_TRUE(wait_until(session, [&](const View& view) { return view.frames >= frames + 2; }));
            Input input;
            input.wheel = 1;
            session.give(input);
        }
        const int frames = session.view()->frames;
        EXPECT_TRUE(wait_until(session, [&](const View& view) { return view.frames >= frames + 12; }));
        session.give(Control::Finish);
        EXPECT_TRUE(wait_until(session, [](const View& view) { return view.phase == Phase::Ended; }));
        return {session.view()->recorded, session.view()->readout};
    }
    /// The last row of the wire in the trace of a replay that leads to the recorded states.
    std::map<std::string, double> last_row(const std::filesystem::path& recording) {
        run::RunOptions options;
        options.images = false;
        options.expect = recording;
        const std::string name = recording.stem().string();
        options.trace = folder / (name + ".csv");
        const run::RunResult result =
            run::run_headless(rubbing(), script::load_commands(recording), folder / name, options);
        EXPECT_TRUE(result.differences.empty());
        EXPECT_GT(result.compared_states, 2);
        std::stringstream text(test::read(options.trace));
        std::string header, line, last;
        std::getline(text, header);
        while (std::getline(text, line))
            if (!line.empty()) last = line;
        std::map<std::string, double> row;
        std::stringstream names(header), cells(last);
        for (std::string key, cell; std::getline(names, key, ',') && std::getline(cells, cell, ',');)
            row[key] = std::atof(cell.c_str());
        return row;
    }
};

template <class Kind>
std::vector<Kind> all_of(const script::CommandScript& script) {
    std::vector<Kind> found;
    for (const script::TimedCommand& timed : script.commands)
        if (const Kind* kind = std::get_if<Kind>(&timed.command)) found.push_back(*kind);
    return found;
}

TEST_F(GripSeam, WhatBowsTheShaftAtAHundredMillimetresGoesInAtThirty) {
    const auto [far, far_panel] = attempt("far", Input());
    const auto [near, near_panel] = attempt("near", tapping("N", 7));
    ASSERT_NE(far, near);
    // The room shows where the hand is, and the recording says what it did.
    EXPECT_EQ(far_panel.devices.at(0).grip, 100);
    EXPECT_EQ(near_panel.devices.at(0).grip, 30);
    EXPECT_GT(far_panel.devices.at(0).bow.value(), 3);
    const script::CommandScript of_far = script::load_commands(far), of_near = script::load_commands(near);
    EXPECT_TRUE(all_of<script::Grip>(of_far).empty());
    ASSERT_EQ(all_of<script::Grip>(of_near).size(), 1u);
    EXPECT_EQ(all_of<script::Grip>(of_near)[0].distance, 30);
    for (const script::CommandScript* script : {&of_far, &of_near}) {
        double fed = 0;
        for (const script::Advance& push : all_of<script::Advance>(*script)) fed += push.length;
        EXPECT_DOUBLE_EQ(fed, 32);
    }
    // Replayed, the trace has the same end.
    std::map<std::string, double> at_far = last_row(far), at_near = last_row(near);
    ASSERT_TRUE(at_far.contains("bow_mm") && at_far.contains("inserted_mm") && at_far.contains("push_N"));
    EXPECT_NEAR(at_far["bow_mm"], *far_panel.devices[0].bow, 1e-3);
    EXPECT_NEAR(at_near["bow_mm"], *near_panel.devices[0].bow, 1e-3);
    EXPECT_LT(at_near["bow_mm"], at_far["bow_mm"] - 3);
    EXPECT_GT(at_near["inserted_mm"], at_far["inserted_mm"] + 3);
    EXPECT_GT(at_near["push_N"], 1.4 * at_far["push_N"]);
    for (auto* row : {&at_far, &at_near})
        EXPECT_NEAR((*row)["bow_mm"] + (*row)["inserted_mm"], 20 + 32, 2e-3);

    // So do the debriefing and the teacher's course.
    debrief::StoryOptions quick;
    quick.images = false;
    const auto far_story = debrief::tell(rubbing(), of_far, quick),
               near_story = debrief::tell(rubbing(), of_near, quick);
    ASSERT_TRUE(far_story && near_story);
    EXPECT_GT(near_story->moments.back().inserted.at(0), far_story->moments.back().inserted.at(0) + 3);
    EXPECT_LT(near_story->score.buckled_frames, far_story->score.buckled_frames);
    const debrief::Story* const expert = nullptr;
    const std::string told = "a push was not passed on in";
    test::expect_said(debrief::page({&*far_story, 1}, expert), told);
    EXPECT_EQ(debrief::page({&*near_story, 1}, expert).find(told) == std::string::npos,
              near_story->score.buckled_frames == 0);

    debrief::CourseOptions course;
    course.scenario = [](const script::CommandScript&) { return rubbing(); };
    course.jobs = 1;
    const std::array files = {far, near};
    const auto rows = debrief::course_of(files, course);
    ASSERT_TRUE(rows);
    ASSERT_EQ(rows->size(), 2u);
    for (const debrief::CourseRow& row : *rows) EXPECT_EQ(row.problem, "");
    EXPECT_GT((*rows)[1].travel, (*rows)[0].travel + 3);
    test::expect_said(debrief::course_csv(*rows, {}), "near");
}

}  // namespace
}  // namespace room
