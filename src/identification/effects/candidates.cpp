// SPDX-License-Identifier: BSD-3-Clause
#include "candidates.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "orthogonal_part.h"
#include "residual_orders.h"

namespace backlash::identification {
namespace {

double deviation(const std::vector<double>& x) {
  double sum = 0, square = 0;
  for (const double v : x) sum += v, square += v * v;
  const double n = double(x.size()), mean = sum / n;
  return std::sqrt(std::max(0.0, square / n - mean * mean));
}

constexpr double kResolved = 2;  // choice: periods in the travel: fewer, and whole orders are tried first

constexpr double kOrderError = 0.25;  // choice: of the resolution: whole orders that are nearer look alike

/// 1/rad, of an order that is one of those tried; 0 of one that the travel resolves.
double held_order(double order, const model::MotionRange& range) {
  const double resolution = model::order_resolution(range);
  return order < kResolved * resolution ? kOrderError * resolution : 0;
}

/// Orders are those that the travel does not resolve, and the strongest of the spectrum beyond them.
std::vector<double> values_of(const model::TermShape& shape, const ParameterValues& choices,
                              const model::MotionRange& range, const ResidualOrders& orders,
                              std::size_t peaks) {
  if (shape.later) return {0};
  std::vector<double> all = shape.values(range);
  if (!shape.wave) return all;
  const double lowest = kResolved * model::order_resolution(range);
  for (const signal::OrderPeak& peak :
       signal::strongest_orders(orders.spectrum(*shape.wave, choices), peaks, lowest))
    all.push_back(peak.order);
  return all;
}

/// All values that one term is tried with, without strength and phase.
std::vector<ParameterValues> combinations(const model::TermType& type, const model::MotionRange& range,
                                          bool load_moves, const ResidualOrders& orders, std::size_t peaks) {
  std::vector<ParameterValues> all(1);
  const auto extend = [&](const auto& options_of, const auto& set) {
    std::vector<ParameterValues> longer;
    for (const ParameterValues& values : all)
      for (const auto& option : options_of(values)) set(longer.emplace_back(values), option);
    all = std::move(longer);
  };
  for (const ParameterSpec& spec : type.parameters) {
    if (spec.choices.empty()) continue;
    std::vector<std::string> words = spec.choices;
    if (!load_moves && spec.name == "body") words = {"motor"};
    extend([&](const ParameterValues&) { return words; },
           [&](ParameterValues& v, const std::string& word) { v.set_choice(spec.name, word); });
  }
  for (const model::TermShape& shape : type.search->shapes)
    extend([&](const ParameterValues& v) { return values_of(shape, v, range, orders, peaks); },
           [&](ParameterValues& v, double value) { v[shape.name] = value; });
  return all;
}

/// The directions in which a combination can change the residuals: one, or sine and cosine.
std::vector<ParameterValues> probes(const model::TermType& type, const ParameterValues& shape,
                                    double strength) {
  const model::TermSearch& search = *type.search;
  std::vector<ParameterValues> all(search.phase.empty() ? 1 : 2, shape);
  for (ParameterValues& p : all) p[search.strength] = strength;
  if (all.size() == 1) return all;
  all[0][search.phase] = 0;
  all[1][search.phase] = M_PI / 2;
  return all;
}

struct Probed {
  const model::TermType* type;
  ParameterValues shape;
  std::string group;  // kind and choices
  double strength;    // of the probes
  // What is left of the sensitivities, 0 where the machine explains them itself. A long record has much of
  // it, so it is kept only of terms that are tried in pairs.
  Eigen::MatrixXd columns = {};
  Candidate alone = {};
};

void probe(Probed& p, const ColumnOf& column) {
  const std::vector<ParameterValues> all = probes(*p.type, p.shape, p.strength);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Eigen::VectorXd own = column(*model::make_term(p.type->id, all[i]));
    if (i == 0) p.columns.resize(own.size(), Eigen::Index(all.size()));
    p.columns.col(Eigen::Index(i)) = own;
  }
}

/// Least squares of -left on the columns; strengths in units of the probes.
struct Explained {
  Eigen::VectorXd factors;
  double gain = 0;
};

Explained explain(const Eigen::MatrixXd& columns, const Eigen::VectorXd& left) {
  Explained e;
  e.factors = signal::solve_least_squares(columns, -left).x;
  e.gain = 1 - (left + columns * e.factors).norm() / left.norm();
  return e;
}

/// What the fitted parameters do not explain of a change; 0 where that is next to nothing.
Eigen::VectorXd own_part(const Eigen::VectorXd& change, const OrthogonalPart& orthogonal,
                         const ScreenSettings& settings) {
  Eigen::VectorXd left = orthogonal.of(change);
  if (left.norm() < settings.least_own * change.norm() || change.norm() == 0) left.setZero();
  return left;
}

/// Strength and phase from the factors of one term's probes; false where the strength cannot be negative.
bool set_strength(const Probed& p, const double* factors, ParameterValues& values) {
  const model::TermSearch& search = *p.type->search;
  values = p.shape;
  if (p.columns.cols() == 2) {
    values[search.strength] = p.strength * std::hypot(factors[0], factors[1]);
    values[search.phase] = std::atan2(factors[1], factors[0]);
    return true;
  }
  values[search.strength] = p.strength * factors[0];
  for (const ParameterSpec& spec : p.type->parameters)
    if (spec.name == search.strength) return spec.range.contains(values.at(search.strength));
  return false;
}

Candidate single(const Probed& p, const Eigen::VectorXd& left) {
  Candidate c{p.type->id, {{}}};
  const Explained e = explain(p.columns, left);
  if (set_strength(p, e.factors.data(), c.terms[0])) c.gain = e.gain;
  return c;
}

Candidate pair(const Probed& a, const Probed& b, const Eigen::VectorXd& left) {
  Candidate c{a.type->id, {{}, {}}};
  Eigen::MatrixXd both(a.columns.rows(), a.columns.cols() + b.columns.cols());
  both << a.columns, b.columns;
  const Explained e = explain(both, left);
  if (set_strength(a, e.factors.data(), c.terms[0]) &&
      set_strength(b, e.factors.data() + a.columns.cols(), c.terms[1]))
    c.gain = e.gain;
  return c;
}

/// With the orders that are not fitted.
Candidate holding(Candidate c, const model::MotionRange& range) {
  for (const model::TermShape& shape : model::term_type(c.id).search->shapes)
    for (const ParameterValues& term : c.terms)
      if (shape.wave) c.held_orders.push_back(held_order(term.at(shape.name), range));
  return c;
}

void keep_better(std::map<std::string, Candidate>& best, const std::string& group,
                 const Candidate& candidate) {
  const auto [at, first] = best.try_emplace(group, candidate);
  if (!first && candidate.gain > at->second.gain) at->second = candidate;
}

std::vector<Probed> all_probes(const model::Rig& rig, const model::MotionRange& range,
                               const ResidualOrders& orders, const ScreenSettings& settings) {
  std::vector<Probed> all;
  const bool load = simulation::load_moves_freely(rig);
  for (const model::TermType& type : model::term_types()) {
    if (!type.search) continue;
    if (rig.link_locked && type.search->needs_turning_link) continue;
    const double strength = settings.probe * type.search->typical(range);
    for (const ParameterValues& shape : combinations(type, range, load, orders, settings.peaks)) {
      std::string group = type.id;
      for (const ParameterSpec& spec : type.parameters)
        if (!spec.choices.empty()) group += " " + shape.choice(spec.name);
      all.push_back({&type, shape, group, strength});
    }
  }
  return all;
}

}  // namespace

