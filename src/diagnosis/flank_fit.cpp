// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/flank_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "flank_hats.h"

namespace backlash::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kGapKnots = 9;        // of b over the travel
constexpr double kOutermost = 0.4;  // share of the windows that the iteration starts from
constexpr double kClear = 3;        // residuals beyond which a flank is surely loaded
constexpr double kOutlier = 5;      // residuals beyond which a window is left out
constexpr double kSlow = 0.03;      // of the rms speed, below which friction has no certain sign
constexpr double kHeld =
    0.1;  // relative error of g up to which the record holds it better than a declaration
constexpr double kVaries = 1.25;           // ratio of residuals, constant over varying gap
constexpr double kInertiaDeviation = 0.5;  // relative, of the declared inertia
constexpr double kTorqueStep = 0.05;       // of the rms torque, for slopes
constexpr double kSwings = 0.05;           // of the windows, that change flanks within them: choice
constexpr int kIterations = 40;
constexpr std::size_t kFewestAgainst = 3;  // stays against the motion, choice: two may be one mistake
// Share of the windows against the motion, and with it. Motions whose windows were 0.1 to 3 % (touches and
// stops only) gave a wrong play; motions that show it have 5 % and more. Simulation.
constexpr double kShareAgainst = 0.04;
// Of the windows, on either flank: with less, one flank is read where the other never is, and teeth of which
// one side is stiffer look like play. Records that gave a wrong play had 2 to 9 %; of 278 others one had less
// than 14 %.
constexpr double kShareOfFlank = 0.1;
// Of the squares of side, what f, the torque and the motion leave: where these determine the side, as in
// moves to and fro over the same path, each flank pressed in its own part of it, they take the play as well.
// Of 150 such records those with less than 1e-4 gave a third to two thirds of the play, the others had more
// than 4e-3.
constexpr double kOwnShare = 3e-3;

double rms(const std::vector<double>& x) {
  return std::sqrt(std::inner_product(x.begin(), x.end(), x.begin(), 0.0) / static_cast<double>(x.size()));
}

/// Slope of the elastic deflection over torque, from differences of `step` and tabulated: it only steers the
/// iteration.
class Slope {
 public:
  Slope(const std::function<double(double)>& elastic, double reach, double step) : reach_(reach) {
    for (int k = 0; k <= kCells; ++k) {
      const double torque = reach * (2.0 * k / kCells - 1);
      values_[k] = (elastic(torque + step) - elastic(torque - step)) / (2 * step);
    }
  }
  double operator()(double torque) const {
    const double place = std::clamp((torque / reach_ + 1) * (0.5 * kCells), 0.0, kCells - 1e-9);
    const int k = static_cast<int>(place);
    return values_[k] + (place - k) * (values_[k + 1] - values_[k]);
  }

 private:
  static constexpr int kCells = 64;
  double reach_;
  std::array<double, kCells + 1> values_;
};

/// One fit in the making.
class Fitter {
 public:
  Fitter(const FlankWindows& windows, const FlankModel& model)
      : w_(windows), model_(model), n_(windows.size()) {
    common_ = model.moving ? position_hats(w_.load, kCommonKnots, kWindowsPerKnot) : MatrixXd::Ones(n_, 1);
    gap_ = model.moving ? position_hats(w_.load, kGapKnots, 200) : MatrixXd::Ones(n_, 1);
    common_first_ = first_knots(common_), gap_first_ = first_knots(gap_);
    phi_ = Eigen::Map<const VectorXd>(w_.deflection.data(), n_);
    inertia_ = model.inertia;
    slow_ = model.moving ? kSlow * rms(w_.speed) : -1;
    const auto [least, most] = signal::extent(w_.torque);
    const double torque = std::max(rms(w_.torque), 1e-300);
    slope_.emplace(model.elastic, 2 * std::max({torque, -least, most}), kTorqueStep * torque);
  }

  FlankFit fit();

 private:
  void choose_outermost();
  void iterate(bool by_position, int iterations);
  void design(const MatrixXd& gap);
  void add_windows(MatrixXd* normal, VectorXd* right) const;
  void solve(const MatrixXd& gap, double elastic_deviation);
  void take_over();
  VectorXd half_play() const;
  bool choose_loaded();
  bool holds_compliance();
  FlankFit result(const MatrixXd& gap) const;
  std::vector<double> away() const;
  std::size_t stays_against() const;
  double share_that_swings() const;
  double sum_of_stays(const VectorXd& score, std::size_t& stays) const;

