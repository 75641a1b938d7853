// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/joint_diagnostics.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/signal_checks.h"

namespace backlash::ros_bridge {
namespace {

using DiagnosticStatus = diagnostic_msgs::DiagnosticStatus;

constexpr double kSecondsPerYear = 365.25 * 86400;
constexpr double kAnotherTime = 3600;  // s: stamps so old or new are of a recording, not late
constexpr std::size_t kInput = 1;      // place of the concern
// s of wall time without an estimate while samples come: choice. Also three periods or intervals without one.
constexpr double kOldEstimate = 30, kMissed = 3;

// s: choice. Each look at 10 s of 1 kHz takes 8 ms of a core: 1.3 % for 16 joints.
constexpr double kLookedAt = 10, kBetweenLooks = 10;

unsigned char level_of(diagnosis::Grade grade) {
  switch (grade) {
    case diagnosis::Grade::good:
    case diagnosis::Grade::ungraded:
      return DiagnosticStatus::OK;
    case diagnosis::Grade::watch:
      return DiagnosticStatus::WARN;
    case diagnosis::Grade::service:
    case diagnosis::Grade::stop:
      return DiagnosticStatus::ERROR;
    case diagnosis::Grade::cannot_tell:
      break;
  }
  return DiagnosticStatus::WARN;
}

double now() {
  return ros::WallTime::now().toSec();
}

double age_of(const MonitorState& state) {
  return state.any_sample ? now() - state.last_arrival.toSec() : 0;
}

/// s of wall time since the latest estimate, where it is too old for what the samples of now are; else 0.
double overdue(const MonitorState& state, double estimate_interval) {
  const double since = now() - state.last_estimate.toSec();
  return since > std::max(kOldEstimate, kMissed * std::max(state.period, estimate_interval)) ? since : 0;
}

/// Why the clock of ROS cannot be compared with the stamps, and what to do; empty: a recording of another
/// day.
std::string clock_problem(double latency) {
  if (!ros::Time::isSimTime()) return "";
  const std::string remedy =
      "; without a simulation or `rosbag play --clock`: rosparam set /use_sim_time false, and "
      "start the nodes again";
  if (ros::Time::now().isZero()) return "/use_sim_time is true, but nobody publishes /clock" + remedy;
  return "the stamps are " + to_text(std::round(std::fabs(latency))) + " s " +
         (latency > 0 ? "behind" : "ahead of") + " /clock: they are of another clock" + remedy;
}

const diagnosis::Mismatch* mismatch_of(const MonitorState& state, diagnosis::Mismatch::Concern concern) {
  if (!state.latest || !state.latest->mismatch) return nullptr;
  return state.latest->mismatch->concern == concern ? &*state.latest->mismatch : nullptr;
}

}  // namespace

JointDiagnostics::JointDiagnostics(const JointMonitor& monitor, const JointHistory* history,
                                   std::string topic, const DiagnosticsSettings& settings)
    : monitor_(monitor), history_(history), topic_(std::move(topic)), settings_(settings) {
  const std::pair<const char*, Describe> all[] = {{"backlash", &JointDiagnostics::describe_backlash},
                                                  {"input", &JointDiagnostics::describe_input},
                                                  {"excitation", &JointDiagnostics::describe_excitation},
                                                  {"signal quality", &JointDiagnostics::describe_signal},
                                                  {"curve domain", &JointDiagnostics::describe_curve}};
  for (const auto& [name, describe] : all)
    concerns_.push_back({monitor_.joint() + ": " + name, describe, HeldLevel(settings.hold), {}});
  update();
}

void JointDiagnostics::add_to(diagnostic_updater::DiagnosticTaskVector& tasks) {
  for (Concern& concern : concerns_)
    tasks.add(concern.name, [this, &concern](Status& status) {
      const std::lock_guard<std::mutex> lock(mutex_);
      status.hardware_id = monitor_.rig().rig.name;
      status.level = concern.status.level;
      status.message = concern.status.message;
      status.values = concern.status.values;
    });
}

void JointDiagnostics::set(const DiagnosticsSettings& settings) {
  const std::lock_guard<std::mutex> lock(mutex_);
  settings_ = settings;
  for (Concern& concern : concerns_) concern.held.set_hold(settings.hold);
}

bool JointDiagnostics::update() {
  const MonitorState state = monitor_.state();
  const std::lock_guard<std::mutex> lock(mutex_);
  look_at_recording();
  bool changed = false;
  for (Concern& concern : concerns_) {
    Status status;
    status.name = concern.name;
    (this->*concern.describe)(state, status);
    if (status.level != DiagnosticStatus::STALE) {  // silence is not a matter of degree
      const int held = concern.held.update(status.level, ros::SteadyTime::now().toSec());
      if (held > status.level) status.message += "; worse within the last " + to_text(settings_.hold) + " s";
      status.level = static_cast<unsigned char>(held);
    }
    changed = changed || status.level != concern.status.level;
    concern.status = std::move(status);
  }
  return changed;
}

std::string JointDiagnostics::input() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return concerns_[kInput].status.message;
}

