/// `seldinger study` as a user meets it: shards that merge, and what is refused.

#include "tests/app/program.h"

namespace app {
namespace {

using test::expect_refused, test::Outcome, test::read, test::run, test::TemporaryFolder, test::write;

Outcome shard(const TemporaryFolder& folder, const std::string& numbers, const std::string& name,
              const std::string& seed = "1") {
    return run(folder, {"study", "wall-variation", "--quick", "--seed", seed, "--shard", numbers, "--out",
                        folder / name});
}

}  // namespace

using Study = test::InFolder;

TEST_F(Study, ListsTheStudiesAndRefusesUnknownOnes) {
    const Outcome list = run(folder, {"study"});
    EXPECT_EQ(list.code, 0);
    for (const char* id : {"separation ", "varied-segments", "separation-frequency", "static-contact",
                           "resolution", "wall-variation", "cost", "triangle-walls", "all", "merge"})
        EXPECT_NE(list.out.find(id), std::string::npos) << id;
    expect_refused(run(folder, {"study", "seperation", "--out", folder / "out"}),
                   "'seperation' is not a study");
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST_F(Study, LeavesTablesPicturesAndClaims) {
    succeeded(folder, {"study", "resolution", "--quick", "--out", folder / "out"});
    for (const char* name : {"resolution.md", "resolution.csv", "resolution.gp", "claims.json"})
        EXPECT_FALSE(read(folder / "out" / name).empty()) << name;
}

TEST_F(Study, RefusesAFolderThatCannotBeWritten) {
    write(folder / "file", "kept");
    for (const char* id : {"resolution", "all"})
        expect_refused(run(folder, {"study", id, "--quick", "--out", folder / "file"}),
                       "file: cannot be written");
    expect_refused(
        run(folder, {"study", "wall-variation", "--quick", "--shard", "1/2", "--out", folder / "file"}),
        "file: cannot be written");
    EXPECT_EQ(read(folder / "file"), "kept");
    expect_refused(run(folder, {"study", "resolution", "--quick"}), "--out FOLDER is missing");
}

TEST_F(Study, RefusesShardsThatCannotBe) {
    for (const char* numbers : {"0/2", "3/2", "1", "x/y", "1/99999"})
        expect_refused(shard(folder, numbers, "out"), "--shard: ");
    expect_refused(run(folder, {"study", "cost", "--quick", "--shard", "1/2", "--out", folder / "out"}),
                   "'cost' cannot be cut");
    expect_refused(run(folder, {"study", "all", "--quick", "--shard", "1/2", "--out", folder / "out"}),
                   "expected one study with it, found 'all'");
    expect_refused(run(folder, {"study", "cost", "x", "--quick", "--out", folder / "out"}),
                   "'study merge' takes folders");
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST_F(Study, MergesShardsOfOneRunOnlyAndOverwritesNothing) {
    EXPECT_EQ(shard(folder, "1/2", "a").code, 0);
    EXPECT_EQ(shard(folder, "2/2", "b").code, 0);
    EXPECT_EQ(shard(folder, "2/2", "other", "7").code, 0);
    const auto merge = [&](std::initializer_list<const char*> names) {
        std::vector<std::string> words = {"study", "merge"};
        for (const char* name : names) words.push_back(folder / name);
        words.insert(words.end(), {"--out", folder / "out"});
        return run(folder, words);
    };
    std::filesystem::create_directory(folder / "out");
    write(folder / "out/wall-variation.md", "of before");
    expect_refused(merge({"a"}), "a shard is missing: 2/2");
    expect_refused(merge({"a", "other"}), "seed 7 was found");
    expect_refused(merge({"a", "a"}), "given twice");
    expect_refused(merge({}), "no folder was given");
    EXPECT_EQ(read(folder / "out/wall-variation.md"), "of before");
    EXPECT_EQ(merge({"b", "a"}).code, 0);
    test::expect_said(read(folder / "out/wall-variation.md"), "uneven wall");
}

}  // namespace app
