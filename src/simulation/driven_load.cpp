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
#include "lanes.h"
// Beyond the lanes.
#include "driven_step.h"
#include "take_lane.h"

namespace backlash::simulation {
namespace {

constexpr double kFarthest = 1e3;  // rad/s, beyond which the load has run away

BACKLASH_LANES Segment segment_after(const RecordedMotion& motion, std::size_t k) {
  const auto &q = *motion.motor, &w = *motion.motor_rate;
  const std::size_t j = std::min(k + 1, q.size() - 1);
  return {{q[k], q[j], motion.interval * w[k], motion.interval * w[j]},
          motion.load_rate ? between(*motion.load_rate, k) : Cubic{0, 0, 0, 0},
          double(k) * motion.interval,
          motion.interval};
}

DrivenLoad columns(std::size_t samples) {
  DrivenLoad out;
  for (auto* column : {&out.load, &out.load_rate, &out.mesh_torque, &out.mesh_on_motor})
    column->resize(samples);
  return out;
}

[[noreturn]] void run_away(double time) {
  throw IntegrationError("the load runs away at t = " + std::to_string(time) + " s");
}

class Load {
 public:
  Load(const model::Rig& rig, double feedback)
      : train_(rig),
        inertia_(train_.load_inertia()),
        feedback_(feedback),
        rubs_(train_.friction_event_count() > 0),
        shaped_(train_.flanks_shift_with_position()),
        plain_(train_.plain_load()) {
    if (!plain_) return;
    const model::PowerContact law = *train_.power_contact();
    forces_ = {train_.equations(),
               {law.exponent, law.stiffness, law.loss, law.damping, 0.5 * train_.backlash()},
               inertia_,
               inertia_ * feedback_};
    friction_ = train_.load_forces({}).friction;
  }

  double q = 0, w = 0;

  double begin(const Segment& s) {
    last_ = forces(s.at(0), q, w);
    mode_.begin(last_.net, w, last_.friction, q);
    return last_.mesh_torque;
  }

  /// One sample, in pieces that end where the load comes to rest or breaks away and where teeth touch or
  /// part. `sum` gathers the mesh torque on the motor; returns that through the teeth at the end.
  double step(const Segment& s, Halves<double>& sum) {
    double u = 0;
    Forces f = last_;
    for (int piece = 0; u < 1; ++piece) {
      const bool divide = piece < kMostPieces;
      u = mode_.stuck() ? hold(s, u, f, divide, sum) : slide(s, u, f, divide, sum);
    }
    last_ = f;
    return f.mesh_torque;
  }

  /// Whether it can move beside another: in sliding with the same friction all along.
  bool joins(const Load& other) const {
    return plain_ && !(friction_.presliding > 0) && forces_.teeth.exponent == other.forces_.teeth.exponent;
  }
  const PlainLoad<double>& plain_forces() const { return forces_; }
  bool stuck() const { return mode_.stuck(); }
  int stops_against() const { return rubs_ ? mode_.direction() : 0; }
  double friction() const { return mode_.torque(friction_); }
  PlainLoad<double>::Forces last() const { return {last_.net, last_.mesh_torque}; }
  /// Goes on from where it has slid to beside others.
  void slid_to(double position, double rate, const PlainLoad<double>::Forces& f) {
    q = position;
    w = rate;
    last_ = {{f.net, f.mesh_torque, -f.mesh_torque, friction_}, position, rate};
    flanks_.reset();
  }

 private:
  static constexpr int kMostPieces = 30;
  static constexpr int kHalvings = 10;  // of a sample, that place an event
  using Flanks = std::optional<model::GearTrain::Flanks>;
  struct Forces : model::GearTrain::LoadForces {  // net with what draws the load
    double position, rate;                        // rad, rad/s, of the load
    int side() const { return (mesh_torque > 0) - (mesh_torque < 0); }
  };
  struct Move {
    double q, w;
    int side;              // that touches halfway
    double mesh_on_motor;  // N m, halfway
    Forces end;
    Flanks flanks;  // at the end
  };

  bool holds(const Forces& f) const {
    if (f.friction.presliding > 0) return mode_.event(f.net, 0, f.friction) < 0;
    return f.net < f.friction.forward && -f.net < f.friction.backward;
  }