  const FlankWindows& w_;
  const FlankModel& model_;
  Eigen::Index n_;
  MatrixXd common_, gap_, f_basis_;
  std::vector<Eigen::Index> common_first_, gap_first_;
  VectorXd phi_, side_;
  std::vector<char> use_;
  double slow_;
  std::optional<Slope> slope_;
  double factor_ = 1, inertia_, viscous_ = 0, coulomb_ = 0;  // g, J, d, C
  // of the last solution
  MatrixXd a_, inverse_;
  VectorXd p_, residual_;
  double sigma_ = 0, prior_g_ = 0;
  Eigen::Index gap_at_ = 0, elastic_at_ = 0;
};

/// Without what follows the load in proportion, the deflections farthest out are on a flank.
void Fitter::choose_outermost() {
  VectorXd x = phi_;
  if (model_.moving) {
    MatrixXd line(n_, 2);
    line.col(0).setOnes();
    line.col(1) = Eigen::Map<const VectorXd>(w_.load.data(), n_);
    x -= line * signal::solve_least_squares(line, phi_).x;
  }
  const std::vector<double> values(x.data(), x.data() + n_);
  const double middle = 0.5 * (signal::quantile(values, 0.1) + signal::quantile(values, 0.9));
  std::vector<double> away;
  for (const double v : values) away.push_back(std::abs(v - middle));
  const double least = signal::quantile(away, 1 - kOutermost);
  use_.assign(n_, 0);
  side_.resize(n_);
  for (Eigen::Index i = 0; i < n_; ++i) {
    side_[i] = x[i] > middle ? 1 : -1;
    use_[i] = away[i] >= least && std::abs(w_.speed[i]) > slow_;
  }
}

/// Columns: f, side b / 2, g, J, (d, C,) c. Nonlinear e is linearised at the present J, d, C.
void Fitter::design(const MatrixXd& gap) {
  const Eigen::Index friction = model_.moving ? 2 : 0;
  MatrixXd& a = a_;
  a.resize(n_, f_basis_.cols() + gap.cols() + 3 + friction);
  a.leftCols(f_basis_.cols()) = f_basis_;
  a.middleCols(f_basis_.cols(), gap.cols()) = (0.5 * side_).asDiagonal() * gap;
  const Eigen::Index at = f_basis_.cols() + gap.cols();
  for (Eigen::Index i = 0; i < n_; ++i) {
    const double sign = w_.speed[i] > 0 ? 1 : -1;
    const double torque = w_.torque[i] - inertia_ * w_.acceleration[i] - viscous_ * w_.speed[i] -
                          coulomb_ * sign * (friction > 0);
    const double slope = factor_ * (*slope_)(torque);
    a(i, at) = model_.elastic(torque);
    a(i, at + 1) = -slope * w_.acceleration[i];
    if (friction > 0) {
      a(i, at + 2) = -slope * w_.speed[i];
      a(i, at + 3) = -slope * sign;
    }
    a(i, at + 2 + friction) = w_.slip[i];
  }
}

/// Normal equations of the windows in use. Of f and of b each row has two columns, between whose knots it
/// lies.
void Fitter::add_windows(MatrixXd* normal, VectorXd* right) const {
  constexpr Eigen::Index kMost = 16;
  Eigen::Index column[kMost];
  double value[kMost];
  const auto add_pair = [&](Eigen::Index from, Eigen::Index columns, Eigen::Index first,
                            Eigen::Index* count) {
    for (Eigen::Index k = 0; k < std::min<Eigen::Index>(2, columns); ++k)
      column[(*count)++] = from + (columns > 2 ? first : 0) + k;
  };
  for (Eigen::Index i = 0; i < n_; ++i) {
    if (!use_[i]) continue;
    Eigen::Index count = 0;
    add_pair(0, gap_at_, common_first_[i], &count);
    add_pair(gap_at_, elastic_at_ - gap_at_, gap_first_[i], &count);
    for (Eigen::Index k = elastic_at_; k < a_.cols(); ++k) column[count++] = k;
    for (Eigen::Index p = 0; p < count; ++p) {
      value[p] = a_(i, column[p]);
      (*right)[column[p]] += value[p] * phi_[i];
      for (Eigen::Index q = 0; q <= p; ++q) (*normal)(column[p], column[q]) += value[p] * value[q];
    }
  }
  normal->triangularView<Eigen::StrictlyUpper>() = normal->transpose();
}

