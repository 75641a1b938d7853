// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/gear_train.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

constexpr double kWithinReach =
    0.1;  // of half a gap, from which a flank that moves less than that cannot touch

Coupling referred(Coupling coupling, double factor) {
  coupling.stiffness *= factor;
  coupling.damping *= factor;
  coupling.inertia *= factor;
  return coupling;
}

double spring(const Coupling& c, double twist) {
  return c.stiffness * twist;
}

FrictionLimits directional(const Body& body, double factor) {
  return {(body.coulomb_friction + body.coulomb_asymmetry) * factor,
          (body.coulomb_friction - body.coulomb_asymmetry) * factor};
}

}  // namespace

GearTrain::GearTrain(const Rig& rig)
    : ratio_(rig.motor_axis_ratio()),
      damping_{rig.motor.viscous_damping * ratio_ * ratio_, rig.pinion.viscous_damping * ratio_ * ratio_,
               rig.gear.viscous_damping, rig.link.viscous_damping},
      input_(referred(rig.input_coupling, ratio_ * ratio_)),
      output_(rig.output_coupling),
      sensed_damping_(rig.sensor_with_damper ? input_.damping : 0),
      lever_(rig.mesh.lever()),
      start_(rig.mesh.start_in_gap),
      asymmetry_{rig.motor.viscous_asymmetry * ratio_ * ratio_,
                 rig.pinion.viscous_asymmetry * ratio_ * ratio_, rig.gear.viscous_asymmetry,
                 rig.link.viscous_asymmetry},
      coulomb_{directional(rig.motor, ratio_), directional(rig.link, 1)},
      torque_constant_(rig.torque_constant),
      contact_(rig.mesh.contact),
      variation_(rig.mesh.variation),
      terms_(rig.terms),
      load_gain_(sensing(rig.terms).load_position_gain) {
  if (rig.mesh.rigid)
    contact_ = nullptr;
  else if (!contact_)
    throw InvalidParameter("mesh.contact", "none", "the mesh needs a contact law");
  set_backlash(rig.mesh.backlash);
  join(rig);
  bool dry = false;
  EndFriction at_rest;
  for (const auto& term : terms_) {
    loaded_ |= term->loads_flanks();
    shaped_ |= term->shapes_flanks() || term->loads_flanks();
    shape_follows_torque_ |= term->shape_follows_torque();
    dry |= term->has_dry_friction();
    term->add_friction({}, at_rest);
    const bool acts_on_flanks = term->shapes_flanks() || term->loads_flanks();
    if (term->shapes_flanks()) flank_terms_.push_back(term.get());
    if (term->moves_load() && !acts_on_flanks) load_terms_.push_back(term.get());
  }
  presliding_ = at_rest.motor.presliding > 0 || at_rest.load.presliding > 0;
  const auto rubs = [](const FrictionLimits& f) { return f.forward > 0 || f.backward > 0; };
  const bool load_rubs = (dry || rubs(coulomb_.load)) && node_[kLink] != kFixed;
  if (dry || rubs(coulomb_.motor) || (load_rubs && one_body())) dry_ends_.push_back({kMotor, {}});
  if (load_rubs && !one_body()) dry_ends_.push_back({kLink, {}});
  simplify(rig);
}

/// Where no more than teeth and springs act; see SmoothTrain.
void GearTrain::simplify(const Rig& rig) {
  if (!contact_ || contact_->needs_impact_speed() || variation_ || !terms_.empty() || !dry_ends_.empty())
    return;
  SmoothTrain<double> t;
  layout_ = {!input_.rigid, node_[kGear] != kFixed, !output_.rigid, !rig.link_locked};
  std::copy(damping_.begin(), damping_.end(), t.damping);
  std::copy(asymmetry_.begin(), asymmetry_.end(), t.asymmetry);
  t.input_stiffness = input_.stiffness, t.input_damping = input_.damping;
  t.output_stiffness = output_.stiffness, t.output_damping = output_.damping;
  t.lever = lever_, t.start = start_;
  for (int node = 0; node < dof_; ++node) t.inverse_inertia[node] = 1 / inertia_[node];
  smooth_ = t;
}

void GearTrain::brake_motor() {
  smooth_.reset();
  braked_ = true;
  if (dry_ends_.empty() || dry_ends_.front().slot != kMotor)
    dry_ends_.insert(dry_ends_.begin(), {kMotor, {}});
}

double GearTrain::load_inertia() const {
  return node_[kLink] == kFixed ? std::numeric_limits<double>::infinity() : inertia_[node_[kLink]];
}

