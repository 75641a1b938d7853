// SPDX-License-Identifier: BSD-3-Clause
#include "traverse_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// What is known of the values: choices, two of them are the 95 % of servos declared within 40 % and more.
constexpr double kKnownGap = 3, kKnownStiffness = 0.35, kKnownDamping = 0.7, kKnownInertia = 0.3,
                 kKnownFriction = 0.5, kKnownPower = 0.2;
constexpr double kNoFriction = 0.1;              // of the level, where none is declared
constexpr double kHeld = 0.5, kKnownHeld = 0.3;  // shares of the sample before: theory, choice
constexpr double kStartSpread[] = {0.5, 5e-2};   // of the deflection, of the rms speed's scale: choice
constexpr double kSlowTorque = 0.05;             // of the level, a torque that nothing tells: choice
constexpr double kSlowTime = 0.4;                // windows, within which it changes: choice
constexpr double kLeastNoise = 0.1;              // of the torque's variance, white whatever else is: choice
constexpr double kFastPart = 8;                  // the position counts as so many times noisier: simulation
constexpr double kUntold = 0.1;            // of the level: a torque on the motor that nothing else tells
constexpr double kUntoldLoad = 0.5;        // the same on the load: gravity
constexpr double kDifference = 1e-4;       // spreads, step of a difference
constexpr double kStartDifference = 1e-2;  // the same of a start value
constexpr double kFirstDamping = 1e-2, kLeastDamping = 1e-6, kHarder = 4, kEasier = 5;
constexpr double kLongestMove = 0.5;  // spreads, of a value in one step
constexpr double kFarthestOwn = 10;   // spreads, of a value of one crossing
constexpr double kEnough = 1e-5;      // gain of the cost below which it ends, relative
constexpr double kFarOff = 3;         // times the median rms: a crossing is left out
constexpr int kLook = 6;              // steps between two looks for such crossings
constexpr int kTries = 8;
constexpr int kSettleSteps = 12;      // of one crossing alone
constexpr double kLongestOwn = 1;     // spreads, of its value in one of them
constexpr double kSettled = 1e-3;     // gain of its cost below which they end, relative
constexpr std::size_t kTogether = 4;  // windows of a linearisation, which fill whole groups of runs
constexpr int kUnmoved = kTraverseValues + kTraverseOwn;  // beside the values of machine and crossing

/// Which loads a linearisation moves: of each window as it is, and with each value moved that moves the load.
/// The first of a window make a group, as their teeth touch at about the same time; the others of several
/// windows come after them.
struct Columns {
  std::size_t windows;
  std::vector<int> moving;

  explicit Columns(std::size_t of_windows) : windows(of_windows) {
    for (int k = 0; k <= kUnmoved; ++k)
      if (moves_load(k)) moving.push_back(k);
  }

  std::size_t count() const { return windows * moving.size(); }

  std::size_t of(std::size_t window, int which) const {
    const auto found = std::find(moving.begin(), moving.end(), moves_load(which) ? which : kUnmoved);
    const auto i = static_cast<std::size_t>(found - moving.begin());
    const auto group = std::min<std::size_t>(kTraverseRuns, moving.size()), others = moving.size() - group;
    return i < group ? window * group + i : windows * group + window * others + i - group;
  }
};

}  // namespace

TraversePriors traverse_priors(const TraverseData& data, const GapTraverseSettings& s) {
  const auto friction = [&](double declared, double scale) {
    return declared > 0 ? TraversePrior{declared, kKnownFriction, true}
                        : TraversePrior{0, kNoFriction * data.level / scale, false};
  };
  const double speed = data.slow * 100;  // rms
  TraversePriors p;
  p[kTraverseGap] = {std::max(s.gap, data.level / s.stiffness), kKnownGap, true};
  p[kTraverseStiffness] = {s.stiffness, kKnownStiffness, true};
  p[kTraverseDamping] = {s.damping, kKnownDamping, true};
  p[kTraverseLoadInertia] = {s.load_inertia, kKnownInertia, true};
  p[kTraverseMotorInertia] = {s.motor_inertia, kKnownInertia, true};
  p[kTraverseMotorDamping] = friction(s.motor_damping, speed);
  p[kTraverseMotorFriction] = friction(s.motor_friction, 1);
  p[kTraverseLoadFriction] = friction(s.load_friction, 1);
  p[kTraversePower] = {1, kKnownPower, true};
  p[kTraverseEarlier] = {kHeld, kKnownHeld, false};
  return p;
}

