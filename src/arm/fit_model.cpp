// SPDX-License-Identifier: BSD-3-Clause
#include "fit_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "joint_effects.h"

namespace backlash::arm {

Eigen::VectorXd at_rows(const Eigen::VectorXd& all, const ArmMotion& m, double cutoff) {
  const std::vector<double> smooth =
      signal::low_pass({all.data(), all.data() + all.size()}, m.interval, cutoff);
  Eigen::VectorXd out(Eigen::Index(m.rows.size()));
  for (std::size_t k = 0; k < m.rows.size(); ++k) out[Eigen::Index(k)] = smooth[m.rows[k]];
  return out;
}

namespace {

constexpr double kShapeStep = 1e-3;  // of a shape, to see what it changes; choice: of smooth functions

/// The signal `delay` later, and its rate, at the rows.
std::pair<Eigen::VectorXd, Eigen::VectorXd> later(const ArmMotion& m, std::size_t j, double delay) {
  const auto c = Eigen::Index(j);
  const std::vector<double> s(m.signal.col(c).data(), m.signal.col(c).data() + m.signal.rows());
  const std::vector<double> shifted = signal::delayed(s, -delay / m.interval);
  const std::vector<double> rate = signal::derivative(shifted, m.interval);
  std::pair<Eigen::VectorXd, Eigen::VectorXd> out{Eigen::VectorXd(Eigen::Index(m.rows.size())),
                                                  Eigen::VectorXd(Eigen::Index(m.rows.size()))};
  for (std::size_t k = 0; k < m.rows.size(); ++k) {
    out.first[Eigen::Index(k)] = shifted[m.rows[k]];
    out.second[Eigen::Index(k)] = rate[m.rows[k]];
  }
  return out;
}

}  // namespace

Eigen::Vector3d tilted(const Eigen::Vector3d& gravity, const Eigen::Vector2d& tilt) {
  return Eigen::AngleAxisd(tilt[0], Eigen::Vector3d::UnitX()) *
         Eigen::AngleAxisd(tilt[1], Eigen::Vector3d::UnitY()) * gravity;
}

bool FitFreedom::rubs_otherwise(std::size_t joint) const {
  return friction && std::find(steady.begin(), steady.end(), joint) == steady.end();
}

bool FitFreedom::of_drive(std::size_t joint) const {
  return drives || std::any_of(effects.begin(), effects.end(),
                               [&](const FreeEffect& e) { return e.joint == joint && !e.of_term; });
}

Layout layout_of(const ArmRig& rig, const FitFreedom& freedom) {
  return {Eigen::Index(rig.joints.size()), Eigen::Index(freedom.effects.size()),
          Eigen::Index(freedom.states())};
}

double FitModel::factor(const State& state, std::size_t j) const {
  return std::exp(-state.drives(Eigen::Index(j), kDriveTerms)) / rig_.joints[j].constant;
}

State FitModel::start() const {
  State state;
  state.links = rig_.chain.links;
  state.payloads.assign(freedom_.states(), BodyParameters::Zero());
  state.friction = state.shift =
      Eigen::MatrixXd::Zero(Eigen::Index(rig_.joints.size()), Eigen::Index(freedom_.states()));
  state.drives = Eigen::MatrixXd::Zero(Eigen::Index(rig_.joints.size()), kDriveUnknowns);
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
    for (std::size_t t = 0; t < kDriveTerms; ++t)
      state.drives(Eigen::Index(j), Eigen::Index(t)) = rig_.joints[j].terms[t];
    state.drives(Eigen::Index(j), kDriveUnknowns - 1) = rig_.joints[j].delay;
  }
  for (const FreeEffect& e : freedom_.effects) state.effects.push_back(e.effect);
  return state;
}

Chain FitModel::chain(const State& state, std::size_t of) const {
  Chain chain = rig_.chain;
  chain.links = state.links;
  for (const Payload& payload : rig_.payloads)
    for (std::size_t i = 0; i < chain.size(); ++i)
      if (chain.joints[i].link == payload.link) chain.links[i] += payload.sign * payload.parameters;
  if (of == 0) return chain;
  if (freedom_.payload) chain.links[*freedom_.payload] += freedom_.payload_sign * state.payloads[of - 1];
  if (freedom_.tilt) chain.gravity = tilted(chain.gravity, state.tilt);
  return chain;
}

Eigen::MatrixXd FitModel::chain_torque(const State& state, const FittedMotion& motion) const {
  const ArmMotion& m = *motion.motion;
  const Chain loaded = chain(state, motion.state);
  Eigen::MatrixXd torque(Eigen::Index(m.time.size()), m.q.cols());
  for (Eigen::Index k = 0; k < torque.rows(); ++k)
    torque.row(k) = inverse_dynamics(loaded, m.q.row(k), m.v.row(k), m.a.row(k)).transpose();
  return torque;
}

