/// `seldinger anatomy generate`, run as a user runs it.

#include "tests/app/program.h"

namespace app {
namespace {

using test::Outcome, test::read, test::run, test::TemporaryFolder, test::write;

const char* const small_tree = R"(schema = 1
[[branch]]
name = "main"
points_mm = [[0, 0, 0, 2], [15, 0, 0, 2], [30, 0, 0, 2]]
)";

void expect_refused(const TemporaryFolder& folder, const std::vector<std::string>& words,
                    const std::string& expected) {
    std::vector<std::string> all = {"anatomy", "generate"};
    all.insert(all.end(), words.begin(), words.end());
    const Outcome result = run(folder, all);
    EXPECT_EQ(result.code, 2) << result.out;
    EXPECT_NE(result.error.find(expected), std::string::npos) << result.error;
    EXPECT_FALSE(std::filesystem::exists(folder / "out/x.stl"));
    EXPECT_FALSE(std::filesystem::exists(folder / "out/x.anatomy.json"));
}

}  // namespace

TEST(AnatomyGenerate, WritesAnAnatomyOnceAndKeepsIt) {
    const TemporaryFolder folder;
    write(folder / "x.toml", small_tree);
    const std::vector<std::string> words = {"anatomy", "generate", folder / "x.toml", "--out",
                                            folder / "out"};
    const Outcome first = run(folder, words);
    EXPECT_EQ(first.code, 0) << first.error;
    const std::string json = read(folder / "out/x.anatomy.json"), stl = read(folder / "out/x.stl");
    EXPECT_NE(json.find("main.in"), std::string::npos);
    EXPECT_EQ(first.out.find("kept"), std::string::npos) << first.out;
    EXPECT_NE(run(folder, words).out.find("kept as it was"), std::string::npos);

    std::filesystem::remove_all(folder / "out");
    run(folder, words);
    EXPECT_EQ(read(folder / "out/x.anatomy.json"), json);
    EXPECT_EQ(read(folder / "out/x.stl"), stl);

    write(folder / "out/x.stl", "damaged");
    EXPECT_EQ(run(folder, words).code, 0);
    EXPECT_EQ(read(folder / "out/x.stl"), stl);

    std::vector<std::string> narrowed = words;
    narrowed.insert(narrowed.end(), {"--stenosis", "main:15:8:50"});
    EXPECT_EQ(run(folder, narrowed).out.find("kept"), std::string::npos);
    EXPECT_NE(read(folder / "out/x.stl"), stl);
}

TEST(AnatomyGenerate, RefusesWhatIsWrongAndWritesNothing) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    expect_refused(folder, {"iliac-rena", "--out", out}, "(is 'iliac-renal' meant?); presets are: arch-1");
    expect_refused(folder, {folder / "x.toml", "--out", out}, "no such vessel tree can be read");
    write(folder / "x.toml", std::string(small_tree) + "radius = 3\n");
    expect_refused(folder, {folder / "x.toml", "--out", out}, "x.toml:5:");
    write(folder / "x.toml", small_tree);
    expect_refused(folder, {folder / "x.toml", "--out", out, "--stenosis", "mian:15:8:50"},
                   "(is 'main' meant?)");
    expect_refused(folder, {folder / "x.toml", "--out", out, "--stenosis", "main:35:8:50"},
                   "0 to 30.0 mm is accepted");
    expect_refused(folder, {folder / "x.toml", "--out", out, "--name", "a/b"},
                   "a file name without a folder");
    write(folder / "out", "in the way");
    expect_refused(folder, {folder / "x.toml", "--out", out}, "cannot be written");
}

}  // namespace app
