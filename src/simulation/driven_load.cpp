#include "backlash_diagnosis/simulation/driven_load.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/stick_slip.h"

namespace backlash {
namespace {

constexpr double kFarthest = 1e3;  // rad/s, beyond which the load has run away

/// A sampled signal between two of its samples, u = 0 .. 1: cubic with the slopes [per sample] at its ends.
struct Cubic {
  double y0, y1, d0, d1;

  double operator()(double u) const {
    const double s = 1 - u;
    return s * s * ((1 + 2 * u) * y0 + u * d0) + u * u * ((3 - 2 * u) * y1 - s * d1);
  }
};

/// After sample k, with slopes from the samples beside it (Catmull and Rom): a straight line would lose 0.03 %
/// of a speed at a hundredth of the sampling rate, which next to the feedback is no longer small.
Cubic between(const std::vector<double>& y, std::size_t k) {
  const std::size_t last = y.size() - 1, j = std::min(k + 1, last);
  const auto slope = [&](std::size_t i) {
    return i == 0 || i == last ? y[j] - y[k] : 0.5 * (y[i + 1] - y[i - 1]);
  };
  return {y[k], y[j], slope(k), slope(j)};
}

/// Motion within one sample.
struct Segment {
  Cubic motor, motor_rate, load_rate;
  double motor_torque;
  double interval;
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

class Load {
 public:
  Load(const Rig& rig, double feedback)
      : train_(rig),
        ratio_(rig.motor_axis_ratio()),
        inertia_(train_.load_inertia()),
        feedback_(feedback),
        rubs_(train_.friction_event_count() > 0) {}

  double q = 0, w = 0;

  GearTrain::EndForces begin(const Segment& s, double t) {
    const Forces f = forces(s, t, 0, q, w);
    mode_.begin(f.net, w, f.ends.friction.load, q);
    return f.ends;
  }

  /// One sample, in pieces that end where the load comes to rest or breaks away and where teeth touch or
  /// part. `sum` gathers the torque on the motor; returns the forces at the end.
  GearTrain::EndForces step(const Segment& s, double t, Halves& sum) {
    double u = 0;
    Forces f = forces(s, t, 0, q, w);
    for (int piece = 0; u < 1; ++piece) {
      const bool divide = piece < kMostPieces;
      u = mode_.stuck() ? hold(s, t, u, f, divide, sum) : slide(s, t, u, f, divide, sum);
    }
    return f.ends;
  }

 private:
  static constexpr int kMostPieces = 30;
  static constexpr int kHalvings = 10;  // of a sample, that place an event
  struct Forces {
    GearTrain::EndForces ends;
    double net;       // N m on the load, without dry friction
    double position;  // rad, of the load
    int side() const { return (ends.mesh_torque > 0) - (ends.mesh_torque < 0); }
  };
  struct Move {
    double q, w;
    int side;            // that touches halfway
    double motor_torque;  // halfway
  };

  bool holds(const Forces& f) const {
    const FrictionLimits& friction = f.ends.friction.load;
    if (friction.presliding > 0) return mode_.event(f.net, 0, friction) < 0;
    return f.net < friction.forward && -f.net < friction.backward;
  }

  Forces forces(const Segment& s, double t, double u, double position, double rate) const {
    const double state[] = {s.motor(u), position, s.motor_rate(u), rate};
    Forces f;
    f.ends = train_.end_forces(t + u * s.interval, state, s.motor_torque / ratio_);
    f.ends.motor -= s.motor_torque;
    f.net = f.ends.load + inertia_ * feedback_ * (s.load_rate(u) - rate);
    f.position = position;
    return f;
  }

  double acceleration(const Forces& f) const {
    return (f.net + mode_.torque(f.ends.friction.load, f.position)) / inertia_;
  }

