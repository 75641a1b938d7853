// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <future>
#include <stdexcept>
#include <thread>
#include <vector>

#include "backlash_diagnosis/base/interruption.h"
#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/ros/background_fits.h"
#include "ros/monitor_support.h"

namespace backlash::ros_bridge {
namespace {

int niceness() {
  return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)));
}

/// A fit that never ends by itself.
struct Endless {
  std::promise<void> began;
  bool operator()() {
    began.set_value();
    for (;;) stop_if_interrupted();
  }
};

TEST(BackgroundFits, OneAtATimeInTurnAtTheLowestPriority) {
  BackgroundFits fits;
  std::atomic<int> running{0}, most{0};
  std::vector<int> order;  // of the one thread
  std::promise<void> enough;
  const auto fit = [&](int joint) {
    return [&, joint] {
      most = std::max<int>(most, ++running);
      order.push_back(joint);
      std::atomic<int> nice{0};
      for_each_in_parallel(
          2, [&nice](int) { nice += niceness(); }, 2);
      EXPECT_EQ(nice, 2 * 19);
      --running;
      if (order.size() == 4) enough.set_value();
      return order.size() <= 4;
    };
  };
  int a = 0, b = 0;
  fits.add(&a, fit(0));
  fits.add(&b, fit(1));
  enough.get_future().wait();
  fits.stop();
  EXPECT_EQ(most, 1);
  EXPECT_NE(order[0], order[1]);
  EXPECT_EQ(order[0], order[2]);
  EXPECT_EQ(order[1], order[3]);
}

// Well below the 600 s that the test's runner waits, which is all that an endless fit could show.
TEST(BackgroundFits, RemovingAndStoppingCancel) {
  int owner = 0;
  Endless removed, stopped;
  BackgroundFits fits;
  fits.add(&owner, [&removed] { return removed(); });
  removed.began.get_future().wait();
  fits.remove(&owner);
  fits.add(&owner, [&stopped] { return stopped(); });
  stopped.began.get_future().wait();
  fits.stop();
}

TEST(BackgroundFits, WhatFailsEndsNothing) {
  BackgroundFits fits;
  int bad = 0, good = 0;
  std::promise<void> done;
  fits.add(&bad, []() -> bool { throw std::runtime_error("on purpose"); });
  fits.add(&good, [&done, first = true]() mutable {
    if (first) done.set_value();
    first = false;
    return true;
  });
  done.get_future().wait();
}

// The samples of a joint are taken while its fit lasts, and the service answers without it.
TEST(BackgroundFits, AMonitorWaitsForNoFit) {
  ros::Time::init();
  BackgroundFits fits;
  int other = 0;
  Endless endless;
  fits.add(&other, [&endless] { return endless(); });
  endless.began.get_future().wait();
  JointMonitor monitor(monitor_settings("elbow"), nullptr, &fits);
  EXPECT_EQ(feed(monitor, test::make_record({})), 13);
  std::string note;
  ros::Time stamp;
  const diagnosis::Diagnosis d = monitor.diagnose(3, 0, note, stamp);
  EXPECT_EQ(d.estimates.back().method, "waveform");
  EXPECT_EQ(d.estimates.back().message.rfind("being fitted", 0), 0u) << d.estimates.back().message;
}

}  // namespace
}  // namespace backlash::ros_bridge
