/// The room as a trainee meets it: the real window on a display of its own, real keys, pictures of it.

#include <cmath>
#include <set>

#include "tests/window/room.h"

namespace test {
namespace {

/// Mean grey and its spread in a part of the picture [0 to 255].
std::pair<double, double> greys(const render::ColourImage& image, int left, int top, int width, int height) {
    double sum = 0, squares = 0;
    for (int y = top; y < top + height; ++y)
        for (int x = left; x < left + width; ++x) {
            const double grey = image.pixels[3 * (static_cast<std::size_t>(y) * image.width + x)];
            sum += grey;
            squares += grey * grey;
        }
    const double count = static_cast<double>(width) * height;
    return {sum / count, std::sqrt(std::max(0.0, squares / count - sum * sum / count / count))};
}

/// Sum of what a recording advances, also while it is written [mm].
double advanced(const std::filesystem::path& recording) {
    double sum = 0;
    for (const script::TimedCommand& timed : so_far(recording).commands)
        if (const auto* advance = std::get_if<script::Advance>(&timed.command)) sum += advance->length;
    return sum;
}

TEST(Play, AWholeExerciseByKeysReplaysToTheSameStates) {
    Room room(1280, 800, {"s_bend", "--record", "@run.gw"});
    ASSERT_TRUE(room.reaches("ready"));
    sleep_for(0.5);
    room.picture("briefing");
    ASSERT_TRUE(room.start());
    const double dark = greys(room.picture("beam-off"), 200, 200, 300, 300).first;
    room.display.key("space", true);
    room.comes("the image",
               [&] { return greys(room.display.screenshot(), 200, 200, 300, 300).first > dark + 40; });
    EXPECT_GT(greys(room.picture("beam-on"), 200, 200, 300, 300).second, 2);  // bones or noise, no plain grey

    room.display.key("Control_L", true);
    room.display.key("Up", true);
    room.comes("a push by more than 20 mm", [&] { return advanced(room.folder / "run.gw") > 20; });
    room.display.key("Up", false);
    room.display.key("Control_L", false);
    room.display.tap("Right", 0.5);
    room.display.tap("j", 0.4);
    room.display.tap("equal");
    sleep_for(0.3);
    room.picture("pushed");
    room.display.key("space", false);
    room.display.key("a", true);
    room.records(room.folder / "run.gw", " mode dsa");
    room.display.tap("F3");
    room.records(room.folder / "run.gw", " inject ");
    sleep_for(1);
    room.picture("dsa");
    room.display.key("a", false);
    room.display.tap("s");
    room.display.tap("r");
    room.picture_behind("v", 0.6, "runs");
    room.picture_behind("F12", 0.8, "behind-teacher");
    room.picture_behind("h", 0.3, "help");
    ASSERT_TRUE(room.finish());
    sleep_for(0.5);
    room.picture("end");
    const Outcome outcome = room.close();
    EXPECT_EQ(outcome.code, 0) << outcome.error;

    const script::CommandScript script = script::load_commands(room.folder / "run.gw");
    int injections = 0, beams = 0;
    for (const script::TimedCommand& timed : script.commands) {
        injections += std::holds_alternative<script::Inject>(timed.command);
        beams += std::holds_alternative<script::Beam>(timed.command);
    }
    EXPECT_EQ(injections, 1);
    EXPECT_GE(beams, 2);
    const Outcome replayed = replay(room, "s_bend");
    EXPECT_NE(replayed.out.find("all equal"), std::string::npos) << replayed.out << replayed.error;
}

TEST(Play, ItBearsWhatAWindowSuffers) {
    Room room(1280, 800, {"s_bend", "--free", "--record", "@run.gw"});
    ASSERT_TRUE(room.start());
    room.display.key("space", true);
    room.display.key("Up", true);
    sleep_for(0.5);
    for (const auto& [width, height] :
         {std::pair{640, 400}, {1, 1}, {1280, 800}, {321, 900}, {1280, 300}, {900, 700}}) {
        room.display.resize(width, height);
        sleep_for(0.25);
    }
    room.picture("resized");
    room.display.iconify();
    sleep_for(0.3);
    // A key that is held when the focus goes is let go.
    room.display.take_focus();
    sleep_for(0.6);
    room.display.key("Up", false);
    room.display.key("space", false);
    room.display.give_focus();
    sleep_for(0.3);
    room.display.tap("BackSpace");
    sleep_for(0.3);
    room.display.key("Up", true);
    sleep_for(0.2);
    const Outcome outcome = room.close();  // with a key held, in mid-frame
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    const Outcome replayed = replay(room, "s_bend");
    EXPECT_NE(replayed.out.find("all equal"), std::string::npos) << replayed.out << replayed.error;
}

TEST(Play, AKeyHeldAsTheFocusGoesIsLetGo) {
    Room room(1280, 800, {"s_bend", "--free", "--record", "@run.gw"});
    const std::filesystem::path recording = room.folder / "run.gw";
    ASSERT_TRUE(room.start());
    room.display.give_focus();
    room.display.key("Up", true);
    ASSERT_TRUE(room.records(recording, " advance "));
    room.display.take_focus();
    // States stand in it every so many frames: two of them, and no push between them.
    ASSERT_TRUE(room.comes("frames without a push", [&] {
        const std::string text = read(recording);
        const std::size_t last_push = text.rfind(" advance "), state = text.find("\nstate ", last_push);
        return state != std::string::npos && text.find("\nstate ", state + 1) != std::string::npos;
    }));
    room.display.key("Up", false);  // which nobody hears
    room.display.give_focus();
    EXPECT_EQ(room.close().code, 0);
    const script::CommandScript script = script::load_commands(recording);
    int last_push = 0;
    for (const script::TimedCommand& timed : script.commands)
        if (std::holds_alternative<script::Advance>(timed.command)) last_push = timed.frame;
    ASSERT_TRUE(script.end);
    EXPECT_GT(last_push, 0);
    EXPECT_LT(last_push, *script.end - 8);
}

TEST(Play, TheSolutionIsShownAndARecordingIsHeldAgainstItsStates) {
    const std::string solution = asset("scripts/s_bend.gw").string();
    Room room(900, 700, {"s_bend", "--replay", solution});
    ASSERT_TRUE(room.reaches("running"));
    ASSERT_TRUE(room.reaches("ended"));
    sleep_for(0.4);
    room.picture("replayed");
    EXPECT_EQ(room.close().code, 0);
}

/// A folder of one exercise, whose name and level make it the first of the chooser.
TEST(Play, AnExerciseOfOnesOwnIsInTheChooserAndShowsItsSolution) {
    TemporaryFolder own;
    write(own / "aaa.toml", std::string(small_toml) + "[lesson]\nlevel = 1\n");
    write(own / "aaa.gw", "0 beam on\n1..60 advance 1 mm\n75 end\n");
    Room room(1280, 800, {"--exercises", own.path().string(), "--learner", "Ada"});
    ASSERT_TRUE(room.reaches("choose"));
    // From what is next for her to the first card, and over "Exercise" and "Free practice" to "Show me".
    ASSERT_TRUE(room.comes("the first card's first button", [&] {
        room.display.tap("Down");
        sleep_for(0.5);
        const auto now = room.marked();
        return now.first >= 0 && now.second < 100;
    }));
    for (int k = 0; k < 2; ++k) ASSERT_TRUE(room.mark_next("Right"));
    room.picture("chooser-own");
    ASSERT_TRUE(room.tap_out_of("choose", "space"));
    ASSERT_TRUE(room.reaches("aaa"));
    ASSERT_TRUE(room.reaches("running"));  // by itself
    EXPECT_EQ(room.close().code, 0);
}

/// What a key held down leaves, a line a frame, is a solution that its author's next command makes.
TEST(Play, AnAttemptByKeysBecomesASolution) {
    TemporaryFolder own;
    write(own / "aaa.toml", replaced(small_toml, "radius_mm = 3.0", "radius_mm = 10.0"));
    Room room(900, 700, {"aaa", "--exercises", own.path().string(), "--record", "@run.gw"});
    ASSERT_TRUE(room.start());
    room.display.key("Up", true);
    ASSERT_TRUE(room.comes(
        "the target", [&] { return room.display.find("ended") || advanced(room.folder / "run.gw") > 75; }));
    room.display.key("Up", false);
    room.display.tap("End");
    ASSERT_TRUE(room.reaches("ended"));
    EXPECT_EQ(room.close().code, 0);
    const Outcome made = run(
        room.folder, {"author", "aaa", "--exercises", own.path().string(), "--from", room.folder / "run.gw"});
    EXPECT_LE(made.code, 1) << made.error;  // it may forgive less than 5 %
    const script::CommandScript hand = script::load_commands(room.folder / "run.gw"),
                                solution = script::load_commands(own / "aaa.gw");
    EXPECT_EQ(solution.end, hand.end);
    EXPECT_NEAR(advanced(own / "aaa.gw"), advanced(room.folder / "run.gw"), 1e-3);
    const std::string text = read(own / "aaa.gw"), all = read(room.folder / "run.gw");
    EXPECT_LT(std::ranges::count(text, '\n'), std::ranges::count(all, '\n') / 2) << text;
}

TEST(Play, ARecordingThatDiffersIsToldByTheExitCode) {
    TemporaryFolder other;
    write(other / "wrong.gw", "# scenario s_bend\n0 advance 1 mm\nstate 2 0123456789abcdef\n4 end\n");
    Room room(900, 700, {"--replay", (other / "wrong.gw").string()});
    ASSERT_TRUE(room.reaches("s_bend - ended"));
    EXPECT_EQ(room.close().code, 3);
}

TEST(Play, AFullDiskEndsTheRecordingAndNotTheExercise) {
    Room room(900, 700, {"s_bend", "--free", "--record", "@run.gw"}, 200);
    ASSERT_TRUE(room.start());
    room.display.key("space", true);
    room.display.key("Up", true);
    // "NOT RECORDED", at the end of the strip below.
    room.comes("the warning",
               [&] { return columns_of(room.display.screenshot(), render::palette::alarm, 670).first >= 0; });
    room.picture("full-disk");
    expect_said(room.display.title(), "running");
    room.display.key("Up", false);
    EXPECT_EQ(room.close().code, 0);
    EXPECT_LE(std::filesystem::file_size(room.folder / "run.gw"), 200u);
    EXPECT_NO_THROW(script::load_commands(room.folder / "run.gw"));
}

TEST(Play, SigtermClosesTheWindowAndTheRecordingReplays) {
    Room room(900, 700, {"s_bend", "--record", "@run.gw"});
    ASSERT_TRUE(room.start());
    room.display.key("Up", true);
    ASSERT_TRUE(room.records(room.folder / "run.gw", " advance "));
    room.program->signal(SIGTERM);
    const Outcome outcome = room.program->wait();
    room.program.reset();
    EXPECT_EQ(outcome.code, 130) << outcome.error;
    EXPECT_TRUE(script::load_commands(room.folder / "run.gw").end);
    const Outcome again = replay(room, "s_bend");
    EXPECT_EQ(again.code, 1) << again.error;  // the target was not reached; not 3: all states agree
}

TEST(Play, AnAttemptIsSignedWhenTheWindowCloses) {
    const TemporaryFolder keys;
    const std::string key = keys / "teacher.key", pub = keys / "teacher.pub";
    const std::string make = fmt::format(
        "openssl genpkey -algorithm ed25519 -out '{0}' && openssl pkey -in '{0}' -pubout -out '{1}'", key,
        pub);
    if (std::system((make + " 2>/dev/null").c_str()) != 0) GTEST_SKIP() << "openssl is not installed";
    Room room(900, 700, {"s_bend", "--record", "@run.gw", "--sign", key});
    ASSERT_TRUE(room.start());
    room.display.key("Up", true);
    ASSERT_TRUE(room.records(room.folder / "run.gw", " advance "));
    room.program->signal(SIGTERM);
    const Outcome outcome = room.program->wait();
    room.program.reset();
    EXPECT_EQ(outcome.code, 130) << outcome.error;
    const Outcome checked = test::run(room.folder, {"replay", room.folder / "run.gw", "--key", pub});
    EXPECT_EQ(checked.code, 0) << checked.error;
    test::expect_said(checked.out, "all equal");
}

/// From the trainees' first keys to the teacher's page, with nothing supplied in between: two learners say
/// who they are, go from exercise to exercise, and end in the course.
TEST(Play, TwoLearnersByKeysAreScoredReplayedDebriefedAndCounted) {
    Room room(1280, 800, {});
    const std::filesystem::path kept = room.folder / "data/seldinger/recordings";
    const auto attempt = [&](const std::string& learner, const std::string& exercise, int number) {
        const std::filesystem::path results = kept / learner / "results.json";
        const std::string before = read(results);
        ASSERT_TRUE(room.reaches(exercise + " - "));
        room.picture(fmt::format("briefing-{}", exercise));
        ASSERT_TRUE(room.start());
        room.display.key("space", true);
        room.display.key("Up", true);
        ASSERT_TRUE(room.records(kept / learner / fmt::format("{}-{:03}.gw", exercise, number), " advance "));
        room.display.key("Up", false);
        room.display.key("space", false);
        ASSERT_TRUE(room.finish());
        ASSERT_TRUE(room.comes("the result", [&] { return read(results) != before; }));
        ASSERT_TRUE(room.comes("the last page",
                               [&] { return columns_of(room.display.screenshot(), button_ink).first >= 0; }));
        room.picture(fmt::format("end-{}", exercise));
        // To the second row of buttons, and back to "Again".
        ASSERT_TRUE(room.tap_until("Down", "a mark", [&] { return room.marked().first >= 0; }));
        ASSERT_TRUE(room.mark_next("Up"));
    };
    const auto types = [&](const std::vector<std::string>& letters) {
        for (const std::string& letter : letters) room.display.tap(letter);
    };
    // Nobody is kept yet: the cursor stands in the field for a name.
    ASSERT_TRUE(room.reaches("learner"));
    sleep_for(1);
    types({"a", "d", "a"});
    ASSERT_TRUE(room.tap_out_of("learner", "Return"));
    ASSERT_TRUE(room.reaches("choose"));
    room.picture("chooser");
    ASSERT_TRUE(room.tap_out_of("choose", "Return"));  // the next one for her, which is in focus
    ASSERT_NO_FATAL_FAILURE(attempt("ada", "first_steps", 1));
    ASSERT_TRUE(room.tap_out_of("ended", "Return"));  // "Again"
    ASSERT_NO_FATAL_FAILURE(attempt("ada", "first_steps", 2));
    for (const char* exercise : {"straight", "s_bend"}) {
        ASSERT_TRUE(room.mark_next("Right"));  // "Next exercise"
        ASSERT_TRUE(room.tap_out_of("ended", "Return"));
        ASSERT_NO_FATAL_FAILURE(attempt("ada", exercise, 1));
    }
    for (int k = 0; k < 3; ++k) ASSERT_TRUE(room.mark_next("Right"));  // "Other exercises"
    const auto end_page = room.marked();
    ASSERT_TRUE(room.tap_out_of("ended", "Return"));
    ASSERT_TRUE(room.reaches("choose"));
    ASSERT_TRUE(room.comes("the chooser", [&] { return room.marked() != end_page; }));
    ASSERT_TRUE(room.mark_next("Right"));  // "Another learner"
    ASSERT_TRUE(room.tap_out_of("choose", "Return"));
    ASSERT_TRUE(room.reaches("learner"));
    room.picture("learner");
    ASSERT_TRUE(room.comes("the second learner", [&] {
        for (int k = 0; k < 2; ++k) {  // "Guest", then the field
            room.display.tap("Down");
            sleep_for(0.5);
        }
        types({"Return", "b", "e", "n", "Return"});
        return wait_until([&] { return room.display.find("choose"); }, 3);
    }));
    ASSERT_TRUE(room.tap_out_of("choose", "Return"));
    ASSERT_NO_FATAL_FAILURE(attempt("ben", "first_steps", 1));
    EXPECT_EQ(room.close().code, 0);

    std::set<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(kept))
        if (entry.path().extension() == ".gw") names.insert(entry.path().lexically_relative(kept).string());
    EXPECT_EQ(names,
              (std::set<std::string>{"ada/s_bend-001.gw", "ada/straight-001.gw", "ada/first_steps-001.gw",
                                     "ada/first_steps-002.gw", "ben/first_steps-001.gw"}));