/// Least squares on the windows in use. elastic_deviation > 0: with g = 1 +- elastic_deviation as one more
/// observation. Parameters are J, d, C minus their present values.
void Fitter::solve(const MatrixXd& gap, double elastic_deviation) {
  gap_at_ = f_basis_.cols();
  elastic_at_ = gap_at_ + gap.cols();
  design(gap);
  const auto count = static_cast<double>(std::count(use_.begin(), use_.end(), 1));
  MatrixXd normal = MatrixXd::Zero(a_.cols(), a_.cols());
  VectorXd right = VectorXd::Zero(a_.cols());
  add_windows(&normal, &right);
  const double noise = sigma_ > 0 ? sigma_ : 0.1 * std::sqrt(phi_.squaredNorm() / static_cast<double>(n_));
  // A declaration counts like one window of its own variance, times how often a correlated record repeats
  // itself.
  const double weight = noise * noise * std::max(1.0, count / 50);
  if (inertia_ > 0 && model_.inertia > 0) {
    const double precision = noise * noise / std::pow(kInertiaDeviation * model_.inertia, 2);
    normal(elastic_at_ + 1, elastic_at_ + 1) += precision;
    right[elastic_at_ + 1] += precision * (model_.inertia - inertia_);
  }
  prior_g_ = elastic_deviation > 0 ? weight / (elastic_deviation * elastic_deviation) : 0;
  normal(elastic_at_, elastic_at_) += prior_g_;
  right[elastic_at_] += prior_g_;
  // A column without any window (a knot that none lies near) gets a zero.
  for (Eigen::Index k = 0; k < normal.cols(); ++k)
    normal(k, k) = normal(k, k) > 0 ? (1 + 1e-12) * normal(k, k) : 1;
  // Scaled to unit diagonal: the columns are of different units.
  const VectorXd unit = normal.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd equal = unit.asDiagonal() * normal * unit.asDiagonal();
  inverse_ = unit.asDiagonal() * signal::symmetric_inverse(equal) * unit.asDiagonal();
  p_ = inverse_ * right;
  residual_ = phi_ - a_ * p_;
  std::vector<double> sizes;
  for (Eigen::Index i = 0; i < n_; ++i)
    if (use_[i]) sizes.push_back(std::abs(residual_[i]));
  sigma_ = signal::kNormalPerMedianDeviation * signal::median(sizes);
}

/// J, d, C for the next linearisation.
void Fitter::take_over() {
  factor_ = std::clamp(p_[elastic_at_], 0.1, 10.0);
  inertia_ = std::max(0.0, inertia_ + p_[elastic_at_ + 1]);
  if (!model_.moving) return;
  viscous_ += p_[elastic_at_ + 2];
  coulomb_ += p_[elastic_at_ + 3];
}

/// Of the last solution, without its sign, wherever side_ pointed.
VectorXd Fitter::half_play() const {
  const Eigen::Index knots = elastic_at_ - gap_at_;
  return side_.asDiagonal() * (a_.middleCols(gap_at_, knots) * p_.segment(gap_at_, knots));
}

/// Windows that surely lie on a flank by the present solution; false when nothing changes any more.
bool Fitter::choose_loaded() {
  const VectorXd common = a_.leftCols(gap_at_) * p_.head(gap_at_);
  const VectorXd half = half_play();
  const VectorXd elastic = a_.rightCols(a_.cols() - elastic_at_) * p_.tail(p_.size() - elastic_at_);
  const double clear = kClear * sigma_;
  std::vector<double> loaded(n_ + 2, 0.0);  // side, 0 where not for certain; shifted by one
  VectorXd residual(n_);
  for (Eigen::Index i = 0; i < n_; ++i) {
    const double deflection = phi_[i] - common[i];
    const double side = deflection > 0 ? 1 : -1;
    residual[i] = deflection - side * half[i] - elastic[i];
    if (side * deflection - half[i] > clear && side * elastic[i] > clear) loaded[i + 1] = side;
  }
  // A window beside one that is not loaded may hold the impact itself.
  std::size_t changes = 0;
  for (Eigen::Index i = 0; i < n_; ++i) {
    const double side = loaded[i + 1];
    const bool inside = side != 0 && loaded[i] == side && loaded[i + 2] == side;
    const char use = inside && std::abs(residual[i]) < kOutlier * sigma_ && std::abs(w_.speed[i]) > slow_;
    changes += use != use_[i] || (use && side != side_[i]);
    use_[i] = use;
    side_[i] = phi_[i] > common[i] ? 1 : -1;
  }
  return changes > 2;
}

