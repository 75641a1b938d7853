// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/ensemble.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "lane_group.h"

namespace backlash::simulation {
namespace {

double rounding(double t) {
  return 4 * std::numeric_limits<double>::epsilon() * std::fabs(t);
}

}  // namespace

bool Ensemble::takes(const std::vector<model::Rig>& rigs, const ExcitationSettings& excitation) {
  if (rigs.empty() || excitation.is_speed_loop() || excitation.type == "topic" || excitation.motor_brake)
    return false;
  std::optional<int> layout;
  std::optional<double> exponent;
  for (const model::Rig& rig : rigs) {
    const model::GearTrain train(rig);
    const std::optional<model::PowerContact> contact = train.power_contact();
    if (!train.smooth() || !contact) return false;
    if (layout && *layout != train.layout().number()) return false;
    if (exponent && *exponent != contact->exponent) return false;
    layout = train.layout().number();
    exponent = contact->exponent;
  }
  return true;
}

Ensemble::Ensemble(const std::vector<model::Rig>& rigs, const ExcitationSettings& excitation,
                   const SolverSettings& solver)
    : at_load_(excitation.at_load), excitation_(excitation.create()) {
  if (!takes(rigs, excitation))
    throw InvalidParameter("rigs", double(rigs.size()), "cannot be moved at once");
  if (at_load_ && rigs.front().link_locked)
    throw InvalidParameter("excitation.at", "load", "the link is locked");
  for (const model::Rig& rig : rigs) trains_.emplace_back(rig);
  const bool held = excitation.type == "square" || excitation.type == "constant";
  while (places_.size() < trains_.size()) {
    const std::size_t first = places_.size(), count = rigs_of_group(trains_.size() - first);
    groups_.push_back(make_group({trains_.begin() + long(first), trains_.begin() + long(first + count)},
                                 solver, at_load_, held));
    for (std::size_t i = 0; i < count; ++i) places_.push_back({groups_.back().get(), int(i)});
  }
  for (const auto& group : groups_) group->restart(0, excitation_->torque(0, 0));
}

Ensemble::~Ensemble() = default;

void Ensemble::advance_to(double t) {
  if (!std::isfinite(t) || t < time_ - rounding(time_))
    throw InvalidParameter("time", t, "must be finite and >= " + std::to_string(time_) + " s");
  const double reach = t + rounding(t);
  for (double stop = excitation_->segment_end(segment_); stop <= reach;
       stop = excitation_->segment_end(segment_)) {
    for (const auto& group : groups_) group->advance_to(stop, stop, *excitation_, segment_);
    const double torque = excitation_->torque(stop, ++segment_);
    for (const auto& group : groups_) group->restart(stop, torque);
    time_ = stop;
  }
  time_ = std::max(t, time_);
  const double stop = excitation_->segment_end(segment_);
  for (const auto& group : groups_) group->advance_to(time_, stop, *excitation_, segment_);
}

std::vector<double> Ensemble::state(std::size_t rig) const {
  const Place& place = places_.at(rig);
  std::vector<double> numbers(2 * std::size_t(trains_[rig].dof()));
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = place.group->state(place.lane, int(i));
  return numbers;
}

model::Observation Ensemble::observe(std::size_t rig) const {
  const double torque = excitation_->torque(time_, segment_);
  return trains_.at(rig).observe(
      state(rig).data(), at_load_ ? model::AppliedTorque(0, torque) : model::AppliedTorque(torque, 0), time_);
}

long Ensemble::steps() const {
  long sum = 0;
  for (const auto& group : groups_) sum += group->steps();
  return sum;
}

}  // namespace backlash::simulation
