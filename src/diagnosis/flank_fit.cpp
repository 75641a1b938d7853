// SPDX-License-Identifier: BSD-3-Clause
#include "flank_fit.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// What is known of an encoder before the record is seen, standard deviations. Choices, of what machines have.
constexpr double kScale = 0.005;        // of the travel
constexpr double kEccentricity = 5e-4;  // rad: 100 arcsec, of a ring 0.05 mm off a radius of 0.1 m
constexpr double kSkew = 5e-3;          // s
constexpr double kDamping = 1e-2;       // s, damping over stiffness of the teeth
constexpr double kUneven = 0.15;        // by which one flank yields more than the other, relative
constexpr int kErrorKnots = 48;         // of the errors over the position, and
constexpr double kWindowsPerKnot = 40;  // at least
constexpr int kGapKnots = 9;            // the same of a gap that varies
constexpr double kWindowsPerGap = 200;
constexpr double kVaries = 1.25;     // ratio of residuals, constant over varying gap: choice
constexpr std::size_t kFewest = 12;  // windows on a flank: choice
constexpr double kClearly = 0.2;     // of the large torque, which presses a flank to begin with: choice
constexpr double kClear = 3;         // standard deviations of torque or residuals, the same: choice
constexpr double kLeast = 0.02;      // of the large torque, to which laws of the teeth are followed
constexpr double kStarts[] = {0, -1.5, 1.5};  // of the last of what is unsure, standard deviations
constexpr double kFarthest = 2;               // the same, to which it is followed: 95 %
constexpr double kClearlyBetter = 0.8;        // of residuals: choice
constexpr int kRounds = 5, kPerRound = 3, kSteps = 5;
constexpr double kSwings = 0.5;  // of the gap or the deflection
constexpr double kSteep = 0.02;  // relative step, of slopes
constexpr Index kSkewAt = 4, kElasticAt = 6, kUnsureAt = 8;

/// u + h u^3 = (1 + h) t.
double hardening(double t, double h) {
  const double p = 1 / h, q = (1 + h) * t / h;
  return 2 * std::sqrt(p / 3) * std::sinh(std::asinh(1.5 * q / p * std::sqrt(3 / p)) / 3);
}

Hats one_hat(std::size_t n) {
  return {1, std::vector<int>(n, 0), std::vector<double>(n, 0)};
}

}  // namespace

const std::vector<ToothLaw>& tooth_laws() {
  static const std::vector<ToothLaw> laws = [] {
    std::vector<ToothLaw> all;
    for (const double power : {2.0 / 3, 0.7, 0.73, 0.76, 0.8, 0.85, 0.9, 0.95, 1.0})
      all.push_back({power == 1 ? "a spring" : fmt::format("teeth that yield as the torque to {:.2g}", power),
                     [power](double t) { return std::pow(t, power); }});
    for (const double h : {0.05, 0.1, 0.2, 0.4, 0.8, 1.6})
      all.push_back({fmt::format("a spring that gets {:.2g} times as hard", 1 + 3 * h),
                     [h](double t) { return hardening(t, h); }});
    return all;
  }();
  return laws;
}

FlankReading::FlankReading(FlankWindows windows, FlankTorque torque, double elastic, double deviation,
                           double encoder_scale, const ToothLaw& law)
    : windows_(std::move(windows)),
      torque_(std::move(torque)),
      elastic_(elastic),
      deviation_(deviation),
      encoder_scale_(encoder_scale),
      errors_(position_hats(windows_.load, kErrorKnots, kWindowsPerKnot)),
      gap_(position_hats(windows_.load, kGapKnots, kWindowsPerGap)) {
  if (windows_.size() < 2 * kFewest || !(torque_.level > 0) || !(elastic_ > 0)) return;
  middle_ = std::accumulate(windows_.load.begin(), windows_.load.end(), 0.0) / double(windows_.size());
  Start best;
  const bool one_start = torque_.unsure.rightCols(1).isZero();
  for (const double last : kStarts) {
    if ((one_start && last != 0) || !search(last, law)) continue;
    if (!found_ || start_.scale < kClearlyBetter * best.scale) best = start_, found_ = true;
  }
  if (!found_) return;
  start_ = std::move(best);
  found_ = choose(false);
  start_.weight.clear();
  if (!found_) return;
  Start varying = start_;
  solve(law, start_, kPerRound, one_hat(windows_.size()));
  if (gap_.count == 0) return;
  solve(law, varying, kPerRound, gap_);
  varies_ = start_.scale > kVaries * varying.scale;
  if (varies_) start_ = std::move(varying);
}