/// Gives each part its degree of freedom and sums the inertia that moves with it.
void GearTrain::join(const Rig& rig) {
  const double square = ratio_ * ratio_;
  node_[kMotor] = dof_++;
  node_[kPinion] = input_.rigid ? node_[kMotor] : dof_++;
  const bool gear_fixed = rig.link_locked && output_.rigid;
  node_[kGear] = gear_fixed ? kFixed : rig.mesh.rigid ? node_[kPinion] : dof_++;
  node_[kLink] = rig.link_locked ? kFixed : output_.rigid ? node_[kGear] : dof_++;
  const double part[kSlots] = {
      rig.motor.inertia * square + 0.5 * input_.inertia, rig.pinion.inertia * square + 0.5 * input_.inertia,
      rig.gear.inertia + 0.5 * output_.inertia, rig.link.inertia + 0.5 * output_.inertia};
  for (int slot = 0; slot < kSlots; ++slot)
    if (node_[slot] != kFixed) inertia_[node_[slot]] += part[slot];
  for (int node = 0; node < dof_; ++node)
    if (!(inertia_[node] > 0))
      throw InvalidParameter("inertia", inertia_[node], "every moving part needs inertia");
}

void GearTrain::set_backlash(double backlash) {
  if (!(backlash >= 0) || !std::isfinite(backlash))
    throw InvalidParameter("backlash", backlash, "must be >= 0 and finite");
  half_gap_ = acting_gap_ = 0.5 * backlash;
}

GearTrain::Slots GearTrain::unpack(const double* state) const {
  Slots s;
  for (int slot = 0; slot < kSlots; ++slot) {
    const int node = node_[slot];
    s.q[slot] = node == kFixed ? 0 : state[node];
    s.w[slot] = node == kFixed ? 0 : state[dof_ + node];
  }
  return s;
}

inline double GearTrain::contact_force(const Slots& s) const {
  if (!contact_) return 0;
  const double x = relative(s);
  const double penetration = std::fabs(x) - acting_gap_;
  if (penetration <= 0) return 0;
  const double side = x > 0 ? 1 : -1;
  const double rate = side * lever_ * (s.w[kPinion] - s.w[kGear]);
  const double force = side * contact_->force(penetration, rate, impact_speed_);
  return variation_ ? force * variation_->factor(lever_ * s.q[kPinion], side) : force;
}

FlankPoint GearTrain::flank_point(const Slots& s, int side, double mesh_torque) const {
  return {s.q[kPinion], s.q[kGear], half_gap_ / lever_, mesh_torque, side};
}

FlankShift GearTrain::shift(const Slots& s, int side, double mesh_torque) const {
  FlankShift sum;
  if (!shaped_) return sum;
  const FlankPoint point = flank_point(s, side, mesh_torque);
  for (const Term* term : flank_terms_) term->shape(point, sum);
  return sum;
}

/// Of a flank that is closed by `penetration` [m], moving at `rate` [m/s].
double GearTrain::flank_force(const Slots& s, int side, double penetration, double rate,
                              double mesh_torque) const {
  double force = contact_->force(penetration, rate, impact_speed_);
  if (variation_) force *= variation_->factor(lever_ * s.q[kPinion], side);
  if (!loaded_) return force;
  double torque = lever_ * force;
  const FlankLoad load{flank_point(s, side, mesh_torque), penetration / lever_, rate / lever_};
  for (const auto& term : terms_) term->load_flank(load, torque);
  return std::max(0.0, torque) / lever_;
}

/// Force >= 0 on the flank of this side [N], shifted as given.
inline double GearTrain::shifted_force(const Slots& s, int side, const FlankShift& at,
                                       double mesh_torque) const {
  const double penetration = side * relative(s) - acting_gap_ - lever_ * at.opening;
  if (!(penetration > 0)) return 0;
  const double rate = side * lever_ * (s.w[kPinion] - s.w[kGear]) -
                      lever_ * (at.motor_slope * s.w[kPinion] + at.load_slope * s.w[kGear]);
  return flank_force(s, side, penetration, rate, mesh_torque);
}