  /// `flanks`: where they are at nearly this position, if known.
  Forces forces(const Moment& m, double position, double rate, const Flanks& flanks = {}) const {
    if (plain_) {
      const PlainLoad<double>::Forces f = forces_.forces(m, position, rate);
      return {{f.net, f.mesh_torque, -f.mesh_torque, friction_}, position, rate};
    }
    const model::Motion motion{m.time, m.motor, m.motor_rate, position, rate, 0};
    Forces f{flanks ? train_.load_forces(motion, *flanks) : train_.load_forces(motion), position, rate};
    f.net += inertia_ * feedback_ * (m.load_rate - rate);
    return f;
  }

  double acceleration(const Forces& f) const {
    return (f.net + mode_.torque(f.friction, f.position, f.rate)) / inertia_;
  }

  /// From u to v. Flanks are looked up twice only, halfway and at the end, where the load will be to within
  /// h^3: their shape hardly changes over less.
  Move moved(const Segment& s, double u, double v, const Forces& f) const {
    const double h = (v - u) * s.interval;
    const Moment middle = s.at(0.5 * (u + v)), end = s.at(v);
    Flanks halfway, beyond;
    Forces stages[2];
    const auto at_stage = [&](int stage, double position, double rate) {
      if (shaped_ && stage == 0) {
        halfway = train_.flanks(middle.motor, q + 0.25 * h * (w + rate));
        beyond = train_.flanks(end.motor, q + h * rate);
      }
      if (stage == 2) return acceleration(forces(end, position, rate, beyond));
      stages[stage] = forces(middle, position, rate, halfway);
      return acceleration(stages[stage]);
    };
    double to_q = q, to_w = w;
    runge_kutta(h, acceleration(f), at_stage, to_q, to_w);
    // Halfway the first estimate of the position lags by h^2 a / 8, the second leads by as much.
    return {to_q,
            to_w,
            stages[1].side(),
            0.5 * (stages[0].mesh_on_motor + stages[1].mesh_on_motor),
            forces(end, to_q, to_w, beyond),
            beyond};
  }

  /// The first change between u and v, known to lie there: last moment before and first after it.
  template <typename Changed>
  static std::pair<double, double> bracket(double u, double v, const Changed& changed) {
    double before = u, after = v;
    for (int i = 0; i < kHalvings; ++i)
      (changed(0.5 * (before + after)) ? after : before) = 0.5 * (before + after);
    return {before, after};
  }

  double slide(const Segment& s, double u, Forces& f, bool divide, Halves<double>& sum) {
    const auto changes = [&](const Move& to) {
      return to.end.side() != f.side() || (rubs_ && mode_.direction() * to.w < 0);
    };
    double v = 1;
    Move to = moved(s, u, v, f);
    if (divide && to.side != f.side() && !changes(to)) {  // touched and left within
      v = 0.5 * (u + v);
      to = moved(s, u, v, f);
    }
    if (!divide || !changes(to)) {
      sum.add(u, v, f.mesh_on_motor, to.mesh_on_motor, to.end.mesh_on_motor);
      q = to.q;
      w = to.w;
      f = to.end;
      flanks_ = to.flanks;
      return v;
    }
    const auto [before, after] = bracket(u, v, [&](double at) { return changes(moved(s, u, at, f)); });
    to = moved(s, u, before, f);
    sum.add(u, before, f.mesh_on_motor, to.mesh_on_motor, to.end.mesh_on_motor);
    const double h = (after - before) * s.interval;
    q = to.q + h * to.w;
    w = to.w + h * acceleration(to.end);
    cross(s, before, after, to.end, f, sum);
    return after;
  }

  double hold(const Segment& s, double u, Forces& f, bool divide, Halves<double>& sum) {
    const auto at = [&](double v) { return forces(s.at(v), q, 0); };
    const auto changes = [&](const Forces& end) { return end.side() != f.side() || !holds(end); };
    double before = 1, after = 1;
    if (divide && changes(at(1)))
      std::tie(before, after) = bracket(u, 1, [&](double v) { return changes(at(v)); });
    const Forces end = at(before);
    sum.add(u, before, f.mesh_on_motor, at(0.5 * (u + before)).mesh_on_motor, end.mesh_on_motor);
    if (before == after) {
      f = end;
      flanks_.reset();
    } else {
      cross(s, before, after, end, f, sum);
    }
    return after;
  }

