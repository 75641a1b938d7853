// SPDX-License-Identifier: BSD-3-Clause
// Columns of effects: computed at all samples, filtered like the record, kept for the rows that count. There
// are some hundred of them in each look, so that they take most of its time.
#include <cmath>

#include "change_effects.h"

namespace backlash::changes {
namespace {

constexpr double kMostKnown = 1e7;     // rows of columns that are kept, 160 MB at most. Choice
constexpr Eigen::Index kTogether = 8;  // as many as low_pass_columns() takes at once

bool is_kept(const ChangeEffect& effect) {
  // Columns of the load depend on the assumed machine; columns of a place are needed once only.
  return !effect.of_load && !effect.at_place();
}

std::string key_of(const ChangeEffect& effect) {
  // Those of a chain are given.
  return effect.law ? effect.name() + " " + std::to_string(effect.count) : effect.name();
}

bool has_room(const SampledMotion& motion) {
  return double(motion.known_columns.size()) * double(motion.size()) < kMostKnown;
}

/// cos(n q), sin(n q) of all samples, from one order to the next by one rotation: error some 1e-16 per
/// order.
class Turning {
 public:
  explicit Turning(const SampledMotion& motion) : motion_(motion) {
    positions_.resize(static_cast<Eigen::Index>(motion.moments.size()));
    for (Eigen::Index k = 0; k < positions_.size(); ++k)
      positions_[k] = motion.moments[static_cast<std::size_t>(k)].position;
  }

  void put(const ChangeEffect& wave, Eigen::Ref<Eigen::MatrixXd> columns) {
    go_to(wave.shape);
    columns.col(0) = cosine_;
    columns.col(1) = sine_;
    if (factor_of_ != wave.type) find_factor(wave);
    for (Eigen::Index k = 0; k < columns.rows(); ++k) columns.row(k) *= factor_[k];
  }

 private:
  void go_to(double order) {
    const double step = order - order_;
    if (step <= 0 || cosine_.size() == 0) {
      cosine_ = (order * positions_).cos();
      sine_ = (order * positions_).sin();
    } else {
      if (step != step_) {
        step_ = step;
        cosine_of_step_ = (step * positions_).cos();
        sine_of_step_ = (step * positions_).sin();
      }
      const Eigen::ArrayXd cosine = cosine_ * cosine_of_step_ - sine_ * sine_of_step_;
      sine_ = sine_ * cosine_of_step_ + cosine_ * sine_of_step_;
      cosine_ = cosine;
    }
    order_ = order;
  }

  /// The wave of a moment is that times cos(n q), and sin(n q): its cosine at the position 0.
  void find_factor(const ChangeEffect& wave) {
    factor_of_ = wave.type;
    factor_.resize(positions_.size());
    const OfMoment cosine = wave.columns().front();
    for (Eigen::Index k = 0; k < factor_.size(); ++k) {
      Moment m = motion_.moments[static_cast<std::size_t>(k)];
      m.position = 0;
      factor_[k] = cosine(m);
    }
  }

  const SampledMotion& motion_;
  const model::TermType* factor_of_ = nullptr;
  Eigen::ArrayXd factor_;
  double order_ = 0, step_ = 0;
  Eigen::ArrayXd positions_, cosine_, sine_, cosine_of_step_, sine_of_step_;
};

void put(const SampledMotion& motion, const ChangeEffect& effect, Eigen::Ref<Eigen::MatrixXd> columns) {
  Eigen::Index i = 0;
  for (const OfMoment& f : effect.columns()) {
    for (Eigen::Index k = 0; k < columns.rows(); ++k)
      columns(k, i) = f(motion.moments[static_cast<std::size_t>(k)]);
    ++i;
  }
}

}  // namespace

std::shared_ptr<const Eigen::MatrixXd> effect_columns(const SampledMotion& motion,
                                                      const ChangeEffect& effect) {
  const std::string key = key_of(effect);
  const bool kept = is_kept(effect);
  if (!effect.law) return motion.known_columns.at(key);
  if (kept)
    if (const auto known = motion.known_columns.find(key); known != motion.known_columns.end())
      return known->second;
  Eigen::MatrixXd all(motion.moments.size(), effect.count);
  put(motion, effect, all);
  auto columns = std::make_shared<const Eigen::MatrixXd>(filtered(motion, std::move(all)));
  if (kept && has_room(motion)) motion.known_columns.emplace(key, columns);
  return columns;
}

void prepare_columns(const SampledMotion& motion, const std::vector<ChangeEffect>& effects) {
  Turning turning(motion);
  Eigen::MatrixXd all(motion.moments.size(), kTogether);
  std::vector<const ChangeEffect*> together;
  Eigen::Index used = 0;
  const auto finish = [&] {
    all.rightCols(kTogether - used).setZero();
    const Eigen::MatrixXd rows = filtered(motion, all);
    Eigen::Index at = 0;
    for (const ChangeEffect* e : together) {
      const auto count = static_cast<Eigen::Index>(e->count);
      motion.known_columns.emplace(key_of(*e),
                                   std::make_shared<const Eigen::MatrixXd>(rows.middleCols(at, count)));
      at += count;
    }
    together.clear();
    used = 0;
  };
  for (const ChangeEffect& e : effects) {
    const auto count = static_cast<Eigen::Index>(e.count);
    if (!is_kept(e) || count == 0 || motion.known_columns.count(key_of(e)) > 0) continue;
    if (!has_room(motion)) break;
    if (used + count > kTogether) finish();
    if (e.has_order())
      turning.put(e, all.middleCols(used, count));
    else
      put(motion, e, all.middleCols(used, count));
    together.push_back(&e);
    used += count;
  }
  if (used > 0) finish();
}

}  // namespace backlash::changes
