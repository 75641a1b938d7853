// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/driven_load.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/stick_slip.h"
#include "lane_group.h"
#include "loads_together.h"

namespace backlash::simulation {
namespace {

/// A load that stands.
class LockedLoad {
 public:
  explicit LockedLoad(const model::Rig& rig) : train_(rig), plain_(train_.plain_load()) {
    if (!plain_) return;
    const model::PowerContact law = *train_.power_contact();
    forces_ = {train_.equations(),
               {law.exponent, law.stiffness, law.loss, law.damping, 0.5 * train_.backlash()},
               train_.load_inertia(),
               0};
  }

  double q = 0, w = 0;

  double shown() const { return q; }

  double begin(const Segment& s) { return (last_ = forces(s.at(0))).mesh_torque; }

  double step(const Segment& s, Halves<double>& sum) {
    const Forces start = last_;
    last_ = forces(s.at(1));
    sum.add(0, 1, start.mesh_on_motor, forces(s.at(0.5)).mesh_on_motor, last_.mesh_on_motor);
    return last_.mesh_torque;
  }

 private:
  struct Forces {
    double mesh_torque, mesh_on_motor;
  };
  Forces forces(const Moment& m) const {
    if (plain_) {
      const double torque = forces_.forces(m, 0, 0).mesh_torque;
      return {torque, -torque};
    }
    const model::GearTrain::LoadForces f = train_.load_forces({m.time, m.motor, m.motor_rate, 0, 0, 0});
    return {f.mesh_torque, f.mesh_on_motor};
  }

  model::GearTrain train_;
  bool plain_;
  PlainLoad<double> forces_{};
  Forces last_{};
};

void check(const model::Rig& rig) {
  if (!rig.input_coupling.rigid)
    throw InvalidParameter("input_coupling", "flexible",
                           "a load that follows the recorded motor needs a rigid one");
  if (!rig.output_coupling.rigid && !rig.bearing_at_gear)
    throw InvalidParameter(
        "output_coupling", "flexible",
        "a load that follows the recorded motor needs a rigid one or a bearing at the gear");
  if (!rig.mesh.rigid && rig.mesh.contact->needs_impact_speed())
    throw InvalidParameter("contact.law", "with touches",
                           "a load that follows the recorded motor needs a law without impact speed");
}

/// Every sample in turn; `Body` is what the load does within one.
template <typename Body>
DrivenLoad follow(Body& load, const RecordedMotion& motion) {
  const std::size_t n = motion.motor->size();
  DrivenLoad out = columns(n);
  double mesh_torque = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const Segment segment = segment_after(motion, k);
    if (k == 0) mesh_torque = load.begin(segment);
    out.load[k] = load.shown();
    out.load_rate[k] = load.w;
    out.mesh_torque[k] = mesh_torque;
    if (!(std::fabs(load.w) < kFarthest)) run_away(segment.start);
    if (k + 1 == n) break;
    Halves<double> half;
    mesh_torque = load.step(segment, half);
    out.mesh_on_motor[k] += k == 0 ? 2 * half.early : half.early;
    out.mesh_on_motor[k + 1] += k + 2 == n ? 2 * half.late : half.late;
  }
  return out;
}

double of_motor_dampers(const model::GearTrain& train, double rate) {
  double net[kParts];
  train.equations().net_torques(
      kFollowing, {{}, {rate, rate, 0, 0}}, 0, 0, [](double*) {}, net);
  return net[kFollowing.node[model::TrainParts::kMotor]];
}

}  // namespace

