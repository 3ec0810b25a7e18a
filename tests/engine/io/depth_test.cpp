#include "engine/io/error.h"
#include "engine/io/text.h"
#include "tests/engine/fixtures.h"

namespace io {
namespace {

std::string repeated(const std::string& text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
}

}  // namespace

TEST(Depth, OfJsonIsLimited) {
    EXPECT_EQ(test::refusal([] { check_json_depth(repeated("[", 64) + repeated("]", 64), "a.json"); }), "");
    EXPECT_EQ(test::refusal([] { check_json_depth(repeated("{\"a\":[]},", 200), "a.json"); }), "");
    EXPECT_EQ(test::refusal([] { check_json_depth("\"" + repeated("[", 100) + "\\\"[" + "\"", "a.json"); }),
              "");
    test::expect_refusal(
        [] { check_json_depth("\n\n" + repeated("[", 100'000), "a.json"); },
        "a.json:3: more than 64 levels, one within another, were found; expected at most 64");
}

TEST(Depth, OfTomlCountsBracketsAndDots) {
    EXPECT_EQ(test::refusal(
                  [] { check_toml_depth("a.b.c = [[1.5, 2.5], [3.5]]\n# " + repeated("[", 100), "a.toml"); }),
              "");
    EXPECT_EQ(test::refusal([] { check_toml_depth(repeated("x = 1.5\n", 500), "a.toml"); }), "");
    EXPECT_EQ(
        test::refusal([] { check_toml_depth("x = \"\"\"" + repeated("[.", 200) + "\n\"\"\"\n", "a.toml"); }),
        "");
    EXPECT_EQ(test::refusal([] { check_toml_depth("x = [" + repeated("1.5, ", 200) + "]", "a.toml"); }), "");
    for (const std::string& deep :
         {repeated("a.", 100'000) + "a = 1\n", "[" + repeated("a.", 100'000) + "a]\n",
          "x = " + repeated("[", 100'000), "\nx = " + repeated("{a=", 100'000),
          repeated("\"a\".", 100'000) + "a = 1"})
        test::expect_refusal([&] { check_toml_depth(deep, "a.toml"); }, "more than 64 levels");
}

TEST(Depth, MessagesAreShortAndWithoutControlCharacters) {
    EXPECT_EQ(printable("a: 5 °C … fine\nb"), "a: 5 °C … fine\nb");
    EXPECT_EQ(printable("\x1b[31mred\a\r\x7f\xc2\x9b"), "?[31mred???\xc2?");
    const std::string one = printable(std::string(3'000'000, 'x'));
    EXPECT_LT(one.size(), 1100u);
    test::expect_said(one, "2999000 bytes more");
    const std::string many = printable(repeated("line\n", 1000));
    test::expect_said(many, "… and 901 lines more");
    EXPECT_EQ(std::string(InputError("a\tb").what()), "a?b");
}

}  // namespace io
