// SPDX-License-Identifier: BSD-3-Clause
#include "missing_effects.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "../effects/candidates.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::identification {
namespace {

constexpr double kComparable = 2;  // choice: times the squares that the best effect leaves
constexpr int kMostEffects = 4;    // choice: in one machine
constexpr double kDrawn = 0.1;     // simulation: share of what is left that follows a column
// Choice: of the squares of an effect, what the equation cannot do by itself. One with less would have to be
// ten times as large as what is left of the torque.
constexpr double kOwn = 0.01;
constexpr double kLeastExplained =
    0.1;                   // choice: share of the squares that are left beyond noise, that an effect explains
constexpr int kSteps = 8;  // choice (time): of values beside effects
constexpr double kProbe = 0.02;  // theory: of a strength that shows clearly, for differences
constexpr double kClear = 4;     // choice: standard deviations of white noise, from which an effect counts

/// What a fit of more columns moves and leaves.
struct Extended {
  Eigen::VectorXd moved;  // of the first columns
  double left = 0;        // squares
};

/// Columns, effects and residuals by their products alone, each of length 1.
class Products {
 public:
  Products(const Eigen::MatrixXd& a, const std::vector<Eigen::MatrixXd>& effects,
           const Eigen::VectorXd& residuals)
      : own_(a.cols()) {
    firsts_.push_back(own_);
    for (const Eigen::MatrixXd& e : effects) firsts_.push_back(firsts_.back() + e.cols());
    Eigen::MatrixXd all(a.rows(), firsts_.back() + 1);
    all.leftCols(own_) = a;
    for (std::size_t i = 0; i < effects.size(); ++i)
      all.middleCols(firsts_[i], effects[i].cols()) = effects[i];
    all.rightCols(1) = residuals;
    length_ = all.colwise().norm().cwiseMax(1e-300);
    for (Eigen::Index i = 0; i < all.cols(); ++i) all.col(i) /= length_[i];
    product_ = signal::gram(all);
  }
  double squares() const { return length_[last()] * length_[last()]; }
  /// With all of these effects; nothing more where the columns do as well without one.
  Extended with(const std::vector<std::size_t>& effects) const {
    std::vector<Eigen::Index> columns;
    for (Eigen::Index i = 0; i < own_; ++i) columns.push_back(i);
    for (const std::size_t e : effects)
      for (Eigen::Index i = firsts_[e]; i < firsts_[e + 1]; ++i) {
        if (!(left_of(i, columns).second > kOwn)) return {Eigen::VectorXd::Zero(own_), squares()};
        columns.push_back(i);
      }
    const auto [x, left] = left_of(last(), columns);
    return {x.head(own_).cwiseQuotient(length_.head(own_)) * length_[last()], left * squares()};
  }

 private:
  Eigen::Index last() const { return product_.cols() - 1; }
  /// Fit of one column to others, and the share of its squares that it leaves.
  std::pair<Eigen::VectorXd, double> left_of(Eigen::Index of,
                                             const std::vector<Eigen::Index>& columns) const {
    const auto n = Eigen::Index(columns.size());
    Eigen::MatrixXd among(n, n);
    Eigen::VectorXd with(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      with[i] = product_(columns[std::size_t(i)], of);
      for (Eigen::Index k = 0; k < n; ++k)
        among(i, k) = product_(columns[std::size_t(i)], columns[std::size_t(k)]);
    }
    const Eigen::VectorXd x = signal::solve_symmetric(among, with);
    return {x, product_(of, of) - x.dot(with)};
  }

  Eigen::Index own_;
  std::vector<Eigen::Index> firsts_;  // of each effect
  Eigen::VectorXd length_;
  Eigen::MatrixXd product_;
};

/// How far x is moved by what no effect explains.
Eigen::VectorXd unexplained(const Eigen::MatrixXd& a, double left) {
  const Eigen::MatrixXd gain = signal::symmetric_inverse(signal::gram(a));
  Eigen::VectorXd drawn(a.cols());
  for (Eigen::Index i = 0; i < a.cols(); ++i) drawn[i] = kDrawn * left * std::sqrt(gain(i, i));
  return drawn;
}

model::MotionRange range_of(const std::vector<model::JointMoment>& moments) {
  model::MotionRange range;
  range.from = range.to = moments.front().position;
  for (const model::JointMoment& m : moments) {
    range.speed += m.speed * m.speed, range.torque += m.load * m.load;
    range.from = std::min(range.from, m.position), range.to = std::max(range.to, m.position);
  }
  range.speed = std::sqrt(range.speed / double(moments.size()));
  range.torque = std::sqrt(range.torque / double(moments.size()));
  range.duration = moments.back().time - moments.front().time;
  return range;
}

EffectShapes shapes_of(const model::TermColumns& term, const std::vector<model::JointMoment>& moments) {
  EffectShapes all{term.type().id, std::vector<std::vector<double>>(term.count())};
  for (std::size_t i = 0; i < all.shapes.size(); ++i)
    for (const model::JointMoment& m : moments) all.shapes[i].push_back(term.at(i, m));
  return all;
}

}  // namespace

