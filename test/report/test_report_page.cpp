// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>

#include "backlash_diagnosis/report/report_page.h"

namespace backlash::report {
namespace {

TEST(ReportPage, AShellReadsTheWordsOfACommandAsTheyWere) {
  const std::vector<std::string> words = {
      "plain/path-1.csv", "with space", "it's",   "$(false) `false`", "a\"b\\", "", "*",
      "new\nline",        "~",          "<&>;|#!"};
  // A shell gets the line with its own `rosrun`, which gives each word back in brackets.
  const std::string line = "rosrun() { printf '[%s]' \"$@\"; }\n" + shell_command(words);
  std::FILE* file = std::tmpfile();
  ASSERT_NE(file, nullptr);
  std::fputs(line.c_str(), file);
  std::fflush(file);
  std::FILE* shell = ::popen(
      ("bash /proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(::fileno(file))).c_str(), "r");
  ASSERT_NE(shell, nullptr);
  std::string read;
  for (int c; (c = std::fgetc(shell)) != EOF;) read += char(c);
  EXPECT_EQ(::pclose(shell), 0);
  std::fclose(file);
  std::string expected = "[backlash_diagnosis]";
  for (const std::string& word : words) expected += "[" + word + "]";
  EXPECT_EQ(read, expected);
}

TEST(ReportPage, NothingFromFilesIsTakenForHtml) {
  const std::string evil = "<script>alert(\"x\")</script>";
  Provenance provenance;
  provenance.command = {"diagnose_record", evil};
  provenance.files = {{"record", evil}};
  provenance.rig_source = provenance.rig_text = provenance.seeds = evil;
  const std::string page = report_page(evil, provenance_sections(provenance));
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_NE(page.find("&lt;script&gt;alert(&quot;x&quot;)"), std::string::npos);
  EXPECT_NE(page.find("not there any more"), std::string::npos);
}

TEST(ReportPage, SaysWhyThereAreNoFigures) {
  EXPECT_NE(drawn_figures("no_such_script.py", {}).find("No plots were drawn: cannot run"),
            std::string::npos);
}

}  // namespace
}  // namespace backlash::report