void Fitter::iterate(bool by_position, int iterations) {
  f_basis_ = common_;
  if (!by_position && model_.moving) {  // offset and scale only
    f_basis_.resize(n_, 2);
    f_basis_.col(0).setOnes();
    f_basis_.col(1) = Eigen::Map<const VectorXd>(w_.load.data(), n_);
  }
  const MatrixXd gap = by_position ? gap_ : MatrixXd::Ones(n_, 1);
  for (int k = 0; k < iterations; ++k) {
    const auto used = std::count(use_.begin(), use_.end(), 1);
    if (used < 2 * static_cast<long>(kFewestOnFlank)) return;
    solve(gap, k == 0 || !model_.moving ? model_.elastic_deviation : 0);
    take_over();
    if (!choose_loaded() && k > 2) return;
  }
}

/// Sum of the squares of the scores of each stay on a flank.
double Fitter::sum_of_stays(const VectorXd& score, std::size_t& stays) const {
  double squares = 0, sum = 0;
  double side = 0;
  stays = 0;
  for (Eigen::Index i = 0; i < n_; ++i) {
    if (!use_[i]) continue;
    if (side_[i] != side) {
      squares += sum * sum;
      sum = 0;
      side = side_[i];
      ++stays;
    }
    sum += score[i] * residual_[i];
  }
  return squares + sum * sum;
}

/// 0 where nearly all windows are against the motion, or nearly none.
std::size_t Fitter::stays_against() const {
  std::size_t stays = 0;
  double windows = 0, count = 0;
  bool before = false;
  for (Eigen::Index i = 0; i < n_; ++i) {
    if (!use_[i]) continue;
    const bool against = side_[i] * w_.speed[i] < 0;
    stays += against && !before;
    windows += against, ++count;
    before = against;
  }
  return std::min(windows, count - windows) < kShareAgainst * count ? 0 : stays;
}

/// Of the windows in use, in which samples lie on both sides of the middle, or go back and forth by more than
/// half the play: flanks change within them, and what they average shows less play than there is (none, of a
/// drive that chatters).
double Fitter::share_that_swings() const {
  const VectorXd common = a_.leftCols(gap_at_) * p_.head(gap_at_);
  const VectorXd half = half_play();
  const double clear = kClear * sigma_;
  double swings = 0, count = 0;
  for (Eigen::Index i = 0; i < n_; ++i) {
    if (!use_[i]) continue;
    const bool both = w_.least[i] - common[i] < -clear && w_.largest[i] - common[i] > clear;
    const bool rough = w_.rough[i] > std::max(0.5 * half[i], clear);
    swings += both || rough;
    ++count;
  }
  return swings / count;
}

std::vector<double> Fitter::away() const {
  const VectorXd deflection = phi_ - a_.leftCols(gap_at_) * p_.head(gap_at_);
  const VectorXd half = half_play();
  const VectorXd elastic = a_.rightCols(a_.cols() - elastic_at_) * p_.tail(p_.size() - elastic_at_);
  std::vector<double> least(n_, NAN);
  for (Eigen::Index i = 0; i < n_; ++i) {
    if (std::abs(w_.speed[i]) <= slow_) continue;
    const double side = elastic[i] > 0 ? 1 : -1;
    const double pressed = std::abs(deflection[i] - side * half[i] - elastic[i]);
    const double beyond = std::max(0.0, std::abs(deflection[i]) - half[i]);
    least[i] = std::min(pressed, std::hypot(beyond, elastic[i]));
  }
  return least;
}

