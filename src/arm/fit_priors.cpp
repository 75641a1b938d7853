// SPDX-License-Identifier: BSD-3-Clause
#include "fit_priors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::arm {
namespace {

constexpr int kMostSteps = 60;        // of Newton; choice
constexpr int kMostHalvings = 40;     // choice: 2^-40 of a step is none
constexpr double kSettled = 1e-8;     // of the decrease that a step promises; choice
constexpr double kDelayError = 0.03;  // s, of a delay that nobody declares: some samples; choice
constexpr double kTilt = 0.3;         // rad, how far a base may be off that is called level; choice
constexpr double kBall = 0.2;         // theory: Sigma = 0.2 m r^2 of a ball

std::array<Eigen::Matrix4d, 10> pseudo_basis() {
  std::array<Eigen::Matrix4d, 10> basis;
  for (std::size_t i = 0; i < 10; ++i) basis[i] = pseudo_inertia(BodyParameters::Unit(Eigen::Index(i)));
  return basis;
}

const std::array<Eigen::Matrix4d, 10>& basis() {
  static const std::array<Eigen::Matrix4d, 10> all = pseudo_basis();
  return all;
}

Eigen::Matrix4d inverse(const Eigen::Matrix4d& p) {
  return signal::symmetric_inverse(Eigen::MatrixXd(p));
}

}  // namespace

Priors::Priors(const ArmRig& rig, const FitFreedom& freedom, const FitSettings& settings,
               const std::vector<char>& moves)
    : layout_(layout_of(rig, freedom)),
      weight_(settings.declared_weight),
      weights_(freedom.weights),
      mass_(settings.payload_mass),
      radius_(settings.payload_radius),
      shift_(settings.day_shift),
      payload_(freedom.payload.has_value()) {
  if (freedom.links)
    for (std::size_t i = 0; i < rig.chain.size(); ++i)
      bodies_.push_back({layout_.link(Eigen::Index(i)), inverse(pseudo_inertia(rig.chain.links[i]))});
  for (Eigen::Index s = 0; payload_ && s < layout_.states; ++s)
    bodies_.push_back({layout_.payload(s), Eigen::Matrix4d::Identity()});
  for (std::size_t s = 0; s < weights_.size(); ++s)
    if (const double error = weights_[s].standard_error; std::isfinite(error))
      normal_.push_back({layout_.payload(Eigen::Index(s)), weights_[s].value, 1 / (error * error)});
  for (Eigen::Index i = 0; freedom.tilt && i < 2; ++i)
    normal_.push_back({layout_.tilt() + i, 0, 1 / (kTilt * kTilt)});
  std::vector<double> own;  // variances of the constants
  for (std::size_t j = 0; j < rig.joints.size(); ++j) {
    const auto c = Eigen::Index(j);
    if (!moves[j]) continue;
    const JointDrive& drive = rig.joints[j];
    if (freedom.of_drive(j)) {
      for (const DriveTerm t : rig.terms) {
        if (!kDriveTermSpecs[std::size_t(t)].dissipates) continue;
        const double declared = drive.terms[std::size_t(t)];
        const double otherwise = t == DriveTerm::rotor_inertia ? settings.rotor_inertia
                                 : t == DriveTerm::load        ? settings.load_friction
                                                        : drive.constant;  // that of 1 A: a size, it follows
        positive_.push_back({layout_.drive(c) + Eigen::Index(t), declared > 0 ? declared : otherwise});
      }
    }
    if (freedom.drives) normal_.push_back({layout_.delay(c), drive.delay, 1 / (kDelayError * kDelayError)});
    if (freedom.friction) {
      for (Eigen::Index s = 0; s < layout_.states; ++s)
        normal_.push_back({layout_.friction(c, s), 0, 1 / (settings.day * settings.day)});
      day_.push_back(c);
    }
    if (freedom.load && !freedom.drives && drive.load_error > 0) {
      const Eigen::Index place = layout_.drive(c) + Eigen::Index(DriveTerm::load);
      normal_.push_back(
          {place, drive.terms[std::size_t(DriveTerm::load)], 1 / (drive.load_error * drive.load_error)});
      if (!freedom.of_drive(j)) positive_.push_back({place, drive.terms[std::size_t(DriveTerm::load)]});
    }
    if (freedom.constants && drive.constant_error > 0) {
      kappas_.push_back(layout_.kappa(c));
      own.push_back(drive.constant_error * drive.constant_error);
    }
  }
  // Known links fix what all constants have in common: then it is no unknown of the fit.
  set_constants(own, freedom.links ? rig.common_error : 0);
  for (std::size_t i = 0; i < freedom.effects.size(); ++i) {
    const FreeEffect& e = freedom.effects[i];
    if (e.effect.spec().has_shape())
      normal_.push_back({layout_.effect(Eigen::Index(i)) + kEffectUnknowns - 1, e.effect.shape,
                         1 / (e.shape_spread * e.shape_spread)});
  }
}

