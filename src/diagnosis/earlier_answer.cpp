// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/earlier_answer.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "doubted_declaration.h"

namespace backlash::diagnosis {
namespace {

constexpr double kOldest = 300;       // s: choice
constexpr double kLeastMove = 0.02;   // of the value: choice
constexpr double kFewestPeriods = 5;  // in all, of which errors can be estimated: choice
constexpr long kMostBins = 200;       // of a period: choice
constexpr double kNoChange = 0.01;    // of the swing: choice
constexpr double kApart = 4;          // squared errors, mean: theory, 1.3 +- 0.4 by chance with ten periods
constexpr double kContradiction = 2;  // times the 95 % interval, as in combine(): theory

bool has_interval(const Estimate& e) {
  return e.status == Status::ok && std::isfinite(e.backlash_angle) && std::isfinite(e.angle_lower) &&
         std::isfinite(e.angle_upper);
}

double half_width(const Estimate& e) {
  return std::max(e.angle_upper - e.backlash_angle, e.backlash_angle - e.angle_lower);
}

/// Without what declared values leave open.
double own_half_width(const Estimate& e) {
  const double half = half_width(e);
  return std::sqrt(std::max(0.0, half * half - e.declared * e.declared));
}

bool has_moved(const Estimate& then, const Estimate& now) {
  if (!has_interval(then) || !has_interval(now)) return false;
  const double least = kLeastMove * std::max(then.backlash_angle, now.backlash_angle);
  return std::fabs(now.backlash_angle - then.backlash_angle) >
         std::max(least, own_half_width(then) + own_half_width(now));
}

/// Whether an estimate leaves no room for the answer. Lower bounds count.
bool contradicts(const Estimate& e, const Estimate& answer) {
  if (!has_interval(answer)) return false;
  const double room = kContradiction * half_width(answer);
  if (e.status == Status::above_range && std::isfinite(e.angle_lower))
    return e.angle_lower > answer.backlash_angle + room;
  return has_interval(e) &&
         std::fabs(e.backlash_angle - answer.backlash_angle) > room + kContradiction * half_width(e);
}

/// Mean of the squared differences of two mean periods, in their squared standard errors; 0 where too little
/// is there to compare.
double distance(const MeanPeriod& a, const MeanPeriod& b) {
  if (a.mean.size() != b.mean.size()) return 0;
  double sum = 0, bins = 0;
  for (std::size_t i = 0; i < a.mean.size(); ++i) {
    const double count = a.count[i] + b.count[i];
    if (a.count[i] < 1 || b.count[i] < 1 || count < kFewestPeriods) continue;
    const double finest = kNoChange * std::max(a.swing, b.swing);
    const double variance = (a.squares[i] + b.squares[i]) / (count - 2) + finest * finest;
    sum += std::pow(a.mean[i] - b.mean[i], 2) / (variance * (1 / a.count[i] + 1 / b.count[i])), ++bins;
  }
  return bins > 0 ? sum / bins : 0;
}

/// What shows that the machine is not what it was; empty: nothing.
std::string changed_since(const EarlierAnswer& earlier, const Diagnosis& diagnosis,
                          const PeriodWindow& window) {
  const std::vector<Estimate>& now = diagnosis.estimates;
  for (const Estimate& e : now) {
    const auto then = std::find_if(earlier.others.begin(), earlier.others.end(),
                                   [&e](const Estimate& other) { return other.method == e.method; });
    if (e.method == earlier.method || then == earlier.others.end()) continue;
    if (has_moved(*then, e)) return e.method;
    if (contradicts(e, earlier.estimate) && !contradicts(*then, earlier.estimate)) return e.method;
  }
  return distance(earlier.period, mean_period(window)) > kApart ? "the torque of the sensor" : "";
}

std::string age_text(double age) {
  return fmt::format("of samples that ended {:.1f} s before", age);
}

/// The earlier answer, or why it does not hold now.
Estimate recalled(const Diagnosis& diagnosis, const EarlierAnswer& earlier, const PeriodWindow& window) {
  const double age = window.record.time.back() - earlier.end;
  Estimate refused;
  refused.method = earlier.method;
  if (diagnosis.lock_contradicted) {
    refused.status = Status::out_of_domain;
    refused.message = *diagnosis.lock_contradicted;
  } else if (!(age <= kOldest)) {
    refused.message = "the last answer is " + age_text(age) + ", too old: being fitted anew";
  } else if (const std::string witness = changed_since(earlier, diagnosis, window); !witness.empty()) {
    refused.message =
        fmt::format("being fitted anew: the machine has changed since the last answer, by {}", witness);
  } else {
    Estimate estimate = earlier.estimate;
    estimate.age = std::max(0.0, age);
    estimate.message += "; " + age_text(estimate.age);
    return estimate;
  }
  return refused;
}

}  // namespace

MeanPeriod mean_period(const PeriodWindow& window) {
  MeanPeriod mean;
  const std::vector<double>& time = window.record.time;
  const std::vector<double>& torque = window.record.column(record::Channel::sensor_torque);
  if (!(window.period > 0) || time.empty() || torque.empty()) return mean;
  const double interval = window.record.sampling_interval();
  const long bins = std::min(kMostBins, std::lround(window.period / interval));
  if (bins < 1) return mean;
  const auto [least, most] = std::minmax_element(torque.begin(), torque.end());
  mean.swing = (*most - *least) / 2;
  for (auto* column : {&mean.mean, &mean.squares, &mean.count})
    column->assign(static_cast<std::size_t>(bins), 0);
  for (std::size_t i = 0; i < time.size(); ++i) {
    // Half an interval, so that rounding moves no sample to the bin beside its own.
    const double phase = (time[i] - time.front() + interval / 2) / window.period;
    const auto bin = static_cast<std::size_t>((phase - std::floor(phase)) * static_cast<double>(bins));
    const double difference = torque[i] - mean.mean[bin];
    mean.mean[bin] += difference / ++mean.count[bin];
    mean.squares[bin] += difference * (torque[i] - mean.mean[bin]);
  }
  return mean;
}

EarlierAnswer answer_of(const std::string& method, const PeriodWindow& window,
                        const DiagnosisSettings& settings, const MonitoringCurve* curve) {
  EarlierAnswer earlier;
  earlier.method = method;
  if (!window.record.time.empty()) earlier.end = window.record.time.back();
  earlier.estimate = diagnose(window, settings, curve, std::nullopt, method).estimates.front();
  DiagnosisSettings quick = settings;
  quick.leave_out_waveform();
  quick.leave_out_gap_traverse();
  earlier.others = diagnose(window, quick, curve).estimates;
  earlier.period = mean_period(window);
  return earlier;
}

void recall(Diagnosis& diagnosis, const EarlierAnswer& earlier, const PeriodWindow& window,
            const std::optional<Limits>& limits, const std::optional<Baseline>& baseline) {
  const auto place =
      std::find_if(diagnosis.estimates.begin(), diagnosis.estimates.end(),
                   [&earlier](const Estimate& estimate) { return estimate.method == earlier.method; });
  if (place == diagnosis.estimates.end() || window.record.time.empty()) return;
  *place = recalled(diagnosis, earlier, window);
  doubt_declared_values(diagnosis.estimates);
  diagnosis.verdict = combine(diagnosis.estimates, limits, baseline);
  const auto index = static_cast<int>(place - diagnosis.estimates.begin());
  const std::vector<int>& members = diagnosis.verdict.members;
  if (std::find(members.begin(), members.end(), index) != members.end())
    diagnosis.verdict.message += fmt::format("; {} is {}", earlier.method, age_text(place->age));
}

}  // namespace backlash::diagnosis
