/// Pages as a teacher makes them, and as a browser shows them.

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "engine/io/text.h"
#include "render/picture/png.h"
#include "tests/app/pages.h"

namespace app {
namespace {

using test::asset, test::browse, test::clumsy, test::expect_refused, test::good_script, test::joined,
    test::Outcome, test::put, test::read, test::recorded, test::run, test::s_bend_run, test::Started,
    test::TemporaryFolder, test::write;

}  // namespace

using DebriefCommand = test::InFolder;

TEST_F(DebriefCommand, MakesAPageThatABrowserOpensClicksAndPrints) {
    const std::string good = recorded(folder, "good", read(good_script)),
                      bad = recorded(folder, "bad", clumsy);
    succeeded(folder, {"debrief", good, bad, "--expert", good_script, "--out", folder / "page"});
    std::string page = read(folder / "page/debrief.html");
    ASSERT_NE(page.find("data:image/png"), std::string::npos);

    // The same page, which clicks its own marks and notes what it then shows.
    const std::string clicks = R"(<script>
const seen = [];
window.addEventListener("error", event => seen.push("ERROR " + event.message));
window.addEventListener("load", async () => {
  for (const mark of document.querySelectorAll("#time a.mark")) {
    mark.dispatchEvent(new MouseEvent("click", {bubbles: true, cancelable: true}));
    await new Promise(resolve => setTimeout(resolve, 100));
    const row = document.querySelector("li.chosen");
    seen.push((row ? row.id : "none") + " | " + document.getElementById("moment").textContent);
  }
  document.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowRight"}));
  seen.push("key | " + document.getElementById("moment").textContent);
  const note = document.createElement("pre");
  note.id = "seen";
  note.textContent = seen.join("\n");
  document.body.append(note);
});
</script></body>)";
    page.replace(page.find("</body>"), 7, clicks);
    write(folder / "clicked.html", page);
    const Outcome clicked = browse(folder, {"--dump-dom", "file://" + (folder / "clicked.html").string()});
    ASSERT_EQ(clicked.code, 0) << clicked.error;
    EXPECT_EQ(clicked.error.find("CONSOLE"), std::string::npos) << clicked.error;
    const std::size_t begin = clicked.out.find("<pre id=\"seen\">");
    ASSERT_NE(begin, std::string::npos) << clicked.out.substr(0, 2000);
    const std::string seen = clicked.out.substr(begin, clicked.out.find("</pre>", begin) - begin);
    const auto score = nlohmann::json::parse(read(folder / "bad/score.json"));
    const auto& marks = score["handling_errors"]["marks"];
    ASSERT_GE(marks.size(), 2u);
    for (std::size_t k = 0; k < marks.size(); ++k) {
        const std::size_t at = seen.find("row" + std::to_string(k + 1) + " | ");
        ASSERT_NE(at, std::string::npos) << seen;
        EXPECT_NE(seen.find("frame " + std::to_string(marks[k]["frame"].get<int>()) + ":", at),
                  std::string::npos)
            << seen;
    }
    test::expect_said(seen, "key | ");
    EXPECT_EQ(seen.find("ERROR"), std::string::npos) << seen;

