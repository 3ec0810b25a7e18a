#include "engine/io/plot.h"

#include "tests/engine/fixtures.h"

namespace io {

TEST(Plot, ScriptIsBesideThePicturesThatGnuplotDrawsFromIt) {
    const test::TemporaryFolder folder;
    test::write(folder / "a.csv", "1,2\n3,4\n");
    const std::string notice = write_plot({"a", "plot 'a.csv' using 1:2 with lines\n"}, folder.path());
    EXPECT_NE(test::read(folder / "a.gp").find("set output 'a.svg'"), std::string::npos);
    if (notice.find("not installed") != std::string::npos) GTEST_SKIP() << notice;
    EXPECT_EQ(notice, "");
    EXPECT_EQ(test::read(folder / "a.png").substr(1, 3), "PNG");
    EXPECT_NE(test::read(folder / "a.svg").find("<svg"), std::string::npos);
}

TEST(Plot, AFailureOfGnuplotIsTold) {
    const test::TemporaryFolder folder;
    const std::string notice = write_plot({"a", "plot 'missing.csv'\n"}, folder.path());
    EXPECT_NE(notice.find("a.gp: "), std::string::npos);
}

TEST(Plot, AFolderThatIsNotThereIsRefused) {
    EXPECT_NE(test::refusal([] {
                  write_plot({"a", ""}, "/nowhere");
              }).find("/nowhere/a.gp: cannot be written"),
              std::string::npos);
}

}  // namespace io
