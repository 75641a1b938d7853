// SPDX-License-Identifier: BSD-3-Clause
#include "healthy_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "change_scan.h"
#include "healthy_columns.h"

namespace backlash::changes {
namespace {

constexpr double kFluctuation =
    3.5;  // simulation: times rms torque over rms speed, see load_dependent_friction
constexpr double kWarmUps[] = {20, 40, 60, 80, 110, 150, 220, 300, 400};  // s, tried. Choice

Eigen::MatrixXd lasting_columns(const SampledMotion& motion) {
  return columns(motion, lasting(motion.sampling));
}

Eigen::MatrixXd warm_columns(const SampledMotion& motion, double warm_up) {
  return columns(motion, warming(motion.sampling, warm_up));
}

struct HealthyData {
  std::vector<SampledMotion> motions;
  std::vector<Eigen::MatrixXd> columns;
};

/// Least squares with a weak pull to `about`, by 1 / `sd` per column.
Eigen::VectorXd pulled_fit(const Eigen::MatrixXd& gram, const Eigen::VectorXd& moment,
                           const Eigen::VectorXd& about, const Eigen::VectorXd& sd, double variance) {
  const Eigen::VectorXd weight = variance * sd.array().square().inverse();
  const Eigen::MatrixXd a = gram + Eigen::MatrixXd(weight.asDiagonal());
  return a.ldlt().solve(moment + weight.cwiseProduct(about));
}

struct PooledFit {
  Eigen::VectorXd values;
  double squares = 0;
  Eigen::Index rows = 0;
};

PooledFit pooled(const HealthyData& data) {
  const Eigen::Index p = data.columns.front().cols();
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(p, p);
  Eigen::VectorXd moment = Eigen::VectorXd::Zero(p);
  PooledFit fit;
  for (std::size_t r = 0; r < data.motions.size(); ++r) {
    gram += data.columns[r].transpose() * data.columns[r];
    moment += data.columns[r].transpose() * data.motions[r].target;
    fit.rows += data.motions[r].size();
  }
  // Columns of any size; what the motion does not show stays 0.
  const Eigen::VectorXd scale = gram.diagonal().cwiseMax(1e-12 * gram.diagonal().maxCoeff()).cwiseSqrt();
  const Eigen::VectorXd inverse = scale.cwiseInverse();
  Eigen::MatrixXd scaled = inverse.asDiagonal() * gram * inverse.asDiagonal();
  scaled.diagonal().array() += 1e-9;
  fit.values = inverse.cwiseProduct(Eigen::VectorXd(scaled.ldlt().solve(inverse.cwiseProduct(moment))));
  for (std::size_t r = 0; r < data.motions.size(); ++r)
    fit.squares += (data.motions[r].target - data.columns[r] * fit.values).squaredNorm();
  return fit;
}

void set_loads(const Eigen::VectorXd& values, SampledMotion& motion) {
  if (motion.sampling.channel == ChangeChannel::deflection) return;
  const double torque = motion.target.norm() / std::sqrt(double(std::max<Eigen::Index>(1, motion.size())));
  for (Moment& m : motion.moments) {
    m.fluctuation = kFluctuation * torque / motion.sampling.speed;
    m.weight = values[kCosine] * std::cos(m.position) + values[kSine] * std::sin(m.position);
    m.load = m.chain + values[kInertia] * m.acceleration + m.weight;
    m.load_slope = values[kSine] * std::cos(m.position) - values[kCosine] * std::sin(m.position);
  }
}

/// The healthy machine's equation at each sample, with all its terms.
void set_torques(const HealthyModel& model, SampledMotion& motion) {
  if (motion.sampling.channel == ChangeChannel::deflection) return;
  std::vector<OfMoment> all = lasting(motion.sampling);
  for (OfMoment& f : warming(motion.sampling, model.warm_up)) all.push_back(std::move(f));
  for (const ChangeEffect& e : model.further)
    for (OfMoment& f : e.columns()) all.push_back(std::move(f));
  std::vector<double> torques;
  for (Moment& m : motion.moments) {
    m.torque = m.chain;
    for (std::size_t i = 0; i < all.size(); ++i)
      m.torque += model.values[static_cast<Eigen::Index>(i)] * all[i](m);
    torques.push_back(m.torque);
  }
  for (std::size_t order = 0; order < motion.moments.front().torque_rates.size(); ++order) {
    torques = signal::derivative(torques, motion.sampling.interval);
    for (std::size_t k = 0; k < torques.size(); ++k) motion.moments[k].torque_rates[order] = torques[k];
  }
}

double best_warm_up(HealthyData& data) {
  double best = 0, least = std::numeric_limits<double>::infinity();
  std::vector<Eigen::MatrixXd> lasting, columns;
  for (const SampledMotion& motion : data.motions) lasting.push_back(lasting_columns(motion));
  for (const double tau : kWarmUps) {
    for (std::size_t r = 0; r < data.motions.size(); ++r)
      data.columns[r] = beside(lasting[r], warm_columns(data.motions[r], tau));
    if (const double squares = pooled(data).squares; squares < least) {
      least = squares;
      best = tau;
      columns = data.columns;
    }
  }
  data.columns = std::move(columns);
  return best;
}

/// Squares that one more effect would take from the residual.
double squares_taken(const HealthyData& data, const std::vector<Eigen::VectorXd>& residuals,
                     const Eigen::LDLT<Eigen::MatrixXd>& gram, const ChangeEffect& effect) {
  Eigen::MatrixXd a, b;
  Eigen::VectorXd c;
  for (std::size_t r = 0; r < data.motions.size(); ++r) {
    const auto columns = effect_columns(data.motions[r], effect);
    const Eigen::MatrixXd& z = *columns;
    if (r == 0) {
      a = Eigen::MatrixXd::Zero(z.cols(), z.cols());
      b = Eigen::MatrixXd::Zero(z.cols(), data.columns[r].cols());
      c = Eigen::VectorXd::Zero(z.cols());
    }
    a += z.transpose() * z;
    b += z.transpose() * data.columns[r];
    c += z.transpose() * residuals[r];
  }
  const Eigen::MatrixXd s = a - b * gram.solve(b.transpose());
  for (Eigen::Index i = 0; i < s.rows(); ++i)
    if (!(s(i, i) > kLeastOwn * a(i, i))) return 0;
  return c.dot(s.ldlt().solve(c));
}

/// Adds what the healthy machine shows, the largest first.
void add_further(HealthyData& data, HealthyModel& model, const ChangeSettings& settings) {
  const std::vector<ChangeEffect> effects = change_effects(model.sampling);
  for (const SampledMotion& motion : data.motions) prepare_columns(motion, effects);
  for (int k = 0; k < settings.most_columns; ++k) {
    const PooledFit fit = pooled(data);
    std::vector<Eigen::VectorXd> residuals;
    Eigen::MatrixXd gram =
        1e-9 * Eigen::MatrixXd::Identity(data.columns.front().cols(), data.columns.front().cols());
    for (std::size_t r = 0; r < data.motions.size(); ++r) {
      set_loads(fit.values, data.motions[r]);
      residuals.emplace_back(data.motions[r].target - data.columns[r] * fit.values);
      gram += data.columns[r].transpose() * data.columns[r];
    }
    const Eigen::LDLT<Eigen::MatrixXd> solver(gram);
    double most = settings.least_share * fit.squares;
    const ChangeEffect* best = nullptr;
    for (const ChangeEffect& e : effects) {
      if (e.ramp) continue;
      if (const double taken = squares_taken(data, residuals, solver, e); taken > most) {
        most = taken;
        best = &e;
      }
    }
    if (!best) return;
    model.further.push_back(*best);
    for (std::size_t r = 0; r < data.motions.size(); ++r)
      data.columns[r] = beside(data.columns[r], *effect_columns(data.motions[r], *best));
  }
}

/// How much a value differs from record to record (in one record: from half to half), with a margin.
Eigen::VectorXd spread_of(const HealthyData& data, const PooledFit& fit, const ChangeSettings& settings) {
  const double variance = fit.squares / double(fit.rows);
  double target = 0;
  Eigen::VectorXd size = Eigen::VectorXd::Zero(fit.values.size());
  std::vector<Eigen::VectorXd> fits;
  for (std::size_t r = 0; r < data.motions.size(); ++r) {
    const Eigen::MatrixXd& x = data.columns[r];
    const Eigen::VectorXd& u = data.motions[r].target;
    target += u.squaredNorm();
    size += x.colwise().squaredNorm().transpose();
    const Eigen::VectorXd sd = fit.values.cwiseAbs().array() + 1e-3;
    const Eigen::Index parts = data.motions.size() > 1 ? 1 : 2, length = u.size() / parts;
    for (Eigen::Index i = 0; i < parts; ++i) {
      const auto rows = x.middleRows(i * length, length);
      fits.push_back(pulled_fit(rows.transpose() * rows, rows.transpose() * u.segment(i * length, length),
                                fit.values, sd, variance));
    }
  }
  Eigen::VectorXd low = fits.front(), high = fits.front();
  for (const Eigen::VectorXd& f : fits) {
    low = low.cwiseMin(f);
    high = high.cwiseMax(f);
  }
  const Eigen::VectorXd least =
      (settings.prior_least * std::sqrt(target) * size.cwiseMax(1e-12).cwiseSqrt().cwiseInverse());
  Eigen::VectorXd spread =
      settings.prior_factor * (high - low).cwiseMax(settings.prior_share * fit.values.cwiseAbs() + least);
  // A record may begin warmer or colder than the one before.
  if (data.motions.front().sampling.channel == ChangeChannel::torque)
    for (const int k : {kWarmViscous, kWarmCoulomb})
      spread[k] = std::max(spread[k], std::fabs(fit.values[k]));
  return spread;
}

/// What the healthy machine leaves beside values that differ between records and wander within one: the
/// noise that scores are measured by. Twice, as the first round takes the wander for noise. Of an arm, whose
/// records are short and whose chain leaves more in another task than in those it was fitted to, all of it is
/// noise: of the measured UR10e four of nine pairs of healthy records were reported as changed otherwise.
void set_noise(const PooledFit& fit, const ChangeSettings& settings, HealthyModel& model) {
  model.noise = std::sqrt(fit.squares / double(fit.rows));
  if (model.sampling.chain) {
    for (const SampledMotion& motion : *model.records)
      model.left.push_back(residual_of(model, motion, settings).residual);
    return;
  }
  for (int round = 0; round < 2; ++round) {
    model.left.clear();
    double squares = 0;
    for (const SampledMotion& motion : *model.records) {
      model.left.push_back(background_of(model, motion, settings).left());
      squares += model.left.back().squaredNorm();
    }
    model.noise = std::sqrt(squares / double(fit.rows));
  }
}

double rms_about_offset(const HealthyData& data, const PooledFit& fit) {
  double squares = 0;
  for (const SampledMotion& m : data.motions)
    squares += (m.target.array() - fit.values[kOffset]).matrix().squaredNorm();
  return std::sqrt(squares / double(fit.rows));
}

}  // namespace

HealthyModel commission_healthy(const std::vector<record::Record>& records, const MotionSampling& sampling,
                                const ChangeSettings& settings) {
  if (records.empty()) throw CannotIdentify("there is no healthy record");
  HealthyModel model;
  model.sampling = sampling;
  double squares = 0, count = 0;
  for (const record::Record& r : records)
    for (const Moment& m : sampled_motion(r, sampling, settings).moments) {
      squares += m.speed * m.speed;
      model.sampling.fastest = std::max(model.sampling.fastest, settings.fast * std::fabs(m.speed));
      model.sampling.hardest = std::max(model.sampling.hardest, settings.fast * std::fabs(m.acceleration));
      ++count;
    }
  model.sampling.speed = std::sqrt(squares / count);
  if (!(model.sampling.speed > 0)) throw CannotIdentify(records.front().name + " does not move");
  HealthyData data;
  for (const record::Record& r : records) data.motions.push_back(sampled_motion(r, model.sampling, settings));
  data.columns.resize(data.motions.size());
  model.warm_up = best_warm_up(data);
  add_further(data, model, settings);
  const PooledFit fit = pooled(data);
  model.values = fit.values;
  model.spread = spread_of(data, fit, settings);
  if (sampling.mesh) model.least_change = settings.least_of_two * rms_about_offset(data, fit);
  model.drift = settings.drift * std::fabs(fit.values[kCoulomb]);
  for (SampledMotion& motion : data.motions) {
    set_loads(fit.values, motion);
    set_torques(model, motion);
  }
  model.records = std::make_shared<const std::vector<SampledMotion>>(std::move(data.motions));
  for (const SampledMotion& m : *model.records)
    m.known_columns.clear();  // of all effects: few are needed again
  set_noise(fit, settings, model);
  return model;
}

MeshLoad mesh_load(const HealthyModel& model, const model::Body& link, double behind,
                   const std::vector<record::Record>& healthy, const ChangeSettings& settings) {
  MeshLoad load = {behind * model.values[kInertia], link.viscous_damping, link.coulomb_friction,
                   model.values[kCosine], model.values[kSine]};
  MotionSampling sampling = model.sampling;
  sampling.mesh = load;
  double largest = 0;
  for (const record::Record& r : healthy)
    for (const Moment& m : sampled_motion(r, sampling, settings).moments)
      largest = std::max(largest, std::fabs(m.mesh));
  load.least = settings.least_load * largest;
  return load;
}

double compliance_of(const HealthyModel& model) {
  return model.values[kInertia] / model.sampling.mesh->inertia;
}

SampledMotion motion_by(const HealthyModel& model, const record::Record& record,
                        const ChangeSettings& settings) {
  SampledMotion motion = sampled_motion(record, model.sampling, settings);
  set_loads(model.values, motion);
  set_torques(model, motion);
  return motion;
}

}  // namespace backlash::changes
