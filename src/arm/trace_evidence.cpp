// SPDX-License-Identifier: BSD-3-Clause
#include "trace_evidence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "fit_model.h"
#include "joint_effects.h"
#include "trace_result.h"

namespace backlash::arm {
namespace {

/// Squared residuals of each joint in blocks of time, of two models.
struct Squares {
  std::vector<std::vector<double>> before, after;  // block, joint
};

Squares squares_of(const Candidate& without, const Candidate& c, const Motions& judged, const ArmRig& rig,
                   double block) {
  Squares all;
  for (const ArmMotion& m : judged) {
    const Prediction before = predict(without.fit, without.freedom, {&m, true}),
                     after = predict(c.fit, c.freedom, {&m, true});
    double begin = -1e300;
    for (std::size_t k = 0; k < m.rows.size(); ++k) {
      if (m.time[m.rows[k]] >= begin + block) {
        begin = m.time[m.rows[k]];
        all.before.emplace_back(rig.joints.size(), 0.0);
        all.after.emplace_back(rig.joints.size(), 0.0);
      }
      for (std::size_t j = 0; j < rig.joints.size(); ++j) {
        const auto r = Eigen::Index(k), col = Eigen::Index(j);
        if (!m.counts(r, col)) continue;
        all.before.back()[j] += std::pow(before.measured(r, col) - before.predicted(r, col), 2);
        all.after.back()[j] += std::pow(after.measured(r, col) - after.predicted(r, col), 2);
      }
    }
  }
  return all;
}

void bootstrap(Candidate& c, const Squares& s, const ArmTraceSettings& settings) {
  const std::size_t joints = c.fit.rig.joints.size(), blocks = s.before.size();
  std::vector<std::size_t> places(blocks);
  const auto gains = [&](const std::vector<std::size_t>& chosen) {
    std::vector<double> out(joints + 1, 0);
    double count = 0;
    for (std::size_t j = 0; j < joints; ++j) {
      double before = 0, after = 0;
      for (const std::size_t b : chosen) before += s.before[b][j], after += s.after[b][j];
      if (!(before > 0)) continue;
      out[j] = 1 - after / before;
      out[joints] -= std::log(after / before);
      count += 1;
    }
    if (count > 0) out[joints] /= count;
    return out;
  };
  for (std::size_t b = 0; b < blocks; ++b) places[b] = b;
  c.gains = gains(places);
  c.joint = std::size_t(std::max_element(c.gains.begin(), c.gains.end() - 1) - c.gains.begin());
  Random random(settings.seed);
  std::vector<std::vector<double>> drawn(joints + 1);
  for (int d = 0; d < settings.draws; ++d) {
    for (std::size_t& place : places) place = random.below(blocks);
    const std::vector<double> one = gains(places);
    for (std::size_t j = 0; j <= joints; ++j) drawn[j].push_back(one[j]);
  }
  c.lowers.clear(), c.uppers.clear();
  for (const std::vector<double>& of_joint : drawn) {
    c.lowers.push_back(signal::quantile(of_joint, 0.025));
    c.uppers.push_back(signal::quantile(of_joint, 0.975));
  }
  c.gain = c.gains[c.joint], c.lower = c.lowers[c.joint], c.upper = c.uppers[c.joint];
  c.all = c.gains[joints], c.all_lower = c.lowers[joints];
}

/// Standard errors from zero of unknowns with one covariance, in the direction in which they are known best.
double standard_errors_from_none(const Eigen::VectorXd& values, const Eigen::MatrixXd& covariance,
                                 Eigen::Index place) {
  const Eigen::Index n = values.size();
  const Eigen::VectorXd scale = covariance.diagonal().segment(place, n).cwiseSqrt().cwiseMax(1e-300);
  Eigen::MatrixXd c = scale.cwiseInverse().asDiagonal() * covariance.block(place, place, n, n) *
                      scale.cwiseInverse().asDiagonal();
  c.diagonal().array() += 1e-9;  // unknowns that follow from each other
  const Eigen::VectorXd v = values.cwiseQuotient(scale);
  return std::sqrt((v.transpose() * signal::solve_symmetric(c, v))(0, 0));
}

constexpr double kFarFromGuess = 0.4;  // of a shape's logarithm; choice: its prior is half of it

constexpr double kShapeKnown = 0.25;  // of a shape, its standard error: else it has none; choice

/// As a share of the rms friction in the drive of its joint, without the effect.
double share_of_friction(const Candidate& c, const Motions& judged) {
  double own = 0, all = 0;
  const JointDrive& drive = c.fit.rig.joints[c.joint];
  Candidate less = c, more = c;
  less.fit.effects.back().effect.values.setZero();
  for (const DriveTerm t :
       {DriveTerm::coulomb, DriveTerm::viscous, DriveTerm::quadratic, DriveTerm::cubic, DriveTerm::load})
    more.fit.rig.joints[c.joint].terms[std::size_t(t)] = 0;
  if (!(drive.terms[std::size_t(DriveTerm::coulomb)] > 0)) return INFINITY;
  for (const ArmMotion& m : judged) {
    const auto at = [&](const Candidate& one) {
      return Eigen::VectorXd(predict(one.fit, one.freedom, {&m, true}).predicted.col(Eigen::Index(c.joint)));
    };
    const Eigen::VectorXd with = at(c);
    own += (with - at(less)).squaredNorm(), all += (with - at(more)).squaredNorm();
  }
  return std::sqrt(own / all);
}

/// Of those that carry the body.
int joints_that_gain(const Candidate& c, const ArmTraceSettings& settings) {
  int count = 0;
  for (std::size_t j = 0; j <= *c.freedom.payload; ++j)
    count += c.gains[j] > settings.clearly && c.lowers[j] > 0;
  return count;
}

const char* const kNotConfirmed = "the part that was not fitted does not confirm it in all blocks of time";

std::string gain_refusal(const Candidate& c, const ArmRig& rig, double least) {
  if (c.gain >= least) return "";
  return fmt::format(
      "takes {:.0f} % of the squared error of {} away in the part that was not fitted, {:.0f} % are needed",
      100 * c.gain, rig.joints[c.joint].name, 100 * least);
}

}  // namespace

double errors_from_none(const Candidate& c, const ArmFit& fit) {
  const Layout layout{Eigen::Index(fit.rig.joints.size())};
  if (!c.freedom.effects.empty()) {
    const FittedEffect& e = fit.effects[c.freedom.effects.size() - 1];
    if (e.effect.spec().columns == 2) {
      const signal::Measured amplitude = effect_parameters(e).front().measured;
      return amplitude.value / amplitude.standard_error;
    }
    return standard_errors_from_none(e.effect.values.head(e.effect.spec().columns), e.covariance, 0);
  }
  if (c.freedom.payload)  // of mass and moments together: an arm may show the moments only
    return standard_errors_from_none(fit.marked().payload.head<4>(), fit.covariance, layout.payload());
  const Eigen::Vector2d tilt(fit.tilt[0].value, fit.tilt[1].value);
  return standard_errors_from_none(tilt, fit.covariance, layout.tilt());
}

double most_left(const Candidate& c, const ArmTraceSettings& settings) {
  return is_gain(c.freedom.effects.back().effect) ? settings.explained : settings.most_of_expected;
}

void judge(Candidate& c, const Candidate& without, const Motions& judged, const ArmRig& rig,
           const ArmTraceSettings& settings) {
  bootstrap(c, squares_of(without, c, judged, rig, settings.block), settings);
}

bool other_friction_than_trained(const ArmFit& fit, std::size_t joint, const ArmTraceSettings& settings) {
  const signal::Measured& f = fit.marked().friction_factors[joint];
  return std::fabs(f.value - 1) > settings.sure * f.standard_error &&
         std::fabs(f.value - 1) > settings.least_friction;
}

std::string effect_refusal(Candidate& c, const Candidate& without, const Motions& judged,
                           const ArmTraceSettings& settings) {
  c.joint = c.freedom.effects.back().joint;
  c.gain = c.gains[c.joint], c.lower = c.lowers[c.joint], c.upper = c.uppers[c.joint];
  if (std::string reason = gain_refusal(c, c.fit.rig, settings.least_at_joint); !reason.empty())
    return reason;
  if (!(c.lower > 0) || !(c.all > 0)) return kNotConfirmed;
  std::vector<FittedMotion> motions;
  for (const ArmMotion& m : judged) motions.push_back({&m, true});
  const double error = relative_errors(without.fit, without.freedom, motions, 0)[c.joint];
  if (const double explained = std::sqrt(c.gain) * error; explained < settings.least_of_signal)
    return fmt::format("explains {:.1f} % of the channel, {:.1f} % are needed", 100 * explained,
                       100 * settings.least_of_signal);
  // The gain counts what the effect itself does, not that the others were fitted anew beside it.
  Candidate taken_out = c;
  taken_out.fit.effects.back().effect.values.setZero();
  const double with = relative_errors(c.fit, c.freedom, motions, 0)[c.joint],
               none = relative_errors(taken_out.fit, c.freedom, motions, 0)[c.joint];
  if (!(with * with < (1 - settings.least_at_joint) * none * none))
    return fmt::format("the error is {:.2f} % without its torque and {:.2f} % with it: others have gained",
                       100 * none, 100 * with);
  const FittedEffect& e = c.fit.effects.back();
  if (c.freedom.effects.back().of_term)
    if (const double share = share_of_friction(c, judged); share < settings.least_friction)
      return fmt::format("is {:.2f} of the joint's friction: no more than a robot's warming up", share);
  if (const double most = e.effect.spec().most; std::fabs(e.effect.values[0]) > most)
    return fmt::format("its {} is {:.2g}: beyond {:.2g} it is something else", e.effect.spec().strength,
                       e.effect.values[0], most);
  if (e.effect.spec().has_shape() && e.effect.shape < e.effect.spec().least_order)
    return fmt::format("its {} is {:.2g}: what links and gravity do as well", e.effect.spec().shape_name,
                       e.effect.shape);
  if (e.effect.spec().positive && !(e.effect.values[0] > 0))
    return fmt::format("its {} is {:.2g}: no friction is negative", e.effect.spec().strength,
                       e.effect.values[0]);
  if (const double slowest = c.fit.rig.identification.slowest;
      e.effect.spec().shape == EffectShape::speed && e.effect.shape < slowest)
    return fmt::format("its speed is {:.2g} rad/s: samples below {:.2g} rad/s do not count (slowest)",
                       e.effect.shape, slowest);
  const FreeEffect& guess = c.freedom.effects.back();
  if (e.effect.spec().has_shape() && std::fabs(std::log(e.effect.shape / guess.effect.shape)) > kFarFromGuess)
    return fmt::format("its {} is {:.2g} where the residual had {:.2g}: the records do not determine it",
                       e.effect.spec().shape_name, e.effect.shape, guess.effect.shape);
  if (const double shape_error = std::sqrt(e.covariance(2, 2));
      e.effect.spec().has_shape() && shape_error > kShapeKnown * e.effect.shape)
    return fmt::format("its {} is {:.2g} +- {:.1g}: the records do not determine it",
                       e.effect.spec().shape_name, e.effect.shape, shape_error);
  const double errors = errors_from_none(c, c.fit);
  if (!(errors > settings.sure)) return fmt::format("its size is {:.1f} standard errors from none", errors);
  return "";
}

std::string refusal(const Candidate& c, const ArmRig& rig, const ArmTraceSettings& settings) {
  if (std::string reason = gain_refusal(c, rig, settings.least_gain); !reason.empty()) return reason;
  if (!(c.lower > 0) || !(c.all_lower > 0)) return kNotConfirmed;
  const double errors = errors_from_none(c, c.fit);
  if (c.freedom.payload) {
    if (const int joints = joints_that_gain(c, settings); joints < 2 && rig.joints.size() > 1)
      return "only " + rig.joints[c.joint].name + " shows it: it may be what that joint itself has";
    if (!(errors > settings.sure))
      return fmt::format(
          "its mass and moments are {:.1f} standard errors from none: mass {:.2g} +- {:.1g} kg", errors,
          c.fit.marked().mass.value, c.fit.marked().mass.standard_error);
  }
  if (c.freedom.tilt) {
    // A planar arm shows the tilt about one axis only.
    const Eigen::Vector2d tilt(c.fit.tilt[0].value, c.fit.tilt[1].value);
    if (tilt.norm() < settings.least_tilt || !(errors > settings.sure))
      return fmt::format("the tilt is {:.2g} rad, {:.1f} standard errors: no more than a level base has",
                         tilt.norm(), errors);
  }
  return "";
}

std::vector<FittedMotion> CandidateFits::motions(const Motions& fitted) const {
  std::vector<FittedMotion> motions = as_fitted(fitted, true);
  if (!rig.fitted)
    for (const FittedMotion& m : as_fitted(train_, false)) motions.push_back(m);
  return motions;
}

void CandidateFits::fit(Candidate& c, const Motions& fitted) const {
  const std::vector<FittedMotion> motions = this->motions(fitted);
  c.freedom.links = c.freedom.drives = !rig.fitted;
  c.freedom.load = rig.fitted && c.freedom.payload;
  c.freedom.friction = true;
  c.fit = fit_arm(rig, motions, c.freedom, settings.fit);
  if (rig.fitted) c.fit.rig.common_error = rig.common_error;
}

void CandidateFits::try_out(Candidate& c, const Candidate& without, const Motions& fitted,
                            const Motions& judged) const {
  fit(c, fitted);
  judge(c, without, judged, rig, settings);
  c.reason =
      c.freedom.effects.empty() ? refusal(c, rig, settings) : effect_refusal(c, without, judged, settings);
}

std::vector<double> CandidateFits::expected_errors(const Candidate& taken, const Motions& judged) const {
  const double least = settings.fit.least_seconds;
  ArmFit known = taken.fit;
  for (std::size_t j = 0; !rig.fitted && j < rig.joints.size(); ++j)
    known.deviation[j] = std::fmin(known.deviation[j], base.deviation[j]);
  if (rig.fitted) std::fill(known.deviation.begin(), known.deviation.end(), 0.0);
  std::vector<double> errors = arm::expected_errors(known, taken.freedom, as_fitted(judged, true), least);
  for (std::size_t j = 0; rig.fitted && j < rig.joints.size(); ++j) {
    const double said = rig.joints[j].training_error;
    errors[j] = std::hypot(errors[j], said > 0 ? said : train_errors[j]);
  }
  if (rig.fitted || taken.freedom.payload || taken.freedom.tilt) return errors;
  // What is missing at a joint where nothing was found, or but one number, makes the fit of the test record
  // unsure: then the training says it.
  const std::vector<double> trained = arm::expected_errors(base, {}, as_fitted(judged, false), least);
  for (std::size_t j = 0; j < errors.size(); ++j)
    if (std::none_of(taken.freedom.effects.begin(), taken.freedom.effects.end(),
                     [&](const FreeEffect& e) { return e.joint == j && !is_gain(e.effect); }))
      errors[j] = trained[j];
  return errors;
}

double CandidateFits::share_known(const Candidate& named, const Candidate& last,
                                  const Motions& judged) const {
  const std::size_t place = named.freedom.effects.size() - 1, joint = named.freedom.effects.back().joint;
  Candidate without = last;
  without.fit.effects[place].effect.values.setZero();
  const auto error = [&](const Candidate& c) {
    return relative_errors(c.fit, c.freedom, as_fitted(judged, true), 0)[joint];
  };
  const double left = error(last), own = error(without), expected = expected_errors(last, judged)[joint];
  const double more = left * left - expected * expected, takes = own * own - left * left;
  return more > 0 && takes > 0 ? std::hypot(settings.law, settings.of_left * std::sqrt(more / takes))
                               : settings.law;
}

}  // namespace backlash::arm
