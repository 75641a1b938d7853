// SPDX-License-Identifier: BSD-3-Clause
// Histories: what was written once is there, whatever happens to the writer, the disk or the file.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "backlash_diagnosis/diagnosis/history.h"
#include "history_test.h"

namespace {

/// Sees what is asked of the disk; its result is fsync's. Empty: the system's own.
std::function<int(int descriptor)> on_fsync;

}  // namespace

/// In the place of the C library's, also for the library under test.
extern "C" int fsync(int descriptor) {
  return on_fsync ? on_fsync(descriptor) : static_cast<int>(::syscall(SYS_fsync, descriptor));
}

namespace backlash::diagnosis {
namespace {

/// A lower limit for the size of files, as a full disk sets one.
class FullDisk {
 public:
  explicit FullDisk(std::uintmax_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = ::signal(SIGXFSZ, SIG_IGN);
    struct rlimit small = before_;
    small.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, handler_);
  }

 private:
  struct rlimit before_ {};
  void (*handler_)(int);
};

class FsyncSeen {
 public:
  explicit FsyncSeen(std::function<int(int)> seen) { on_fsync = std::move(seen); }
  ~FsyncSeen() { on_fsync = nullptr; }
};

TEST_F(HistoryTest, AnEntryIsOnTheDiskBeforeItCountsAsWritten) {
  History h = history();
  std::string at_sync;
  {
    const FsyncSeen seen([&](int) {
      at_sync = content();
      return 0;
    });
    h.append(entry(1));
  }
  EXPECT_EQ(at_sync, content());  // whole by then, and nothing was written after it
  expect_entries({1});
}

TEST_F(HistoryTest, AnEntryThatTheDiskRefusesIsNotWritten) {
  History h = history();
  {
    const FsyncSeen seen([](int) {
      errno = EIO;
      return -1;
    });
    expect_refusal<CannotWrite>([&] { h.append(entry(1)); }, "Input/output error");
  }
  expect_entries({});
  h.append(entry(1));
  expect_entries({1});
}

TEST_F(HistoryTest, EntriesComeBackAsTheyWere) {
  HistoryEntry full = entry(1);
  full.event = kBaselineEvent;
  full.grade = "cannot_tell";
  full.backlash_angle = 1.0 / 3e3;
  full.angle_lower = -1e-300;
  full.angle_upper = 5e-3;
  full.skewness = -0.123456789012345678;
  HistoryEntry empty;
  empty.time = 1234.5;
  empty.grade = "stop";
  {
    History history(this->history());
    history.append(full);
    history.append(empty);
  }
  const HistoryFile file = read_history(path());
  ASSERT_EQ(file.entries.size(), 2u);
  expect_same(file.entries[0], full);
  expect_same(file.entries[1], empty);
  EXPECT_TRUE(file.warnings.empty());
  EXPECT_EQ(content().substr(content().rfind("1234.5")),
            "1234.5,1970-01-01T00:20:34Z,estimate,stop,,,,,,,,,\"\"\n");
}

TEST_F(HistoryTest, AnEntryHoldsTheVerdictAndTheSkewness) {
  Diagnosis diagnosis;
  for (const char* method : {"apd_skewness", "apd_shape", "lost_motion"}) {
    Estimate estimate;
    estimate.method = method;
    estimate.skewness = diagnosis.estimates.empty() ? 0.25 : kNaN;
    diagnosis.estimates.push_back(estimate);
  }
  Verdict& verdict = diagnosis.verdict;
  verdict.grade = Grade::service;
  verdict.members = {2, 1};
  verdict.backlash = 1, verdict.lower = 2, verdict.upper = 3;
  verdict.backlash_angle = 4, verdict.angle_lower = 5, verdict.angle_upper = 6;
  HistoryEntry expected;
  expected.time = 7;
  expected.grade = "service";
  expected.backlash = 1, expected.lower = 2, expected.upper = 3;
  expected.backlash_angle = 4, expected.angle_lower = 5, expected.angle_upper = 6;
  expected.skewness = 0.25;
  expected.methods = "lost_motion+apd_shape";
  expected.rig_digest = "abc";
  expect_same(history_entry(7, diagnosis, "abc"), expected);
}

TEST_F(HistoryTest, RefusesWhatCouldNotBeReadBack) {
  History history(this->history());
  HistoryEntry wrong = entry(1);
  wrong.methods = "a,b";
  EXPECT_THROW(history.append(wrong), InvalidParameter);
  wrong = entry(1);
  wrong.time = kNaN;
  EXPECT_THROW(history.append(wrong), InvalidParameter);
  wrong = entry(1);
  wrong.grade = "fine";
  EXPECT_THROW(history.append(wrong), InvalidParameter);
  wrong = entry(1);
  wrong.event = "";
  EXPECT_THROW(history.append(wrong), InvalidParameter);
  expect_entries({});
}

TEST_F(HistoryTest, SaysWhyItCannotBeOpened) {
  expect_refusal<CannotWrite>([&] { History({path("none/elbow.csv")}); },
                              "none/elbow.csv: cannot be written: No such file");
  expect_refusal<CannotWrite>([&] { History({folder_.string()}); }, "Is a directory");
  expect_refusal<CannotWrite>([&] { History({""}); }, "no file name");
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  expect_refusal<CannotWrite>([&] { History({path("pipe")}); }, "is no regular file");
  expect_refusal<MissingInput>([&] { read_history(path()); }, "elbow.csv: cannot be opened: No such file");
  const std::string foreign = "time,motor_torque\n0,1\n";
  put(foreign);
  expect_refusal<BadData>([&] { history(); },
                          "elbow.csv: is no history of estimates: it begins with 'time,motor_");
  expect_refusal<BadData>([&] { read_history(path()); }, "is no history of estimates");
  EXPECT_EQ(content(), foreign);
}

TEST_F(HistoryTest, OneWriterOnly) {
  {
    History first(history());
    expect_refusal<CannotWrite>([&] { history(); }, "another process writes this history");
    History moved(std::move(first));
    moved.append(entry(1));
  }
  history().append(entry(2));
  expect_entries({1, 2});
}

TEST_F(HistoryTest, LinesThatWereCutOffAreEndedAndLeftOut) {
  history().append(entry(1));
  const std::string whole = content();
  const std::size_t header = whole.find('\n') + 1;
  for (std::size_t length = 0; length <= whole.size(); length += length + 4 < whole.size() ? 3 : 1) {
    put(whole.substr(0, length));
    const bool has_all = length >= whole.size() - 1;  // but perhaps for its newline
    if (length > 0) read_history(path());             // does not throw
    history().append(entry(2));
    EXPECT_EQ(content().substr(0, length), whole.substr(0, length));
    const bool damaged = length > header && !has_all;
    expect_entries(has_all ? std::vector<int>{1, 2} : std::vector<int>{2}, damaged ? 1 : 0);
    if (HasFailure()) FAIL() << "cut after " << length;
  }
}

TEST_F(HistoryTest, DamagedLinesAreNamedAndLeftOut) {
  {
    History history(this->history());
    for (int i = 0; i < 3; ++i) history.append(entry(i));
  }
  const std::string whole = content();
  const std::size_t second = whole.find("1800000000.1");
  Random random(1);
  const auto spoil = [&](const std::string& by) {
    std::string text = whole;
    put(text.replace(second + 3, by.size(), by));
  };
  for (const std::string& by :
       {std::string(20, '\0'), std::string("x"), std::string("\n\n"), std::string(",")}) {
    spoil(by);
    const HistoryFile file = read_history(path());
    ASSERT_GE(file.entries.size(), 2u);
    expect_same(file.entries.front(), entry(0));
    expect_same(file.entries.back(), entry(2));
    ASSERT_FALSE(file.warnings.empty());
    EXPECT_NE(file.warnings[0].find("elbow.csv:3: "), std::string::npos) << file.warnings[0];
  }
  // Wherever bytes flip, the lines before and after are there.
  for (int trial = 0; trial < 300; ++trial) {
    std::string text = whole;
    const std::size_t place = second + random.below(text.find('\n', second) - second);
    text[place] = static_cast<char>(text[place] ^ (1 << random.below(8)));
    put(text);
    const HistoryFile file = read_history(path());
    ASSERT_GE(file.entries.size(), 2u);
    expect_same(file.entries.front(), entry(0));
    expect_same(file.entries.back(), entry(2));
  }
}

TEST_F(HistoryTest, AFileSavedByAnEditorOfAnotherSystemIsRead) {
  history().append(entry(1));
  std::string text;
  for (const char c : content()) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
  put(text);
  expect_entries({1});
}

TEST_F(HistoryTest, RotatesWithoutLosingAnything) {
  std::vector<int> numbers;
  {
    History history(this->history(1000));
    for (int i = 0; i < 60; ++i) {
      history.append(entry(i));
      numbers.push_back(i);
    }
  }
  ASSERT_TRUE(fs::exists(path("elbow.csv.10")));  // which comes after .9, not after .1
  for (const auto& file : fs::directory_iterator(folder_)) EXPECT_LE(fs::file_size(file), 1000u);
  expect_entries(numbers);
  // A number that is taken is never used again, and strange names are none.
  std::ofstream(path("elbow.csv.0300")) << "foreign";
  std::ofstream(path("elbow.csv.old")) << "foreign";
  fs::rename(path("elbow.csv.10"), path("elbow.csv.200"));
  const std::string kept = content("elbow.csv.200");
  {
    History history(this->history(1000));
    for (int i = 60; i < 70; ++i) history.append(entry(i));
  }
  EXPECT_TRUE(fs::exists(path("elbow.csv.201")));
  EXPECT_EQ(content("elbow.csv.200"), kept);
  EXPECT_EQ(read_history(path()).entries.size(), 70u);
  // Killed between two parts: the history is what was rotated.
  fs::remove(path());
  EXPECT_GT(read_history(path()).entries.size(), 50u);
}

TEST_F(HistoryTest, AnEntryLargerThanAPartIsWrittenAllTheSame) {
  History history(this->history(1));
  for (int i = 0; i < 3; ++i) history.append(entry(i));
  expect_entries({0, 1, 2});
}

TEST_F(HistoryTest, AFullDiskLeavesNoHalfLineAndCanBeTriedAgain) {
  History history(this->history());
  history.append(entry(1));
  const std::string before = content();
  for (std::size_t room = 0; room < 100; room += 9) {
    const FullDisk full(before.size() + room);
    expect_refusal<CannotWrite>([&] { history.append(entry(2)); },
                                "elbow.csv: cannot be written: File too large");
    EXPECT_EQ(content(), before);
  }
  history.append(entry(2));
  expect_entries({1, 2});
}

TEST_F(HistoryTest, AFullDiskAtTheRotationCanBeTriedAgain) {
  History history(this->history(400));
  history.append(entry(1));
  {
    const FullDisk full(10);
    EXPECT_THROW(history.append(entry(2)), CannotWrite);
    EXPECT_THROW(history.append(entry(2)), CannotWrite);
  }
  history.append(entry(2));
  expect_entries({1, 2});
}

TEST_F(HistoryTest, AFileThatWasMovedAwayIsBegunAnew) {
  History history(this->history());
  history.append(entry(1));
  fs::rename(path(), path("archive.csv"));
  history.append(entry(2));
  fs::remove(path());
  history.append(entry(3));
  expect_entries({3});
  EXPECT_EQ(read_history(path("archive.csv")).entries.size(), 1u);
  fs::rename(folder_, folder_.string() + "_away");
  EXPECT_THROW(history.append(entry(4)), CannotWrite);
  fs::rename(folder_.string() + "_away", folder_);
  history.append(entry(4));
  expect_entries({3, 4});
}

TEST_F(HistoryTest, BehindALinkTheFileItselfIsRotated) {
  fs::create_directory(folder_ / "real");
  std::ofstream(path("real/elbow.csv")).close();
  fs::create_symlink("real/elbow.csv", path());
  {
    History history(this->history(400));
    for (int i = 0; i < 4; ++i) history.append(entry(i));
  }
  EXPECT_TRUE(fs::is_symlink(path()));
  EXPECT_TRUE(fs::exists(path("real/elbow.csv.1")));
  EXPECT_EQ(read_history(path("real/elbow.csv")).entries.size(), 4u);
}

}  // namespace
}  // namespace backlash::diagnosis
