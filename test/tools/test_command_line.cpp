// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "tools/common/command_line.h"
#include "tools/common/progress_bar.h"

namespace backlash::tools {
namespace {

Command command() {
  Command c;
  c.name = "saw";
  c.summary = "Saws.";
  c.positional = {"WOOD"};
  c.options = {
      {"length", "M", "length [m]", true}, {"count", "N", "pieces; default: 1"}, {"dry", "", "no oil"}};
  c.examples = {"saw oak --length 2"};
  c.exit_codes = "  0   done\n";
  return c;
}

Arguments parse(const std::vector<std::string>& words) {
  return parse_arguments(command(), words);
}

std::string complaint(const std::vector<std::string>& words) {
  try {
    const Arguments arguments = parse(words);
    arguments.number("length", 0, Range::positive());
    arguments.integer("count", 1, 1, 9);
  } catch (const UsageError& e) {
    return e.what();
  }
  return "";
}

TEST(CommandLine, ReadsOptionsInAnyOrderAndBothSpellings) {
  const Arguments arguments = parse({"--length=2e-3", "oak", "--count", "3"});
  EXPECT_EQ(arguments.positional(0), "oak");
  EXPECT_EQ(arguments.number("length", 0, Range::positive()), 2e-3);
  EXPECT_EQ(arguments.integer("count", 1, 1, 9), 3u);
}

TEST(CommandLine, AbsentOptionIsTheFallback) {
  const Arguments arguments = parse({"oak", "--length", "1"});
  EXPECT_FALSE(arguments.has("count"));
  EXPECT_EQ(arguments.integer("count", 7, 1, 9), 7u);
  EXPECT_EQ(arguments.text("count"), "");
}

TEST(CommandLine, AnOptionWithoutValueIsGivenOrNot) {
  EXPECT_TRUE(parse({"oak", "--dry", "--length", "1"}).has("dry"));
  EXPECT_FALSE(parse({"oak", "--length", "1"}).has("dry"));
  EXPECT_NE(complaint({"oak", "--length", "1", "--dry=yes"}).find("--dry"), std::string::npos);
}

TEST(CommandLine, AnOptionWithDotsTakesSeveralValues) {
  Command c = command();
  c.positional.clear();
  c.options.push_back({"sort", "NAME...", "of wood", true});
  const auto sorts = [&c](const std::vector<std::string>& words) {
    return parse_arguments(c, words).texts("sort");
  };
  using Sorts = std::vector<std::string>;
  EXPECT_EQ(sorts({"--sort", "oak", "ash", "--length", "1"}), (Sorts{"oak", "ash"}));
  EXPECT_EQ(sorts({"--sort", "oak", "--length", "1", "--sort", "ash"}), (Sorts{"oak", "ash"}));
  EXPECT_EQ(sorts({"--length", "1", "--sort=oak"}), Sorts{"oak"});
  EXPECT_THROW(sorts({"--length", "1"}), UsageError);
  EXPECT_THROW(sorts({"--length", "1", "--sort"}), UsageError);
  EXPECT_THROW(sorts({"--length", "1", "--sort", "oak", ""}), UsageError);
  EXPECT_NE(help_text(c).find("--sort NAME..."), std::string::npos);
}

TEST(CommandLine, ComplaintsNameOptionValueAndLimit) {
  const std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>> cases = {
      {{"--length", "1"}, {"WOOD"}},
      {{"oak"}, {"--length"}},
      {{"oak", "ash", "--length", "1"}, {"ash"}},
      {{"", "--length", "1"}, {"WOOD", "empty"}},
      {{"oak", "--length", ""}, {"--length", "empty"}},
      {{"oak", "--length"}, {"--length"}},
      {{"oak", "--length", "0"}, {"--length", "'0'", "> 0"}},
      {{"oak", "--length", "-1"}, {"--length", "'-1'", "> 0"}},
      {{"oak", "--length", "1m"}, {"--length", "'1m'", "not a number"}},
      {{"oak", "--length", "nan"}, {"--length", "finite"}},
      {{"oak", "--length", "0x10"}, {"--length", "not a number"}},
      {{"oak", "--length", "1", "--length", "2"}, {"--length"}},
      {{"oak", "--len", "1"}, {"--len"}},
      {{"oak", "--length", "1", "--depth", "1"}, {"--depth"}},
      {{"oak", "--length", "1", "-x"}, {"-x"}},
      {{"oak", "--length", "1", "--count", "10"}, {"--count", "'10'", "1 to 9"}},
      {{"oak", "--length", "1", "--count", "2.5"}, {"--count", "'2.5'", "whole"}},
      {{"oak", "--length", "1", "--count", "99999999999999999999"}, {"--count", "whole"}},
  };
  for (const auto& [words, parts] : cases) {
    const std::string text = complaint(words);
    for (const std::string& part : parts)
      EXPECT_NE(text.find(part), std::string::npos) << text << " lacks " << part;
    EXPECT_FALSE(text.empty());
  }
}

TEST(CommandLine, HelpNamesEverythingWithinThePage) {
  const std::string help = help_text(command());
  for (const char* part :
       {"Usage: saw WOOD --length M [--count N] [--dry]", "Saws.", "length [m]", "default: 1", "--help",
        "--version", "saw oak --length 2", "0   done", "64", "65", "66", "70", "73"})
    EXPECT_NE(help.find(part), std::string::npos) << help << " lacks " << part;
}

// Test runners have no terminal on standard error; with one there is nothing to see here.
TEST(ProgressBar, IsSilentWithoutATerminal) {
  testing::internal::CaptureStderr();
  {
    ProgressBar bar;
    EXPECT_FALSE(bar.progress());
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace backlash::tools