    const std::string url = "file://" + (folder / "page/debrief.html").string();
    const Outcome shot =
        browse(folder, {"--window-size=1120,1600", "--screenshot=" + (folder / "page.png").string(), url});
    ASSERT_EQ(shot.code, 0) << shot.error;
    const render::ColourImage picture = render::read_colour_png(folder / "page.png");
    EXPECT_EQ(picture.width, 1120);
    const Outcome printed =
        browse(folder, {"--print-to-pdf=" + (folder / "page.pdf").string(), "--no-pdf-header-footer", url});
    ASSERT_EQ(printed.code, 0) << printed.error;
    EXPECT_EQ(read(folder / "page.pdf").substr(0, 5), "%PDF-");
    EXPECT_GT(read(folder / "page.pdf").size(), 20'000u);
}

TEST_F(DebriefCommand, WhatIsNoRecordingOfTheExerciseIsRefused) {
    const std::string good = recorded(folder, "good", read(good_script));
    write(folder / "other.gw",
          "recording 3\nprogram 0000000000000001 x\nscenario 0000000000000001 renal\n0 end\n");
    expect_refused(run(folder, {"debrief", good, folder / "other.gw", "--out", folder / "page"}), "'renal'");
    write(folder / "broken.gw", "recording 3\n0 beam\n");
    expect_refused(run(folder, {"debrief", folder / "broken.gw", "--out", folder / "page"}), "broken.gw:2:");
    write(folder / "file", "");
    expect_refused(run(folder, {"debrief", good, "--out", folder / "file"}), "file: cannot be written");
    EXPECT_FALSE(std::filesystem::exists(folder / "page"));
}

TEST_F(DebriefCommand, OfAFolderMakesAPageForEachLearnerAndExercise) {
    std::filesystem::create_directories(folder / "class/below");
    const std::string few = "0 beam on\n2 advance 2 mm\n9 end\n";
    put(folder, recorded(folder, "a", few), "1.gw");
    put(folder, recorded(folder, "b", few), "below/2.gw");
    put(folder, recorded(folder, "c", few, "B/b"), "3.gw");
    run(folder, {"run", "straight", "--commands", folder / "a.script.gw", "--out", folder / "d", "--frames",
                 "none", "--learner", "Ada"});
    put(folder, folder / "d/run.gw", "4.gw");
    write(folder / "class/script.gw", few);
    write(folder / "class/broken.gw", "recording 3\n0 beam\n");
    std::string free = read(folder / "a.gw");
    free.insert(free.find("learner "), "practice free\n");
    write(folder / "class/free.gw", free);
    const Outcome made = succeeded(folder, {"debrief", folder / "class", "--no-pictures"});
    std::set<std::string> pages;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "class"))
        if (entry.path().extension() == ".html") pages.insert(entry.path().filename().string());
    EXPECT_EQ(pages, (std::set<std::string>{"debrief-Ada-s_bend.html", "debrief-Ada-straight.html",
                                            "debrief-B%2Fb-s_bend.html"}));
    for (const char* told :
         {"script.gw is left out: a script", "broken.gw is left out", "free.gw is left out: free"})
        EXPECT_NE(made.error.find(told), std::string::npos) << told << "\n" << made.error;
    // The other readers of a folder go through it, too, and say which file cannot be played.
    const Outcome replayed = run(folder, {"replay", folder / "class"});
    EXPECT_EQ(replayed.code, 2);
    EXPECT_EQ(std::count(replayed.out.begin(), replayed.out.end(), '\n'), 5) << replayed.out;
    test::expect_said(replayed.error, "broken.gw:2:");
    test::expect_said(replayed.error, "script.gw");
    std::filesystem::remove(folder / "class/broken.gw");
    std::filesystem::remove(folder / "class/script.gw");
    EXPECT_EQ(run(folder, {"replay", folder / "class"}).code, 0);
    EXPECT_EQ(run(folder, {"score", folder / "class"}).code, 0);
    expect_refused(run(folder, {"score", folder / "class", "--out", folder / "x.json"}),
                   "expected one recording");
    const Outcome counted = run(folder, {"course", folder / "class"});
    test::expect_said(counted.out, "4 attempts, 1 files that do not count");
}

TEST_F(DebriefCommand, ARecordingCannotNameAPlaceOutsideTheFolder) {
    std::filesystem::create_directories(folder / "class");
    const std::string plain = read(recorded(folder, "a", "0 beam on\n2 advance 2 mm\n9 end\n"));
    write(folder / "class/1.gw", plain);
    for (const char* hostile : {"../../elsewhere", "/tmp/elsewhere", "..", "a<b>", "x\\y"}) {
        std::string text = plain;
        const std::size_t at = text.find(" s_bend\n");
        ASSERT_NE(at, std::string::npos);
        write(folder / "class/2.gw", text.replace(at + 1, 6, hostile));
        succeeded(folder, {"debrief", folder / "class", "--no-pictures", "--force", "--scenario", "s_bend",
                           "--out", folder / "deep/out"});
        const std::filesystem::path page =
            folder / "deep/out" / ("debrief-" + io::file_name_of(hostile) + ".html");
        EXPECT_TRUE(std::filesystem::is_regular_file(page)) << page;
        EXPECT_EQ(page.parent_path(), folder / "deep/out") << page;
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "elsewhere.html"));
    EXPECT_FALSE(std::filesystem::exists(folder / "deep/elsewhere.html"));
}

