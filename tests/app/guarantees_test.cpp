/// docs/guarantees.md, and what only the program as a whole can hold of it.

#include <regex>
#include <set>

#include "tests/app/program.h"

namespace app {
namespace {

using test::Outcome, test::read, test::Started, test::TemporaryFolder;

namespace fs = std::filesystem;

/// "Suite.Name" of every test in the source.
std::set<std::string> tests_of_the_source() {
    std::set<std::string> names;
    const std::regex test(R"(\nTEST(_F|_P)?\(([A-Za-z0-9_]+),\s*([A-Za-z0-9_]+)\))");
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(SELDINGER_SOURCE) / "tests")) {
        if (!entry.path().filename().string().ends_with("_test.cpp")) continue;
        const std::string text = read(entry.path());
        for (std::sregex_iterator at(text.begin(), text.end(), test), end; at != end; ++at)
            names.insert((*at)[2].str() + "." + (*at)[3].str());
    }
    return names;
}

}  // namespace

TEST(Guarantees, NameOnlyTestsThatExist) {
    const std::set<std::string> tests = tests_of_the_source();
    ASSERT_GT(tests.size(), 1000u);
    const std::string text = read(fs::path(SELDINGER_SOURCE) / "docs/guarantees.md");
    const std::regex named(R"(`([A-Z][A-Za-z0-9]+\.[A-Z][A-Za-z0-9]+)`)");
    int count = 0;
    for (std::sregex_iterator at(text.begin(), text.end(), named), end; at != end; ++at, ++count)
        EXPECT_TRUE(tests.contains((*at)[1].str())) << (*at)[1].str();
    EXPECT_GT(count, 60);
    // Every promise names a test.
    const std::regex row(R"(\n\| (?!Promise)[^|]+\|([^|\n]*)\|)");
    for (std::sregex_iterator at(text.begin(), text.end(), row), end; at != end; ++at)
        EXPECT_NE((*at)[1].str().find('`'), std::string::npos) << at->str();
}

TEST(Guarantees, ARecordingOfAnEarlierBuildReachesItsStates) {
    const TemporaryFolder folder;
    const std::string recording = std::string(SELDINGER_SOURCE) + "/tests/app/recorded/s_bend.gw";
    for (const char* setting :
         {"LC_ALL=C", "LC_ALL=de_DE.UTF-8", "LC_ALL=tr_TR.UTF-8", "LP_NUM_THREADS=0", "LP_NUM_THREADS=2"}) {
        const Outcome result = Started(folder, {"env", setting, SELDINGER_PROGRAM, "replay", recording,
                                                "--cache", folder / "cache"})
                                   .wait();
        EXPECT_EQ(result.code, 0) << setting << "\n" << result.error;
        test::expect_said(result.out, "states compared, all equal");
    }
}

}  // namespace app
