// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/joint_monitor.h"

#include <fmt/format.h>
#include <ros/console.h>

#include <chrono>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/utc.h"
#include "backlash_diagnosis/diagnosis/play_change.h"
#include "backlash_diagnosis/rig_file/declared_motion.h"
#include "backlash_diagnosis/ros/curve_job.h"

namespace backlash::ros_bridge {
namespace {

/// Of a fit of the waveform: its twelve reversals, and the half period before the first.
constexpr long kFittedPeriods = 7;
constexpr const char* kWaveform = "waveform";
constexpr const char* kGapTraverse = "gap_traverse";
constexpr const char* kNoWaveformYet = "being fitted to seven periods, which takes seconds: no answer yet";
constexpr const char* kNoTraverseYet = "being fitted in the background, which takes seconds: no answer yet";
/// Times as long as the estimate before it took, without an APD: a tenth of a processor for each joint;
/// choice.
constexpr double kRest = 9;
constexpr std::chrono::milliseconds kLook{
    100};  // choice: from one look whether samples still come to the next

diagnosis::StreamSettings stream_settings(const MonitorSettings& settings) {
  diagnosis::StreamSettings stream;
  stream.apd = settings.rig.diagnosis.apd;
  stream.keep = settings.keep;
  return stream;
}

}  // namespace

std::vector<std::string> MonitorState::warnings() const {
  std::vector<std::string> all;
  for (const std::string& warning : {curve_warning, baseline_warning})
    if (!warning.empty()) all.push_back(warning);
  return all;
}

JointMonitor::JointMonitor(MonitorSettings settings, OnDiagnosis on_diagnosis, BackgroundFits* fits)
    : settings_(std::move(settings)),
      diagnosis_settings_(settings_.rig.diagnosis),
      stream_(stream_settings(settings_)),
      on_diagnosis_(std::move(on_diagnosis)),
      fits_(fits),
      all_methods_(settings_.rig.diagnosis),
      worker_([this](const DiagnosisTask& task) { work(task); }) {
  last_sample_ = ros::WallTime::now();
  if (all_methods_.waveform && fits_)
    diagnosis_settings_.leave_out_waveform(kNoWaveformYet);
  else if (all_methods_.waveform)
    diagnosis_settings_.leave_out_waveform();
  if (settings_.baseline) set_baseline(settings_.baseline);
  if (settings_.curve) {
    curve_warning_ = settings_.curve_warning;
    if (!curve_warning_.empty()) ROS_WARN("%s: %s", settings_.joint.c_str(), curve_warning_.c_str());
    curve_ = std::make_shared<diagnosis::MonitoringCurve>(*settings_.curve);
    curve_state_ = "loaded";
  } else if (!settings_.rig.diagnosis.apd) {
    curve_state_ = "none: the rig file declares no diagnosis.apd";
  } else {
    curve_state_ = "waiting for samples to know their rate";
  }
  if (all_methods_.waveform) background(kWaveform);
  if (all_methods_.gap_traverse) background(kGapTraverse);
}

JointMonitor::~JointMonitor() {
  if (fits_) fits_->remove(this);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
    changed_.notify_all();
  }
  worker_.stop();
  if (builder_.joinable()) builder_.join();
}

void JointMonitor::background(const std::string& method) {
  if (fits_) fits_->add(this, [this, method] { return fit(method); });
}

std::optional<PeriodReport> JointMonitor::take(const ros::Time& stamp, const record::ChannelValues& values,
                                               const std::string& problem, const std::string& topic) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_arrival_ = ros::WallTime::now();
  if (!problem.empty() || stamp.isZero()) {
    ++bad_messages_;
    last_problem_ = BadData(topic, stamp.isZero() ? "the header stamp is zero" : problem).what();
    return std::nullopt;
  }
  latency_ = (ros::Time::now() - stamp).toSec();
  const long restarts = stream_.counters().restarts, accepted = stream_.counters().accepted;
  const double time = clock_.seconds(stamp);
  const diagnosis::PeriodResult* period = stream_.add(time, values);
  if (stream_.counters().restarts != restarts) {
    reported_periods_ = 0;
    estimated_.reset();
    fitted_.clear();
  }
  if (!stream_.counters().last_problem.empty())
    last_problem_ = topic + ": " + stream_.counters().last_problem;
  if (stream_.counters().accepted > accepted) last_sample_ = last_arrival_;
  if (const long periods = stream_.periods(); periods > reported_periods_) {
    reported_periods_ = periods;
    changed_.notify_all();
  }
  if (!moment(period, time)) return std::nullopt;
  if (!curve_ && !build_tried_ && settings_.rig.diagnosis.apd)
    if (const double interval = stream_.sampling_interval(); interval > 0)
      start_building(studies::nominal_sampling_rate(interval));
  ros::Time last = clock_.stamp(time);
  if (auto next = due(time)) {
    last = next->stamp;
    worker_.add(std::move(*next));
  }
  changed_.notify_all();
  if (!period) return std::nullopt;
  return PeriodReport{*period, stream_.period(), last};
}