    const std::string cache = std::string(SELDINGER_SOURCE) + "/build/cache";
    const auto of = [&](const char* verb) {
        const Outcome outcome = run(room.folder, {verb, kept, "--cache", cache});
        EXPECT_EQ(outcome.code, 0) << verb << ": " << outcome.error;
        return outcome.out;
    };
    expect_said(of("course"), "5 recordings, 5 attempts:");
    for (const char* row : {"ada,first_steps,", "ada,straight,", "ada,s_bend,", "ben,first_steps,"})
        expect_said(read(kept / "course.csv"), row);
    const std::string made = of("debrief");
    EXPECT_EQ(std::count(made.begin(), made.end(), '\n'), 4) << made;
    expect_said(of("score"), "by ada");
    const std::string replayed = of("replay");
    std::size_t equal = 0;
    for (std::size_t at = replayed.find("all equal"); at != std::string::npos;
         at = replayed.find("all equal", at + 1))
        ++equal;
    EXPECT_EQ(equal, 5u) << replayed;

    Room shown(900, 700, {"--replay", (kept / "ada").string()});
    for (int k = 0; k < 4; ++k) {
        ASSERT_TRUE(shown.reaches("ended"));
        sleep_for(0.5);
        shown.picture(fmt::format("replay-{}", k + 1));
        if (k == 3) break;
        ASSERT_TRUE(shown.tap_out_of("ended", "Return"));  // "Next recording", which is in focus
    }
    EXPECT_EQ(shown.close().code, 0);
}

TEST(Play, WhereThereIsNoDisplayItSaysSo) {
    TemporaryFolder folder;
    setenv("DISPLAY", ":987", 1);
    const Outcome outcome = run(folder, {"play", "s_bend"});
    expect_refused(outcome, "no display");
    expect_said(outcome.error, "seldinger run");
}

TEST(Play, BadArgumentsAreRefusedBeforeAWindowOpens) {
    TemporaryFolder folder;
    write(folder / "keys.toml", "[keys]\nadvance = \"Up\"\nwithdraw = \"Up\"\n");
    write(folder / "other.gw", "# recorded by seldinger\n# scenario renal\n0 advance 1 mm\n");
    const std::pair<std::vector<std::string>, std::string> cases[] = {
        {{"play", "s_bend", "--keys", (folder / "keys.toml").string()}, "keys.toml:3:"},
        {{"play", "s_bend", "--keys", "/no/such.toml"}, "/no/such.toml"},
        {{"play", "s_bend", "--replay", (folder / "other.gw").string()},
         "expected a recording of 's_bend', found one of 'renal'"},
        {{"play", "s_bend", "--size", "10x10"},
         "--size: expected WIDTHxHEIGHT from 320x240 to 8192x8192, found '10x10'"},
        {{"play", "s_bend", "--size", "wide"}, "WIDTHxHEIGHT"},
        {{"play", "nowhere"}, "nowhere"},
        {{"play", "s_bend", "--record", "/proc/nope"}, "/proc/nope: cannot be written"},
        {{"play", "s_bend", "--measure", (folder / "no/x.json").string()}, "no/x.json: cannot be written"},
    };
    setenv("DISPLAY", ":987", 1);
    for (const auto& [words, said] : cases) {
        expect_refused(run(folder, words), said);
    }
}

}  // namespace
}  // namespace test
