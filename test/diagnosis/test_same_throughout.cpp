// SPDX-License-Identifier: BSD-3-Clause
// A play that changes within the record is none that an interval could hold.
#include <gtest/gtest.h>

#include <cmath>

#include "../../src/diagnosis/refusal.h"
#include "../../src/diagnosis/same_throughout.h"
#include "backlash_diagnosis/base/random.h"

namespace backlash::diagnosis {
namespace {

constexpr int kPassages = 60;

/// Plays of passages with noise of 5 % of 1, of which those from `from` to before `to` are `changed`.
std::vector<double> plays(int from, int to, double changed) {
  Random random(1);
  std::vector<double> all;
  for (int i = 0; i < kPassages; ++i)
    all.push_back((i >= from && i < to ? changed : 1) * (1 + 0.05 * random.normal()));
  return all;
}

TEST(SameThroughout, RefusesAPlayThatStepsGrowsOrComesBack) {
  EXPECT_NO_THROW(require_same_throughout(plays(0, 0, 1), 0.02));
  EXPECT_THROW(require_same_throughout(plays(15, kPassages, 1.5), 0.02), Refusal);
  EXPECT_THROW(require_same_throughout(plays(36, kPassages, 1.5), 0.02), Refusal);
  EXPECT_THROW(require_same_throughout(plays(15, 45, 0.5), 0.02), Refusal);
  std::vector<double> grows = plays(0, 0, 1);
  for (int i = 0; i < kPassages; ++i) grows[i] *= 1 + 0.01 * i;  // the halves are 30 % apart
  EXPECT_THROW(require_same_throughout(grows, 0.02), Refusal);
}

TEST(SameThroughout, LeavesWhatTheIntervalHoldsAndTooFew) {
  EXPECT_NO_THROW(require_same_throughout(plays(30, kPassages, 1.5), 0.25));
  EXPECT_NO_THROW(require_same_throughout(plays(30, kPassages, 1.07), 0.001));  // less than a tenth
  const std::vector<double> few = plays(5, 10, 2);
  EXPECT_NO_THROW(require_same_throughout({few.begin(), few.begin() + 10}, 0.02));
  EXPECT_NO_THROW(require_same_throughout({}, 0.02));
}

}  // namespace
}  // namespace backlash::diagnosis
