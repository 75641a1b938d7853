// SPDX-License-Identifier: BSD-3-Clause
#include "crossing_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::geared_arm {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// What is known of the values, standard deviations: choices.
constexpr double kKnownStiffness = 0.5, kKnownDamping = 0.8, kKnownPower = 0.15, kKnownRotor = 0.1;
constexpr double kKnownCoulomb = 0.5;                   // of the declared friction behind the gap, and
constexpr double kUndeclaredCoulomb = 0.005;            // of the largest load
constexpr double kHeldTorque = 0.25, kKnownHeld = 0.3;  // samples: held or averaged; theory, choice
constexpr double kUnknownTorque = 0.01;                 // of the largest load, on a link; choice
constexpr double kVaries = 0.1;                         // of the gap, and
constexpr double kTeethVary = 0.03;     // of the deflection: what a turn says of the gap otherwise; choices
constexpr double kSlow = 0.3;           // s, memory of an unknown torque; choice
constexpr double kRough = 0.03;         // s, the same of friction about a standstill; choice
constexpr double kRings = 0.5;          // of the deflection: what a link swings on its teeth; choice
constexpr double kShares[] = {1, 0.3};  // of a step of what is a window's own; choice
constexpr int kAttempts = 10;           // of a step, each five times shorter; choice
constexpr double kLittle = 1;           // of the cost: a standard error
constexpr double kDifference = 0.01;    // of a standard deviation, for derivatives; choice: more leaves
                                        // out touches, and fits end before they are at their best
constexpr double kMostWindows = 0.7;    // that must be explained; choice
constexpr double kBounds[kCrossingValues][2] = {{0, 0.1},    {-3, 3},    {-4, 4}, {0.8, 1.6},
                                                {-0.6, 0.6}, {0, 1e300}, {-3, 3}};

int place(std::size_t joint, int value) {
  return int(joint) * kCrossingValues + value;
}

bool same_rotor(const CrossingMachine::value_type& a, const CrossingMachine::value_type& b) {
  return a[kCrossingRotor] == b[kCrossingRotor];
}

}  // namespace

CrossingFit::CrossingFit(const CrossingData& data)
    : data_(data), machine_(data.joints.size()), held_(data.joints.size(), 0) {
  whiten();
  begin(std::vector<double>(data.joints.size(), 0.0));
}

void CrossingFit::begin(const std::vector<double>& gaps) {
  for (std::size_t j = 0; j < machine_.size(); ++j) {
    for (int v = 0; v < kCrossingValues; ++v) machine_[j][std::size_t(v)] = centre(j, v);
    machine_[j][kCrossingGap] = gaps[j];
  }
  take_rotors();
  own_.assign(data_.windows.size(), VectorXd::Zero(kCrossingOwn * Index(machine_.size())));
  cost_ = cost_of(machine_, own_);
}

void CrossingFit::take_rotors() {
  std::vector<LinkMobilities> all(data_.windows.size());
  for_each_in_parallel(int(all.size()), [&](int w) {
    all[std::size_t(w)] = link_mobilities(data_, data_.windows[std::size_t(w)], machine_);
  });
  mobilities_ = std::make_shared<const std::vector<LinkMobilities>>(std::move(all));
}

/// Standard deviations of a window's own values. The equations are not exact, so that each turn says another
/// gap: without that, the turn with the hardest touch alone would decide.
VectorXd CrossingFit::own_spread(const CrossingMachine& machine) const {
  const Index n = Index(machine.size());
  VectorXd spread(kCrossingOwn * n);
  for (Index j = 0; j < n; ++j) {
    const TraverseJoint& joint = data_.joints[std::size_t(j)];
    spread[j] = std::hypot(kUnknownTorque * joint.most, joint.slow_torque);
    spread[n + j] = std::hypot(kVaries * machine[std::size_t(j)][kCrossingGap],
                               kTeethVary * joint.level / joint.stiffness);
    spread[2 * n + j] = kRings * joint.level / joint.stiffness;
    spread[3 * n + j] = spread[2 * n + j] * 2 * M_PI / teeth_cycle(joint);
  }
  return spread;
}

void CrossingFit::set_gap(std::size_t joint, double gap) {
  machine_[joint][kCrossingGap] = gap;
  cost_ = cost_of(machine_, own_);
}

