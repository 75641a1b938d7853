// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "rig_stretches.h"

namespace backlash::changes {
namespace {

constexpr int kLeastOfRecord = 4;   // stretches. Choice
constexpr int kFirstTries = 3;      // stretches that may determine the machine first. Choice
constexpr std::size_t kFewest = 4;  // that must fit. Choice: their scatter is needed
// Choices, what a stretch may be off by itself:
constexpr double kJitter = 0.002;                         // of a value, as the equations are no better
constexpr double kFinestJitter = 0.1;                     // of the finest backlash that can be estimated
constexpr double kJitterOfTime = 0.02, kLeastTime = 0.1;  // of the interval between samples, of a delay
constexpr double kSureOfScatter = 0.05;                   // chance that the healthy stretches scatter less

/// Values that wander with temperature and oil.
bool wanders(const std::string& name) {
  static const std::set<std::string> names = {"motor_viscous",   "motor_coulomb",  "friction_speed",
                                              "load_viscous",    "load_coulomb",   "contact_loss",
                                              "contact_damping", "sensor_damping", "output_damping"};
  return names.count(name) > 0;
}

RigValue gap_value(const HealthyRig& rig, const ChangeSettings& s) {
  RigValue v;
  const double finest = rig.settings.finest();
  v.name = "backlash", v.unit = rig.settings.angular ? "rad" : "m";
  v.value = std::max(rig.backlash, finest);
  v.jitter = std::hypot(kJitter, kFinestJitter * finest / v.value);
  v.day = std::hypot(s.prior_share, finest / v.value);
  v.least = std::max(s.prior_share, finest / v.value);
  return v;
}

RigValue machine_value(const HealthyRig& rig, std::size_t quantity, double spread, double level,
                       double interval, const ChangeSettings& s) {
  const diagnosis::WaveformQuantity& q = diagnosis::waveform_quantities()[quantity];
  RigValue v;
  v.name = q.name, v.unit = q.unit_in(rig.settings);
  v.factor = q.factor, v.value = rig.settings.*q.at, v.spread = spread;
  v.power = diagnosis::scale_power(q, rig.settings);
  const bool wander = wanders(v.name);
  const double off = wander ? s.wander : kJitter, day = wander ? s.drift : s.prior_share;
  if (q.factor) {
    v.jitter = off / spread, v.day = day / spread;
    v.least = std::max(s.prior_share, 2 * off) / spread;
  } else if (wander) {  // a torque
    v.jitter = std::hypot(off * v.value, s.prior_least * level) / spread;
    v.day = std::hypot(day * v.value, s.prior_share * level) / spread;
    v.least = std::max(2 * off * v.value, s.prior_share * level) / spread;
  } else {  // a time
    v.jitter = kJitterOfTime * interval / spread;
    v.day = v.least = kLeastTime * interval / spread;
  }
  return v;
}

/// The machine as the first stretches of the first record that fit show it, about which all others are
/// looked at.
void take_machine(const record::Record& record, const ChangeSettings& settings, HealthyRig& rig) {
  diagnosis::WaveformValues found;
  std::string reason;
  for (const Stretch& at : StretchCutter(record).spread(kFirstTries)) {
    found = diagnosis::waveform_values(with_context(record, at), at.from, at.to, rig.settings);
    reason = found.status == diagnosis::Status::ok ? found.doubt : found.reason;
    if (reason.empty()) break;
  }
  if (!reason.empty()) throw CannotIdentify(record.name + ": " + reason);
  const auto& all = diagnosis::waveform_quantities();
  rig.backlash = found.backlash;
  rig.settings.common_scale = 0;
  rig.values = {gap_value(rig, settings)};
  rig.values[0].scale_error = found.log_error;
  const auto count = found.information.rows();
  const Eigen::MatrixXd known =
      signal::symmetric_inverse(found.information + Eigen::MatrixXd::Identity(count, count));
  const double level = drive_level(record), interval = record.sampling_interval();
  for (std::size_t i = 0; i < found.quantities.size(); ++i) {
    const diagnosis::WaveformQuantity& q = all[found.quantities[i]];
    double& value = rig.settings.*q.at;
    const double move = found.spread[i + 1] * found.z[static_cast<Eigen::Index>(i) + 1];
    value = q.factor ? value * std::exp(move) : std::max(0.0, value + move);
    rig.settings.spread.*q.spread = found.spread[i + 1];
    rig.values.push_back(
        machine_value(rig, found.quantities[i], found.spread[i + 1], level, interval, settings));
    const auto k = static_cast<Eigen::Index>(i) + 1;
    if (q.factor) rig.values.back().scale_error = found.spread[i + 1] * std::sqrt(known(k, k));
    // From torque alone a length is known as well as this; where there is no play, its logarithm is not.
    if (q.at == &diagnosis::WaveformSettings::sensor_stiffness)
      rig.values[0].scale_error = std::min(found.log_error, rig.values.back().scale_error);
  }
}

/// The values one by one, and:
///   motor_torque_gain    the motor's torque is 1/k of what is recorded: all torques of
///                        the machine times k, and the sensor's gain
///                        over k, move as it does
///   motor_position_gain  by the symmetry of waveform.h: values times k^-power show k times the position
std::vector<RigEffect> effects_of(const HealthyRig& rig, const ChangeSettings& settings) {
  const auto count = static_cast<Eigen::Index>(rig.values.size());
  std::vector<RigEffect> all;
  RigEffect torque{"motor_torque_gain", "-", Eigen::VectorXd::Zero(count), settings.prior_share},
      position{"motor_position_gain", "-", Eigen::VectorXd::Zero(count), settings.prior_share};
  position.direction[0] = rig.backlash / rig.values[0].value;
  for (Eigen::Index i = 0; i < count; ++i) {
    const RigValue& v = rig.values[static_cast<std::size_t>(i)];
    all.push_back({v.name, v.unit, Eigen::VectorXd::Unit(count, i), v.least, 1, static_cast<int>(i)});
    if (i == 0) continue;
    const double one = (v.factor ? 1 : v.value) / v.spread;
    position.direction[i] = -v.power * one;
    const bool no_torque = v.name == "friction_speed" || v.name == "contact_loss" ||
                           v.name == "sensor_delay" || v.name == "sensor_time_constant";
    torque.direction[i] = v.name == "sensor_gain" ? -one : no_torque ? 0 : one;
  }
  all.push_back(torque);
  if (rig.residual[1] > 0) all.push_back(position);
  return all;
}

using Fits = std::vector<std::vector<FittedStretch>>;

std::vector<const FittedStretch*> judged_of(const std::vector<FittedStretch>& fits) {
  std::vector<const FittedStretch*> out;
  for (const FittedStretch& f : fits)
    if (f.judged) out.push_back(&f);
  return out;
}

Fits fit_all(const std::vector<record::Record>& healthy, const HealthyRig& rig, int stretches) {
  Fits all;
  const int each = std::max(kLeastOfRecord, stretches / static_cast<int>(healthy.size()));
  for (const record::Record& record : healthy) {
    all.emplace_back();
    std::string reason;
    for (const Stretch& at : StretchCutter(record).spread(each)) {
      all.back().push_back(fit_stretch(record, at, rig));
      if (!all.back().back().judged) reason = all.back().back().reason;
    }
    if (2 * judged_of(all.back()).size() <= all.back().size())
      throw CannotIdentify(record.name + ": most of it does not fit the machine of the rig file: " + reason);
  }
  return all;
}

void take_residuals(const Fits& fits, HealthyRig& rig) {
  std::vector<double> residual[2], swing[2], left_out, level;
  for (const auto& of_record : fits)
    for (const FittedStretch* f : judged_of(of_record)) {
      for (int c = 0; c < 2; ++c) residual[c].push_back(f->residual[c]), swing[c].push_back(f->swing[c]);
      left_out.push_back(f->left_out), level.push_back(f->level);
    }
  for (int c = 0; c < 2; ++c) {
    const bool seen = std::none_of(residual[c].begin(), residual[c].end(), [](double r) { return !(r > 0); });
    rig.residual[c] = seen ? signal::median(residual[c]) : 0;
    rig.swing[c] = seen ? signal::median(swing[c]) : 0;
  }
  rig.left_out = *std::max_element(left_out.begin(), left_out.end());
  rig.least_level = *std::min_element(level.begin(), level.end());
  rig.most_level = *std::max_element(level.begin(), level.end());
}

Eigen::VectorXd mean_of(const std::vector<const FittedStretch*>& fits, const Eigen::VectorXd& spread) {
  Eigen::MatrixXd information = spread.cwiseAbs2().cwiseInverse().asDiagonal();
  Eigen::VectorXd score = Eigen::VectorXd::Zero(spread.size());
  for (const FittedStretch* f : fits) information += f->information, score += f->score;
  return signal::solve_symmetric(information, score);
}

/// Mean over the records, how they differ, and how their stretches scatter about them.
void take_statistics(const Fits& fits, const ChangeSettings& settings, HealthyRig& rig) {
  const auto count = static_cast<Eigen::Index>(rig.values.size());
  std::vector<const FittedStretch*> all;
  const Eigen::VectorXd free = Eigen::VectorXd::Ones(count);
  Eigen::VectorXd least = Eigen::VectorXd::Constant(count, 1e300), most = -least;
  std::vector<double> squares(rig.effects.size(), 0);
  double of_all = 0, most_of_all = 0;
  for (const auto& of_record : fits) {
    const auto judged = judged_of(of_record);
    all.insert(all.end(), judged.begin(), judged.end());
    const Eigen::VectorXd own = mean_of(judged, free);
    least = least.cwiseMin(own), most = most.cwiseMax(own);
    for (const FittedStretch* f : judged) {
      const Eigen::VectorXd left = f->score - f->information * own;
      for (std::size_t i = 0; i < squares.size(); ++i) {
        const Eigen::VectorXd& d = rig.effects[i].direction;
        const double information = d.dot(f->information * d);
        if (information > 0) squares[i] += std::pow(d.dot(left), 2) / information;
      }
      const double gain = gain_of_all(left, f->information);
      of_all += gain, most_of_all = std::max(most_of_all, gain);
    }
  }
  if (all.size() < kFewest)
    throw CannotIdentify(
        fmt::format("only {} stretches of the healthy records fit: {} are needed", all.size(), kFewest));
  rig.mean = mean_of(all, free);
  rig.day.resize(count);
  for (Eigen::Index i = 0; i < count; ++i)
    rig.day[i] = std::pow(rig.values[static_cast<std::size_t>(i)].day, 2) +
                 std::pow(settings.prior_factor * (most[i] - least[i]) / 2, 2);
  const double degrees = double(all.size()) - double(fits.size());
  for (std::size_t i = 0; i < squares.size(); ++i)
    rig.effects[i].inflation =
        std::max(1.0, squares[i] / signal::chi_square_quantile(kSureOfScatter, degrees));
  const double values = double(count);
  rig.inflation_of_all =
      std::max({1.0, of_all / signal::chi_square_quantile(kSureOfScatter, degrees * values),
                most_of_all / signal::chi_square_quantile(1 - kSureOfScatter / double(all.size()), values)});
}

}  // namespace

HealthyRig commission_rig(const std::vector<record::Record>& healthy,
                          const diagnosis::WaveformSettings& machine, const ChangeSettings& settings) {
  HealthyRig rig;
  rig.settings = machine;
  take_machine(healthy.front(), settings, rig);
  const Fits fits = fit_all(healthy, rig, settings.rig_healthy_stretches);
  take_residuals(fits, rig);
  rig.effects = effects_of(rig, settings);
  take_statistics(fits, settings, rig);
  return rig;
}

}  // namespace backlash::changes
