/// The room as a trainee meets it: the real window on a display of its own, real keys, pictures of it.

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <fmt/format.h>
#include <functional>
#include <gtest/gtest.h>
#include <map>
#include <optional>
#include <set>
#include <sys/resource.h>

#include "app/play/window.h"
#include "engine/script/command.h"
#include "render/panel/palette.h"
#include "render/picture/png.h"
#include "tests/app/program.h"
#include "tests/window/display.h"

namespace test {
namespace {

constexpr double long_enough = 300;              // [s]; nothing here waits for as long unless it fails
constexpr render::Ink button_ink{35, 70, 110};   // of the buttons of a page
constexpr render::Ink marked_ink{66, 150, 250};  // of the one that the keys have reached

/// The first and the last column with pixels of this colour; -1 where there are none.
std::pair<int, int> columns_of(const render::ColourImage& image, render::Ink ink, int top = 0) {
    std::pair<int, int> columns{-1, -1};
    for (int x = 0; x < image.width; ++x)
        for (int y = top; y < image.height; ++y) {
            const std::uint8_t* pixel = &image.pixels[3 * (static_cast<std::size_t>(y) * image.width + x)];
            if (pixel[0] == ink.red && pixel[1] == ink.green && pixel[2] == ink.blue)
                columns = {columns.first < 0 ? x : columns.first, x};
        }
    return columns;
}

/// The program in the room, its files in a folder of its own; vessels come from the cache of all tests.
class Room {
public:
    /// `largest_file`: the largest that the program can write, as on a full disk [bytes].
    Room(int width, int height, std::vector<std::string> words, std::optional<rlim_t> largest_file = {})
        : display(width, height) {
        setenv("DISPLAY", display.name().c_str(), 1);
        setenv("XDG_DATA_HOME", (folder / "data").c_str(), 1);
        setenv("XDG_CONFIG_HOME", (folder / "config").c_str(), 1);
        words.insert(words.begin(), "play");
        words.insert(words.end(), {"--size", fmt::format("{}x{}", width, height), "--cache",
                                   std::string(SELDINGER_SOURCE) + "/build/cache"});
        for (std::string& word : words)
            if (word.starts_with("@")) word = (folder / word.substr(1)).string();
        rlimit before{};
        getrlimit(RLIMIT_FSIZE, &before);
        ::signal(SIGXFSZ, SIG_IGN);
        const rlimit limited{largest_file.value_or(before.rlim_cur), before.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limited);  // limits this process, and what it starts inherits the limit
        program.emplace(folder, command(words));
        setrlimit(RLIMIT_FSIZE, &before);
    }
    ~Room() {
        if (program) program->signal(SIGKILL);
    }