std::string JointDiagnostics::silence(const MonitorState& state) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double age = age_of(state);
  return age > settings_.stale ? "no message for " + to_text(std::round(age)) + " s" : "";
}

void JointDiagnostics::look_at_recording() {
  const double time = ros::SteadyTime::now().toSec();
  if (time < next_look_) return;
  next_look_ = time + kBetweenLooks;
  found_ = monitor_.check_recording(kLookedAt).findings;
}

void JointDiagnostics::describe_backlash(const MonitorState& state, Status& status) {
  if (!monitor_.rig().diagnosis.serves_any()) {
    status.summary(DiagnosticStatus::OK,
                   "not judged: the rig file declares nothing that a method could go by (one "
                   "inertia has no play)");
  } else if (!state.latest) {
    status.summary(DiagnosticStatus::WARN,
                   monitor_.rig().diagnosis.apd ? "no whole excitation period yet" : "no estimate yet");
  } else if (age_of(state) > settings_.stale) {
    status.summary(DiagnosticStatus::STALE, "no sample for " + to_text(std::round(age_of(state))) +
                                                " s; before: " + state.latest->verdict.message);
  } else if (const double since = overdue(state, monitor_.estimate_interval()); since > 0) {
    status.summary(DiagnosticStatus::STALE, "samples come, but no estimate for " +
                                                to_text(std::round(since)) +
                                                " s; before: " + state.latest->verdict.message);
  } else {
    status.summary(level_of(state.latest->verdict.grade), state.latest->verdict.message);
  }
  status.add("Whole periods kept", state.periods);
  if (!state.baseline_warning.empty()) status.add("Warning", state.baseline_warning);
  if (state.latest) {
    const diagnosis::Verdict& verdict = state.latest->verdict;
    status.add("Grade", diagnosis::to_string(verdict.grade));
    status.add("Agreement", verdict.agreement);
    status.add("Backlash (m)", verdict.backlash);
    status.add("Backlash lower (m)", verdict.lower);
    status.add("Backlash upper (m)", verdict.upper);
    status.add("Backlash angle (rad)", verdict.backlash_angle);
    for (const diagnosis::Estimate& e : state.latest->estimates) {
      status.add(e.method + " status", diagnosis::to_string(e.status));
      status.add(e.method + " backlash (m)", e.backlash);
      status.add(e.method + " backlash angle (rad)", e.backlash_angle);
    }
  }
  add_history(status);
}