  /// Classical Runge-Kutta from u to v.
  Move moved(const Segment& s, double t, double u, double v, const Forces& f) const {
    const double h = (v - u) * s.interval, m = 0.5 * (u + v);
    const double a1 = acceleration(f);
    const double w2 = w + 0.5 * h * a1;
    const Forces early = forces(s, t, m, q + 0.5 * h * w, w2);
    const double a2 = acceleration(early), w3 = w + 0.5 * h * a2;
    const Forces late = forces(s, t, m, q + 0.5 * h * w2, w3);
    const double a3 = acceleration(late), w4 = w + h * a3;
    const double a4 = acceleration(forces(s, t, v, q + h * w3, w4));
    // Halfway the first estimate of the position lags by h^2 a / 8, the second leads by as much.
    return {q + h / 6 * (w + 2 * w2 + 2 * w3 + w4), w + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4), late.side(),
            0.5 * (early.ends.motor + late.ends.motor)};
  }

  /// The first change between u and v, known to lie there: last moment before and first after it.
  template <typename Changed>
  static std::pair<double, double> bracket(double u, double v, const Changed& changed) {
    double before = u, after = v;
    for (int i = 0; i < kHalvings; ++i) (changed(0.5 * (before + after)) ? after : before) = 0.5 * (before + after);
    return {before, after};
  }

  double slide(const Segment& s, double t, double u, Forces& f, bool divide, Halves& sum) {
    const auto changes = [&](const Move& to, const Forces& end) {
      return end.side() != f.side() || (rubs_ && mode_.direction() * to.w < 0);
    };
    double v = 1;
    Move to = moved(s, t, u, v, f);
    Forces end = forces(s, t, v, to.q, to.w);
    if (divide && to.side != f.side() && !changes(to, end)) {  // touched and left within
      v = 0.5 * (u + v);
      to = moved(s, t, u, v, f);
      end = forces(s, t, v, to.q, to.w);
    }
    if (!divide || !changes(to, end)) {
      sum.add(u, v, f.ends.motor, to.motor_torque, end.ends.motor);
      q = to.q;
      w = to.w;
      f = end;
      return v;
    }
    const auto [before, after] = bracket(u, v, [&](double at) {
      const Move there = moved(s, t, u, at, f);
      return changes(there, forces(s, t, at, there.q, there.w));
    });
    to = moved(s, t, u, before, f);
    end = forces(s, t, before, to.q, to.w);
    sum.add(u, before, f.ends.motor, to.motor_torque, end.ends.motor);
    const double h = (after - before) * s.interval;
    q = to.q + h * to.w;
    w = to.w + h * acceleration(end);
    cross(s, t, before, after, end, f, sum);
    return after;
  }

  double hold(const Segment& s, double t, double u, Forces& f, bool divide, Halves& sum) {
    const auto at = [&](double v) { return forces(s, t, v, q, 0); };
    const auto changes = [&](const Forces& end) { return end.side() != f.side() || !holds(end); };
    double before = 1, after = 1;
    if (divide && changes(at(1))) std::tie(before, after) = bracket(u, 1, [&](double v) { return changes(at(v)); });
    const Forces end = at(before);
    sum.add(u, before, f.ends.motor, at(0.5 * (u + before)).ends.motor, end.ends.motor);
    if (before == after)
      f = end;
    else
      cross(s, t, before, after, end, f, sum);
    return after;
  }

  /// The moment of the change itself.
  void cross(const Segment& s, double t, double before, double after, const Forces& from, Forces& f, Halves& sum) {
    const bool sticks = !(from.ends.friction.load.presliding > 0);
    if (sticks && mode_.direction() * w <= 0) w = 0;
    f = forces(s, t, after, q, w);
    mode_.update(f.net, w, f.ends.friction.load, q);
    const double mean = 0.5 * (from.ends.motor + f.ends.motor);
    sum.add(before, after, mean, mean, mean);
  }

  GearTrain train_;
  double ratio_;
  double inertia_, feedback_;
  bool rubs_;
  StickSlip mode_;
};

/// A load that stands or moves with the motor: torques at either end of a sample and halfway.
class FixedLoad {
 public:
  explicit FixedLoad(const Rig& rig) : train_(rig), ratio_(rig.motor_axis_ratio()), rigid_(rig.mesh.rigid) {}

