#include "engine/io/text.h"

#include <array>
#include <cmath>
#include <gtest/gtest.h>

namespace io {

TEST(Text, NumbersReadBackToTheSameBits) {
    for (const double number : {0.1, 1.0 / 3.0, -1e-300, 5e-324, 1.7976931348623157e308, 12345678.9}) {
        EXPECT_EQ(parse_number(number_text(number)), number);
    }
    EXPECT_EQ(number_text(30.0), "30");
}

TEST(Text, RoundedNumbersHaveNoExponent) {
    EXPECT_EQ(rounded_text(246.3), "250");
    EXPECT_EQ(rounded_text(2794), "2800");
    EXPECT_EQ(rounded_text(9.96), "10");
    EXPECT_EQ(rounded_text(0.996), "1.0");
    EXPECT_EQ(rounded_text(-1.949), "-1.9");
    EXPECT_EQ(rounded_text(0.000423), "0.00042");
    EXPECT_EQ(rounded_text(1e-14), "0");
    EXPECT_EQ(rounded_text(0), "0");
    EXPECT_EQ(rounded_text(123.456, 4), "123.5");
}

TEST(Text, OnlyAWholeWordIsANumber) {
    EXPECT_FALSE(parse_number("5mm"));
    EXPECT_FALSE(parse_number(""));
    EXPECT_FALSE(parse_number("0,5"));
    EXPECT_FALSE(parse_integer("3.0"));
    EXPECT_EQ(parse_number("+2.5"), 2.5);
}

TEST(Text, HashesAreSixteenDigitsAndReadBack) {
    EXPECT_EQ(hash_text(0x1234abcdull), "000000001234abcd");
    EXPECT_EQ(parse_hash("000000001234abcd"), 0x1234abcdull);
    EXPECT_EQ(parse_hash(hash_text(~0ull)), ~0ull);
    EXPECT_FALSE(parse_hash("1234abcd"));
    EXPECT_FALSE(parse_hash("000000001234abcg"));
}

TEST(Text, NearestWordForgivesSlipsOnly) {
    constexpr std::array<std::string_view, 3> words = {"advance", "withdraw", "rotate"};
    EXPECT_EQ(nearest_word("advnce", words), "advance");
    EXPECT_EQ(nearest_word("rot", words), "rotate");
    EXPECT_EQ(nearest_word("fly", words), "");
    EXPECT_EQ(suggestion("rot", words), " (did you mean 'rotate'?)");
    EXPECT_EQ(suggestion("ROTATE", words), " (did you mean 'rotate'?)");
    const std::string_view devices[] = {"cobra4f", "glide035", "cobra5f", "pigtail5f"};
    EXPECT_EQ(suggestion("cobra", devices), " (did you mean 'cobra4f' or 'cobra5f'?)");
    EXPECT_EQ(suggestion("xyz", devices), "");
    EXPECT_EQ(suggestion("fly", words), "");
    constexpr std::array<std::string_view, 2> vessels = {"LM+LAD", "LCX"};
    EXPECT_EQ(nearest_word("LAD", vessels), "LM+LAD");
    EXPECT_EQ(nearest_word("LM", vessels), "LM+LAD");
}

TEST(Text, WhatIsNotUtf8IsReplaced) {
    for (const char* good : {"", "a", "\u00e4", "\u20ac", "\U0001F600", "\u07ff\u0800\uffff\U0010FFFF"}) {
        EXPECT_TRUE(is_utf8(good)) << good;
        EXPECT_EQ(as_utf8(good), good);
    }
    // Latin-1, a lone byte, cut short, too long a form, a surrogate, beyond Unicode.
    for (const char* bad : {"\xc4nna", "\x80", "\xe2\x82", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80",
                            "\xf4\x90\x80\x80", "\xff", "a\xf0\x9f\x98"}) {
        EXPECT_FALSE(is_utf8(bad)) << bad;
        EXPECT_TRUE(is_utf8(as_utf8(bad))) << bad;
    }
    EXPECT_EQ(as_utf8("\xc4nna \u00e4"), "\uFFFDnna \u00e4");
}

}  // namespace io
