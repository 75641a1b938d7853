// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/messages.h"

#include <cmath>

#include "backlash_diagnosis/report/change_file.h"

namespace backlash::ros_bridge {
namespace {

using EstimateMessage = backlash_diagnosis::BacklashEstimate;

backlash_diagnosis::AmplitudeDistribution distribution(const diagnosis::AmplitudeDistribution& apd,
                                                       const diagnosis::ApdSettings& settings) {
  backlash_diagnosis::AmplitudeDistribution m;
  m.signal = record::channel_name(settings.signal);
  m.lower = apd.layout().lower;
  m.upper = apd.layout().upper;
  m.percentage = apd.percentages();
  m.samples = static_cast<std::uint32_t>(apd.samples());
  m.below = static_cast<std::uint32_t>(apd.below());
  m.above = static_cast<std::uint32_t>(apd.above());
  m.skewness = apd.skewness();
  m.kurtosis = apd.kurtosis();
  return m;
}

std::uint8_t code(diagnosis::Status status) {
  switch (status) {
    case diagnosis::Status::ok:
      return EstimateMessage::OK;
    case diagnosis::Status::below_range:
      return EstimateMessage::BELOW_RANGE;
    case diagnosis::Status::above_range:
      return EstimateMessage::ABOVE_RANGE;
    case diagnosis::Status::out_of_domain:
      return EstimateMessage::OUT_OF_DOMAIN;
    case diagnosis::Status::insufficient_data:
      return EstimateMessage::INSUFFICIENT_DATA;
    case diagnosis::Status::ambiguous:
      break;
  }
  return EstimateMessage::AMBIGUOUS;
}

}  // namespace

backlash_diagnosis::AmplitudeDistribution to_message(const diagnosis::PeriodResult& period,
                                                     const diagnosis::ApdSettings& settings,
                                                     double period_length) {
  auto m = distribution(period.apd, settings);
  m.mean = period.signal.mean();
  m.standard_deviation = period.signal.standard_deviation();
  m.period = period_length;
  m.periods = 1;
  return m;
}

backlash_diagnosis::AmplitudeDistribution to_message(const diagnosis::ApdResult& apd,
                                                     const diagnosis::ApdSettings& settings) {
  auto m = distribution(apd.total, settings);
  m.skewness = apd.skewness;
  m.period = apd.period;
  m.periods = static_cast<std::uint32_t>(apd.periods.size());
  double sum = 0, squares = 0;  // of equally long periods
  for (const diagnosis::PeriodResult& period : apd.periods) {
    sum += period.signal.mean();
    squares += std::pow(period.signal.mean(), 2) + std::pow(period.signal.standard_deviation(), 2);
  }
  const double n = apd.periods.empty() ? kNaN : apd.periods.size();
  m.mean = sum / n;
  m.standard_deviation = std::sqrt(std::max(0.0, squares / n - m.mean * m.mean));
  return m;
}

backlash_diagnosis::BacklashEstimate to_message(const diagnosis::Estimate& e, const ros::Time& stamp) {
  EstimateMessage m;
  if (!stamp.isZero()) m.header.stamp = stamp - ros::Duration(e.age);
  m.method = e.method;
  m.status = code(e.status);
  m.status_name = diagnosis::to_string(e.status);
  m.backlash = e.backlash;
  m.lower = e.lower;
  m.upper = e.upper;
  m.backlash_angle = e.backlash_angle;
  m.angle_lower = e.angle_lower;
  m.angle_upper = e.angle_upper;
  m.skewness = e.skewness;
  const diagnosis::PlayComponents parts = e.components.value_or(diagnosis::PlayComponents{});
  m.gap = parts.gap;
  m.compliance = parts.compliance;
  m.coulomb = parts.coulomb;
  m.at_torque = parts.at_torque;
  m.message = e.message;
  return m;
}

backlash_diagnosis::Verdict to_message(const diagnosis::Verdict& verdict,
                                       const std::vector<diagnosis::Estimate>& estimates) {
  backlash_diagnosis::Verdict m;
  m.grade = diagnosis::to_string(verdict.grade);
  m.estimate = verdict.estimate;
  m.agreement = verdict.agreement;
  for (const int i : verdict.members) m.members.push_back(estimates[i].method);
  for (const int i : verdict.dissenters) m.dissenters.push_back(estimates[i].method);
  m.backlash = verdict.backlash;
  m.lower = verdict.lower;
  m.upper = verdict.upper;
  m.backlash_angle = verdict.backlash_angle;
  m.angle_lower = verdict.angle_lower;
  m.angle_upper = verdict.angle_upper;
  m.growth = verdict.growth;
  m.growth_lower = verdict.growth_lower;
  m.growth_upper = verdict.growth_upper;
  m.message = verdict.message;
  return m;
}

backlash_diagnosis::MonitoringCurve to_message(const diagnosis::MonitoringCurve& curve) {
  const diagnosis::CurveConditions& c = curve.conditions;
  backlash_diagnosis::MonitoringCurve m;
  m.rig = c.rig;
  m.version = c.version;
  m.signal = c.signal;
  m.excitation = c.excitation;
  m.amplitude = c.amplitude;
  m.frequency = c.frequency;
  m.sampling_rate = c.sampling_rate;
  m.classes = static_cast<std::uint32_t>(c.apd.classes);
  m.lower = c.apd.lower;
  m.upper = c.apd.upper;
  m.periods = static_cast<std::uint32_t>(c.periods);
  m.seeds = static_cast<std::uint32_t>(c.seeds);
  m.noise = c.noise;
  for (const diagnosis::CurvePoint& point : curve.points) {
    backlash_diagnosis::MonitoringCurvePoint p;
    p.backlash = point.backlash;
    p.skewness = curve.nominal(point).mean;
    p.scatter = std::hypot(curve.nominal(point).between, curve.nominal(point).within);
    p.monotonic = point.monotonic;
    m.points.push_back(p);
  }
  return m;
}

ros::Time to_stamp(double time) {
  constexpr double kEnd = 4294967295.0;  // s, the last that fits
  return time > 0 && time < kEnd ? ros::Time(time) : ros::Time();
}

backlash_diagnosis::Change to_message(const diagnosis::KnownChange& change, const std::string& joint) {
  constexpr double k95 = 1.959964;  // standard errors of a 95 % interval
  using Message = backlash_diagnosis::Change;
  const diagnosis::FoundChange& found = change.found;
  Message m;
  m.joint = joint;
  m.id = static_cast<std::uint32_t>(change.id);
  m.state = change.state == diagnosis::ChangeState::standing ? Message::STANDING
            : change.state == diagnosis::ChangeState::ended  ? Message::ENDED
            : change.state == diagnosis::ChangeState::unseen ? Message::UNSEEN
                                                             : Message::WITHDRAWN;
  m.state_name = diagnosis::to_string(change.state);
  m.effect = found.effect;
  m.equivalent_to = found.equivalent_to;
  for (const diagnosis::FoundSize& s : found.size) {
    backlash_diagnosis::ChangeSize size;
    size.name = s.name;
    size.unit = s.unit;
    size.value = s.value;
    size.lower = s.value - k95 * s.standard_error;
    size.upper = s.value + k95 * s.standard_error;
    m.size.push_back(size);
  }
  m.since = to_stamp(found.since);
  m.since_from = to_stamp(found.since_from);
  m.since_to = to_stamp(found.since_to);
  if (found.until) m.until = to_stamp(*found.until);
  m.gain = found.gain;
  m.error_before = found.error_before;
  m.error_after = found.error_after;
  m.text = report::change_text(found);
  return m;
}

}  // namespace backlash::ros_bridge
