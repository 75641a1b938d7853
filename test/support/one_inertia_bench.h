// SPDX-License-Identifier: BSD-3-Clause
// A machine of one inertia whose torque is written down, and what the steps of the search for missing effects
// need to look at it:
//   torque = J a + F sign(w) + c w + extra(q, w) + noise
#pragma once

#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/record/record.h"
#include "identification/effects/hypothesis.h"

namespace backlash::test {

struct OneInertiaMachine {
  double inertia = 2, coulomb = 3, viscous = 1.5;  // kg m^2, N m, N m s/rad
  std::function<double(double q, double w)> extra = [](double, double) { return 0.0; };  // N m
  double noise = 0.05;                                                                   // N m
  double weight = 0, loss = 0, rotor = 0;  // N m; - of what the load takes; - of the inertia, that is no load
};

/// 20 s at 100 Hz of two sines, from about -1.4 to 1.4 rad.
inline record::Record record_of(const OneInertiaMachine& m, std::uint64_t seed = 1) {
  constexpr double kFirst = 2 * M_PI * 0.17, kSecond = 2 * M_PI * 0.43;  // rad/s
  Random random(seed);
  record::Record record;
  record.name = "one inertia";
  for (int k = 0; k < 2000; ++k) {
    const double t = 0.01 * k;
    const double q = std::sin(kFirst * t) + 0.4 * std::sin(kSecond * t + 1);
    const double w = kFirst * std::cos(kFirst * t) + 0.4 * kSecond * std::cos(kSecond * t + 1);
    const double a =
        -kFirst * kFirst * std::sin(kFirst * t) - 0.4 * kSecond * kSecond * std::sin(kSecond * t + 1);
    const double weight = m.weight * std::sin(q), load = (1 - m.rotor) * m.inertia * a + weight;
    const double friction = (m.coulomb + m.loss * std::fabs(load)) * (w > 0 ? 1 : -1) + m.viscous * w;
    record.time.push_back(t);
    record.column(record::Channel::motor_position).push_back(q);
    record.column(record::Channel::motor_torque)
        .push_back(m.inertia * a + weight + friction + m.extra(q, w) + m.noise * random.normal());
  }
  return record;
}

/// As somebody would declare it, a fifth off.
inline model::Rig one_inertia_rig() {
  model::Rig rig;
  rig.mesh.rigid = true;
  rig.motor.inertia = 2.4;
  rig.motor.coulomb_friction = 2.4;
  rig.motor.viscous_damping = 1.8;
  return rig;
}

/// Records and settings of a search, whose steps refer to it.
struct SearchBench {
  std::vector<identification::ServoData> data;
  identification::SearchContext context;

  SearchBench(const model::Rig& rig, const std::vector<record::Record>& records)
      : data(data_of(rig, records)),
        context{data,
                data.front(),
                identification::motion_range(data),
                identification::SearchSettings(),
                [](const std::string&) {},
                [](const identification::Hypothesis&) {}} {
    context.settings.fit = identification::with_bands(context.settings.fit, rig, data);
  }
  explicit SearchBench(const OneInertiaMachine& machine)
      : SearchBench(one_inertia_rig(), {record_of(machine)}) {}
  SearchBench(const SearchBench&) = delete;  // refers to itself

 private:
  static std::vector<identification::ServoData> data_of(const model::Rig& rig,
                                                        const std::vector<record::Record>& records) {
    std::vector<identification::ServoData> data;
    for (const record::Record& record : records) data.push_back(identification::servo_data(record, rig));
    return data;
  }
};

/// Torque of a term of cogging: A sin(n q + p).
inline std::function<double(double, double)> cogging_torque(double amplitude, double order, double phase) {
  return [=](double q, double) { return amplitude * std::sin(order * q + phase); };
}

inline identification::Effect cogging_effect(double amplitude, double order, double phase) {
  identification::Effect effect;
  effect.candidate.id = "cogging";
  effect.candidate.terms = {{{"amplitude", amplitude}, {"order", order}, {"phase", phase}}};
  return effect;
}

inline identification::Effect drag_effect(double drag) {
  identification::Effect effect;
  effect.candidate.id = "quadratic_drag";
  effect.candidate.terms = {{{"drag", drag}}};
  effect.candidate.terms.front().set_choice("body", "motor");
  return effect;
}

}  // namespace backlash::test