/// The precision of all constants together: variances of each, and the error that they share.
void Priors::set_constants(const std::vector<double>& own, double common) {
  const auto n = Eigen::Index(own.size());
  Eigen::MatrixXd together = Eigen::MatrixXd::Constant(n, n, common * common);
  for (Eigen::Index i = 0; i < n; ++i) together(i, i) += own[std::size_t(i)];
  if (n > 0) kappa_precision_ = signal::symmetric_inverse(together);
}

Eigen::VectorXd Priors::vector_of(const State& state) const {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(layout_.size());
  for (Eigen::Index i = 0; i < layout_.joints; ++i)
    x.segment<10>(layout_.link(i)) = state.links[std::size_t(i)];
  x.segment<2>(layout_.tilt()) = state.tilt;
  for (Eigen::Index s = 0; s < layout_.states; ++s) {
    x.segment<10>(layout_.payload(s)) = state.payloads[std::size_t(s)];
    x.segment(layout_.friction(0, s), layout_.joints) = state.friction.col(s);
    x.segment(layout_.shift(0, s), layout_.joints) = state.shift.col(s);
  }
  for (Eigen::Index j = 0; j < layout_.joints; ++j)
    x.segment(layout_.drive(j), kDriveUnknowns) = state.drives.row(j).transpose();
  for (std::size_t i = 0; i < state.effects.size(); ++i)
    x.segment<kEffectUnknowns>(layout_.effect(Eigen::Index(i))) << state.effects[i].values,
        state.effects[i].shape;
  return x;
}

void Priors::begin(State& state) {
  for (std::size_t s = 0; payload_ && s < state.payloads.size(); ++s) {
    Body ball;
    ball.mass = s < weights_.size() && std::isfinite(weights_[s].standard_error) ? weights_[s].value : mass_;
    ball.inertia = 2 * kBall * ball.mass * radius_ * radius_ * Eigen::Matrix3d::Identity();
    state.payloads[s] = parameters_of(ball);
  }
  for (const Positive& p : positive_) {
    const Eigen::Index j = (p.place - layout_.drive(0)) / kDriveUnknowns,
                       t = (p.place - layout_.drive(0)) % kDriveUnknowns;
    if (!(state.drives(j, t) > 0)) state.drives(j, t) = p.reference;
  }
}

double Priors::value(const Eigen::VectorXd& x) const {
  constexpr double kOutside = std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const Divergence& d : bodies_) {
    const Eigen::Matrix4d p = pseudo_inertia(x.segment<10>(d.place));
    const Eigen::VectorXd eigenvalues = signal::symmetric_eigenvalues(Eigen::MatrixXd(p));
    if (!(eigenvalues[0] > 0)) return kOutside;
    sum += weight_ * ((d.inverse * p).trace() - eigenvalues.array().log().sum());
  }
  for (const Positive& p : positive_) {
    const double ratio = x[p.place] / p.reference;
    if (!(ratio > 0)) return kOutside;
    sum += weight_ * (ratio - std::log(ratio));
  }
  for (const Normal& n : normal_) sum += 0.5 * n.weight * (x[n.place] - n.centre) * (x[n.place] - n.centre);
  for (std::size_t i = 0; i < kappas_.size(); ++i)
    for (std::size_t k = 0; k < kappas_.size(); ++k)
      sum += 0.5 * x[kappas_[i]] * kappa_precision_(Eigen::Index(i), Eigen::Index(k)) * x[kappas_[k]];
  return sum;
}