TraverseFit::TraverseFit(const TraverseData& data, const TraversePriors& priors,
                         std::vector<TraverseWindow> windows, double first_gap)
    : data_(data),
      priors_(priors),
      windows_(std::move(windows)),
      used_(windows_.size(), 1),
      own_(windows_.size(), TraverseOwn::Zero()),
      z_(VectorXd::Zero(kTraverseValues)) {
  z_[kTraverseGap] = first_gap;
  // What a window knows of its start comes from the torque there, with its noise.
  const double per_torque = 1 / priors_[kTraverseStiffness].value;
  own_spread_ << std::hypot(kStartSpread[0] * data.level, data.noise) * per_torque,
      std::hypot(kStartSpread[1] * data.slow * 100, data.slope_noise * per_torque), kUntold * data.level,
      kUntoldLoad * data.level;
  for (const TraverseWindow& window : windows_) weigh(window);
}

/// What is left has three parts: the noise of the torque, of which two samples are averaged; that of the
/// position, which two differences make large and fast; and a slow torque that nothing tells. The noise of
/// the position comes in as a factor of the motor's inertia, which would be fitted too small where it counted
/// as much as it is: its fast part is all but left out.
void TraverseFit::weigh(const TraverseWindow& window) {
  const double differences =
      priors_[kTraverseMotorInertia].value * data_.position_noise / (data_.interval * data_.interval);
  const double white = data_.torque_noise * data_.torque_noise, blue = differences * differences,
               slow = kSlowTorque * data_.level * kSlowTorque * data_.level;
  const double kBlue[] = {6, -4, 1}, kHeldNoise[] = {0.5, 0.25, 0};
  Weights w;
  for (Eigen::Index k = 1; k + 1 < Eigen::Index(data_.samples); ++k)
    if (data_.counts[window.first + std::size_t(k)]) w.counted.push_back(k);
  const auto count = Eigen::Index(w.counted.size());
  MatrixXd noise(count, count), all(count, count);
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto apart = std::size_t(std::abs(w.counted[std::size_t(i)] - w.counted[std::size_t(k)]));
      const double held = apart < 3 ? kHeldNoise[apart] * white : 0,
                   fast = apart < 3 ? kBlue[apart] * blue : 0;
      noise(i, k) = held + fast;
      all(i, k) = held + kFastPart * kFastPart * fast +
                  slow * std::exp(-double(apart) / (kSlowTime * double(data_.samples)));
    }
  all.diagonal().array() += kLeastNoise * white + 1e-9 * all(0, 0);
  w.deviation = all.llt().matrixL();
  const MatrixXd half = w.deviation.triangularView<Eigen::Lower>().solve(noise);
  w.of_noise = w.deviation.triangularView<Eigen::Lower>().solve(half.transpose()).trace();
  weights_.push_back(std::move(w));
}

TraverseFit::TraverseFit(const TraverseFit& other, const TraverseData& data,
                         std::vector<TraverseWindow> windows)
    : TraverseFit(data, other.priors_, std::move(windows), 0) {
  z_ = other.z_;
  settle(used_);
}

double TraverseFit::value(int which, double z) const {
  const TraversePrior& p = priors_[static_cast<std::size_t>(which)];
  return p.factor ? p.value * std::exp(p.spread * z) : std::max(0.0, p.value + p.spread * z);
}

TraverseMachine TraverseFit::machine(const VectorXd& z) const {
  TraverseMachine m{};
  for (int k = 0; k < kTraverseValues; ++k) m[static_cast<std::size_t>(k)] = value(k, z[k]);
  return m;
}