void JointDiagnostics::add_history(Status& status) const {
  if (!history_) return;
  const JointHistory::State history = history_->state();
  if (!history.problem.empty())
    status.mergeSummary(DiagnosticStatus::ERROR, "history: " + history.problem);
  else if (history.behind)
    status.mergeSummary(DiagnosticStatus::WARN, "history: stamps are older than its last entry");
  status.add("History", history.path);
  status.add("History entries written", history.entries);
  status.add("History entries waiting", history.waiting);
  status.add("History entries left out", history.left_out);
  status.add("History entries lost", history.lost);
  const diagnosis::Trend& trend = history.trend;
  status.add("Trend", trend.message);
  const std::string unit = monitor_.rig().rig.mesh.angular() ? "rad/year" : "m/year";
  status.add("Trend rate (" + unit + ")", trend.rate * kSecondsPerYear);
  status.add("Trend rate lower (" + unit + ")", trend.rate_lower * kSecondsPerYear);
  status.add("Trend rate upper (" + unit + ")", trend.rate_upper * kSecondsPerYear);
  status.add("Service limit reached (s since 1970)", trend.reaches ? trend.reaches->time : kNaN);
}

void JointDiagnostics::describe_input(const MonitorState& state, Status& status) {
  const diagnosis::StreamCounters& c = state.counters;
  const double age = age_of(state);
  summarise_input(state, age, status);
  problems_ = state.bad_messages + c.repeated + c.restarts;
  replaced_ = state.replaced;
  status.add("Sampling rate (Hz)", state.rate);
  status.add("Latency (s)", state.latency);
  status.add("Age of the last sample (s)", age);
  status.add("Samples accepted", c.accepted);
  status.add("Samples with NaN", c.not_a_number);
  status.add("Repeated stamps", c.repeated);
  status.add("Clock jumps", c.restarts);
  status.add("Malformed messages", state.bad_messages);
  status.add("Estimates left out", state.replaced);
  status.add("Last problem", state.last_problem);
}

void JointDiagnostics::summarise_input(const MonitorState& state, double age, Status& status) const {
  const diagnosis::StreamCounters& c = state.counters;
  if (!state.any_sample && state.bad_messages + c.not_a_number == 0)
    status.summary(DiagnosticStatus::WARN,
                   "no message on " + topic_ + " has named " + monitor_.joint() + " yet");
  else if (!state.any_sample)
    status.summary(DiagnosticStatus::ERROR, "no usable sample; " + state.last_problem);
  else if (age > settings_.stale)
    status.summary(DiagnosticStatus::STALE, "no message for " + to_text(std::round(age)) + " s");
  else if (state.bad_messages + c.repeated + c.restarts > problems_)
    status.summary(DiagnosticStatus::WARN, "samples were left out; last: " + state.last_problem);
  else if (state.replaced > replaced_)
    status.summary(DiagnosticStatus::WARN,
                   "samples come faster than they can be diagnosed: estimates are left out");
  else if (std::fabs(state.latency) > kAnotherTime)
    clock_problem(state.latency).empty()
        ? status.summary(DiagnosticStatus::OK,
                         "receiving; the stamps are of another time than now: a recording")
        : status.summary(DiagnosticStatus::WARN, clock_problem(state.latency));
  else if (state.latency > settings_.latency_limit)
    status.summary(DiagnosticStatus::WARN,
                   "samples arrive " + to_text(std::round(1000 * state.latency)) + " ms after their stamps");
  else
    status.summary(DiagnosticStatus::OK, "receiving");
}

void JointDiagnostics::describe_excitation(const MonitorState& state, Status& status) {
  const auto& apd = monitor_.rig().diagnosis.apd;
  status.add("Excitation period (s)", state.period);
  status.add("Whole periods kept", state.periods);
  if (const auto curve = monitor_.curve()) {
    status.add("Frequency of the curve (Hz)", curve->conditions.frequency);
    status.add("Excitation level of the curve (N m)", curve->conditions.excitation_level);
  }
  const bool settled =
      state.rate > 0 && double(state.counters.accepted) > 2 * state.rate * diagnosis::kFirstPeriodSearch;
  if (const diagnosis::Mismatch* mismatch = mismatch_of(state, diagnosis::Mismatch::Concern::excitation))
    status.summary(DiagnosticStatus::WARN, mismatch->reason);
  else if (!apd)
    status.summary(DiagnosticStatus::OK, "not judged: the rig file declares no diagnosis.apd");
  else if (state.period > 0)
    status.summary(DiagnosticStatus::OK, state.latest ? "periodic" : "periodic, settling");
  else if (settled)
    status.summary(DiagnosticStatus::WARN, "no excitation period found");
  else
    status.summary(DiagnosticStatus::OK, "waiting for samples");
}

