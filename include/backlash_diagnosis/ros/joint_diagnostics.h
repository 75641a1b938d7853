// SPDX-License-Identifier: BSD-3-Clause
// The statuses of a joint on /diagnostics (REP 107): backlash, input, excitation, signal quality, curve
// domain.
#pragma once

#include <diagnostic_updater/diagnostic_updater.h>

#include <atomic>
#include <mutex>
#include <string>
#include <vector>

#include "backlash_diagnosis/ros/held_level.h"
#include "backlash_diagnosis/ros/joint_history.h"
#include "backlash_diagnosis/ros/joint_monitor.h"

namespace backlash::ros_bridge {

struct DiagnosticsSettings {
  double stale = 2;          // s of wall time without a message, > 0
  double hold = 5;           // s that a level must be better before it falls, >= 0
  double latency_limit = 1;  // s from stamp to arrival, > 0
};

class JointDiagnostics {
 public:
  /// `history` may be null.
  JointDiagnostics(const JointMonitor& monitor, const JointHistory* history, std::string topic,
                   const DiagnosticsSettings& settings);

  void add_to(diagnostic_updater::DiagnosticTaskVector& tasks);
  void set(const DiagnosticsSettings& settings);

  /// Reads the state of the joint; true if a level has changed since the last call, so that it should be
  /// published at once.
  bool update();

  /// What the status `input` says now.
  std::string input() const;
  /// "no message for 12 s", where that is longer than `stale`; else empty.
  std::string silence(const MonitorState& state) const;

 private:
  using Status = diagnostic_updater::DiagnosticStatusWrapper;
  using Describe = void (JointDiagnostics::*)(const MonitorState&, Status&);
  struct Concern {
    std::string name;
    Describe describe;
    HeldLevel held;
    Status status;  // as of the last update
  };

  void describe_backlash(const MonitorState& state, Status& status);
  void describe_input(const MonitorState& state, Status& status);
  void describe_excitation(const MonitorState& state, Status& status);
  void describe_signal(const MonitorState& state, Status& status);
  void describe_curve(const MonitorState& state, Status& status);
  void look_at_recording();
  void add_history(Status& status) const;
  void summarise_input(const MonitorState& state, double age, Status& status) const;

  const JointMonitor& monitor_;
  const JointHistory* history_;
  std::string topic_;
  DiagnosticsSettings settings_;
  std::vector<Concern> concerns_;
  std::vector<record::Finding> found_;                   // in the newest samples
  double next_look_ = 0;                                 // s, of the steady clock
  long problems_ = 0, not_a_number_ = 0, replaced_ = 0;  // counted up to the last update
  mutable std::mutex mutex_;
};

}  // namespace backlash::ros_bridge
