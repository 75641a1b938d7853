#include "backlash_diagnosis/simulation/driven_load.h"

#include <cmath>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/stick_slip.h"

namespace backlash {
namespace {

constexpr double kFarthest = 1e3;  // rad/s, beyond which the load has run away

/// Motion within one sample, u = 0 .. 1.
struct Segment {
  double q0, w0, q1, w1, v0, v1, interval;

  double motor(double u) const {  // cubic Hermite
    const double s = 1 - u;
    return s * s * ((1 + 2 * u) * q0 + u * interval * w0) + u * u * ((3 - 2 * u) * q1 - s * interval * w1);
  }
  double motor_rate(double u) const { return (1 - u) * w0 + u * w1; }
  double load_rate(double u) const { return (1 - u) * v0 + u * v1; }
};

class Load {
 public:
  Load(const Rig& rig, double feedback) : train_(rig), inertia_(train_.load_inertia()), feedback_(feedback) {}

  double q = 0, w = 0;

  void begin(const Segment& s, double t) {
    const Forces f = forces(s, t, 0, q, w);
    mode_.begin(f.net, w, f.limits);
  }

  /// One sample, in pieces where the load comes to rest or breaks away.
  void step(const Segment& s, double t) {
    double u = 0;
    for (int piece = 0; u < 1 && piece < kMostPieces; ++piece) {
      if (mode_.stuck()) {
        const Forces f = forces(s, t, 1, q, 0);
        if (f.net < f.limits.forward && -f.net < f.limits.backward) return;  // holds to the end of the sample
        w = 0;
        mode_.begin(f.net, w, f.limits);  // breaks away, to within a sample
      }
      u = slide(s, t, u);
    }
  }

  GearTrain::EndForces observe(const Segment& s, double t, double u) const {
    const double state[] = {s.motor(u), q, s.motor_rate(u), w};
    return train_.end_forces(t, state, 0);
  }

 private:
  static constexpr int kMostPieces = 8;
  struct Forces {
    double net;
    FrictionLimits limits;
  };

  Forces forces(const Segment& s, double t, double u, double position, double rate) const {
    const double state[] = {s.motor(u), position, s.motor_rate(u), rate};
    const GearTrain::EndForces f = train_.end_forces(t + u * s.interval, state, 0);
    return {f.load + inertia_ * feedback_ * (s.load_rate(u) - rate), f.friction.load};
  }

  double acceleration(const Segment& s, double t, double u, double position, double rate) const {
    const Forces f = forces(s, t, u, position, rate);
    return (f.net + mode_.torque(f.limits)) / inertia_;
  }

  /// From u to the end of the sample, or to where the load comes to rest; returns where.
  double slide(const Segment& s, double t, double u) {
    const double h = (1 - u) * s.interval, v = 0.5 * (u + 1);
    const double a1 = acceleration(s, t, u, q, w);
    const double w2 = w + 0.5 * h * a1, a2 = acceleration(s, t, v, q + 0.5 * h * w, w2);
    const double w3 = w + 0.5 * h * a2, a3 = acceleration(s, t, v, q + 0.5 * h * w2, w3);
    const double w4 = w + h * a3, a4 = acceleration(s, t, 1, q + h * w3, w4);
    const double rate = w + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    const bool stops = mode_.direction() * rate < 0 && train_.friction_event_count() > 0;
    if (!stops) {
      q += h / 6 * (w + 2 * w2 + 2 * w3 + w4);
      w = rate;
      return 1;
    }
    const double share = w / (w - rate);  // of the rest of the sample until it stands, speed linear
    q += 0.5 * w * share * h;
    w = 0;
    const double at = u + share * (1 - u);
    const Forces f = forces(s, t, at, q, 0);
    mode_.begin(f.net, w, f.limits);
    return at;
  }

  GearTrain train_;
  double inertia_, feedback_;
  StickSlip mode_;
};

void check(const Rig& rig) {
  const auto refuse = [](const char* name, const char* value, const char* why) {
    throw InvalidParameter(name, value, why);
  };
  if (!rig.input_coupling.rigid || !rig.output_coupling.rigid)
    refuse("coupling", "flexible", "a load that follows the recorded motor needs rigid couplings");
  if (rig.link_locked) refuse("link", "locked", "cannot follow the motor");
  if (rig.mesh.rigid) refuse("mesh", "rigid", "leaves no motion of the load of its own");
  if (rig.mesh.contact->needs_impact_speed())
    refuse("contact.law", "with touches",
           "a load that follows the recorded motor needs a law without impact speed");
}

}  // namespace

DrivenLoad simulate_driven_load(const Rig& rig, const RecordedMotion& motion, double feedback) {
  check(rig);
  const std::size_t n = motion.motor->size();
  DrivenLoad out;
  for (auto* column : {&out.load, &out.load_rate, &out.mesh_torque, &out.motor_net})
    column->resize(n);
  out.motor_friction.resize(n);
  Load load(rig, motion.load_rate ? feedback : 0);
  load.q = motion.first_load;
  load.w = motion.first_load_rate;
  const auto& q = *motion.motor;
  const auto& w = *motion.motor_rate;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t j = k + 1 < n ? k + 1 : k;
    const double v0 = motion.load_rate ? (*motion.load_rate)[k] : 0,
                 v1 = motion.load_rate ? (*motion.load_rate)[j] : 0;
    const Segment segment{q[k], w[k], q[j], w[j], v0, v1, motion.interval};
    const double t = k * motion.interval;
    if (k == 0) load.begin(segment, t);
    out.load[k] = load.q;
    out.load_rate[k] = load.w;
    const GearTrain::EndForces f = load.observe(segment, t, 0);
    out.mesh_torque[k] = f.mesh_torque;
    out.motor_net[k] = f.motor;
    out.motor_friction[k] = f.friction.motor;
    if (!(std::fabs(load.w) < kFarthest))
      throw IntegrationError("the load runs away at t = " + std::to_string(t) + " s");
    load.step(segment, t);
  }
  return out;
}

}  // namespace backlash