  /// The moment of the change itself.
  void cross(const Segment& s, double before, double after, const Forces& from, Forces& f,
             Halves<double>& sum) {
    flanks_.reset();
    const bool sticks = !(from.friction.presliding > 0);
    if (sticks && mode_.direction() * w <= 0) w = 0;
    f = forces(s.at(after), q, w);
    mode_.update(f.net, w, f.friction, q);
    const double mean = 0.5 * (from.mesh_on_motor + f.mesh_on_motor);
    sum.add(before, after, mean, mean, mean);
  }

  model::GearTrain train_;
  double inertia_, feedback_;
  bool rubs_, shaped_, plain_;
  PlainLoad<double> forces_{};      // of a plain load
  model::FrictionLimits friction_;  // of a plain load
  model::StickSlip mode_;
  Forces last_{};  // at the end of the sample before
  Flanks flanks_;  // there, if known
};

/// A load that stands.
class LockedLoad {
 public:
  explicit LockedLoad(const model::Rig& rig) : train_(rig) {}

  double q = 0, w = 0;

  double begin(const Segment& s) { return forces(s.at(0)).mesh_torque; }

  double step(const Segment& s, Halves<double>& sum) {
    const model::GearTrain::LoadForces end = forces(s.at(1));
    sum.add(0, 1, forces(s.at(0)).mesh_on_motor, forces(s.at(0.5)).mesh_on_motor, end.mesh_on_motor);
    return end.mesh_torque;
  }

 private:
  model::GearTrain::LoadForces forces(const Moment& m) const {
    return train_.load_forces({m.time, m.motor, m.motor_rate, 0, 0, 0});
  }