    /// Waits for what the program shows or writes, however busy the machine is.
    bool comes(const std::string& what, const std::function<bool()>& has_come) {
        const bool came = wait_until(has_come, long_enough);
        EXPECT_TRUE(came) << what << " did not come; the title is '" << display.title() << "'";
        return came;
    }
    bool reaches(const std::string& title) {
        return comes("'" + title + "'", [&] { return display.find(title); });
    }
    /// Until the recording holds these words; `file` as for --record.
    bool records(const std::filesystem::path& file, const std::string& words) {
        return comes("'" + words + "' in " + file.string(),
                     [&] { return read(file).find(words) != std::string::npos; });
    }
    /// Taps a key of a page until it has acted: the page does not see a tap that falls between two of its
    /// drawings, and one that it has seen acts with the next.
    bool tap_until(const char* key, const std::string& what, const std::function<bool()>& has_come) {
        return comes(what + " by " + key, [&] {
            display.tap(key);
            return wait_until(has_come, 3);
        });
    }
    bool tap_out_of(const std::string& title, const char* key) {
        return tap_until(key, "the end of '" + title + "'", [&] { return !display.find(title); });
    }
    /// Columns of the marked button, the first and the last; those of one picture that stays.
    std::pair<int, int> marked() {
        std::pair<int, int> columns{-1, -1}, before;
        do {
            before = columns;
            columns = columns_of(display.screenshot(), marked_ink);
        } while (columns != before);
        return columns;
    }
    bool mark_next(const char* key) {
        const auto before = marked();
        return tap_until(key, "the mark on another button", [&] {
            const auto now = marked();
            return now.first >= 0 && now != before;
        });
    }
    /// From the briefing into the running exercise.
    bool start() {
        display.move_mouse(200, 200);
        return reaches("ready") && tap_out_of("ready", "Return") && reaches("running");
    }
    /// Ends the exercise, and says that it is meant.
    bool finish() {
        display.tap("End");
        return reaches("asks") && tap_out_of("asks", "Return") && reaches("ended");
    }
    /// Keeps a picture for whoever wants to look, and returns it.
    render::ColourImage picture(const std::string& name) {
        const render::ColourImage image = display.screenshot();
        std::filesystem::create_directories(SELDINGER_SCREENSHOTS);
        const auto bytes = render::encode_png(image);
        write(std::filesystem::path(SELDINGER_SCREENSHOTS) / (name + ".png"),
              std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
        return image;
    }
    /// A picture of what a key opens; the key closes it again.
    void picture_behind(const char* key, double seconds, const std::string& name) {
        display.tap(key);
        sleep_for(seconds);
        picture(name);
        display.tap(key);
    }
    Outcome close() {
        display.close();
        const Outcome outcome = program->wait();
        program.reset();
        return outcome;
    }

    TemporaryFolder folder;
    VirtualDisplay display;
    std::optional<Started> program;
};

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

Outcome replay(const Room& room, const std::string& scenario) {
    const std::string recording = room.folder / "run.gw";
    return run(room.folder,
               {"run", scenario, "--commands", recording, "--expect", recording, "--out", room.folder / "out",
                "--frames", "none", "--cache", std::string(SELDINGER_SOURCE) + "/build/cache"});
}

/// What a recording says so far, also while it is written.
script::CommandScript so_far(const std::filesystem::path& recording) {
    const std::string text = read(recording);
    return script::parse_commands(text.substr(0, text.rfind('\n') + 1), recording.string());
}

/// Frames in which the right hand pushes the wire while the left one pulls the catheter.
int frames_of_both(const script::CommandScript& script) {
    std::map<int, int> found;
    for (const script::TimedCommand& timed : script.commands) {
        if (const auto* in = std::get_if<script::Advance>(&timed.command))
            found[timed.frame] |= in->held == script::Held::Wire ? 1 : 0;
        if (const auto* out = std::get_if<script::Withdraw>(&timed.command))
            found[timed.frame] |= out->held == script::Held::Catheter ? 2 : 0;
    }
    return static_cast<int>(
        std::ranges::count_if(found, [](const auto& frame) { return frame.second == 3; }));
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
    room.picture_behind("F12", 0.8, "instructor");
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

TEST(Play, BothHandsActAtOnceByKeysAndReplay) {
    TemporaryFolder other;
    write(other / "two.toml", read(asset("scenarios/s_bend.toml")) +
                                  "\n[catheter]\ndevice = \"berenstein5f\"\ninserted_mm = 30\n");
    const std::string scenario = (other / "two.toml").string();
    Room room(1280, 800, {scenario, "--free", "--record", "@run.gw"});
    const std::filesystem::path recording = room.folder / "run.gw";
    ASSERT_TRUE(room.start());
    room.display.key("space", true);
    room.display.key("Up", true);
    room.display.key("d", true);
    room.comes("both hands in ten frames", [&] { return frames_of_both(so_far(recording)) >= 10; });
    room.picture("two-hands");
    room.display.key("Up", false);
    room.display.key("d", false);
    room.picture_behind("h", 0.3, "help-two-hands");
    // The helper takes the wire, and lets it go: its valve has friction.
    room.display.tap("y");
    room.comes("the helper's wire", [&] {
        room.display.tap("y");
        return wait_until([&] { return read(recording).find(" pin wire off") != std::string::npos; }, 2);
    });
    EXPECT_EQ(room.close().code, 0);
    const Outcome replayed = replay(room, scenario);
    EXPECT_NE(replayed.out.find("all equal"), std::string::npos) << replayed.out << replayed.error;
}

TEST(Play, HomeAndEndAskAndNothingElseHappensMeanwhile) {
    Room room(640, 400, {"s_bend", "--record", "@run.gw"});
    const std::filesystem::path recording = room.folder / "run.gw";
    ASSERT_TRUE(room.start());
    room.display.key("Up", true);
    ASSERT_TRUE(room.records(recording, " advance "));
    room.display.key("Up", false);
    for (const auto& [key, picture] : {std::pair{"Home", "asks-again"}, {"End", "asks-end"}}) {
        room.display.tap(key);
        ASSERT_TRUE(room.reaches("asks"));
        sleep_for(0.5);
        room.picture(picture);
        const std::string before = read(recording);
        room.display.tap("Up", 0.3);
        for (const char* other : {"p", "F1", "Home", "End", "h", "r", "BackSpace"}) room.display.tap(other);
        sleep_for(0.7);
        EXPECT_EQ(read(recording), before) << "it waits";
        ASSERT_TRUE(room.tap_out_of("asks", "Escape"));
        ASSERT_TRUE(room.reaches("running"));
    }
    EXPECT_EQ(read(recording).find(" reset"), std::string::npos);
    room.display.tap("Home");
    ASSERT_TRUE(room.reaches("asks") && room.tap_out_of("asks", "Return"));
    ASSERT_TRUE(room.records(recording, " reset"));
    room.display.tap("h");
    sleep_for(0.4);
    room.picture("help-small");
    room.display.tap("h");
    EXPECT_EQ(read(recording).find(" inject"), std::string::npos);
    ASSERT_TRUE(room.finish());
    EXPECT_EQ(room.close().code, 0);
    const Outcome replayed = replay(room, "s_bend");
    EXPECT_NE(replayed.out.find("all equal"), std::string::npos) << replayed.out << replayed.error;
}

/// Places of keys stay, what is shown for them follows the layout, also while the window is open.
TEST(Play, KeysAreShownAsTheyStandOnTheKeyboardInUse) {
    VirtualDisplay display(640, 480);
    setenv("DISPLAY", display.name().c_str(), 1);
    const auto choose = [](const char* layout) {
        return std::system(fmt::format("setxkbmap -layout {}", layout).c_str());
    };
    const auto shown = [](const char* key) {
        return app::Window::key_labels().at(static_cast<std::size_t>(*room::find_key(key)));
    };
    ASSERT_EQ(choose("fr"), 0);
    app::Window window(320, 240, "labels");
    EXPECT_EQ(shown("Q") + shown("W") + shown("A") + shown("Z"), "AZQW");
    EXPECT_EQ(shown("Semicolon"), "M");
    EXPECT_EQ(shown("2"), "é");
    EXPECT_EQ(shown("Up"), "Up");
    EXPECT_EQ(shown("Keypad4"), "Keypad4");
    ASSERT_EQ(choose("de"), 0);
    for (int k = 0; k < 50 && shown("Y") != "Z"; ++k) window.wait(0.1);
    EXPECT_EQ(shown("Q") + shown("Y") + shown("Z"), "QZY");
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

/// From the trainee's first key to the teacher's page, with nothing supplied in between.
TEST(Play, AttemptsByKeysFromTheChooserAreScoredReplayedDebriefedAndCounted) {
    Room room(1280, 800, {"--learner", "Ada"});
    const std::filesystem::path kept = room.folder / "data/seldinger/recordings/Ada",
                                results = room.folder / "data/seldinger/results.json";
    const auto attempt = [&](const std::string& exercise, int number) {
        const std::string before = read(results);
        ASSERT_TRUE(room.start());
        room.display.key("space", true);
        room.display.key("Up", true);
        ASSERT_TRUE(room.records(kept / fmt::format("{}-{:03}.gw", exercise, number), " advance "));
        room.display.key("Up", false);
        room.display.key("space", false);
        ASSERT_TRUE(room.finish());
        ASSERT_TRUE(room.comes("the result", [&] { return read(results) != before; }));
        ASSERT_TRUE(room.comes("the last page",
                               [&] { return columns_of(room.display.screenshot(), button_ink).first >= 0; }));
        // Marks "Again".
        ASSERT_TRUE(room.tap_until("Down", "a mark", [&] { return room.marked().first >= 0; }));
    };
    // From the card that is in focus over its buttons to the first button of the next card.
    constexpr int to_next_card = 3;
    ASSERT_TRUE(room.reaches("choose"));
    for (const char* exercise : {"s_bend", "straight"}) {
        for (int k = 0; k < to_next_card; ++k) ASSERT_TRUE(room.mark_next("Right"));
        room.picture(fmt::format("chooser-{}", exercise));
        ASSERT_TRUE(room.tap_out_of("choose", "space"));
        ASSERT_TRUE(room.reaches(exercise));
        ASSERT_NO_FATAL_FAILURE(attempt(exercise, 1));
        room.picture(fmt::format("end-{}", exercise));
        ASSERT_TRUE(room.tap_out_of("ended", "space"));
        ASSERT_NO_FATAL_FAILURE(attempt(exercise, 2));
        for (int k = 0; k < 3; ++k) ASSERT_TRUE(room.mark_next("Right"));  // "Other exercises"
        const auto end_page = room.marked();
        ASSERT_TRUE(room.tap_out_of("ended", "space"));
        ASSERT_TRUE(room.reaches("choose"));
        ASSERT_TRUE(room.comes("the chooser", [&] { return room.marked() != end_page; }));
    }
    EXPECT_EQ(room.close().code, 0);

    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(kept))
        names.insert(entry.path().filename().string());
    EXPECT_EQ(names, (std::set<std::string>{"s_bend-001.gw", "s_bend-002.gw", "straight-001.gw",
                                            "straight-002.gw"}));

    // No further argument: vessels of these two are made in no time.
    setenv("XDG_CACHE_HOME", (room.folder / "cache").c_str(), 1);
    const Outcome course = run(room.folder, {"course", kept});
    EXPECT_EQ(course.code, 0) << course.error;
    expect_said(course.out, "4 recordings, 4 attempts:");
    expect_said(read(kept / "course.csv"), "Ada,straight,");
    const Outcome debrief = run(room.folder, {"debrief", kept});
    EXPECT_EQ(debrief.code, 0) << debrief.error;
    for (const char* page : {"debrief-s_bend.html", "debrief-straight.html"})
        EXPECT_NE(read(kept / page).find("Ada"), std::string::npos) << page;
    const Outcome score = run(room.folder, {"score", kept});
    EXPECT_EQ(score.code, 0) << score.error;
    expect_said(score.out, "by Ada");
    const Outcome replayed = run(room.folder, {"replay", kept});
    EXPECT_EQ(replayed.code, 0) << replayed.error;
    std::size_t equal = 0;
    for (std::size_t at = replayed.out.find("all equal"); at != std::string::npos;
         at = replayed.out.find("all equal", at + 1))
        ++equal;
    EXPECT_EQ(equal, 4u) << replayed.out;

    Room shown(900, 700, {"--replay", kept.string()});
    for (int k = 0; k < 4; ++k) {
        ASSERT_TRUE(shown.reaches("ended"));
        sleep_for(0.5);
        shown.picture(fmt::format("replay-{}", k + 1));
        if (k == 3) break;
        ASSERT_TRUE(shown.tap_out_of("ended", "space"));  // "Next recording", which is in focus
    }
    EXPECT_EQ(shown.close().code, 0);
    unsetenv("XDG_CACHE_HOME");
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
        {{"play", "s_bend", "--replay", (folder / "other.gw").string()}, "it is a recording of 'renal'"},
        {{"play", "s_bend", "--size", "10x10"}, "--size 10x10"},
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
