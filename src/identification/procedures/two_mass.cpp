// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/two_mass.h"

#include <array>
#include <cmath>
#include <functional>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::identification {
namespace {

using Complex = std::complex<double>;

double frequency_of(double stiffness, double inertia) {
  return std::sqrt(stiffness / inertia) / (2 * M_PI);
}

double stiffness_of(double frequency, double inertia) {
  return std::pow(2 * M_PI * frequency, 2) * inertia;
}

struct Impedances {
  Complex mesh, motor, load;
  Complex divisor() const { return motor * load + mesh * (motor + load); }
};

Impedances impedances(const TwoMass& m, double frequency) {
  const Complex s(0, 2 * M_PI * frequency);
  return {m.damping + m.stiffness / s, m.motor_inertia * s + m.motor_viscous,
          m.load_inertia * s + m.load_viscous};
}

void require_positive(const signal::Measured& m, const char* what) {
  if (!(m.value > 0) || !std::isfinite(m.value))
    throw CannotIdentify(std::string(what) + " = " + to_text(m.value) + ": must be > 0");
}

using Row = std::array<double, 7>;     // in the order of StiffnessSplit
using Inputs = std::array<double, 4>;  // F_R, F_AR, total, motor inertia

Row split(KnownInertia known, const Inputs& in) {
  const double ratio = std::pow(in[0] / in[1], 2);  // (JM + JL) / JM, (5.5)
  double total = in[2], motor = in[3];
  if (known == KnownInertia::total_inertia) motor = total / ratio;
  if (known == KnownInertia::motor_inertia) total = motor * ratio;
  const double load = total - motor, reduced = motor * load / total;
  const double first = stiffness_of(in[1], load), second = stiffness_of(in[0], reduced);
  return {motor, load, reduced, first, second, frequency_of(first, reduced), frequency_of(second, load)};
}

}  // namespace

double TwoMass::resonance() const {
  return frequency_of(stiffness, reduced_inertia());
}

double TwoMass::anti_resonance() const {
  return frequency_of(stiffness, load_inertia);
}

double TwoMass::damping_ratio() const {
  return damping / (2 * std::sqrt(stiffness * reduced_inertia()));
}

Complex TwoMass::motor_response(double frequency) const {
  const Impedances z = impedances(*this, frequency);
  return (z.load + z.mesh) / z.divisor();
}

Complex TwoMass::load_response(double frequency) const {
  const Impedances z = impedances(*this, frequency);
  return z.mesh / z.divisor();
}

StiffnessSplit split_stiffness(KnownInertia known, const Resonances& measured,
                               const signal::Measured& total_inertia, const signal::Measured& motor_inertia) {
  std::array<signal::Measured, 4> given{measured.resonance, measured.anti_resonance, total_inertia,
                                        motor_inertia};
  require_positive(given[0], "resonance");
  require_positive(given[1], "anti-resonance");
  if (!(given[0].value > given[1].value))
    throw CannotIdentify("resonance " + to_text(given[0].value) + " Hz not above the anti-resonance " +
                         to_text(given[1].value) + " Hz");
  if (known == KnownInertia::motor_inertia) given[2] = {};
  if (known == KnownInertia::total_inertia) given[3] = {};
  if (known != KnownInertia::motor_inertia) require_positive(total_inertia, "total inertia");
  if (known != KnownInertia::total_inertia) require_positive(motor_inertia, "motor inertia");
  if (known == KnownInertia::both_inertias && !(total_inertia.value > motor_inertia.value))
    throw CannotIdentify("total inertia " + to_text(total_inertia.value) +
                         " kg m^2 not above the motor inertia " + to_text(motor_inertia.value) + " kg m^2");
  const Inputs at{given[0].value, given[1].value, given[2].value, given[3].value};
  const Row row = split(known, at);
  Row variance{};
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (std::isnan(at[i])) continue;
    const double step = 1e-5 * at[i];
    Inputs more = at, less = at;
    more[i] += step;
    less[i] -= step;
    const Row upper = split(known, more), lower = split(known, less);
    for (std::size_t k = 0; k < row.size(); ++k)
      variance[k] += std::pow((upper[k] - lower[k]) / (2 * step) * given[i].standard_error, 2);
  }
  const auto cell = [&](std::size_t k) { return signal::Measured{row[k], std::sqrt(variance[k])}; };
  return {cell(0), cell(1), cell(2), cell(3), cell(4), cell(5), cell(6)};
}

}  // namespace backlash::identification
