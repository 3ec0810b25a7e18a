/// An exercise of one's own, from nothing to a class: `new`, `check`, `author`, and all commands that then
/// know it.

#include <cmath>
#include <fmt/format.h>
#include <random>

#include "tests/app/program.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using test::command, test::expect_refused, test::Outcome, test::read, test::Started, test::write;

const std::string vessels_cache = SELDINGER_SOURCE "/build/cache";

/// The program of a user whose data lie in the test's folder.
struct Author : test::InFolder {
    Outcome run(std::vector<std::string> words) const {
        words = command(std::move(words));
        words.insert(words.begin(), {"env", "XDG_DATA_HOME=" + (folder / "data").string()});
        return Started(folder, words).wait();
    }
    Outcome succeeded(const std::vector<std::string>& words,
                      const std::source_location& where = std::source_location::current()) const {
        const Outcome result = run(words);
        if (result.code != 0)
            ADD_FAILURE_AT(where.file_name(), static_cast<int>(where.line()))
                << "exit code " << result.code << ": " << result.out << result.error;
        return result;
    }
    /// own/small.toml, and a recording of it in rec/run.gw.
    void small_exercise() const {
        fs::create_directories(folder / "own");
        write(folder / "own/small.toml", test::small_toml);
        write(folder / "hand.gw", "0 beam on\n1..60 advance 1 mm\n75 end\n");
        succeeded({"run", "own/small.toml", "--commands", "hand.gw", "--out", "rec", "--frames", "none"});
    }
};

/// A hand that trembles: a line a frame, no two amounts alike.
std::string trembling_hand() {
    std::mt19937 random(3);
    const auto about = [&random](double amount, double most) {
        return amount + most * (2 * std::ldexp(static_cast<double>(random()), -32) - 1);
    };
    std::string text = "0 beam on\n";
    for (int frame = 1; frame <= 12; ++frame)
        text += fmt::format("{} rotate {:.3f} deg\n", frame, about(15, 1));
    for (int frame = 15; frame < 75; ++frame)
        text += fmt::format("{} advance {:.3f} mm\n", frame, about(3, 0.4));
    for (int frame = 79; frame < 86; ++frame)
        text += fmt::format("{} rotate {:.3f} deg\n", frame, about(-15, 1));
    for (int frame = 88; frame < 100; ++frame)
        text += fmt::format("{} advance {:.3f} mm\n", frame, about(2.4, 0.2));
    return text + "115 end\n";
}

}  // namespace

TEST_F(Author, FromNewThroughARecordingToTheClassWithNothingInBetween) {
    const std::vector<std::string> cache = {"--cache", vessels_cache}, own = {"--exercises", "own"};
    const auto with = [](std::vector<std::string> words, const std::vector<std::string>& more,
                         const std::vector<std::string>& others = {}) {
        return test::joined(test::joined(std::move(words), more), others);
    };
    succeeded({"new", "mine", "--folder", "own"});
    // The target forgives, as its author would have it.
    write(folder / "own/mine.toml",
          test::replaced(read(folder / "own/mine.toml"), "radius_mm = 8.0", "radius_mm = 14.0"));
    const Outcome checked = succeeded(with({"check", "own/mine.toml"}, cache));
    EXPECT_EQ(checked.out.find("WRONG"), std::string::npos) << checked.out;
    write(folder / "hand.gw", trembling_hand());
    succeeded(with({"run", "mine", "--commands", "hand.gw", "--out", "rec", "--frames", "none"}, cache, own));
    const Outcome made = succeeded(with({"author", "mine", "--from", "rec/run.gw"}, cache, own));
    test::expect_said(made.out, "10 of 10 reach the target of 14 mm");
    test::expect_said(read(folder / "own/mine.gw"), "1..12     rotate ");
    EXPECT_TRUE(fs::exists(folder / "own/mine.png"));

    // By its name, with what lies beside it.
    test::expect_said(succeeded(with({"list"}, own)).out, "mine ");
    succeeded(with({"run", "mine", "--commands", "own/mine.gw", "--out", "class/ada", "--frames", "none",
                    "--learner", "Ada"},
                   cache, own));
    write(folder / "list.toml", "schema = 1\n[[run]]\nscenario = \"mine\"\ncommands = \"solution\"\n");
    succeeded(with({"batch", "list.toml", "--out", "runs"}, cache, own));
    test::expect_said(succeeded(with({"check", "mine"}, cache, own)).out, "reaches the target after");
    succeeded(with({"score", "class/ada/run.gw"}, cache, own));
    succeeded(with({"replay", "class/ada/run.gw"}, cache, own));
    succeeded(with({"debrief", "class/ada/run.gw", "--out", "page", "--no-pictures"}, cache, own));
    const Outcome course = succeeded(with({"course", "class", "--out", "course"}, cache, own));
    test::expect_said(course.out, "1 recordings, 1 attempts: ");
    const std::string csv = read(folder / "course/course.csv"), row = "\nAda,mine,1,1,class/ada/run.gw,1,";
    test::expect_said(csv, row);
    EXPECT_NE(csv[csv.find(row) + row.size()], ',') << "no points";

    // Without a word a recording in the exercise's own folder knows it; one elsewhere says what is accepted.
    expect_refused(run(with({"score", "class/ada/run.gw"}, cache)),
                   "class/ada/run.gw is of 'mine', which was not found in ");
    fs::create_directories(folder / "own/recordings");
    fs::copy_file(folder / "class/ada/run.gw", folder / "own/recordings/run.gw");
    succeeded(with({"score", "own/recordings/run.gw"}, cache));
    // In the user's data every command finds it.
    fs::create_directories(folder / "data/seldinger");
    fs::rename(folder / "own", folder / "data/seldinger/exercises");
    succeeded(with({"score", "class/ada/run.gw"}, cache));
    test::expect_said(succeeded({"list"}).out, "mine ");
}

