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

using Studies = test::InFolder;

TEST_F(Studies, HaveNamesOfTheirOwnAndAQuestion) {
    std::set<std::string_view> ids;
    for (const Study& study : all_studies()) {
        EXPECT_TRUE(ids.insert(study.id).second);
        EXPECT_TRUE(study.question.ends_with('?')) << study.id;
        EXPECT_EQ(&find_study(study.id), &study);
    }
    test::expect_refusal([] { find_study("x"); }, "'x' is not a study; studies are: stability");
}

TEST_F(Studies, LeaveTheirFilesInAFolderThatIsMade) {
    EXPECT_TRUE(run_study({"tiny", "?", tiny}, folder / "a/b", {}).empty());
    EXPECT_EQ(test::read(folder / "a/b/numbers.csv"), "x\n1.5\n");
    EXPECT_EQ(test::read(folder / "a/b/tiny.md"), "# Tiny\n");
}

}  // namespace studies
