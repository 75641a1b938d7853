// SPDX-License-Identifier: BSD-3-Clause
// Nodes of ROS 1 register once, at their start: a master that is started again does not know them, and nobody
// finds their topics and services any more, though they run on. This watch registers its node again.
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace backlash::ros_bridge {

/// What the master knows of a node, by name.
struct Registrations {
  std::vector<std::string> publications, subscriptions, services;
  bool empty() const { return publications.empty() && subscriptions.empty() && services.empty(); }
};

/// Asks the master every `interval` [s of wall time] what it knows of this node. If it knows nothing any
/// more, registers again what it knew last. Logs this, and also when the master does not answer.
class MasterWatch {
 public:
  explicit MasterWatch(double interval = 1);
  ~MasterWatch();
  MasterWatch(const MasterWatch&) = delete;
  MasterWatch& operator=(const MasterWatch&) = delete;

 private:
  void run(double interval);
  void look();

  std::mutex mutex_;
  std::condition_variable changed_;
  bool stop_ = false;
  bool away_ = false;     // the master did not answer the last time
  bool complete_ = true;  // it took all registrations
  Registrations known_;
  std::thread thread_;
};

}  // namespace backlash::ros_bridge
