// SPDX-License-Identifier: BSD-3-Clause
// What the search tries: terms of the registry with values, and how much each would explain.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "../fit/joint_fit.h"
#include "backlash_diagnosis/model/term.h"
#include "search_settings.h"

namespace backlash::identification {

class ResidualOrders;

/// One or two terms of the same kind, with a start for what is fitted.
struct Candidate {
  std::string id;
  std::vector<ParameterValues> terms;
  double gain = 0;        // predicted: relative decrease of the norm of all residuals
  double smoothness = 0;  // of a learned map, see learned.h
  // 1/rad, per term: standard error of an order that is not fitted but one of those that were tried, as the
  // travel hardly resolves it; 0: fitted. Empty: all are.
  std::vector<double> held_orders = {};
};

/// The shapes of the i-th term of a candidate that are fitted, in the order of their parameters in a fit.
std::vector<const model::TermShape*> fitted_shapes(const Candidate& candidate, std::size_t term);

/// All shapes of all its terms, fitted or chosen; those that are only tried later do not count before.
std::size_t shape_count(const Candidate& candidate);

/// The best candidate of each kind and choice, best first. `fit` is the present fit with its sensitivities.
/// What the fitted parameters could explain by changing does not count as a gain of a candidate.
std::vector<Candidate> screen(const MachineFit& fit, const RecordSet& records,
                              const model::MotionRange& range, const ScreenSettings& settings);

/// The same of another rig at the values of the fit, if the change to it may be of any size.
double predicted_gain(const model::Rig& other, const MachineFit& fit, const RecordSet& records,
                      const ScreenSettings& settings);

/// The change of the residuals by a term, less the part that the fitted parameters explain.
using ColumnOf = std::function<Eigen::VectorXd(const model::Term&)>;
/// The same of other residuals, `left`, with their own sensitivities.
std::vector<Candidate> screen(const model::Rig& rig, const ResidualOrders& orders,
                              const model::MotionRange& range, const ScreenSettings& settings,
                              const Eigen::VectorXd& left, const ColumnOf& column);

/// All terms of a candidate, one that has a phase as sine and cosine.
std::vector<std::shared_ptr<const model::Term>> probed_terms(const Candidate& candidate);

/// The machine with this candidate's terms, whose strengths, phases and refined shapes are fitted as well.
Machine with_candidate(Machine machine, const Candidate& candidate, const model::MotionRange& range);

/// Of all records together.
model::MotionRange motion_range(const std::vector<ServoData>& records);

}  // namespace backlash::identification