using BatchCommand = test::InFolder;

TEST_F(BatchCommand, MakesEveryCombinationAndGoesOnWhereItStopped) {
    write(folder / "x.gw", "0 beam on\n1..10 advance 2 mm\n15 end\n");
    const std::string list =
        "schema = 1\n[[run]]\nscenario = [\"s_bend\", \"straight\"]\ncommands = [\"x.gw\", "
        "\"solution\"]\nseeds = [1, 2]\n"
        "[run.set]\n\"guidewire.friction\" = [0.0, 0.1]\n"
        "[[run]]\nscenario = \"s_bend\"\ncommands = \"solution\"\n[run.set]\n\"guidewire.diameter_mm\" = "
        "[0.5, 30.0]\n";
    write(folder / "list.toml", list);
    const auto made = run(folder, {"batch", folder / "list.toml", "--out", folder / "one", "--jobs", "1"});
    EXPECT_EQ(made.code, 1) << made.error;  // one of them fails
    test::expect_said(made.out, "18 of 18 runs, 1 failed");
    const std::string csv = read(folder / "one/batch.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 19) << csv;
    test::expect_said(csv, "diameter_mm = 30.0: expected");
    test::expect_said(csv, "guidewire.friction=0.1 seed=2");
    EXPECT_TRUE(std::filesystem::exists(folder / "one/000001/run.gw"));
    // Two at a time give the same.
    run(folder, {"batch", folder / "list.toml", "--out", folder / "two", "--jobs", "2"});
    EXPECT_EQ(read(folder / "two/batch.csv"), csv);
    // Only what is missing, has failed or has changed is made again.
    std::filesystem::remove_all(folder / "one/000003");
    write(folder / "x.gw", "0 beam on\n1..11 advance 2 mm\n15 end\n");
    const auto again = run(folder, {"batch", folder / "list.toml", "--out", folder / "one"});
    test::expect_said(again.out, "18 of 18 runs, 9 of them made before, 1 failed");
    EXPECT_TRUE(std::filesystem::exists(folder / "one/000003/run.gw"));
}

/// Every file below the folder, by its path there, but for what merging leaves and a plain batch does not.
std::map<std::string, std::string> bytes_below(const std::filesystem::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (entry.is_regular_file())
            files[std::filesystem::relative(entry.path(), folder).string()] = read(entry.path());
    return files;
}

TEST_F(BatchCommand, MergedShardsAreTheBytesOfOneBatch) {
    write(folder / "x.gw", "0 beam on\n1..10 advance 2 mm\n15 end\n");
    write(folder / "list.toml",
          "schema = 1\n[[run]]\nscenario = [\"s_bend\", \"straight\"]\ncommands = \"x.gw\"\nseeds = [1, 2]\n"
          "images = true\n[[run]]\nscenario = \"s_bend\"\ncommands = \"x.gw\"\n[run.set]\n"
          "\"guidewire.diameter_mm\" = [0.5, 30.0, 0.6]\n");
    const auto batch = [&](const std::string& out, const std::vector<std::string>& more) {
        return run(folder,
                   joined({"batch", folder / "list.toml", "--out", folder / out, "--cache", folder / "cache"},
                          more));
    };
    EXPECT_EQ(batch("whole", {}).code, 1);  // one of them fails
    const auto expected = bytes_below(folder / "whole");
    ASSERT_GT(expected.size(), 30u);
    for (const int shards : {1, 3, 7}) {
        std::vector<std::string> merge = {"batch", "merge"};
        for (int k = shards; k >= 1; --k) {
            const std::string name = std::to_string(k) + "of" + std::to_string(shards);
            EXPECT_LE(batch(name, {"--shard", std::to_string(k) + "/" + std::to_string(shards)}).code, 1);
            merge.push_back(folder / name);
        }
        const std::string out = folder / ("merged" + std::to_string(shards));
        merge.insert(merge.end(), {"--out", out});
        const auto merged = run(folder, merge);
        EXPECT_EQ(merged.code, 1) << merged.error;  // as the whole batch
        const auto found = bytes_below(out);
        EXPECT_EQ(found.size(), expected.size());
        for (const auto& [name, bytes] : expected) {
            ASSERT_TRUE(found.contains(name)) << name;
            EXPECT_TRUE(found.at(name) == bytes) << name;
        }
    }
    // What was merged goes on as one batch.
    const auto again = batch("merged3", {});
    test::expect_said(again.out, "7 of 7 runs, 6 of them made before, 1 failed");
}

TEST_F(BatchCommand, ShardsThatDoNotBelongTogetherAreNotMerged) {
    write(folder / "x.gw", "1..3 advance 2 mm\n5 end\n");
    const std::string list = "schema = 1\n[[run]]\nscenario = \"straight\"\ncommands = \"x.gw\"\nseeds = ";
    write(folder / "list.toml", list + "[1, 2, 3, 4]\n");
    write(folder / "other.toml", list + "[1, 2, 3, 5]\n");
    const auto shard = [&](const char* file, const char* shard, const char* out) {
        return run(folder, {"batch", folder / file, "--shard", shard, "--out", folder / out});
    };
    ASSERT_EQ(shard("list.toml", "1/2", "a").code, 0);
    ASSERT_EQ(shard("list.toml", "2/2", "b").code, 0);
    ASSERT_EQ(shard("other.toml", "2/2", "c").code, 0);
    ASSERT_EQ(shard("list.toml", "2/3", "d").code, 0);
    const auto refused = [&](const std::vector<std::string>& shards, const std::string& expected) {
        std::vector<std::string> arguments = {"batch", "merge"};
        for (const std::string& name : shards) arguments.push_back(folder / name);
        arguments.insert(arguments.end(), {"--out", folder / "out"});
        expect_refused(run(folder, arguments), expected);
        EXPECT_FALSE(std::filesystem::exists(folder / "out")) << expected;
    };
    refused({}, "no folder was given");
    refused({"a"}, "shard 2/2 is missing");
    refused({"a", "a"}, "was found in");
    refused({"a", "c"}, "a shard of another list");
    refused({"a", "d"}, "a shard of another list");
    write(folder / "x.gw", "1..3 advance 1 mm\n5 end\n");
    ASSERT_EQ(shard("list.toml", "2/2", "f").code, 0);
    refused({"a", "f"}, "a shard of another list");  // its script has changed
    refused({"a", "nowhere"}, "nowhere/shard.json");
    std::filesystem::remove(folder / "b/000004/score.json");
    refused({"a", "b"}, "run 4 is missing");
    write(folder / "b/shard.json", "{\"list\": \"x\", \"shard\": -1}");
    refused({"a", "b"}, "the shard is damaged");
    expect_refused(shard("list.toml", "5/4", "e"),
                   "expected i/n with i from 1 to n, and n up to 100000, found '5/4'");
    expect_refused(shard("list.toml", "1/5", "e"), "expected at most 4, one a run");
    EXPECT_FALSE(std::filesystem::exists(folder / "e"));
    expect_refused(run(folder, {"batch", folder / "list.toml", folder / "a", "--out", folder / "e"}),
                   "'batch merge' takes folders");
}

/// Three runs of scripts of their own, of which the first then never ends.
struct EndlessBatch {
    TemporaryFolder folder;
    std::vector<std::string> words = {"batch",   folder / "list.toml", "--jobs", "1",
                                      "--cache", folder / "cache"};

    EndlessBatch() {
        write(folder / "list.toml",
              "schema = 1\n[[run]]\nscenario = \"straight\"\ncommands = [\"a.gw\", \"b.gw\", \"c.gw\"]\n");
        for (const char* name : {"a.gw", "b.gw", "c.gw"})
            write(folder / name, "0 beam on\n1..3 advance 2 mm\n12 end\n");
    }
    std::vector<std::string> with(const std::vector<std::string>& more) const { return joined(words, more); }
    /// Starts it again, ends it by the signal in the midst of the first run, and returns its exit code.
    int ended(const std::string& out, int signal, const std::vector<std::string>& more = {}) const {
        write(folder / "a.gw", "0 beam on\n1..4 advance 2 mm\n1000000 end\n");
        const Started started(folder, test::command(joined(with({"--out", folder / out}), more)));
        // Its old recording ends with frame 12.
        const std::filesystem::path recording = folder / (out + "/000001/run.gw");
        while (read(recording).find("state 20 ") == std::string::npos) std::this_thread::yield();
        started.signal(signal);
        return started.wait().code;
    }
};

TEST_F(BatchCommand, AShardOfAnotherListThatWasEndedIsNotMerged) {
    for (const int signal : {SIGINT, SIGKILL}) {
        const EndlessBatch batch;
        const TemporaryFolder& home = batch.folder;
        ASSERT_EQ(run(home, batch.with({"--shard", "1/2", "--out", home / "one"})).code, 0);
        write(home / "a.gw", "0 beam on\n1..4 advance 2 mm\n1000000 end\n");
        ASSERT_EQ(run(home, batch.with({"--shard", "2/2", "--out", home / "two"})).code, 0);
        batch.ended("one", signal, {"--shard", "1/2"});
        expect_refused(run(home, {"batch", "merge", home / "one", home / "two", "--out", home / "all"}),
                       "run 1 is missing; shard 1/2 is to be made to its end first");
        EXPECT_FALSE(std::filesystem::exists(home / "all"));
        // What has not changed is still there.
        const std::string rows = read(home / "one/batch.csv");
        test::expect_said(rows, "\n3,straight,c.gw");
        EXPECT_EQ(rows.find("\n1,straight,a.gw"), std::string::npos) << rows;
    }
    // A whole batch of another list in the home of a fraction leaves none.
    const EndlessBatch batch;
    const TemporaryFolder& home = batch.folder;
    for (const char* shard : {"1/2", "2/2"})
        ASSERT_EQ(run(home, batch.with({"--shard", shard, "--out", home / std::string(1, shard[0])})).code,
                  0);
    write(home / "a.gw", "0 beam on\n12 end\n");
    ASSERT_EQ(run(home, batch.with({"--out", home / "1"})).code, 0);
    expect_refused(run(home, {"batch", "merge", home / "1", home / "2", "--out", home / "all"}),
                   "shard.json");
}

TEST_F(BatchCommand, WhenInterruptedItKeepsTheRowsOfRunsThatAreWhole) {
    const EndlessBatch batch;
    const TemporaryFolder& home = batch.folder;
    ASSERT_EQ(run(home, batch.with({"--out", home / "out"})).code, 0);
    EXPECT_EQ(batch.ended("out", SIGINT), 130);
    const std::string rows = read(home / "out/batch.csv");
    EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 3) << rows;
    write(home / "a.gw", "0 beam on\n12 end\n");
    test::expect_said(run(home, batch.with({"--out", home / "out"})).out,
                      "3 of 3 runs, 2 of them made before");
}

