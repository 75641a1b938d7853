// SPDX-License-Identifier: BSD-3-Clause
// Runs the commands of the package as a user would, in a folder of its own that vanishes with the test.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace backlash::test {

struct Outcome {
  int code = -1;  ///< exit code; -1: ended by a signal
  std::string out, err;
};

class CommandTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::path(testing::TempDir()) / "command_XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = std::filesystem::path(pattern);
    std::filesystem::create_directory(folder_ / "work");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// `line` is a command of the package with its arguments, as in a shell; `before` is put in front of it. No
  /// argument may hold a quote.
  Outcome run(const std::string& line, const std::string& before = "") const {
    return shell(before + " '" BACKLASH_DIAGNOSIS_BIN_DIR "'/" + line);
  }

  /// Any line of a shell, in the folder of the test.
  Outcome shell(const std::string& line) const {
    const int status =
        std::system(("cd '" + path("") + "' && " + line + " >../out 2>../err </dev/null").c_str());
    Outcome outcome;
    if (WIFEXITED(status)) outcome.code = WEXITSTATUS(status);
    outcome.out = content((folder_ / "out").string());
    outcome.err = content((folder_ / "err").string());
    return outcome;
  }

  /// Runs a command that must succeed.
  Outcome done(const std::string& line) const {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, 0) << line << "\n" << outcome.err;
    return outcome;
  }

  std::string path(const std::string& name) const { return (folder_ / "work" / name).string(); }

  std::string read(const std::string& name) const { return content(path(name)); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
  }

  bool exists(const std::string& name) const { return std::filesystem::exists(path(name)); }

  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(path("")), std::filesystem::directory_iterator()));
  }

  static std::string content(const std::string& absolute) {
    std::ifstream in(absolute, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

 private:
  std::filesystem::path folder_;
};

inline void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text << "\nlacks: " << part;
}

}  // namespace backlash::test