/// Whether a running estimate may be due with this sample. Called with the lock held.
bool JointMonitor::moment(const diagnosis::PeriodResult* period, double time) const {
  if (settings_.rig.diagnosis.apd) return period != nullptr;
  if (!all_methods_.serves_any()) return false;
  const std::vector<double>& kept = stream_.kept().time;
  return !kept.empty() && time - kept.front() >= diagnosis::kFirstPeriodSearch && worker_.rested(kRest);
}

/// The running estimate of this moment, where one is due. Called with the lock held.
std::optional<DiagnosisTask> JointMonitor::due(double time) {
  // Half a sample is what rounding and jitter may take from an interval of whole periods.
  const double slack = 0.5 * stream_.sampling_interval();
  if (estimated_ && time < *estimated_ + settings_.estimate_interval - slack) return std::nullopt;
  DiagnosisTask next = task(settings_.window);
  if (next.window.record.time.empty()) return std::nullopt;
  estimated_ = time;
  if (all_methods_.gap_traverse) {
    if (fits_)
      next.settings.leave_out_gap_traverse(kNoTraverseYet);
    else
      next.settings.leave_out_gap_traverse();
    if (const auto found = fitted_.find(kGapTraverse); found != fitted_.end())
      next.earlier.push_back(found->second);
  }
  return next;
}

/// What a diagnosis of the last `periods` needs. Called with the lock held.
DiagnosisTask JointMonitor::task(long periods) const {
  DiagnosisTask task;
  task.window = stream_.latest(periods);
  if (!task.window.record.time.empty()) task.stamp = clock_.stamp(task.window.record.time.back());
  task.settings = diagnosis_settings_;
  task.curve = curve_;
  task.baseline = baseline_;
  if (const auto found = fitted_.find(kWaveform); found != fitted_.end()) task.earlier = {found->second};
  return task;
}

/// In the worker's thread.
void JointMonitor::work(const DiagnosisTask& task) {
  const auto diagnosis = std::make_shared<const diagnosis::Diagnosis>(task.compute());
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    latest_ = diagnosis;
    last_estimate_ = ros::WallTime::now();
  }
  if (on_diagnosis_) on_diagnosis_(task.stamp, *diagnosis);
}

/// In the thread of the background fits. Crossings of the gap are looked at in the newer half of what is
/// kept, so that an answer follows a play that changes, and in all of it where that half shows too few.
bool JointMonitor::fit(const std::string& method) {
  const bool waveform = method == kWaveform;
  DiagnosisTask newest;
  long restarts = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    newest = task(waveform ? kFittedPeriods : 0);
    restarts = stream_.counters().restarts;
    const auto found = fitted_.find(method);
    const std::vector<double>& time = newest.window.record.time;
    if (time.empty() || (found != fitted_.end() && found->second.end >= time.back())) return false;
  }
  const bool more_to_come = settings_.keep > (kFittedPeriods + 1) * newest.window.period;
  if (waveform && newest.window.period > 0 && newest.window.count < kFittedPeriods && more_to_come)
    return false;
  const auto answer = [&](const diagnosis::PeriodWindow& window) {
    return diagnosis::answer_of(method, window, all_methods_, newest.curve.get());
  };
  const record::Record& all = newest.window.record;
  const double half = all.time.back() - 0.5 * settings_.keep;
  std::optional<diagnosis::EarlierAnswer> found;
  if (!waveform && half > all.time.front())
    found = answer({all.slice(half, HUGE_VAL), newest.window.period, 0, {}});
  if (!found || found->estimate.status == diagnosis::Status::insufficient_data) found = answer(newest.window);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (stream_.counters().restarts == restarts) fitted_[method] = std::move(*found);
  return true;
}

diagnosis::Diagnosis JointMonitor::diagnose(long periods, double timeout, std::string& note,
                                            ros::Time& stamp) {
  std::unique_lock<std::mutex> lock(mutex_);
  const auto silence = [&] { return (ros::WallTime::now() - last_sample_).toSec(); };
  const auto ready = [&] {
    if (stop_) return true;
    return !building_ && (stream_.periods() >= wanted_periods(periods) || silence() > settings_.silent);
  };
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout);
  while (!ready() && std::chrono::steady_clock::now() < end) changed_.wait_for(lock, kLook);
  const long available = stream_.periods();
  const DiagnosisTask asked = task(periods);
  // Without an APD all that is kept will do, whether it has periods or not.
  const bool any_length = periods == 0 && !settings_.rig.diagnosis.apd && !asked.window.record.time.empty();
  if (available < wanted_periods(periods) && !any_length)
    note = fmt::format("only {} of {} whole periods arrived{}", available, wanted_periods(periods),
                       last_problem_.empty() ? "" : "; last problem: " + last_problem_);
  const std::string curve_state = curve_state_;
  const bool nothing = stream_.counters().accepted == 0;
  stamp = asked.stamp;
  lock.unlock();  // the subscriber goes on while this computes
  if (nothing) return {};
  diagnosis::Diagnosis diagnosis = asked.compute();
  for (diagnosis::Estimate& estimate : diagnosis.estimates)
    if (diagnosis::needs_curve(estimate.method) && !asked.curve) estimate.message += " (" + curve_state + ")";
  return diagnosis;
}