void Priors::add_derivatives(const Eigen::VectorXd& x, Eigen::VectorXd& gradient,
                             Eigen::MatrixXd& curvature) const {
  for (const Divergence& d : bodies_) {
    const Eigen::Matrix4d own = inverse(pseudo_inertia(x.segment<10>(d.place)));
    std::array<Eigen::Matrix4d, 10> turned;
    for (std::size_t i = 0; i < 10; ++i) turned[i] = own * basis()[i];
    for (Eigen::Index i = 0; i < 10; ++i) {
      gradient[d.place + i] += weight_ * ((d.inverse - own) * basis()[std::size_t(i)]).trace();
      for (Eigen::Index k = 0; k < 10; ++k)
        curvature(d.place + i, d.place + k) +=
            weight_ * (turned[std::size_t(i)] * turned[std::size_t(k)]).trace();
    }
  }
  for (const Positive& p : positive_) {
    gradient[p.place] += weight_ * (1 / p.reference - 1 / x[p.place]);
    curvature(p.place, p.place) += weight_ / (x[p.place] * x[p.place]);
  }
  for (const Normal& n : normal_) {
    gradient[n.place] += n.weight * (x[n.place] - n.centre);
    curvature(n.place, n.place) += n.weight;
  }
  for (std::size_t i = 0; i < kappas_.size(); ++i)
    for (std::size_t k = 0; k < kappas_.size(); ++k) {
      const double precision = kappa_precision_(Eigen::Index(i), Eigen::Index(k));
      gradient[kappas_[i]] += precision * x[kappas_[k]];
      curvature(kappas_[i], kappas_[k]) += precision;
    }
}

Eigen::MatrixXd Priors::curvature(const State& state) const {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(layout_.size());
  Eigen::MatrixXd curvature = Eigen::MatrixXd::Zero(layout_.size(), layout_.size());
  add_derivatives(vector_of(state), gradient, curvature);
  return curvature;
}

void Priors::follow(const Eigen::VectorXd& x) {
  for (Divergence& d : bodies_) {
    const Eigen::Matrix4d p = pseudo_inertia(x.segment<10>(d.place));
    if (d.place >= layout_.payload())
      d.inverse = inverse(p);
    else
      d.inverse *= 4 / (d.inverse * p).trace();
  }
  for (Positive& p : positive_) p.reference = x[p.place];
  const Eigen::Index first = layout_.shift(0), last = layout_.shift(0, layout_.states);
  normal_.erase(std::remove_if(normal_.begin(), normal_.end(),
                               [&](const Normal& n) { return n.place >= first && n.place < last; }),
                normal_.end());
  for (const Eigen::Index j : day_) {
    const double size = shift_ * x[layout_.drive(j) + Eigen::Index(DriveTerm::coulomb)];
    for (Eigen::Index s = 0; size > 0 && s < layout_.states; ++s)
      normal_.push_back({layout_.shift(j, s), 0, 1 / (size * size)});
  }
}

Eigen::VectorXd Priors::step(const Eigen::MatrixXd& h, const Eigen::VectorXd& g, const State& state,
                             const std::vector<char>& free) {
  const Eigen::VectorXd start = vector_of(state);
  follow(start);
  std::vector<Eigen::Index> places;
  for (std::size_t i = 0; i < free.size(); ++i)
    if (free[i]) places.push_back(Eigen::Index(i));
  const auto n = Eigen::Index(places.size());
  Eigen::VectorXd x = Eigen::VectorXd::Zero(start.size());
  const auto objective = [&](const Eigen::VectorXd& at) {
    return 0.5 * at.dot(h * at) - g.dot(at) + value(start + at);
  };
  double best = objective(x);
  for (int i = 0; i < kMostSteps; ++i) {
    Eigen::VectorXd gradient = h * x - g;
    Eigen::MatrixXd curvature = h;
    add_derivatives(start + x, gradient, curvature);
    Eigen::MatrixXd a(n, n);
    Eigen::VectorXd b(n), scale(n);
    for (Eigen::Index r = 0; r < n; ++r) {
      const double d = curvature(places[std::size_t(r)], places[std::size_t(r)]);
      scale[r] = d > 0 ? 1 / std::sqrt(d) : 0;
    }
    for (Eigen::Index r = 0; r < n; ++r) {
      b[r] = -scale[r] * gradient[places[std::size_t(r)]];
      for (Eigen::Index c = 0; c < n; ++c)
        a(r, c) = scale[r] * scale[c] * curvature(places[std::size_t(r)], places[std::size_t(c)]);
    }
    const Eigen::VectorXd newton = scale.asDiagonal() * signal::solve_symmetric(a, b);
    Eigen::VectorXd dx = Eigen::VectorXd::Zero(x.size());
    for (Eigen::Index r = 0; r < n; ++r) dx[places[std::size_t(r)]] = newton[r];
    const double promised = -gradient.dot(dx);
    if (!(promised > kSettled)) break;
    double t = 1;
    int halvings = 0;
    for (; halvings < kMostHalvings && !(objective(x + t * dx) < best); ++halvings) t /= 2;
    if (halvings == kMostHalvings) break;
    x += t * dx;
    best = objective(x);
  }
  return x;
}

}  // namespace backlash::arm
