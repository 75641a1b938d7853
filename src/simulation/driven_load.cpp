// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/driven_load.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/stick_slip.h"
#include "power_teeth.h"

namespace backlash::simulation {
namespace {

constexpr double kFarthest = 1e3;  // rad/s, beyond which the load has run away

/// A sampled signal between two of its samples, u = 0 .. 1: cubic with the slopes [per sample] at its ends.
struct Cubic {
  double y0, y1, d0, d1;

  double operator()(double u) const {
    const double s = 1 - u;
    return s * s * ((1 + 2 * u) * y0 + u * d0) + u * u * ((3 - 2 * u) * y1 - s * d1);
  }
  /// Per sample.
  double slope(double u) const {
    const double s = 1 - u;
    return 6 * u * s * (y1 - y0) + s * (1 - 3 * u) * d0 - u * (2 - 3 * u) * d1;
  }
};

/// After sample k, with slopes from the samples beside it (Catmull and Rom): a straight line would lose 0.03
/// % of a speed at a hundredth of the sampling rate, which next to the feedback is no longer small.
Cubic between(const std::vector<double>& y, std::size_t k) {
  const std::size_t last = y.size() - 1, j = std::min(k + 1, last);
  const auto slope = [&](std::size_t i) {
    return i == 0 || i == last ? y[j] - y[k] : 0.5 * (y[i + 1] - y[i - 1]);
  };
  return {y[k], y[j], slope(k), slope(j)};
}

/// What is recorded at one moment.
struct Moment {
  double time;
  double motor, motor_rate, load_rate;
};

/// Motion within one sample. The motor's speed is the derivative of its position, so that a damper between
/// the teeth takes the energy that belongs to their motion: another line through the same speeds makes the
/// motor's inertia 0.15 % and the damping 0.1 % too small.
struct Segment {
  Cubic motor, load_rate;
  double start, interval;

  Moment at(double u) const {
    const double t = start + u * interval;
    if (u == 0) return {t, motor.y0, motor.d0 / interval, load_rate.y0};
    if (u == 1) return {t, motor.y1, motor.d1 / interval, load_rate.y1};
    return {t, motor(u), motor.slope(u) / interval, load_rate(u)};
  }
};

/// Integrals over one sample with the weights 1 - u and u.
struct Halves {
  double early = 0, late = 0;

