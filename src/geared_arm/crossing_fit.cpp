// SPDX-License-Identifier: BSD-3-Clause
#include "crossing_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

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
constexpr double kTeethVary = 0.03;   // of the deflection: what a turn says of the gap otherwise; choices
constexpr double kSlow = 0.3;         // s, memory of an unknown torque; choice
constexpr double kRough = 0.03;       // s, the same of friction about a standstill; choice
constexpr double kRings = 0.5;        // of the deflection: what a link swings on its teeth; choice
constexpr double kDifference = 0.01;  // of a standard deviation, for derivatives; choice: more leaves
                                      // out touches, and fits end before they are at their best
constexpr double kSameValue = 1e-12;  // theory: of a value; steps are 1e-4 and more of it
constexpr int kPasses = 2;            // over all joints, of a scan; choice
constexpr double kConverged = 1e-4;   // of the cost; choice
constexpr double kMostWindows = 0.7;  // that must be explained; choice

Index place(std::size_t joint, int value) {
  return Index(joint) * kCrossingValues + value;
}

void add_shared(const TraverseJoint& joint, fit::Priors& all) {
  fit::Priors p(kCrossingValues);
  p[kCrossingGap] = {"gap", 0, kLargestGap, false};
  p[kCrossingStiffness] = {"stiffness of the teeth", 1, kKnownStiffness, true, kDifference};
  p[kCrossingDamping] = {"damping of the teeth", 1, kKnownDamping, true, kDifference};
  p[kCrossingPower] = {"power of the teeth", 1, kKnownPower, true, kDifference};
  p[kCrossingRotor] = {"inertia of the rotor", 1, kKnownRotor, true, kDifference};
  p[kCrossingCoulomb] = {"dry friction of the link", joint.link_coulomb,
                         std::hypot(kKnownCoulomb * joint.link_coulomb, kUndeclaredCoulomb * joint.most),
                         false, kDifference};
  p[kCrossingEarlier] = {"delay of the torque", kHeldTorque, kKnownHeld, false, kDifference};
  all.insert(all.end(), p.begin(), p.end());
}

fit::Priors own_priors(const std::vector<TraverseJoint>& joints) {
  fit::Priors all;
  for (const TraverseJoint& j : joints)
    all.push_back({"torque", 0, std::hypot(kUnknownTorque * j.most, j.slow_torque), false, kDifference});
  for (std::size_t j = 0; j < joints.size(); ++j)
    all.push_back({"wider gap", 0, 1, false, kDifference});  // see vary_about()
  for (const TraverseJoint& j : joints)
    all.push_back({"deflection", 0, kRings * j.level / j.stiffness, false, kDifference});
  for (const TraverseJoint& j : joints)
    all.push_back(
        {"rate", 0, kRings * j.level / j.stiffness * 2 * M_PI / teeth_cycle(j), false, kDifference});
  return all;
}

/// Cholesky's factor of the covariance of a joint's averaged torques in a window.
MatrixXd factor_of(const CrossingData& data, const CrossingWindow& w, std::size_t j) {
  const TraverseJoint& joint = data.joints[j];
  const double block = double(data.block) * data.interval, m = double(data.reach);
  const Index n = (w.samples() - 1 - data.skipped) / data.block;
  const double rate = joint.position_noise / data.interval * std::sqrt(3 / (m * (m + 1) * (2 * m + 1)));
  const double edge = std::pow(joint.rotor * rate / block, 2);
  const double white = joint.torque_noise * joint.torque_noise / double(data.block);
  const auto unsure = [&](Index i) {
    return w.unsure(data.skipped + i * data.block + data.block / 2, Index(j));
  };
  MatrixXd c(n, n);
  for (Index a = 0; a < n; ++a)
    for (Index b = 0; b < n; ++b) {
      const double apart = std::fabs(double(a - b)) * block;
      c(a, b) = joint.slow_torque * joint.slow_torque * std::exp(-apart / kSlow) +
                unsure(a) * unsure(b) * std::exp(-apart / kRough);
      if (a == b) c(a, b) += white + 2 * edge;
      if (std::abs(a - b) == 1) c(a, b) -= edge;
    }
  return c.llt().matrixL();
}

