// SPDX-License-Identifier: BSD-3-Clause
#include "rig_stretches.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::changes {
namespace {

using record::Channel;

constexpr std::size_t kReversals = 8;  // of a stretch. Choice: with more the errors hardly shrink
constexpr double kTurned = 0.3;        // of the middle size, beyond which the torque is on a side. Choice
constexpr double kContext = 2;   // of a stretch, to either side: shows where a square wave reverses. Choice
constexpr double kUneven = 0.1;  // of an interval, error of a stamp. Choice: the fit asks for less
constexpr double kGap = 2.5;     // intervals between samples that are none. Choice
constexpr double kOtherLevel =
    1.25;                        // times the drive of the healthy records that is extrapolated to. Choice
constexpr double kLouder = 1.5;  // times the healthy residual, that follows no machine. Choice
constexpr double kModelError = 0.002;  // of the swing, as in the fit: no model is better
constexpr double kMoreLeftOut =
    0.25;  // of the reversals, more than of the healthy machine. Choice: two of eight
constexpr double kChangeSpread = 30;  // in coordinates, of a change of all values: as good as free. Choice
constexpr double kLeastPlay =
    0.1;                     // of the finest backlash that can be estimated, or of the healthy one. Choice
constexpr double kWide = 3;  // spread of the logarithm of the backlash: as good as free. Choice

/// First sample on another side than before.
std::vector<std::size_t> reversals_of(const std::vector<double>& torque, double level) {
  std::vector<std::size_t> found;
  int state = 0;
  for (std::size_t i = 0; i < torque.size(); ++i) {
    const int now = torque[i] > kTurned * level ? 1 : torque[i] < -kTurned * level ? -1 : state;
    if (state != 0 && now != state) found.push_back(i);
    state = now;
  }
  return found;
}

/// Stamps that no clock made say nothing of the machine.
bool even(const record::Record& record, const Stretch& at) {
  const double interval = record.sampling_interval();
  const auto first = std::lower_bound(record.time.begin(), record.time.end(), at.from);
  for (auto t = first; t != record.time.end() && *t < at.to; ++t)
    if (std::fabs(*t - *first - double(t - first) * interval) > kUneven * interval) return false;
  return true;
}

bool explained(const FittedStretch& s, const HealthyRig& rig) {
  for (int c = 0; c < 2; ++c) {
    if (!(rig.residual[c] > 0)) continue;
    const double healthy = std::max(rig.residual[c], kModelError * rig.swing[c]);
    if (!(s.residual[c] <= kLouder * healthy * std::max(1.0, s.swing[c] / rig.swing[c]))) return false;
  }
  return s.left_out <= rig.left_out + kMoreLeftOut;
}

/// Score and information at the healthy machine, in the coordinates of its values, made less certain by what
/// a stretch may be off by itself: of the information I and that spread Q the rest is (1 + I Q)^-1 I.
void take_score(const diagnosis::WaveformValues& found, const HealthyRig& rig, FittedStretch& out) {
  const Eigen::Index count = found.z.size();
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(count), at = found.z, jitter(count);
  const double unit = rig.values[0].value;
  // Where there is almost no play, its logarithm is arbitrary.
  scale[0] = unit / (std::max(found.backlash, kLeastPlay * unit) * found.spread[0]);
  at[0] = (found.backlash - rig.backlash) / unit;
  for (Eigen::Index i = 0; i < count; ++i)
    jitter[i] = std::pow(rig.values[static_cast<std::size_t>(i)].jitter, 2);
  const Eigen::MatrixXd information = scale.asDiagonal() * found.information * scale.asDiagonal();
  const Eigen::VectorXd score = information * at + scale.cwiseProduct(found.slope);
  Eigen::MatrixXd right(count, count + 1);
  right << information, score;
  Eigen::MatrixXd mixed = information * jitter.asDiagonal();
  mixed.diagonal().array() += 1;
  const Eigen::MatrixXd solved = signal::solve_square(mixed, right);
  out.information = (solved.leftCols(count) + solved.leftCols(count).transpose()) / 2;
  out.score = solved.col(count);
}

void take(const diagnosis::WaveformValues& found, const HealthyRig& rig, FittedStretch& out) {
  out.judged = found.status == diagnosis::Status::ok;
  out.unexplained = false;
  out.reason = found.reason;
  if (!out.judged) {
    out.unexplained = found.status != diagnosis::Status::insufficient_data;
    return;
  }
  for (int c = 0; c < 2; ++c) out.residual[c] = found.residual[c], out.swing[c] = found.swing[c];
  out.left_out = double(found.left_out) / found.windows;
  out.unexplained = !explained(out, rig);
  if (!out.unexplained) return take_score(found, rig, out);
  out.judged = false;
  out.reason = found.doubt.empty() ? "more is left of the torque than of the healthy machine" : found.doubt;
}

}  // namespace

