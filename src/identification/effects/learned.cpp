// SPDX-License-Identifier: BSD-3-Clause
#include "learned.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "orthogonal_part.h"

namespace backlash::identification {
namespace {

constexpr int kPoints = 40;  // choice: of a map; its smoothness is found by cross-validation

std::vector<double> coordinate(const std::string& name, const RecordSet& records, const Machine& machine) {
  std::vector<double> all;
  for (std::size_t i = 0; i < records.records().size(); ++i) {
    const ServoData& d = records.records()[i].data();
    const auto take = [&](const std::vector<double>& x) { all.insert(all.end(), x.begin(), x.end()); };
    if (name == "motor_position") take(d.motor);
    if (name == "motor_velocity") take(d.motor_rate);
    if (name == "load_position") take(d.load);
    if (name == "load_velocity") take(d.load_rate);
    if (name == "mesh_torque")
      take(records.records()[i].residuals(machine.rig, machine.calibrations[i]).load->mesh_torque);
    if (name == "time")
      for (std::size_t k = 0; k < d.size(); ++k) all.push_back(d.start + double(k) * d.interval);
  }
  return all;
}

/// Evenly spaced over what the records cover.
std::vector<double> points_over(const std::vector<double>& values, double tail) {
  const double low = signal::quantile(values, tail), high = signal::quantile(values, 1 - tail);
  std::vector<double> points;
  if (!(high > low)) return points;
  for (int i = 0; i < kPoints; ++i) points.push_back(low + (high - low) * i / (kPoints - 1));
  return points;
}

ParameterValues map_values(const model::MapKind& kind, const std::vector<double>& points,
                           std::vector<double> values) {
  const model::TermMap& map = *map_term().map;
  ParameterValues p;
  p.set_choice(map.acts_on, kind.acts_on);
  p.set_choice(map.coordinate, kind.coordinate);
  p.set_list(map.points, points);
  p.set_list(map.values, std::move(values));
  return p;
}

/// What is left of the sensitivities to each value of a map.
Eigen::MatrixXd columns(const model::MapKind& kind, const std::vector<double>& points, double step,
                        const MachineFit& fit, const RecordSet& records, const OrthogonalPart& orthogonal,
                        const Eigen::VectorXd& now) {
  Eigen::MatrixXd all(now.size(), kPoints);
  for_each_in_parallel(kPoints, [&](int i) {
    std::vector<double> values(kPoints, 0.0);
    values[i] = step;
    model::Rig rig = fit.machine.rig;
    rig.terms.push_back(model::make_term(map_term().id, map_values(kind, points, values)));
    try {
      all.col(i) = orthogonal.of(records.rows(rig, fit.machine.calibrations) - now) / step;
    } catch (const Cancelled&) {
      throw;
    } catch (const Error&) {
      all.col(i).setZero();
    }
  });
  return all;
}

/// Least squares in blocks, each of which can be left out.
struct Blocks {
  std::vector<Eigen::MatrixXd> normal;
  std::vector<Eigen::VectorXd> gradient;
  std::vector<double> square;
};

Blocks in_blocks(const Eigen::MatrixXd& c, const Eigen::VectorXd& left, const RecordSet& records,
                 int blocks) {
  Blocks b;
  b.normal.assign(blocks, Eigen::MatrixXd::Zero(c.cols(), c.cols()));
  b.gradient.assign(blocks, Eigen::VectorXd::Zero(c.cols()));
  b.square.assign(blocks, 0);
  for (Eigen::Index i = 0; i < c.rows(); ++i) {
    const RecordSet::Row& row = records.layout()[std::size_t(i)];
    const ServoData& d = records.records()[row.record].data();
    const auto at =
        std::min<std::size_t>(blocks - 1, std::size_t(blocks * row.time / (double(d.size()) * d.interval)));
    b.normal[at].noalias() += c.row(i).transpose() * c.row(i);
    b.gradient[at] -= c.row(i).transpose() * left[i];
    b.square[at] += left[i] * left[i];
  }
  return b;
}

Eigen::MatrixXd roughness() {
  Eigen::MatrixXd d = Eigen::MatrixXd::Zero(kPoints - 2, kPoints);
  for (int i = 0; i + 2 < kPoints; ++i) d(i, i) = 1, d(i, i + 1) = -2, d(i, i + 2) = 1;
  return signal::gram(d);
}

/// Squared norm of what is left in blocks that the map did not see.
double held_out_square(const Blocks& b, const Eigen::MatrixXd& all, const Eigen::VectorXd& gradient,
                       const Eigen::MatrixXd& prior) {
  double sum = 0;
  for (std::size_t k = 0; k < b.normal.size(); ++k) {
    const Eigen::VectorXd v = signal::solve_symmetric(all - b.normal[k] + prior, gradient - b.gradient[k]);
    sum += b.square[k] - 2 * v.dot(b.gradient[k]) + v.dot(b.normal[k] * v);
  }
  return sum;
}

LearnedCandidate learn(const model::MapKind& kind, const std::vector<double>& points,
                       const Eigen::MatrixXd& c, const Eigen::VectorXd& left, const RecordSet& records,
                       const MapSettings& settings) {
  const Blocks blocks = in_blocks(c, left, records, settings.blocks);
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(kPoints, kPoints);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(kPoints);
  for (const Eigen::MatrixXd& normal : blocks.normal) all += normal;
  for (const Eigen::VectorXd& one : blocks.gradient) gradient += one;
  const double mean = all.trace() / kPoints;
  LearnedCandidate best;
  if (!(mean > 0)) return best;
  const Eigen::MatrixXd rough = roughness(),
                        ridge = settings.ridge * mean * Eigen::MatrixXd::Identity(kPoints, kPoints);
  double least = INFINITY;
  for (double weight = settings.roughest * mean; weight < settings.smoothest * mean; weight *= 10) {
    const Eigen::MatrixXd prior = weight * rough + ridge;
    const double square = held_out_square(blocks, all, gradient, prior);
    if (!(square < least)) continue;
    least = square;
    Eigen::VectorXd v = signal::solve_symmetric(all + prior, gradient);
    v = v.cwiseMax(kind.least);
    best.values = map_values(kind, points, {v.begin(), v.end()});
    best.smoothness = weight;
    best.gain = 1 - std::sqrt(std::max(0.0, square)) / left.norm();
  }
  return best;
}

}  // namespace

const model::TermType& map_term() {
  static const model::TermType& type =
      model::term_type_that([](const model::TermType& t) { return t.map.has_value(); });
  return type;
}

const model::MapKind& kind_of(const ParameterValues& values) {
  const model::TermMap& map = *map_term().map;
  for (const model::MapKind& kind : map.kinds)
    if (kind.acts_on == values.choice(map.acts_on) && kind.coordinate == values.choice(map.coordinate))
      return kind;
  throw InvalidParameter(map.coordinate, values.choice(map.coordinate), "is not one that is learned");
}

std::vector<LearnedCandidate> learn_maps(const MachineFit& fit, const RecordSet& records,
                                         const model::MotionRange& range, const MapSettings& settings) {
  const Eigen::VectorXd now = records.rows(fit.machine.rig, fit.machine.calibrations);
  const OrthogonalPart orthogonal(fit, now.size());
  std::vector<LearnedCandidate> all;
  for (const model::MapKind& kind : map_term().map->kinds) {
    if (kind.needs_load && !simulation::load_moves_freely(fit.machine.rig)) continue;
    const std::vector<double> points =
        points_over(coordinate(kind.coordinate, records, fit.machine), settings.tail);
    if (points.empty()) continue;
    const double step = settings.probe * kind.typical(range);
    const LearnedCandidate one =
        learn(kind, points, columns(kind, points, step, fit, records, orthogonal, now),
              orthogonal.residuals(), records, settings);
    if (one.gain > 0) all.push_back(one);
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const LearnedCandidate& a, const LearnedCandidate& b) { return a.gain > b.gain; });
  return all;
}

Machine with_map(Machine machine, const LearnedCandidate& candidate, const model::MotionRange& range,
                 const MapSettings& settings) {
  const std::size_t place = machine.rig.terms.size();
  machine.has_map = true;
  machine.rig.terms.push_back(model::make_term(map_term().id, candidate.values));
  const model::TermMap& map = *map_term().map;
  const double scale = kind_of(candidate.values).typical(range);
  for (std::size_t i = 0; i < kPoints; ++i)
    machine.parameters.push_back(list_parameter(place, map.values, i, scale));
  const double root = std::sqrt(candidate.smoothness),
               ridge = std::sqrt(settings.ridge * candidate.smoothness);
  for (std::size_t i = 0; i < kPoints; ++i) {
    machine.priors.emplace_back(
        [=, &map](const model::Rig& rig) { return ridge * rig.terms[place]->values.list(map.values)[i]; });
    if (i + 2 < kPoints)
      machine.priors.emplace_back([=, &map](const model::Rig& rig) {
        const std::vector<double>& v = rig.terms[place]->values.list(map.values);
        return root * (v[i] - 2 * v[i + 1] + v[i + 2]);
      });
  }
  return machine;
}

}  // namespace backlash::identification