  double q = 0, w = 0;

  GearTrain::EndForces begin(const Segment& s, double t) {
    follow(s, 0);
    return forces(s, t, 0);
  }

  GearTrain::EndForces step(const Segment& s, double t, Halves& sum) {
    const GearTrain::EndForces end = forces(s, t, 1);
    sum.add(0, 1, forces(s, t, 0).motor, forces(s, t, 0.5).motor, end.motor);
    follow(s, 1);
    return end;
  }

 private:
  void follow(const Segment& s, double u) {
    if (!rigid_) return;
    q = s.motor(u);
    w = s.motor_rate(u);
  }

  GearTrain::EndForces forces(const Segment& s, double t, double u) const {
    const double state[] = {s.motor(u), s.motor_rate(u)};
    GearTrain::EndForces f = train_.end_forces(t + u * s.interval, state, s.motor_torque / ratio_);
    f.motor -= s.motor_torque;
    if (!rigid_) return f;
    f.friction.motor.forward += f.friction.load.forward;
    f.friction.motor.backward += f.friction.load.backward;
    return f;
  }

  GearTrain train_;
  double ratio_;
  bool rigid_;
};

void check(const Rig& rig) {
  if (!rig.input_coupling.rigid || !rig.output_coupling.rigid)
    throw InvalidParameter("coupling", "flexible", "a load that follows the recorded motor needs rigid couplings");
  if (!rig.mesh.rigid && rig.mesh.contact->needs_impact_speed())
    throw InvalidParameter("contact.law", "with touches",
                           "a load that follows the recorded motor needs a law without impact speed");
}

/// Every sample in turn; `Body` is what the load does within one.
template <typename Body>
DrivenLoad follow(Body& load, const RecordedMotion& motion) {
  const std::size_t n = motion.motor->size();
  DrivenLoad out;
  for (auto* column : {&out.load, &out.load_rate, &out.mesh_torque, &out.motor_net, &out.motor_mean})
    column->resize(n);
  out.motor_friction.resize(n);
  const auto& q = *motion.motor;
  const auto& w = *motion.motor_rate;
  GearTrain::EndForces f{};
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t j = std::min(k + 1, n - 1);
    const Segment segment{{q[k], q[j], motion.interval * w[k], motion.interval * w[j]},
                          between(w, k),
                          motion.load_rate ? between(*motion.load_rate, k) : Cubic{0, 0, 0, 0},
                          motion.motor_torque ? (*motion.motor_torque)[k] : 0,
                          motion.interval};
    const double t = k * motion.interval;
    if (k == 0) f = load.begin(segment, t);
    out.load[k] = load.q;
    out.load_rate[k] = load.w;
    out.mesh_torque[k] = f.mesh_torque;
    out.motor_net[k] = f.motor;
    out.motor_friction[k] = f.friction.motor;
    if (!(std::fabs(load.w) < kFarthest))
      throw IntegrationError("the load runs away at t = " + std::to_string(t) + " s");
    if (j == k) break;
    Halves half;
    f = load.step(segment, t, half);
    out.motor_mean[k] += k == 0 ? 2 * half.early : half.early;
    out.motor_mean[j] += j + 1 == n ? 2 * half.late : half.late;
  }
  return out;
}

}  // namespace

bool load_moves_freely(const Rig& rig) {
  return !rig.mesh.rigid && !rig.link_locked;
}

DrivenLoad simulate_driven_load(const Rig& rig, const RecordedMotion& motion, double feedback) {
  check(rig);
  if (!load_moves_freely(rig)) {
    FixedLoad load(rig);
    return follow(load, motion);
  }
  Load load(rig, motion.load_rate ? feedback : 0);
  load.q = motion.first_load;
  load.w = motion.first_load_rate;
  return follow(load, motion);
}

}  // namespace backlash
