// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/gear_train.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"

namespace backlash::model {
namespace {

constexpr int kMostSteps = 60;        // theory: 2^-60 where friction grows by half of the torque
constexpr double kSettled = 1e-12;    // theory: relative, above roundings
constexpr double kWithinReach = 0.1;  // share of the half gap; a flank that moves by less cannot touch
constexpr TrainLayout kFollowingLoad = TrainLayout::following_load();

TrainLayout layout_of(const Rig& rig) {
  return {!rig.input_coupling.rigid, !rig.mesh.rigid, !rig.output_coupling.rigid, !rig.link_locked};
}

/// All but the inertia.
EquationsOfMotion<double> equations_of(const Rig& rig) {
  const double square = rig.motor_axis_ratio() * rig.motor_axis_ratio();
  EquationsOfMotion<double> e{};
  const Body* parts[] = {&rig.motor, &rig.pinion, &rig.gear, &rig.link};
  for (int part = 0; part < TrainParts::kPartCount; ++part) {
    const double to_load = part <= TrainParts::kPinion ? square : 1;
    e.damping[part] = parts[part]->viscous_damping * to_load;
    e.asymmetry[part] = parts[part]->viscous_asymmetry * to_load;
  }
  e.input_stiffness = rig.input_coupling.stiffness * square;
  e.input_damping = rig.input_coupling.damping * square;
  e.output_stiffness = rig.output_coupling.stiffness;
  e.output_damping = rig.output_coupling.damping;
  e.lever = rig.mesh.lever();
  e.start = rig.mesh.start_in_gap;
  return e;
}

FrictionLimits directional(const Body& body, double factor) {
  return {(body.coulomb_friction + body.coulomb_asymmetry) * factor,
          (body.coulomb_friction - body.coulomb_asymmetry) * factor};
}

void keep_from_driving(FrictionLimits& limits) {
  limits.forward = std::max(0.0, limits.forward);
  limits.backward = std::max(0.0, limits.backward);
}

}  // namespace

GearTrain::GearTrain(const Rig& rig)
    : ratio_(rig.motor_axis_ratio()),
      layout_(layout_of(rig)),
      equations_(equations_of(rig)),
      sensed_damping_(rig.sensor_with_damper ? equations_.input_damping : 0),
      lever_(equations_.lever),
      coulomb_{directional(rig.motor, ratio_), directional(rig.link, 1)},
      load_end_(rig.bearing_at_gear ? kGear : kLink),
      torque_constant_(rig.torque_constant),
      contact_(rig.mesh.contact),
      variation_(rig.mesh.variation),
      pairs_(rig.mesh.rigid ? nullptr : rig.mesh.pairs),
      protrusion_(pairs_ ? pairs_->most_protrusion() : 0),
      terms_(rig.terms),
      load_gain_(sensing(rig.terms).load_position_gain) {
  if (rig.mesh.rigid)
    contact_ = nullptr;
  else if (!contact_)
    throw InvalidParameter("mesh.contact", "none", "the mesh needs a contact law");
  if (pairs_ && contact_->needs_impact_speed())
    throw InvalidParameter("tooth_pairs", contact_->made_of.law,
                           "needs the speed of one touch, pairs have several");
  set_backlash(rig.mesh.backlash);
  sum_inertia(rig);
  check_what_follows_torque();
  bool dry = false;
  EndFriction at_rest;
  for (const auto& term : terms_) {
    loaded_ |= term->loads_flanks();
    shaped_ |= term->shapes_flanks() || term->loads_flanks();
    shape_follows_torque_ |= term->shape_follows_torque();
    dry |= term->has_dry_friction();
    friction_of_load_ |= one_body() && term->follows_mesh_torque();
    share_of_load_ *= 1 - term->rotor_share();
    term->add_friction({}, at_rest);
    const bool acts_on_flanks = term->shapes_flanks() || term->loads_flanks();
    if (term->shapes_flanks()) flank_terms_.push_back(term.get());
    if (term->moves_load() && !acts_on_flanks) load_terms_.push_back(term.get());
  }
  presliding_ = at_rest.motor.presliding > 0 || at_rest.load.presliding > 0;
  const auto rubs = [](const FrictionLimits& f) { return f.forward > 0 || f.backward > 0; };
  const bool load_rubs = (dry || rubs(coulomb_.load)) && moves(kLink);
  if (dry || rubs(coulomb_.motor) || (load_rubs && one_body())) dry_ends_.push_back({kMotor, {}});
  if (load_rubs && !one_body()) dry_ends_.push_back({load_end_, {}});
  smooth_ = contact_ && !contact_->needs_impact_speed() && !variation_ && !pairs_ && terms_.empty() &&
            dry_ends_.empty();
}

void GearTrain::check_what_follows_torque() const {
  if (contact_) return;
  for (const auto& term : terms_)
    if (term->follows_mesh_torque() && !(one_body() && term->has_dry_friction()))
      throw InvalidParameter("terms", term->id,
                             "follows the torque through the teeth, which a rigid mesh lacks");
}

double GearTrain::load_inertia() const {
  return moves(kLink) ? inertia_[layout_.node[kLink]] : std::numeric_limits<double>::infinity();
}

/// Sums what moves with each degree of freedom.
void GearTrain::sum_inertia(const Rig& rig) {
  const double square = ratio_ * ratio_, input = square * rig.input_coupling.inertia;
  const double of_part[kPartCount] = {rig.motor.inertia * square + 0.5 * input,
                                      rig.pinion.inertia * square + 0.5 * input,
                                      rig.gear.inertia + 0.5 * rig.output_coupling.inertia,
                                      rig.link.inertia + 0.5 * rig.output_coupling.inertia};
  for (int part = 0; part < kPartCount; ++part)
    if (moves(part)) inertia_[layout_.node[part]] += of_part[part];
  const double of_load = of_part[kGear] + of_part[kLink];
  if (one_body() && of_load > 0) share_of_load_ = of_load / inertia_[layout_.node[kMotor]];
  for (int node = 0; node < layout_.dof; ++node) {
    if (!(inertia_[node] > 0))
      throw InvalidParameter("inertia", inertia_[node], "every moving part needs inertia");
    equations_.inverse_inertia[node] = 1 / inertia_[node];
  }
}

void GearTrain::set_backlash(double backlash) {
  if (!(backlash >= 0) || !std::isfinite(backlash))
    throw InvalidParameter("backlash", backlash, "must be >= 0 and finite");
  half_gap_ = acting_gap_ = 0.5 * backlash;
}

/// Of the teeth [N] at a position in the gap [m] that changes at this rate [m/s].
inline double GearTrain::force_at(double x, double rate) const {
  const double penetration = std::fabs(x) - acting_gap_;
  if (penetration <= 0) return 0;
  const double side = x > 0 ? 1 : -1;
  return side * contact_->force(penetration, side * rate, impact_speed_);
}

inline double GearTrain::contact_force(const PartMotion& s) const {
  if (!contact_) return 0;
  const double x = gap_position(s), force = force_at(x, equations_.gap_rate(s));
  if (!variation_ || force == 0) return force;
  return force * variation_->factor(lever_ * s.q[kPinion], x > 0 ? 1 : -1);
}

FlankPoint GearTrain::flank_point(const PartMotion& s, int side, double mesh_torque) const {
  return {s.q[kPinion], s.q[kGear], half_gap_ / lever_, mesh_torque, side};
}

FlankShift GearTrain::shift(const PartMotion& s, int side, double mesh_torque) const {
  FlankShift sum;
  if (!shaped_) return sum;
  const FlankPoint point = flank_point(s, side, mesh_torque);
  for (const Term* term : flank_terms_) term->shape(point, sum);
  return sum;
}

ToothPairs::Place GearTrain::place_of(const PartMotion& s, int side, double penetration, double rate) const {
  return {lever_ * s.q[kPinion], lever_ * s.w[kPinion], penetration, rate, side};
}

/// Of a flank that is closed by `penetration` [m], moving at `rate` [m/s].
double GearTrain::flank_force(const PartMotion& s, int side, double penetration, double rate,
                              double mesh_torque) const {
  double force = pairs_ ? pairs_->push(place_of(s, side, penetration, rate), *contact_).force
                        : contact_->force(penetration, rate, impact_speed_);
  if (variation_) force *= variation_->factor(lever_ * s.q[kPinion], side);
  if (!loaded_) return force;
  double torque = lever_ * force;
  const FlankLoad load{flank_point(s, side, mesh_torque), std::max(0.0, penetration) / lever_, rate / lever_};
  for (const auto& term : terms_) term->load_flank(load, torque);
  return std::max(0.0, torque) / lever_;
}

/// Force >= 0 on the flank of this side [N], shifted as given.
inline double GearTrain::shifted_force(const PartMotion& s, int side, const FlankShift& at,
                                       double mesh_torque) const {
  const double penetration = side * gap_position(s) - acting_gap_ - lever_ * at.opening;
  if (!(penetration > -protrusion_)) return 0;
  const double rate =
      side * equations_.gap_rate(s) - lever_ * (at.motor_slope * s.w[kPinion] + at.load_slope * s.w[kGear]);
  return flank_force(s, side, penetration, rate, mesh_torque);
}

/// Force >= 0 on the flank of this side [N], with its shift in `at`. Where the shape follows the torque both
/// are found together by the Illinois method, between no torque and one that is too large for the flank.
/// Infinite where the flank advances faster with the torque than the teeth give way.
double GearTrain::shaped_force(const PartMotion& s, int side, FlankShift& at) const {
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

/// The same with what pairs of teeth spare the pinion.
inline void GearTrain::press(const PartMotion& s, int side, const FlankShift& at, double flank_torque,
                             double* torque) const {
  press(side, at, flank_torque, torque);
  if (!pairs_) return;
  const double penetration = side * gap_position(s) - acting_gap_ - lever_ * at.opening;
  if (!(penetration > -protrusion_)) return;
  const double rate =
      side * equations_.gap_rate(s) - lever_ * (at.motor_slope * s.w[kPinion] + at.load_slope * s.w[kGear]);
  torque[kPinion] += lever_ * pairs_->push(place_of(s, side, penetration, rate), *contact_).spared;
}

/// Adds what both flanks do to pinion and gear and returns the mesh torque. A gap that a term closes
/// altogether presses both flanks.
double GearTrain::add_shaped_teeth(const PartMotion& s, double* torque) const {
  double mesh_torque = 0;
  for (const int side : {1, -1}) {
    FlankShift at;
    const double t = lever_ * shaped_force(s, side, at);
    press(s, side, at, t, torque);
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
  keep_from_driving(sum.motor);
  keep_from_driving(sum.load);
  if (braked_) sum.motor = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  return sum;
}

double GearTrain::torque_of_load(const Motion& motion, double acceleration) const {
  EndTorques ends;
  for (const auto& term : terms_) term->add(motion, ends);
  return share_of_load_ * inertia_[layout_.node[kMotor]] * acceleration - ends.load;
}

/// Under these torques without dry friction. Of one body, friction that follows what the load takes is found
/// with the acceleration that it leaves, for either direction; each step comes nearer by the factor by which
/// friction grows with that torque. What is left has the sign that it has at rest, which serves for sticking.
EndFriction GearTrain::friction_under(const Motion& motion, const double* net) const {
  if (!friction_of_load_) return friction(motion);
  const double all = net[layout_.node[kMotor]], inertia = inertia_[layout_.node[kMotor]];
  Motion loaded = motion;
  const auto settled = [&](int direction, double FrictionLimits::*limit) {
    double rubs = 0;
    for (int i = 0; i < kMostSteps; ++i) {
      loaded.mesh_torque = torque_of_load(motion, (all - direction * rubs) / inertia);
      const double before = rubs;
      rubs = friction(loaded).motor.*limit;
      if (std::fabs(rubs - before) <= kSettled * rubs) break;
    }
    return rubs;
  };
  EndFriction both = friction(motion);
  both.motor.forward = settled(1, &FrictionLimits::forward);
  both.motor.backward = settled(-1, &FrictionLimits::backward);
  return both;
}

/// Adds what the teeth do to pinion and gear and returns the mesh torque.
inline double GearTrain::add_teeth(const PartMotion& s, double* torque) const {
  if ((shaped_ || pairs_) && contact_) return add_shaped_teeth(s, torque);
  const double mesh_torque = lever_ * contact_force(s);
  equations_.add_mesh(mesh_torque, torque);
  return mesh_torque;
}

/// All torques but dry friction, per degree of freedom [N m]; returns that through the teeth.
inline double GearTrain::net_torques(double t, const PartMotion& s, AppliedTorque applied,
                                     double* net) const {
  double mesh_torque = 0;
  const auto teeth_and_terms = [&](double* torque) {
    mesh_torque = add_teeth(s, torque);
    if (terms_.empty()) return;
    const Motion motion = motion_of(t, s, mesh_torque);
    EndTorques ends;
    for (const auto& term : terms_) term->add(motion, ends);
    torque[kMotor] += ends.motor;
    torque[kLink] += ends.load;
  };
  equations_.net_torques(layout_, s, applied.motor * ratio_, applied.load, teeth_and_terms, net);
  return mesh_torque;
}

GearTrain::Balance GearTrain::balance(double t, const double* state, AppliedTorque applied) const {
  const PartMotion s = part_motion(state);
  Balance b;
  b.mesh_torque = net_torques(t, s, applied, b.net);
  if (!dry_ends_.empty()) b.friction = friction_under(motion_of(t, s, b.mesh_torque), b.net);
  return b;
}

void GearTrain::derivative(double t, const double* state, AppliedTorque applied, double* rate) const {
  if (smooth_) {
    const auto force = [this](double x, double v) { return force_at(x, v); };
    return with_constant_number(layout_, [&](auto number) {
      static constexpr TrainLayout layout = TrainLayout::numbered(number);
      equations_.derivative(layout, state, applied.motor * ratio_, applied.load, half_gap_, force, rate);
    });
  }
  const PartMotion s = part_motion(state);
  double net[kPartCount];
  const double mesh_torque = net_torques(t, s, applied, net);
  // Divided here, so that records stay the same to the last digit: motion in a gap is chaotic.
  for (int node = 0; node < layout_.dof; ++node) {
    rate[node] = state[layout_.dof + node];
    rate[layout_.dof + node] = net[node] / inertia_[node];
  }
  if (dry_ends_.empty()) return;
  const EndFriction rubbing = friction_under(motion_of(t, s, mesh_torque), net);
  for (const DryEnd& end : dry_ends_) {
    const int node = layout_.node[end.part], speed = layout_.dof + node;
    if (end.mode.stuck())
      rate[speed] = rate[node] = 0;
    else
      rate[speed] += end.mode.torque(limits(end, rubbing), state[node], state[speed]) / inertia_[node];
  }
}

GearTrain::EndForces GearTrain::end_forces(double t, const double* state, AppliedTorque applied) const {
  const Balance b = balance(t, state, applied);
  const int load = layout_.node[load_end_];
  return {b.net[layout_.node[kMotor]], moves(load_end_) ? b.net[load] : 0, b.mesh_torque, b.friction};
}

inline GearTrain::PartMotion GearTrain::ends(const Motion& m) {
  return {{m.motor_position, m.motor_position, m.load_position, m.load_position},
          {m.motor_velocity, m.motor_velocity, m.load_velocity, m.load_velocity}};
}

/// `add_teeth` adds what the teeth do to pinion and gear and returns the mesh torque.
template <typename AddTeeth>
inline GearTrain::LoadForces GearTrain::load_forces(const Motion& motion, const PartMotion& s,
                                                    const AddTeeth& add_teeth) const {
  LoadForces forces{0, 0, 0, coulomb_.load};
  const auto teeth_and_terms = [&](double* torque) {
    double of_teeth[kPartCount] = {};
    forces.mesh_torque = add_teeth(of_teeth);
    forces.mesh_on_motor = of_teeth[kPinion];
    torque[kGear] += of_teeth[kGear];
    if (load_terms_.empty()) return;
    Motion with_mesh = motion;
    with_mesh.mesh_torque = forces.mesh_torque;
    EndTorques ends;
    EndFriction rubs{{}, coulomb_.load};
    for (const Term* term : load_terms_) {
      term->add(with_mesh, ends);
      term->add_friction(with_mesh, rubs);
    }
    keep_from_driving(rubs.load);
    forces.friction = rubs.load;
    torque[kLink] += ends.load;
  };
  double net[kPartCount];
  equations_.net_torques(kFollowingLoad, s, 0, 0, teeth_and_terms, net);
  forces.net = net[kFollowingLoad.node[kLink]];
  return forces;
}

GearTrain::LoadForces GearTrain::load_forces(const Motion& motion) const {
  const PartMotion s = ends(motion);
  return load_forces(motion, s, [&](double* torque) { return add_teeth(s, torque); });
}

GearTrain::Flanks GearTrain::flanks(double motor_position, double load_position) const {
  Motion motion{};
  motion.motor_position = motor_position;
  motion.load_position = load_position;
  const PartMotion s = ends(motion);
  return {shift_within_reach(s, kForward), shift_within_reach(s, kReverse)};
}

/// Infinite for a flank that cannot touch here, which saves computing its shape.
FlankShift GearTrain::shift_within_reach(const PartMotion& s, int side) const {
  const double half = half_gap_ / lever_;
  double nearest = half - protrusion_ / lever_;
  for (const Term* term : flank_terms_) nearest += term->least_opening(half);
  const double away = nearest - side * gap_position(s) / lever_;
  if (away > kWithinReach * half) return {std::numeric_limits<double>::infinity(), 0, 0};
  return shift(s, side, 0);
}

GearTrain::LoadForces GearTrain::load_forces(const Motion& motion, const Flanks& flanks) const {
  const PartMotion s = ends(motion);
  const auto teeth = [&](double* torque) {
    double mesh_torque = 0;
    for (const int side : {1, -1}) {
      const FlankShift& at = flanks[side > 0 ? 0 : 1];
      const double t = lever_ * shifted_force(s, side, at, 0);
      if (t == 0) continue;
      press(s, side, at, t, torque);
      mesh_torque += side * t;
    }
    return mesh_torque;
  };
  return load_forces(motion, s, teeth);
}

GearTrain::MotorForces GearTrain::motor_forces(const Motion& motion) const {
  const auto terms = [&](double* torque) {
    EndTorques ends;
    for (const auto& term : terms_) term->add(motion, ends);
    torque[kMotor] += ends.motor;
    torque[kLink] += ends.load;
  };
  double net[kPartCount];
  equations_.net_torques(layout_, ends(motion), 0, 0, terms, net);
  return {net[layout_.node[kMotor]], friction(motion).motor};
}

}  // namespace backlash::model