  /// Adds a piece from u0 to u1 by Simpson's rule.
  void add(double u0, double u1, double f0, double middle, double f1) {
    const double d = (u1 - u0) / 6, um = 0.5 * (u0 + u1);
    early += d * ((1 - u0) * f0 + 4 * (1 - um) * middle + (1 - u1) * f1);
    late += d * (u0 * f0 + 4 * um * middle + u1 * f1);
  }
};

constexpr model::TrainLayout kFollowing = model::TrainLayout::following_load();
constexpr int kParts = model::TrainParts::kPartCount;
using PartMotion = model::EquationsOfMotion<double>::PartMotion;

PartMotion ends(const model::Motion& m) {
  return {{m.motor_position, m.motor_position, m.load_position, m.load_position},
          {m.motor_velocity, m.motor_velocity, m.load_velocity, m.load_velocity}};
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
    teeth_ = {law.exponent, law.stiffness, law.loss, law.damping, 0.5 * train_.backlash()};
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
  double step(const Segment& s, Halves& sum) {
    double u = 0;
    Forces f = last_;
    for (int piece = 0; u < 1; ++piece) {
      const bool divide = piece < kMostPieces;
      u = mode_.stuck() ? hold(s, u, f, divide, sum) : slide(s, u, f, divide, sum);
    }
    last_ = f;
    return f.mesh_torque;
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
    const model::Motion motion{m.time, m.motor, m.motor_rate, position, rate, 0};
    Forces f{plain_   ? plain_forces(motion)
             : flanks ? train_.load_forces(motion, *flanks)
                      : train_.load_forces(motion),
             position, rate};
    f.net += inertia_ * feedback_ * (m.load_rate - rate);
    return f;
  }

  /// GearTrain::load_forces() of a plain load, without a call: a sample takes four of them.
  model::GearTrain::LoadForces plain_forces(const model::Motion& m) const {
    const model::EquationsOfMotion<double>& train = train_.equations();
    const PartMotion s = ends(m);
    const double mesh_torque =
        train.lever * teeth_.force(train.gap_position(s, teeth_.half_gap), train.gap_rate(s));
    double net[kParts];
    train.net_torques(
        kFollowing, s, 0, 0, [&](double* torque) { train.add_mesh(mesh_torque, torque); }, net);
    return {net[kFollowing.node[model::TrainParts::kLink]], mesh_torque, -mesh_torque, friction_};
  }

  double acceleration(const Forces& f) const {
    return (f.net + mode_.torque(f.friction, f.position, f.rate)) / inertia_;
  }

  /// Classical Runge-Kutta from u to v. Flanks are looked up twice only, halfway and at the end, where the
  /// load will be to within h^3: their shape hardly changes over less.
  Move moved(const Segment& s, double u, double v, const Forces& f) const {
    const double h = (v - u) * s.interval;
    const Moment middle = s.at(0.5 * (u + v)), end = s.at(v);
    const double a1 = acceleration(f), w2 = w + 0.5 * h * a1;
    Flanks halfway, beyond;
    if (shaped_) {
      halfway = train_.flanks(middle.motor, q + 0.25 * h * (w + w2));
      beyond = train_.flanks(end.motor, q + h * w2);
    }
    const Forces early = forces(middle, q + 0.5 * h * w, w2, halfway);
    const double a2 = acceleration(early), w3 = w + 0.5 * h * a2;
    const Forces late = forces(middle, q + 0.5 * h * w2, w3, halfway);
    const double a3 = acceleration(late), w4 = w + h * a3;
    const double a4 = acceleration(forces(end, q + h * w3, w4, beyond));
    const double to_q = q + h / 6 * (w + 2 * w2 + 2 * w3 + w4),
                 to_w = w + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    // Halfway the first estimate of the position lags by h^2 a / 8, the second leads by as much.
    return {to_q,
            to_w,
            late.side(),
            0.5 * (early.mesh_on_motor + late.mesh_on_motor),
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

  double slide(const Segment& s, double u, Forces& f, bool divide, Halves& sum) {
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

  double hold(const Segment& s, double u, Forces& f, bool divide, Halves& sum) {
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
  void cross(const Segment& s, double before, double after, const Forces& from, Forces& f, Halves& sum) {
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
  PowerTeeth<double> teeth_{};      // of a plain load
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

  double step(const Segment& s, Halves& sum) {
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
  DrivenLoad out;
  for (auto* column : {&out.load, &out.load_rate, &out.mesh_torque, &out.mesh_on_motor}) column->resize(n);
  const auto& q = *motion.motor;
  const auto& w = *motion.motor_rate;
  double mesh_torque = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t j = std::min(k + 1, n - 1);
    const Segment segment{{q[k], q[j], motion.interval * w[k], motion.interval * w[j]},
                          motion.load_rate ? between(*motion.load_rate, k) : Cubic{0, 0, 0, 0},
                          double(k) * motion.interval,
                          motion.interval};
    if (k == 0) mesh_torque = load.begin(segment);
    out.load[k] = load.q;
    out.load_rate[k] = load.w;
    out.mesh_torque[k] = mesh_torque;
    if (!(std::fabs(load.w) < kFarthest))
      throw IntegrationError("the load runs away at t = " + std::to_string(segment.start) + " s");
    if (j == k) break;
    Halves half;
    mesh_torque = load.step(segment, half);
    out.mesh_on_motor[k] += k == 0 ? 2 * half.early : half.early;
    out.mesh_on_motor[j] += j + 1 == n ? 2 * half.late : half.late;
  }
  return out;
}

/// A rig reduced to what acts on its load. What is taken away here is all that does not: a new member of Rig
/// counts until it is named.
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

}  // namespace

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

MotorTorques motor_torques(const model::Rig& rig, const RecordedMotion& motion, const DrivenLoad& load) {
  const model::GearTrain train(rig);
  const std::size_t n = motion.motor->size();
  const bool plain = rig.terms.empty() && !rig.mesh.rigid;  // dampers and friction that does not change
  const model::FrictionLimits friction = train.motor_forces({}).friction;
  const auto of_dampers = [&](const model::Motion& m) {
    double net[kParts];
    train.equations().net_torques(
        kFollowing, ends(m), 0, 0, [](double*) {}, net);
    return net[kFollowing.node[model::TrainParts::kMotor]];
  };
  MotorTorques out{load.mesh_on_motor, std::vector<model::FrictionLimits>(n), load.mesh_torque};
  for (std::size_t k = 0; k < n; ++k) {
    model::Motion m{double(k) * motion.interval, (*motion.motor)[k], (*motion.motor_rate)[k], load.load[k],
                    load.load_rate[k],           load.mesh_torque[k]};
    if (rig.mesh.rigid)
      out.mesh_torque[k] = m.mesh_torque =
          train.torque_of_load(m, motion.acceleration ? (*motion.acceleration)[k] : 0);
    const model::GearTrain::MotorForces forces =
        plain ? model::GearTrain::MotorForces{of_dampers(m), friction} : train.motor_forces(m);
    // The triangular weights of two intervals, by Simpson's rule for what is smooth.
    out.mean[k] += 10.0 / 12 * forces.net;
    out.mean[k == 0 ? 0 : k - 1] += forces.net / 12;
    out.mean[k + 1 == n ? k : k + 1] += forces.net / 12;
    out.friction[k] = forces.friction;
  }
  return out;
}

}  // namespace backlash::simulation
