// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/model_comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/identification/procedures/ringing.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "backlash_diagnosis/simulation/plant.h"

namespace backlash::identification {
namespace {

using Values = std::vector<double>;

constexpr double kHysteresis = 0.25;   // of the range of the deflection, either side of its middle
constexpr double kBeyondRange = 0.1;   // of the samples, on either side
constexpr double kSettling = 1.5;      // periods of the ringing after the first peak, in which teeth may part
constexpr double kTurnsOfRinging = 3;  // periods that are fitted

Values difference(const Values& a, const Values& b) {
  Values d(a.size());
  for (std::size_t k = 0; k < a.size(); ++k) d[k] = a[k] - b[k];
  return d;
}

double median_of_finite(Values values) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); }),
               values.end());
  return signal::median(std::move(values));
}

/// Flank changes: the deflection comes from one side of its range and reaches the other.
std::vector<Engagement> find_engagements(const ComparedRecord& r, const ComparisonSettings& s) {
  const double low = signal::quantile(r.raw_deflection, kBeyondRange),
               high = signal::quantile(r.raw_deflection, 1 - kBeyondRange);
  const double middle = 0.5 * (low + high), margin = kHysteresis * (high - low);
  const auto samples = [&](double seconds) { return std::lround(seconds / r.data.interval); };
  const long n = long(r.data.size()), before = samples(s.before), after = samples(s.after);
  std::vector<Engagement> found;
  int side = 0;
  for (long k = 0; k < n; ++k) {
    const double x = r.raw_deflection[k] - middle;
    const int reached = x > 0 ? 1 : -1;
    if (std::fabs(x) < margin || reached == side) continue;
    long at = k;  // back to where it passed the middle
    while (at > 0 && reached * (r.raw_deflection[at - 1] - middle) > 0) --at;
    if (side != 0 && at >= before && at + after < n) {
      if (!found.empty() && long(found.back().to) > at - before) found.back().to = at - before;
      found.push_back({r.time[at], r.data.load[at], reached, std::size_t(at - before), std::size_t(at),
                       std::size_t(at + after)});
    }
    side = reached;
  }
  // Teeth that are thrown back at once do not count as an engagement.
  const auto too_short = [&](const Engagement& e) { return e.to < e.middle + std::size_t(before); };
  found.erase(std::remove_if(found.begin(), found.end(), too_short), found.end());
  return found;
}

/// Sums of one channel over the samples that count.
class Sums {
 public:
  void add(double measured, double predicted) {
    ++n_;
    sum_ += measured;
    square_ += measured * measured;
    residual_ += std::pow(measured - predicted, 2);
    peak_ = std::max(peak_, std::fabs(measured - predicted));
  }
  ChannelComparison result(const char* unit, double noise) const {
    const double spread = std::sqrt(square_ - sum_ * sum_ / n_);
    return {unit, std::sqrt(residual_) / spread, noise * std::sqrt(n_) / spread, std::sqrt(residual_ / n_),
            peak_};
  }

 private:
  double n_ = 0, sum_ = 0, square_ = 0, residual_ = 0, peak_ = 0;
};

ChannelComparison compare(const Values& measured, const Values& predicted, const char* unit, double noise,
                          const std::vector<char>& counts = {}) {
  Sums sums;
  for (std::size_t k = 0; k < measured.size(); ++k)
    if (counts.empty() || counts[k]) sums.add(measured[k], predicted[k]);
  return sums.result(unit, noise);
}

/// The machine through the engagements, driven by the torque of the record.
class FreeRuns {
 public:
  FreeRuns(const model::Rig& rig, const ComparedRecord& record, const simulation::DrivenLoad& followed,
           const Calibration& calibration)
      : plant_(rig, topic(), {}), record_(record), followed_(followed) {
    torque_ = signal::delayed(record.data.torque, calibration.torque_delay);
    if (!calibration.held)  // of the moment: its mean between samples
      for (std::size_t k = 0; k + 1 < torque_.size(); ++k) torque_[k] = 0.5 * (torque_[k] + torque_[k + 1]);
    for (Values* column : {&motor_speed, &deflection, &speed_difference})
      column->assign(record.data.size(), kNaN);
    offset_ = calibration.encoder_offset;
  }