  model::GearTrain train_;
};

void check(const model::Rig& rig) {
  if (!rig.input_coupling.rigid || !rig.output_coupling.rigid)
    throw InvalidParameter("coupling", "flexible",
                           "a load that follows the recorded motor needs rigid couplings");
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
    out.load[k] = load.q;
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

/// Plain loads side by side, number by number as each alone: samples in which a load just slides are done for
/// all at once, others by itself. Lanes without a load do what the last load does.
template <typename Real>
class alignas(sizeof(Real)) LoadsTogether {
 public:
  explicit LoadsTogether(std::vector<Load>& loads) : loads_(loads) {
    for (int i = 0; i < kCount; ++i) {
      const PlainLoad<double>& one = load_of(i).plain_forces();
      take_lane(plain_.train, i, one.train);
      take_lane(plain_.teeth, i, one.teeth);
      set_lane(plain_.inertia, i, one.inertia);
      set_lane(plain_.drawn, i, one.drawn);
    }
  }

  void begin(const Segment& s) {
    for (Load& load : loads_) load.begin(s);
    for (int i = 0; i < kCount; ++i) take_state(i);
  }

  BACKLASH_LANES Halves<Real> step(const Segment& s) {
    Halves<Real> sum;
    const Real slid = slide(s, sum);
    for (int i = 0; i < kCount; ++i) {
      if (lane(slid, i) > 0) continue;
      if (i < int(loads_.size())) step_alone(i, s, sum);
      take_state(i);
    }
    return sum;
  }

  Real q = {}, w = {}, mesh_torque = {};  // of each, now

 private:
  static constexpr int kCount = kLanesOf<Real>;

  Load& load_of(int i) { return loads_[std::min(std::size_t(i), loads_.size() - 1)]; }

  void take_state(int i) {
    const Load& load = load_of(i);
    set_lane(q, i, load.q);
    set_lane(w, i, load.w);
    set_lane(net_, i, load.last().net);
    set_lane(mesh_torque, i, load.last().mesh_torque);
    set_lane(friction_, i, load.friction());
    set_lane(stops_against_, i, load.stops_against());
    set_lane(slides_, i, load.stuck() ? 0 : 1);
  }

  void step_alone(int i, const Segment& s, Halves<Real>& sum) {
    Load& load = load_of(i);
    load.slid_to(lane(q, i), lane(w, i), {lane(net_, i), lane(mesh_torque, i)});
    Halves<double> own;
    load.step(s, own);
    set_lane(sum.early, i, own.early);
    set_lane(sum.late, i, own.late);
  }

  static BACKLASH_LANES Real side(const Real& torque) {
    const Real none = {};
    return torque > none ? none + 1 : torque < none ? none - 1 : none;
  }

  /// Load::slide() over the whole sample. 1 for those that have moved, 0 where something happens within it.
  BACKLASH_LANES Real slide(const Segment& s, Halves<Real>& sum) {
    const Moment middle = s.at(0.5), end = s.at(1);
    typename PlainLoad<Real>::Forces stages[2];
    const auto acceleration = [&](const auto& f) __attribute__((always_inline)) {
      return (f.net + friction_) / plain_.inertia;
    };
    const auto at_stage = [&](int stage, const Real& position, const Real& rate)
        __attribute__((always_inline)) {
      const auto f = plain_.forces(stage == 2 ? end : middle, position, rate);
      if (stage < 2) stages[stage] = f;
      return acceleration(f);
    };
    Real to_q = q, to_w = w;
    const Real first = (net_ + friction_) / plain_.inertia;
    runge_kutta(s.interval, first, at_stage, to_q, to_w);
    const auto last = plain_.forces(end, to_q, to_w);
    const Real none = {}, before = side(mesh_torque);
    Real slid = stops_against_ * to_w < none ? none : slides_;
    slid = side(stages[1].mesh_torque) == before ? slid : none;
    slid = side(last.mesh_torque) == before ? slid : none;
    const Real halfway = -0.5 * (stages[0].mesh_torque + stages[1].mesh_torque);
    sum.add(0, 1, -mesh_torque, halfway, -last.mesh_torque);
    q = slid > none ? to_q : q;
    w = slid > none ? to_w : w;
    net_ = slid > none ? last.net : net_;
    mesh_torque = slid > none ? last.mesh_torque : mesh_torque;
    return slid;
  }

  std::vector<Load>& loads_;
  PlainLoad<Real> plain_ = {};
  Real net_ = {}, friction_ = {};          // N m, now; while it slides
  Real stops_against_ = {}, slides_ = {};  // sign of a speed that ends the sliding, 0: none; 0 or 1
};

template <typename Real>
BACKLASH_LANES bool any_far(const Real& rate) {
  bool far = false;
  for (int i = 0; i < kLanesOf<Real>; ++i) far |= !(std::fabs(lane(rate, i)) < kFarthest);
  return far;
}

/// Hardly a call within the loop: code that is not compiled for the same processor costs as much as the rest.
template <typename Real>
BACKLASH_LANES void follow_together(std::vector<Load>& loads, const RecordedMotion& motion,
                                    std::vector<DrivenLoad>& out) {
  const std::size_t n = motion.motor->size();
  LoadsTogether<Real> together(loads);
  Halves<Real> before;
  for (std::size_t k = 0; k < n; ++k) {
    const Segment segment = segment_after(motion, k);
    if (k == 0) together.begin(segment);
    if (any_far(together.w)) run_away(segment.start);
    const Real q = together.q, w = together.w, mesh_torque = together.mesh_torque;
    const Halves<Real> now = k + 1 < n ? together.step(segment) : Halves<Real>();
    const Real mean = k == 0 ? 2 * now.early : k + 1 == n ? 2 * before.late : before.late + now.early;
    for (int i = 0; i < int(loads.size()); ++i) {
      DrivenLoad& one = out[std::size_t(i)];
      one.load[k] = lane(q, i);
      one.load_rate[k] = lane(w, i);
      one.mesh_torque[k] = lane(mesh_torque, i);
      one.mesh_on_motor[k] = lane(mean, i);
    }
    before = now;
  }
}

// What is compiled for each processor.
#if defined(__x86_64__)
__attribute__((target("avx512f"))) void follow_avx512(std::vector<Load>& loads, const RecordedMotion& motion,
                                                      std::vector<DrivenLoad>& out) {
  follow_together<Lanes8>(loads, motion, out);
}

__attribute__((target("avx2"))) void follow_avx2(std::vector<Load>& loads, const RecordedMotion& motion,
                                                 std::vector<DrivenLoad>& out) {
  follow_together<Lanes4>(loads, motion, out);
}
#endif

void follow_all(std::vector<Load>& loads, const RecordedMotion& motion, std::vector<DrivenLoad>& out) {
#if defined(__x86_64__)
  if (loads_at_once() == 8) return follow_avx512(loads, motion, out);
  if (loads_at_once() == 4) return follow_avx2(loads, motion, out);
#endif
  follow_together<Lanes2>(loads, motion, out);
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

bool moves_same_load(const model::Rig& a, const model::Rig& b) {
  return acting_on_load(a) == acting_on_load(b);
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
  Load load(rig, motion.load_rate ? feedback : 0);
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
  std::vector<Load> loads;
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
      model::Motion m{double(k) * motion.interval, (*motion.motor)[k], (*motion.motor_rate)[k], load.load[k],
                      load.load_rate[k],           load.mesh_torque[k]};
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