model::MotionRange motion_range(const std::vector<ServoData>& records) {
  model::MotionRange range;
  range.from = INFINITY, range.to = -INFINITY;
  for (const ServoData& d : records) {
    range.torque = std::max(range.torque, deviation(d.torque));
    range.speed = std::max(range.speed, deviation(d.motor_rate));
    std::vector<double> deflection(d.load.size());
    for (std::size_t k = 0; k < d.load.size(); ++k) deflection[k] = d.motor[k] - d.load[k];
    if (!deflection.empty()) range.deflection = std::max(range.deflection, deviation(deflection));
    const auto [low, high] = signal::extent(d.motor);
    range.from = std::min(range.from, low);
    range.to = std::max(range.to, high);
    range.duration = std::max(range.duration, d.start + double(d.size()) * d.interval);
    range.interval = d.interval;
  }
  if (range.deflection == 0) range.deflection = 0.01 * (range.to - range.from);
  return range;
}

double predicted_gain(const model::Rig& other, const MachineFit& fit, const RecordSet& records,
                      const ScreenSettings& settings) {
  const Eigen::VectorXd now = records.rows(fit.machine.rig, fit.machine.calibrations);
  const OrthogonalPart orthogonal(fit, now.size());
  const Explained e =
      explain(own_part(records.rows(other, fit.machine.calibrations) - now, orthogonal, settings),
              orthogonal.residuals());
  return e.factors[0] > 0 ? e.gain : 0;
}