bool FlankReading::search(double last, const ToothLaw& law) {
  start_ = Start();
  start_.x = VectorXd::Zero(torque_.unsure.cols());
  start_.x[start_.x.size() - 1] = last;
  for (int k = 0; k < kRounds; ++k) {
    if (!choose(2 * k <= kRounds)) return false;
    start_.weight.clear();
    solve(law, start_, kPerRound, one_hat(windows_.size()));
  }
  return true;
}

/// Windows that press one flank for sure, as their neighbours do.
bool FlankReading::choose(bool begins) {
  const auto n = Index(windows_.size());
  const VectorXd torque = torque_.torque + torque_.unsure * start_.x;
  std::vector<int> sides(std::size_t(n), 0);
  for (Index i = 0; i < n; ++i) {
    const double per_torque = start_.factor * elastic_ / torque_.level;
    const double clear = begins ? kClearly * torque_.level
                                : std::min(kClearly * torque_.level, kClear * start_.scale / per_torque);
    const double least =
        std::max(clear, kClear * torque_.noise) + torque_.unsure.row(i).norm() + torque_.still[i];
    const int side = torque[i] > least ? 1 : torque[i] < -least ? -1 : 0;
    // by what is declared, too: else friction that is found wrong finds its own flanks
    sides[std::size_t(i)] = side * torque_.torque[i] > 0 ? side : 0;
  }
  at_.clear(), side_.clear(), stay_.clear();
  used_[0] = used_[1] = stays_ = 0;
  for (std::size_t i = 1; i + 1 < sides.size(); ++i) {
    if (sides[i] == 0 || sides[i - 1] != sides[i] || sides[i + 1] != sides[i]) continue;
    const bool goes_on = !at_.empty() && side_.back() == sides[i] &&
                         2 * (windows_.centre[i] - windows_.centre[at_.back()]) < 3 * windows_.half;
    stays_ += !goes_on;
    at_.push_back(i), side_.push_back(sides[i]), stay_.push_back(stays_ - 1);
    ++used_[sides[i] > 0];
  }
  return std::min(used_[0], used_[1]) >= kFewest;
}

PriorRegression FlankReading::solve(const ToothLaw& law, Start& start, int steps, const Hats& gap) const {
  const Index unsure = torque_.unsure.cols(), gap_at = kUnsureAt + unsure, errors_at = gap_at + gap.count;
  PriorRegression fit;
  fit.mean = VectorXd::Zero(errors_at + errors_.count);
  fit.deviation = VectorXd::Constant(fit.mean.size(), INFINITY);
  const double eccentric = kEccentricity * encoder_scale_;
  fit.deviation.segment(1, 6) << kScale, eccentric, eccentric, kSkew, kDamping, deviation_;
  fit.deviation.segment(kUnsureAt, unsure).setOnes();
  fit.deviation[kElasticAt + 1] = kUneven;
  fit.mean[kElasticAt] = 1;
  fit.groups = stays_, fit.scale = start.scale, fit.weight = start.weight;
  double errors = start.errors > 0 ? start.errors : eccentric;
  for (int step = 0; step < steps; ++step) {
    fit.rows.clear();
    for (std::size_t k = 0; k < at_.size(); ++k) {
      const std::size_t i = at_[k];
      const VectorXd wrong = torque_.unsure.row(Index(i)).transpose();
      const double torque = torque_.torque[Index(i)] + wrong.dot(start.x);
      const double size = std::max(kLeast, std::abs(torque) / torque_.level);
      const double elastic = std::copysign(elastic_ * law.deflection(size), torque);
      const double slope = start.factor * elastic_ *
                           (law.deflection((1 + kSteep) * size) - law.deflection((1 - kSteep) * size)) /
                           (2 * kSteep * size * torque_.level);
      const double turn = windows_.load[i] / encoder_scale_;
      PriorRegression::Row row;
      row.group = stay_[k], row.y = windows_.deflection[i] + slope * wrong.dot(start.x);
      const double common[] = {1,
                               windows_.load[i] - middle_,
                               std::sin(turn),
                               std::cos(turn),
                               windows_.load_speed[i],
                               windows_.speed[i] - windows_.load_speed[i],
                               elastic,
                               std::abs(elastic)};
      for (Index c = 0; c < kUnsureAt; ++c) row.add(c, common[c]);
      for (Index c = 0; c < unsure; ++c) row.add(kUnsureAt + c, slope * wrong[c]);
      const auto add_hats = [&](const Hats& hats, Index from, double times) {
        if (hats.count == 0) return;
        row.add(from + hats.first[i], times * (1 - hats.share[i]));
        if (hats.share[i] != 0) row.add(from + hats.first[i] + 1, times * hats.share[i]);
      };
      add_hats(gap, gap_at, 0.5 * side_[k]);
      add_hats(errors_, errors_at, 1);
      fit.rows.push_back(row);
    }
    fit.deviation.tail(errors_.count).setConstant(errors);
    fit.step();
    start.x = fit.x.segment(kUnsureAt, unsure).cwiseMax(-kFarthest).cwiseMin(kFarthest);
    start.factor = std::clamp(fit.x[kElasticAt], 0.1, 10.0);
    if (errors_.count > 0) {  // their likeliest size (Dempster, Laird and Rubin 1977)
      const double squares = fit.x.tail(errors_.count).squaredNorm() +
                             fit.unit() * fit.inverse.diagonal().tail(errors_.count).sum();
      errors = std::clamp(std::sqrt(squares / errors_.count), 1e-7, 1.0);
    }
  }
  start.errors = errors, start.scale = fit.scale, start.weight = fit.weight;
  start.covariance = fit.unit() * fit.inverse.block(kUnsureAt, kUnsureAt, unsure, unsure);
  return fit;
}