model::Rig acting_on_load(model::Rig rig) {
  const model::Rig none;
  rig.name = none.name;
  rig.joint = none.joint;
  rig.reduction_ratio = none.reduction_ratio;
  rig.motor_side = none.motor_side;
  rig.linear = none.linear;
  rig.motor = none.motor;
  rig.pinion = none.pinion;
  rig.torque_constant = none.torque_constant;
  rig.sensor_with_damper = none.sensor_with_damper;
  rig.encoder_skew = none.encoder_skew;
  rig.coupled = none.coupled;
  if (rig.input_coupling.rigid) rig.input_coupling = none.input_coupling;
  const auto idle = [](const std::shared_ptr<const model::Term>& term) { return !term->moves_load(); };
  rig.terms.erase(std::remove_if(rig.terms.begin(), rig.terms.end(), idle), rig.terms.end());
  return rig;
}

bool load_moves_freely(const model::Rig& rig) {
  return !rig.mesh.rigid && !rig.link_locked;
}

DrivenLoad simulate_driven_load(const model::Rig& rig, const RecordedMotion& motion, double feedback) {
  check(rig);
  if (rig.mesh.rigid) {
    const std::vector<double> none(motion.motor->size(), 0.0);
    return {*motion.motor, *motion.motor_rate, none, none};
  }
  if (rig.link_locked) {
    LockedLoad load(rig);
    return follow(load, motion);
  }
  FreeLoad load(rig, motion.load_rate ? feedback : 0);
  load.q = motion.first_load;
  load.w = motion.first_load_rate;
  return follow(load, motion);
}

std::size_t loads_at_once() {
  return rigs_of_group(std::numeric_limits<std::size_t>::max());
}

std::vector<DrivenLoad> simulate_driven_loads(const std::vector<model::Rig>& rigs,
                                              const std::vector<double>& first_loads,
                                              const RecordedMotion& motion, double feedback) {
  std::vector<FreeLoad> loads;
  bool together = 1 < rigs.size() && rigs.size() <= loads_at_once();
  for (std::size_t i = 0; i < rigs.size() && together; ++i) {
    check(rigs[i]);
    if (!load_moves_freely(rigs[i])) return {};
    loads.emplace_back(rigs[i], motion.load_rate ? feedback : 0);
    loads.back().q = first_loads[i];
    loads.back().w = motion.first_load_rate;
    together = loads.back().joins(loads.front());
  }
  std::vector<DrivenLoad> out;
  if (!together) return out;
  out.assign(loads.size(), columns(motion.motor->size()));
  follow_all(loads, motion, out);
  return out;
}

MotorTorques motor_torques(const model::Rig& rig, const RecordedMotion& motion, const DrivenLoad& load) {
  const model::GearTrain train(rig);
  const std::size_t n = motion.motor->size();
  MotorTorques out{load.mesh_on_motor, {}, load.mesh_torque};
  std::vector<double> net(n);
  if (rig.terms.empty() && !rig.mesh.rigid) {  // dampers and friction that does not change
    out.friction.assign(n, train.motor_forces({}).friction);
    for (std::size_t k = 0; k < n; ++k) net[k] = of_motor_dampers(train, (*motion.motor_rate)[k]);
  } else {
    out.friction.resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      model::Motion m{motion.start + double(k) * motion.interval,
                      (*motion.motor)[k],
                      (*motion.motor_rate)[k],
                      load.load[k],
                      load.load_rate[k],
                      load.mesh_torque[k]};
      if (rig.mesh.rigid)
        out.mesh_torque[k] = m.mesh_torque =
            train.torque_of_load(m, motion.acceleration ? (*motion.acceleration)[k] : 0);
      const model::GearTrain::MotorForces forces = train.motor_forces(m);
      net[k] = forces.net;
      out.friction[k] = forces.friction;
    }
  }
  // The triangular weights of two intervals, by Simpson's rule for what is smooth.
  for (std::size_t k = 0; k < n; ++k) {
    const double before = net[k > 0 ? k - 1 : 0], after = net[std::min(k + 1, n - 1)];
    out.mean[k] = out.mean[k] + before / 12 + 10.0 / 12 * net[k] + after / 12;
  }
  return out;
}

}  // namespace backlash::simulation
