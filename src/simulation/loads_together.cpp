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
  explicit LoadsTogether(std::vector<FreeLoad>& loads) : loads_(loads) {
    for (int i = 0; i < kCount; ++i) {
      const PlainLoad<double>& one = load_of(i).plain_forces();
      take_lane(plain_.train, i, one.train);
      take_lane(plain_.teeth, i, one.teeth);
      set_lane(plain_.inertia, i, one.inertia);
      set_lane(plain_.drawn, i, one.drawn);
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

  Real q = {}, w = {}, mesh_torque = {};  // of each, now

 private:
  static constexpr int kCount = kLanesOf<Real>;

  FreeLoad& load_of(int i) { return loads_[std::min(std::size_t(i), loads_.size() - 1)]; }

  void take_state(int i) {
    const FreeLoad& load = load_of(i);
    set_lane(q, i, load.q);
    set_lane(w, i, load.w);
    set_lane(net_, i, load.last().net);
    set_lane(mesh_torque, i, load.last().mesh_torque);
    set_lane(friction_, i, load.friction());
    set_lane(stops_against_, i, load.stops_against());
    set_lane(slides_, i, load.stuck() ? 0 : 1);
  }

  void step_alone(int i, const Segment& s, Halves<Real>& sum) {
    FreeLoad& load = load_of(i);
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

  /// FreeLoad::slide() over the whole sample. 1 for those that have moved, 0 where something happens within
  /// it.
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

  std::vector<FreeLoad>& loads_;
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
BACKLASH_LANES void follow_together(std::vector<FreeLoad>& loads, const RecordedMotion& motion,
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