TraverseRun TraverseFit::run_of(std::size_t window, const TraverseMachine& machine,
                                const TraverseOwn& own) const {
  return {&windows_[window], machine, own.cwiseProduct(own_spread_)};
}

std::vector<TraverseMachine> TraverseFit::moved_machines() const {
  std::vector<TraverseMachine> machines;
  for (int k = 0; k <= kUnmoved; ++k) {
    VectorXd z = z_;
    if (k < kTraverseValues) z[k] += kDifference;
    machines.push_back(machine(z));
  }
  return machines;
}

TraverseRun TraverseFit::moved_run(std::size_t window, const std::vector<TraverseMachine>& machines,
                                   int which) const {
  TraverseOwn own = own_[window];
  if (which >= kTraverseValues && which < kUnmoved) own[which - kTraverseValues] += kStartDifference;
  return run_of(window, machines[static_cast<std::size_t>(which)], own);
}

void TraverseFit::linearise(std::size_t first, std::size_t last,
                            const std::vector<TraverseMachine>& machines) {
  const Columns columns(last - first);
  std::vector<TraverseRun> runs(columns.count());
  for (std::size_t w = first; w < last; ++w)
    for (const int k : columns.moving) runs[columns.of(w - first, k)] = moved_run(w, machines, k);
  const MatrixXd teeth = traverse_teeth(data_, runs);
  for (std::size_t w = first; w < last; ++w) {
    const auto left = [&](int k) {
      return traverse_residual(data_, moved_run(w, machines, k),
                               teeth.col(Eigen::Index(columns.of(w - first, k))));
    };
    const VectorXd r = left(kUnmoved);
    MatrixXd slopes(r.size(), kUnmoved);
    for (int k = 0; k < kUnmoved; ++k)
      slopes.col(k) = (left(k) - r) / (k < kTraverseValues ? kDifference : kStartDifference);
    parts_[w] = part_of(w, r, slopes);
  }
}

TraverseFit::Part TraverseFit::part_of(std::size_t window, const VectorXd& residual,
                                       const MatrixXd& all_slopes) const {
  const auto deviation = weights_[window].deviation.triangularView<Eigen::Lower>();
  const VectorXd counted = residual(weights_[window].counted), r = deviation.solve(counted);
  MatrixXd slopes = all_slopes(weights_[window].counted, Eigen::all);
  deviation.solveInPlace(slopes);
  const MatrixXd normal = signal::gram(slopes);
  const VectorXd toward = -signal::transposed_product(slopes, r);
  Part part{normal.topLeftCorner(kTraverseValues, kTraverseValues),
            normal.topRightCorner(kTraverseValues, kTraverseOwn),
            normal.bottomRightCorner(kTraverseOwn, kTraverseOwn), toward.head(kTraverseValues),
            toward.tail(kTraverseOwn)};
  part.own += TraverseMatrix::Identity();
  part.own_toward -= own_[window];
  return part;
}

double TraverseFit::squares_of(std::size_t window, const VectorXd& residual) const {
  const VectorXd counted = residual(weights_[window].counted);
  return weights_[window].deviation.triangularView<Eigen::Lower>().solve(counted).squaredNorm();
}

double TraverseFit::cost_of(const VectorXd& z, const std::vector<TraverseOwn>& own,
                            std::vector<double>* rms) const {
  const TraverseMachine here = machine(z);
  std::vector<std::size_t> wanted;
  for (std::size_t w = 0; w < windows_.size(); ++w)
    if (used_[w] || rms != nullptr) wanted.push_back(w);
  std::vector<double> of(windows_.size(), 0.0);
  for (std::size_t first = 0; first < wanted.size(); first += kTraverseRuns) {
    const std::size_t last = std::min<std::size_t>(first + kTraverseRuns, wanted.size());
    std::vector<TraverseRun> runs;
    for (std::size_t i = first; i < last; ++i) runs.push_back(run_of(wanted[i], here, own[wanted[i]]));
    const MatrixXd teeth = traverse_teeth(data_, runs);
    for (std::size_t i = first; i < last; ++i) {
      const std::size_t w = wanted[i];
      const double squares = squares_of(
          w, traverse_residual(data_, runs[i - first], teeth.col(static_cast<Eigen::Index>(i - first))));
      if (rms != nullptr) (*rms)[w] = std::sqrt(squares / weights_[w].of_noise);
      of[w] = used_[w] ? squares + own[w].squaredNorm() : 0;
    }
  }
  double sum = z.squaredNorm();
  for (const double each : of) sum += each;
  return std::isfinite(sum) ? sum : std::numeric_limits<double>::infinity();
}