TEST_F(BatchCommand, ItsOutputReplacesNoInput) {
    const EndlessBatch batch;
    const TemporaryFolder& home = batch.folder;
    ASSERT_EQ(run(home, batch.with({"--out", home / "out"})).code, 0);
    const std::string recording = read(home / "out/000002/run.gw");
    const std::string list =
        "schema = 1\n[[run]]\nscenario = \"straight\"\ncommands = [\"a.gw\", \"out/000002/run.gw\"]\n";
    write(home / "list.toml", list);
    expect_refused(run(home, batch.with({"--out", home / "out"})), "would be replaced, and is read");
    EXPECT_EQ(read(home / "out/000002/run.gw"), recording);
    std::filesystem::copy_file(home / "list.toml", home / "out/batch.csv",
                               std::filesystem::copy_options::overwrite_existing);
    expect_refused(run(home, {"batch", home / "out/batch.csv", "--out", home / "out"}), "run.gw");
    write(home / "out/batch.csv", "schema = 1\n[[run]]\nscenario = \"straight\"\ncommands = \"solution\"\n");
    expect_refused(run(home, {"batch", home / "out/batch.csv", "--out", home / "out"}),
                   "batch.csv would overwrite what is read");
}

TEST_F(BatchCommand, VesselsThatHaveChangedAreRunAgain) {
    const auto grow = [&](const char* radius) {
        write(folder / "tree.toml",
              std::string("schema = 1\n[[branch]]\nname = \"v\"\npoints_mm = [[0, 0, 0, ") + radius +
                  "], [0, 0, 80, " + radius + "]]\n");
    };
    grow("3");
    write(folder / "own.toml",
          "schema = 1\ntitle = \"own\"\n[anatomy]\ntree = \"tree.toml\"\n[entry]\nend = "
          "\"v.in\"\ninserted_mm = "
          "40.0\n[target]\ncentre_mm = [0, 0, 60]\n");
    write(folder / "x.gw", "0 beam on\n1 advance 2 mm\n3 end\n");
    write(folder / "list.toml", "schema = 1\n[[run]]\nscenario = \"own.toml\"\ncommands = \"x.gw\"\n");
    const std::vector<std::string> words = {"batch", folder / "list.toml", "--out", folder / "out"};
    test::expect_said(run(folder, words).out, "1 of 1 runs:");
    test::expect_said(run(folder, words).out, "1 of them made before");
    grow("4");
    test::expect_said(run(folder, words).out, "1 of 1 runs:");
}

