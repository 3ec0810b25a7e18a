#include "engine/scenario/exercise_folders.h"

#include <sys/stat.h>

#include "tests/engine/fixtures.h"

namespace scenario {
namespace {

namespace fs = std::filesystem;
using test::expect_refusal, test::small_toml, test::write;

/// Shipped assets, a user's folder and two folders to name.
struct ExerciseFoldersTest : test::InFolder {
    ExerciseFoldersTest() {
        for (const char* name : {"assets/scenarios", "assets/scripts", "users", "a", "b"})
            fs::create_directories(folder / name);
        write(folder / "assets/scenarios/tube.toml", small_toml);
        write(folder / "assets/scripts/tube.gw", "0 end\n");
        write(folder / "assets/scenarios/tube.png", "a picture");
    }
    void put(const std::string& file, const std::string& toml = small_toml) const {
        write(folder / file, toml);
    }
    ExerciseFolders with(const std::vector<std::string>& named) const {
        std::vector<fs::path> folders;
        for (const std::string& name : named) folders.push_back(folder / name);
        return {folder / "assets", folder / "users", folders};
    }
    /// A recording of the small scenario of that name; hash 0 = unknown.
    script::CommandScript recording(const std::string& file, const std::string& name,
                                    std::uint64_t hash) const {
        script::CommandScript made;
        made.file = (folder / file).string();
        made.origin.emplace();
        made.origin->scenario = name;
        made.origin->scenario_hash = hash;
        return made;
    }
};

std::uint64_t content_of(const std::string& toml) {
    return parse_scenario(toml, "x.toml", test::asset("devices")).content;
}

const std::string wider = test::small_toml_with("radius_mm = 3.0", "radius_mm = 4.0");

}  // namespace

TEST_F(ExerciseFoldersTest, SolutionAndPictureLieBesideTheScenario) {
    put("a/mine.toml");
    write(folder / "a/mine.gw", "0 end\n");
    const ExerciseFiles mine = with({"a"}).find("mine");
    EXPECT_EQ(mine.file, folder / "a/mine.toml");
    EXPECT_EQ(mine.solution, folder / "a/mine.gw");
    EXPECT_EQ(mine.picture, "");
    const ExerciseFiles ships = with({}).find("tube");
    EXPECT_EQ(ships.solution, folder / "assets/scripts/tube.gw");
    EXPECT_EQ(ships.picture, folder / "assets/scenarios/tube.png");
    EXPECT_EQ(with({}).find((folder / "a/mine.toml").string()).solution, mine.solution);
    // By its path too, a shipped one has its own solution.
    EXPECT_EQ(with({}).find((folder / "assets/scenarios/tube.toml").string()).solution, ships.solution);
}

TEST_F(ExerciseFoldersTest, TheMoreSpecificFolderComesFirstAndSaysWhatItHides) {
    put("users/tube.toml");
    put("a/tube.toml");
    const ExerciseFiles own = with({}).find("tube");
    EXPECT_EQ(own.file, folder / "users/tube.toml");
    EXPECT_EQ(own.hides, std::vector<fs::path>{folder / "assets/scenarios/tube.toml"});
    const ExerciseFiles named = with({"a"}).find("tube");
    EXPECT_EQ(named.file, folder / "a/tube.toml");
    EXPECT_EQ(named.hides.size(), 2u);
    const std::vector<ExerciseFiles> all = with({"a"}).all();
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].file, named.file);
    EXPECT_EQ(all[0].hides, named.hides);
}

TEST_F(ExerciseFoldersTest, TwoNamedFoldersWithOneNameAreRefused) {
    put("a/mine.toml");
    put("b/mine.toml");
    expect_refusal([&] { with({"a", "b"}); }, "expected one exercise 'mine', found ");
    EXPECT_EQ(with({"a", "a"}).find("mine").file, folder / "a/mine.toml");  // one folder, named twice
}

TEST_F(ExerciseFoldersTest, WhatIsNoFolderOrCannotBeReadIsRefused) {
    expect_refusal([&] { with({"nowhere"}); }, "expected a folder of exercises, found nothing of that name");
    write(folder / "file", "");
    expect_refusal([&] { with({"file"}); }, "found something else");
    fs::permissions(folder / "b", fs::perms::none);
    if (::geteuid() != 0) expect_refusal([&] { with({"b"}); }, "cannot be read");
    fs::permissions(folder / "b", fs::perms::owner_all);
    EXPECT_NO_THROW(ExerciseFolders(folder / "assets", folder / "missing", {}).all());
}