FlankFit Fitter::result(const MatrixXd& gap) const {
  FlankFit fit;
  VectorXd mean = VectorXd::Zero(p_.size());
  double count = 0, squares = 0;
  for (Eigen::Index i = 0; i < n_; ++i) {
    if (!use_[i]) continue;
    ++fit.used[side_[i] > 0];
    mean.segment(gap_at_, gap.cols()) += gap.row(i).transpose();
    squares += residual_[i] * residual_[i];
    ++count;
  }
  mean /= count;
  const double alone = 0.25 * count * inverse_(gap_at_, gap_at_);  // variance, over that of the side alone
  fit.gap = mean.dot(p_);
  fit.residual = std::sqrt(squares / count);
  const VectorXd row = inverse_ * mean;
  double variance = sum_of_stays(a_ * row, fit.stays);
  fit.against = model_.moving ? stays_against() : fit.stays;
  const double stays = static_cast<double>(fit.stays);
  variance *=
      stays / std::max(1.0, stays - 1) * count / std::max(1.0, count - static_cast<double>(p_.size()));
  if (prior_g_ > 0) variance += std::pow(row[elastic_at_] * prior_g_ * model_.elastic_deviation, 2);
  fit.standard_error = std::sqrt(variance);
  fit.compliance_factor = p_[elastic_at_];
  const double noise = squares / (p_[elastic_at_] * p_[elastic_at_]);
  const double left = 1 - noise * inverse_(elastic_at_, elastic_at_);
  fit.attenuation = left > 0 ? noise * p_[elastic_at_] * row[elastic_at_] / left : INFINITY;
  const auto fewer = double(std::min(fit.used[0], fit.used[1]));
  fit.obstacle = [&] {
    if (fewer < std::max(double(kFewestOnFlank), model_.moving ? kShareOfFlank * count : 0))
      return FlankObstacle::not_pressed;
    if (fit.against < kFewestAgainst) return FlankObstacle::one_direction;
    if (model_.moving && share_that_swings() > kSwings) return FlankObstacle::chatter;
    if (model_.moving && gap.cols() == 1 && kOwnShare * alone >= 1) return FlankObstacle::own_part;
    return FlankObstacle::none;
  }();
  fit.found = fit.obstacle == FlankObstacle::none;
  return fit;
}

/// Whether the record determines the compliance: then the declaration, which may be wrong, is not needed.
bool Fitter::holds_compliance() {
  solve(gap_, 0);
  const double free = p_[elastic_at_];
  std::size_t stays = 0;
  const double error = std::sqrt(sum_of_stays(a_ * inverse_.col(elastic_at_), stays));
  return free > 0 && error < kHeld * free;
}

FlankFit Fitter::fit() {
  choose_outermost();
  if (model_.moving) iterate(false, 4);  // a locked output has but one position
  iterate(true, kIterations);
  if (std::count(use_.begin(), use_.end(), 1) < 2 * static_cast<long>(kFewestOnFlank)) return {};
  const bool held = model_.moving && holds_compliance();
  const double deviation = held ? 0 : model_.elastic_deviation;
  solve(gap_, deviation);
  FlankFit fit = result(gap_);
  if (gap_.cols() > 1) {
    FlankFit varying = fit;
    const VectorXd knots = p_.segment(gap_at_, gap_.cols());
    solve(MatrixXd::Ones(n_, 1), deviation);
    fit = result(MatrixXd::Ones(n_, 1));
    if (fit.residual > kVaries * varying.residual) {
      varying.found = fit.found, varying.obstacle = fit.obstacle;
      fit = varying;
      fit.varies = true;
      fit.least_gap = knots.minCoeff();
      fit.largest_gap = knots.maxCoeff();
    }
  }
  fit.compliance_from_record = held;
  fit.away = away();
  if (model_.moving && common_.cols() > 1) {
    fit.scale_error = (p_[common_.cols() - 1] - p_[0]) / signal::peak_to_peak(w_.load);
  }
  return fit;
}

}  // namespace

FlankFit fit_flanks(const FlankWindows& windows, const FlankModel& model) {
  if (windows.size() < 4 * kFewestOnFlank) return {};
  return Fitter(windows, model).fit();
}

}  // namespace backlash::diagnosis
