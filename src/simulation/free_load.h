// SPDX-License-Identifier: BSD-3-Clause
// A load that follows the motor of a record through teeth, sample by sample (driven_load.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/stick_slip.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "lanes.h"
// Beyond the lanes.
#include "driven_step.h"
#include "geared_shaft.h"

namespace backlash::simulation {

constexpr double kFarthest = 1e3;  // rad/s, beyond which the load has run away

BACKLASH_LANES Segment segment_after(const RecordedMotion& motion, std::size_t k) {
  const auto &q = *motion.motor, &w = *motion.motor_rate;
  const std::size_t j = std::min(k + 1, q.size() - 1);
  return {{q[k], q[j], motion.interval * w[k], motion.interval * w[j]},
          motion.load_rate ? between(*motion.load_rate, k) : Cubic{0, 0, 0, 0},
          motion.start + double(k) * motion.interval,
          motion.interval};
}

inline DrivenLoad columns(std::size_t samples) {
  DrivenLoad out;
  for (auto* column : {&out.load, &out.load_rate, &out.mesh_torque, &out.mesh_on_motor})
    column->resize(samples);
  return out;
}

[[noreturn]] inline void run_away(double time) {
  throw IntegrationError("the load runs away at t = " + std::to_string(time) + " s");
}

class FreeLoad {
 public:
  FreeLoad(const model::Rig& rig, double feedback)
      : train_(load_as_one(rig)),
        inertia_(train_.load_inertia()),
        feedback_(feedback),
        behind_shaft_(!rig.output_coupling.rigid),
        rubs_(train_.friction_event_count() > 0 && !behind_shaft_),
        shaped_(train_.flanks_shift_with_position()),
        plain_(train_.plain_load()) {
    geared_.shaft.stiffness = behind_shaft_ ? rig.output_coupling.stiffness : 0;
    if (!plain_) return;
    const model::PowerContact law = *train_.power_contact();
    geared_.plain = {train_.equations(),
                     {law.exponent, law.stiffness, law.loss, law.damping, 0.5 * train_.backlash()},
                     inertia_,
                     inertia_ * feedback_};
    const model::FrictionLimits friction = train_.load_forces({}).friction;
    geared_.forward = friction.forward;
    geared_.backward = friction.backward;
    if (!behind_shaft_) friction_ = friction;
  }

  double q = 0, w = 0;

  /// rad: what an encoder shows.
  double shown() const { return behind_shaft_ ? last_.gear.position : q; }

  double begin(const Segment& s) {
    last_.gear.position = q;
    last_ = forces(s.at(0), q, w, last_);
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
  bool joins(const FreeLoad& other) const {
    return plain_ && behind_shaft_ == other.behind_shaft_ && !(friction_.presliding > 0) &&
           geared_.plain.teeth.exponent == other.geared_.plain.teeth.exponent;
  }
  const GearedLoad<double>& plain_load() const { return geared_; }
  bool behind_shaft() const { return behind_shaft_; }
  bool stuck() const { return mode_.stuck(); }
  int stops_against() const { return rubs_ ? mode_.direction() : 0; }
  double friction() const { return mode_.torque(friction_); }
  GearedLoad<double>::Forces last() const { return {{last_.net, last_.mesh_torque}, last_.gear}; }
  /// Goes on from where it has slid to beside others.
  void slid_to(double position, double rate, const GearedLoad<double>::Forces& f) {
    q = position;
    w = rate;
    last_ = of_plain(f, position, rate);
    flanks_.reset();
  }

 private:
  static constexpr int kMostPieces = 30;
  static constexpr int kHalvings = 10;  // of a sample, that place an event
  using Flanks = std::optional<model::GearTrain::Flanks>;
  struct Forces : model::GearTrain::LoadForces {  // net with what draws the load
    double position, rate;                        // rad, rad/s, of the load
    Gear<double> gear;
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

  Forces of_plain(const GearedLoad<double>::Forces& f, double position, double rate) const {
    return {{f.net, f.mesh_torque, -f.mesh_torque, friction_}, position, rate, f.gear};
  }

  /// `before`: those of a moment before. `flanks`: where they are at nearly this position, if known.
  Forces forces(const Moment& m, double position, double rate, const Forces& before,
                const Flanks& flanks = {}) const {
    if (!plain_)
      return behind_shaft_ ? through_gear(m, position, rate, before, flanks)
                           : Forces{acting(m, position, rate, flanks), position, rate, {}};
    if (!behind_shaft_) return of_plain({geared_.plain.forces(m, position, rate), {}}, position, rate);
    const GearedLoad<double>::Forces from{{before.net, before.mesh_torque}, before.gear};
    return of_plain(geared_.forces(m, position, rate, from), position, rate);
  }

  Forces through_gear(const Moment& m, double position, double rate, const Forces& before,
                      const Flanks& flanks) const {
    const double gear_rate = geared_.shaft.rate(before.gear, before.mesh_torque, m.motor_rate, rate);
    model::GearTrain::LoadForces f;
    const Gear<double> gear = geared_.shaft.follow(before.gear, position, [&](double at) {
      f = acting(m, at, gear_rate, flanks);
      return OnGear<double>{f.mesh_torque, f.friction.forward, f.friction.backward};
    });
    f.net += geared_.shaft.stiffness * (gear.position - position) - f.mesh_torque;
    f.friction = {};
    return {f, position, rate, gear};
  }

  /// With the gear at this position.
  model::GearTrain::LoadForces acting(const Moment& m, double gear, double rate, const Flanks& flanks) const {
    const model::Motion motion{m.time, m.motor, m.motor_rate, gear, rate, 0};
    model::GearTrain::LoadForces f =
        flanks ? train_.load_forces(motion, *flanks) : train_.load_forces(motion);
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
      if (stage == 2) return acceleration(forces(end, position, rate, stages[1], beyond));
      stages[stage] = forces(middle, position, rate, f, halfway);
      return acceleration(stages[stage]);
    };
    double to_q = q, to_w = w;
    runge_kutta(h, acceleration(f), at_stage, to_q, to_w);
    // Halfway the first estimate of the position lags by h^2 a / 8, the second leads by as much.
    return {to_q,
            to_w,
            stages[1].side(),
            0.5 * (stages[0].mesh_on_motor + stages[1].mesh_on_motor),
            forces(end, to_q, to_w, stages[1], beyond),
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
    const auto at = [&](double v) { return forces(s.at(v), q, 0, f); };
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
    const bool sticks = rubs_ && !(from.friction.presliding > 0);
    if (sticks && mode_.direction() * w <= 0) w = 0;
    f = forces(s.at(after), q, w, from);
    if (rubs_ || mode_.stuck()) mode_.update(f.net, w, f.friction, q);
    const double mean = 0.5 * (from.mesh_on_motor + f.mesh_on_motor);
    sum.add(before, after, mean, mean, mean);
  }

  /// Gear and link as one body.
  static model::Rig load_as_one(model::Rig rig) {
    rig.output_coupling.rigid = true;
    return rig;
  }

  model::GearTrain train_;
  double inertia_, feedback_;
  bool behind_shaft_, rubs_, shaped_, plain_;
  GearedLoad<double> geared_{};     // beside its shaft that of a plain load
  model::FrictionLimits friction_;  // of a plain load on the gear
  model::StickSlip mode_;
  Forces last_{};  // at the end of the sample before
  Flanks flanks_;  // there, if known
};

}  // namespace backlash::simulation