TEST_F(BatchCommand, AListWithErrorsIsRefusedWithItsLines) {
    const auto refused = [&](const std::string& list, const std::string& expected) {
        write(folder / "list.toml", list);
        expect_refused(run(folder, {"batch", folder / "list.toml", "--out", folder / "out"}), expected);
        EXPECT_FALSE(std::filesystem::exists(folder / "out"));
    };
    const std::string good = "schema = 1\n[[run]]\nscenario = \"s_bend\"\ncommands = \"solution\"\n";
    refused(good + "sedes = [1]\n", "list.toml:5:");
    refused(good + "seeds = [\"a\"]\n", "a list of whole numbers");
    refused("schema = 1\n", "[[run]]");
    refused("[[run]]\n", "schema");
    refused("schema = 1\n[[run]]\nscenario = \"s_bent\"\ncommands = \"solution\"\n", "s_bend");
    refused("schema = 1\n[[run]]\nscenario = \"s_bend\"\ncommands = \"none.gw\"\n", "none.gw");
    refused("schema = 1\n[[run\n", "this is not TOML");
    refused(good + "[run.set]\nseed = []\n", "a list of one or more");
    refused(good + "seeds = [1]\n[run.set]\nseed = 2\n", "expected either 'seeds'");
    // 2^64 combinations, which is 0 in 64 bits.
    std::string many = good + "[run.set]\n";
    for (int key = 0; key < 64; ++key) many += "k" + std::to_string(key) + " = [1, 2]\n";
    refused(many, "more than 100000 runs");
}

