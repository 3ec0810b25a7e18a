#include "engine/studies/templates.h"

#include <gtest/gtest.h>
#include <stdexcept>

namespace {

using studies::fill;

TEST(Templates, PlaceholdersTakeNumbersAndTextByTheirFormat) {
    EXPECT_EQ(
        fill("@n@ of @x:.2f@ @unit@, @x@: 10^{-3}", {{"n", 3}, {"x", 0.125}, {"unit", std::string("mm")}}),
        "3 of 0.12 mm, 0.125: 10^{-3}");
    EXPECT_EQ(fill("@axis@@n:03d@", {{"axis", 'x'}, {"n", 7u}}), "x007");
    EXPECT_EQ(fill("", {}), "");
}

TEST(Templates, ValuesAreNotReadForPlaceholders) {
    EXPECT_EQ(fill("@a@", {{"a", "@b@"}}), "@b@");
}

TEST(Templates, MissingAndUnusedValuesThrow) {
    EXPECT_THROW(fill("@a@ @b@", {{"a", 1}}), std::logic_error);
    EXPECT_THROW(fill("@a@", {{"a", 1}, {"b", 2}}), std::logic_error);
    EXPECT_THROW(fill("100 @a", {{"a", 1}}), std::logic_error);
    EXPECT_THROW(studies::filled_text("no such file", {}), std::logic_error);
}

TEST(Templates, PartsAreRepeatedForRows) {
    const studies::TemplateRows methods = {{{"method", "A"}}, {{"method", "B"}}};
    EXPECT_EQ(
        fill("plot @for methods@'@table@' title '@method@'@end@;", {{"table", "t"}, {"methods", methods}}),
        "plot 't' title 'A', \\\n     't' title 'B';");
    EXPECT_EQ(fill("@for tubes@@n@: @for methods@@method@@n@@end@\n@end@",
                   {{"methods", methods}, {"tubes", studies::TemplateRows{{{"n", 1}}, {{"n", 2}}}}}),
              "1: A1, \\\n     B1\n2: A2, \\\n     B2\n");
    EXPECT_EQ(fill("[@for none@@x@@end@]", {{"none", studies::TemplateRows{}}}), "[]");
    EXPECT_THROW(fill("@for methods@@end@", {{"methods", methods}}), std::logic_error);
    EXPECT_THROW(fill("@for methods@@method@", {{"methods", methods}}), std::logic_error);
    EXPECT_THROW(fill("@methods@", {{"methods", methods}}), std::logic_error);
    EXPECT_THROW(fill("@for a@@end@", {}), std::logic_error);
}

TEST(Templates, PlotTakesItsCaptionFromTheScriptsFirstComment) {
    const io::Plot plot =
        studies::filled_plot("pair_relaxation_traces", 900, 420, {{"scene", "scene sharp"}});
    EXPECT_EQ(plot.name, "pair_relaxation_traces");
    EXPECT_EQ(plot.width, 900);
    EXPECT_EQ(plot.height, 420);
    EXPECT_TRUE(plot.caption.starts_with("Size of the two second-order terms along a wire at rest"));
    EXPECT_TRUE(plot.caption.ends_with("between the first and the last R): scene sharp."));
    EXPECT_TRUE(plot.commands.starts_with("set grid lc rgb '#dddddd'\nset logscale y\n"));
    EXPECT_TRUE(plot.commands.ends_with("title 'Tr A_i, bending'\n"));
}

TEST(Templates, LineOfTextGoesOnAfterABackslash) {
    const std::string text = studies::filled_text("imaging_wire", {{"table", "TABLE"}});
    EXPECT_EQ(text.find('\\'), std::string::npos);
    EXPECT_TRUE(
        text.starts_with("## Wire\n\nTransmission of a bent wire of 0.89 mm, solid, at the energies of the "
                         "bins, against 8 × 8 rays a pixel"));
    EXPECT_TRUE(text.ends_with("transmission.\n\nTABLE"));
}

}  // namespace