double CrossingFit::centre(std::size_t joint, int value) const {
  return value == kCrossingPower     ? 1
         : value == kCrossingCoulomb ? data_.joints[joint].link_coulomb
         : value == kCrossingEarlier ? kHeldTorque
                                     : 0;
}

double CrossingFit::spread(std::size_t joint, int value) const {
  const TraverseJoint& known = data_.joints[joint];
  switch (value) {
    case kCrossingStiffness:
      return kKnownStiffness;
    case kCrossingDamping:
      return kKnownDamping;
    case kCrossingPower:
      return kKnownPower;
    case kCrossingRotor:
      return kKnownRotor;
    case kCrossingCoulomb:
      return std::hypot(kKnownCoulomb * known.link_coulomb, kUndeclaredCoulomb * known.most);
    case kCrossingEarlier:
      return kKnownHeld;
    default:
      return INFINITY;
  }
}

/// Covariances of the averaged torques of each window.
void CrossingFit::whiten() {
  const double block = double(data_.block) * data_.interval, m = double(data_.reach);
  for (const CrossingWindow& w : data_.windows) {
    factors_.emplace_back();
    shaken_.emplace_back();
    const Index n = (w.samples() - 1 - data_.skipped) / data_.block;
    for (std::size_t j = 0; j < data_.joints.size(); ++j) {
      const TraverseJoint& joint = data_.joints[j];
      const double rate = joint.position_noise / data_.interval * std::sqrt(3 / (m * (m + 1) * (2 * m + 1)));
      const double edge = std::pow(joint.rotor * rate / block, 2);
      const double white = joint.torque_noise * joint.torque_noise / double(data_.block);
      MatrixXd c(n, n);
      const auto unsure = [&](Index i) {
        return w.unsure(data_.skipped + i * data_.block + data_.block / 2, Index(j));
      };
      for (Index a = 0; a < n; ++a)
        for (Index b = 0; b < n; ++b) {
          const double apart = std::fabs(double(a - b)) * block;
          c(a, b) = joint.slow_torque * joint.slow_torque * std::exp(-apart / kSlow) +
                    unsure(a) * unsure(b) * std::exp(-apart / kRough);
          if (a == b) c(a, b) += white + 2 * edge;
          if (std::abs(a - b) == 1) c(a, b) -= edge;
        }
      const Eigen::LLT<MatrixXd> factor(c);
      const MatrixXd inverse = factor.solve(MatrixXd::Identity(n, n));
      factors_.back().push_back(factor.matrixL());
      shaken_.back().push_back(edge * (2 * inverse.trace() - 2 * inverse.diagonal(1).sum()));
    }
  }
}

VectorXd CrossingFit::residual(std::size_t window, const CrossingMachine& machine,
                               const VectorXd& own) const {
  const CrossingWindow& w = data_.windows[window];
  LinkMobilities other;
  const LinkMobilities* mobilities = &(*mobilities_)[window];
  if (!std::equal(machine.begin(), machine.end(), machine_.begin(), same_rotor)) {
    other = link_mobilities(data_, w, machine);
    mobilities = &other;
  }
  const MatrixXd mesh = mesh_torques(data_, w, *mobilities, machine, own);
  const Index m = data_.block, n = (w.samples() - 1 - data_.skipped) / m;
  VectorXd all(n * Index(machine.size()));
  for (std::size_t j = 0; j < machine.size(); ++j) {
    const auto c = Index(j);
    const double rotor = data_.joints[j].rotor * std::exp(machine[j][kCrossingRotor]);
    VectorXd r(n);
    for (Index k = 0; k < n; ++k) {
      const Index from = data_.skipped + k * m, to = from + m;
      const double torque = w.torque.col(c).segment(from, m).mean() +
                            machine[j][kCrossingEarlier] * (w.torque(to, c) - w.torque(from, c)) / double(m);
      const double inertial = rotor * (w.rate(to, c) - w.rate(from, c)) / (double(m) * data_.interval);
      const double friction =
          (w.friction.col(c).segment(from, m).sum() + w.friction.col(c).segment(from + 1, m).sum()) /
          (2 * double(m));
      r[k] = torque - inertial - friction - mesh.col(c).segment(from, m).mean();
    }
    factors_[window][j].triangularView<Eigen::Lower>().solveInPlace(r);
    all.segment(n * c, n) = r;
  }
  return all;
}