TEST(ShowCommand, DrawsTheScenario) {
    const TemporaryFolder folder;
    succeeded(folder, {"show", "s_bend", "--out", folder / "x.png", "--cache", folder / "cache"});
    EXPECT_GT(render::read_colour_png(folder / "x.png").width, 300);
    expect_refused(run(folder, {"show", "s_bend", "--out", folder / "x.jpg"}), ".png");
}

using RunCommand = test::InFolder;

TEST_F(RunCommand, TakesCommandsFromStandardInputAndValuesOfAnyKey) {
    const Outcome piped =
        Started(folder, {"/bin/sh", "-c",
                         std::string(SELDINGER_PROGRAM) + " run s_bend --commands - --frames none --out " +
                             (folder / "out").string() + " < " + good_script})
            .wait();
    EXPECT_EQ(piped.code, 0) << piped.error;
    EXPECT_EQ(
        run(folder, {"run", "s_bend", "--commands", good_script, "--frames", "none", "--out", folder / "set",
                     "--set", "guidewire.friction=0.1", "--set", "target.radius_mm=0.5"})
            .code,
        1);
    expect_refused(run(folder, s_bend_run(folder / "x", {"--set", "radius"})), "KEY=VALUE");
    expect_refused(run(folder, s_bend_run(folder / "x", {"--set", "target.radios_mm=1"})), "radios_mm");
}

}  // namespace app