/// One linearisation, and harder damping until a step improves. False where none does.
bool TraverseFit::iterate() {
  parts_.resize(windows_.size());
  const std::vector<TraverseMachine> machines = moved_machines();
  for (std::size_t first = 0; first < windows_.size(); first += kTogether)
    linearise(first, std::min(first + kTogether, windows_.size()), machines);
  for (int attempt = 0; attempt < kTries; ++attempt, damping_ *= kHarder) {
    MatrixXd normal = MatrixXd::Identity(kTraverseValues, kTraverseValues);
    VectorXd toward = -z_;
    std::vector<TraverseMatrix> own(windows_.size());
    for (std::size_t w = 0; w < windows_.size(); ++w) {
      own[w] = parts_[w].own;
      own[w].diagonal() *= 1 + damping_;
      if (!used_[w]) continue;
      const TraverseMatrix inverse = own[w].inverse();
      MatrixXd shared = parts_[w].shared;
      shared.diagonal() *= 1 + damping_;
      normal += shared - parts_[w].mixed * inverse * parts_[w].mixed.transpose();
      toward += parts_[w].toward - parts_[w].mixed * (inverse * parts_[w].own_toward);
    }
    const VectorXd move =
        VectorXd(signal::solve_symmetric(normal, toward)).cwiseMax(-kLongestMove).cwiseMin(kLongestMove);
    std::vector<TraverseOwn> moved = own_;
    // Those that are left out move on too, or none could come back.
    for (std::size_t w = 0; w < windows_.size(); ++w) {
      moved[w] += own[w].inverse() * (parts_[w].own_toward - parts_[w].mixed.transpose() * move);
      moved[w] = moved[w].cwiseMax(-kFarthestOwn).cwiseMin(kFarthestOwn);
    }
    const double cost = cost_of(z_ + move, moved, nullptr);
    gain_ = cost_ - cost;
    if (!(gain_ > 0)) continue;
    z_ += move, own_ = std::move(moved), cost_ = cost;
    damping_ = std::max(kLeastDamping, damping_ / kEasier);
    return true;
  }
  return false;
}

/// One after the other: steps of all crossings together lead some of them astray.
void TraverseFit::settle(const std::vector<char>& which) {
  for (std::size_t w = 0; w < windows_.size(); ++w)
    if (which[w]) own_[w] = settled(w);
}

TraverseOwn TraverseFit::settled(std::size_t window) const {
  const TraverseMachine here = machine(z_);
  const auto left = [&](const TraverseRun& run, const auto& teeth) {
    const VectorXd all = traverse_residual(data_, run, teeth), counted = all(weights_[window].counted);
    return VectorXd(weights_[window].deviation.triangularView<Eigen::Lower>().solve(counted));
  };
  const auto cost = [&](const TraverseOwn& at) {
    const TraverseRun run = run_of(window, here, at);
    return left(run, traverse_teeth(data_, {run}).col(0)).squaredNorm() + at.squaredNorm();
  };
  TraverseOwn own = TraverseOwn::Zero();
  double damping = kFirstDamping, now = cost(own);
  for (int step = 0; step < kSettleSteps; ++step) {
    std::vector<TraverseRun> runs = {run_of(window, here, own)};
    for (int k = 0; k < kTraverseOwn; ++k)
      runs.push_back(run_of(window, here, own + kStartDifference * TraverseOwn::Unit(k)));
    const MatrixXd teeth = traverse_teeth(data_, runs);
    const VectorXd r = left(runs[0], teeth.col(0));
    MatrixXd slopes(r.size(), int(kTraverseOwn));
    for (int k = 0; k < kTraverseOwn; ++k)
      slopes.col(k) = (left(runs[std::size_t(k) + 1], teeth.col(k + 1)) - r) / kStartDifference;
    const TraverseMatrix normal = signal::gram(slopes) + TraverseMatrix::Identity();
    const TraverseOwn toward = -signal::transposed_product(slopes, r) - own;
    double gain = 0;
    for (int attempt = 0; attempt < kTries && !(gain > 0); ++attempt) {
      TraverseMatrix damped = normal;
      damped.diagonal() *= 1 + damping;
      const TraverseOwn move = damped.inverse() * toward,
                        moved = (own + move.cwiseMax(-kLongestOwn).cwiseMin(kLongestOwn))
                                    .cwiseMax(-kFarthestOwn)
                                    .cwiseMin(kFarthestOwn);
      const double then = cost(moved);
      gain = now - then;
      damping = gain > 0 ? std::max(kLeastDamping, damping / kEasier) : damping * kHarder;
      if (gain > 0) own = moved, now = then;
    }
    if (!(gain > kSettled * now)) break;
  }
  return own;
}

