// SPDX-License-Identifier: BSD-3-Clause
// One joint as the diagnoser sees it: its samples, its curve, its baseline, its latest diagnosis.
// Thread-safe: the subscriber feeds it from one thread while services ask from others, and running estimates
// are computed in a third.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "backlash_diagnosis/diagnosis/earlier_answer.h"
#include "backlash_diagnosis/diagnosis/sample_stream.h"
#include "backlash_diagnosis/record/record_check.h"
#include "backlash_diagnosis/ros/background_fits.h"
#include "backlash_diagnosis/ros/diagnosis_worker.h"
#include "backlash_diagnosis/ros/job.h"
#include "backlash_diagnosis/ros/joint_state.h"
#include "backlash_diagnosis/studies/curve_builder.h"

namespace backlash::ros_bridge {

struct MonitorSettings {
  std::string joint;
  rig_file::RigFile rig;
  std::optional<diagnosis::Baseline> baseline;
  std::string baseline_path;  // where a new baseline is kept; empty: nowhere
  std::optional<diagnosis::MonitoringCurve>
      curve;                        // absent: built from the rig at the sampling rate of the messages
  std::string curve_warning;        // what check_curve() says of it
  int window = 5;                   // periods that the running estimates look back
  double estimate_interval = 0.25;  // s of stamps at least from one running estimate to the next
  double keep = 60;                 // s of samples kept
  double silent = 2;                // s of wall time without a sample, after which nobody waits for one
  double job_memory = kJobMemory;   // GB, of the process that builds a curve
};

/// What is published when a period is complete.
struct PeriodReport {
  diagnosis::PeriodResult period;
  double period_length = 0;  // s
  ros::Time stamp;           // of the last sample
};

struct MonitorState {
  diagnosis::StreamCounters counters;
  long bad_messages = 0;  // wrong array sizes, infinite values, names twice
  std::string last_problem;
  std::string curve_state;                      // "loaded", "building, 40 %", "built", "none: ..."
  std::string curve_warning, baseline_warning;  // of another version of the rig file
  double rate = 0;                              // Hz, of the samples kept
  double period = 0;                            // s
  long periods = 0;                             // whole settled ones at hand
  long replaced = 0;                            // running estimates left out, as they took too long
  bool any_sample = false;
  ros::WallTime last_arrival;
  ros::WallTime last_estimate;  // when `latest` was there
  double latency = 0;           // s from stamp to arrival by ROS time, of the latest message
  std::shared_ptr<const diagnosis::Diagnosis> latest;
  bool building_curve = false;
  bool baseline = false;

  std::vector<std::string> warnings() const;
};

class JointMonitor {
 public:
  /// Hears of running estimates over the last `window` periods, in their order, from a thread of the monitor;
  /// `stamp` is that of their last sample.
  using OnDiagnosis = std::function<void(const ros::Time& stamp, const diagnosis::Diagnosis& diagnosis)>;

  /// `fits` must outlive the monitor. Without it (null) the methods that take seconds (`waveform`,
  /// `gap_traverse`) are left out of running estimates, and `waveform` also of answers.
  explicit JointMonitor(MonitorSettings settings, OnDiagnosis on_diagnosis = nullptr,
                        BackgroundFits* fits = nullptr);
  ~JointMonitor();

  const std::string& joint() const { return settings_.joint; }
  const rig_file::RigFile& rig() const { return settings_.rig; }
  const std::string& baseline_path() const { return settings_.baseline_path; }

  /// Takes the values of the joint in a message, or what is wrong with them (see JointStateReader). Returns a
  /// report if they complete a period with an APD. Bad content is counted and reported by state(). A running
  /// estimate is due with each such period; without an APD it is due when at least ten times the duration of
  /// the last estimate has passed. Then the window is copied here; the estimate is computed in the monitor's
  /// thread.
  std::optional<PeriodReport> take(const ros::Time& stamp, const record::ChannelValues& values,
                                   const std::string& problem, const std::string& topic);

  /// The check of a recording (record_check.h), as the commands make it, on the samples of the last
  /// `seconds`.
  record::RecordCheck check_recording(double seconds) const;

  /// Waits until `periods` whole periods are at hand (0: one) and the curve is there, at most `timeout` [s]
  /// of wall time and no longer than samples come, then diagnoses the latest `periods` (0: all kept).
  /// `waveform` is what its latest fit found; nobody waits for it. No estimates where there is no sample at
  /// all.
  diagnosis::Diagnosis diagnose(long periods, double timeout, std::string& note, ros::Time& stamp);

  /// Whether the play is the same in all samples that are kept: empty if so, else since when it differs, in
  /// words.
  std::string change_of_play() const;

  /// Ends the running estimates: the latest that waits is still reported.
  void stop() { worker_.stop(); }

  void set_baseline(const std::optional<diagnosis::Baseline>& baseline);
  void set_curve(diagnosis::MonitoringCurve curve);
  void set_window(int periods, double estimate_interval);  ///< as in MonitorSettings
  void set_limits(const std::optional<diagnosis::Limits>& limits);
  std::optional<diagnosis::Limits> limits() const;
  double estimate_interval() const;  ///< s, as in MonitorSettings
  std::optional<diagnosis::Baseline> baseline() const;
  std::shared_ptr<const diagnosis::MonitoringCurve> curve() const;
  MonitorState state() const;

 private:
  void start_building(double rate);
  void build(double rate);
  std::optional<DiagnosisTask> due(double time);
  DiagnosisTask task(long periods) const;
  void work(const DiagnosisTask& task);
  bool moment(const diagnosis::PeriodResult* period, double time) const;
  bool fit(const std::string& method);
  void background(const std::string& method);
  long wanted_periods(long periods) const { return periods > 0 ? periods : 1; }

  MonitorSettings settings_;
  diagnosis::DiagnosisSettings diagnosis_settings_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  StampClock clock_;
  diagnosis::SampleStream stream_;
  long reported_periods_ = 0;
  std::optional<double> estimated_;  // s, when the last running estimate was due
  std::shared_ptr<const diagnosis::MonitoringCurve> curve_;
  std::optional<diagnosis::Baseline> baseline_;
  std::shared_ptr<const diagnosis::Diagnosis> latest_;
  std::string curve_state_, last_problem_;
  std::string curve_warning_, baseline_warning_;
  long bad_messages_ = 0;
  ros::WallTime last_arrival_, last_sample_, last_estimate_;
  double latency_ = 0;
  bool building_ = false, build_tried_ = false, stop_ = false;
  std::thread builder_;
  OnDiagnosis on_diagnosis_;
  BackgroundFits* const fits_;
  const diagnosis::DiagnosisSettings all_methods_;
  std::map<std::string, diagnosis::EarlierAnswer> fitted_;  // by method, of this run of the stream
  DiagnosisWorker worker_;                                  // last: it uses all of the others
};

}  // namespace backlash::ros_bridge