std::string JointMonitor::change_of_play() const {
  record::Record kept;
  std::shared_ptr<const diagnosis::MonitoringCurve> curve;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    kept = stream_.kept();
    curve = curve_;
  }
  const auto change = diagnosis::play_change(kept, all_methods_, curve.get());
  if (!change) return "";
  const std::lock_guard<std::mutex> lock(mutex_);
  const double ago = kept.time.back() - change->to;
  return fmt::format(
      "the play changed between {} and {}, {:.0f} s before the last sample: {}; ask again after {:.0f} s "
      "of the play that is to be the baseline",
      utc_time(clock_.stamp(change->from).toSec()), utc_time(clock_.stamp(change->to).toSec()), ago,
      diagnosis::plays_text(*change), settings_.keep);
}

void JointMonitor::start_building(double rate) {
  building_ = build_tried_ = true;
  curve_state_ = "building";
  if (builder_.joinable()) builder_.join();
  builder_ = std::thread(&JointMonitor::build, this, rate);
}

void JointMonitor::build(double rate) {
  studies::CurveRequest request;
  request.sampling_rate = rate;
  std::string failure;
  try {
    const auto progress = [this](double fraction, const std::string&) {
      const std::lock_guard<std::mutex> lock(mutex_);
      curve_state_ = fmt::format("building, {:.0f} %", 100 * fraction);
      return !stop_;
    };
    diagnosis::MonitoringCurve built =
        build_curve_as_job(settings_.rig, request, settings_.job_memory, progress);
    ROS_INFO("%s: built the monitoring curve for %g Hz from %s", settings_.joint.c_str(),
             built.conditions.sampling_rate, settings_.rig.source.c_str());
    set_curve(std::move(built));
  } catch (const Cancelled&) {
    return;
  } catch (const std::exception& error) {
    failure = error.what();
    ROS_ERROR("%s: the monitoring curve cannot be built: %s", settings_.joint.c_str(), error.what());
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  building_ = false;
  if (!failure.empty()) curve_state_ = "none: " + failure;
  changed_.notify_all();
}

void JointMonitor::set_baseline(const std::optional<diagnosis::Baseline>& baseline) {
  const std::lock_guard<std::mutex> lock(mutex_);
  baseline_ = baseline;
  baseline_warning_.clear();
  if (!baseline) return;
  baseline_warning_ = diagnosis::check_baseline(*baseline, settings_.rig.rig.name, settings_.rig.digest,
                                                settings_.baseline_path);
  if (!baseline_warning_.empty()) ROS_WARN("%s: %s", settings_.joint.c_str(), baseline_warning_.c_str());
}

void JointMonitor::set_curve(diagnosis::MonitoringCurve curve) {
  const std::lock_guard<std::mutex> lock(mutex_);
  curve_ = std::make_shared<diagnosis::MonitoringCurve>(std::move(curve));
  curve_state_ = "built";
  curve_warning_.clear();
  changed_.notify_all();
}

void JointMonitor::set_window(int periods, double estimate_interval) {
  const std::lock_guard<std::mutex> lock(mutex_);
  settings_.window = periods;
  settings_.estimate_interval = estimate_interval;
}

void JointMonitor::set_limits(const std::optional<diagnosis::Limits>& limits) {
  const std::lock_guard<std::mutex> lock(mutex_);
  diagnosis_settings_.limits = limits;
}

double JointMonitor::estimate_interval() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return settings_.estimate_interval;
}

std::optional<diagnosis::Limits> JointMonitor::limits() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return diagnosis_settings_.limits;
}

std::optional<diagnosis::Baseline> JointMonitor::baseline() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return baseline_;
}

std::shared_ptr<const diagnosis::MonitoringCurve> JointMonitor::curve() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return curve_;
}

record::RecordCheck JointMonitor::check_recording(double seconds) const {
  record::Record latest;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const record::Record& kept = stream_.kept();
    if (!kept.time.empty()) latest = kept.slice(kept.time.back() - seconds, HUGE_VAL);
  }
  return record::check_record(std::move(latest), rig_file::declared_motion(settings_.rig.rig)).check;
}

MonitorState JointMonitor::state() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  MonitorState state;
  state.counters = stream_.counters();
  state.bad_messages = bad_messages_;
  state.last_problem = last_problem_;
  state.curve_state = curve_state_;
  state.curve_warning = curve_warning_;
  state.baseline_warning = baseline_warning_;
  state.baseline = baseline_.has_value();
  state.building_curve = building_;
  state.latency = latency_;
  const double interval = stream_.sampling_interval();
  state.rate = interval > 0 ? 1 / interval : 0;
  state.period = stream_.period();
  state.periods = stream_.periods();
  state.any_sample = stream_.counters().accepted > 0;
  state.last_arrival = last_arrival_;
  state.last_estimate = last_estimate_;
  state.latest = latest_;
  state.replaced = worker_.replaced();
  return state;
}

}  // namespace backlash::ros_bridge