FlankFit FlankReading::result(const ToothLaw& law, const Hats& gap) const {
  Start start = start_;
  const PriorRegression fit = solve(law, start, kSteps, gap);
  const Index gap_at = kUnsureAt + torque_.unsure.cols();
  VectorXd mean = VectorXd::Zero(fit.x.size());
  for (const std::size_t i : at_) {
    mean[gap_at + gap.first[i]] += (1 - gap.share[i]) / double(at_.size());
    if (gap.share[i] != 0) mean[gap_at + gap.first[i] + 1] += gap.share[i] / double(at_.size());
  }
  FlankFit out;
  out.gap = mean.dot(fit.x), out.standard_error = std::sqrt(fit.variance(mean));
  out.wrong = fit.x.segment(kUnsureAt, torque_.unsure.cols()).cwiseAbs().maxCoeff();
  out.varies = varies_ && gap.count > 1;
  out.least_gap = fit.x.segment(gap_at, gap.count).minCoeff();
  out.largest_gap = fit.x.segment(gap_at, gap.count).maxCoeff();
  out.compliance = fit.x[kElasticAt], out.elastic = std::abs(out.compliance) * elastic_;
  out.residual = fit.scale, out.skew = fit.x[kSkewAt], out.scale_error = fit.x[1];
  out.left = fit.left, out.independent = fit.independent();
  return out;
}

FlankFit FlankReading::fit(const ToothLaw& law) const {
  return result(law, varies_ ? gap_ : one_hat(windows_.size()));
}

std::size_t FlankReading::fit_part(const ToothLaw& law, std::size_t begin, std::size_t end,
                                   FlankFit& fit) const {
  FlankReading part = *this;
  const auto cut = [&](auto& list) {
    list.erase(list.begin() + std::ptrdiff_t(end), list.end());
    list.erase(list.begin(), list.begin() + std::ptrdiff_t(begin));
  };
  cut(part.at_), cut(part.side_), cut(part.stay_), cut(part.start_.weight);
  const std::size_t first = part.stay_.front();
  for (std::size_t& stay : part.stay_) stay -= first;
  part.stays_ = part.stay_.back() + 1;
  const auto up =
      std::size_t(std::count_if(part.side_.begin(), part.side_.end(), [](double s) { return s > 0; }));
  if (std::min(up, part.at_.size() - up) < kFewest) return 0;
  part.varies_ = false;
  fit = part.fit(law);
  return part.stays_;
}

double FlankReading::share_that_swings(const ToothLaw& law, const FlankFit& fit) const {
  const auto elastic = [&](std::size_t i) {
    const double torque = torque_.torque[Index(i)] + torque_.unsure.row(Index(i)).dot(start_.x);
    return std::copysign(fit.elastic * law.deflection(std::abs(torque) / torque_.level), torque);
  };
  double swings = 0;
  for (const std::size_t i : at_) {
    const double moves = std::abs(elastic(i + 1) - elastic(i - 1)) + 2 * kClear * fit.residual;
    swings += windows_.range[i] > kSwings * std::max(fit.gap, fit.elastic) + moves ||
              windows_.rough[i] > kSwings * std::max(fit.gap, 0.0) + 2 * kClear * fit.residual;
  }
  return swings / double(at_.size());
}

}  // namespace backlash::diagnosis
