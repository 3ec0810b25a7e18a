/// docs/guarantees.md, and what only the program as a whole can hold of it.

#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "tests/app/program.h"

namespace app {
namespace {

using test::Outcome, test::read, test::Started, test::TemporaryFolder;

namespace fs = std::filesystem;

const fs::path source = SELDINGER_SOURCE;

/// "Suite.Name" of every test in the source, and "test_name" of those in Python.
std::set<std::string> tests_of_the_source() {
    std::set<std::string> names;
    const std::regex test(R"(\nTEST(_F|_P)?\(([A-Za-z0-9_]+),\s*([A-Za-z0-9_]+)\))"),
        python(R"(\ndef (test_[a-z0-9_]+)\()");
    for (const auto& entry : fs::recursive_directory_iterator(source / "tests")) {
        const std::string file = entry.path().filename().string();
        if (!file.ends_with("_test.cpp") && !(file.starts_with("test_") && file.ends_with(".py"))) continue;
        const std::string text = read(entry.path());
        for (std::sregex_iterator at(text.begin(), text.end(), file.ends_with(".py") ? python : test), end;
             at != end; ++at)
            names.insert(file.ends_with(".py") ? (*at)[1].str() : (*at)[2].str() + "." + (*at)[3].str());
    }
    return names;
}

/// A line of the tables: what is promised, and the tests that hold it.
struct Promise {
    std::string text;
    std::set<std::string> tests;
};
std::vector<Promise> promises() {
    std::vector<Promise> all;
    const std::string text = read(source / "docs/guarantees.md");
    const std::regex row(R"(\n\| (?!Promise)([^|]+)\|([^|\n]*)\|)"), named("`([^`]+)`");
    for (std::sregex_iterator at(text.begin(), text.end(), row), end; at != end; ++at) {
        Promise& promise = all.emplace_back(Promise{(*at)[1].str(), {}});
        const std::string cell = (*at)[2].str();
        for (std::sregex_iterator test(cell.begin(), cell.end(), named); test != end; ++test)
            promise.tests.insert((*test)[1].str());
    }
    return all;
}

/// An entry of tests/mutants.txt.
struct Mutant {
    std::string name, row;
    std::vector<std::string> tests, files, old_texts, new_texts;  // a file for each old text
};
std::vector<Mutant> mutants() {
    std::vector<Mutant> all;
    std::istringstream text(read(source / "tests/mutants.txt"));
    char before = 0;
    std::string file;
    for (std::string line; std::getline(text, line);) {
        const auto rest = [&line](std::string_view key) { return line.substr(key.size()); };
        const char kind = line.empty() ? 0 : line[0];
        if (kind == '[') {
            all.push_back({line, {}, {}, {}, {}, {}});
            file.clear();
        } else if (kind == '-' || kind == '+') {
            std::vector<std::string>& texts = kind == '-' ? all.back().old_texts : all.back().new_texts;
            if (before == kind)
                texts.back() += "\n" + line.substr(std::min<std::size_t>(2, line.size()));
            else
                texts.push_back(line.substr(std::min<std::size_t>(2, line.size())));
            all.back().files.resize(all.back().old_texts.size(), file);
        } else if (line.starts_with("row ")) {
            all.back().row = rest("row ");
        } else if (line.starts_with("file ")) {
            file = rest("file ");
        } else if (line.starts_with("test ")) {
            all.back().tests.push_back(rest("test "));
        }
        before = kind;
    }
    return all;
}

}  // namespace

TEST(Guarantees, NameOnlyTestsThatExist) {
    const std::set<std::string> tests = tests_of_the_source();
    ASSERT_GT(tests.size(), 1000u);
    const std::string text = read(source / "docs/guarantees.md");
    const std::regex named(R"(`([A-Z][A-Za-z0-9]+\.[A-Z][A-Za-z0-9]+|test_[a-z0-9_]+)`)");
    int count = 0;
    for (std::sregex_iterator at(text.begin(), text.end(), named), end; at != end; ++at, ++count)
        EXPECT_TRUE(tests.contains((*at)[1].str())) << (*at)[1].str();
    EXPECT_GT(count, 60);
    for (const Promise& promise : promises()) EXPECT_FALSE(promise.tests.empty()) << promise.text;
}

TEST(Guarantees, EachHasAMutantThatFitsTheSource) {
    const std::vector<Promise> all = promises();
    EXPECT_GT(all.size(), 90u);
    std::set<std::string> names, broken;
    std::map<std::string, std::string> texts;
    for (const Mutant& mutant : mutants()) {
        SCOPED_TRACE(mutant.name);
        EXPECT_TRUE(names.insert(mutant.name).second) << "the name is there twice";
        int rows = 0;
        for (const Promise& promise : all) {
            if (mutant.row.empty() || !promise.text.starts_with(mutant.row)) continue;
            ++rows;
            broken.insert(promise.text);
            for (const std::string& test : mutant.tests)
                EXPECT_TRUE(promise.tests.contains(test)) << test << " is not named by: " << promise.text;
        }
        EXPECT_EQ(rows, 1) << mutant.row;
        EXPECT_FALSE(mutant.tests.empty());
        EXPECT_FALSE(mutant.old_texts.empty());
        EXPECT_EQ(mutant.old_texts.size(), mutant.new_texts.size());
        for (std::size_t k = 0; k < mutant.old_texts.size(); ++k) {
            const std::string &file = mutant.files[k], &old = mutant.old_texts[k];
            const auto [known, is_new] = texts.try_emplace(file);
            if (is_new) known->second = read(source / file);
            const std::string& text = known->second;
            const std::size_t at = text.find(old);
            EXPECT_NE(at, std::string::npos) << file << " has no longer:\n" << old;
            EXPECT_EQ(text.find(old, std::min(at, text.size() - 1) + 1), std::string::npos)
                << file << " has more than once:\n"
                << old;
        }
    }
    for (const Promise& promise : all)
        EXPECT_TRUE(broken.contains(promise.text)) << "no mutant breaks: " << promise.text;
}

TEST(Guarantees, ARecordingOfAnEarlierBuildReachesItsStates) {
    const TemporaryFolder folder;
    const std::string recording = source / "tests/app/recorded/s_bend.gw";
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