std::vector<EffectShapes> likely_effects(const std::vector<model::JointMoment>& moments) {
  const model::MotionRange range = range_of(moments);
  // Slow waves alone follow the columns of the equation: one a turn, or half of one over the travel.
  const double slowest = std::max(1.0, 0.5 * model::order_resolution(range));
  std::vector<EffectShapes> all;
  for (const model::SearchedTerm& searched : model::searched_terms(model::ShownIn::torque, range)) {
    const std::optional<ParameterSpec> shape = model::searched_shape(*searched.type);
    std::vector<double> values = searched.shapes;
    if (values.empty()) values.push_back(slowest);
    ParameterValues given = searched.given;
    for (const double value : values) {
      if (shape) given[shape->name] = value;
      all.push_back(shapes_of(model::TermColumns(*searched.type, given), moments));
    }
  }
  return all;
}

Eigen::VectorXd drawn_by_missing(const Eigen::MatrixXd& a, const Eigen::VectorXd& residuals,
                                 const std::vector<Eigen::MatrixXd>& effects, double noise, double clear,
                                 std::vector<std::size_t>* named) {
  const auto beyond = [&](double left) { return std::max(left - noise * noise, clear); };
  const Products products(a, effects, residuals);
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(a.cols());
  std::vector<std::size_t> chosen;
  Extended with{moved, residuals.squaredNorm()};
  for (int n = 0; n < kMostEffects; ++n) {
    std::vector<Extended> tried;
    for (std::size_t i = 0; i < effects.size(); ++i) {
      std::vector<std::size_t> more = chosen;
      more.push_back(i);
      tried.push_back(products.with(more));
    }
    const auto best = std::min_element(tried.begin(), tried.end(),
                                       [](const Extended& x, const Extended& y) { return x.left < y.left; });
    if (best == tried.end() || with.left - best->left < std::max(clear, kLeastExplained * beyond(with.left)))
      break;
    Eigen::VectorXd furthest = Eigen::VectorXd::Zero(a.cols());
    for (const Extended& e : tried) {
      const double share = std::min(1.0, (with.left - e.left) / beyond(with.left));
      if (with.left - e.left >= clear && beyond(e.left) <= kComparable * beyond(best->left))
        furthest = furthest.cwiseMax(share * (e.moved - with.moved).cwiseAbs());
    }
    moved += furthest;
    chosen.push_back(std::size_t(best - tried.begin()));
    with = *best;
  }
  if (named) *named = chosen;
  const double unknown = std::sqrt(std::max(0.0, with.left - noise * noise));
  return (moved.cwiseAbs2() + unexplained(a, unknown).cwiseAbs2()).cwiseSqrt();
}