  void run(const Engagement& e) {
    const auto speeds = std::size_t(plant_.gear_train().dof());  // 3 with a load behind a shaft
    simulation::Plant::State start{record_.data.motor[e.from]};
    start[speeds] = record_.data.motor_rate[e.from];
    for (std::size_t body = 1; body < speeds; ++body) {
      start[body] = followed_.load[e.from];
      start[speeds + body] = followed_.load_rate[e.from];
    }
    plant_.reset();
    plant_.set_state(start);
    for (std::size_t k = e.from; k < e.to; ++k) {
      const simulation::Plant::State& s = plant_.state();
      motor_speed[k] = s[speeds];
      deflection[k] = s[0] - s[1] - offset_;
      speed_difference[k] = s[speeds] - s[speeds + 1];
      plant_.set_torque(torque_[k]);
      plant_.advance_to(double(k + 1 - e.from) * record_.data.interval);
    }
  }

  Values motor_speed, deflection, speed_difference;  // NaN between engagements

 private:
  static simulation::ExcitationSettings topic() {
    simulation::ExcitationSettings settings;
    settings.type = "topic";
    return settings;
  }
  simulation::Plant plant_;
  const ComparedRecord& record_;
  const simulation::DrivenLoad& followed_;
  Values torque_;
  double offset_;
};

/// Largest excursion towards the flank that is reached, as sample.
std::size_t first_peak(const Values& speed_difference, const Engagement& e) {
  std::size_t peak = e.middle;
  for (std::size_t k = e.from; k < e.to; ++k)
    if (e.direction * speed_difference[k] > e.direction * speed_difference[peak]) peak = k;
  return peak;
}

/// Damped sine from kSettling on.
Ringing ringing_after(const Values& speed_difference, const Engagement& e, double interval, double expected) {
  const double period = 2 * M_PI / expected;
  const std::size_t from = first_peak(speed_difference, e) + std::lround(kSettling * period / interval);
  const std::size_t to = std::min(e.to, from + std::lround(kTurnsOfRinging * period / interval));
  if (from >= to) throw CannotIdentify("too short");
  const Values values(speed_difference.begin() + from, speed_difference.begin() + to);
  Values time(values.size());
  for (std::size_t k = 0; k < time.size(); ++k) time[k] = double(k) * interval;
  return fit_ringing(time, values, expected);
}

EngagementPeak compare_peaks(const ComparedRecord& record, const Values& predicted, const Engagement& e,
                             double expected) {
  EngagementPeak p{};
  p.measured = e.direction * record.speed_difference[first_peak(record.speed_difference, e)];
  p.predicted = e.direction * predicted[first_peak(predicted, e)];
  p.measured_frequency = p.predicted_frequency = p.measured_damping_ratio = p.predicted_damping_ratio = kNaN;
  try {
    const Ringing measured = ringing_after(record.speed_difference, e, record.data.interval, expected);
    const Ringing model = ringing_after(predicted, e, record.data.interval, expected);
    p.measured_frequency = measured.frequency.value / (2 * M_PI);
    p.predicted_frequency = model.frequency.value / (2 * M_PI);
    p.measured_damping_ratio = measured.damping_ratio.value;
    p.predicted_damping_ratio = model.damping_ratio.value;
  } catch (const CannotIdentify&) {  // no ringing to speak of
  }
  return p;
}

double natural_frequency(const model::Rig& rig) {
  if (!rig.mesh.contact_spec().values.has("stiffness"))
    throw InvalidParameter("contact.law", rig.mesh.contact_spec().law, "needs a stiffness to be compared");
  const model::GearTrain train(rig);
  const double m = train.motor_inertia(), l = train.load_inertia();
  return std::sqrt(rig.mesh.contact_spec().values.at("stiffness") * (m + l) / (m * l));
}

void compare_followed(const ServoPrediction& p, const ComparedRecord& record, ModelComparison& result) {
  result.followed["torque"] = compare(p.measured_torque, p.torque, "N m", p.torque_floor, p.counts);
  result.followed["deflection"] =
      compare(record.deflection, p.deflection, "rad", p.deflection_floor, p.settled);
  // The motor is the recorded one in both.
  result.followed["speed_difference"] =
      compare(record.speed_difference, difference(record.motor_speed, p.load.load_rate), "rad/s",
              signal::white_noise(record.load_speed), p.settled);
  result.traces.deflection = p.deflection;
}

