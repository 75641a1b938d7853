// SPDX-License-Identifier: BSD-3-Clause
#include "loads_together.h"

#include <algorithm>
#include <cmath>

#include "lane_group.h"
#include "lanes.h"
// Beyond the lanes.
#include "driven_step.h"
#include "take_lane.h"

namespace backlash::simulation {
namespace {

/// Plain loads side by side, number by number as each alone: samples in which a load just slides are done for
/// all at once, others by itself. Lanes without a load do what the last load does.
template <typename Real>
class alignas(sizeof(Real)) LoadsTogether {
 public:
  explicit LoadsTogether(std::vector<FreeLoad>& loads)
      : loads_(loads), behind_shaft_(loads.front().behind_shaft()) {
    for (int i = 0; i < kCount; ++i) {
      const GearedLoad<double>& one = load_of(i).plain_load();
      take_lane(geared_.plain.train, i, one.plain.train);
      take_lane(geared_.plain.teeth, i, one.plain.teeth);
      set_lane(geared_.plain.inertia, i, one.plain.inertia);
      set_lane(geared_.plain.drawn, i, one.plain.drawn);
      set_lane(geared_.shaft.stiffness, i, one.shaft.stiffness);
      set_lane(geared_.forward, i, one.forward);
      set_lane(geared_.backward, i, one.backward);
    }
  }

  void begin(const Segment& s) {
    for (FreeLoad& load : loads_) load.begin(s);
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

  Real q = {}, w = {};  // of each, now
  const Real& mesh_torque() const { return now_.mesh_torque; }
  BACKLASH_LANES Real shown() const { return behind_shaft_ ? now_.gear.position : q; }

 private:
  static constexpr int kCount = kLanesOf<Real>;
  using Forces = typename GearedLoad<Real>::Forces;

  FreeLoad& load_of(int i) { return loads_[std::min(std::size_t(i), loads_.size() - 1)]; }

  void take_state(int i) {
    const FreeLoad& load = load_of(i);
    const GearedLoad<double>::Forces last = load.last();
    set_lane(q, i, load.q);
    set_lane(w, i, load.w);
    set_lane(now_.net, i, last.net);
    set_lane(now_.mesh_torque, i, last.mesh_torque);
    set_lane(now_.gear.position, i, last.gear.position);
    set_lane(now_.gear.slides, i, last.gear.slides);
    set_lane(now_.gear.slope, i, last.gear.slope);
    set_lane(friction_, i, load.friction());
    set_lane(stops_against_, i, load.stops_against());
    set_lane(slides_, i, load.stuck() ? 0 : 1);
  }

  void step_alone(int i, const Segment& s, Halves<Real>& sum) {
    FreeLoad& load = load_of(i);
    const Gear<double> gear = {lane(now_.gear.position, i), lane(now_.gear.slides, i),
                               lane(now_.gear.slope, i)};
    load.slid_to(lane(q, i), lane(w, i), {{lane(now_.net, i), lane(now_.mesh_torque, i)}, gear});
    Halves<double> own;
    load.step(s, own);
    set_lane(sum.early, i, own.early);
    set_lane(sum.late, i, own.late);
  }

  static BACKLASH_LANES Real side(const Real& torque) {
    const Real none = {};
    return torque > none ? none + 1 : torque < none ? none - 1 : none;
  }

  BACKLASH_LANES Forces forces(const Moment& m, const Real& position, const Real& rate,
                               const Forces& before) const {
    if (behind_shaft_) return geared_.forces(m, position, rate, before);
    return {geared_.plain.forces(m, position, rate), {}};
  }

  /// FreeLoad::slide() over the whole sample. 1 for those that have moved, 0 where something happens within
  /// it.
  BACKLASH_LANES Real slide(const Segment& s, Halves<Real>& sum) {
    const Moment middle = s.at(0.5), end = s.at(1);
    Forces stages[2];
    const auto acceleration = [&](const Forces& f) __attribute__((always_inline)) {
      return (f.net + friction_) / geared_.plain.inertia;
    };
    const auto at_stage = [&](int stage, const Real& position, const Real& rate)
        __attribute__((always_inline)) {
      if (stage == 2) return acceleration(forces(end, position, rate, stages[1]));
      stages[stage] = forces(middle, position, rate, now_);
      return acceleration(stages[stage]);
    };
    Real to_q = q, to_w = w;
    runge_kutta(s.interval, acceleration(now_), at_stage, to_q, to_w);
    const Forces last = forces(end, to_q, to_w, stages[1]);
    const Real none = {}, before = side(now_.mesh_torque);
    Real slid = stops_against_ * to_w < none ? none : slides_;
    slid = side(stages[1].mesh_torque) == before ? slid : none;
    slid = side(last.mesh_torque) == before ? slid : none;
    const Real halfway = -0.5 * (stages[0].mesh_torque + stages[1].mesh_torque);
    sum.add(0, 1, -now_.mesh_torque, halfway, -last.mesh_torque);
    const auto moves = [&](Real & from, const Real& to) __attribute__((always_inline)) {
      from = slid > none ? to : from;
    };
    moves(q, to_q);
    moves(w, to_w);
    moves(now_.net, last.net);
    moves(now_.mesh_torque, last.mesh_torque);
    if (!behind_shaft_) return slid;
    moves(now_.gear.position, last.gear.position);
    moves(now_.gear.slides, last.gear.slides);
    moves(now_.gear.slope, last.gear.slope);
    return slid;
  }

  std::vector<FreeLoad>& loads_;
  bool behind_shaft_;
  GearedLoad<Real> geared_ = {};
  Forces now_ = {};                        // N m, while it slides beside friction
  Real friction_ = {};                     // N m
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
BACKLASH_LANES void follow_together(std::vector<FreeLoad>& loads, const RecordedMotion& motion,
                                    std::vector<DrivenLoad>& out) {
  const std::size_t n = motion.motor->size();
  LoadsTogether<Real> together(loads);
  Halves<Real> before;
  for (std::size_t k = 0; k < n; ++k) {
    const Segment segment = segment_after(motion, k);
    if (k == 0) together.begin(segment);
    if (any_far(together.w)) run_away(segment.start);
    const Real q = together.shown(), w = together.w, mesh_torque = together.mesh_torque();
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
__attribute__((target("avx512f"))) void follow_avx512(std::vector<FreeLoad>& loads,
                                                      const RecordedMotion& motion,
                                                      std::vector<DrivenLoad>& out) {
  follow_together<Lanes8>(loads, motion, out);
}

__attribute__((target("avx2"))) void follow_avx2(std::vector<FreeLoad>& loads, const RecordedMotion& motion,
                                                 std::vector<DrivenLoad>& out) {
  follow_together<Lanes4>(loads, motion, out);
}
#endif

}  // namespace

void follow_all(std::vector<FreeLoad>& loads, const RecordedMotion& motion, std::vector<DrivenLoad>& out) {
#if defined(__x86_64__)
  if (loads_at_once() == 8) return follow_avx512(loads, motion, out);
  if (loads_at_once() == 4) return follow_avx2(loads, motion, out);
#endif
  follow_together<Lanes2>(loads, motion, out);
}

}  // namespace backlash::simulation
