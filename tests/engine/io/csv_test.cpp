#include "engine/io/csv.h"

#include "tests/engine/fixtures.h"

namespace io {
namespace {

using test::refusal;

std::string points_refusal(const std::string& text) {
    return refusal([&] { parse_csv(text, "a.csv", points_header); });
}

}  // namespace

TEST(Csv, PointsReadBackToTheSameBits) {
    const test::TemporaryFolder folder;
    const geometry::Polyline points = {{0.1, -1e-300, 1.0 / 3}, {1e22, 5e-324, -0.0}};
    test::write(folder / "a.csv", points_csv(points));
    const geometry::Polyline again = load_points(folder / "a.csv");
    ASSERT_EQ(again.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i)
        for (int k = 0; k < 3; ++k) EXPECT_EQ(again[i][k], points[i][k]);
}

TEST(Csv, LineEndsOfOtherSystemsSpacesAndEmptyLastLinesAreAccepted) {
    const auto rows =
        parse_csv("\xEF\xBB\xBFx_mm,y_mm,z_mm\r\n1, 2,+3\r\n4,5,6\r\n\r\n", "a.csv", points_header);
    ASSERT_EQ(rows.size(), 2u);
    EXPECT_EQ(rows[0], (std::vector<double>{1, 2, 3}));
    EXPECT_EQ(parse_csv("x_mm,y_mm,z_mm", "a.csv", points_header).size(), 0u);
}

TEST(Csv, RefusalsNameLineAndColumn) {
    const std::string header = "x_mm,y_mm,z_mm\n";
    EXPECT_EQ(points_refusal("x,y,z\n"),
              "a.csv:1:1: 'x,y,z' was found; expected the header 'x_mm,y_mm,z_mm'");
    EXPECT_EQ(points_refusal(header + "1,2,3\n4,five,6\n"),
              "a.csv:3:3: 'five' was found; expected a finite number");
    EXPECT_EQ(points_refusal(header + "1,2,inf\n"), "a.csv:2:5: 'inf' was found; expected a finite number");
    EXPECT_EQ(points_refusal(header + "1,,3\n"), "a.csv:2:3: '' was found; expected a finite number");
    EXPECT_EQ(points_refusal(header + "1,2\n"), "a.csv:2:4: the row ends after 2 numbers; expected 3");
    EXPECT_EQ(points_refusal(header + "1,2,3,4\n"), "a.csv:2:7: '4' is one column too many; expected 3");
    EXPECT_EQ(points_refusal(header + "1,2,3\n\n4,5,6\n"),
              "a.csv:3:1: '' was found; expected a finite number");
    test::expect_refusal([] { load_points("/nowhere.csv"); }, "/nowhere.csv: no such file");
}

TEST(Csv, NoWordBeginsAsAFormula) {
    std::string text;
    const std::vector<CsvCell> row = {std::string("=cmd|'/c calc'!A1"),
                                      std::string("+1+1"),
                                      std::string("@SUM(1)"),
                                      std::string("-2,5"),
                                      std::string("\tx"),
                                      std::string("a=b"),
                                      -2.5};
    append_row(text, row);
    EXPECT_EQ(text, "'=cmd|'/c calc'!A1,'+1+1,'@SUM(1),\"'-2,5\",'\tx,a=b,-2.5\n");
}

}  // namespace io