void JointDiagnostics::describe_signal(const MonitorState& state, Status& status) {
  const bool fresh_nan = state.counters.not_a_number > not_a_number_;
  not_a_number_ = state.counters.not_a_number;
  if (const diagnosis::Mismatch* mismatch = mismatch_of(state, diagnosis::Mismatch::Concern::signal))
    status.summary(DiagnosticStatus::WARN, mismatch->reason);
  else if (fresh_nan)
    status.summary(DiagnosticStatus::WARN, "samples hold NaN; last: " + state.last_problem);
  else if (state.latest && state.latest->apd && state.latest->apd->incomplete > 0)
    status.summary(DiagnosticStatus::WARN, "periods have gaps or no sample inside the classes");
  else
    status.summary(DiagnosticStatus::OK, state.latest ? "sound" : "waiting for samples");
  for (const record::Finding& finding : found_) {
    status.add(record::id_of(finding.kind), finding.message);
    if (finding.consequence != record::Consequence::noted)
      status.mergeSummary(finding.consequence == record::Consequence::refused ? DiagnosticStatus::ERROR
                                                                              : DiagnosticStatus::WARN,
                          finding.message);
  }
  status.add("Samples with NaN", state.counters.not_a_number);
  if (!state.latest || !state.latest->apd) return;
  const diagnosis::ApdResult& apd = *state.latest->apd;
  const std::string unit = record::channel_unit(monitor_.rig().diagnosis.apd->signal);
  status.add("Signal", record::channel_name(monitor_.rig().diagnosis.apd->signal));
  status.add("Noise, standard deviation (" + unit + ")", apd.noise);
  status.add("Periods with gaps", apd.incomplete);
  status.add("Skewness", apd.skewness);
}

void JointDiagnostics::describe_curve(const MonitorState& state, Status& status) {
  status.add("Monitoring curve", state.curve_state);
  const auto curve = monitor_.curve();
  if (curve) {
    status.add("Curve from (m)", curve->points.front().backlash);
    status.add("Curve to (m)", curve->points.back().backlash);
    status.add("Curve sampling rate (Hz)", curve->conditions.sampling_rate);
  }
  if (!monitor_.rig().diagnosis.apd)
    status.summary(DiagnosticStatus::OK, "not judged: the rig file declares no diagnosis.apd");
  else if (!curve)
    status.summary(state.building_curve || !state.any_sample ? DiagnosticStatus::OK : DiagnosticStatus::WARN,
                   state.curve_state);
  else if (const diagnosis::Mismatch* mismatch = mismatch_of(state, diagnosis::Mismatch::Concern::curve))
    status.summary(DiagnosticStatus::WARN, mismatch->reason);
  else if (!state.curve_warning.empty())
    status.summary(DiagnosticStatus::WARN, state.curve_warning);
  else
    status.summary(DiagnosticStatus::OK,
                   state.latest ? "the record is as the curve needs it" : "waiting for samples");
  if (state.latest && !state.latest->verdict.declared_wrong.empty())
    status.mergeSummary(DiagnosticStatus::WARN,
                        diagnosis::contradiction_text(state.latest->verdict.declared_wrong));
  if (!state.latest || !curve) return;
  for (const diagnosis::Estimate& e : state.latest->estimates)
    if (e.status == backlash::diagnosis::Status::above_range && diagnosis::needs_curve(e.method))
      status.mergeSummary(DiagnosticStatus::WARN, e.method + ": beyond the end of the curve");
}

}  // namespace backlash::ros_bridge
