// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/text.h"

namespace backlash {
namespace {

TEST(Text, NumbersAreParsedWhole) {
  const struct {
    const char* text;
    double value;
  } cases[] = {{"1", 1},  {"+1.5", 1.5},      {"-.5", -0.5}, {"5.", 5},    {"2e-3", 2e-3},  {"1E+6", 1000000},
               {"-0", 0}, {"1e-320", 1e-320}, {"007", 7},    {"0.1", 0.1}, {"1e308", 1e308}};
  for (const auto& c : cases) {
    const ParsedNumber number = parse_number(c.text);
    EXPECT_TRUE(number) << c.text;
    EXPECT_EQ(number.value, c.value) << c.text;
  }
  EXPECT_TRUE(std::signbit(parse_number("-0").value));
}

TEST(Text, WhatIsNoFiniteNumberIsRefusedWithTheReason) {
  for (const char* text : {"", "+", "-", ".", "e5", "abc", "1.5x", "1 2", " 1", "1 ", "0x10", "1,5", "+-1",
                           "--1", "++1", "1e", "1_000"}) {
    EXPECT_STREQ(parse_number(text).problem, "not a number") << text;
  }
  for (const char* text :
       {"nan", "NaN", "-nan", ".nan", ".NaN", "inf", "-inf", "+Inf", ".inf", "-.INF", "Infinity", "nan(1)"}) {
    EXPECT_STREQ(parse_number(text).problem, "not a finite number") << text;
  }
  for (const char* text : {"1e999", "-1e400"}) {
    EXPECT_STREQ(parse_number(text).problem, "too large or too small for a double") << text;
  }
}

TEST(Text, NumbersSurviveTheirText) {
  for (const double value :
       {0.1, -1.0 / 3, 1e-300, 5e-324, std::numeric_limits<double>::max(), 123456789.125, 0.0}) {
    EXPECT_EQ(parse_number(to_text(value)).value, value);
  }
  EXPECT_EQ(to_text(0.1), "0.1");
  EXPECT_EQ(to_text(-20), "-20");
}

TEST(Text, TrimsSpacesAndTabsOnly) {
  EXPECT_EQ(trimmed(" \t a b\t "), "a b");
  EXPECT_EQ(trimmed("  "), "");
  EXPECT_EQ(trimmed(""), "");
  EXPECT_EQ(trimmed("\n"), "\n");
}

TEST(Text, PrintableEscapesControlsAndBrokenUtf8) {
  EXPECT_EQ(printable("N m/rad"), "N m/rad");
  EXPECT_EQ(printable("a\nb\x1b[0m"),
            "a\\x0a"
            "b\\x1b[0m");
  EXPECT_EQ(printable("\xc2\xb5m \xe2\x82\xac \xf0\x9f\x98\x80"), "\xc2\xb5m \xe2\x82\xac \xf0\x9f\x98\x80");
  EXPECT_EQ(printable("\xff"), "\\xff");
  EXPECT_EQ(printable("\xc2"), "\\xc2");                             // cut off
  EXPECT_EQ(printable("\xc0\x80"), "\\xc0\\x80");                    // overlong
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");           // surrogate
  EXPECT_EQ(printable("\xc2\x9b"), "\\xc2\\x9b");                    // C1 control
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // above U+10FFFF
}

TEST(Text, PrintableIsBounded) {
  EXPECT_EQ(printable("abcdef", 3), "abc...");
  EXPECT_EQ(printable("abc", 3), "abc");
  EXPECT_EQ(printable("\xc2\xb5\xc2\xb5\xc2\xb5", 2), "\xc2\xb5\xc2\xb5...");
}

TEST(Text, JoinsWithCommas) {
  EXPECT_EQ(joined(std::vector<std::string>{"a", "b"}), "a, b");
  EXPECT_EQ(joined(std::vector<std::string>{}), "");
}

}  // namespace
}  // namespace backlash