/// The chain's torque at all samples is half of the work.
bool FitModel::something_follows_load() const {
  const auto follows = [](const JointEffect& e) { return stands_for(e.spec(), DriveTerm::load); };
  bool any =
      freedom_.load || std::find(rig_.terms.begin(), rig_.terms.end(), DriveTerm::load) != rig_.terms.end();
  for (const FreeEffect& e : freedom_.effects) any = any || follows(e.effect);
  for (const JointDrive& drive : rig_.joints)
    any = any || drive.terms[std::size_t(DriveTerm::load)] != 0 ||
          std::any_of(drive.effects.begin(), drive.effects.end(), follows);
  return any;
}

std::vector<Linearised> FitModel::linearised(const State& state, const FittedMotion& motion) const {
  const ArmMotion& m = *motion.motion;
  const Chain loaded = chain(state, motion.state);
  const auto n = Eigen::Index(m.time.size()), count = m.q.cols();
  const bool tilts = freedom_.tilt && motion.marked();
  const Eigen::MatrixXd load =
      something_follows_load() ? chain_torque(state, motion) : Eigen::MatrixXd::Zero(n, count);
  std::vector<Eigen::MatrixXd> tilt(tilts ? 3 : 0, Eigen::MatrixXd(n, count));
  const Eigen::Matrix3d turns =
      (Eigen::Matrix3d() << Eigen::Vector3d::UnitX().cross(loaded.gravity),
       Eigen::Vector3d::UnitY().cross(loaded.gravity), loaded.gravity - rig_.chain.gravity)
          .finished();
  for (Eigen::Index k = 0; tilts && k < n; ++k) {
    const Eigen::MatrixXd by_tilt = gravity_regressor(loaded, m.q.row(k)) * turns;
    for (int i = 0; i < 3; ++i) tilt[std::size_t(i)].row(k) = by_tilt.col(i).transpose();
  }
  std::vector<Linearised> all;
  const double cutoff = rig_.identification.torque_cutoff;
  for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
    const auto c = Eigen::Index(j);
    Eigen::MatrixXd by_tilt(Eigen::Index(m.rows.size()), Eigen::Index(tilt.size()));
    for (std::size_t i = 0; i < tilt.size(); ++i)
      by_tilt.col(Eigen::Index(i)) = at_rows(tilt[i].col(c), m, cutoff);
    all.push_back(joint(state, motion, j,
                        at_rows(m.sign.col(c).cwiseProduct(load.col(c).cwiseAbs()), m, cutoff), by_tilt));
  }
  add_effects(state, motion, load, all);
  return all;
}

Eigen::MatrixXd FitModel::effect_at_rows(const State& state, const JointEffect& effect, std::size_t j,
                                         const ArmMotion& m, const Eigen::MatrixXd& chain,
                                         const std::vector<Eigen::VectorXd>& drives) const {
  if (is_of_drives(effect))
    return factor(state, j) * drives[is_coupling(effect) ? *index_of(rig_, effect.other) : j];
  const Eigen::MatrixXd all = effect_columns(effect, m, j, chain.col(Eigen::Index(j)));
  Eigen::MatrixXd out(Eigen::Index(m.rows.size()), all.cols());
  for (Eigen::Index i = 0; i < all.cols(); ++i)
    out.col(i) = factor(state, j) * at_rows(all.col(i), m, rig_.identification.torque_cutoff);
  return out;
}

void FitModel::add_effects(const State& state, const FittedMotion& motion, const Eigen::MatrixXd& chain,
                           std::vector<Linearised>& all) const {
  const Layout at = layout_of(rig_, freedom_);
  std::vector<Eigen::VectorXd> drives;
  for (std::size_t j = 0; j < all.size(); ++j) drives.emplace_back(all[j].predicted / factor(state, j));
  const auto columns = [&](const JointEffect& e, std::size_t j) {
    return effect_at_rows(state, e, j, *motion.motion, chain, drives);
  };
  for (std::size_t j = 0; j < all.size(); ++j)
    for (const JointEffect& e : rig_.joints[j].effects)
      all[j].predicted += columns(e, j) * e.values.head(e.spec().columns);
  for (std::size_t i = 0; i < freedom_.effects.size(); ++i) {
    if (!freedom_.effects[i].everywhere && !motion.marked()) continue;
    const std::size_t j = freedom_.effects[i].joint;
    JointEffect e = state.effects[i];
    const JointEffectSpec& spec = e.spec();
    Eigen::MatrixXd& s = all[j].sensitivity;
    const Eigen::Index count = spec.columns, before = s.cols(), place = at.effect(Eigen::Index(i));
    s.conservativeResize(Eigen::NoChange, before + count + (spec.has_shape() ? 1 : 0));
    s.middleCols(before, count) = columns(e, j);
    const Eigen::VectorXd torque = s.middleCols(before, count) * e.values.head(count);
    all[j].predicted += torque;
    for (Eigen::Index c = 0; c < count; ++c) all[j].unknowns.push_back(place + c);
    if (!spec.has_shape()) continue;
    const double step = kShapeStep * e.shape;
    e.shape += step;
    s.rightCols(1) = (columns(e, j) * e.values.head(count) - torque) / step;
    all[j].unknowns.push_back(place + kEffectUnknowns - 1);
  }
  for (Linearised& joint : all)
    joint.sensitivity.col(10 * at.joints + Eigen::Index(kDriveTerms)) = -joint.predicted;
}