std::vector<Candidate> screen(const MachineFit& fit, const RecordSet& records,
                              const model::MotionRange& range, const ScreenSettings& settings) {
  const Eigen::VectorXd now = records.rows(fit.machine.rig, fit.machine.calibrations);
  const OrthogonalPart orthogonal(fit, now.size());
  const auto column = [&](const model::Term& term) {
    model::Rig rig = fit.machine.rig;
    rig.terms.push_back(model::make_term(term.id, term.values));
    return own_part(records.rows(rig, fit.machine.calibrations) - now, orthogonal, settings);
  };
  return screen(fit.machine.rig, orders_of_fit(fit, records, orthogonal), range, settings,
                orthogonal.residuals(), column);
}

std::vector<Candidate> screen(const model::Rig& rig, const ResidualOrders& orders,
                              const model::MotionRange& range, const ScreenSettings& settings,
                              const Eigen::VectorXd& left, const ColumnOf& column) {
  std::vector<Probed> all = all_probes(rig, range, orders, settings);
  for_each_in_parallel(int(all.size()), [&](int i) {
    Probed& p = all[std::size_t(i)];
    try {
      probe(p, column);
    } catch (const Cancelled&) {
      throw;
    } catch (const Error&) {  // a load that runs away with it: no candidate
      p.columns.setZero(left.size(), 1);
    }
    p.alone = single(p, left);
    if (!p.type->search->pairs) p.columns.resize(0, 0);
  });
  std::map<std::string, Candidate> best;
  for (std::size_t i = 0; i < all.size(); ++i) {
    keep_better(best, all[i].group, all[i].alone);
    if (!all[i].type->search->pairs) continue;
    for (std::size_t j = 0; j < i; ++j)
      if (all[j].group == all[i].group) keep_better(best, all[i].group + " pair", pair(all[j], all[i], left));
  }
  std::vector<Candidate> sorted;
  for (const auto& [group, candidate] : best)
    if (candidate.gain > 0) sorted.push_back(holding(candidate, range));
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Candidate& a, const Candidate& b) { return a.gain > b.gain; });
  return sorted;
}

std::vector<std::shared_ptr<const model::Term>> probed_terms(const Candidate& candidate) {
  const model::TermType& type = model::term_type(candidate.id);
  std::vector<std::shared_ptr<const model::Term>> all;
  for (const ParameterValues& values : candidate.terms)
    for (const ParameterValues& p : probes(type, values, values.at(type.search->strength)))
      all.push_back(model::make_term(candidate.id, p));
  return all;
}

std::vector<const model::TermShape*> fitted_shapes(const Candidate& candidate, std::size_t term) {
  std::vector<const model::TermShape*> all;
  const bool held = term < candidate.held_orders.size() && candidate.held_orders[term] > 0;
  for (const model::TermShape& shape : model::term_type(candidate.id).search->shapes)
    if (shape.refined && !(shape.wave && held) && !(shape.later && candidate.terms[term].at(shape.name) == 0))
      all.push_back(&shape);
  return all;
}

std::size_t shape_count(const Candidate& candidate) {
  std::size_t count = 0;
  for (const model::TermShape& shape : model::term_type(candidate.id).search->shapes)
    for (const ParameterValues& term : candidate.terms)
      count += !(shape.later > 0 && term.at(shape.name) == 0);
  return count;
}

Machine with_candidate(Machine machine, const Candidate& candidate, const model::MotionRange& range) {
  const model::TermSearch& search = *model::term_type(candidate.id).search;
  for (std::size_t i = 0; i < candidate.terms.size(); ++i) {
    const std::size_t place = machine.rig.terms.size();
    machine.rig.terms.push_back(model::make_term(candidate.id, candidate.terms[i]));
    const auto fit = [&](const std::string& name, double scale) -> FitParameter& {
      return machine.parameters.emplace_back(term_parameter(place, name, machine.rig, scale));
    };
    fit(search.strength, search.typical(range));
    if (!search.phase.empty()) fit(search.phase, 1);
    for (const model::TermShape* shape : fitted_shapes(candidate, i)) {
      if (shape->wave) {  // a part of it counts, as of a phase, and not a share
        fit(shape->name, model::order_resolution(range)).positive = false;
        continue;
      }
      const std::vector<double> grid = shape->values(range);
      fit(shape->name, grid.size() > 1 ? std::fabs(grid[1] - grid[0]) : 1);
    }
  }
  return machine;
}

}  // namespace backlash::identification
