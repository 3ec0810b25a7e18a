/// The room as a trainee meets it: the real window on a display of its own, real keys, pictures of it.

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <set>
#include <sys/resource.h>

#include "engine/script/command.h"
#include "render/picture/png.h"
#include "tests/app/program.h"
#include "tests/window/display.h"

namespace test {
namespace {

constexpr double long_enough = 90;  // [s]; nothing here waits for as long unless it fails

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

    bool reaches(const std::string& title) {
        const bool reached = display.wait_for_title(title, long_enough);
        EXPECT_TRUE(reached) << "'" << title << "' did not come, it is '" << display.title() << "'";
        return reached;
    }
    /// From the briefing into the running exercise.
    bool start() {
        display.move_mouse(200, 200);
        if (!reaches("ready")) return false;
        sleep_for(0.5);
        display.tap("Return", 0.1);
        return reaches("running");
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
    return run(room.folder, {"run", scenario, "--commands", (room.folder / "run.gw").string(), "--out",
                             (room.folder / "out").string(), "--expect", (room.folder / "run.gw").string(),
                             "--cache", std::string(SELDINGER_SOURCE) + "/build/cache"});
}

TEST(Play, AWholeExerciseByKeysReplaysToTheSameStates) {
    Room room(1280, 800, {"s_bend", "--record", "@run.gw"});
    ASSERT_TRUE(room.reaches("ready"));
    sleep_for(0.5);
    room.picture("briefing");
    ASSERT_TRUE(room.start());
    const double dark = greys(room.picture("beam-off"), 200, 200, 300, 300).first;
    room.display.key("space", true);
    sleep_for(1);
    const auto [bright, spread] = greys(room.picture("beam-on"), 200, 200, 300, 300);
    EXPECT_GT(bright, dark + 40);
    EXPECT_GT(spread, 2);  // bones or noise, not a plain grey

    room.display.key("Control_L", true);
    room.display.key("Up", true);
    sleep_for(2.5);
    room.display.key("Up", false);
    room.display.key("Control_L", false);
    room.display.tap("Right", 0.5);
    room.display.tap("j", 0.4);
    room.display.tap("equal");
    sleep_for(0.3);
    room.picture("pushed");
    room.display.key("space", false);
    room.display.key("a", true);
    sleep_for(0.4);
    room.display.tap("F3");
    sleep_for(1.5);
    room.picture("dsa");
    room.display.key("a", false);
    room.display.tap("s");
    room.display.tap("r");
    room.picture_behind("v", 0.6, "runs");
    room.picture_behind("F12", 0.8, "instructor");
    room.picture_behind("h", 0.3, "help");
    room.display.tap("End");
    ASSERT_TRUE(room.reaches("ended"));
    sleep_for(0.5);
    room.picture("end");
    const Outcome outcome = room.close();
    EXPECT_EQ(outcome.code, 0) << outcome.error;

    const script::CommandScript script = script::load_commands(room.folder / "run.gw");
    double advanced = 0;
    int injections = 0, beams = 0;
    for (const script::TimedCommand& timed : script.commands) {
        if (const auto* advance = std::get_if<script::Advance>(&timed.command)) advanced += advance->length;
        injections += std::holds_alternative<script::Inject>(timed.command);
        beams += std::holds_alternative<script::Beam>(timed.command);
    }
    EXPECT_GT(advanced, 20);
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
    ASSERT_TRUE(room.start());
    room.display.give_focus();
    sleep_for(0.2);
    room.display.key("Up", true);
    sleep_for(0.6);
    room.display.take_focus();
    sleep_for(1.2);
    room.display.key("Up", false);  // which nobody hears
    room.display.give_focus();
    sleep_for(0.2);
    EXPECT_EQ(room.close().code, 0);
    const script::CommandScript script = script::load_commands(room.folder / "run.gw");
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
    sleep_for(1.5);
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
    sleep_for(1);
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
    const auto tap = [&](const char* key, int times = 1) {
        for (int k = 0; k < times; ++k) {
            room.display.tap(key, 0.15);
            sleep_for(0.25);
        }
    };
    const auto attempt = [&](double push) {
        ASSERT_TRUE(room.start());
        room.display.key("space", true);
        room.display.key("Up", true);
        sleep_for(push);
        room.display.key("Up", false);
        room.display.key("space", false);
        tap("End");
        ASSERT_TRUE(room.reaches("ended"));
        sleep_for(0.5);
    };
    // From the card that is in focus over its buttons to the first button of the next card.
    constexpr int to_next_card = 3;
    for (const char* exercise : {"s_bend", "straight"}) {
        ASSERT_TRUE(room.reaches("choose"));
        sleep_for(1);
        tap("Right", to_next_card);
        room.picture(fmt::format("chooser-{}", exercise));
        tap("space");
        ASSERT_TRUE(room.reaches(exercise));
        attempt(1.5);
        tap("Down");  // marks "Again"
        room.picture(fmt::format("end-{}", exercise));
        tap("space");
        attempt(0.7);
        tap("Down");
        tap("Right", 3);  // "Other exercises"
        tap("space");
    }
    ASSERT_TRUE(room.reaches("choose"));
    EXPECT_EQ(room.close().code, 0);

    const std::filesystem::path kept = room.folder / "data/seldinger/recordings/Ada";
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
        ASSERT_TRUE(shown.reaches("running"));
        ASSERT_TRUE(shown.reaches("ended"));
        sleep_for(0.5);
        shown.picture(fmt::format("replay-{}", k + 1));
        if (k == 3) break;
        shown.display.tap("space", 0.15);  // "Next recording", which is in focus
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
        const Outcome outcome = run(folder, words);
        expect_refused(outcome, said);
    }
}

}  // namespace
}  // namespace test
