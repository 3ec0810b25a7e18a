#include "engine/studies/study.h"

#include <set>

#include "tests/engine/fixtures.h"

namespace studies {
namespace {

StudyResult tiny(const StudyOptions&) {
    StudyResult result;
    io::Table table{"numbers", {"x"}, {}};
    table.add({1.5});
    result.tables = {table};
    result.page = "# Tiny\n";
    return result;
}

}  // namespace

TEST(Studies, HaveNamesOfTheirOwnAndAQuestion) {
    std::set<std::string_view> ids;
    for (const Study& study : all_studies()) {
        EXPECT_TRUE(ids.insert(study.id).second);
        EXPECT_TRUE(study.question.ends_with('?')) << study.id;
        EXPECT_EQ(&find_study(study.id), &study);
    }
    EXPECT_NE(test::refusal([] { find_study("x"); }).find("'x' is not a study; studies are: stability"),
              std::string::npos);
}

TEST(Studies, LeaveTheirFilesInAFolderThatIsMade) {
    const test::TemporaryFolder folder;
    EXPECT_TRUE(run_study({"tiny", "?", tiny}, folder / "a/b", {}).empty());
    EXPECT_EQ(test::read(folder / "a/b/numbers.csv"), "x\n1.5\n");
    EXPECT_EQ(test::read(folder / "a/b/tiny.md"), "# Tiny\n");
}

TEST(Studies, RefuseAFolderThatCannotBe) {
    const test::TemporaryFolder folder;
    test::write(folder / "file", "");
    const std::string message = test::refusal([&] { run_study({"tiny", "?", tiny}, folder / "file", {}); });
    EXPECT_NE(message.find("file: cannot be written"), std::string::npos) << message;
}

}  // namespace studies