TEST_F(Author, ASolutionAndAPictureThatAreThereStay) {
    small_exercise();
    write(folder / "own/small.gw", "# mine\n");
    expect_refused(run({"author", "own/small.toml", "--from", "rec/run.gw"}),
                   "small.gw: it is there already; --replace makes it anew");
    EXPECT_EQ(read(folder / "own/small.gw"), "# mine\n");
    fs::remove(folder / "own/small.gw");
    write(folder / "own/small.png", "mine");
    test::expect_said(succeeded({"author", "own/small.toml", "--from", "rec/run.gw"}).out,
                      "small.png: stays as it is");
    EXPECT_EQ(read(folder / "own/small.png"), "mine");
    const std::string solution = read(folder / "own/small.gw");
    succeeded({"author", "own/small.toml", "--from", "rec/run.gw", "--replace"});
    EXPECT_EQ(read(folder / "own/small.gw"), solution);
    EXPECT_NE(read(folder / "own/small.png"), "mine");
    // Its solution alone is looked over without another being made.
    test::expect_said(succeeded({"author", "own/small.toml"}).out, "10 of 10 reach");
    // The recording is not written over, by any name.
    expect_refused(run({"author", "own/small.toml", "--from", "own/small.gw", "--replace"}),
                   "would overwrite what is read");
}

TEST_F(Author, RecordingsThatAreNoSolutionAreRefusedAndNothingIsWritten) {
    small_exercise();
    write(folder / "bad.gw", "1 push 2 mm\n");
    write(folder / "still.gw", "0 beam on\n5 end\n");
    write(folder / "short.gw", "1..5 advance 1 mm\n");
    succeeded({"run", "s_bend", "--commands", test::good_script, "--out", "other", "--frames", "none"});
    const auto refused = [&](const std::string& recording, const std::string& said) {
        expect_refused(run({"author", "own/small.toml", "--from", recording}), said);
    };
    refused("bad.gw", "bad.gw:1:");
    refused("still.gw", "expected motions of a device, found none");
    refused("short.gw", "it does not reach the target: its tip is ");
    refused("other/run.gw", "it is a recording of 's_bend'; expected one of 'small'");
    refused("missing.gw", "missing.gw");
    expect_refused(run({"author", "own/small.toml"}), "found none; --from RECORDING makes one");
    expect_refused(run({"author", "s_bend", "--from", "other/run.gw"}),
                   "'s_bend' ships; 'seldinger new NAME --from s_bend'");
    EXPECT_EQ(test::names_in(folder / "own"), std::vector<std::string>{"small.toml"});
}