/// A motion of the links, with the gaps of its turn. A step of all gaps and one of this turn's must give the
/// same number: rounding decides whether teeth touch, and a turn would say more of one than the other leaves.
struct Run {
  CrossingMachine machine;
  VectorXd own;
  MatrixXd mesh;
};

bool alike(const Run& a, const Run& b) {
  const auto same = [](double x, double y) { return std::fabs(x - y) <= kSameValue * std::fabs(x); };
  for (std::size_t j = 0; j < a.machine.size(); ++j)
    if (!std::equal(a.machine[j].begin(), a.machine[j].end(), b.machine[j].begin(), same)) return false;
  return std::equal(a.own.begin(), a.own.end(), b.own.begin(), same);
}

bool same_rotors(const Run& a, const Run& b) {
  return std::equal(a.machine.begin(), a.machine.end(), b.machine.begin(),
                    [](const auto& x, const auto& y) { return x[kCrossingRotor] == y[kCrossingRotor]; });
}

}  // namespace

CrossingWindows::CrossingWindows(const CrossingData& data) : data_(data), own_(own_priors(data.joints)) {
  for (const TraverseJoint& joint : data.joints) add_shared(joint, shared_);
  Factors factors(data.windows.size());
  for (std::size_t w = 0; w < factors.size(); ++w)
    for (std::size_t j = 0; j < data.joints.size(); ++j)
      factors[w].push_back(factor_of(data, data.windows[w], j));
  factors_ = std::make_shared<const Factors>(std::move(factors));
}

void CrossingWindows::hold_gap(std::size_t joint, double gap) {
  fit::Prior& prior = shared_[std::size_t(place(joint, kCrossingGap))];
  prior.centre = gap, prior.spread = 0;
}

CrossingMachine CrossingWindows::machine(const VectorXd& shared) const {
  CrossingMachine machine(data_.joints.size());
  for (std::size_t j = 0; j < machine.size(); ++j) {
    for (int v = 0; v < kCrossingValues; ++v) {
      const Index p = place(j, v);
      machine[j][std::size_t(v)] = shared_[std::size_t(p)].value(shared[p]);
    }
    // Neither can be below zero, where nothing would lead back.
    for (const int v : {kCrossingGap, kCrossingCoulomb})
      machine[j][std::size_t(v)] = std::fabs(machine[j][std::size_t(v)]);
  }
  return machine;
}

/// The equations are not exact, so that each turn says another gap: without that, the turn with the hardest
/// touch alone would decide. Steps of the gap are those of a turn's own.
void CrossingWindows::vary_about(const CrossingMachine& machine) {
  for (std::size_t j = 0; j < machine.size(); ++j) {
    const TraverseJoint& joint = data_.joints[j];
    const double spread =
        std::hypot(kVaries * machine[j][kCrossingGap], kTeethVary * joint.level / joint.stiffness);
    own_[machine.size() + j].spread = spread;
    shared_[std::size_t(place(j, kCrossingGap))].step = kDifference * spread / kLargestGap;
  }
}

VectorXd CrossingWindows::own_of(const VectorXd& own) const {
  VectorXd values(own.size());
  for (Index i = 0; i < own.size(); ++i) values[i] = own_[std::size_t(i)].value(own[i]);
  return values;
}

VectorXd CrossingWindows::residual(int window, const CrossingMachine& machine, const MatrixXd& mesh) const {
  const CrossingWindow& w = data_.windows[std::size_t(window)];
  const Index m = data_.block, n = (w.samples() - 1 - data_.skipped) / m;
  VectorXd all(n * Index(machine.size()));
  for (std::size_t j = 0; j < machine.size(); ++j) {
    const auto c = Index(j);
    const double rotor = data_.joints[j].rotor * machine[j][kCrossingRotor];
    auto r = all.segment(n * c, n);
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
    (*factors_)[std::size_t(window)][j].triangularView<Eigen::Lower>().solveInPlace(r);
  }
  return all;
}