CrossingFit::Part CrossingFit::part(std::size_t window) const {
  Part p;
  const VectorXd spread = own_spread(machine_);
  p.residual = residual(window, machine_, own_[window]);
  p.global = MatrixXd::Zero(p.residual.size(), Index(machine_.size()) * kCrossingValues);
  p.own.resize(p.residual.size(), spread.size());
  for (std::size_t j = 0; j < machine_.size(); ++j)
    for (int v = kCrossingStiffness; v < kCrossingValues; ++v) {
      CrossingMachine other = machine_;
      const double step = kDifference * spread(j, v);
      other[j][std::size_t(v)] += step;
      p.global.col(place(j, v)) = (residual(window, other, own_[window]) - p.residual) / step;
    }
  for (Index i = 0; i < spread.size(); ++i) {
    VectorXd own = own_[window];
    const double step = kDifference * spread[i];
    own[i] += step;
    p.own.col(i) = (residual(window, machine_, own) - p.residual) / step;
  }
  for (std::size_t j = 0; j < machine_.size(); ++j)
    if (!held_[j]) p.global.col(place(j, kCrossingGap)) = p.own.col(Index(machine_.size() + j));
  weigh(window, p);
  return p;
}

/// By how much noise of the position makes the squares of the weighted residuals larger than with the
/// declared rotor, whose inertia multiplies it: without this a lighter rotor would seem the better one.
double CrossingFit::shaken(std::size_t window, std::size_t joint, const CrossingMachine& machine) const {
  return shaken_[window][joint] * (std::exp(2 * machine[joint][kCrossingRotor]) - 1);
}

/// Minus twice the log likelihood of a joint's residuals in a window, with a noise at least as
/// large as the known one: a window that the equations do not explain, such as a long one with many touches,
/// says little, and does not draw all others with it.
double CrossingFit::cost_of(std::size_t window, const VectorXd& residual,
                            const CrossingMachine& machine) const {
  const Index n = residual.size() / Index(machine_.size());
  double sum = 0;
  for (Index j = 0; j < Index(machine_.size()); ++j) {
    const double left = residual.segment(n * j, n).squaredNorm() - shaken(window, std::size_t(j), machine);
    sum += left < double(n) ? left : double(n) * (1 + std::log(left / double(n)));
  }
  return sum;
}

/// The rows of each joint, weighted by what is left of them.
void CrossingFit::weigh(std::size_t window, Part& p) const {
  const Index n = p.residual.size() / Index(machine_.size());
  p.offset = VectorXd::Zero(p.global.cols());
  for (Index j = 0; j < Index(machine_.size()); ++j) {
    const auto joint = std::size_t(j);
    const double left =
        (p.residual.segment(n * j, n).squaredNorm() - shaken(window, joint, machine_)) / double(n);
    const double weight = 1 / std::sqrt(std::fmax(1, left));
    p.residual.segment(n * j, n) *= weight;
    p.global.middleRows(n * j, n) *= weight;
    p.own.middleRows(n * j, n) *= weight;
    p.offset[place(joint, kCrossingRotor)] =
        -weight * weight * shaken_[window][joint] * std::exp(2 * machine_[joint][kCrossingRotor]);
  }
}

std::vector<CrossingFit::Part> CrossingFit::parts() const {
  std::vector<Part> all(data_.windows.size());
  for_each_in_parallel(int(all.size()), [&](int w) { all[std::size_t(w)] = part(std::size_t(w)); });
  return all;
}

double CrossingFit::prior_cost(const CrossingMachine& machine) const {
  double sum = 0;
  for (std::size_t j = 0; j < machine_.size(); ++j)
    for (int v = kCrossingStiffness; v < kCrossingValues; ++v)
      sum += std::pow((machine[j][std::size_t(v)] - centre(j, v)) / spread(j, v), 2);
  return sum;
}

/// Cost of a window, with the priors of its own values.
double CrossingFit::cost_of(std::size_t window, const CrossingMachine& machine, const VectorXd& own) const {
  return cost_of(window, residual(window, machine, own), machine) +
         own.cwiseQuotient(own_spread(machine)).squaredNorm();
}