namespace {

/// Friction builds up since the last reversal.
std::vector<model::JointMoment> moments_of(const PreparedServo& record, const std::vector<double>& load) {
  const ServoData& d = record.data();
  std::vector<model::JointMoment> all;
  double way = std::numeric_limits<double>::infinity(), before = 0;
  for (std::size_t k = 0; k < d.size(); ++k) {
    const double speed = d.motor_rate[k];
    way = speed * before < 0 ? 0 : way + std::fabs(speed) * d.interval;
    if (speed != 0) before = speed;
    all.push_back(
        {d.start + double(k) * d.interval, d.motor[k], speed, double(record.direction[k]), load[k], way});
  }
  return all;
}

/// How far values move beside these effects where they are fitted as well, by the slopes at the fit.
Eigen::VectorXd moved_beside(const MachineFit& fit, const Machine& start, const RecordSet& records,
                             const std::vector<Eigen::MatrixXd>& effects) {
  const Unknowns unknowns(start);
  const Eigen::Index own = fit.fit.values.size();
  Eigen::MatrixXd slopes = fit.fit.jacobian;
  for (const Eigen::MatrixXd& effect : effects) {
    slopes.conservativeResize(Eigen::NoChange, slopes.cols() + effect.cols());
    slopes.rightCols(effect.cols()) = effect;
  }
  const Eigen::VectorXd unit = slopes.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  slopes = (slopes * unit.asDiagonal()).eval();
  const Eigen::MatrixXd gram = signal::gram(slopes);
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(slopes.cols()), next = moved;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kSteps; ++i) {
    Eigen::VectorXd rows = slopes.rightCols(slopes.cols() - own) * next.tail(slopes.cols() - own);
    const Eigen::VectorXd values = fit.fit.values + next.cwiseProduct(unit).head(own);
    try {
      rows += all_rows(unknowns, records, values);
    } catch (const Error&) {  // no machine
      break;
    }
    if (!(rows.norm() < least)) break;
    least = rows.norm();
    moved = next;
    next -= signal::solve_symmetric(gram, signal::transposed_product(slopes, rows));
  }
  return moved.cwiseProduct(unit).head(own);
}

}  // namespace

std::vector<std::string> allow_for_effects(MachineFit& fit, const Machine& start, const RecordSet& records) {
  const Machine& machine = fit.machine;
  std::vector<model::JointMoment> moments;
  std::vector<ServoData> data;
  for (std::size_t i = 0; i < records.records().size(); ++i) {
    const PreparedServo& record = records.records()[i];
    data.push_back(record.data());
    const auto of = moments_of(record, record.residuals(machine.rig, machine.calibrations[i]).mesh_torque);
    moments.insert(moments.end(), of.begin(), of.end());
  }
  const Eigen::Index rows = Eigen::Index(records.layout().size());
  std::vector<Eigen::MatrixXd> effects;
  std::vector<std::string> names;
  const auto add = [&](const std::string& name, const std::vector<Eigen::VectorXd>& columns) {
    names.push_back(name);
    effects.emplace_back(Eigen::MatrixXd::Zero(fit.fit.residuals.size(), Eigen::Index(columns.size())));
    for (std::size_t i = 0; i < columns.size(); ++i)
      effects.back().col(Eigen::Index(i)).head(rows) = columns[i];
  };
  for (const EffectShapes& effect : likely_effects(moments)) {
    std::vector<Eigen::VectorXd> columns;
    for (const std::vector<double>& shape : effect.shapes) {
      std::vector<std::vector<double>> torque;
      auto at = shape.begin();
      for (const ServoData& d : data) torque.emplace_back(at, at + long(d.size())), at += long(d.size());
      columns.push_back(records.rows_of_torque(torque));
    }
    add(effect.id, columns);
  }
  const std::size_t torques = effects.size();
  const Eigen::VectorXd now = records.rows(machine.rig, machine.calibrations);
  const model::MotionRange range = motion_range(data);
  for (const model::SearchedTerm& searched : model::searched_terms(model::ShownIn::neither, range)) {
    model::Rig rig = machine.rig;
    rig.terms.push_back(model::term_of(searched, kProbe * searched.type->search->typical(range)));
    add(searched.type->id, {records.rows(rig, machine.calibrations) - now});
  }
  const double noise = fit.fit.residuals.norm() / std::max(1.0, records.misfit(machine).torque);
  const double variance = now.squaredNorm() / double((now.array() != 0).count());
  std::vector<std::size_t> clear;
  const Eigen::VectorXd drawn = drawn_by_missing(fit.fit.jacobian, fit.fit.residuals, effects, noise,
                                                 kClear * kClear * variance, &clear);
  std::vector<std::string> lacking;
  std::vector<Eigen::MatrixXd> of_teeth;  // what they do follows where the flanks are
  for (const std::size_t i : clear) {
    lacking.push_back(names[i]);
    if (i >= torques) of_teeth.push_back(effects[i]);
  }
  const Eigen::VectorXd moved = moved_beside(fit, start, records, of_teeth);
  fit.fit.covariance.diagonal() += drawn.cwiseMax(moved.cwiseAbs()).cwiseAbs2();
  return lacking;
}

}  // namespace backlash::identification