MatrixXd CrossingWindows::residuals(int w, const MatrixXd& shared, const MatrixXd& own) const {
  const CrossingWindow& window = data_.windows[std::size_t(w)];
  const Index n = Index(data_.joints.size());
  std::vector<Run> runs;
  LinkMobilities usual;
  MatrixXd all;
  for (Index c = 0; c < shared.cols(); ++c) {
    const CrossingMachine fitted = machine(shared.col(c));
    Run run{fitted, own_of(own.col(c)), {}};
    for (Index j = 0; j < n; ++j) {
      std::array<double, kCrossingValues>& joint = run.machine[std::size_t(j)];
      joint[kCrossingGap] += std::exchange(run.own[n + j], 0.0);
      joint[kCrossingEarlier] = 0;
    }
    auto same = std::find_if(runs.begin(), runs.end(), [&](const Run& r) { return alike(r, run); });
    if (same == runs.end()) {
      const bool own_rotors = runs.empty() || !same_rotors(run, runs.front());
      const LinkMobilities other = own_rotors ? link_mobilities(data_, window, fitted) : LinkMobilities();
      if (runs.empty()) usual = other;
      run.mesh = mesh_torques(data_, window, own_rotors ? other : usual, run.machine, run.own);
      same = runs.insert(runs.end(), std::move(run));
    }
    const VectorXd r = residual(w, fitted, same->mesh);
    if (c == 0) all.resize(r.size(), shared.cols());
    all.col(c) = r;
  }
  return all;
}

CrossingFit::CrossingFit(const CrossingData& data)
    : windows_(std::make_shared<CrossingWindows>(data)), fit_(*windows_) {}

void CrossingFit::take(const CrossingWindows& windows) {
  const auto next = std::make_shared<const CrossingWindows>(windows);
  fit::WindowedFit fit(*next);
  fit.shared = fit_.shared, fit.own = fit_.own;
  for (VectorXd& own : fit.own)
    for (Index i = 0; i < own.size(); ++i)
      own[i] *= windows_->own()[std::size_t(i)].spread / next->own()[std::size_t(i)].spread;
  fit_ = std::move(fit), windows_ = next;
}

CrossingFit CrossingFit::held(std::size_t joint, double gap) const {
  CrossingWindows windows = *windows_;
  windows.hold_gap(joint, gap);
  CrossingFit other = *this;
  other.take(windows);
  other.fit_.shared[place(joint, kCrossingGap)] = 0;
  return other;
}

void CrossingFit::set_gap(std::size_t joint, double gap) {
  fit_.shared[place(joint, kCrossingGap)] = gap / kLargestGap;
}

void CrossingFit::run(int steps, double wanted) {
  CrossingWindows windows = *windows_;
  windows.vary_about(machine());
  take(windows);
  fit::FitOptions options;
  options.iterations = steps, options.tolerance = kConverged, options.wanted = wanted;
  fit_.run(options);
}

double CrossingFit::cost_with(std::size_t joint, double gap) const {
  VectorXd shared = fit_.shared;
  shared[place(joint, kCrossingGap)] = gap / kLargestGap;
  return fit_.cost_at(shared, fit::FitOptions());
}

void CrossingFit::scan(const std::function<std::vector<double>(double)>& gaps_about) {
  for (VectorXd& own : fit_.own) own.setZero();
  bool moved = true;
  for (int pass = 0; moved && pass < kPasses; ++pass) {
    moved = false;
    for (std::size_t j = 0; j < windows_->data().joints.size(); ++j) {
      const double from = gap(j);
      double best = from, least = cost_with(j, from);
      for (const double each : gaps_about(from))
        if (const double cost = cost_with(j, each); cost < least) least = cost, best = each;
      set_gap(j, best);
      moved = moved || best != from;
    }
  }
}

double CrossingFit::misfit(std::size_t joint) const {
  std::vector<double> all;
  for (int w = 0; w < windows_->count(); ++w) {
    const VectorXd& r = fit_.residual(w);
    const Index n = r.size() / Index(windows_->data().joints.size());
    all.push_back(std::sqrt(r.segment(n * Index(joint), n).squaredNorm() / double(n)));
  }
  return signal::quantile(std::move(all), kMostWindows);
}

std::vector<CrossingFit::Errors> CrossingFit::errors() const {
  const MatrixXd of_fit = fit_.covariance(), clustered = fit_.clustered_covariance();
  std::vector<Errors> errors(windows_->data().joints.size());
  for (std::size_t j = 0; j < errors.size(); ++j) {
    const Index p = place(j, kCrossingGap);
    errors[j] = {kLargestGap * std::sqrt(of_fit(p, p)), kLargestGap * std::sqrt(clustered(p, p)),
                 fit_.windows_that_count(p)};
  }
  return errors;
}

}  // namespace backlash::geared_arm