void compare_free(const model::Rig& rig, const ComparedRecord& record, const simulation::DrivenLoad& followed,
                  ModelComparison& result) {
  result.peak_ratio = result.frequency_ratio = result.damping_ratio = kNaN;
  if (record.engagements.empty()) return;
  FreeRuns runs(rig, record, followed, result.calibration);
  std::vector<char> counts(record.data.size(), 0);
  const double expected = natural_frequency(rig);
  Values peak, frequency, damping;
  for (const Engagement& e : record.engagements) {
    runs.run(e);
    std::fill(counts.begin() + e.from, counts.begin() + e.to, 1);
    const EngagementPeak p = compare_peaks(record, runs.speed_difference, e, expected);
    peak.push_back(p.predicted / p.measured);
    frequency.push_back(p.predicted_frequency / p.measured_frequency);
    damping.push_back(p.predicted_damping_ratio / p.measured_damping_ratio);
    result.peaks.push_back(p);
  }
  result.peak_ratio = median_of_finite(peak);
  result.frequency_ratio = median_of_finite(frequency);
  result.damping_ratio = median_of_finite(damping);
  const auto add = [&](const char* name, const Values& measured, const Values& predicted, const char* unit,
                       double noise) {
    result.free[name] = compare(measured, predicted, unit, noise, counts);
  };
  add("motor_speed", record.motor_speed, runs.motor_speed, "rad/s", signal::white_noise(record.motor_speed));
  add("speed_difference", record.speed_difference, runs.speed_difference, "rad/s",
      signal::white_noise(record.speed_difference));
  add("deflection", record.raw_deflection, runs.deflection, "rad",
      signal::white_noise(record.raw_deflection));
  result.traces.free_deflection = std::move(runs.deflection);
  result.traces.free_speed_difference = std::move(runs.speed_difference);
}

}  // namespace

ComparedRecord compared_record(const record::Record& given, const model::Rig& rig,
                               const ComparisonSettings& settings) {
  ComparedRecord r;
  r.data = servo_data(given, rig);
  if (r.data.load.empty()) throw CannotIdentify(given.name + ": a comparison needs load_position");
  const record::Record record = record::evenly_sampled(load_side(given, rig));
  r.time = record.time;
  r.raw_deflection = difference(r.data.motor, r.data.load);
  r.deflection = signal::low_pass(r.raw_deflection, r.data.interval, settings.cutoff);
  const bool speeds =
      record.has(record::Channel::motor_velocity) && record.has(record::Channel::load_velocity);
  r.motor_speed = speeds ? record.column(record::Channel::motor_velocity) : r.data.motor_rate;
  r.load_speed = speeds ? record.column(record::Channel::load_velocity) : r.data.load_rate;
  r.speed_difference = difference(r.motor_speed, r.load_speed);
  r.engagements = find_engagements(r, settings);
  return r;
}

std::vector<ModelComparison> compare_models(const std::vector<model::Rig>& rigs, const ComparedRecord& record,
                                            const ComparisonSettings& settings, const Progress& progress) {
  if (rigs.empty()) return {};
  FitSettings fit;
  fit.cutoff = settings.cutoff;
  fit = with_bands(fit, model::load_side(rigs.front()), {record.data});  // the same bands for all
  std::vector<ModelComparison> results(rigs.size());
  double done = 0;
  const auto step = [&](const std::string& phase) {
    if (progress && !progress(done++ / (2.0 * double(rigs.size())), phase)) throw Cancelled();
  };
  double least = std::numeric_limits<double>::infinity();
  Calibration best;
  for (std::size_t i = 0; i < rigs.size(); ++i) {
    step("calibrating to the record");
    Calibration& own = results[i].calibration;
    const ServoPrediction p = predict_calibrated(model::load_side(rigs[i]), record.data, fit, own);
    if (p.torque_error.error < least) best = own;
    least = std::min(least, p.torque_error.error);
  }
  for (std::size_t i = 0; i < rigs.size(); ++i) {
    step("comparing");
    results[i].calibration.torque_delay = best.torque_delay;
    results[i].calibration.held = best.held;
    const model::Rig rig = model::load_side(rigs[i]);
    const ServoPrediction p = predict_servo(rig, record.data, fit, results[i].calibration);
    compare_followed(p, record, results[i]);
    compare_free(rig, record, p.load, results[i]);
  }
  return results;
}

}  // namespace backlash::identification
