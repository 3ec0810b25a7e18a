#include "engine/room/attempts.h"

#include <gtest/gtest.h>
#include <random>
#include <set>
#include <thread>

#include "engine/io/error.h"
#include "engine/room/results.h"
#include "tests/engine/fixtures.h"

namespace room {
namespace {

namespace fs = std::filesystem;

TEST(Attempts, AreNumberedInAFolderAndAfterAFirstFile) {
    const test::TemporaryFolder folder;
    const Attempts there(folder / "recordings/Ada/");
    EXPECT_EQ(there.make_next("renal"), folder / "recordings/Ada/renal-001.gw");
    EXPECT_EQ(there.make_next("renal"), folder / "recordings/Ada/renal-002.gw");
    EXPECT_EQ(there.make_next("s_bend"), folder / "recordings/Ada/s_bend-001.gw");
    fs::remove(folder / "recordings/Ada/renal-001.gw");
    test::write(folder / "recordings/Ada/renal-0999.gw", "");
    EXPECT_EQ(there.make_next("renal"), folder / "recordings/Ada/renal-1000.gw");

    const Attempts after(folder / "my.gw");
    EXPECT_EQ(after.make_next("renal"), folder / "my.gw");
    EXPECT_EQ(after.make_next("s_bend"), folder / "my-2.gw");
    EXPECT_EQ(after.make_next("renal"), folder / "my-3.gw");
}

/// Names of files that are there already, links to nothing among them, and first files of any form.
TEST(Attempts, ReplaceNothingThatIsThere) {
    const unsigned seed = 20261125;
    std::mt19937 random(seed);
    const char* const names[] = {
        "renal-001.gw", "renal-1.gw",  "renal-.gw", "renal-0002.gw", "renal-99999999999.gw",
        "a.gw",         "a-2.gw",      "a-x.gw",    "a-3.gw.gw",     "renal-007.GW",
        "renal--3.gw",  "renal-+5.gw", "-001.gw",   "a-02.gw",       "renal-002.gw.part"};
    for (int round = 0; round < 1000; ++round) {
        const test::TemporaryFolder folder;
        std::set<fs::path> before;
        for (const char* name : names) {
            if (random() % 2) continue;
            if (random() % 8 == 0)
                fs::create_symlink("nothing", folder / name);
            else
                test::write(folder / name, "kept");
            before.insert(folder / name);
        }
        const Attempts attempts(random() % 2 ? folder.path() : folder / "a.gw");
        for (int k = 0; k < 4; ++k) {
            const fs::path made = attempts.make_next("renal");
            EXPECT_TRUE(before.insert(made).second) << made << ", seed " << seed << ", round " << round;
            EXPECT_EQ(fs::file_size(made), 0u);
        }
        for (const fs::path& file : before) {
            if (!fs::is_regular_file(file) || fs::file_size(file) == 0) continue;
            EXPECT_EQ(test::read(file), "kept") << file;
        }
        EXPECT_FALSE(fs::exists(folder / "nothing")) << "seed " << seed << ", round " << round;
    }
}

TEST(Attempts, OfSeveralProgramsAtOnceHaveFilesOfTheirOwn) {
    const test::TemporaryFolder folder;
    std::vector<fs::path> made[4];
    std::vector<std::thread> threads;
    for (auto& mine : made)
        threads.emplace_back([&mine, &folder] {
            const Attempts attempts(folder.path());
            for (int k = 0; k < 50; ++k) mine.push_back(attempts.make_next("renal"));
        });
    for (std::thread& thread : threads) thread.join();
    std::set<fs::path> all;
    for (const auto& mine : made) all.insert(mine.begin(), mine.end());
    EXPECT_EQ(all.size(), 200u);
}

TEST(Attempts, SayWhatCannotBeWritten) {
    const test::TemporaryFolder folder;
    for (const char* place : {"/proc/nope", "/proc/nope/", "/no/such/folder/run.gw", "/dev/full"}) {
        const Attempts attempts{fs::path(place)};
        test::expect_refusal([&] { attempts.require_writable(); }, place);
    }
    Attempts(folder / "new/folders/").require_writable();
    EXPECT_FALSE(fs::exists(folder / "new"));
}

/// Of 2000 names of random bytes, and some of people, each has a folder of its own that lies in the folder
/// above.
TEST(Attempts, EveryLearnerHasAFolder) {
    const unsigned seed = 36;
    std::mt19937 random(seed);
    std::set<std::string> learners = {"Ada", "ada",   "..",   ".",     "/etc",
                                      "a/b", "a%2Fb", "José", "C:\\x", "a b"},
                          folders;
    while (learners.size() < 2000) {
        std::string name(1 + random() % 12, ' ');
        for (char& c : name) c = "ab./\\%: \"*?<>|\xc3\xa9"[random() % 17];
        learners.insert(name);
    }
    for (const std::string& learner : learners) {
        const std::string folder = folder_of(learner);
        EXPECT_TRUE(folders.insert(folder).second) << learner << ", seed " << seed;
        EXPECT_EQ(fs::path(folder).filename(), folder) << learner << ", seed " << seed;
        EXPECT_EQ((fs::path("x") / folder).lexically_normal().parent_path(), "x")
            << learner << ", seed " << seed;
    }
    EXPECT_EQ(folder_of(""), "guest");
}

}  // namespace
}  // namespace room
