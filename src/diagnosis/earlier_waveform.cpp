// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/earlier_waveform.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace backlash::diagnosis {
namespace {

constexpr const char* kName = "waveform";
constexpr double kOldest = 300;       // s: choice
constexpr double kLeastMove = 0.02;   // of the value: choice
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

/// The method that shows that the machine is not what it was; null: none.
const Estimate* changed_since(const EarlierWaveform& earlier, const std::vector<Estimate>& now) {
  for (const Estimate& e : now) {
    const auto then = std::find_if(earlier.others.begin(), earlier.others.end(),
                                   [&e](const Estimate& other) { return other.method == e.method; });
    if (e.method == kName || then == earlier.others.end()) continue;
    if (has_moved(*then, e)) return &e;
    if (contradicts(e, earlier.estimate) && !contradicts(*then, earlier.estimate)) return &e;
  }
  return nullptr;
}

std::string age_text(double age) {
  return fmt::format("of samples that ended {:.1f} s before", age);
}

/// The earlier answer, or why it does not hold now.
Estimate recalled(const Diagnosis& diagnosis, const EarlierWaveform& earlier, double age) {
  Estimate refused;
  refused.method = kName;
  if (diagnosis.lock_contradicted) {
    refused.status = Status::out_of_domain;
    refused.message = *diagnosis.lock_contradicted;
  } else if (!(age <= kOldest)) {
    refused.message = "the last answer is " + age_text(age) + ", too old: being fitted anew";
  } else if (const Estimate* witness = changed_since(earlier, diagnosis.estimates)) {
    refused.message = fmt::format("being fitted anew: the machine has changed since the last answer, by {}",
                                  witness->method);
  } else {
    Estimate estimate = earlier.estimate;
    estimate.age = std::max(0.0, age);
    estimate.message += "; " + age_text(estimate.age);
    return estimate;
  }
  return refused;
}

}  // namespace

EarlierWaveform fit_waveform(const PeriodWindow& window, const DiagnosisSettings& settings,
                             const MonitoringCurve* curve) {
  EarlierWaveform earlier;
  if (!window.record.time.empty()) earlier.end = window.record.time.back();
  earlier.estimate = diagnose(window, settings, curve, std::nullopt, kName).estimates.front();
  DiagnosisSettings quick = settings;
  quick.leave_out_waveform();
  earlier.others = diagnose(window, quick, curve).estimates;
  return earlier;
}

void recall_waveform(Diagnosis& diagnosis, const EarlierWaveform& earlier, double end,
                     const std::optional<Limits>& limits, const std::optional<Baseline>& baseline) {
  const auto place = std::find_if(diagnosis.estimates.begin(), diagnosis.estimates.end(),
                                  [](const Estimate& estimate) { return estimate.method == kName; });
  if (place == diagnosis.estimates.end()) return;
  *place = recalled(diagnosis, earlier, end - earlier.end);
  diagnosis.verdict = combine(diagnosis.estimates, limits, baseline);
  const auto index = static_cast<int>(place - diagnosis.estimates.begin());
  const std::vector<int>& members = diagnosis.verdict.members;
  if (std::find(members.begin(), members.end(), index) != members.end())
    diagnosis.verdict.message += fmt::format("; {} is {}", kName, age_text(place->age));
}

}  // namespace backlash::diagnosis
