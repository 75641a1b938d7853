// SPDX-License-Identifier: BSD-3-Clause
// What is reported of looks whose findings the test writes down.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/diagnosis/change_ledger.h"
#include "backlash_diagnosis/diagnosis/change_log.h"

namespace backlash::diagnosis {
namespace {

constexpr double kStart = 1.7e9;  // s since 1970

FoundChange coulomb(double since, double size, double error = 0.02) {
  FoundChange c;
  c.effect = "motor_coulomb";
  c.since = kStart + since;
  c.since_from = c.since - 1;
  c.since_to = c.since + 1;
  c.size = {{"motor_coulomb", "N m", size, error}};
  c.gain = 1000;
  return c;
}

ChangeLook look(double to, std::vector<FoundChange> changes, std::vector<std::string> different = {}) {
  ChangeLook l;
  l.from = kStart + to - 300;
  l.to = kStart + to;
  l.windows = 10;
  l.changes = std::move(changes);
  l.different = std::move(different);
  return l;
}

TEST(ChangeLedger, ReportsAChangeOnceAndWhenASecondLookFindsIt) {
  ChangeLedger ledger;
  EXPECT_TRUE(ledger.take(look(1000, {coulomb(950, 0.6)})).empty());
  EXPECT_TRUE(ledger.reported().empty());
  EXPECT_EQ(ledger.take(look(1060, {coulomb(950.5, 0.6)})), std::vector<long>{1});
  EXPECT_TRUE(ledger.take(look(1120, {coulomb(950, 0.6)})).empty());
  ASSERT_EQ(ledger.reported().size(), 1u);
  EXPECT_EQ(ledger.reported().front().state, ChangeState::standing);
  // It leaves the stretch and still stands.
  for (int to = 1300; to < 5000; to += 60) EXPECT_TRUE(ledger.take(look(to, {}, {"motor_coulomb"})).empty());
  EXPECT_EQ(ledger.reported().front().state, ChangeState::standing);
  EXPECT_TRUE(ledger.unexplained_difference().empty());
}

TEST(ChangeLedger, ReportsWhatBecomesSharper) {
  ChangeLedger ledger;
  ledger.take(look(1000, {coulomb(950, 0.6, 0.05)}));
  ledger.take(look(1060, {coulomb(950, 0.6, 0.05)}));
  FoundChange sharper = coulomb(950, 0.58, 0.02);
  sharper.gain = 3000;
  EXPECT_EQ(ledger.take(look(1120, {sharper})), std::vector<long>{1});
  EXPECT_EQ(ledger.change(1).found.size.front().value, 0.58);
  FoundChange renamed = sharper;
  renamed.effect = "load_dependent_friction";
  renamed.gain = 4000;
  EXPECT_EQ(ledger.take(look(1180, {renamed})), std::vector<long>{1});
  EXPECT_EQ(ledger.reported().size(), 1u);
  EXPECT_EQ(ledger.change(1).found.effect, "load_dependent_friction");
}

TEST(ChangeLedger, ForgetsWhatOnlyOneLookFound) {
  ChangeLedger ledger;
  ledger.take(look(1000, {coulomb(950, 0.6)}));
  ledger.take(look(1060, {}));
  EXPECT_TRUE(ledger.take(look(1120, {coulomb(950, 0.6)})).empty());
  EXPECT_TRUE(ledger.reported().empty());
  ledger.restart();  // the clock was set between two looks
  EXPECT_TRUE(ledger.take(look(1180, {coulomb(950, 0.6)})).empty());
}

TEST(ChangeLedger, WithdrawsWhatLaterLooksDoNotFind) {
  ChangeLedger ledger;
  ledger.take(look(1000, {coulomb(950, 0.6)}));
  ledger.take(look(1010, {coulomb(950, 0.6)}));
  EXPECT_TRUE(ledger.take(look(1020, {})).empty());
  EXPECT_TRUE(ledger.take(look(1030, {})).empty());
  EXPECT_EQ(ledger.take(look(1040, {})), std::vector<long>{1});
  EXPECT_EQ(ledger.change(1).state, ChangeState::withdrawn);
}

TEST(ChangeLedger, EndsAChangeThatIsUndone) {
  ChangeLedger ledger;
  ledger.take(look(1000, {coulomb(950, 0.6)}));
  ledger.take(look(1060, {coulomb(950, 0.6)}));
  ledger.take(look(3000, {coulomb(2900, -0.61)}, {"motor_coulomb"}));
  EXPECT_EQ(ledger.take(look(3060, {coulomb(2900, -0.61)}, {"motor_coulomb"})), std::vector<long>{1});
  ASSERT_EQ(ledger.reported().size(), 1u);  // the end is no change of its own
  EXPECT_EQ(ledger.reported().front().state, ChangeState::ended);
  EXPECT_EQ(ledger.reported().front().found.until, kStart + 2900);
  // Half of it gone is another change.
  ledger.take(look(9000, {coulomb(8950, 0.6)}));
  ledger.take(look(9060, {coulomb(8950, 0.6)}));
  ledger.take(look(12000, {coulomb(11950, -0.3)}));
  ledger.take(look(12060, {coulomb(11950, -0.3)}));
  EXPECT_EQ(ledger.reported().size(), 3u);
}

// One look sees onset and end; later ones, from which the onset has gone, see the end as a change.
TEST(ChangeLedger, TheEndThatWasReportedIsNoFurtherChange) {
  ChangeLedger ledger;
  FoundChange ended = coulomb(950, 0.6);
  ended.until = kStart + 1030;
  ledger.take(look(1000, {coulomb(950, 0.6)}));
  ledger.take(look(1020, {coulomb(950, 0.6)}));
  EXPECT_EQ(ledger.take(look(1100, {ended})), std::vector<long>{1});
  for (int to = 1260; to < 1330; to += 30)
    EXPECT_TRUE(ledger.take(look(to, {coulomb(1031, -0.6)}, {"motor_coulomb"})).empty());
  ASSERT_EQ(ledger.reported().size(), 1u);
  EXPECT_EQ(ledger.reported().front().state, ChangeState::ended);
  // What falls further than to where it was begins another change.
  ledger.take(look(5000, {coulomb(4950, -0.6)}));
  EXPECT_EQ(ledger.take(look(5060, {coulomb(4950, -0.6)})), std::vector<long>{2});
}

// The machine stood still, or nobody listened, while it was mended.
TEST(ChangeLedger, AnEndThatNoLookSawIsNoLongerSeen) {
  ChangeLedger ledger;
  ledger.take(look(1000, {coulomb(950, 0.6)}));
  ledger.take(look(1060, {coulomb(950, 0.6)}));
  for (int to = 1300; to < 2000; to += 60) EXPECT_TRUE(ledger.take(look(to, {}, {"motor_coulomb"})).empty());
  EXPECT_TRUE(ledger.take(look(5000, {})).empty());
  EXPECT_TRUE(ledger.take(look(5060, {})).empty());
  EXPECT_EQ(ledger.change(1).state, ChangeState::standing);
  EXPECT_EQ(ledger.take(look(5120, {})), std::vector<long>{1});
  EXPECT_EQ(ledger.change(1).state, ChangeState::unseen);
  EXPECT_FALSE(ledger.change(1).found.until);  // when, no look saw
  // It was the motion that did not show it.
  EXPECT_EQ(ledger.take(look(6000, {}, {"motor_coulomb"})), std::vector<long>{1});
  EXPECT_EQ(ledger.change(1).state, ChangeState::standing);
}

TEST(ChangeLedger, WhatIsNoLongerSeenDoesNotComeBackWithAnotherChange) {
  ChangeLedger ledger;
  ledger.take(look(1000, {coulomb(950, 0.6)}));
  ledger.take(look(1060, {coulomb(950, 0.6)}));
  ledger.take(look(1300, {}, {"motor_coulomb"}));
  for (int to = 5000; to < 5200; to += 60) ledger.take(look(to, {}));
  ASSERT_EQ(ledger.change(1).state, ChangeState::unseen);
  ledger.take(look(6000, {coulomb(5950, 0.4)}));
  EXPECT_EQ(ledger.take(look(6060, {coulomb(5950, 0.4)})), std::vector<long>{2});
  EXPECT_TRUE(ledger.take(look(7000, {}, {"motor_coulomb"})).empty());
  EXPECT_EQ(ledger.change(1).state, ChangeState::unseen);
  EXPECT_EQ(ledger.change(2).state, ChangeState::standing);
}

TEST(ChangeLedger, WhatLooksAfterItsOnsetNeverShowedIsNotTakenForGone) {
  ChangeLedger ledger;
  ledger.take(look(1000, {coulomb(950, 0.6)}));
  ledger.take(look(1060, {coulomb(950, 0.6)}));
  for (int to = 1300; to < 5000; to += 60) EXPECT_TRUE(ledger.take(look(to, {})).empty());
  EXPECT_EQ(ledger.change(1).state, ChangeState::standing);
  // Nor do looks that could judge nothing say that it has gone.
  ledger.take(look(5000, {}, {"motor_coulomb"}));
  for (int to = 5300; to < 7000; to += 60) {
    ChangeLook nothing = look(to, {});
    nothing.windows = 0;
    EXPECT_TRUE(ledger.take(nothing).empty());
  }
  EXPECT_EQ(ledger.change(1).state, ChangeState::standing);
}

TEST(ChangeLedger, EndsASineOfOppositePhase) {
  const auto sine = [](double since, double phase) {
    FoundChange c = coulomb(since, 0.2);
    c.effect = "gravity";
    c.size = {{"amplitude", "N m", 0.2, 0.01}, {"phase", "rad", phase, 0.05}};
    return c;
  };
  ChangeLedger ledger;
  ledger.take(look(1000, {sine(950, 3)}));
  ledger.take(look(1060, {sine(950, 3)}));
  ledger.take(look(3000, {sine(2900, 3 - M_PI)}));
  ledger.take(look(3060, {sine(2900, 3 - M_PI)}));
  ASSERT_EQ(ledger.reported().size(), 1u);
  EXPECT_EQ(ledger.reported().front().state, ChangeState::ended);
}

TEST(ChangeLedger, SaysThatTheMachineIsAnotherSinceAnUnknownTime) {
  ChangeLedger ledger;
  for (int i = 0; i < ChangeLedger::kLooksOfDifference; ++i) {
    EXPECT_TRUE(ledger.unexplained_difference().empty());
    ledger.take(look(1000 + 60 * i, {}, {"motor_viscous"}));
  }
  EXPECT_EQ(ledger.unexplained_difference(), std::vector<std::string>{"motor_viscous"});
  ledger.take(look(2000, {}));
  EXPECT_TRUE(ledger.unexplained_difference().empty());
}

TEST(ChangeLedger, RateOfOverlappingLooksAddsUpToWhatWasAskedFor) {
  // 3600 / 60 looks an hour at 300 s each of 4 joints, by hand.
  const double rate = rate_of_look(0.01, 300, 60, 4);
  EXPECT_NEAR(rate * (300.0 / 3600) * (3600.0 / 60) * 4, 0.01, 1e-15);
  EXPECT_EQ(rate_of_look(0.01, 60, 300, 1), 0.01);  // looks that do not overlap
  EXPECT_THROW(rate_of_look(0, 300, 60, 4), InvalidParameter);
}

TEST(ChangeLog, ComesBackAsItWas) {
  const ScratchFolder scratch;
  const std::string path = scratch.path("joint_changes.csv");
  EXPECT_TRUE(read_change_log(path).empty());
  KnownChange k;
  k.id = 3;
  k.state = ChangeState::standing;
  k.found = coulomb(950, 0.6);
  k.found.equivalent_to = {"a", "b"};
  k.found.error_after = kNaN;
  append_change(path, k);
  k.state = ChangeState::ended;
  k.found.until = kStart + 1000.25;
  append_change(path, k);
  std::vector<KnownChange> back = read_change_log(path);
  ASSERT_EQ(back.size(), 1u);
  EXPECT_EQ(back[0].id, 3);
  EXPECT_EQ(back[0].state, ChangeState::ended);
  EXPECT_EQ(back[0].found.until, k.found.until);
  EXPECT_EQ(back[0].found.since, k.found.since);
  EXPECT_EQ(back[0].found.equivalent_to, k.found.equivalent_to);
  ASSERT_EQ(back[0].found.size.size(), 1u);
  EXPECT_EQ(back[0].found.size[0].unit, "N m");
  EXPECT_EQ(back[0].found.size[0].value, 0.6);
  EXPECT_TRUE(std::isnan(back[0].found.error_after));
  // Ids go on where they ended.
  ChangeLedger ledger;
  ledger.restore(back);
  ledger.take(look(5000, {coulomb(4950, 0.6)}));
  EXPECT_EQ(ledger.take(look(5060, {coulomb(4950, 0.6)})), std::vector<long>{4});
}

TEST(ChangeLog, LeavesOutALineThatWasCutOffAndRefusesAnotherFile) {
  const ScratchFolder scratch;
  const std::string path = scratch.path("joint_changes.csv");
  KnownChange k;
  k.id = 1;
  k.state = ChangeState::standing;
  k.found = coulomb(950, 0.6);
  append_change(path, k);
  std::ofstream(path, std::ios::app) << "1700000000,2023-11-14T22:13:20Z,2,stan";
  EXPECT_EQ(read_change_log(path).size(), 1u);
  k.id = 2;
  append_change(path, k);
  EXPECT_EQ(read_change_log(path).size(), 2u);
  std::ofstream(path, std::ios::app) << "x,y,3,standing,e,1,1,1,,,,1,1,1,\n";
  EXPECT_THROW(read_change_log(path), BadData);
  std::ofstream(scratch.path("other.csv")) << "time,date\n";
  EXPECT_THROW(read_change_log(scratch.path("other.csv")), BadData);
}

}  // namespace
}  // namespace backlash::diagnosis