/// The same wherever the flank is. Where its shape follows the torque that it carries both are
/// found together, between no torque and one that the flank does not bear, by the Illinois method. Infinite
/// where the flank advances faster with the torque than the teeth give way.
double GearTrain::shaped_force(const Slots& s, int side, FlankShift& at) const {
  const auto force = [&](double mesh_torque) {
    at = shift(s, side, mesh_torque);
    return shifted_force(s, side, at, mesh_torque);
  };
  const double f0 = force(0);
  if (!shape_follows_torque_ || f0 == 0) return f0;
  const auto excess = [&](double t) { return lever_ * force(side * t) - t; };
  double low = 0, above = lever_ * f0, high = above, below = excess(high);
  for (int i = 0; below > 0 && i < 50; ++i) low = high, above = below, below = excess(high *= 2);
  if (below > 0) return std::numeric_limits<double>::infinity();
  double t = high, rest = below;
  int last = 0;
  for (int i = 0; std::fabs(rest) > 1e-13 * t && i < 100; ++i) {
    t = (low * below - high * above) / (below - above);
    rest = excess(t);
    if (rest > 0) {
      low = t, above = rest;
      if (last == 1) below *= 0.5;
      last = 1;
    } else {
      high = t, below = rest;
      if (last == -1) above *= 0.5;
      last = -1;
    }
  }
  return t / lever_;
}

/// Adds what a flank does to pinion and gear under its torque >= 0.
inline void GearTrain::press(int side, const FlankShift& at, double flank_torque, double* torque) {
  torque[kPinion] -= flank_torque * (side - at.motor_slope);
  torque[kGear] += flank_torque * (side + at.load_slope);
}

/// Adds what both flanks do to pinion and gear and returns the mesh torque. A gap that a term closes
/// altogether presses both flanks.
double GearTrain::shaped_torques(const Slots& s, double* torque) const {
  double mesh_torque = 0;
  for (const int side : {1, -1}) {
    FlankShift at;
    const double t = lever_ * shaped_force(s, side, at);
    press(side, at, t, torque);
    mesh_torque += side * t;
  }
  return mesh_torque;
}

EndFriction GearTrain::friction(const Motion& motion) const {
  EndFriction sum = coulomb_;
  for (const auto& term : terms_) term->add_friction(motion, sum);
  if (one_body()) {  // it sticks by both
    sum.motor.forward += sum.load.forward;
    sum.motor.backward += sum.load.backward;
    sum.motor.presliding = std::max(sum.motor.presliding, sum.load.presliding);
    sum.motor.presliding_damping += sum.load.presliding_damping;
    sum.load = {};
  }
  for (FrictionLimits* limits : {&sum.motor, &sum.load}) {
    limits->forward = std::max(0.0, limits->forward);
    limits->backward = std::max(0.0, limits->backward);
  }
  if (braked_) sum.motor = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  return sum;
}

/// All torques but dry friction, per degree of freedom [N m]; returns that through the teeth.
inline double GearTrain::net_torques(double t, const Slots& s, AppliedTorque applied, double* net) const {
  double torque[kSlots];
  for (int slot = 0; slot < kSlots; ++slot)
    torque[slot] = -damping_[slot] * s.w[slot] - asymmetry_[slot] * std::fabs(s.w[slot]);
  torque[kMotor] += applied.motor * ratio_;
  torque[kLink] += applied.load;
  if (!input_.rigid) {
    const double through =
        spring(input_, s.q[kMotor] - s.q[kPinion]) + input_.damping * (s.w[kMotor] - s.w[kPinion]);
    torque[kMotor] -= through;
    torque[kPinion] += through;
  }
  if (!output_.rigid) {
    const double through =
        spring(output_, s.q[kGear] - s.q[kLink]) + output_.damping * (s.w[kGear] - s.w[kLink]);
    torque[kGear] -= through;
    torque[kLink] += through;
  }
  double mesh_torque;
  if (shaped_ && contact_) {
    mesh_torque = shaped_torques(s, torque);
  } else {
    mesh_torque = lever_ * contact_force(s);
    torque[kPinion] -= mesh_torque;
    torque[kGear] += mesh_torque;
  }
  if (!terms_.empty()) {
    const Motion motion = motion_of(t, s, mesh_torque, applied);
    EndTorques ends;
    for (const auto& term : terms_) term->add(motion, ends);
    torque[kMotor] += ends.motor;
    torque[kLink] += ends.load;
  }
  std::fill(net, net + kSlots, 0.0);
  for (int slot = 0; slot < kSlots; ++slot)
    if (node_[slot] != kFixed) net[node_[slot]] += torque[slot];
  return mesh_torque;
}