TEST_F(ExerciseFoldersTest, DevicesVesselsAndListsAreNoExercises) {
    put("a/mine.toml");
    fs::copy_file(test::asset("devices/glide035.toml"), folder / "a/wire.toml");
    write(folder / "a/vessels.toml", "schema = 1\npreset = \"lca\"\n");
    write(folder / "a/list.toml", "schema = 1\n[[run]]\nscenario = \"mine\"\n");
    write(folder / "a/broken.toml", "this is no TOML");
    fs::create_directories(folder / "a/folder.toml");
    fs::create_symlink("loop.toml", folder / "a/loop.toml");
    ASSERT_EQ(mkfifo((folder / "a/pipe.toml").c_str(), 0600), 0);
    std::vector<std::string> names;
    for (const ExerciseFiles& one : with({}).in(folder / "a")) names.push_back(one.name);
    EXPECT_EQ(names, (std::vector<std::string>{"broken", "mine"}));
}

TEST_F(ExerciseFoldersTest, AnUnknownNameIsAnsweredWithThoseThereAreAndWhere) {
    put("a/mine.toml");
    expect_refusal([&] { with({"a"}).find("mina"); }, "did you mean 'mine'?");
    expect_refusal([&] { with({"a"}).find("mina"); }, (folder / "a").string());
    expect_refusal([&] { with({"a"}).find("../a/mine"); }, "no such scenario");
    expect_refusal([&] { with({}).find("mine"); }, "--exercises FOLDER");
    EXPECT_EQ(ExerciseFolders(test::asset(""), "", {}).find("s_bend").file,
              test::asset("scenarios/s_bend.toml"));
}

TEST_F(ExerciseFoldersTest, ARecordingFindsTheScenarioOfItsContent) {
    put("a/mine.toml");
    put("b/mine.toml", wider);
    const std::uint64_t narrow_hash = content_of(small_toml), wide_hash = content_of(wider);
    ASSERT_NE(narrow_hash, wide_hash);
    const auto file_of = [&](const std::vector<std::string>& folders, const script::CommandScript& of) {
        return fs::weakly_canonical(with(folders).of_recording(of, test::asset("devices")).file);
    };
    const fs::path narrow = fs::weakly_canonical(folder / "a/mine.toml"),
                   wide = fs::weakly_canonical(folder / "b/mine.toml");
    fs::create_directories(folder / "b/recordings");
    // In a folder that is searched, beside the recording, and in the folder above.
    EXPECT_EQ(file_of({"a"}, recording("run.gw", "mine", narrow_hash)), narrow);
    EXPECT_EQ(file_of({}, recording("a/run.gw", "mine", narrow_hash)), narrow);
    EXPECT_EQ(file_of({}, recording("b/recordings/run.gw", "mine", wide_hash)), wide);
    // The content decides, not the order of folders.
    EXPECT_EQ(file_of({"a"}, recording("b/run.gw", "mine", wide_hash)), wide);
    EXPECT_EQ(file_of({"b"}, recording("a/run.gw", "mine", narrow_hash)), narrow);
    // Of neither content: the first, whose difference whoever plays it tells.
    EXPECT_EQ(file_of({"a"}, recording("b/run.gw", "mine", 1)), narrow);
}

TEST_F(ExerciseFoldersTest, ARecordingOfNothingKnownIsToldWhatIsAccepted) {
    const auto said = [&](const std::string& name) {
        return test::refusal(
            [&] { with({}).of_recording(recording("run.gw", name, 0), test::asset("devices")); });
    };
    test::expect_said(said("lsa"), "run.gw is of 'lsa', which was not found in ");
    test::expect_said(said("lsa"), "expected --exercises FOLDER or --scenario FILE");
    test::expect_said(said(""), "it does not say which scenario it is of");
    put("a/tube.toml");
    test::expect_said(said("../a/tube"), "'../a/tube' is no scenario's name");
    test::expect_said(said("/etc/passwd"), "is no scenario's name");
    test::expect_said(said(".hidden"), "is no scenario's name");
}

TEST(ExerciseName, IsNeverAPath) {
    for (const char* name : {"lsa", "LSA-2", "a_b", "7"}) EXPECT_TRUE(is_exercise_name(name)) << name;
    for (const char* name : {"", "..", "a/b", "/a", ".a", "-a", "a b", "a.b", "ä", "a\n", "a\\b"})
        EXPECT_FALSE(is_exercise_name(name)) << name;
    EXPECT_FALSE(is_exercise_name(std::string(65, 'a')));
}

}  // namespace scenario