double CrossingFit::cost_of(const CrossingMachine& machine, const std::vector<VectorXd>& own) const {
  std::vector<double> costs(data_.windows.size(), 0.0);
  for_each_in_parallel(int(costs.size()), [&](int w) {
    costs[std::size_t(w)] = cost_of(std::size_t(w), machine, own[std::size_t(w)]);
  });
  return std::accumulate(costs.begin(), costs.end(), prior_cost(machine));
}

double CrossingFit::cost_with(std::size_t joint, double gap) const {
  CrossingMachine other = machine_;
  other[joint][kCrossingGap] = gap;
  return cost_of(other, own_);
}

void CrossingFit::add_priors(MatrixXd& h, VectorXd& g) const {
  for (std::size_t j = 0; j < machine_.size(); ++j)
    for (int v = 0; v < kCrossingValues; ++v) {
      const int p = place(j, v);
      if (v != kCrossingGap) {
        const double weight = std::pow(spread(j, v), -2);
        h(p, p) += weight;
        g[p] += weight * (machine_[j][std::size_t(v)] - centre(j, v));
      } else if (held_[j]) {
        h(p, p) += 1;
      }
    }
}

/// Values that would leave their bounds stay there, and the others are solved for without them.
void CrossingFit::hold_at_bounds(MatrixXd& h, VectorXd& g) const {
  for (std::size_t j = 0; j < machine_.size(); ++j)
    for (int v = 0; v < kCrossingValues; ++v) {
      const int p = place(j, v);
      const double value = machine_[j][std::size_t(v)];
      if ((value > kBounds[v][0] || g[p] < 0) && (value < kBounds[v][1] || g[p] > 0)) continue;
      h.row(p).setZero(), h.col(p).setZero();
      h(p, p) = 1, g[p] = 0;
    }
}

CrossingMachine CrossingFit::moved(const VectorXd& step) const {
  CrossingMachine other = machine_;
  for (std::size_t j = 0; j < machine_.size(); ++j)
    for (int v = 0; v < kCrossingValues; ++v) {
      double by = step[place(j, v)];
      if (v == kCrossingGap) {  // a large step would leave what a derivative knows
        if (held_[j]) continue;
        const double most = 0.3 * gap(j) + 0.2 * data_.joints[j].level / data_.joints[j].stiffness;
        by = std::clamp(by, -most, most);
      }
      other[j][std::size_t(v)] = std::clamp(machine_[j][std::size_t(v)] + by, kBounds[v][0], kBounds[v][1]);
    }
  return other;
}

CrossingFit::Reduced CrossingFit::reduced(const Part& p, const MatrixXd& known, const VectorXd& own) {
  Reduced out;
  out.inverse = signal::symmetric_inverse(signal::gram(p.own) + known);
  const MatrixXd cross = signal::transposed_product(p.global, p.own);
  const MatrixXd taken = signal::product(cross, out.inverse);
  out.information = signal::gram(p.global) - signal::product(taken, cross.transpose());
  out.score =
      p.global.transpose() * p.residual + p.offset - taken * (p.own.transpose() * p.residual + known * own);
  return out;
}

/// Takes a machine if it is better, with each window's own values moved along where that helps.
bool CrossingFit::take(const CrossingMachine& machine, const std::vector<Part>& parts,
                       const std::vector<Reduced>& normals) {
  VectorXd taken(Index(machine.size()) * kCrossingValues);
  for (std::size_t j = 0; j < machine.size(); ++j)
    for (int v = 0; v < kCrossingValues; ++v)
      taken[place(j, v)] = machine[j][std::size_t(v)] - machine_[j][std::size_t(v)];
  const VectorXd known = own_spread(machine_).array().pow(-2);
  std::vector<VectorXd> owns = own_;
  std::vector<double> costs(parts.size(), 0.0);
  for_each_in_parallel(int(parts.size()), [&](int i) {
    const auto w = std::size_t(i);
    const Part& p = parts[w];
    const VectorXd step = -normals[w].inverse *
                          (p.own.transpose() * (p.residual + p.global * taken) + known.cwiseProduct(own_[w]));
    costs[w] = cost_of(w, machine, own_[w]);
    for (const double share : kShares) {
      const VectorXd other = own_[w] + share * step;
      const double cost = cost_of(w, machine, other);
      if (!(cost < costs[w])) continue;
      owns[w] = other, costs[w] = cost;
      return;
    }
  });
  const double cost = std::accumulate(costs.begin(), costs.end(), prior_cost(machine));
  if (!(cost < cost_)) return false;
  machine_ = machine, own_ = owns, cost_ = cost;
  take_rotors();
  return true;
}