StretchCutter::StretchCutter(const record::Record& record) {
  const std::vector<double>& torque = record.column(Channel::motor_torque);
  const std::vector<std::size_t> at = reversals_of(torque, drive_level(record));
  const double gap = kGap * record.sampling_interval();
  std::vector<std::size_t> gaps = {0};
  for (std::size_t i = 1; i < record.size(); ++i)
    gaps.push_back(gaps.back() + (record.time[i] - record.time[i - 1] > gap ? 1 : 0));
  for (std::size_t k = 1; k + kReversals <= at.size(); ++k) {
    const std::size_t first = (at[k - 1] + at[k]) / 2, next = k + kReversals;
    const std::size_t last = (next < at.size() ? at[next] : record.size()) - 1;
    if (gaps[first] != gaps[last]) continue;
    all_.push_back({record.time[first], record.time[last]});
    longest_ = std::max(longest_, all_.back().to - all_.back().from);
  }
  if (all_.empty())
    throw CannotIdentify(record.name + ": nowhere eight reversals of the motor's torque in a row");
}

Stretch StretchCutter::nearest(double time) const {
  return *std::min_element(all_.begin(), all_.end(), [&](const Stretch& a, const Stretch& b) {
    return std::fabs(a.middle() - time) < std::fabs(b.middle() - time);
  });
}

std::vector<Stretch> StretchCutter::spread(int count) const {
  std::vector<Stretch> chosen;
  const double first = all_.front().middle(), last = all_.back().middle();
  for (int i = 0; i < count; ++i) {
    const Stretch s = nearest(first + (last - first) * (count > 1 ? double(i) / (count - 1) : 0.5));
    if (chosen.empty() || s.from >= chosen.back().to) chosen.push_back(s);
  }
  return chosen;
}

double gain_of_all(const Eigen::VectorXd& score, const Eigen::MatrixXd& information) {
  Eigen::MatrixXd with_spread = information;
  with_spread.diagonal().array() += 1 / (kChangeSpread * kChangeSpread);
  return score.dot(signal::solve_symmetric(with_spread, score).col(0));
}

double drive_level(const record::Record& record) {
  std::vector<double> size;
  for (const double t : record.column(Channel::motor_torque)) size.push_back(std::fabs(t));
  return size.empty() ? 0 : signal::median(size);
}

record::Record with_context(const record::Record& record, const Stretch& at) {
  const double reach = kContext * (at.to - at.from);
  return record.slice(at.from - reach, at.to + reach);
}

FittedStretch fit_stretch(const record::Record& record, const Stretch& at, const HealthyRig& rig) {
  FittedStretch out;
  out.at = at;
  out.level = drive_level(record.slice(at.from, at.to));
  if (rig.most_level > 0 &&
      !(out.level <= kOtherLevel * rig.most_level && kOtherLevel * out.level >= rig.least_level)) {
    out.reason = fmt::format("driven by {:.2g} N m, the healthy records by {:.2g} to {:.2g} N m", out.level,
                             rig.least_level, rig.most_level);
    return out;
  }
  if (!even(record, at)) {
    out.reason = "the samples are not evenly spaced in time";
    return out;
  }
  const double near = std::max(rig.backlash, rig.settings.finest());
  const record::Record around = with_context(record, at);
  take(diagnosis::waveform_values(around, at.from, at.to, rig.settings, near, kWide), rig, out);
  // What is far from the healthy machine may need a search from everywhere.
  if (out.unexplained) take(diagnosis::waveform_values(around, at.from, at.to, rig.settings), rig, out);
  return out;
}

}  // namespace backlash::changes