TEST_F(Author, ATargetThatForgivesTooLittleIsTold) {
    small_exercise();
    write(folder / "own/small.toml",
          test::replaced(read(folder / "own/small.toml"), "name = \"end\"\nradius_mm = 3.0",
                         "centre_mm = [50.0, 8.0, 0.0]\nradius_mm = 4.0"));
    write(folder / "hand.gw", "0 beam on\n1..25 advance 1.2 mm\n40 end\n");
    const Outcome result = run({"author", "own/small.toml", "--from", "hand.gw", "--off", "20"});
    EXPECT_EQ(result.code, 1) << result.out << result.error;
    test::expect_said(result.out, "NO");
    test::expect_said(result.out, "The smallest target that all reach with 20 % off: radius_mm = ");
}

TEST_F(Author, NewRefusesWhatIsThereAndWhatIsNoName) {
    succeeded({"new", "mine"});
    const fs::path file = folder / "data/seldinger/exercises/mine.toml";
    const std::string text = read(file);
    expect_refused(run({"new", "mine"}), "expected a new name, found 'mine'");
    expect_refused(run({"new", "renal"}), "expected a new name, found 'renal'");
    for (const char* name : {"../mine", "/mine", ".mine", "a b", "a/b", ""})
        expect_refused(run({"new", name}), "expected a name of up to 64 letters");
    fs::create_directories(folder / "own");
    write(folder / "own/other.toml", "mine\n");
    expect_refused(run({"new", "other", "--folder", "own"}),
                   "own/other.toml: expected a new name, found this file");
    EXPECT_EQ(read(folder / "own/other.toml"), "mine\n");
    EXPECT_EQ(read(file), text);
    succeeded({"new", "second", "--from", "renal"});
    expect_refused(run({"new", "third", "--from", "renall"}), "did you mean 'renal'?");
    EXPECT_FALSE(fs::exists(folder / "data/seldinger/exercises/third.toml"));
}

TEST_F(Author, CheckTellsAllAndSaysSoByItsCode) {
    small_exercise();
    write(folder / "own/wrong.toml", test::small_toml_with("end = \"start\"", "end = \"begin\""));
    const Outcome both = run({"check", "own/small.toml", "own/wrong.toml"});
    EXPECT_EQ(both.code, 2);
    test::expect_said(both.out, "WRONG  entry");
    test::expect_said(both.out, "-      solution     there is none: small.gw");
    succeeded({"check", "own/small.toml"});
    // 'list' describes it all the same, and says so.
    test::expect_said(succeeded({"list", "own/wrong.toml"}).error, "note: it would be refused: ");
}

TEST_F(Author, FoldersOfExercisesAreToldApart) {
    small_exercise();
    fs::create_directories(folder / "two");
    write(folder / "two/small.toml", test::small_toml);
    for (const std::string name : {"list", "course"})
        expect_refused(
            run({name, name == "list" ? "scenarios" : "rec", "--exercises", "own", "--exercises", "two"}),
            "expected one exercise 'small', found ");
    expect_refused(run({"list", "--exercises", "nowhere"}), "expected a folder of exercises");
    // One that ships stands behind one's own of its name, and that is told.
    write(folder / "two/s_bend.toml", test::small_toml);
    const Outcome own = succeeded({"list", "s_bend", "--exercises", "two"});
    test::expect_said(own.out, "s_bend: small");
    test::expect_said(own.error, "note: two/s_bend.toml is taken, not ");
    // What cannot be loaded does not keep the others from the list.
    write(folder / "own/broken.toml", "title = \n");
    const Outcome list = succeeded({"list", "--exercises", "own"});
    test::expect_said(list.error, "broken.toml is left out: ");
    test::expect_said(list.out, "small ");
    test::expect_said(succeeded({"list", "own"}).out, "small ");
}

TEST_F(Author, ARecordingOfAnExerciseThatIsNotFoundKeepsNoOtherFromItsPage) {
    small_exercise();
    succeeded({"run", "own/small.toml", "--commands", "hand.gw", "--out", "class/a", "--frames", "none"});
    succeeded({"run", "s_bend", "--commands", test::good_script, "--out", "class/b", "--frames", "none"});
    const Outcome without = succeeded({"debrief", "class", "--no-pictures"});
    test::expect_said(without.error, "note: 'small' is left out: ");
    EXPECT_FALSE(fs::exists(folder / "class/debrief-small.html"));
    EXPECT_TRUE(fs::exists(folder / "class/debrief-s_bend.html"));
    succeeded({"debrief", "class", "--no-pictures", "--exercises", "own"});
    EXPECT_TRUE(fs::exists(folder / "class/debrief-small.html"));
}

}  // namespace app
