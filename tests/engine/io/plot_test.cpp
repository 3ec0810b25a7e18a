#include "engine/io/plot.h"

#include "tests/engine/fixtures.h"

namespace io {

TEST(Plot, ScriptIsBesideThePicturesThatGnuplotDrawsFromIt) {
    const test::TemporaryFolder folder;
    test::write(folder / "a.csv", "1,2\n3,4\n");
    const std::string notice = write_plot({"a", "plot 'a.csv' using 1:2 with lines\n"}, folder.path());
    test::expect_said(test::read(folder / "a.gp"), "set output 'a.svg'");
    if (notice.find("not installed") != std::string::npos) GTEST_SKIP() << notice;
    EXPECT_EQ(notice, "");
    EXPECT_EQ(test::read(folder / "a.png").substr(1, 3), "PNG");
    test::expect_said(test::read(folder / "a.svg"), "<svg");
}

TEST(Plot, AFailureOfGnuplotIsTold) {
    const test::TemporaryFolder folder;
    const std::string notice = write_plot({"a", "plot 'missing.csv'\n"}, folder.path());
    test::expect_said(notice, "a.gp: ");
}

TEST(Plot, AFolderThatIsNotThereIsRefused) {
    test::expect_refusal([] { write_plot({"a", ""}, "/nowhere"); }, "/nowhere/a.gp: cannot be written");
}

}  // namespace io