void CrossingFit::run(int steps, double wanted) {
  for (int s = 0; s < steps; ++s) {
    const std::vector<Part> all = parts();
    const Index n = Index(machine_.size()) * kCrossingValues;
    MatrixXd h = MatrixXd::Zero(n, n);
    VectorXd g = VectorXd::Zero(n);
    add_priors(h, g);
    const MatrixXd known = own_spread(machine_).array().pow(-2).matrix().asDiagonal();
    std::vector<Reduced> normals;
    for (std::size_t w = 0; w < all.size(); ++w) {
      normals.push_back(reduced(all[w], known, own_[w]));
      h += normals.back().information;
      g += normals.back().score;
    }
    hold_at_bounds(h, g);
    const double before = cost_;
    bool better = false;
    for (int attempt = 0; attempt < kAttempts && !better; ++attempt) {
      MatrixXd damped = h;
      damped.diagonal() *= 1 + damping_;
      better = take(moved(-signal::solve_symmetric(damped, g)), all, normals);
      damping_ = std::clamp(better ? damping_ / 5 : damping_ * 5, 1e-6, 1e6);
    }
    if (!better || before - cost_ < kLittle) return;
    if ((before - cost_) * steps < cost_ - wanted) return;  // so it would not come there
  }
}

void CrossingFit::scan(const std::vector<double>& grid) {
  for (std::size_t j = 0; j < machine_.size(); ++j) {
    if (held_[j]) continue;
    double best = gap(j), least = cost_;
    for (const double gap : grid)
      if (const double cost = cost_with(j, gap); cost < least) least = cost, best = gap;
    set_gap(j, best);
  }
}

double CrossingFit::misfit(std::size_t joint) const {
  std::vector<double> all;
  for (std::size_t w = 0; w < data_.windows.size(); ++w) {
    const VectorXd r = residual(w, machine_, own_[w]);
    const Index n = r.size() / Index(machine_.size());
    all.push_back(std::sqrt(r.segment(n * Index(joint), n).squaredNorm() / double(n)));
  }
  return signal::quantile(std::move(all), kMostWindows);
}

std::vector<CrossingFit::Errors> CrossingFit::errors() const {
  const std::vector<Part> all = parts();
  const Index n = Index(machine_.size()) * kCrossingValues;
  MatrixXd h = MatrixXd::Zero(n, n);
  VectorXd unused = VectorXd::Zero(n);
  add_priors(h, unused);
  const MatrixXd known = own_spread(machine_).array().pow(-2).matrix().asDiagonal();
  std::vector<Reduced> normals;
  for (std::size_t w = 0; w < all.size(); ++w) {
    normals.push_back(reduced(all[w], known, own_[w]));
    h += normals.back().information;
  }
  for (Index i = 0; i < n; ++i) h(i, i) = h(i, i) * (1 + 1e-9) + 1e-300;
  const MatrixXd inverse = signal::symmetric_inverse(h);
  std::vector<Errors> errors(machine_.size());
  for (std::size_t j = 0; j < machine_.size(); ++j) {
    const int p = place(j, kCrossingGap);
    double sum = 0, squares = 0, clustered = 0;
    for (std::size_t w = 0; w < all.size(); ++w) {
      const double information = normals[w].information(p, p);
      sum += information, squares += information * information;
      clustered += std::pow(inverse.row(p).dot(normals[w].score), 2);
    }
    Errors& e = errors[j];
    e.turns = squares > 0 ? sum * sum / squares : 0;
    e.own = std::sqrt(std::fmax(0, inverse(p, p)));
    e.clustered = std::sqrt(clustered * e.turns / std::fmax(1, e.turns - 1));
  }
  return errors;
}

}  // namespace backlash::geared_arm