GearTrain::Balance GearTrain::balance(double t, const double* state, AppliedTorque applied) const {
  const Slots s = unpack(state);
  Balance b;
  b.mesh_torque = net_torques(t, s, applied, b.net);
  if (!dry_ends_.empty()) b.friction = friction(motion_of(t, s, b.mesh_torque, applied));
  return b;
}

void GearTrain::derivative(double t, const double* state, AppliedTorque applied, double* rate) const {
  if (smooth_) {
    const auto force = [this](double x, double v) {
      const double penetration = std::fabs(x) - half_gap_, side = x > 0 ? 1 : -1;
      return penetration > 0 ? side * contact_->force(penetration, side * v, 0) : 0;
    };
    return smooth_->derivative(layout_, state, applied.motor * ratio_, applied.load, half_gap_, force, rate);
  }
  const Slots s = unpack(state);
  double net[kSlots];
  const double mesh_torque = net_torques(t, s, applied, net);
  for (int node = 0; node < dof_; ++node) {
    rate[node] = state[dof_ + node];
    rate[dof_ + node] = net[node] / inertia_[node];
  }
  if (dry_ends_.empty()) return;
  const EndFriction rubbing = friction(motion_of(t, s, mesh_torque, applied));
  for (const DryEnd& end : dry_ends_) {
    const int node = node_[end.slot];
    double& acceleration = rate[dof_ + node];
    if (end.mode.stuck())
      acceleration = rate[node] = 0;
    else
      acceleration += end.mode.torque(limits(end, rubbing), state[node], state[dof_ + node]) / inertia_[node];
  }
}

GearTrain::EndForces GearTrain::end_forces(double t, const double* state, AppliedTorque applied) const {
  const Balance b = balance(t, state, applied);
  const double load = node_[kLink] == kFixed ? 0 : b.net[node_[kLink]];
  return {b.net[node_[kMotor]], load, b.mesh_torque, b.friction};
}

inline GearTrain::Slots GearTrain::ends(const Motion& m) {
  return {{m.motor_position, m.motor_position, m.load_position, m.load_position},
          {m.motor_velocity, m.motor_velocity, m.load_velocity, m.load_velocity}};
}

/// With the torques of the mesh on pinion and gear.
inline GearTrain::LoadForces GearTrain::with_load_terms(const Motion& motion, double mesh_torque,
                                                        const double* torque) const {
  const double v = motion.load_velocity;
  const double net = torque[kGear] - (damping_[kGear] + damping_[kLink]) * v -
                     (asymmetry_[kGear] + asymmetry_[kLink]) * std::fabs(v);
  if (load_terms_.empty()) return {net, mesh_torque, torque[kPinion], coulomb_.load};
  Motion with_mesh = motion;
  with_mesh.mesh_torque = mesh_torque;
  EndTorques ends;
  EndFriction rubs{{}, coulomb_.load};
  for (const Term* term : load_terms_) {
    term->add(with_mesh, ends);
    term->add_friction(with_mesh, rubs);
  }
  rubs.load.forward = std::max(0.0, rubs.load.forward);
  rubs.load.backward = std::max(0.0, rubs.load.backward);
  return {net + ends.load, mesh_torque, torque[kPinion], rubs.load};
}

GearTrain::LoadForces GearTrain::load_forces(const Motion& motion) const {
  const Slots s = ends(motion);
  double torque[kSlots] = {};
  if (shaped_) {
    const double mesh_torque = shaped_torques(s, torque);
    return with_load_terms(motion, mesh_torque, torque);
  }
  torque[kGear] = lever_ * contact_force(s);
  torque[kPinion] = -torque[kGear];
  return with_load_terms(motion, torque[kGear], torque);
}

GearTrain::Flanks GearTrain::flanks(double motor_position, double load_position) const {
  Motion motion{};
  motion.motor_position = motor_position;
  motion.load_position = load_position;
  const Slots s = ends(motion);
  return {shift_within_reach(s, kForward), shift_within_reach(s, kReverse)};
}

/// Nobody asks where a flank is that cannot touch here.
FlankShift GearTrain::shift_within_reach(const Slots& s, int side) const {
  const double half = half_gap_ / lever_;
  double nearest = half;
  for (const Term* term : flank_terms_) nearest += term->least_opening(half);
  const double away = nearest - side * relative(s) / lever_;
  if (away > kWithinReach * half) return {std::numeric_limits<double>::infinity(), 0, 0};
  return shift(s, side, 0);
}