Linearised FitModel::joint(const State& state, const FittedMotion& motion, std::size_t j,
                           const Eigen::VectorXd& load, const Eigen::MatrixXd& tilt) const {
  const ArmMotion& m = *motion.motion;
  const auto c = Eigen::Index(j);
  const Layout at = layout_of(rig_, freedom_);
  const Eigen::Index s = Eigen::Index(motion.state) - 1;
  const bool carries = freedom_.payload && motion.marked(), rubs = freedom_.friction && motion.marked(),
             tilts = tilt.cols() > 0;
  const double factor = this->factor(state, j);
  Linearised out;
  const Eigen::Index links = 10 * at.joints, rows = Eigen::Index(m.rows.size());
  out.sensitivity.resize(rows,
                         links + kDriveUnknowns + (carries ? 10 : 0) + (tilts ? 2 : 0) + (rubs ? 2 : 0));
  for (Eigen::Index i = 0; i < links; ++i) out.unknowns.push_back(i);
  out.sensitivity.leftCols(links) = factor * m.chain[j];
  Eigen::MatrixXd drive = m.drive[j];
  drive.col(int(DriveTerm::load)) = load;
  const Eigen::VectorXd terms = state.drives.row(c).head(kDriveTerms).transpose();
  Eigen::VectorXd kept = terms;  // what a factor of friction does not change
  if (rubs)
    for (const DriveTerm t :
         {DriveTerm::coulomb, DriveTerm::viscous, DriveTerm::quadratic, DriveTerm::cubic, DriveTerm::load})
      kept[int(t)] *= std::exp(state.friction(c, s));
  const Chain chain = this->chain(state, motion.state);
  out.predicted = drive * kept;
  if (rubs) out.predicted.array() += state.shift(c, s);
  for (Eigen::Index i = 0; i < at.joints; ++i)
    out.predicted += m.chain[j].middleCols(10 * i, 10) * chain.links[std::size_t(i)];
  if (tilts) out.predicted += tilt.col(2);  // the chain's columns know no tilt
  out.predicted *= factor;
  const auto [measured, rate] = later(m, j, state.drives(c, kDriveUnknowns - 1));
  out.measured = measured;
  out.sensitivity.middleCols(links, kDriveTerms) = factor * drive;
  out.sensitivity.col(links + Eigen::Index(kDriveTerms)) = -out.predicted;
  out.sensitivity.col(links + Eigen::Index(kDriveTerms) + 1) = -rate;
  for (Eigen::Index i = 0; i < kDriveUnknowns; ++i) out.unknowns.push_back(at.drive(c) + i);
  Eigen::Index next = links + kDriveUnknowns;
  if (carries) {
    out.sensitivity.middleCols(next, 10) =
        freedom_.payload_sign * factor * m.chain[j].middleCols(10 * Eigen::Index(*freedom_.payload), 10);
    for (Eigen::Index i = 0; i < 10; ++i) out.unknowns.push_back(at.payload(s) + i);
    next += 10;
  }
  for (Eigen::Index i = 0; tilts && i < 2; ++i, ++next) {
    out.sensitivity.col(next) = factor * tilt.col(i);
    out.unknowns.push_back(at.tilt() + i);
  }
  if (rubs) {
    Eigen::VectorXd part = kept;
    part[int(DriveTerm::rotor_inertia)] = part[int(DriveTerm::offset)] = 0;
    out.sensitivity.col(next) = factor * (drive * part);
    out.unknowns.push_back(at.friction(c, s));
    out.sensitivity.col(next + 1).setConstant(factor);
    out.unknowns.push_back(at.shift(c, s));
  }
  return out;
}

}  // namespace backlash::arm
