/// Another patient of the same exercise, by real keys: from the briefing to the teacher's page.

#include "tests/window/room.h"

namespace test {
namespace {

TEST(Patients, OneChosenInTheBriefingIsInRecordingScoreAndCourse) {
    Room room(1280, 800, {"coronary_right", "--learner", "ada"});
    ASSERT_TRUE(room.reaches("coronary_right - ready"));
    // From "Start" up to the first patient, and right to the second.
    ASSERT_TRUE(room.comes("the mark on a patient", [&] {
        room.display.tap("Up");
        return wait_until(
            [&] {
                return room.marked().first >= 0 &&
                       columns_of(room.display.screenshot(), marked_ink, 400).first < 0;
            },
            2);
    }));
    ASSERT_TRUE(room.mark_next("Right"));
    ASSERT_TRUE(room.tap_out_of("coronary_right - ready", "space"));
    ASSERT_TRUE(room.reaches("coronary_right, patient 2 - ready"));
    sleep_for(0.3);
    room.picture("briefing-patient");
    ASSERT_TRUE(room.start());
    const std::filesystem::path kept = room.folder / "data/seldinger/recordings/ada";
    room.display.key("Up", true);
    ASSERT_TRUE(room.records(kept / "coronary_right-001.gw", " advance "));
    room.display.key("Up", false);
    ASSERT_TRUE(room.finish());
    ASSERT_TRUE(room.comes("the result", [&] { return !read(kept / "results.json").empty(); }));
    sleep_for(0.3);
    room.picture("end-patient");
    EXPECT_EQ(room.close().code, 0);
    expect_said(read(kept / "results.json"), "\"patients\"");
    expect_said(read(kept / "coronary_right-001.gw"), "\npatient 2\n");

    const std::string cache = std::string(SELDINGER_SOURCE) + "/build/cache";
    const Outcome scored = run(room.folder, {"score", kept / "coronary_right-001.gw", "--cache", cache});
    EXPECT_EQ(scored.code, 0) << scored.error;
    expect_said(scored.out, "patient 2: man, 58, by ada");
    expect_said(scored.out, "all equal");
    const Outcome course = run(room.folder, {"course", kept, "--cache", cache});
    EXPECT_EQ(course.code, 0) << course.error;
    expect_said(course.out, "1 recordings, 1 attempts");
    expect_said(read(kept / "course.csv"), "\nada,coronary_right,4,1,");
    expect_said(read(kept / "course.html"), "patient 2: man, 58");
}

}  // namespace
}  // namespace test
