// SPDX-License-Identifier: BSD-3-Clause
// What a writer of a history has written is there, whenever it is killed.
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <functional>
#include <string>
#include <system_error>
#include <vector>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/history.h"
#include "history_test.h"

namespace backlash::diagnosis {
namespace {

/// Appends entries from `first` on, sending each number once append has returned, until it is killed.
[[noreturn]] void write_on(const std::string& path, int first, int pipe) {
  try {
    History history({path, 2000});
    for (int i = first;; ++i) {
      history.append(entry(i));
      if (::write(pipe, &i, sizeof i) != sizeof i) ::_exit(1);
    }
  } catch (...) {
    ::_exit(2);
  }
}

/// Waits until something has happened, for ten seconds at most.
bool happens(const std::function<bool()>& what) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!what())
    if (std::chrono::steady_clock::now() > end) return false;
  return true;
}

/// Waits for one of three moments of the writer: none in particular (0); the file has changed, perhaps before
/// the writer has said so (1); the writer has sent a further number (2).
void await_death(std::uint64_t moment, int pipe, const std::string& path) {
  const auto size = [&] {
    std::error_code none;  // the file may be renamed just now
    return fs::file_size(path, none);
  };
  const auto before = size();
  if (moment == 1) EXPECT_TRUE(happens([&] { return size() != before; }));
  pollfd sent{pipe, POLLIN, 0};
  if (moment == 2) EXPECT_EQ(::poll(&sent, 1, 10'000), 1);
}

TEST_F(HistoryTest, NoKillCostsAnEntryThatWasWritten) {
  Random random(7);
  int next = 0;
  std::vector<int> appended;
  for (int round = 0; round < 40; ++round) {
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) write_on(path(), next, ends[1]);
    ::close(ends[1]);
    const int until = static_cast<int>(random.below(25));  // as many are waited for, then it may die anywhere
    int number = 0;
    for (int i = 0; i < until; ++i) {
      ASSERT_EQ(::read(ends[0], &number, sizeof number), static_cast<ssize_t>(sizeof number));
      appended.push_back(number);
    }
    await_death(random.below(3), ends[0], path());
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << WEXITSTATUS(status);
    while (::read(ends[0], &number, sizeof number) == static_cast<ssize_t>(sizeof number))
      appended.push_back(number);
    ::close(ends[0]);
    // The entry under way when it died may be there or not; its number is not used again.
    next = appended.empty() ? next + 1 : std::max(next, appended.back() + 2);
  }
  history();
  std::vector<int> found;
  for (const HistoryEntry& e : read_history(path()).entries) {
    found.push_back(static_cast<int>(std::lround((e.time - 1.8e9) / 0.1)));
    expect_same(e, entry(found.back()));
  }
  EXPECT_GT(appended.size(), 200u);
  EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
  EXPECT_TRUE(std::includes(found.begin(), found.end(), appended.begin(), appended.end()));
  EXPECT_LE(found.size(), appended.size() + 40);
}

}  // namespace
}  // namespace backlash::diagnosis