GearTrain::LoadForces GearTrain::load_forces(const Motion& motion, const Flanks& flanks) const {
  const Slots s = ends(motion);
  double torque[kSlots] = {}, mesh_torque = 0;
  for (const int side : {1, -1}) {
    const FlankShift& at = flanks[side > 0 ? 0 : 1];
    const double t = lever_ * shifted_force(s, side, at, 0);
    if (t == 0) continue;
    press(side, at, t, torque);
    mesh_torque += side * t;
  }
  return with_load_terms(motion, mesh_torque, torque);
}

GearTrain::MotorForces GearTrain::motor_forces(const Motion& motion) const {
  const double w = motion.motor_velocity;
  double damping = damping_[kMotor] + damping_[kPinion], asymmetry = asymmetry_[kMotor] + asymmetry_[kPinion];
  EndTorques ends;
  for (const auto& term : terms_) term->add(motion, ends);
  double net = ends.motor;
  if (one_body()) {
    damping += damping_[kGear] + damping_[kLink];
    asymmetry += asymmetry_[kGear] + asymmetry_[kLink];
    net += ends.load;
  }
  return {net - damping * w - asymmetry * std::fabs(w), friction(motion).motor};
}

Observation GearTrain::observe(const double* state, AppliedTorque applied, double t) const {
  const Slots s = unpack(state);
  const double none = std::nan("");
  Observation o;
  o.motor_torque = applied.motor;
  o.motor_position = s.q[kMotor] * ratio_;
  o.motor_velocity = s.w[kMotor] * ratio_;
  const double twist = s.q[kMotor] - s.q[kPinion], twist_rate = s.w[kMotor] - s.w[kPinion];
  o.sensor_torque = input_.rigid ? none : (spring(input_, twist) + sensed_damping_ * twist_rate) / ratio_;
  o.sensor_twist = input_.rigid ? none : twist * ratio_;
  o.sensor_twist_rate = input_.rigid ? none : twist_rate * ratio_;
  o.load_position = load_gain_ * s.q[kLink];
  o.load_velocity = load_gain_ * s.w[kLink];
  o.load_torque = output_.rigid ? none : spring(output_, s.q[kGear] - s.q[kLink]);
  o.motor_current = applied.motor / torque_constant_;
  double rate[kMaxStates];
  derivative(t, state, applied, rate);
  const bool gear_moves = node_[kGear] != kFixed;
  o.acceleration = gear_moves ? rate[dof_ + node_[kGear]] : rate[dof_ + node_[kPinion]] * ratio_;
  return o;
}

double GearTrain::energy(const double* state) const {
  const Slots s = unpack(state);
  Slots resting = s;
  std::fill(resting.w, resting.w + kSlots, 0.0);
  double energy = 0;
  for (int node = 0; node < dof_; ++node)
    energy += 0.5 * inertia_[node] * state[dof_ + node] * state[dof_ + node];
  if (!input_.rigid) energy += 0.5 * input_.stiffness * std::pow(s.q[kMotor] - s.q[kPinion], 2);
  if (!output_.rigid) energy += 0.5 * output_.stiffness * std::pow(s.q[kGear] - s.q[kLink], 2);
  if (!contact_) return energy;
  for (const int side : {1, -1}) {
    FlankShift at;
    if (shaped_) shaped_force(resting, side, at);
    const double penetration = side * relative(s) - half_gap_ - lever_ * at.opening;
    if (penetration > 0)
      energy += contact_->elastic_energy(penetration) *
                (variation_ ? variation_->factor(lever_ * s.q[kPinion], side) : 1);
  }
  return energy;
}

double GearTrain::damping_power(const double* state) const {
  const Slots s = unpack(state);
  double power = 0;
  for (int slot = 0; slot < kSlots; ++slot)
    power += (damping_[slot] * s.w[slot] + asymmetry_[slot] * std::fabs(s.w[slot])) * s.w[slot];
  if (!input_.rigid) power += input_.damping * std::pow(s.w[kMotor] - s.w[kPinion], 2);
  if (!output_.rigid) power += output_.damping * std::pow(s.w[kGear] - s.w[kLink], 2);
  return power;
}

double GearTrain::elastic_deflection(double motor_torque) const {
  const double torque = std::fabs(motor_torque) * ratio_;
  double angle = contact_ ? contact_->static_penetration(torque / lever_) / lever_ : 0;
  if (!input_.rigid) angle += torque / input_.stiffness;
  if (!output_.rigid) angle += torque / output_.stiffness;
  return std::copysign(angle * ratio_, motor_torque);
}

}  // namespace backlash