void TraverseFit::leave_out() {
  std::vector<double> rms(windows_.size());
  cost_of(z_, own_, &rms);
  const double most = kFarOff * std::max(1.0, signal::median(rms));
  std::vector<char> far(windows_.size());
  for (std::size_t w = 0; w < windows_.size(); ++w) far[w] = !(rms[w] <= most);
  settle(far);
  cost_of(z_, own_, &rms);
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    used_[w] = rms[w] <= most;
    if (!used_[w]) own_[w].setZero();
  }
  cost_ = cost_of(z_, own_, nullptr);
}

void TraverseFit::run(int iterations) {
  damping_ = kFirstDamping;
  cost_ = cost_of(z_, own_, nullptr);
  for (int i = 1; i <= iterations; ++i) {
    const bool better = iterate();
    if (i % kLook == 0) leave_out();
    if ((!better || gain_ < kEnough * cost_) && i > 2 * kLook) break;
  }
  leave_out();
}

int TraverseFit::left_out() const {
  return int(std::count(used_.begin(), used_.end(), 0));
}

double TraverseFit::misfit() const {
  std::vector<double> rms(windows_.size());
  cost_of(z_, own_, &rms);
  return signal::median(rms);
}

double TraverseFit::untold() const {
  double squares = 0;
  for (std::size_t w = 0; w < windows_.size(); ++w)
    if (used_[w]) squares += std::pow(own_[w][2] * own_spread_[2], 2);
  return std::sqrt(squares / std::max(1, windows() - left_out()));
}

namespace {

MatrixXd eliminated(const MatrixXd& shared, const MatrixXd& mixed, const TraverseMatrix& own) {
  return shared - mixed * own.inverse() * mixed.transpose();
}

}  // namespace

double TraverseFit::standard_error() const {
  MatrixXd information = MatrixXd::Identity(kTraverseValues, kTraverseValues);
  for (std::size_t w = 0; w < windows_.size(); ++w)
    if (used_[w]) information += eliminated(parts_[w].shared, parts_[w].mixed, parts_[w].own);
  return priors_[kTraverseGap].spread *
         std::sqrt(signal::symmetric_inverse(information)(kTraverseGap, kTraverseGap));
}

double TraverseFit::clustered_error() const {
  MatrixXd information = MatrixXd::Identity(kTraverseValues, kTraverseValues), scatter = information;
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    if (!used_[w]) continue;
    information += eliminated(parts_[w].shared, parts_[w].mixed, parts_[w].own);
    const VectorXd score =
        parts_[w].toward - parts_[w].mixed * (parts_[w].own.inverse() * parts_[w].own_toward);
    scatter += score * score.transpose();
  }
  const MatrixXd inverse = signal::symmetric_inverse(information);
  return priors_[kTraverseGap].spread * std::sqrt((inverse * scatter * inverse)(kTraverseGap, kTraverseGap));
}

}  // namespace backlash::diagnosis
